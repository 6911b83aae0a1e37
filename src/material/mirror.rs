//! Mirrors.

use super::kind::Kind;
use super::lobes::SpecularReflection;
use super::program::{Leaf, MaterialParameters};
use super::row::{Numbers, Row, Site};
use crate::math::{Float, narrow};
use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, parameters};

parameters! {
    /// A perfect mirror, on both sides.
    pub struct MirrorParameters: "mirror", "a mirror" {
        /// The fraction of light that is reflected: red, green, blue, each 0 to 1.
        reflectance: Colour = FRACTION,
    }
}

/// Perfect reflection on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Mirror;

impl MaterialParameters for MirrorParameters {
    fn row(&self) -> Row {
        Row::new(Kind::Mirror, narrow(self.reflectance))
    }
}

impl Leaf for Mirror {
    const IS_FREQUENT: bool = true;

    type Lobe<F: Float> = SpecularReflection<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> SpecularReflection<F> {
        SpecularReflection { reflectance: numbers.colour }
    }
}
