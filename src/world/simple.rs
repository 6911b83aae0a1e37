//! Surfaces that every ray is tested against.

use super::{FIRST_TRIANGLE, Hit, Instances, Members, NO_INSTANCE, Triangles, rarely};
use crate::math::lanes::{Kernel, MAX_LANES};
use crate::math::{LaneFloat, LaneMask, LaneUint, Mask, Ray, Uint, Vec3};
use crate::shape::{CustomShape, NOTHING, Plane, Quad, Shape, ShearedRays, Sphere, TriangleHit};
use std::ops::Range;
use std::sync::Arc;

/// Tests every surface, kind by kind (report §5.2.4, `SimpleWorld`), which is the fastest way for few surfaces.
#[derive(Clone, Debug, Default)]
pub struct Simple {
    /// The planes, each with its row in the surface table, in ascending order of rows.
    pub planes: Vec<(Plane, u32)>,
    /// The spheres, in the same form.
    pub spheres: Vec<(Sphere, u32)>,
    /// The quads, in the same form.
    pub quads: Vec<(Quad, u32)>,
    /// The custom shapes, in the same form.
    pub custom: Vec<(CustomShape, u32)>,
    /// The triangles of all meshes.
    pub triangles: Arc<Triangles>,
    /// The groups, the shared meshes, and their instances.
    pub instances: Arc<Instances>,
}

impl Simple {
    /// The number of surfaces.
    pub fn len(&self) -> usize {
        let Simple { planes, spheres, quads, custom, triangles, instances } = self;
        planes.len() + spheres.len() + quads.len() + custom.len() + triangles.placed() + instances.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The first of a previous hit and the hits on shapes of one kind, which are in the order of their rows: among equal
/// distances the first one wins.
#[inline(always)]
fn closest<F: LaneFloat, S: Shape>(shapes: &[(S, u32)], ray: &Ray<F>, so_far: Hit<F>) -> Hit<F> {
    closest_by(
        shapes,
        so_far,
        NO_INSTANCE,
        #[inline(always)]
        |shape| shape.intersect(ray),
    )
}

/// The same for shapes of an instance, with a given test.
#[inline(always)]
fn closest_by<F: LaneFloat, S>(
    shapes: &[(S, u32)],
    so_far: Hit<F>,
    instance: u32,
    intersect: impl Fn(&S) -> F,
) -> Hit<F> {
    let mut hit = Hit { instance: F::Uint::splat(instance), ..Hit::none() };
    for (shape, row) in shapes {
        let t = intersect(shape);
        let nearer = t.lt(hit.t);
        hit.t = F::select(nearer, t, hit.t);
        hit.surface = F::Uint::select(nearer, F::Uint::splat(*row), hit.surface);
    }
    if shapes.is_empty() { so_far } else { so_far.nearer(hit) }
}

#[inline(always)]
fn any<F: LaneFloat, S: Shape>(shapes: &[(S, u32)], ray: &Ray<F>, t_max: F, mut found: F::Mask) -> F::Mask {
    for (shape, _) in shapes {
        found = found | shape.intersect(ray).lt(t_max);
    }
    found
}

/// The test against all surfaces in scenes with custom shapes or instances. It is a separate function, so that other
/// scenes contain no code for these.
struct TestAll<'a> {
    world: &'a Simple,
    /// The rays' origins and directions, one column for each coordinate.
    ray: [[f32; MAX_LANES]; 6],
    /// Bit `i` is set if lane `i` ignores meshes.
    ignores_meshes: u32,
}

impl<'a> TestAll<'a> {
    #[inline(always)]
    fn new<F: LaneFloat>(world: &'a Simple, ray: &Ray<F>, ignores_meshes: F::Mask) -> TestAll<'a> {
        let mut columns = [[0.0; MAX_LANES]; 6];
        for (column, x) in columns.iter_mut().zip([ray.o.x, ray.o.y, ray.o.z, ray.d.x, ray.d.y, ray.d.z]) {
            x.store(column);
        }
        TestAll { world, ray: columns, ignores_meshes: ignores_meshes.bits() }
    }
}

/// The first hit of each lane.
struct Found {
    t: [f32; MAX_LANES],
    surface: [u32; MAX_LANES],
    instance: [u32; MAX_LANES],
    weights: [[f32; MAX_LANES]; 2],
}

impl Kernel for TestAll<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Found {
        let [ox, oy, oz, dx, dy, dz] = &self.ray;
        let o = Vec3::new(F::load(ox), F::load(oy), F::load(oz));
        // Time is left out, as nothing moves.
        let ray = Ray::new(o, Vec3::new(F::load(dx), F::load(dy), F::load(dz)));
        let ignores_meshes = F::Mask::from_bits(self.ignores_meshes);
        let hit = closest(&self.world.custom, &ray, self.world.closest_common(&ray, ignores_meshes));
        let hit = self.world.closest_placed(&ray, ignores_meshes, hit);
        let nothing = [0; MAX_LANES];
        let weights = [[0.0; MAX_LANES]; 2];
        let mut found = Found { t: [NOTHING; MAX_LANES], surface: nothing, instance: nothing, weights };
        hit.t.store(&mut found.t);
        hit.surface.store(&mut found.surface);
        hit.instance.store(&mut found.instance);
        hit.weights[0].store(&mut found.weights[0]);
        hit.weights[1].store(&mut found.weights[1]);
        found
    }
}

/// Tests rays against some triangles, and calls `found` for each with its index.
#[inline(always)]
fn each_triangle<F: LaneFloat>(
    triangles: &Triangles,
    range: Range<usize>,
    ray: &Ray<F>,
    mut found: impl FnMut(TriangleHit<F>, u32),
) {
    if range.is_empty() {
        return;
    }
    let shears = ShearedRays::new(ray);
    for triangle in range {
        let corners = triangles.positions_of(triangle).map(Vec3::splat);
        found(shears.intersect(corners, triangles.has_needles), triangle as u32);
    }
}

impl Simple {
    /// The first hit on all surfaces, including custom shapes and instances. Lanes in `ignores_meshes` ignore triangles.
    #[inline(always)]
    fn closest_of_all<F: LaneFloat>(&self, ray: &Ray<F>, ignores_meshes: F::Mask) -> Hit<F> {
        let found = &F::outlined(TestAll::new(self, ray, ignores_meshes));
        Hit {
            t: F::load(&found.t),
            surface: F::Uint::load(&found.surface),
            instance: F::Uint::load(&found.instance),
            weights: [F::load(&found.weights[0]), F::load(&found.weights[1])],
        }
    }

