//! Nodes of eight children, and what is in a leaf.

use super::build::{Below, Item, LEAF, Split};
use crate::math::{Bounds, Float, Vec3};
use crate::shape::{Quad, QuadForm, Sphere, SphereForm};
use crate::world::{FIRST_TRIANGLE, Simple, Triangles};

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Eight boxes and what is in them: four lines of a processor's cache.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Low x, y and z, then high x, y and z. A child that is not there has the box of nothing.
    pub(super) planes: [[f32; WIDTH]; 6],
    /// What the boxes hold.
    pub(super) children: [Child; WIDTH],
}

/// A reference to a node or a leaf, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(u32);

/// What a reference leads to: an index among the things of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Node(usize),
    Spheres(usize),
    Quads(usize),
    Triangles(usize),
}

impl Child {
    const INDEX_BITS: u32 = 29;
    const SPHERES: u32 = 1;
    const QUADS: u32 = 2;
    const TRIANGLES: u32 = 3;

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
            _ => Target::Triangles(index),
        }
    }
}

/// The kinds of things, as [`Item::kind`] has them.
pub(super) const SPHERE: u32 = 0;
pub(super) const QUAD: u32 = 1;
pub(super) const TRIANGLE: u32 = 2;

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
fn load3<F: Float>(columns: &[[f32; LEAF]]) -> Vec3<F> {
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

    /// The spheres as eight lanes ask for them.
    #[inline(always)]
    pub(super) fn form<F: Float>(&self) -> SphereForm<F> {
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

    /// The quads as eight lanes ask for them.
    #[inline(always)]
    pub(super) fn form<F: Float>(&self) -> QuadForm<F> {
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
    fn new(triangles: &Triangles, indices: impl Iterator<Item = u32>) -> Eight {
        let mut block = Eight { corners: [[[f32::NAN; LEAF]; 3]; 3], rows: [u32::MAX; LEAF] };
        for (lane, index) in indices.enumerate() {
            for (columns, corner) in block.corners.iter_mut().zip(triangles.positions_of(index as usize)) {
                place(columns, lane, corner);
            }
            block.rows[lane] = FIRST_TRIANGLE | index;
        }
        block
    }

    /// The corners, their coordinates in this order.
    #[inline(always)]
    pub(super) fn corners<F: Float>(&self, order: [usize; 3]) -> [Vec3<F>; 3] {
        let [x, y, z] = order;
        let [a, b, c] = &self.corners;
        [
            Vec3::new(F::load(&a[x]), F::load(&a[y]), F::load(&a[z])),
            Vec3::new(F::load(&b[x]), F::load(&b[y]), F::load(&b[z])),
            Vec3::new(F::load(&c[x]), F::load(&c[y]), F::load(&c[z])),
        ]
    }
}

/// The tree as rays go through it.
#[derive(Clone, Debug)]
pub(super) struct Nodes {
    pub(super) root: Child,
    pub(super) nodes: Vec<Node>,
    pub(super) spheres: Vec<Spheres>,
    pub(super) quads: Vec<Quads>,
    pub(super) triangles: Vec<Eight>,
}

impl Nodes {
    /// Makes nodes of eight children from those of two: a node takes its children's children in their place, the
    /// largest first, until it has eight.
    pub(super) fn new(splits: &[Split], items: &[Item], things: &Simple) -> Nodes {
        let mut nodes = Nodes {
            root: Child(0),
            nodes: Vec::new(),
            spheres: Vec::new(),
            quads: Vec::new(),
            triangles: Vec::new(),
        };
        nodes.root = nodes.add(0, splits, items, things);
        nodes
    }

    /// Bytes in memory.
    pub(super) fn bytes(&self) -> usize {
        let Nodes { root: _, nodes, spheres, quads, triangles } = self;
        size_of_val(&nodes[..])
            + size_of_val(&spheres[..])
            + size_of_val(&quads[..])
            + size_of_val(&triangles[..])
    }

    fn add_leaf(&mut self, items: &[Item], things: &Simple) -> Child {
        let indices = items.iter().map(|item| item.index as usize);
        match items[0].kind {
            SPHERE => {
                self.spheres.push(Spheres::new(indices.map(|i| things.spheres[i])));
                Child::new(Child::SPHERES, self.spheres.len() - 1)
            }
            QUAD => {
                self.quads.push(Quads::new(indices.map(|i| things.quads[i])));
                Child::new(Child::QUADS, self.quads.len() - 1)
            }
            _ => {
                self.triangles.push(Eight::new(&things.triangles, items.iter().map(|item| item.index)));
                Child::new(Child::TRIANGLES, self.triangles.len() - 1)
            }
        }
    }

    fn add(&mut self, split: usize, splits: &[Split], items: &[Item], things: &Simple) -> Child {
        if let Below::Leaf { first, count } = splits[split].below {
            return self.add_leaf(&items[first as usize..(first + count) as usize], things);
        }
        let mut below = vec![split];
        while below.len() < WIDTH {
            let area = |at: usize| match splits[at].below {
                Below::Two { .. } => Some(splits[at].bounds.half_area()),
                Below::Leaf { .. } => None,
            };
            let areas = below.iter().enumerate().filter_map(|(i, &at)| area(at).map(|area| (i, area)));
            let Some((largest, _)) = areas.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))) else {
                break;
            };
            let at = below[largest];
            let Below::Two { second } = splits[at].below else { unreachable!("leaves have no area") };
            below[largest] = at + 1;
            below.insert(largest + 1, second as usize);
        }
        let index = self.nodes.len();
        let nothing = Child(0);
        let mut planes = [[0.0; WIDTH]; 6];
        let bounds = below.iter().map(|&at| splits[at].bounds).chain(std::iter::repeat(Bounds::NOTHING));
        for (lane, Bounds { low: [a, b, c], high: [d, e, f] }) in bounds.take(WIDTH).enumerate() {
            place(&mut planes, lane, [a, b, c, d, e, f]);
        }
        self.nodes.push(Node { planes, children: [nothing; WIDTH] });
        for (lane, &at) in below.iter().enumerate() {
            let child = self.add(at, splits, items, things);
            self.nodes[index].children[lane] = child;
        }
        Child::new(0, index)
    }
}
