//! The sphere.

use super::{NOTHING, Shape, Surface, UNIT_ROUNDOFF};
use crate::math::{Float, Ray, Vec3};
use std::f32::consts::PI;

/// All X with |X − centre| = radius: hollow, so that light can pass (report §2.3.2.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// The centre.
    pub centre: [f32; 3],
    /// The radius, above zero.
    pub radius: f32,
}

impl Shape for Sphere {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        // t² + 2bt + c = 0 with b = m·d and c = m·m − r². The discriminant b² − c cancels when the sphere
        // is small and far; r² − |m − b·d|² does not (Haines, Günther and Akenine-Möller 2019, "Precision
        // Improvements for Ray/Sphere Intersection"), and neither does the smaller root as c/q.
        let m = ray.o - Vec3::splat(self.centre);
        let b = m.dot(ray.d);
        let c = m.dot(m) - self.radius * self.radius;
        let perpendicular = m - ray.d * b;
        let discriminant = -perpendicular.dot(perpendicular) + self.radius * self.radius;
        let root = discriminant.max(F::zero()).sqrt();
        let q = -b - root.copysign(b);
        let (t0, t1) = (c / q, q);
        // One of the roots is negative or the smaller one is nearer; a root at or before the origin is none.
        let (near, far) = (t0.min(t1), t0.max(t1));
        let zero = F::zero();
        let t = F::select(near.gt(zero), near, far);
        let hit = zero.le(discriminant) & t.gt(zero);
        F::select(hit, t, F::splat(NOTHING))
    }

    fn surface(&self) -> Surface {
        let extent = self.centre.iter().fold(0.0_f32, |m, x| m.max(x.abs())) + self.radius;
        Surface {
            centre: self.centre,
            radius: self.radius,
            normal: [0.0; 3],
            distance: 0.0,
            // Following the roundings of |p − centre| and of m·m − r² through to a distance gives at most
            // 6.5 roundings of r and one of the centre: 4 of their sum cover both, as |centre| ≥ r/2
            // whenever r is large against the coordinates of the hit, whose own share comes on top.
            error: 4.0 * UNIT_ROUNDOFF * extent,
            u_axis: [0.0; 4],
            v_axis: [0.0; 4],
            area: 4.0 * PI * self.radius * self.radius,
        }
    }
}
