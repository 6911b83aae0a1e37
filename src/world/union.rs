//! Two worlds as one.

use super::{Hit, World};
use crate::math::{Float, Ray};

/// Whatever either of two worlds holds (report §5.2.4, `UnionWorld`): unbounded surfaces beside a structure
/// that can only hold bounded ones.
#[derive(Clone, Debug)]
pub struct Union<A, B> {
    /// One world.
    pub first: A,
    /// The other.
    pub second: B,
}

impl<A: World, B: World> World for Union<A, B> {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> Hit<F> {
        self.first.intersect(ray).nearer(self.second.intersect(ray))
    }

    #[inline(always)]
    fn occluded<F: Float>(&self, ray: &Ray<F>, t_max: F) -> F::Mask {
        self.first.occluded(ray, t_max) | self.second.occluded(ray, t_max)
    }
}
