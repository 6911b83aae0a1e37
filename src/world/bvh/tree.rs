//! The trees of a world: construction, and access for other workers.

use super::build::{Item, build, in_parts};
use super::node::{Contents, LONE, Nodes, Primitives, QUAD, SPHERE, TRIANGLE, WIDTH};
use crate::math::Bounds;
use crate::shape::{BOUNDS_ERROR, Shape};
use crate::world::{Instances, Members, Simple, TreeScope, pages};
use std::ops::Range;
use std::sync::Arc;

/// Coordinates of this size have squares that are not finite.
const FARTHEST: f32 = 1e18;

/// Bounded surfaces in a bounding volume hierarchy with eight children per node. Groups and shared meshes have trees of
/// their own, in their own spaces; the instances in the top-level tree refer to them.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// The top-level tree; `None` if it is empty.
    pub(super) tree: Option<Nodes>,
    /// The trees of the groups and of the shared meshes.
    pub(super) meshes: Vec<Nodes>,
    pub(super) instances: Arc<Instances>,
    /// The fraction of a ray's largest origin coordinate by which the ray is moved relative to the boxes of the
    /// top-level tree.
    pub(super) share: f32,
    /// The same fraction for the trees of groups and shared meshes.
    pub(super) share_within: f32,
    /// Whether it holds nothing but meshes.
    pub(super) is_of_meshes: bool,
}

impl Bvh {
    /// Sorts surfaces into a tree, built by `threads` threads, and returns the surfaces that stay outside: those that
    /// are unbounded or too large for a box and, [with meshes only](TreeScope::Meshes), all but meshes.
    pub(in crate::world) fn of(surfaces: &Simple, tree_scope: TreeScope, threads: usize) -> (Simple, Bvh) {
        Bvh::with(surfaces, tree_scope, |bounds| bounds, threads)
    }

    /// The tree's memory, in bytes.
    pub fn bytes(&self) -> usize {
        let trees = self.tree.iter().chain(&self.meshes);
        trees.map(Nodes::bytes).sum::<usize>() + self.instances.bytes()
    }

    /// The number of levels of nodes above the deepest leaf.
    pub fn depth(&self) -> usize {
        self.tree.as_ref().map_or(0, Nodes::depth)
    }

    /// As `of`, with other bounds than those of the shapes, so that tests can check that too small bounds are
    /// detected.
    pub fn with(
        all: &Simple,
        tree_scope: TreeScope,
        change: impl Fn(Bounds) -> Bounds + Sync,
        threads: usize,
    ) -> (Simple, Bvh) {
        let Simple { planes, spheres, quads, custom, .. } = all.clone();
        let mut beside = Simple { planes, custom, ..Simple::default() };
        let mut items = pages::with_capacity(all.len());
        if tree_scope == TreeScope::Meshes {
            (beside.spheres, beside.quads) = (spheres, quads);
        } else {
            for (index, sphere) in spheres.into_iter().enumerate() {
                match item(change(sphere.0.bounds()), SPHERE, index) {
                    Some(item) => items.push(item),
                    None => beside.spheres.push(sphere),
                }
            }
            for (index, quad) in quads.into_iter().enumerate() {
                match item(change(quad.0.bounds()), QUAD, index) {
                    Some(item) => items.push(item),
                    None => beside.quads.push(quad),
                }
            }
        }
        let triangles = |items: &mut Vec<Item>, range: Range<usize>| {
            let others = items.len();
            items.resize(others + range.len(), Item::new(&Bounds::EVERYTHING, TRIANGLE, 0));
            in_parts(&mut items[others..], threads, |first, part| {
                for (index, item) in part.iter_mut().enumerate() {
                    let index = range.start + first + index;
                    *item = Item::new(&change(all.triangles.bounds(index)), TRIANGLE, index as u32);
                }
            });
        };
        // The triangles of a mesh all have finite bounds: its reader and its transform have been checked.
        triangles(&mut items, 0..all.triangles.placed());
        let tree_of = |mut items: Vec<Item>, members: Option<&Members>| {
            let splits = build(&mut items, threads);
            let things = match members {
                None => Primitives {
                    spheres: &all.spheres,
                    quads: &all.quads,
                    custom: &[],
                    triangles: &all.triangles,
                },
                Some(Members { spheres, quads, custom }) => {
                    Primitives { spheres, quads, custom, triangles: &all.triangles }
                }
            };
            Nodes::new(&splits, &items, &things, threads)
        };
        let is_of_meshes = items.len() == all.triangles.placed();
        let mut meshes = Vec::new();
        for (thing, range) in all.instances.meshes.iter().enumerate() {
            let mut items = pages::with_capacity(range.len());
            triangles(&mut items, range.clone());
            let members = all.instances.groups.get(thing);
            if let Some(Members { spheres, quads, custom }) = members {
                // All of them have finite bounds: checked scenes have no group of greater extent.
                let of_kind = |kind| {
                    let change = &change;
                    move |(i, bounds)| Item::new(&change(bounds), kind, i)
                };
                items.extend((0..).zip(spheres.iter().map(|(s, _)| s.bounds())).map(of_kind(SPHERE)));
                items.extend((0..).zip(quads.iter().map(|(q, _)| q.bounds())).map(of_kind(QUAD)));
                items.extend((0..).zip(custom.iter().map(|(r, _)| r.bounds())).map(of_kind(LONE)));
            }
            meshes.push(tree_of(items, members));
        }
        let mut share = BOUNDS_ERROR;
        for (instance, &mesh) in all.instances.mesh.iter().enumerate() {
            let (bounds, own) = all.instances.bounds(instance, &meshes[mesh as usize].boxes());
            items.push(Item::new(&change(bounds), LONE, instance as u32));
            share = share.max(own);
        }
        let tree = (!items.is_empty()).then(|| tree_of(items, None));
        let instances = Arc::clone(&all.instances);
        let share_within = instances.share_within();
        (beside, Bvh { tree, meshes, instances, share, share_within, is_of_meshes })
    }
}

/// Read access to one tree, for workers that store trees in another form.
#[derive(Clone, Copy, Debug)]
pub struct Boxes<'a>(&'a Nodes);

impl<'a> Boxes<'a> {
    /// The root node.
    pub fn root(self) -> Contents<'a> {
        self.0.contents(self.0.root)
    }

    /// The boxes of a node's children, and their contents. Boxes are enlarged as in [`Shape::bounds`].
    pub fn children(self, node: usize) -> [(Bounds, Contents<'a>); WIDTH] {
        self.0.children(node)
    }
}

impl Bvh {
    /// The top-level tree, unless it is empty.
    pub fn boxes(&self) -> Option<Boxes<'_>> {
        self.tree.as_ref().map(Boxes)
    }

    /// The trees of the groups and of the shared meshes, each in its own space.
    pub fn shared(&self) -> impl Iterator<Item = Boxes<'_>> {
        self.meshes.iter().map(Boxes)
    }

    /// The fraction of a ray's largest origin coordinate by which the ray has to be moved relative to the boxes of the
    /// top-level tree: at least [`BOUNDS_ERROR`]. For the other trees, see [`Instances::share_within`].
    pub fn share(&self) -> f32 {
        self.share
    }
}

fn item(bounds: Bounds, kind: u32, index: usize) -> Option<Item> {
    let Bounds { low, high } = bounds;
    let fits = low.iter().chain(&high).all(|x| x.abs() < FARTHEST);
    fits.then(|| Item::new(&bounds, kind, index as u32))
}
