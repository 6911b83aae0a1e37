//! Reflection at a metal, smooth and rough.

use super::ggx::{Ggx, halfway};
use super::{raised, reflect, same_side};
use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, function, value};

/// Fresnel reflectance of unpolarised light at a conductor with the index of refraction η + i·k, relative to the
/// outside.
///
/// `cos` in [0, 1] is the cosine of incidence (Born and Wolf 1999, §14.2). With q = √((η + i·k)² − sin²θ) = a + i·b,
/// the amplitudes are (cos θ − q)/(cos θ + q) and the same times (q·cos θ − sin²θ)/(q·cos θ + sin²θ); the code computes
/// their squared magnitudes.
#[inline(always)]
pub fn fresnel_conductor<F: Float>(cos: F, eta: F, k: F) -> F {
    let (cos2, tiny) = (cos * cos, F::splat(f32::MIN_POSITIVE));
    let sin2 = -cos2 + 1.0;
    let (eta_k, difference) = (eta * k, (eta - k) * (eta + k) - sin2);
    // |q|², and a. The larger of a² and b² is computed without cancellation, and their product is (η·k)².
    let square = (difference * difference + eta_k * eta_k * 4.0).sqrt();
    let larger = (square + difference.abs()) * 0.5;
    let a2 = F::select(difference.lt(F::zero()), eta_k * eta_k / larger.max(tiny), larger);
    let twice = a2.sqrt() * cos * 2.0;
    let (near, far) = (square + cos2, square * cos2 + sin2 * sin2);
    let perpendicular = (near - twice) / (near + twice).max(tiny);
    let parallel = perpendicular * ((far - twice * sin2) / (far + twice * sin2).max(tiny));
    // For a surface that reflects nothing, rounding could give less than zero.
    ((perpendicular + parallel) * 0.5).max(F::zero())
}

/// A metal's index of refraction η + i·k relative to the outside.
#[derive(Clone, Copy, Debug)]
pub struct Metal<F> {
    /// η.
    pub eta: Rgb<F>,
    /// k.
    pub k: Rgb<F>,
}

value!(Metal { eta, k });

impl<F: Float> Metal<F> {
    /// The reflectance at a cosine of incidence.
    #[inline(always)]
    fn reflectance(&self, cos: F) -> Rgb<F> {
        let (eta, k) = (self.eta, self.k);
        function!(F, metal_reflectance(cos, eta, k), {
            Rgb::new(
                fresnel_conductor(cos, eta.r, k.r),
                fresnel_conductor(cos, eta.g, k.g),
                fresnel_conductor(cos, eta.b, k.b),
            )
        })
    }
}

/// A smooth metal, on both sides.
#[derive(Clone, Copy, Debug)]
pub struct SmoothMetal<F> {
    /// The metal.
    pub metal: Metal<F>,
}

value!(SmoothMetal { metal });

impl<F: Float> Bxdf<F> for SmoothMetal<F> {
    const HAS_NON_DELTA: bool = false;
    const HAS_DELTA: bool = true;

    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], _lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let (one, delta) = (F::splat(1.0), F::Mask::splat(true));
        let weight = self.metal.reflectance(wo.z.abs().min(one));
        BxdfSample { wi: reflect(wo), weight, pdf: one, delta, eta: one }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.metal.reflectance(F::splat(1.0))
    }
}

/// A rough metal, on both sides: f = F·D·G₂/(4 cos θₒ cos θᵢ) (Cook and Torrance 1982; Walter et al. 2007, §5.1). Light
/// that meets a second microfacet is lost.
#[derive(Clone, Copy, Debug)]
pub struct RoughMetal<F> {
    /// The metal.
    pub metal: Metal<F>,
    /// The distribution of its microfacets.
    pub normals: Ggx<F>,
}

value!(RoughMetal { metal, normals });

