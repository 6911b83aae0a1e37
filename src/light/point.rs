//! The point light.

use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::{Light, LightList, LightParameters};
use super::power;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Mask, Ray, Rgb, Vec3, narrow};
use crate::parameter::limits::{INTENSITY, POINT};
use crate::parameter::{Colour, ParameterKind, Problem, parameters};
use crate::sampling::warp;
use glam::DVec3;
use std::f64::consts::PI;

parameters! {
    /// A point with the same intensity in every direction.
    pub struct PointLightParameters: "point", "a point light" {
        /// The position of the light.
        position: DVec3 = POINT,
        /// Radiant intensity in W/sr, the same in every direction; or give power.
        intensity: Option<Colour> = ParameterKind::Colour(INTENSITY) => nothing,
        /// The total flux of the light in W, instead of intensity.
        power: Option<Colour> = ParameterKind::Colour(INTENSITY) => nothing,
    }
    check = check;
    rules = r#"{ "oneOf": [{ "required": ["intensity"] }, { "required": ["power"] }] }"#;
}

/// Converts power to intensity.
fn check(
    parameters: PointLightParameters,
    _warnings: &mut Vec<Problem>,
) -> Result<PointLightParameters, Problem> {
    let PointLightParameters { intensity, power, .. } = parameters;
    let intensity = power::intensity("a point light", intensity, power, 4.0 * PI)?;
    Ok(PointLightParameters { intensity: Some(intensity), power: None, ..parameters })
}

/// A point with the same intensity in every direction. No path can hit it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// The position.
    pub position: [f32; 3],
    /// Radiant intensity in W/sr.
    pub intensity: [f32; 3],
}

impl LightParameters for PointLightParameters {
    fn add_to(&self, lights: &mut impl LightList) -> u32 {
        let intensity = power::given(self.intensity, self.power, 4.0 * PI);
        lights.add(PointLight { position: narrow(self.position.to_array()), intensity: narrow(intensity) })
    }
}

impl Light for PointLight {
    const DELTA: bool = true;

    fn row(&self) -> LightRow {
        LightRow { origin: self.position, emission: self.intensity, ..LightRow::default() }
    }

    fn bounds(&self) -> Option<LightBounds> {
        Some(LightBounds {
            lo: self.position,
            hi: self.position,
            mean: self.position.map(f64::from),
            power: 4.0 * PI * grey(self.intensity),
            ..LightBounds::default()
        })
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        _u: [F; 2],
    ) -> LightSample<F> {
        let to_light = lights.origin - p;
        let distance2 = to_light.dot(to_light);
        LightSample {
            wi: to_light * (F::splat(1.0) / distance2.sqrt()),
            target: lights.origin,
            radiance: emission * (F::splat(1.0) / distance2),
            pdf: F::splat(1.0),
            delta: F::Mask::splat(true),
            infinite: F::Mask::splat(false),
        }
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [_, _, c, d]: [F; 4]) -> EmittedRay<F> {
        EmittedRay {
            ray: Ray::new(lights.origin, warp::uniform_sphere([c, d])),
            cos: F::splat(1.0),
            radiance: emission,
            pdf_position: F::splat(1.0),
            pdf_direction: warp::uniform_sphere_pdf(),
        }
    }
}
