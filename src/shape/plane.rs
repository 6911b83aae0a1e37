//! The unbounded plane.

use super::{Bounds, Form, NOTHING, POSITION_ERROR, Shape, Surface};
use crate::math::{Float, Frame, Ray, Vec3};

/// All X with X·normal = distance (report §2.3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of length one.
    pub normal: [f32; 3],
    /// Signed distance from the origin along the normal.
    pub distance: f32,
}

/// Distance along a ray to the plane X·n = distance, or [`NOTHING`]: the division is left to make an
/// infinity or NaN of a parallel ray, which the comparison then refuses.
#[inline(always)]
pub(super) fn distance_to_plane<F: Float>(ray: &Ray<F>, n: Vec3<F>, distance: F) -> F {
    let t = (-ray.o.dot(n) + distance) / ray.d.dot(n);
    F::select(t.gt(F::zero()), t, F::splat(NOTHING))
}

impl Shape for Plane {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        distance_to_plane(ray, Vec3::splat(self.normal), F::splat(self.distance))
    }

    fn bounds(&self) -> Bounds {
        Bounds::EVERYTHING
    }

    fn surface(&self) -> Surface {
        // uv are lengths along the frame's axes from the point nearest the origin, where both vanish.
        let frame = Frame::<f32>::around(Vec3::splat(self.normal));
        Surface {
            form: Form::Flat,
            centre: [0.0; 3],
            radius: 0.0,
            anchor: [0.0; 3],
            to_centre: [0.0; 3],
            anchor_power: 0.0,
            normal: self.normal,
            distance: self.distance,
            error: POSITION_ERROR * self.distance.abs(),
            u_axis: [frame.s.x, frame.s.y, frame.s.z, 0.0],
            v_axis: [frame.t.x, frame.t.y, frame.t.z, 0.0],
            area: f32::INFINITY,
        }
    }
}
