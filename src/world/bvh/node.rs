//! Nodes of eight children, and the items of leaves.

use super::build::{ALONE, Below, Item, LEAF, Split, in_parts};
use crate::math::{Bounds, LaneFloat, Ray, Vec3};
use crate::shape::{BOUNDS_ERROR, Quad, QuadForm, Rare, Sphere, SphereForm};
use crate::world::{FIRST_TRIANGLE, Triangles, pages};

/// Children of a node.
pub const WIDTH: usize = 8;

/// Eight boxes and what is in them: four lines of a processor's cache.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Low x, y and z, then high x, y and z. An absent child has the box of nothing, and is [`Child::ABSENT`].
    pub(super) planes: [[f32; WIDTH]; 6],
    /// The contents of the boxes.
    pub(super) children: [Child; WIDTH],
}

impl Node {
    /// A node of which all children are absent.
    const EMPTY: Node = {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Node { planes: [low, low, low, high, high, high], children: [Child::ABSENT; WIDTH] }
    };

    fn set_box(&mut self, lane: usize, bounds: &Bounds) {
        let Bounds { low: [a, b, c], high: [d, e, f] } = *bounds;
        place(&mut self.planes, lane, [a, b, c, d, e, f]);
    }
}

/// A reference to a node or a leaf, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// The target of a reference: an index among the items of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Node(usize),
    Spheres(usize),
    Quads(usize),
    Triangles(usize),
    /// One thing alone: in the first tree an instance, in the tree of a group a rare shape.
    Lone(usize),
}

impl Child {
    const INDEX_BITS: u32 = 29;
    const SPHERES: u32 = 1;
    const QUADS: u32 = 2;
    const TRIANGLES: u32 = 3;
    const LONE: u32 = 7;

    /// The first block of triangles, which is empty: a ray that is not finite enters the box of nothing, too, and has to
    /// come to an end there.
    const ABSENT: Child = Child(Child::TRIANGLES << Child::INDEX_BITS);

    fn new(tag: u32, index: usize) -> Child {
        assert!(index < 1 << Child::INDEX_BITS, "a tree of {index} nodes");
        Child(tag << Child::INDEX_BITS | index as u32)
    }

    #[inline(always)]
    pub(super) fn target(self) -> Target {
        let index = (self.0 & ((1 << Child::INDEX_BITS) - 1)) as usize;
        match self.0 >> Child::INDEX_BITS {
            0 => Target::Node(index),
            Child::SPHERES => Target::Spheres(index),
            Child::QUADS => Target::Quads(index),
            Child::TRIANGLES => Target::Triangles(index),
            _ => Target::Lone(index),
        }
    }
}

/// The kinds of things, as [`Item::kind`] has them.
pub(super) const SPHERE: u32 = 0;
pub(super) const QUAD: u32 = 1;
pub(super) const TRIANGLE: u32 = 2;
/// What is alone in its leaf: see [`Target::Lone`].
pub(super) const LONE: u32 = ALONE;

/// Eight spheres, one column for each property. Places that are left over hold NaN, which nothing meets.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Spheres {
    anchor: [[f32; LEAF]; 3],
    to_centre: [[f32; LEAF]; 3],
    anchor_power: [f32; LEAF],
    pub(super) rows: [u32; LEAF],
}

/// Eight quads likewise.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Quads {
    normal: [[f32; LEAF]; 3],
    distance: [f32; LEAF],
    u_axis: [[f32; LEAF]; 4],
    v_axis: [[f32; LEAF]; 4],
    pub(super) rows: [u32; LEAF],
}

/// Eight triangles likewise.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Eight {
    corners: [[[f32; LEAF]; 3]; 3],
    pub(super) rows: [u32; LEAF],
}

#[inline(always)]
fn load3<F: LaneFloat>(columns: &[[f32; LEAF]]) -> Vec3<F> {
    Vec3::new(F::load(&columns[0]), F::load(&columns[1]), F::load(&columns[2]))
}

fn place<const N: usize>(columns: &mut [[f32; LEAF]; N], lane: usize, values: [f32; N]) {
    for (column, value) in columns.iter_mut().zip(values) {
        column[lane] = value;
    }
}

impl Spheres {
    fn new(spheres: impl Iterator<Item = (Sphere, u32)>) -> Spheres {
        let nothing = [f32::NAN; LEAF];
        let mut block = Spheres {
            anchor: [nothing; 3],
            to_centre: [nothing; 3],
            anchor_power: nothing,
            rows: [u32::MAX; LEAF],
        };
        for (lane, (sphere, row)) in spheres.enumerate() {
            place(&mut block.anchor, lane, sphere.anchor);
            place(&mut block.to_centre, lane, sphere.to_centre);
            block.anchor_power[lane] = sphere.anchor_power;
            block.rows[lane] = row;
        }
        block
    }

