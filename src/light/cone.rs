//! Spheres as they are seen from outside.

use crate::math::{Float, Vec3};
use std::f32::consts::FRAC_1_PI;

/// The cone of directions in which a point sees a sphere.
pub(super) struct Cone<F: Float> {
    /// Direction to the centre, of length one.
    pub(super) axis: Vec3<F>,
    /// Distance to the centre.
    pub(super) distance: F,
    /// 1 − cos of half the opening angle.
    pub(super) versine: F,
    /// Density of a uniform direction within, by solid angle.
    pub(super) pdf: F,
    /// Whether the point is outside the sphere; if not, nothing else here means anything.
    pub(super) outside: F::Mask,
}

impl<F: Float> Cone<F> {
    #[inline(always)]
    pub(super) fn new(to_centre: Vec3<F>, radius: F) -> Self {
        let distance2 = to_centre.dot(to_centre);
        let distance = distance2.sqrt();
        let sin2 = radius * radius / distance2;
        let outside = sin2.lt(F::splat(1.0));
        let cos = (-sin2 + 1.0).max(F::zero()).sqrt();
        // 1 − cos without cancellation, for a sphere that is far away.
        let versine = sin2 / (cos + 1.0);
        Cone {
            axis: to_centre * (F::splat(1.0) / distance),
            distance,
            versine,
            pdf: F::splat(0.5 * FRAC_1_PI) / versine,
            outside,
        }
    }
}
