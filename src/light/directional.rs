//! Parallel or nearly parallel light from infinity, such as that of the sun.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::{Light, LightList, LightParameters};
use super::sample::{EmittedRay, Escaped, LightSample};
use crate::math::{Float, Frame, Mask, Rgb, Vec3, narrow};
use crate::parameter::limits::{DIRECTION, RADIANCE};
use crate::parameter::{Colour, Number, ParameterKind, parameters};
use crate::sampling::warp;
use glam::DVec3;
use std::f64::consts::PI;

parameters! {
    /// Light from infinity in one direction, such as that of the sun.
    pub struct DirectionalLightParameters: "directional", "a directional light" {
        /// The direction in which the light travels, of any length.
        direction: DVec3 = DIRECTION,
        /// Irradiance in W/m² on a surface that faces the light.
        irradiance: Colour = ParameterKind::Colour(RADIANCE),
        /// The angle in degrees that the light covers in the sky, as a disk of uniform radiance. Below 0.01 the light
        /// has no size: its shadows are sharp, and no path can hit it.
        angular_diameter: f64 = ParameterKind::Number(Number::between(0.0, 180.0)) => "0",
    }
}

/// The smallest angular diameter of a disk in degrees: a narrower one contains few directions in single precision.
const LEAST_DIAMETER: f64 = 0.01;

impl LightParameters for DirectionalLightParameters {
    fn add_to(&self, lights: &mut impl LightList) -> u32 {
        let towards = narrow((-self.direction.normalize()).to_array());
        if self.angular_diameter < LEAST_DIAMETER {
            return lights.add(Distant { towards, irradiance: narrow(self.irradiance) });
        }
        // 1 − cos r as 2·sin²(r/2), which avoids cancellation.
        let versine = 2.0 * libm::sin(self.angular_diameter.to_radians() / 4.0).powi(2);
        // E = π·L·sin²r.
        let radiance = self.irradiance.map(|e| e / (PI * versine * (2.0 - versine)));
        lights.add(DistantDisk { towards, versine: versine as f32, radiance: narrow(radiance) })
    }
}

/// A light at infinity without a size. No path can hit it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distant {
    /// The direction to the light, of length one.
    pub towards: [f32; 3],
    /// Irradiance in W/m² on a surface that faces the light.
    pub irradiance: [f32; 3],
}

impl Light for Distant {
    const DELTA: bool = true;
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        LightRow { normal: self.towards, emission: self.irradiance, ..LightRow::default() }
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        _p: Vec3<F>,
        emission: Rgb<F>,
        _u: [F; 2],
    ) -> LightSample<F> {
        LightSample {
            wi: lights.normal(),
            target: Vec3::zero(),
            radiance: emission,
            pdf: F::splat(1.0),
            delta: F::Mask::splat(true),
            infinite: F::Mask::splat(true),
        }
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, _, _]: [F; 4]) -> EmittedRay<F> {
        EmittedRay::from_infinity(lights.extent(), -lights.normal(), emission, [a, b])
    }
}

/// A disk at infinity of uniform radiance, sampled uniformly by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistantDisk {
    /// The direction to its centre, of length one.
    pub towards: [f32; 3],
    /// 1 − cos of its angular radius.
    pub versine: f32,
    /// Its radiance in W·m⁻²·sr⁻¹.
    pub radiance: [f32; 3],
}

impl DistantDisk {
    /// A direction to the light.
    #[inline(always)]
    fn direction<F: Float>(lights: &LaneLights<'_, F>, u: [F; 2]) -> Vec3<F> {
        Frame::around(lights.normal()).to_world(warp::cone(u, lights.radius()))
    }
}

impl Light for DistantDisk {
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        LightRow {
            normal: self.towards,
            radius: self.versine,
            emission: self.radiance,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        _p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        LightSample {
            wi: DistantDisk::direction(lights, u),
            target: Vec3::zero(),
            radiance: emission,
            pdf: warp::cone_pdf(lights.radius()),
            delta: F::Mask::splat(false),
            infinite: F::Mask::splat(true),
        }
    }

    #[inline(always)]
    fn escaped<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, d: Vec3<F>) -> Escaped<F> {
        let versine = lights.radius();
        // |d − towards|² = 2·(1 − cos), which avoids cancellation for a small disk.
        let off = d - lights.normal();
        let met = off.dot(off).le(versine * 2.0);
        Escaped { radiance: emission.only(met), pdf: warp::cone_pdf(versine).only(met) }
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let d = -DistantDisk::direction(lights, [c, d]);
        EmittedRay {
            pdf_direction: warp::cone_pdf(lights.radius()),
            ..EmittedRay::from_infinity(lights.extent(), d, emission, [a, b])
        }
    }
}
