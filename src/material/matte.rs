//! Matte: the same from wherever it is seen.

use super::kind::Kind;
use super::lobes::Lambertian;
use super::program::Leaf;
use super::row::{Numbers, Row, Site, narrow};
use crate::math::Float;

/// Scatters evenly, on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Matte;

impl Matte {
    /// The row of a material that reflects this fraction in each channel.
    pub fn row(reflectance: [f64; 3]) -> Row {
        Row::new(Kind::Matte, narrow(reflectance))
    }
}

impl Leaf for Matte {
    type Lobe<F: Float> = Lambertian<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> Lambertian<F> {
        Lambertian { reflectance: numbers.colour }
    }
}
