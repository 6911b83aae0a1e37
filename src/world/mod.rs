//! The compiled scene, and the intersection of rays with it.
//!
//! [`CompiledScene`] holds flat tables of everything that a path looks up. A [`World`] finds the first of its surfaces
//! along a ray, and whether there is any before a distance.
//!
//! | file | what is in it |
//! |---|---|
//! | `compile` | from the description of a scene to its tables |
//! | `size` | the limits of these tables |
//! | `extent` | the box around everything bounded |
//! | `simple` | the surfaces that every ray is tested against |
//! | `bvh` | trees of boxes over the other surfaces |
//! | `triangles` | the triangles of all meshes |
//! | `listing` | the surfaces of the world itself, and the lights that they are |
//! | `groups` | what is kept once of each group of the scene |
//! | `sharing` | the choice of meshes that are kept once |
//! | `instances` | the places where these stand, and rays in their own space |
//! | `surfaces` | the rows that hits look up: material, emission, normals, tangents, uv |
//! | `look` | what such a row says besides the form |
//! | `rare` | normals, tangents and uv of hits on shapes of which most scenes have none |
//! | `modified` | the material of a hit where it is one of several, has holes or has a map |
//! | `interaction` | a hit with all that scattering depends on, and the rays that leave it |
//! | `bent` | normals that are bent, so that light is scattered to the right side of a surface |
//! | `submerged` | the dielectrics that a camera is inside of |
//! | `pages` | memory in large pages, and prefetching |

mod bent;
mod bvh;
mod compile;
mod extent;
mod groups;
mod instances;
mod interaction;
mod listing;
mod look;
mod modified;
mod pages;
mod rare;
mod sharing;
mod simple;
mod size;
mod submerged;
mod surfaces;
mod triangles;

pub use bvh::{Boxes, Bvh, Contents, WIDTH as TREE_WIDTH};
pub use compile::{CompiledScene, compile, compile_sharing};
pub use extent::extent;
pub use instances::{Instances, Members, NO_INSTANCE, Place, RAY_ERROR};
pub use interaction::{Interaction, Uv};
pub use look::Look;
pub use sharing::SHARING_PAYS_FROM;
pub use simple::Simple;
pub use size::{MOST_PRIMITIVES, MOST_VERTICES, Size, TooLarge};
pub use surfaces::{SurfacePoint, SurfaceTable};
pub use triangles::{Corners, FIRST_TRIANGLE, Triangles};

use crate::math::lanes::Device;
use crate::math::{Float, LaneFloat, Ray, Uint, value};
use crate::shape::NOTHING;

/// How the surfaces that rays meet are found. The picture is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Finder {
    /// The fastest way for the number of surfaces.
    #[default]
    Fastest,
    /// By testing every surface.
    Simple,
    /// By a tree of all surfaces that it can hold.
    Bvh,
}

/// Which of the bounded surfaces go into a tree. Every ray is tested against the others, all lanes at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treed {
    /// Nothing: no tree is worth it.
    Nothing,
    /// Triangles and instances of meshes and groups.
    Meshes,
    /// Everything.
    Everything,
}

impl Finder {
    /// Which of these surfaces go into a tree.
    pub fn treed(self, surfaces: &Simple) -> Treed {
        // Testing a quad or a triangle takes about twice as long as testing a sphere.
        let others = surfaces.spheres.len() + 2 * surfaces.quads.len();
        let placed = surfaces.instances.len() + surfaces.instances.tests_of_groups();
        let all = others + 2 * (surfaces.triangles.len() + placed);
        match self {
            Finder::Simple => Treed::Nothing,
            Finder::Fastest if all < TREE_PAYS_FROM => Treed::Nothing,
            Finder::Fastest if others < BESIDE_UP_TO => Treed::Meshes,
            Finder::Fastest | Finder::Bvh => Treed::Everything,
        }
    }
}

/// The number of spheres from which on a tree is faster than testing them all: about 70 for sixteen paths side by side,
/// 40 for eight; 35 and 28 if they are quads, which count as two each.
const TREE_PAYS_FROM: usize = 56;

/// The number of spheres up to which testing them all is faster where there is a tree of meshes anyway: rays that have
/// a near hit then need not enter the tree.
const BESIDE_UP_TO: usize = 24;

