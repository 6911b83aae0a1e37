//! Nodes with eight children, and the items of leaves.

use super::build::{ALONE, Below, Item, LEAF, Split, in_parts};
use crate::math::{Bounds, LaneFloat, Ray, Vec3};
use crate::shape::{BOUNDS_ERROR, CustomShape, Quad, QuadLanes, Sphere, SphereLanes};
use crate::world::{FIRST_TRIANGLE, Triangles, pages};

/// The number of children of a node.
pub const WIDTH: usize = 8;

/// Eight boxes and their contents; four cache lines.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Minimum x, y and z, then maximum x, y and z. An absent child has an empty box and is [`Child::ABSENT`].
    pub(super) planes: [[f32; WIDTH]; 6],
    /// The contents of the boxes.
    pub(super) children: [Child; WIDTH],
}

impl Node {
    /// A node whose children are all absent.
    const EMPTY: Node = {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Node { planes: [low, low, low, high, high, high], children: [Child::ABSENT; WIDTH] }
    };

    fn set_box(&mut self, lane: usize, bounds: &Bounds) {
        let Bounds { low: [a, b, c], high: [d, e, f] } = *bounds;
        place(&mut self.planes, lane, [a, b, c, d, e, f]);
    }
}

/// A reference to a node or a leaf, in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// The target of a reference: an index among the targets of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Node(usize),
    Spheres(usize),
    Quads(usize),
    Triangles(usize),
    /// A single primitive: in the top-level tree an instance, in the tree of a group a custom shape.
    Lone(usize),
}

impl Child {
    const INDEX_BITS: u32 = 29;
    const SPHERES: u32 = 1;
    const QUADS: u32 = 2;
    const TRIANGLES: u32 = 3;
    const LONE: u32 = 7;

    /// The first block of triangles, which is empty. A non-finite ray enters empty boxes too, and must end there.
    const ABSENT: Child = Child(Child::TRIANGLES << Child::INDEX_BITS);

    fn new(tag: u32, index: usize) -> Child {
        assert!(index < 1 << Child::INDEX_BITS, "a tree with {index} nodes");
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

/// The kinds of primitives, as in [`Item::kind`].
pub(super) const SPHERE: u32 = 0;
pub(super) const QUAD: u32 = 1;
pub(super) const TRIANGLE: u32 = 2;
/// A primitive that forms a leaf of its own: see [`Target::Lone`].
pub(super) const LONE: u32 = ALONE;

/// Eight spheres, one column for each property. Unused slots hold NaN, which no ray hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Spheres {
    anchor: [[f32; LEAF]; 3],
    to_centre: [[f32; LEAF]; 3],
    anchor_power: [f32; LEAF],
    pub(super) rows: [u32; LEAF],
}

/// Eight quads, in the same layout.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Quads {
    normal: [[f32; LEAF]; 3],
    distance: [f32; LEAF],
    u_axis: [[f32; LEAF]; 4],
    v_axis: [[f32; LEAF]; 4],
    pub(super) rows: [u32; LEAF],
}

/// Eight triangles, in the same layout.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Triangle8 {
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
    pub(super) fn lanes<F: LaneFloat>(&self) -> SphereLanes<F> {
        let to_centre = load3(&self.to_centre);
        SphereLanes {
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
    pub(super) fn lanes<F: LaneFloat>(&self) -> QuadLanes<F> {
        QuadLanes {
            normal: load3(&self.normal),
            distance: F::load(&self.distance),
            u_axis: load3(&self.u_axis),
            u_offset: F::load(&self.u_axis[3]),
            v_axis: load3(&self.v_axis),
            v_offset: F::load(&self.v_axis[3]),
        }
    }
}

impl Triangle8 {
    const EMPTY: Triangle8 = Triangle8 { corners: [[[f32::NAN; LEAF]; 3]; 3], rows: [u32::MAX; LEAF] };

    fn fill(&mut self, triangles: &Triangles, items: &[Item]) {
        for (lane, item) in items.iter().enumerate() {
            let corners = triangles.positions_of(item.index() as usize);
            for (columns, corner) in self.corners.iter_mut().zip(corners) {
                place(columns, lane, corner);
            }
            self.rows[lane] = FIRST_TRIANGLE | item.index();
        }
    }

    /// The corners, in this order of coordinates.
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

/// The tree in the form in which rays traverse it.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub(super) root: Child,
    /// The bounds of the tree, with a margin for the rounding errors of a ray.
    around: Bounds,
    pub(super) nodes: Vec<Node>,
    pub(super) spheres: Vec<Spheres>,
    pub(super) quads: Vec<Quads>,
    pub(super) triangles: Vec<Triangle8>,
    /// The custom shapes of a group, each a leaf of its own; empty in other trees.
    pub(super) custom: Vec<(CustomShape, u32)>,
    /// The first leaf of triangles without needles (see [`crate::shape::NEEDLE`]); none of the following leaves has
    /// any.
    pub(super) first_without_needles: usize,
}

/// The contents of a box of the tree, for workers that store trees in another form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contents<'a> {
    /// Nothing: the box is absent.
    Nothing,
    /// A node, by its index.
    Node(usize),
    /// Surfaces of one kind, numbered as in [`Hit::surface`](crate::world::Hit::surface).
    Leaf(&'a [u32]),
    /// An instance of a group or of a shared mesh, by its index in [`Instances`](crate::world::Instances).
    Instance(usize),
}

/// The primitives that the items of a tree refer to by index.
pub(super) struct Primitives<'a> {
    pub(super) spheres: &'a [(Sphere, u32)],
    pub(super) quads: &'a [(Quad, u32)],
    /// The custom shapes of a group.
    pub(super) custom: &'a [(CustomShape, u32)],
    pub(super) triangles: &'a Triangles,
}

