//! The CPU's tree in the device's layout.
//!
//! A node of eight boxes takes 96 bytes instead of the CPU's 256, because a device is limited by memory more than by
//! arithmetic. Boxes are rounded outwards to 256 steps along each axis (Ylitie, Karras and Laine 2017, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs"). The child nodes of a node are contiguous, as are
//! the contents of its leaves. Each box is stored in the slot of the corner of the node that it is nearest to, which
//! gives an order of traversal for every direction: turn i visits slot i ^ o, where o is the octant that the ray points
//! away from.

use super::layout::{Instance, MeshVertex, PlaceRow, TreeNode, Triangle};
use crate::light::NO_LIGHT;
use crate::math::{Bounds, Vec3};
use crate::shape::SurfaceKind;
use crate::world::{Boxes, Bvh, Contents, FIRST_TRIANGLE, Instances, SurfaceTable, TREE_WIDTH, Triangles};
use std::collections::VecDeque;
use std::fmt::Write;

/// The kinds of leaves in a node's sixteen bits. Custom shapes are leaves only in groups.
pub(super) const TRIANGLES: u32 = 0;
pub(super) const SPHERES: u32 = 1;
pub(super) const QUADS: u32 = 2;
pub(super) const INSTANCE: u32 = 3;

pub(super) const CUSTOM: u32 = 5;

/// The kind of surfaces that are in no tree.
pub(super) const PLANES: u32 = 4;

/// The parent of a root.
pub(super) const NO_NODE: u32 = u32::MAX;

/// The trees and their contents: those of groups and shared meshes, then the top-level tree. All empty if there is
/// none.
#[derive(Default)]
pub(super) struct Tree {
    /// The depth of the trees, in nodes.
    pub(super) levels: u32,
    pub(super) nodes: Vec<TreeNode>,
    /// The root of the top-level tree.
    pub(super) root: u32,
    /// The fraction by which a ray is moved relative to its boxes: see [`Bvh::share`].
    pub(super) share: f32,
    /// The triangles, and among them, with the same size, every [`Instance`].
    pub(super) triangles: Vec<Triangle>,
    pub(super) vertices: Vec<MeshVertex>,
    /// The transforms of instances, in the host's order.
    pub(super) places: Vec<PlaceRow>,
    /// Whether any are instances of groups.
    pub(super) has_groups: bool,
    /// Rows of the host's surface table, in the order of leaves.
    pub(super) rows: Vec<u32>,
}

/// A node to be built: its contents, its parent, and its level.
struct Pending<'a> {
    children: [(Bounds, Contents<'a>); TREE_WIDTH],
    parent: u32,
    level: u32,
}

/// The input of the trees.
struct Source<'a> {
    table: &'a SurfaceTable,
    /// The number of surfaces before those of leaves.
    first_surface: u32,
    meshes: Option<Meshes<'a>>,
    /// The roots of the trees of groups and shared meshes.
    roots: Vec<u32>,
}

impl Tree {
    /// Converts the host's trees over a scene's surfaces, of which `first_surface` precede those of leaves.
    pub(super) fn new(bvh: &Bvh, table: &SurfaceTable, first_surface: u32) -> Tree {
        let mut tree = Tree { share: bvh.share(), ..Tree::default() };
        let meshes = table.triangles().map(|triangles| Meshes::new(triangles, table));
        let mut source = Source { table, first_surface, meshes, roots: Vec::new() };
        let mut below = 0;
        for boxes in bvh.shared() {
            source.roots.push(tree.nodes.len() as u32);
            below = tree.add(boxes, &source).max(below);
        }
        tree.root = tree.nodes.len() as u32;
        let Some(boxes) = bvh.boxes() else { return tree };
        tree.levels = tree.add(boxes, &source) + below;
        if let Some(Meshes { triangles, .. }) = source.meshes {
            tree.vertices = vertices(triangles);
        }
        if let Some(instances) = table.instances() {
            tree.places = (0..instances.len()).map(|i| place(instances, i)).collect();
            tree.has_groups = instances.has_groups();
        }
        tree
    }

