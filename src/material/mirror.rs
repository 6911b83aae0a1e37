//! Mirrors.

use super::kind::Kind;
use super::lobes::SpecularReflection;
use super::program::Leaf;
use super::row::{Numbers, Row, Site, narrow};
use crate::math::Float;

/// Reflects perfectly, on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Mirror;

impl Mirror {
    /// The row of a mirror that reflects this fraction in each channel.
    pub fn row(reflectance: [f64; 3]) -> Row {
        Row::new(Kind::Mirror, narrow(reflectance))
    }
}

impl Leaf for Mirror {
    type Lobe<F: Float> = SpecularReflection<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> SpecularReflection<F> {
        SpecularReflection { reflectance: numbers.colour }
    }
}
