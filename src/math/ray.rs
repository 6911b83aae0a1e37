//! Rays.

use super::{Float, Vec3, value};

/// A half-line R(t) = o + t·d, t > 0, with a direction of length one.
#[derive(Clone, Copy, Debug)]
pub struct Ray<F> {
    /// Origin.
    pub o: Vec3<F>,
    /// Direction, of length one.
    pub d: Vec3<F>,
    /// The time, as a fraction of the camera's shutter interval; 0 if nothing moves.
    pub time: F,
}

value!(Ray { o, d, time });

impl<F: Float> Ray<F> {
    /// The ray from an origin in a direction, at time 0.
    #[inline(always)]
    pub fn new(o: Vec3<F>, d: Vec3<F>) -> Self {
        Ray { o, d, time: F::zero() }
    }

    /// A placeholder of zeros.
    #[inline(always)]
    pub fn none() -> Self {
        Ray::new(Vec3::zero(), Vec3::zero())
    }

    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: F) -> Vec3<F> {
        self.o + self.d * t
    }

    /// The lanes whose coordinates are all finite: the product of an infinity or NaN is not finite either.
    /// Coordinates of 10³⁷ and more may count as infinite.
    #[inline(always)]
    pub fn is_finite(&self) -> F::Mask {
        self.o.dot(self.d).abs().lt(F::splat(f32::INFINITY))
    }
}
