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
    fn intersect<F: Float>(&self, ray: &Ray<F>, asks: F::Mask) -> Hit<F> {
        self.first.intersect(ray, asks).nearer(self.second.intersect(ray, asks))
    }

    #[inline(always)]
    fn occluded<F: Float>(&self, ray: &Ray<F>, t_max: F, asks: F::Mask) -> F::Mask {
        let found = self.first.occluded(ray, t_max, asks);
        found | self.second.occluded(ray, t_max, asks & !found)
    }
}
