//! The compiled scene, and the intersection of rays with it.
//!
//! [`CompiledScene`] holds flat tables of everything that a path looks up. A [`World`] finds the first surface along a
//! ray, and tests whether there is one before a distance.
//!
//! | file | contents |
//! |---|---|
//! | `compile` | compilation of a scene description into tables |
//! | `size` | the limits of the tables |
//! | `extent` | the bounds of the scene |
//! | `simple` | the surfaces that every ray is tested against |
//! | `bvh` | bounding volume hierarchies of the other surfaces |
//! | `triangles` | the triangles of all meshes |
//! | `surface_list` | the surfaces in world space, and the area lights among them |
//! | `groups` | groups of the scene, which are stored once |
//! | `sharing` | the choice of meshes that are stored once |
//! | `instances` | the transforms of instances, and rays in their spaces |
//! | `surfaces` | the rows that hits look up: material, emission, normals, tangents, uv |
//! | `attributes` | the attributes of a surface other than its geometry |
//! | `custom` | normals, tangents and uv of hits on custom shapes |
//! | `modified` | the material of a hit, with mixes, holes, back sides and maps resolved |
//! | `interaction` | a hit with all inputs of scattering, and the rays that leave it |
//! | `bent` | shading normals bent to keep light on the correct side of a surface |
//! | `camera_media` | the dielectrics that contain the camera |
//! | `pages` | memory in large pages, and prefetching |

mod attributes;
mod bent;
mod bvh;
mod camera_media;
mod compile;
mod custom;
mod extent;
mod groups;
mod instances;
mod interaction;
mod modified;
mod pages;
mod sharing;
mod simple;
mod size;
mod surface_list;
mod surfaces;
mod triangles;

pub use attributes::SurfaceAttributes;
pub use bvh::{Boxes, Bvh, Contents, WIDTH as TREE_WIDTH};
pub use compile::{CompiledScene, compile, compile_sharing};
pub use extent::extent;
pub use instances::{InstanceTransform, Instances, Members, NO_INSTANCE, RAY_ERROR};
pub use interaction::{Interaction, Uv};
pub use sharing::SHARING_PAYS_FROM;
pub use simple::Simple;
pub use size::{MOST_PRIMITIVES, MOST_VERTICES, Size, TooLarge};
pub use surfaces::{SurfacePoint, SurfaceTable};
pub use triangles::{Corners, FIRST_TRIANGLE, Triangles};

use crate::math::lanes::Device;
use crate::math::{Float, LaneFloat, Ray, Uint, value};
use crate::shape::NOTHING;

/// The choice of accelerator. The image does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AcceleratorChoice {
    /// The fastest for the number of surfaces.
    #[default]
    Fastest,
    /// None: every ray is tested against every surface.
    Simple,
    /// A bounding volume hierarchy of all bounded surfaces.
    Bvh,
}

/// Former name of [`AcceleratorChoice`].
#[deprecated(note = "renamed to `AcceleratorChoice`")]
pub type Finder = AcceleratorChoice;

/// The bounded surfaces that go into a tree. Every ray is tested against the others, in all lanes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TreeScope {
    /// None: there is no tree.
    Nothing,
    /// Triangles and instances of meshes and groups.
    Meshes,
    /// All bounded surfaces.
    Everything,
}

impl AcceleratorChoice {
    /// The surfaces that go into a tree with this choice.
    pub fn tree_scope(self, surfaces: &Simple) -> TreeScope {
        // Testing a quad or a triangle takes about twice as long as testing a sphere.
        let others = surfaces.spheres.len() + 2 * surfaces.quads.len();
        let placed = surfaces.instances.len() + surfaces.instances.tests_of_groups();
        let all = others + 2 * (surfaces.triangles.len() + placed);
        match self {
            AcceleratorChoice::Simple => TreeScope::Nothing,
            AcceleratorChoice::Fastest if all < TREE_PAYS_FROM => TreeScope::Nothing,
            AcceleratorChoice::Fastest if others < BESIDE_UP_TO => TreeScope::Meshes,
            AcceleratorChoice::Fastest | AcceleratorChoice::Bvh => TreeScope::Everything,
        }
    }
}

/// The number of spheres from which a tree is faster than testing all of them: about 70 for sixteen lanes and 40 for
/// eight. For quads, which count twice, it is 35 and 28.
const TREE_PAYS_FROM: usize = 56;

/// The number of spheres below which testing all of them is faster if there is a tree of meshes anyway: rays with a
/// near hit then need not enter the tree.
const BESIDE_UP_TO: usize = 24;

/// The first hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit<F: Float> {
    /// Distance along the ray; infinite without a hit.
    pub t: F,
    /// The surface's number: its row in the [`SurfaceTable`], or [`FIRST_TRIANGLE`] plus the triangle's index in
    /// [`Triangles`]. Unspecified without a hit.
    pub surface: F::Uint,
    /// [`NO_INSTANCE`], or one more than the index in [`Instances`] of the instance that is hit. A surface's number is
    /// the same in all instances of its mesh or group.
    pub instance: F::Uint,
    /// The barycentric weights of the second and the third corner of the triangle that is hit; zero on other surfaces.
    pub weights: [F; 2],
}

value!(Hit { t, surface, instance, weights });

impl<F: Float> Hit<F> {
    /// No hit.
    #[inline(always)]
    pub fn none() -> Self {
        let instance = F::Uint::splat(NO_INSTANCE);
        Hit { t: F::splat(NOTHING), surface: F::Uint::splat(u32::MAX), instance, weights: [F::zero(); 2] }
    }