    /// Adds one of the host's trees and returns its number of levels.
    fn add(&mut self, tree: Boxes<'_>, source: &Source<'_>) -> u32 {
        let nothing = (Bounds::NOTHING, Contents::Nothing);
        let root = match tree.root() {
            Contents::Nothing => [nothing; TREE_WIDTH],
            Contents::Node(node) => tree.children(node),
            _ => unreachable!("the host's roots are nodes"),
        };
        let mut pending = VecDeque::from([Pending { children: root, parent: NO_NODE, level: 1 }]);
        let mut made = self.nodes.len() as u32 + 1;
        let mut levels = 0;
        // Breadth first, so that the child nodes of a node are contiguous.
        while let Some(Pending { children, parent, level }) = pending.pop_front() {
            levels = levels.max(level);
            let here = self.nodes.len() as u32;
            let children = in_places(children);
            let mut node = boxes(&children.map(|(bounds, _)| bounds));
            (node.parent, node.nodes) = (parent, made);
            node.triangles = self.triangles.len() as u32;
            node.surfaces = source.first_surface + self.rows.len() as u32;
            for (place, (_, contents)) in children.into_iter().enumerate() {
                let (kind, from, count) = match contents {
                    Contents::Nothing => continue,
                    Contents::Node(child) => {
                        node.scales |= 1 << (24 + place);
                        let children = tree.children(child);
                        pending.push_back(Pending { children, parent: here, level: level + 1 });
                        made += 1;
                        continue;
                    }
                    Contents::Instance(number) => self.add_instance(number, source, &node),
                    Contents::Leaf(numbers) => self.add_leaf(numbers, source, &node),
                };
                assert!(count < 16 && from < 256, "a leaf of {count} from {from}");
                node.leaves[place / 2] |= (kind << 12 | from << 4 | count) << (place % 2 * 16);
            }
            self.nodes.push(node);
        }
        levels
    }

    /// Adds the contents of a leaf. Returns their kind, their offset from the node's first item of this kind, and their
    /// number.
    fn add_leaf(&mut self, numbers: &[u32], source: &Source<'_>, node: &TreeNode) -> (u32, u32, u32) {
        let count = numbers.len() as u32;
        match &source.meshes {
            Some(meshes) if numbers[0] >= FIRST_TRIANGLE => {
                let from = self.triangles.len() as u32 - node.triangles;
                self.triangles.extend(numbers.iter().map(|&number| meshes.triangle(number)));
                (TRIANGLES, from, count)
            }
            _ => {
                let kind = match source.table.rows()[numbers[0] as usize].0.kind {
                    SurfaceKind::Round => SPHERES,
                    SurfaceKind::Flat => QUADS,
                    SurfaceKind::Custom(_) => CUSTOM,
                };
                let from = source.first_surface + self.rows.len() as u32 - node.surfaces;
                self.rows.extend(numbers);
                (kind, from, count)
            }
        }
    }

    fn add_instance(&mut self, number: usize, source: &Source<'_>, node: &TreeNode) -> (u32, u32, u32) {
        let from = self.triangles.len() as u32 - node.triangles;
        if let Some(instances) = source.table.instances() {
            let PlaceRow { to_mesh_x, to_mesh_y, to_mesh_z, origin, .. } = place(instances, number);
            let root = source.roots[instances.mesh[number] as usize];
            let number = number as u32 + 1;
            let instance =
                Instance { to_mesh_x, root, to_mesh_y, number, to_mesh_z, origin, ..Instance::default() };
            self.triangles.push(bytemuck::cast(instance));
        }
        (INSTANCE, from, 1)
    }

    /// Replaces the host's rows of meshes in the surface table by the device's.
    pub(super) fn put_surfaces(&mut self, places: &[u32]) {
        for node in &self.nodes {
            for place in 0..TREE_WIDTH {
                let leaf = node.leaves[place / 2] >> (place % 2 * 16) & 0xffff;
                let (kind, from, count) = (leaf >> 12, leaf >> 4 & 255, leaf & 15);
                if kind == TRIANGLES {
                    let first = (node.triangles + from) as usize;
                    for triangle in &mut self.triangles[first..first + count as usize] {
                        triangle.surface = places[triangle.surface as usize];
                    }
                }
            }
        }
        for place in &mut self.places {
            // Groups have no row.
            if let Some(&surface) = places.get(place.surface as usize) {
                place.surface = surface;
            }
        }
    }
}

