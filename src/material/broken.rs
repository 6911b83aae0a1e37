//! A material for testing the rejection of invalid samples.

use super::bxdf::{Bxdf, BxdfSample, TransportMode};
use super::kind::Kind;
use super::lobes::Lambertian;
use super::program::{Leaf, MaterialParameters};
use super::row::{Numbers, Row, Site};
use crate::math::{Float, Rgb, Uint, Vec3, value};
use crate::parameter::parameters;

parameters! {
    /// Returns NaN, infinity and −1 in turn, for testing the rejection of invalid samples.
    pub struct BrokenParameters: "broken", "a broken material" {}
    hidden = true;
}

/// Returns invalid samples.
#[derive(Clone, Copy, Debug)]
pub struct Broken;

impl Broken {
    /// The weights of its samples, one for each third of the range of numbers that choose the lobe.
    pub const WEIGHTS: [f32; 3] = [f32::NAN, f32::INFINITY, -1.0];
}

impl MaterialParameters for BrokenParameters {
    fn row(&self) -> Row {
        Row::new(Kind::Broken, [1.0; 3])
    }
}

impl Leaf for Broken {
    type Lobe<F: Float> = Impossible<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> Impossible<F> {
        Impossible { directions: Lambertian { reflectance: numbers.colour } }
    }
}

/// Scatters like a matte surface, with [`Broken::WEIGHTS`].
#[derive(Clone, Copy, Debug)]
pub struct Impossible<F> {
    directions: Lambertian<F>,
}

value!(Impossible { directions });

impl<F: Float> Bxdf<F> for Impossible<F> {
    // No light is sampled: invalid values come only from the sampled directions.
    const HAS_NON_DELTA: bool = false;
    const HAS_DELTA: bool = true;

    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F> {
        let [first, second, third] = Broken::WEIGHTS;
        let (first, second, third) = (by_bits::<F>(first), by_bits(second), by_bits(third));
        let later = F::select(lobe.lt(F::splat(2.0 / 3.0)), second, third);
        let weight = F::select(lobe.lt(F::splat(1.0 / 3.0)), first, later);
        let sample = self.directions.sample(wo, u, lobe, mode);
        BxdfSample { weight: Rgb::new(weight, weight, weight), ..sample }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.directions.albedo()
    }
}

/// A number by its bits, because recorded programs have no name for infinity.
#[inline(always)]
fn by_bits<F: Float>(number: f32) -> F {
    F::from_bits(F::Uint::splat(number.to_bits()))
}
