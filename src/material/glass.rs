//! Smooth glass.

use super::kind::Kind;
use super::lobes::SmoothDielectric;
use super::program::{Leaf, MaterialParameters};
use super::row::{Medium, Numbers, Row, Site, padded};
use crate::math::{Float, Rgb, narrow};
use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, Number, ParameterKind, parameters};

parameters! {
    /// A smooth dielectric interface; the inside is the side that the normal points away from.
    pub struct GlassParameters: "glass", "a glass" {
        /// Index of refraction of the inside over the outside: 1.5 for glass in air, 1.33 for water.
        ior: f64 = ParameterKind::Number(Number::positive(1e-3, 1e3)),
        /// Tint of reflected light.
        reflectance: Colour = FRACTION => "[1, 1, 1]",
        /// Tint of transmitted light.
        transmittance: Colour = FRACTION => "[1, 1, 1]",
    }
}

/// A smooth dielectric interface; the inside is the side that the normal points away from.
#[derive(Clone, Copy, Debug)]
pub struct Glass;

impl MaterialParameters for GlassParameters {
    fn row(&self) -> Row {
        let [r, g, b] = narrow(self.transmittance);
        Row {
            numbers: padded([r, g, b, self.ior as f32]),
            medium: Some(Medium { priority: 0, absorption: [0.0; 3] }),
            ..Row::new(Kind::Glass, narrow(self.reflectance))
        }
    }
}

impl Leaf for Glass {
    const IS_FREQUENT: bool = true;

    type Lobe<F: Float> = SmoothDielectric<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> SmoothDielectric<F> {
        let [r, g, b, ior, ..] = numbers.further;
        SmoothDielectric { ior, reflectance: numbers.colour, transmittance: Rgb::new(r, g, b) }
    }
}