/// The first hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit<F: Float> {
    /// Distance along the ray; infinite where nothing is met.
    pub t: F,
    /// The surface's number: its row in the [`SurfaceTable`], or [`FIRST_TRIANGLE`] and the triangle's index in
    /// [`Triangles`]; meaningless where nothing is met.
    pub surface: F::Uint,
    /// [`NO_INSTANCE`], or one more than the index in [`Instances`] of that of which a surface is met. That surface's
    /// number is the same in all instances of a mesh or group.
    pub instance: F::Uint,
    /// The weights of the second and the third corner of the triangle that is met; zero on other surfaces.
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

    /// The nearer of two hits. At equal distances it is the one of the lower instance, and then of the lower surface,
    /// so that the result does not depend on the order of tests.
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

    /// The lanes that met something.
    #[inline(always)]
    pub fn is_some(&self) -> F::Mask {
        self.t.lt(F::splat(f32::INFINITY))
    }
}

/// Everything that rays can meet: surfaces that every ray is tested against, and a tree of the others.
///
/// Whether there is a tree is a value and not a type, so that integrators are compiled once. A function of its own
/// searches it for a whole packet of rays, so that the branch is taken once a packet.
#[derive(Clone, Debug)]
pub struct World {
    /// The surfaces that every ray is tested against.
    pub simple: Simple,
    /// The others, if a tree is worth it.
    pub tree: Option<Bvh>,
}

impl World {
    /// The world of some surfaces, with or without a tree as `finder` says.
    pub fn new(surfaces: &Simple, finder: Finder) -> World {
        World::with_tree_of(surfaces, finder.treed(surfaces))
    }

    /// The same with these surfaces in a tree.
    pub fn with_tree_of(surfaces: &Simple, treed: Treed) -> World {
        World::built_by(surfaces, treed, std::thread::available_parallelism().map_or(1, |n| n.get()))
    }

    /// The same, with a given number of threads to build the tree. It does not depend on that number.
    pub fn built_by(surfaces: &Simple, treed: Treed, threads: usize) -> World {
        if treed == Treed::Nothing {
            return World { simple: surfaces.clone(), tree: None };
        }
        let (simple, tree) = Bvh::of(surfaces, treed, threads);
        World { simple, tree: Some(tree) }
    }

    /// The first hit of each ray. Equal distances go to the lower instance, and then to the lower surface. The hits
    /// of lanes outside `asks` are unspecified.
    #[inline(always)]
    pub fn intersect<F: Float>(&self, ray: &Ray<F>, asks: F::Mask) -> Hit<F> {
        F::device(&Intersect(self), (*ray, asks))
    }

    /// The lanes whose ray has a hit before the distance `t_max`. For lanes in `past_triangles`, hits on meshes do not
    /// count. The results of lanes outside `asks` are unspecified.
    #[inline(always)]
    pub fn occluded<F: Float>(
        &self,
        ray: &Ray<F>,
        t_max: F,
        asks: F::Mask,
        past_triangles: F::Mask,
    ) -> F::Mask {
        F::device(&Occluded(self), (*ray, t_max, asks, past_triangles))
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
    fn run<F: LaneFloat>(&self, (ray, asks): Self::Arguments<F>) -> Hit<F> {
        let hit = self.0.simple.intersect(&ray);
        match &self.0.tree {
            None => hit,
            Some(tree) => hit.nearer(tree.intersect_within(&ray, hit.t, asks)),
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
    fn run<F: LaneFloat>(&self, (ray, t_max, asks, past_triangles): Self::Arguments<F>) -> F::Mask {
        let found = self.0.simple.occluded(&ray, t_max, past_triangles);
        match &self.0.tree {
            None => found,
            Some(tree) => found | tree.occluded(&ray, t_max, asks & !found, past_triangles),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Sphere;
    use glam::DVec3;

    #[test]
    fn few_surfaces_stay_out_of_trees() {
        let spheres = |count: usize| {
            let sphere = (Sphere::new(DVec3::ZERO, 1.0), 0);
            Simple { spheres: vec![sphere; count], ..Simple::default() }
        };
        for (finder, count, treed) in [
            (Finder::Fastest, 3, Treed::Nothing),
            (Finder::Fastest, 1000, Treed::Everything),
            (Finder::Bvh, 3, Treed::Everything),
            (Finder::Simple, 1000, Treed::Nothing),
        ] {
            assert_eq!(finder.treed(&spheres(count)), treed, "{finder:?}, {count} spheres");
        }
    }
}
