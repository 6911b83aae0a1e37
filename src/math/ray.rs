//! Rays.

use super::{Float, Vec3};

/// A half-line R(t) = o + t·d, t > 0, with a direction of length one.
#[derive(Clone, Copy, Debug)]
pub struct Ray<F> {
    /// Origin.
    pub o: Vec3<F>,
    /// Direction, of length one.
    pub d: Vec3<F>,
}

impl<F: Float> Ray<F> {
    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: F) -> Vec3<F> {
        self.o + self.d * t
    }
}
