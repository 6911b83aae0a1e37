//! The world that tries every surface.

use super::{FIRST_TRIANGLE, Hit, Triangles, World};
use crate::math::{Float, Mask, Ray, Uint, Vec3};
use crate::shape::{Plane, Quad, Shape, Shears, Sphere};
use std::sync::Arc;

/// Tries every surface, kind by kind (report §5.2.4, `SimpleWorld`): the fastest for a handful.
#[derive(Clone, Debug, Default)]
pub struct Simple {
    /// The planes, each with its row in the surface table, in ascending order of rows.
    pub planes: Vec<(Plane, u32)>,
    /// The spheres likewise.
    pub spheres: Vec<(Sphere, u32)>,
    /// The quads likewise.
    pub quads: Vec<(Quad, u32)>,
    /// The triangles of all meshes.
    pub triangles: Arc<Triangles>,
}

impl Simple {
    /// How many surfaces there are.
    pub fn len(&self) -> usize {
        self.planes.len() + self.spheres.len() + self.quads.len() + self.triangles.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The first hit among those so far and shapes of one kind, which stand in the order of their rows: of equal
/// distances among them the first one counts.
#[inline(always)]
fn closest<F: Float, S: Shape>(shapes: &[(S, u32)], ray: &Ray<F>, so_far: Hit<F>) -> Hit<F> {
    let mut hit = Hit::none();
    for (shape, row) in shapes {
        let t = shape.intersect(ray);
        let nearer = t.lt(hit.t);
        hit.t = F::select(nearer, t, hit.t);
        hit.surface = F::Uint::select(nearer, F::Uint::splat(*row), hit.surface);
    }
    if shapes.is_empty() { so_far } else { so_far.nearer(hit) }
}

#[inline(always)]
fn any<F: Float, S: Shape>(shapes: &[(S, u32)], ray: &Ray<F>, t_max: F, mut found: F::Mask) -> F::Mask {
    for (shape, _) in shapes {
        found = found | shape.intersect(ray).lt(t_max);
    }
    found
}

/// Distances to the triangles, each with its index.
#[inline(always)]
fn each_triangle<F: Float>(triangles: &Triangles, ray: &Ray<F>, mut found: impl FnMut(F, u32)) {
    if triangles.is_empty() {
        return;
    }
    let shears = Shears::new(ray);
    for triangle in 0..triangles.len() {
        let corners = triangles.positions_of(triangle).map(Vec3::splat);
        found(shears.meet(corners).t, triangle as u32);
    }
}

impl World for Simple {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>, _asks: F::Mask) -> Hit<F> {
        let hit = closest(&self.planes, ray, Hit::none());
        let hit = closest(&self.spheres, ray, hit);
        let mut hit = closest(&self.quads, ray, hit);
        // Triangles come last and in the order of their numbers: the first of equal distances counts.
        each_triangle(&self.triangles, ray, |t, triangle| {
            let nearer = t.lt(hit.t);
            hit.t = F::select(nearer, t, hit.t);
            hit.surface = F::Uint::select(nearer, F::Uint::splat(FIRST_TRIANGLE | triangle), hit.surface);
        });
        hit
    }

    #[inline(always)]
    fn occluded<F: Float>(&self, ray: &Ray<F>, t_max: F, _asks: F::Mask) -> F::Mask {
        let none = F::Mask::splat(false);
        let found = any(&self.planes, ray, t_max, none);
        let found = any(&self.spheres, ray, t_max, found);
        let mut found = any(&self.quads, ray, t_max, found);
        each_triangle(&self.triangles, ray, |t, _| found = found | t.lt(t_max));
        found
    }
}
