//! Reflection at a rough diffuse surface.

use super::{raised, same_side};
use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, function, trig, value};
use crate::sampling::warp;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// The fraction of light that grooves of roughness one reflect into other grooves, up to [`OrenNayar::scale`]: ½ −
/// 2/(3π).
const GROOVES: f32 = 0.5 - 2.0 / (3.0 * PI);

/// The same averaged over all directions: ½ − 2/(3π) minus ⅔ − 28/(15π).
const GROOVES_ON_AVERAGE: f32 = GROOVES - MEAN;
const MEAN: f32 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// Diffuse grooves that conserve energy: Fujii's Oren–Nayar model with multiple scattering (Portsmouth, Kutz and Hill
/// 2025, "EON: A Practical Energy-Preserving Rough Diffuse BRDF"). On both sides.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar<F> {
    /// The reflectance of the sides of the grooves.
    pub reflectance: Rgb<F>,
    /// The roughness, in [0, 1].
    pub roughness: F,
}

value!(OrenNayar { reflectance, roughness });

impl<F: Float> OrenNayar<F> {
    /// The scale of single scattering: 1/(1 + (½ − 2/(3π))·r).
    #[inline(always)]
    fn scale(&self) -> F {
        F::splat(1.0) / (self.roughness * GROOVES + 1.0)
    }

    /// ½ − 2/(3π) − G(μ)/π: the light along a direction that single scattering loses, divided by r·scale. At grazing
    /// directions it is zero.
    #[inline(always)]
    fn loss(cos: F) -> F {
        function!(F, groove_loss(cos), {
            let sin = (-cos * cos + 1.0).max(F::zero()).sqrt();
            let angle = trig::angle_turns(sin, cos) * TAU;
            // (1 − sin³)/cos without cancellation, because 1 − sin is cos²/(1 + sin).
            let rest = cos * (sin + sin * sin + 1.0) / (sin + 1.0);
            let g = sin * (angle - sin * cos) + sin * (rest - 1.0) * (2.0 / 3.0);
            (-g * FRAC_1_PI + GROOVES).max(F::zero())
        })
    }

    /// π·f of two directions above the surface.
    #[inline(always)]
    fn shade(&self, wo: Vec3<F>, wi: Vec3<F>) -> Rgb<F> {
        let scale = self.scale();
        let across = wo.x * wi.x + wo.y * wi.y;
        let cos = wo.z.max(wi.z).max(F::splat(f32::MIN_POSITIVE));
        let groove = F::select(across.gt(F::zero()), across / cos, across);
        let single = (scale * (self.roughness * groove + 1.0)).max(F::zero());
        // For multiple scattering, each channel is a geometric series.
        let average = scale * (self.roughness * MEAN + 1.0);
        let lost = -average + 1.0;
        let share = OrenNayar::loss(wo.z) * OrenNayar::loss(wi.z) / GROOVES_ON_AVERAGE;
        let again = self.roughness * scale * share * average;
        // For a channel's reflectance ρ: ρ·single + ρ²·again/(1 − ρ·lost).
        let (rho, one) = (self.reflectance, F::splat(1.0));
        let series =
            Rgb::new(one / (-rho.r * lost + 1.0), one / (-rho.g * lost + 1.0), one / (-rho.b * lost + 1.0));
        rho * single + rho * rho * again * series
    }
}

impl<F: Float> Bxdf<F> for OrenNayar<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        (self.shade(raised(wo), raised(wi)) * F::splat(FRAC_1_PI)).only(same_side(wo, wi))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], _lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let up = warp::cosine_hemisphere(u);
        BxdfSample {
            wi: Vec3::new(up.x, up.y, up.z.copysign(wo.z)),
            weight: self.shade(raised(wo), up),
            pdf: warp::cosine_hemisphere_pdf(up.z),
            delta: F::Mask::splat(false),
            eta: F::splat(1.0),
        }
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
    use crate::sampling::{Stream, warp};
    use rand::RngExt;

    /// ∫ π·f over the hemisphere by cosines, for a direction with this cosine.
    fn energy(rho: f32, roughness: f32, cos: f32) -> f64 {
        let bxdf = OrenNayar { reflectance: Rgb::splat([rho; 3]), roughness };
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let n = 800;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
            sum += f64::from(bxdf.shade(wo, warp::cosine_hemisphere(u)).r);
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn white_grooves_conserve_energy() {
        for roughness in [0.01, 0.3, 1.0] {
            for cos in [1.0, 0.7, 0.3, 0.05] {
                let energy = energy(1.0, roughness, cos);
                assert!((energy - 1.0).abs() < 1e-3, "{roughness}, {cos}: {energy}");
            }
            // Without multiple scattering they would lose energy, and a grey surface reflects less than its
            // reflectance.
            let grey = energy(0.5, roughness, 0.7);
            assert!(grey < 0.5 && grey > 0.4, "{roughness}: {grey}");
        }
    }

    #[test]
    fn grooves_of_no_roughness_are_lambertian() {
        let bxdf = OrenNayar { reflectance: Rgb::splat([0.5, 0.3, 0.1]), roughness: 0.0_f32 };
        let stream = &mut Stream::new(73, 0, 0);
        for _ in 0..1000 {
            let [wo, wi] =
                [(); 2].map(|()| warp::cosine_hemisphere([stream.random::<f32>(), stream.random()]));
            assert_eq!(bxdf.shade(wo, wi), bxdf.reflectance);
        }
    }

    /// Grooves retroreflect.
    #[test]
    fn rough_surfaces_retroreflect() {
        let bxdf = OrenNayar { reflectance: Rgb::splat([0.8; 3]), roughness: 1.0_f32 };
        let (there, back) = (Vec3::new(0.8, 0.0, 0.6), Vec3::new(-0.8, 0.0, 0.6));
        assert!(bxdf.shade(there, there).r > 1.5 * bxdf.shade(there, back).r);
    }
}