    /// The spheres, one in each of eight lanes.
    #[inline(always)]
    pub(super) fn form<F: LaneFloat>(&self) -> SphereForm<F> {
        let to_centre = load3(&self.to_centre);
        SphereForm {
            anchor: load3(&self.anchor),
            to_centre,
            twice_to_centre: to_centre * F::splat(2.0),
            anchor_power: F::load(&self.anchor_power),
        }
    }
}

impl Quads {
    fn new(quads: impl Iterator<Item = (Quad, u32)>) -> Quads {
        let nothing = [f32::NAN; LEAF];
        let mut block = Quads {
            normal: [nothing; 3],
            distance: nothing,
            u_axis: [nothing; 4],
            v_axis: [nothing; 4],
            rows: [u32::MAX; LEAF],
        };
        for (lane, (quad, row)) in quads.enumerate() {
            place(&mut block.normal, lane, quad.normal);
            block.distance[lane] = quad.distance;
            place(&mut block.u_axis, lane, quad.u_axis);
            place(&mut block.v_axis, lane, quad.v_axis);
            block.rows[lane] = row;
        }
        block
    }

    /// The quads, one in each of eight lanes.
    #[inline(always)]
    pub(super) fn form<F: LaneFloat>(&self) -> QuadForm<F> {
        QuadForm {
            normal: load3(&self.normal),
            distance: F::load(&self.distance),
            u_axis: load3(&self.u_axis),
            u_offset: F::load(&self.u_axis[3]),
            v_axis: load3(&self.v_axis),
            v_offset: F::load(&self.v_axis[3]),
        }
    }
}

impl Eight {
    const EMPTY: Eight = Eight { corners: [[[f32::NAN; LEAF]; 3]; 3], rows: [u32::MAX; LEAF] };

    fn fill(&mut self, triangles: &Triangles, items: &[Item]) {
        for (lane, item) in items.iter().enumerate() {
            let corners = triangles.positions_of(item.index() as usize);
            for (columns, corner) in self.corners.iter_mut().zip(corners) {
                place(columns, lane, corner);
            }
            self.rows[lane] = FIRST_TRIANGLE | item.index();
        }
    }

    /// The corners, their coordinates in this order.
    #[inline(always)]
    pub(super) fn corners<F: LaneFloat>(&self, order: [usize; 3]) -> [Vec3<F>; 3] {
        let [x, y, z] = order;
        let [a, b, c] = &self.corners;
        [
            Vec3::new(F::load(&a[x]), F::load(&a[y]), F::load(&a[z])),
            Vec3::new(F::load(&b[x]), F::load(&b[y]), F::load(&b[z])),
            Vec3::new(F::load(&c[x]), F::load(&c[y]), F::load(&c[z])),
        ]
    }
}

/// The tree as rays traverse it.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub(super) root: Child,
    /// Around everything, with room for what rounding does to a ray.
    around: Bounds,
    pub(super) nodes: Vec<Node>,
    pub(super) spheres: Vec<Spheres>,
    pub(super) quads: Vec<Quads>,
    pub(super) triangles: Vec<Eight>,
    /// The rare shapes of a group, each a leaf of its own; empty in other trees.
    pub(super) rare: Vec<(Rare, u32)>,
    /// The first leaf of triangles that are no needles (see [`crate::shape::NEEDLE`]); none of those after it has any.
    pub(super) first_without_needles: usize,
}

/// The contents of a box of the tree, for workers that keep it in another form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contents<'a> {
    /// Nothing: there is no such box.
    Nothing,
    /// A node, by its number.
    Node(usize),
    /// Surfaces of one kind, numbered as in [`Hit::surface`](crate::world::Hit::surface).
    Leaf(&'a [u32]),
    /// A group or a shared mesh where it stands, by its index in [`Instances`](crate::world::Instances).
    Instance(usize),
}

/// What the items of a tree are, each by its index.
pub(super) struct Things<'a> {
    pub(super) spheres: &'a [(Sphere, u32)],
    pub(super) quads: &'a [(Quad, u32)],
    /// Of a group.
    pub(super) rare: &'a [(Rare, u32)],
    pub(super) triangles: &'a Triangles,
}

/// Some of the things, as sorted.
type Range = std::ops::Range<usize>;

/// Leaves of each kind, in the order of their numbers. The first one of triangles is empty: see [`Child::ABSENT`].
struct Leaves {
    spheres: Vec<Range>,
    quads: Vec<Range>,
    triangles: Vec<Range>,
}