    /// The nearer of two hits. At equal distances the lower instance wins, and then the lower surface, so that the
    /// result does not depend on the order of tests.
    #[inline(always)]
    pub fn nearer(self, other: Self) -> Self {
        let same = other.instance.eq(self.instance);
        let lower = other.instance.lt(self.instance) | (same & other.surface.lt(self.surface));
        let other_wins = other.t.lt(self.t) | (other.t.le(self.t) & lower);
        Hit {
            t: F::select(other_wins, other.t, self.t),
            surface: F::Uint::select(other_wins, other.surface, self.surface),
            instance: F::Uint::select(other_wins, other.instance, self.instance),
            weights: [
                F::select(other_wins, other.weights[0], self.weights[0]),
                F::select(other_wins, other.weights[1], self.weights[1]),
            ],
        }
    }

    /// The lanes with a hit.
    #[inline(always)]
    pub fn is_some(&self) -> F::Mask {
        self.t.lt(F::splat(f32::INFINITY))
    }
}

/// All surfaces that rays can hit: surfaces that every ray is tested against, and a tree of the others.
///
/// The tree is optional at run time, so that integrators are compiled once. A separate function traverses it for a
/// whole packet of rays, so that the branch is taken once per packet.
#[derive(Clone, Debug)]
pub struct World {
    /// The surfaces that every ray is tested against.
    pub simple: Simple,
    /// The others, if a tree is worthwhile.
    pub tree: Option<Bvh>,
}

impl World {
    /// A world of surfaces, with or without a tree according to `accelerator`.
    pub fn new(surfaces: &Simple, accelerator: AcceleratorChoice) -> World {
        World::with_tree_scope(surfaces, accelerator.tree_scope(surfaces))
    }

    /// As [`Self::new`], with these surfaces in a tree.
    pub fn with_tree_scope(surfaces: &Simple, tree_scope: TreeScope) -> World {
        World::with_build_threads(
            surfaces,
            tree_scope,
            std::thread::available_parallelism().map_or(1, |n| n.get()),
        )
    }

    /// As [`Self::with_tree_scope`], with a number of threads to build the tree. The tree does not depend on that
    /// number.
    pub fn with_build_threads(surfaces: &Simple, tree_scope: TreeScope, threads: usize) -> World {
        if tree_scope == TreeScope::Nothing {
            return World { simple: surfaces.clone(), tree: None };
        }
        let (simple, tree) = Bvh::of(surfaces, tree_scope, threads);
        World { simple, tree: Some(tree) }
    }

    /// The first hit of each ray. At equal distances the lower instance wins, and then the lower surface. The hits of
    /// lanes outside `active` are unspecified.
    #[inline(always)]
    pub fn intersect<F: Float>(&self, ray: &Ray<F>, active: F::Mask) -> Hit<F> {
        F::device(&Intersect(self), (*ray, active))
    }

    /// [`Self::intersect`] in a function of its own, which is compiled once for each level: for rays that few scenes or
    /// few renders have, such as shadow rays through holes and those of layers.
    #[inline(always)]
    pub fn intersect_apart<F: Float>(&self, ray: &Ray<F>, active: F::Mask) -> Hit<F> {
        let ray = *ray;
        F::out_of_line(
            #[inline(always)]
            move || self.intersect(&ray, active),
        )
    }

    /// The lanes whose rays have a hit before the distance `t_max`. Lanes in `ignores_meshes` ignore hits on meshes.
    /// The results of lanes outside `active` are unspecified.
    #[inline(always)]
    pub fn occluded<F: Float>(
        &self,
        ray: &Ray<F>,
        t_max: F,
        active: F::Mask,
        ignores_meshes: F::Mask,
    ) -> F::Mask {
        F::device(&Occluded(self), (*ray, t_max, active, ignores_meshes))
    }
}

/// Marks a branch as cold, so that registers are saved there and not on the common path.
#[cold]
fn rarely() {}

/// [`World::intersect`].
struct Intersect<'a>(&'a World);

impl Device for Intersect<'_> {
    const NAME: &'static str = "intersect";
    type Arguments<F: Float> = (Ray<F>, F::Mask);
    type Output<F: Float> = Hit<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (ray, active): Self::Arguments<F>) -> Hit<F> {
        let hit = self.0.simple.intersect(&ray);
        match &self.0.tree {
            None => hit,
            Some(tree) => hit.nearer(tree.intersect_within(&ray, hit.t, active)),
        }
    }
}

/// [`World::occluded`].
struct Occluded<'a>(&'a World);

impl Device for Occluded<'_> {
    const NAME: &'static str = "occluded";
    type Arguments<F: Float> = (Ray<F>, F, F::Mask, F::Mask);
    type Output<F: Float> = F::Mask;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (ray, t_max, active, ignores_meshes): Self::Arguments<F>) -> F::Mask {
        let found = self.0.simple.occluded(&ray, t_max, ignores_meshes);
        match &self.0.tree {
            None => found,
            Some(tree) => found | tree.occluded(&ray, t_max, active & !found, ignores_meshes),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;
    use glam::DVec3;

    #[test]
    fn small_scenes_have_no_tree() {
        let spheres = |count: usize| {
            let sphere = (Sphere::new(DVec3::ZERO, 1.0), 0);
            Simple { spheres: vec![sphere; count], ..Simple::default() }
        };
        for (accelerator, count, tree_scope) in [
            (AcceleratorChoice::Fastest, 3, TreeScope::Nothing),
            (AcceleratorChoice::Fastest, 1000, TreeScope::Everything),
            (AcceleratorChoice::Bvh, 3, TreeScope::Everything),
            (AcceleratorChoice::Simple, 1000, TreeScope::Nothing),
        ] {
            assert_eq!(
                accelerator.tree_scope(&spheres(count)),
                tree_scope,
                "{accelerator:?}, {count} spheres"
            );
        }
    }
}
