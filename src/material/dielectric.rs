//! Dielectrics such as glass: smooth and rough, solid and in thin sheets.

use super::conductor::alpha;
use super::kind::Kind;
use super::lobes::{Ggx, RoughDielectric, RoughSheet, Sheet, SmoothSheet};
use super::program::{Leaf, MaterialParameters};
use super::row::{Medium, Numbers, Row, Site, padded};
use crate::math::{Float, Rgb, narrow};
use crate::parameter::limits::{DISTANCE, FRACTION};
use crate::parameter::{Colour, Number, ParameterKind, Problem, Value, parameters};

parameters! {
    /// A dielectric interface, smooth or rough; the inside is the side that the normal points away from.
    pub struct DielectricParameters: "dielectric", "a dielectric" {
        /// Index of refraction of the inside over the outside: 1.5 for glass in air, 1.33 for water. Within 0.001 of 1
        /// there is no refraction.
        ior: f64 = ParameterKind::Number(Number::positive(1e-3, 1e3)),
        /// Roughness, 0 to 1. Its square is α of a GGX distribution of microfacets: one number, or one along u and one
        /// along v. Below 0.01 the surface is perfectly smooth.
        roughness: [f64; 2] = ParameterKind::Pair(Number::between(0.0, 1.0)) => "0",
        /// Absorption coefficient of the inside per unit of length: the fraction exp(−absorption · length) is
        /// transmitted. Dielectrics that overlap without priorities keep their own indices of refraction, and the one
        /// entered last absorbs.
        absorption: Colour = ParameterKind::Colour(DISTANCE) => "[0, 0, 0]" uncounted Value::Colour([0.0; 3]),
        /// Where dielectrics overlap, the one with the highest priority fills the space, and among equal ones the one
        /// entered last. If any dielectric in the scene has a priority above 0, every index of refraction, including
        /// that of smooth glass, is that of the medium itself, and surfaces refract by the two media that they
        /// separate.
        priority: f64 = ParameterKind::Integer(0, MOST_PRIORITY) => "0" uncounted Value::Number(0.0),
        /// Whether the surface is a thin sheet with the same medium on both sides, through which light passes straight.
        /// It has no inside that could absorb or overlap others.
        thin_walled: bool = ParameterKind::Flag => "false",
        /// Tint of reflected light.
        reflectance: Colour = FRACTION => "[1, 1, 1]",
        /// Tint of transmitted light.
        transmittance: Colour = FRACTION => "[1, 1, 1]",
    }
    check = check;
}

/// The highest priority.
const MOST_PRIORITY: u32 = 1000;

/// A sheet has no inside.
fn check(
    parameters: DielectricParameters,
    _warnings: &mut Vec<Problem>,
) -> Result<DielectricParameters, Problem> {
    let problem = |parameter, message: &str| {
        let help = Some("remove it, or remove thin_walled".to_owned());
        Err(Problem { parameter, message: message.into(), help })
    };
    match parameters {
        DielectricParameters { thin_walled: true, absorption, .. } if absorption.iter().any(|&a| a > 0.0) => {
            problem("absorption", "a thin-walled dielectric has no inside that could absorb")
        }
        DielectricParameters { thin_walled: true, priority, .. } if priority > 0.0 => {
            problem("priority", "a thin-walled dielectric has no inside that could overlap others")
        }
        other => Ok(other),
    }
}

/// An index closer to one than this has no direction of refraction in single precision.
const LEAST_REFRACTION: f64 = 1e-3;

impl MaterialParameters for DielectricParameters {
    fn row(&self) -> Row {
        let ([r, g, b], ior) = (narrow(self.transmittance), self.ior as f32);
        let refracts = (self.ior - 1.0).abs() >= LEAST_REFRACTION;
        // With a priority the index around it may be another than one.
        let rough = alpha(self.roughness).filter(|_| refracts || self.priority > 0.0);
        let kind = match (rough.is_some(), self.thin_walled) {
            (false, false) => Kind::Glass,
            (false, true) => Kind::ThinDielectric,
            (true, false) => Kind::Dielectric,
            (true, true) => Kind::RoughThinDielectric,
        };
        // Paths sample no lights at black colours, although light may be transmitted.
        let least = if rough.is_some() { f32::MIN_POSITIVE } else { 0.0 };
        let medium = Medium { priority: self.priority as u32, absorption: narrow(self.absorption) };
        let row = Row {
            medium: (!self.thin_walled).then_some(medium),
            ..Row::new(kind, narrow(self.reflectance).map(|channel: f32| channel.max(least)))
        };
        match rough {
            None => Row { numbers: padded([r, g, b, ior]), ..row },
            Some([along_u, along_v]) => Row {
                numbers: padded([r, g, b, ior, along_u, along_v]),
                is_anisotropic: along_u != along_v,
                ..row
            },
        }
    }
}

/// The index of a row with rough microfacets, which a texture may bring close to one.
#[inline(always)]
fn refracting<F: Float>(ior: F) -> F {
    let (off, least) = (ior - 1.0, F::splat(LEAST_REFRACTION as f32));
    F::select(off.abs().lt(least), least.copysign(off) + 1.0, ior)
}

/// The sheet of a row.
#[inline(always)]
fn sheet<F: Float>(numbers: &Numbers<F>) -> Sheet<F> {
    let [r, g, b, ior, ..] = numbers.further;
    Sheet { ior, reflectance: numbers.colour, transmittance: Rgb::new(r, g, b) }
}

/// The microfacets of a row.
#[inline(always)]
fn normals<F: Float>(numbers: &Numbers<F>) -> Ggx<F> {
    let [_, _, _, _, along_u, along_v, ..] = numbers.further;
    Ggx { alpha: [along_u, along_v] }
}

/// A rough dielectric interface. A smooth one is a [`Glass`](super::Glass).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric;

impl Leaf for Dielectric {
    type Lobe<F: Float> = RoughDielectric<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> RoughDielectric<F> {
        let Sheet { ior, reflectance, transmittance } = sheet(numbers);
        RoughDielectric { ior: refracting(ior), reflectance, transmittance, normals: normals(numbers) }
    }
}

/// A smooth thin sheet.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric;

impl Leaf for ThinDielectric {
    type Lobe<F: Float> = SmoothSheet<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> SmoothSheet<F> {
        SmoothSheet { sheet: sheet(numbers) }
    }
}

/// A rough thin sheet.
#[derive(Clone, Copy, Debug)]
pub struct RoughThinDielectric;

impl Leaf for RoughThinDielectric {
    type Lobe<F: Float> = RoughSheet<F>;

    #[inline(always)]
    fn lobe<F: Float>(numbers: &Numbers<F>, _site: &Site<F>) -> RoughSheet<F> {
        RoughSheet { sheet: sheet(numbers), normals: normals(numbers) }
    }
}