impl Nodes {
    /// Makes nodes of eight children from those of two: a node takes its children's children in their place, the
    /// largest first, until it has eight. Up to so many threads fill the leaves.
    pub(super) fn new(splits: &[Split], items: &[Item], things: &Things<'_>, threads: usize) -> Nodes {
        let nothing: Range = 0..0;
        let mut leaves = Leaves { spheres: Vec::new(), quads: Vec::new(), triangles: vec![nothing] };
        let mut nodes = pages::with_capacity(splits.len() / 8);
        let root = match splits[0].below {
            Below::Two { .. } => add(0, splits, items, &mut nodes, &mut leaves),
            // One leaf: a node of one child, so that its box is somewhere.
            Below::Leaf { .. } => {
                let mut node = Node::EMPTY;
                node.set_box(0, &splits[0].bounds);
                node.children[0] = add(0, splits, items, &mut nodes, &mut leaves);
                nodes.push(node);
                Child::new(0, 0)
            }
        };
        let first_without_needles = needles_first(things.triangles, items, &mut leaves.triangles, &mut nodes);
        let all = |range: &Range| items[range.clone()].iter().map(|item| item.index() as usize);
        let spheres = leaves.spheres.iter().map(|range| Spheres::new(all(range).map(|i| things.spheres[i])));
        let quads = leaves.quads.iter().map(|range| Quads::new(all(range).map(|i| things.quads[i])));
        let mut triangles = pages::with_capacity(leaves.triangles.len());
        triangles.resize(leaves.triangles.len(), Eight::EMPTY);
        in_parts(&mut triangles, threads, |first, part| {
            for (block, range) in part.iter_mut().zip(&leaves.triangles[first..]) {
                block.fill(things.triangles, &items[range.clone()]);
            }
        });
        Nodes {
            root,
            around: splits[0].bounds.grown(BOUNDS_ERROR),
            nodes,
            spheres: spheres.collect(),
            quads: quads.collect(),
            triangles,
            rare: things.rare.to_vec(),
            first_without_needles,
        }
    }

    /// The lanes whose ray comes to the box around everything before `t_max` or there, all at once; `share` as for
    /// the boxes within (see [`super::Bvh`]), twice, so that no ray is turned away that one of them would let in.
    ///
    /// Rays that are not finite meet nothing, and are turned away: they would visit every node.
    #[inline(always)]
    pub(super) fn reached<F: LaneFloat>(&self, ray: &Ray<F>, t_max: F, share: f32) -> F::Mask {
        let error = ray.o.max_abs() * (2.0 * share);
        let (mut near, mut far) = (F::zero(), t_max);
        let Bounds { low, high } = self.around;
        for (axis, (o, d)) in
            [(ray.o.x, ray.d.x), (ray.o.y, ray.d.y), (ray.o.z, ray.d.z)].into_iter().enumerate()
        {
            let inverse = F::splat(1.0) / d;
            let a = (F::splat(low[axis]) - error - o) * inverse;
            let b = (F::splat(high[axis]) + error - o) * inverse;
            near = a.min(b).max(near);
            far = a.max(b).min(far);
        }
        !near.gt(far) & ray.is_finite()
    }