    /// The first hit on all surfaces but custom shapes and instances.
    #[inline(always)]
    fn closest_common<F: LaneFloat>(&self, ray: &Ray<F>, ignores_meshes: F::Mask) -> Hit<F> {
        let hit = closest(&self.planes, ray, Hit::none());
        let hit = closest(&self.spheres, ray, hit);
        let mut hit = closest(&self.quads, ray, hit);
        // Triangles come last, in the order of their numbers: among equal distances the first one wins.
        each_triangle(
            &self.triangles,
            0..self.triangles.placed(),
            ray,
            #[inline(always)]
            |meeting, triangle| take_nearer(&mut hit, meeting, ignores_meshes, NO_INSTANCE, triangle),
        );
        hit
    }

    /// The first of a previous hit and the hits on instances, with ties resolved as in [`Hit::nearer`].
    #[inline(always)]
    fn closest_placed<F: LaneFloat>(&self, ray: &Ray<F>, ignores_meshes: F::Mask, mut hit: Hit<F>) -> Hit<F> {
        for (instance, &thing) in self.instances.mesh.iter().enumerate() {
            let ray = &self.instances.splat::<F>(instance).ray(ray);
            let instance = instance as u32 + 1;
            if let Some(Members { spheres, quads, custom }) = self.instances.groups.get(thing as usize) {
                hit = closest_by(
                    spheres,
                    hit,
                    instance,
                    #[inline(always)]
                    |sphere| sphere.lanes().intersect_any_length(ray),
                );
                hit = closest_by(
                    quads,
                    hit,
                    instance,
                    #[inline(always)]
                    |quad| quad.intersect(ray),
                );
                hit = closest_by(
                    custom,
                    hit,
                    instance,
                    #[inline(always)]
                    |custom| custom.intersect(ray),
                );
            }
            each_triangle(
                &self.triangles,
                self.instances.meshes[thing as usize].clone(),
                ray,
                #[inline(always)]
                |meeting, triangle| take_nearer(&mut hit, meeting, ignores_meshes, instance, triangle),
            );
        }
        hit
    }
}

/// Takes the hit on a triangle where it is nearer than the previous one.
#[inline(always)]
fn take_nearer<F: LaneFloat>(
    hit: &mut Hit<F>,
    TriangleHit { t, weights }: TriangleHit<F>,
    ignores_meshes: F::Mask,
    instance: u32,
    triangle: u32,
) {
    let nearer = t.lt(hit.t) & !ignores_meshes;
    if nearer.any() {
        let surface = F::Uint::splat(FIRST_TRIANGLE | triangle);
        hit.t = F::select(nearer, t, hit.t);
        hit.surface = F::Uint::select(nearer, surface, hit.surface);
        hit.instance = F::Uint::select(nearer, F::Uint::splat(instance), hit.instance);
        hit.weights[0] = F::select(nearer, weights[0], hit.weights[0]);
        hit.weights[1] = F::select(nearer, weights[1], hit.weights[1]);
    }
}

impl Simple {
    /// The first hit of each ray: see [`World::intersect`](super::World::intersect).
    #[inline(always)]
    pub fn intersect<F: LaneFloat>(&self, ray: &Ray<F>) -> Hit<F> {
        let none = F::Mask::splat(false);
        if !self.custom.is_empty() || !self.instances.is_empty() {
            rarely();
            return self.closest_of_all(ray, none);
        }
        self.closest_common(ray, none)
    }

    /// The lanes whose rays hit anything: see [`World::occluded`](super::World::occluded).
    #[inline(always)]
    pub fn occluded<F: LaneFloat>(&self, ray: &Ray<F>, t_max: F, ignores_meshes: F::Mask) -> F::Mask {
        if !self.custom.is_empty() || !self.instances.is_empty() {
            rarely();
            return self.closest_of_all(ray, ignores_meshes).t.lt(t_max);
        }
        let none = F::Mask::splat(false);
        let found = any(&self.planes, ray, t_max, none);
        let found = any(&self.spheres, ray, t_max, found);
        let mut found = any(&self.quads, ray, t_max, found);
        each_triangle(
            &self.triangles,
            0..self.triangles.placed(),
            ray,
            #[inline(always)]
            |meeting, _| found = found | (meeting.t.lt(t_max) & !ignores_meshes),
        );
        found
    }
}
