//! The spot light.

use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::{Light, LightList, LightParameters};
use super::power;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3, narrow, trig};
use crate::parameter::limits::{DIRECTION, INTENSITY, POINT};
use crate::parameter::{Colour, Number, ParameterKind, Problem, parameters, words};
use crate::sampling::warp;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

words! {
    /// The function by which intensity falls off in the penumbra.
    pub enum Falloff {
        /// 3t² − 2t³, where t is linear in the cosine, as in pbrt.
        Smoothstep = "smoothstep",
        /// Linear in the angle, as in Mitsuba.
        Angle = "angle",
        /// t², where t is linear in the cosine, as in glTF.
        Squared = "squared",
    }
}

parameters! {
    /// A point that emits into a cone.
    pub struct SpotLightParameters: "spot", "a spot light" {
        /// The position of the light.
        position: DVec3 = POINT,
        /// The direction of the cone's axis, of any length.
        direction: DVec3 = DIRECTION,
        /// Radiant intensity in W/sr on the axis; or give power.
        intensity: Option<Colour> = ParameterKind::Colour(INTENSITY) => nothing,
        /// The total flux of the light in W, instead of intensity.
        power: Option<Colour> = ParameterKind::Colour(INTENSITY) => nothing,
        /// The angle in degrees between the axis and the edge of the cone, where the intensity is zero.
        cone_angle: f64 = ParameterKind::Number(Number::between(0.01, 180.0)) => "30",
        /// The width in degrees of the penumbra, the edge of the cone in which the intensity falls to zero; 0 is a
        /// sharp edge. By default it is 5, or the cone's angle if that is less.
        penumbra_angle: Option<f64> = ParameterKind::Number(Number::between(0.0, 180.0)) => nothing,
        /// The function by which intensity falls off in the penumbra: smoothstep, 3t² − 2t³ with t linear in the
        /// cosine; angle, linear in the angle; squared, t².
        falloff: Falloff = ParameterKind::Word(Falloff::WORDS) => "\"smoothstep\"",
    }
    check = check;
    rules = r#"{ "oneOf": [{ "required": ["intensity"] }, { "required": ["power"] }] }"#;
}

/// Checks that the penumbra is within the cone, and converts power to intensity.
fn check(
    parameters: SpotLightParameters,
    _warnings: &mut Vec<Problem>,
) -> Result<SpotLightParameters, Problem> {
    let SpotLightParameters { intensity, power, cone_angle, .. } = parameters;
    let penumbra_angle = parameters.penumbra();
    if penumbra_angle > cone_angle {
        return Err(Problem {
            parameter: "penumbra_angle",
            message: format!("penumbra_angle, {penumbra_angle}, is above cone_angle, {cone_angle}"),
            help: Some("the penumbra lies within the cone".into()),
        });
    }
    let solid_angle = Ramp::of(&parameters).solid_angle();
    let intensity = power::intensity("a spot light", intensity, power, solid_angle)?;
    Ok(SpotLightParameters {
        intensity: Some(intensity),
        power: None,
        penumbra_angle: Some(penumbra_angle),
        ..parameters
    })
}

impl SpotLightParameters {
    /// The width of the penumbra in degrees.
    fn penumbra(&self) -> f64 {
        self.penumbra_angle.unwrap_or_else(|| self.cone_angle.min(5.0))
    }
}

/// The cone, its penumbra, and the falloff of intensity there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// The angle between the axis and the edge of the cone, in radians.
    pub outer: f64,
    /// The angle between the axis and the start of the penumbra, in radians.
    pub inner: f64,
    /// The falloff of intensity in the penumbra.
    pub falloff: Falloff,
}

/// 1 − cos of an angle, without cancellation for small angles.
fn versine(angle: f64) -> f64 {
    2.0 * libm::sin(angle / 2.0).powi(2)
}

/// The largest slope of a ramp, for which the product with a difference is finite.
const STEEPEST: f64 = 1e30;

impl Ramp {
    fn of(parameters: &SpotLightParameters) -> Ramp {
        let outer = parameters.cone_angle.to_radians();
        let inner = (parameters.cone_angle - parameters.penumbra()).to_radians();
        Ramp { outer, inner, falloff: parameters.falloff }
    }

    /// The relative intensity integrated over all directions.
    fn solid_angle(&self) -> f64 {
        let [outer, inner] = [self.outer, self.inner].map(versine);
        let fall = outer - inner;
        TAU * match self.falloff {
            // The means of the falloff over the cosine in the penumbra are ½ and ⅓.
            Falloff::Smoothstep => inner + fall / 2.0,
            Falloff::Squared => inner + fall / 3.0,
            // 1 − cos θᵢ + ∫ (θₒ − θ)/(θₒ − θᵢ)·sin θ dθ, by parts: 1 − (sin θₒ − sin θᵢ)/(θₒ − θᵢ).
            Falloff::Angle => {
                let [middle, half] = [self.outer + self.inner, self.outer - self.inner].map(|x| x / 2.0);
                let sinc = if half > 0.0 { libm::sin(half) / half } else { 1.0 };
                versine(middle) + libm::cos(middle) * (1.0 - sinc)
            }
        }
    }