    /// The target of a reference.
    pub(super) fn contents(&self, child: Child) -> Contents<'_> {
        let rows = match child.target() {
            Target::Node(node) => return Contents::Node(node),
            Target::Lone(index) => {
                return match self.rare.get(index) {
                    Some((_, row)) => Contents::Leaf(std::slice::from_ref(row)),
                    None => Contents::Instance(index),
                };
            }
            Target::Spheres(block) => &self.spheres[block].rows,
            Target::Quads(block) => &self.quads[block].rows,
            Target::Triangles(block) => &self.triangles[block].rows,
        };
        let count = rows.iter().position(|&row| row == u32::MAX).unwrap_or(LEAF);
        Contents::Leaf(&rows[..count])
    }

    /// A node's children.
    pub(super) fn children(&self, node: usize) -> [(Bounds, Contents<'_>); WIDTH] {
        let Node { planes: [low_x, low_y, low_z, high_x, high_y, high_z], children } = &self.nodes[node];
        std::array::from_fn(|i| {
            let bounds =
                Bounds { low: [low_x[i], low_y[i], low_z[i]], high: [high_x[i], high_y[i], high_z[i]] };
            let is_there = bounds.low[0] <= bounds.high[0];
            (bounds, if is_there { self.contents(children[i]) } else { Contents::Nothing })
        })
    }

    /// Prefetches the target of a child.
    #[inline(always)]
    pub(super) fn prefetch(&self, child: Child) {
        match child.target() {
            Target::Node(index) => pages::prefetch(&self.nodes[index]),
            Target::Triangles(index) => pages::prefetch(&self.triangles[index]),
            // There are never so many of the others that they are far away.
            _ => {}
        }
    }

    /// The boxes of the root's children; those of absent children are empty.
    pub(super) fn boxes(&self) -> Vec<Bounds> {
        let Node { planes: [low_x, low_y, low_z, high_x, high_y, high_z], .. } = &self.nodes[0];
        let low = |i: usize| [low_x[i], low_y[i], low_z[i]];
        (0..WIDTH).map(|i| Bounds { low: low(i), high: [high_x[i], high_y[i], high_z[i]] }).collect()
    }

    /// Levels of nodes above the deepest leaf.
    pub(super) fn depth(&self) -> usize {
        let (mut deepest, mut waiting) = (0, vec![(self.root, 0)]);
        while let Some((child, above)) = waiting.pop() {
            let Target::Node(index) = child.target() else {
                deepest = deepest.max(above);
                continue;
            };
            let Node { planes, children } = &self.nodes[index];
            // A child that is not there has the box of nothing.
            let there = (0..WIDTH).filter(|&lane| planes[0][lane] <= planes[3][lane]);
            waiting.extend(there.map(|lane| (children[lane], above + 1)));
        }
        deepest
    }

    /// Bytes in memory.
    pub(super) fn bytes(&self) -> usize {
        let Nodes { root: _, around: _, nodes, spheres, quads, triangles, rare, first_without_needles: _ } =
            self;
        size_of_val(&nodes[..])
            + size_of_val(&spheres[..])
            + size_of_val(&quads[..])
            + size_of_val(&triangles[..])
            + size_of_val(&rare[..])
    }
}

/// Puts leaves with needles before those without, behind the empty one, so that a leaf's place says what it may hold.
/// Returns the place of the first without.
fn needles_first(
    triangles: &Triangles,
    items: &[Item],
    leaves: &mut Vec<Range>,
    nodes: &mut [Node],
) -> usize {
    if !triangles.has_needles {
        return 0;
    }
    let has_needles = |&leaf: &usize| {
        leaf == 0 || items[leaves[leaf].clone()].iter().any(|item| triangles.is_needle(item.index() as usize))
    };
    let (mut order, without): (Vec<usize>, Vec<usize>) = (0..leaves.len()).partition(has_needles);
    let first_without = order.len();
    order.extend(without);
    let mut places = vec![0; order.len()];
    order.iter().enumerate().for_each(|(place, &leaf)| places[leaf] = place);
    for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
        if let Target::Triangles(leaf) = child.target() {
            *child = Child::new(Child::TRIANGLES, places[leaf]);
        }
    }
    *leaves = order.into_iter().map(|leaf| leaves[leaf].clone()).collect();
    first_without
}

/// Adds what is at a split, and all below it.
fn add(split: usize, splits: &[Split], items: &[Item], nodes: &mut Vec<Node>, leaves: &mut Leaves) -> Child {
    if let Below::Leaf { first, count } = splits[split].below {
        let (tag, leaves) = match items[first as usize].kind() {
            SPHERE => (Child::SPHERES, &mut leaves.spheres),
            QUAD => (Child::QUADS, &mut leaves.quads),
            LONE => return Child::new(Child::LONE, items[first as usize].index() as usize),
            _ => (Child::TRIANGLES, &mut leaves.triangles),
        };
        leaves.push(first as usize..(first + count) as usize);
        return Child::new(tag, leaves.len() - 1);
    }
    let mut below = [split; WIDTH];
    let mut count = 1;
    while count < WIDTH {
        let mut largest: Option<(f64, usize, u32)> = None;
        for (i, &at) in below[..count].iter().enumerate() {
            if let Below::Two { second } = splits[at].below {
                let area = splits[at].bounds.half_area();
                if largest.is_none_or(|(most, ..)| area > most) {
                    largest = Some((area, i, second));
                }
            }
        }
        let Some((_, i, second)) = largest else { break };
        below.copy_within(i + 1..count, i + 2);
        below[i] += 1;
        below[i + 1] = second as usize;
        count += 1;
    }
    let index = nodes.len();
    let mut node = Node::EMPTY;
    for (lane, &at) in below[..count].iter().enumerate() {
        node.set_box(lane, &splits[at].bounds);
    }
    nodes.push(node);
    for (lane, &at) in below[..count].iter().enumerate() {
        let child = add(at, splits, items, nodes, leaves);
        nodes[index].children[lane] = child;
    }
    Child::new(0, index)
}
