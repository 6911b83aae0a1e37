//! The diffuse material.

use super::kind::Kind;
use super::lobes::{Lambertian, OrenNayar};
use super::program::{Leaf, MaterialParameters};
use super::row::{Numbers, Row, Site, padded};
use crate::math::{Float, narrow};
use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, Number, ParameterKind, Value, parameters};

parameters! {
    /// A diffuse surface, smooth or rough, on both sides.
    pub struct MatteParameters: "matte", "a matte material" {
        /// The fraction of light that is reflected: red, green, blue, each 0 to 1.
        reflectance: Colour = FRACTION,
        /// Roughness, 0 to 1: an energy-preserving Oren–Nayar model (EON; Portsmouth, Kutz and Hill 2025); 0 is Lambertian.
        roughness: f64 = ParameterKind::Number(Number::between(0.0, 1.0)) => "0" uncounted Value::Number(0.0),
    }
}

/// Lambertian reflection on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Matte;

impl MaterialParameters for MatteParameters {
    fn row(&self) -> Row {
        let (colour, roughness) = (narrow(self.reflectance), self.roughness as f32);
        if roughness > 0.0 {
            Row { numbers: padded([roughness]), ..Row::new(Kind::RoughMatte, colour) }
        } else {
            Row::new(Kind::Matte, colour)
        }
    }
}

impl Leaf for Matte {
    const IS_FREQUENT: bool = true;

    type Lobe<F: Float> = Lambertian<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> Lambertian<F> {
        Lambertian { reflectance: numbers.colour }
    }
}

/// Oren–Nayar reflection on both sides.
#[derive(Clone, Copy, Debug)]
pub struct RoughMatte;

impl Leaf for RoughMatte {
    type Lobe<F: Float> = OrenNayar<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> OrenNayar<F> {
        let [roughness, ..] = numbers.further;
        OrenNayar { reflectance: numbers.colour, roughness }
    }
}
