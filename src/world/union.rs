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
    fn intersect_within<F: Float>(&self, ray: &Ray<F>, t_max: F, asks: F::Mask) -> Hit<F> {
        let first = self.first.intersect_within(ray, t_max, asks);
        first.nearer(self.second.intersect_within(ray, first.t.min(t_max), asks))
    }

    #[inline(always)]
    fn occluded<F: Float>(&self, ray: &Ray<F>, t_max: F, asks: F::Mask, past_triangles: F::Mask) -> F::Mask {
        let found = self.first.occluded(ray, t_max, asks, past_triangles);
        found | self.second.occluded(ray, t_max, asks & !found, past_triangles)
    }
}
