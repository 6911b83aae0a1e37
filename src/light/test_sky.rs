//! A light at infinity for tests of the table; scenes cannot have it.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, Escaped, LightSample};
use crate::math::{Float, Mask, Rgb, Vec3};
use crate::sampling::warp;

/// A sky of uniform radiance, sampled uniformly by solid angle.
#[derive(Clone, Copy)]
pub(crate) struct Sky {
    pub(crate) radiance: [f32; 3],
}

impl Light for Sky {
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        LightRow { emission: self.radiance, ..LightRow::default() }
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
        let d = warp::uniform_sphere([c, d]);
        EmittedRay {
            pdf_direction: warp::uniform_sphere_pdf(),
            ..EmittedRay::from_infinity(lights.extent(), d, emission, [a, b])
        }
    }
}