    /// The end of the falloff and its slope, in the cosine minus one or, for [`Falloff::Angle`], in radians.
    fn line(&self) -> [f64; 2] {
        let [from, to] = match self.falloff {
            Falloff::Angle => [self.outer, self.inner],
            Falloff::Smoothstep | Falloff::Squared => [self.outer, self.inner].map(|angle| -versine(angle)),
        };
        let slope = 1.0 / (to - from);
        let steepest = if self.falloff == Falloff::Angle { -STEEPEST } else { STEEPEST };
        [from, if slope.abs() < STEEPEST { slope } else { steepest }]
    }
}

/// A point that emits into a cone. No path can hit it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpotLight {
    /// The position.
    pub position: [f32; 3],
    /// The axis, of length one.
    pub axis: [f32; 3],
    /// Radiant intensity in W/sr on the axis.
    pub intensity: [f32; 3],
    /// The cone.
    pub ramp: Ramp,
}

impl LightParameters for SpotLightParameters {
    fn add_to(&self, lights: &mut impl LightList) -> u32 {
        let ramp = Ramp::of(self);
        lights.add(SpotLight {
            position: narrow(self.position.to_array()),
            axis: narrow(self.direction.normalize().to_array()),
            intensity: narrow(power::given(self.intensity, self.power, ramp.solid_angle())),
            ramp,
        })
    }
}

impl SpotLight {
    /// The total flux in W, averaged over the channels.
    pub fn power(&self) -> f64 {
        self.ramp.solid_angle() * grey(self.intensity)
    }

    /// The relative intensity in a direction.
    #[inline(always)]
    fn share<F: Float>(lights: &LaneLights<'_, F>, d: Vec3<F>) -> F {
        let (axis, [from, slope, falloff]) = (lights.normal(), lights.ramp());
        // |d − axis|² = 2·(1 − cos), without cancellation for a narrow cone.
        let off = d - axis;
        let is = |one: Falloff| falloff.to_uint().eq(F::Uint::splat(one as u32));
        let x = F::branch(
            is(Falloff::Angle),
            off.dot(off) * -0.5,
            #[inline(always)]
            || trig::angle_turns(d.cross(axis).length(), d.dot(axis)) * std::f32::consts::TAU,
        );
        let t = ((x - from) * slope).max(F::zero()).min(F::splat(1.0));
        let smooth = t * t * (t * -2.0 + 3.0);
        F::select(is(Falloff::Angle), t, F::select(is(Falloff::Squared), t * t, smooth))
    }
}

impl Light for SpotLight {
    const DELTA: bool = true;

    fn row(&self) -> LightRow {
        LightRow {
            origin: self.position,
            normal: self.axis,
            radius: versine(self.ramp.outer) as f32,
            ramp_from: self.ramp.line()[0] as f32,
            ramp_slope: self.ramp.line()[1] as f32,
            falloff: self.ramp.falloff as u32 as f32,
            emission: self.intensity,
            ..LightRow::default()
        }
    }

    /// Within its cone a spot contributes as much as a point light of the same intensity: the power is that of the
    /// point light.
    fn bounds(&self) -> Option<LightBounds> {
        // The estimate falls to zero at a right angle from the normals.
        let inner = self.ramp.inner.max(self.ramp.outer - 0.8 * PI / 2.0).max(0.0);
        // The margin keeps rounding from excluding points just within the cone.
        let beyond = (self.ramp.outer - inner + 0.01).min(PI / 2.0);
        Some(LightBounds {
            lo: self.position,
            hi: self.position,
            mean: self.position.map(f64::from),
            power: 4.0 * PI * grey(self.intensity),
            axis: self.axis,
            cos_o: libm::cos(inner) as f32,
            cos_e: libm::cos(beyond) as f32,
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
        let wi = to_light * (F::splat(1.0) / distance2.sqrt());
        LightSample {
            wi,
            target: lights.origin,
            radiance: emission * (SpotLight::share(lights, -wi) / distance2),
            pdf: F::splat(1.0),
            delta: F::Mask::splat(true),
            infinite: F::Mask::splat(false),
        }
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [_, _, c, d]: [F; 4]) -> EmittedRay<F> {
        let versine = lights.radius();
        let d = Frame::around(lights.normal()).to_world(warp::cone([c, d], versine));
        EmittedRay {
            ray: Ray::new(lights.origin, d),
            cos: F::splat(1.0),
            radiance: emission * SpotLight::share(lights, d),
            pdf_position: F::splat(1.0),
            pdf_direction: warp::cone_pdf(versine),
        }
    }
}
