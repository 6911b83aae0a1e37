//! The trees of a world: their surfaces, and the contents of their boxes.

use super::build::{Item, build, in_parts};
use super::node::{Contents, LONE, Nodes, QUAD, SPHERE, TRIANGLE, Things, WIDTH};
use crate::math::Bounds;
use crate::shape::{BOUNDS_ERROR, Shape};
use crate::world::{Instances, Members, Simple, Treed, pages};
use std::ops::Range;
use std::sync::Arc;

/// Coordinates as far out as this have squares that are not finite.
const FARTHEST: f32 = 1e18;

/// Bounded surfaces in a tree of boxes, eight at each node. Groups and shared meshes have trees of their own, each in
/// its own space, which the instances in the first tree lead to.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// `None` if there is nothing.
    pub(super) tree: Option<Nodes>,
    /// The trees of the groups and of the shared meshes.
    pub(super) meshes: Vec<Nodes>,
    pub(super) instances: Arc<Instances>,
    /// By how much of its origin's largest coordinate a ray is moved beside the first tree's boxes.
    pub(super) share: f32,
    /// The same in the trees of groups and shared meshes.
    pub(super) share_within: f32,
    /// Whether nothing but meshes is in it.
    pub(super) is_of_meshes: bool,
}

impl Bvh {
    /// Sorts surfaces into a tree, built by so many threads, and returns those that stay beside it: the unbounded
    /// ones, those that no box can hold, and all but meshes where the tree is [of meshes](Treed::Meshes).
    pub(in crate::world) fn of(surfaces: &Simple, treed: Treed, threads: usize) -> (Simple, Bvh) {
        Bvh::with(surfaces, treed, |bounds| bounds, threads)
    }

    /// The tree's memory, in bytes.
    pub fn bytes(&self) -> usize {
        let trees = self.tree.iter().chain(&self.meshes);
        trees.map(Nodes::bytes).sum::<usize>() + self.instances.bytes()
    }

    /// Levels of nodes above the deepest leaf.
    pub fn depth(&self) -> usize {
        self.tree.as_ref().map_or(0, Nodes::depth)
    }

    /// The same with other boxes than the shapes' own: tests hold trees to boxes that are too small.
    pub fn with(
        all: &Simple,
        treed: Treed,
        change: impl Fn(Bounds) -> Bounds + Sync,
        threads: usize,
    ) -> (Simple, Bvh) {
        let Simple { planes, spheres, quads, rare, .. } = all.clone();
        let mut beside = Simple { planes, rare, ..Simple::default() };
        let mut items = pages::with_capacity(all.len());
        if treed == Treed::Meshes {
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
        // The triangles of a mesh all fit: its reader and its transform have been checked.
        triangles(&mut items, 0..all.triangles.placed());
        let tree_of = |mut items: Vec<Item>, members: Option<&Members>| {
            let splits = build(&mut items, threads);
            let things = match members {
                None => {
                    Things { spheres: &all.spheres, quads: &all.quads, rare: &[], triangles: &all.triangles }
                }
                Some(Members { spheres, quads, rare }) => {
                    Things { spheres, quads, rare, triangles: &all.triangles }
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
            if let Some(Members { spheres, quads, rare }) = members {
                // All of them fit: a scene that is checked has no group that reaches farther.
                let of_kind = |kind| {
                    let change = &change;
                    move |(i, bounds)| Item::new(&change(bounds), kind, i)
                };
                items.extend((0..).zip(spheres.iter().map(|(s, _)| s.bounds())).map(of_kind(SPHERE)));
                items.extend((0..).zip(quads.iter().map(|(q, _)| q.bounds())).map(of_kind(QUAD)));
                items.extend((0..).zip(rare.iter().map(|(r, _)| r.bounds())).map(of_kind(LONE)));
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

/// One tree, for workers that keep it in another form.
#[derive(Clone, Copy, Debug)]
pub struct Boxes<'a>(&'a Nodes);

impl<'a> Boxes<'a> {
    /// The root.
    pub fn root(self) -> Contents<'a> {
        self.0.contents(self.0.root)
    }

    /// The boxes of a node's children, and what they hold. A box is grown as [`Shape::bounds`] says.
    pub fn children(self, node: usize) -> [(Bounds, Contents<'a>); WIDTH] {
        self.0.children(node)
    }
}

impl Bvh {
    /// The tree in the world's own space, if anything is in it.
    pub fn boxes(&self) -> Option<Boxes<'_>> {
        self.tree.as_ref().map(Boxes)
    }

    /// The trees of the groups and of the shared meshes, each in its own space.
    pub fn shared(&self) -> impl Iterator<Item = Boxes<'_>> {
        self.meshes.iter().map(Boxes)
    }

    /// The share of a ray's origin by which it has to be moved beside the boxes of the tree in the world's own space:
    /// at least [`BOUNDS_ERROR`]. [`Instances::share_within`] is that in the others.
    pub fn share(&self) -> f32 {
        self.share
    }
}

fn item(bounds: Bounds, kind: u32, index: usize) -> Option<Item> {
    let Bounds { low, high } = bounds;
    let fits = low.iter().chain(&high).all(|x| x.abs() < FARTHEST);
    fits.then(|| Item::new(&bounds, kind, index as u32))
}
