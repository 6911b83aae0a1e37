//! Lambertian reflection.

use super::same_side;
use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, value};
use crate::sampling::warp;
use std::f32::consts::FRAC_1_PI;

/// Uniform scattering on the side of the incident light (report §4.3.1.1): f = R/π.
#[derive(Clone, Copy, Debug)]
pub struct Lambertian<F> {
    /// The reflectance.
    pub reflectance: Rgb<F>,
}

value!(Lambertian { reflectance });

impl<F: Float> Bxdf<F> for Lambertian<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        (self.reflectance * F::splat(FRAC_1_PI)).only(same_side(wo, wi))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], _lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let up = warp::cosine_hemisphere(u);
        let wi = Vec3::new(up.x, up.y, up.z.copysign(wo.z));
        // f·cos/pdf = (R/π)·cos / (cos/π). The report's program omits π in f.
        let (pdf, delta) = (warp::cosine_hemisphere_pdf(up.z), F::Mask::splat(false));
        BxdfSample { wi, weight: self.reflectance, pdf, delta, eta: F::splat(1.0) }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        warp::cosine_hemisphere_pdf(wi.z.abs()).only(same_side(wo, wi))
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.reflectance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODE: TransportMode = TransportMode::Radiance;

    fn rgb(v: f32) -> Rgb<f32> {
        Rgb::splat([v; 3])
    }

    fn direction(cos: f32, turns: f32) -> Vec3<f32> {
        let sin = (1.0 - cos * cos).sqrt();
        let (s, c) = crate::math::trig::sin_cos_turns(turns);
        Vec3::new(sin * c, sin * s, cos)
    }

    #[test]
    fn lambertian_conserves_energy_and_stays_on_its_side() {
        let bxdf = Lambertian { reflectance: rgb(0.5) };
        for wo in [direction(0.8, 0.1), direction(-0.3, 0.6)] {
            let n = 400;
            let mut energy = 0.0;
            for i in 0..n * n {
                let cos = ((i / n) as f32 + 0.5) / n as f32 * 2.0 - 1.0;
                let wi = direction(cos, (i % n) as f32 / n as f32);
                energy += bxdf.eval(wo, wi, MODE).r * cos.abs() * 4.0 * std::f32::consts::PI / (n * n) as f32;
            }
            assert!((energy - 0.5).abs() < 1e-3, "∫ f cos is {energy}, not the reflectance");
            let sample = bxdf.sample(wo, [0.3, 0.7], 0.0, MODE);
            assert!(sample.wi.z * wo.z > 0.0);
            let weight = bxdf.eval(wo, sample.wi, MODE).r * sample.wi.z.abs() / bxdf.pdf(wo, sample.wi);
            assert!((weight - sample.weight.r).abs() < 1e-6);
            assert!((sample.pdf - bxdf.pdf(wo, sample.wi)).abs() < 1e-6);
        }
    }
}