/// The transform of an instance. Its surface is the host's row, until the device's order is known.
fn place(instances: &Instances, number: usize) -> PlaceRow {
    let place = instances.place(number);
    let [to_world_x, to_world_y, to_world_z] = place.to_world.map(array);
    let [to_mesh_x, to_mesh_y, to_mesh_z] = place.to_mesh.map(array);
    PlaceRow {
        to_world_x,
        to_world_y,
        to_world_z,
        to_mesh_x,
        to_mesh_y,
        to_mesh_z,
        origin: array(place.origin),
        stretch: place.stretch,
        condition: place.condition,
        side: place.side,
        surface: instances.rows[number],
        ..PlaceRow::default()
    }
}

fn array(v: Vec3<f32>) -> [f32; 3] {
    [v.x, v.y, v.z]
}

/// Children in the slots of their nearest corners: bit i of a slot is set on the upper side along axis i. The best
/// matches are assigned first.
fn in_places<'a>(children: [(Bounds, Contents<'a>); TREE_WIDTH]) -> [(Bounds, Contents<'a>); TREE_WIDTH] {
    let middle = |bounds: &Bounds| [0, 1, 2].map(|i| f64::from(bounds.low[i]) + f64::from(bounds.high[i]));
    let is_there = |child: &(Bounds, Contents<'_>)| child.1 != Contents::Nothing;
    let all = children.iter().filter(|child| is_there(child)).fold(Bounds::NOTHING, |all, c| all.with(&c.0));
    let centre = middle(&all);
    let mut placed = [(Bounds::NOTHING, Contents::Nothing); TREE_WIDTH];
    let (mut left, mut free) = (children.map(|child| is_there(&child)), [true; TREE_WIDTH]);
    // The position of a child along the diagonal towards a slot's corner.
    let suits = |child: usize, place: usize| -> f64 {
        let m = middle(&children[child].0);
        (0..3).map(|i| if place >> i & 1 == 1 { m[i] - centre[i] } else { centre[i] - m[i] }).sum()
    };
    let pairs = || (0..TREE_WIDTH).flat_map(|child| (0..TREE_WIDTH).map(move |place| (child, place)));
    while left.contains(&true) {
        let mut best: Option<(f64, usize, usize)> = None;
        for (child, place) in pairs().filter(|&(child, place)| left[child] && free[place]) {
            let suits = suits(child, place);
            if best.is_none_or(|(most, ..)| suits > most) {
                best = Some((suits, child, place));
            }
        }
        let Some((_, child, place)) = best else { break };
        placed[place] = children[child];
        (left[child], free[place]) = (false, false);
    }
    placed
}

/// A node with these boxes, rounded outwards.
pub(super) fn boxes(children: &[Bounds; TREE_WIDTH]) -> TreeNode {
    let all = children.iter().fold(Bounds::NOTHING, |all, bounds| all.with(bounds));
    let mut node = TreeNode { origin: all.low, ..TreeNode::default() };
    let (mut low, mut high) = ([[0_u32; 2]; 3], [[0_u32; 2]; 3]);
    for axis in 0..3 {
        let origin = f64::from(all.low[axis]);
        let exponent = exponent(f64::from(all.high[axis]) - origin);
        node.scales |= exponent << (8 * axis);
        let steps = |x: f32| (f64::from(x) - origin) / step(exponent);
        for (place, bounds) in children.iter().enumerate() {
            // The box of an absent child is never entered: its minimum exceeds its maximum.
            let is_there = bounds.low[axis] <= bounds.high[axis];
            let (from, to) = if is_there {
                (steps(bounds.low[axis]).floor() as u32, steps(bounds.high[axis]).ceil() as u32)
            } else {
                (255, 0)
            };
            debug_assert!(from <= 255 && to <= 255);
            low[axis][place / 4] |= from << (place % 4 * 8);
            high[axis][place / 4] |= to << (place % 4 * 8);
        }
    }
    [node.low_x, node.low_y, node.low_z] = low;
    [node.high_x, node.high_y, node.high_z] = high;
    node
}

/// The power of two with this biased exponent.
fn step(exponent: u32) -> f64 {
    f64::from(f32::from_bits(exponent << 23))
}

/// The biased exponent of the smallest normal power of two such that 255 steps cover the length.
fn exponent(extent: f64) -> u32 {
    (1..255).find(|&exponent| step(exponent) * 255.0 >= extent).unwrap_or(254)
}

/// The source of triangles.
struct Meshes<'a> {
    triangles: &'a Triangles,
    table: &'a SurfaceTable,
    /// The first triangle of each row that is a mesh.
    first: Vec<u32>,
}

impl<'a> Meshes<'a> {
    fn new(triangles: &'a Triangles, table: &'a SurfaceTable) -> Meshes<'a> {
        let mut first = vec![u32::MAX; table.len()];
        for (index, &row) in (0..).zip(&triangles.rows) {
            let first = &mut first[row as usize];
            *first = index.min(*first);
        }
        Meshes { triangles, table, first }
    }

    /// The light of a triangle: the lights of a mesh are in the order of its triangles. Shared meshes have none.
    fn light(&self, index: usize) -> u32 {
        let Some(&row) = self.triangles.rows.get(index) else { return NO_LIGHT };
        let row = row as usize;
        match self.table.rows()[row].1.light {
            NO_LIGHT => NO_LIGHT,
            light => light + index as u32 - self.first[row],
        }
    }

    fn triangle(&self, number: u32) -> Triangle {
        let triangles = self.triangles;
        let index = (number & !FIRST_TRIANGLE) as usize;
        let [a, b, c] = triangles.positions_of(index);
        Triangle {
            a,
            number,
            b,
            // The host's row, until the device's order is known. For shared meshes, the instance holds it.
            surface: triangles.rows.get(index).copied().unwrap_or(0),
            c,
            light: self.light(index),
            vertices: [0, 1, 2].map(|corner| triangles.corners[corner][index]),
            _end: 0,
        }
    }
}

