//! Two lights at infinity for tests of the table; no scene has them.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, Escaped, LightSample};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Vec3};
use crate::sampling::warp;
use std::f32::consts::PI;

/// A sky of the same radiance everywhere, sampled uniformly by solid angle.
#[derive(Clone, Copy)]
pub(crate) struct Sky {
    pub(crate) radiance: [f32; 3],
    /// Radius of a ball about the origin that holds the scene.
    pub(crate) reach: f32,
}

impl Light for Sky {
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        LightRow { radius: self.reach, emission: self.radiance, ..LightRow::default() }
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    #[inline(always)]
    fn sample<F: Float>(
        _lights: &LaneLights<'_, F>,
        _p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        LightSample {
            wi: warp::uniform_sphere(u),
            target: Vec3::zero(),
            radiance: emission,
            pdf: warp::uniform_sphere_pdf(),
            delta: F::Mask::splat(false),
            infinite: F::Mask::splat(true),
        }
    }

    #[inline(always)]
    fn escaped<F: Float>(_lights: &LaneLights<'_, F>, emission: Rgb<F>, _d: Vec3<F>) -> Escaped<F> {
        Escaped { radiance: emission, pdf: warp::uniform_sphere_pdf() }
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let towards = warp::uniform_sphere([c, d]);
        EmittedRay {
            pdf_direction: warp::uniform_sphere_pdf(),
            ..from_afar(lights, emission, towards, [a, b])
        }
    }
}

/// A sun without a size: a delta light at infinity.
#[derive(Clone, Copy)]
pub(crate) struct Sun {
    /// The direction to it, of length one.
    pub(crate) towards: [f32; 3],
    /// On a surface that faces it, in W/m².
    pub(crate) irradiance: [f32; 3],
    /// Radius of a ball about the origin that holds the scene.
    pub(crate) reach: f32,
}

impl Light for Sun {
    const DELTA: bool = true;
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        LightRow {
            normal: self.towards,
            radius: self.reach,
            emission: self.irradiance,
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
        from_afar(lights, emission, lights.normal(), [a, b])
    }
}

/// A ray from a disk beyond the scene, of which a direction to the light is the normal.
#[inline(always)]
fn from_afar<F: Float>(
    lights: &LaneLights<'_, F>,
    emission: Rgb<F>,
    towards: Vec3<F>,
    u: [F; 2],
) -> EmittedRay<F> {
    let reach = lights.radius();
    let (x, y) = warp::disk(u);
    let on_disk = Frame::around(towards).to_world(Vec3::new(x * reach, y * reach, reach));
    EmittedRay {
        ray: Ray::new(on_disk, -towards),
        cos: F::splat(1.0),
        radiance: emission,
        pdf_position: F::splat(1.0) / (reach * reach * PI),
        pdf_direction: F::splat(1.0),
    }
}