impl<F: Float> Bxdf<F> for RoughMetal<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        let (o, i) = (raised(wo), raised(wi));
        let (h, cos) = halfway(o, i);
        let f = self.metal.reflectance(cos) * (self.normals.density(h) * self.normals.visibility(o, i));
        f.only(same_side(wo, wi))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], _lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let (o, normals) = (raised(wo), &self.normals);
        let h = normals.sample(o, u);
        let cos = o.dot(h).max(F::zero()).min(F::splat(1.0));
        let i = h * (cos * 2.0) - o;
        // A direction below the surface meets a second microfacet.
        let leaves = i.z.gt(F::zero()) & cos.gt(F::zero()) & o.z.gt(F::zero());
        // F·G₂/G₁, because f contains the density of visible normals.
        let masked = normals.visibility(o, i) * i.z * 4.0 / normals.masking(o);
        BxdfSample {
            wi: Vec3::new(i.x, i.y, i.z.copysign(wo.z)),
            weight: (self.metal.reflectance(cos) * masked).only(leaves),
            pdf: (normals.density(h) * normals.masking(o) * 0.25).only(leaves),
            delta: F::Mask::splat(false),
            eta: F::splat(1.0),
        }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        let (o, i) = (raised(wo), raised(wi));
        let (h, _) = halfway(o, i);
        (self.normals.density(h) * self.normals.masking(o) * 0.25).only(same_side(wo, wi))
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.metal.reflectance(F::splat(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A complex number, for Fresnel amplitudes.
    #[derive(Clone, Copy)]
    struct Complex(f64, f64);

    impl Complex {
        fn add(self, other: Complex) -> Complex {
            Complex(self.0 + other.0, self.1 + other.1)
        }
        fn times(self, other: Complex) -> Complex {
            Complex(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
        }
        fn norm2(self) -> f64 {
            self.0 * self.0 + self.1 * self.1
        }
        fn sqrt(self) -> Complex {
            let length = self.norm2().sqrt();
            let im = ((length - self.0) / 2.0).max(0.0).sqrt();
            Complex(((length + self.0) / 2.0).max(0.0).sqrt(), im.copysign(self.1))
        }
    }

    /// |r|² of both polarisations by their amplitudes: (cos − q)/(cos + q) and (m²·cos − q)/(m²·cos + q).
    fn by_amplitudes(cos: f64, eta: f64, k: f64) -> f64 {
        let m2 = Complex(eta, k).times(Complex(eta, k));
        let q = m2.add(Complex(cos * cos - 1.0, 0.0)).sqrt();
        let real = |x: f64| Complex(x, 0.0);
        let ratio = |a: Complex| {
            let minus = Complex(-q.0, -q.1);
            a.add(minus).norm2() / a.add(q).norm2()
        };
        (ratio(real(cos)) + ratio(m2.times(real(cos)))) / 2.0
    }

    #[test]
    fn conductor_reflectance_matches_complex_amplitudes() {
        let mut worst = 0.0_f64;
        for eta in [0.001, 0.05, 0.2, 1.0, 1.5, 4.0, 40.0, 1000.0] {
            for k in [0.0, 0.01, 1.0, 3.5, 9.0, 1000.0] {
                for i in 1..=100 {
                    let cos = f64::from(i) / 100.0;
                    let ours = fresnel_conductor(cos as f32, eta as f32, k as f32);
                    assert!((0.0..=1.0 + 1e-6).contains(&ours), "{eta} {k} {cos}: {ours}");
                    worst = worst.max((f64::from(ours) - by_amplitudes(cos, eta, k)).abs());
                }
            }
        }
        assert!(worst < 2e-5, "{worst:e}");
        // At grazing incidence all light is reflected, whatever the metal.
        assert!((fresnel_conductor(0.0_f32, 0.2, 3.9) - 1.0).abs() < 1e-6);
        // Glass is a conductor that does not absorb.
        let glass = fresnel_conductor(0.7_f32, 1.5, 0.0) - super::super::fresnel_dielectric(0.7_f32, 1.5).0;
        assert!(glass.abs() < 1e-6, "{glass}");
    }
}
