//! Reflection and refraction at a smooth surface.

use super::reflect;
use crate::material::bxdf::{Branch, Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, function, value};

/// A smooth dielectric interface: Fresnel reflection and Snell refraction.
#[derive(Clone, Copy, Debug)]
pub struct SmoothDielectric<F> {
    /// The index of refraction below the surface over that above it.
    pub ior: F,
    /// Tint of reflected light.
    pub reflectance: Rgb<F>,
    /// Tint of transmitted light.
    pub transmittance: Rgb<F>,
}

value!(SmoothDielectric { ior, reflectance, transmittance });

/// Fresnel reflectance of unpolarised light at a smooth dielectric, and the cosine of refraction.
///
/// `cos_i` ≥ 0 is the cosine of incidence and `eta` the index of the far side over that of the near side. For total
/// internal reflection the result is (1, 0) (Born and Wolf 1999, §1.5.2).
#[inline(always)]
pub fn fresnel_dielectric<F: Float>(cos_i: F, eta: F) -> (F, F) {
    function!(F, fresnel_dielectric(cos_i, eta), {
        let sin2_t = (-cos_i * cos_i + 1.0) / (eta * eta);
        let cos_t = (-sin2_t + 1.0).max(F::zero()).sqrt();
        let reflectance = fresnel_by_cosines(cos_i, cos_t, eta);
        let total = F::splat(1.0).le(sin2_t);
        (F::select(total, F::splat(1.0), reflectance), cos_t.only(!total))
    })
}

/// The same from the cosines of incidence and refraction, both ≥ 0 and not both zero.
#[inline(always)]
pub(super) fn fresnel_by_cosines<F: Float>(cos_i: F, cos_t: F, eta: F) -> F {
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    (parallel * parallel + perpendicular * perpendicular) * 0.5
}

impl<F: Float> SmoothDielectric<F> {
    /// The index of refraction on the far side of the surface over that on the side of `wo`.
    #[inline(always)]
    fn eta(&self, wo: Vec3<F>) -> F {
        F::select(F::zero().le(wo.z), self.ior, F::splat(1.0) / self.ior)
    }
}

impl<F: Float> Bxdf<F> for SmoothDielectric<F> {
    const HAS_NON_DELTA: bool = false;
    const HAS_DELTA: bool = true;
    const TRANSMITS: bool = true;

    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F> {
        let [reflected, refracted] = self.branches(wo, mode);
        let fresnel = reflected.probability;
        let reflects = lobe.lt(fresnel);
        let probability = F::select(reflects, fresnel, -fresnel + 1.0);
        // The probability of a branch is its Fresnel factor, which therefore cancels.
        let transmitted = refracted.weight * (F::splat(1.0) / probability);
        BxdfSample {
            wi: Vec3::select(reflects, reflected.wi, refracted.wi),
            weight: Rgb::select(reflects, self.reflectance, transmitted),
            pdf: probability,
            delta: F::Mask::splat(true),
            eta: F::select(reflects, F::splat(1.0), self.eta(wo)),
        }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.transmittance
    }

    /// The reflected branch, then the refracted one, with Fresnel factors in their weights. With total internal
    /// reflection, the refracted weight is black.
    #[inline(always)]
    fn branches(&self, wo: Vec3<F>, mode: TransportMode) -> [Branch<F>; 2] {
        let eta = self.eta(wo);
        let (fresnel, cos_t) = fresnel_dielectric(wo.z.abs(), eta);
        let scale = F::splat(1.0) / eta;
        let refracted = Vec3::new(-wo.x * scale, -wo.y * scale, -cos_t.copysign(wo.z));
        let through = -fresnel + 1.0;
        let transmitted = match mode {
            // Radiance is concentrated in a smaller solid angle on the denser side (Veach 1997, §5.2).
            TransportMode::Radiance => through * scale * scale,
            TransportMode::Importance => through,
        };
        [
            Branch { wi: reflect(wo), weight: self.reflectance * fresnel, probability: fresnel },
            Branch { wi: refracted, weight: self.transmittance * transmitted, probability: through },
        ]
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
    fn fresnel_at_normal_incidence_brewster_and_beyond_the_critical_angle() {
        let (r, cos_t) = fresnel_dielectric(1.0_f32, 1.5);
        assert!((r - 0.04).abs() < 1e-6 && (cos_t - 1.0).abs() < 1e-6);
        // At Brewster's angle only perpendicularly polarised light is reflected: R = ½((1 − η²)/(1 + η²))².
        let cos_brewster = (1.0_f32 / (1.0 + 1.5 * 1.5)).sqrt();
        let expected = 0.5 * ((1.0 - 1.5_f32.powi(2)) / (1.0 + 1.5_f32.powi(2))).powi(2);
        assert!((fresnel_dielectric(cos_brewster, 1.5).0 - expected).abs() < 1e-6);
        assert_eq!(fresnel_dielectric(0.5_f32, 1.0 / 1.5), (1.0, 0.0));
        // From inside at sin i = 0.6, sin t = 0.9: ½((η·0.8 − cos t)²/(…)² + (0.8 − η·cos t)²/(…)²).
        assert!((fresnel_dielectric(0.8_f32, 1.0 / 1.5).0 - 0.114_141).abs() < 1e-5);
    }

    #[test]
    fn glass_obeys_snell_and_conserves_energy() {
        let glass = SmoothDielectric { ior: 1.5_f32, reflectance: rgb(1.0), transmittance: rgb(1.0) };
        for cos in [0.9, 0.3, 0.05, -0.9, -0.8] {
            let wo = direction(cos, 0.2);
            let eta = if cos > 0.0 { 1.5 } else { 1.0 / 1.5 };
            let [reflected, refracted] = glass.branches(wo, MODE).map(|branch| branch.wi);
            let [fr, ft] = glass.branches(wo, MODE).map(|branch| branch.weight);
            assert_eq!([reflected.x, reflected.y, reflected.z], [-wo.x, -wo.y, wo.z]);
            let sin = |w: Vec3<f32>| (w.x * w.x + w.y * w.y).sqrt();
            assert!((sin(wo) - eta * sin(refracted)).abs() < 1e-6, "Snell at {cos}");
            assert!(refracted.z * wo.z < 0.0);
            assert!((refracted.length() - 1.0).abs() < 1e-6);
            // Refraction changes radiance by η², but not flux.
            assert!((fr.r + ft.r * eta * eta - 1.0).abs() < 1e-6);
            for lobe in [0.0, 0.999_999] {
                let sample = glass.sample(wo, [0.5; 2], lobe, MODE);
                let expected = if lobe < fr.r { 1.0 } else { 1.0 / (eta * eta) };
                assert!((sample.weight.r - expected).abs() < 1e-5);
            }
        }
        // Beyond the critical angle all light is reflected.
        let sample = glass.sample(direction(-0.3, 0.2), [0.5; 2], 0.999_999, MODE);
        assert!(sample.wi.z < 0.0 && sample.weight.r == 1.0);
    }
}
