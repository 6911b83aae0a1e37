//! Perfect specular reflection.

use super::reflect;
use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, value};

/// Perfect reflection on both sides (report §4.3.1.2).
#[derive(Clone, Copy, Debug)]
pub struct SpecularReflection<F> {
    /// The reflectance.
    pub reflectance: Rgb<F>,
}

value!(SpecularReflection { reflectance });

impl<F: Float> Bxdf<F> for SpecularReflection<F> {
    const HAS_NON_DELTA: bool = false;
    const HAS_DELTA: bool = true;

    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], _lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let (one, delta) = (F::splat(1.0), F::Mask::splat(true));
        BxdfSample { wi: reflect(wo), weight: self.reflectance, pdf: one, delta, eta: one }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.reflectance
    }
}