/// The vertex attributes of meshes.
fn vertices(triangles: &Triangles) -> Vec<MeshVertex> {
    let Triangles { normals: [x, y, z], uv: [u, v], second_uv, .. } = triangles;
    let vertex = |i: usize| {
        let [second_u, second_v] = second_uv.each_ref().map(|column| column.get(i).copied().unwrap_or(0.0));
        MeshVertex {
            normal: [x[i], y[i], z[i]],
            u: u[i],
            v: v[i],
            second_u,
            second_v,
            ..MeshVertex::default()
        }
    };
    (0..u.len()).map(vertex).collect()
}

/// The WGSL type of the trail up a tree of so many levels: eight bits for each level above the current one, the lowest
/// bits for the level right above.
pub(super) fn trail(levels: u32) -> String {
    let words = levels.saturating_sub(1).div_ceil(16).max(1) as usize;
    let names: Vec<_> =
        (0..words).map(|i| if i == 0 { "newest".to_owned() } else { format!("older_{i}") }).collect();
    let (mut fields, mut waits, mut push, mut pop) =
        (String::new(), String::new(), String::new(), String::new());
    for (i, name) in names.iter().enumerate() {
        let comma = if i == 0 { "" } else { ", " };
        let newer = if i == 0 { "waiting".to_owned() } else { format!("trail.{}.w >> 24u", names[i - 1]) };
        let older = names.get(i + 1).map_or("0u".to_owned(), |older| format!("trail.{older}.x"));
        // Writing to a string does not fail.
        let _ = writeln!(fields, "    {name}: vec4u,");
        let _ = write!(waits, "{}trail.{name}", if i == 0 { "" } else { " | " });
        let _ = write!(
            push,
            "{comma}(trail.{name} << vec4u(8u)) | vec4u({newer}, trail.{name}.xyz >> vec3u(24u))"
        );
        let _ = write!(
            pop,
            "{comma}(trail.{name} >> vec4u(8u)) | (vec4u(trail.{name}.yzw, {older}) << vec4u(24u))"
        );
    }
    format!(
        "struct Trail {{
{fields}}}
fn trail_waits(trail: Trail) -> bool {{
    return any(({waits}) != vec4u(0u));
}}
fn trail_push(trail: Trail, waiting: u32) -> Trail {{
    return Trail({push});
}}
fn trail_pop(trail: Trail) -> Trail {{
    return Trail({pop});
}}
"
    )
}