/// A range of the sorted primitives.
type Range = std::ops::Range<usize>;

/// Leaves of each kind, in the order of their indices. The first leaf of triangles is empty: see [`Child::ABSENT`].
struct Leaves {
    spheres: Vec<Range>,
    quads: Vec<Range>,
    triangles: Vec<Range>,
}

impl Nodes {
    /// Makes nodes with eight children from binary nodes: a node replaces its largest children by their children until
    /// it has eight. Up to `threads` threads fill the leaves.
    pub(super) fn new(splits: &[Split], items: &[Item], things: &Primitives<'_>, threads: usize) -> Nodes {
        let nothing: Range = 0..0;
        let mut leaves = Leaves { spheres: Vec::new(), quads: Vec::new(), triangles: vec![nothing] };
        let mut nodes = pages::with_capacity(splits.len() / 8);
        let root = match splits[0].below {
            Below::Two { .. } => add(0, splits, items, &mut nodes, &mut leaves),
            // A single leaf becomes a node with one child, so that its box is stored.
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
        triangles.resize(leaves.triangles.len(), Triangle8::EMPTY);
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
            custom: things.custom.to_vec(),
            first_without_needles,
        }
    }

    /// The lanes whose rays enter the bounds of the tree no later than at `t_max`. `share` is that of the boxes within
    /// (see [`super::Bvh`]), applied twice, so that no ray is rejected that one of them would accept.
    ///
    /// Non-finite rays hit nothing and are rejected here; they would visit every node.
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
                return match self.custom.get(index) {
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
            // The other kinds never have so many leaves that they miss the cache.
            _ => {}
        }
    }

    /// The boxes of the root's children; boxes of absent children are empty.
    pub(super) fn boxes(&self) -> Vec<Bounds> {
        let Node { planes: [low_x, low_y, low_z, high_x, high_y, high_z], .. } = &self.nodes[0];
        let low = |i: usize| [low_x[i], low_y[i], low_z[i]];
        (0..WIDTH).map(|i| Bounds { low: low(i), high: [high_x[i], high_y[i], high_z[i]] }).collect()
    }

    /// The number of levels of nodes above the deepest leaf.
    pub(super) fn depth(&self) -> usize {
        let (mut deepest, mut waiting) = (0, vec![(self.root, 0)]);
        while let Some((child, above)) = waiting.pop() {
            let Target::Node(index) = child.target() else {
                deepest = deepest.max(above);
                continue;
            };
            let Node { planes, children } = &self.nodes[index];
            // An absent child has an empty box.
            let there = (0..WIDTH).filter(|&lane| planes[0][lane] <= planes[3][lane]);
            waiting.extend(there.map(|lane| (children[lane], above + 1)));
        }
        deepest
    }

    /// Memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        let Nodes { root: _, around: _, nodes, spheres, quads, triangles, custom, first_without_needles: _ } =
            self;
        size_of_val(&nodes[..])
            + size_of_val(&spheres[..])
            + size_of_val(&quads[..])
            + size_of_val(&triangles[..])
            + size_of_val(&custom[..])
    }
}

/// Moves leaves with needles before those without, after the empty one, so that a leaf's index tells whether it may
/// hold needles. Returns the index of the first leaf without.
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

/// Adds a split and everything below it.
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
