//! Two worlds as one.

use super::{Hit, World};
use crate::math::{Float, Ray, Uint};

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
        let (a, b) = (self.first.intersect(ray), self.second.intersect(ray));
        let b_wins = b.t.lt(a.t) | (b.t.le(a.t) & b.surface.lt(a.surface));
        Hit { t: F::select(b_wins, b.t, a.t), surface: F::Uint::select(b_wins, b.surface, a.surface) }
    }

    #[inline(always)]
    fn occluded<F: Float>(&self, ray: &Ray<F>, t_max: F) -> F::Mask {
        self.first.occluded(ray, t_max) | self.second.occluded(ray, t_max)
    }
}
