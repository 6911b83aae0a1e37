//! The matte material, of the same radiance in all directions.

use super::kind::Kind;
use super::lobes::Lambertian;
use super::program::{Leaf, MaterialParameters};
use super::row::{Numbers, Row, Site};
use crate::math::{Float, narrow};
use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, parameters};

parameters! {
    /// Scatters evenly, on both sides.
    pub struct MatteParameters: "matte", "a matte material" {
        /// The fraction of light that is reflected: red, green, blue, each 0 to 1.
        reflectance: Colour = FRACTION,
    }
}

/// Scatters evenly, on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Matte;

impl MaterialParameters for MatteParameters {
    fn row(&self) -> Row {
        Row::new(Kind::Matte, narrow(self.reflectance))
    }
}

impl Leaf for Matte {
    type Lobe<F: Float> = Lambertian<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> Lambertian<F> {
        Lambertian { reflectance: numbers.colour }
    }
}
