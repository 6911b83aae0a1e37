//! BxDFs: how light scatters at a point.
//!
//! Directions are in the shading frame, where +z is the outward normal; they have length one and point
//! away from the surface: `wo` towards where light goes, `wi` towards where it comes from. Densities are
//! by solid angle.

use super::kind::Kind;
use crate::math::{Float, Mask, Rgb, Uint, Vec3};
use crate::sampling::warp;
use std::f32::consts::FRAC_1_PI;

/// A direction drawn from a BxDF.
#[derive(Clone, Copy, Debug)]
pub struct BxdfSample<F: Float> {
    /// Where light comes from.
    pub wi: Vec3<F>,
    /// f(wo, wi)·|cos θᵢ| / pdf: what the path's throughput is multiplied by.
    pub weight: Rgb<F>,
    /// Density of `wi`; for a delta lobe, the probability of choosing it.
    pub pdf: F,
    /// Whether `wi` comes from a delta lobe, which no other way of sampling can find.
    pub delta: F::Mask,
}

/// What every BxDF can do.
pub trait Bxdf<F: Float> {
    /// f(wo, wi) per steradian, without delta lobes.
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>) -> Rgb<F>;
    /// A direction for `wo`, from a pair for the direction and a number for the lobe.
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F) -> BxdfSample<F>;
    /// Density of [`Bxdf::sample`] at `wi`, without delta lobes.
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F;
}

/// Scatters evenly on the side that the light came from (report §4.3.1.1): f = R/π.
#[derive(Clone, Copy, Debug)]
pub struct Lambertian<F> {
    /// The fraction reflected.
    pub reflectance: Rgb<F>,
}

/// Whether two directions are on the same side of the surface.
#[inline(always)]
fn same_side<F: Float>(wo: Vec3<F>, wi: Vec3<F>) -> F::Mask {
    (wo.z * wi.z).gt(F::zero())
}

impl<F: Float> Bxdf<F> for Lambertian<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>) -> Rgb<F> {
        (self.reflectance * F::splat(FRAC_1_PI)).only(same_side(wo, wi))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], _lobe: F) -> BxdfSample<F> {
        let up = warp::cosine_hemisphere(u);
        let wi = Vec3::new(up.x, up.y, up.z.copysign(wo.z));
        // f·cos/pdf = (R/π)·cos / (cos/π): what the report's program, which leaves π out of f, gets wrong.
        let pdf = warp::cosine_hemisphere_pdf(up.z);
        BxdfSample { wi, weight: self.reflectance, pdf, delta: F::Mask::splat(false) }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        warp::cosine_hemisphere_pdf(wi.z.abs()).only(same_side(wo, wi))
    }
}

/// Reflects perfectly on both sides (report §4.3.1.2).
#[derive(Clone, Copy, Debug)]
pub struct Mirror<F> {
    /// The fraction reflected.
    pub reflectance: Rgb<F>,
}

/// The mirror image of a direction about the normal.
#[inline(always)]
fn reflect<F: Float>(w: Vec3<F>) -> Vec3<F> {
    Vec3::new(-w.x, -w.y, w.z)
}

impl<F: Float> Bxdf<F> for Mirror<F> {
    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], _lobe: F) -> BxdfSample<F> {
        let delta = F::Mask::splat(true);
        BxdfSample { wi: reflect(wo), weight: self.reflectance, pdf: F::splat(1.0), delta }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }
}

/// A smooth dielectric interface: Fresnel reflection and Snell refraction.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric<F> {
    /// Index of refraction below the surface over that above it.
    pub ior: F,
    /// Tint of what is reflected.
    pub reflectance: Rgb<F>,
    /// Tint of what is transmitted.
    pub transmittance: Rgb<F>,
}

/// Fresnel reflectance of unpolarised light at a smooth dielectric, and the cosine of refraction.
///
/// `cos_i` ≥ 0 is the cosine of incidence and `eta` the index of the far side over that of the near side.
/// With total internal reflection it gives (1, 0) (Born and Wolf 1999, §1.5.2).
#[inline(always)]
pub fn fresnel_dielectric<F: Float>(cos_i: F, eta: F) -> (F, F) {
    let sin2_t = (-cos_i * cos_i + 1.0) / (eta * eta);
    let cos_t = (-sin2_t + 1.0).max(F::zero()).sqrt();
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let reflectance = (parallel * parallel + perpendicular * perpendicular) * 0.5;
    let total = F::splat(1.0).le(sin2_t);
    (F::select(total, F::splat(1.0), reflectance), cos_t.only(!total))
}

impl<F: Float> Dielectric<F> {
    /// Both branches of `wo`: the reflected direction and its weight, the refracted direction and its
    /// weight, with f·|cos| / 1 each, hence the Fresnel factors inside. Where light cannot pass, the
    /// refracted weight is black.
    #[inline(always)]
    pub fn branches(&self, wo: Vec3<F>) -> [(Vec3<F>, Rgb<F>, F); 2] {
        let outside = F::zero().le(wo.z);
        let eta = F::select(outside, self.ior, F::splat(1.0) / self.ior);
        let (fresnel, cos_t) = fresnel_dielectric(wo.z.abs(), eta);
        let scale = F::splat(1.0) / eta;
        let refracted = Vec3::new(-wo.x * scale, -wo.y * scale, -cos_t.copysign(wo.z));
        // Radiance is squeezed into a smaller solid angle where it enters the denser side (Veach 1997, §5.2).
        let through = -fresnel + 1.0;
        let transmitted = through * scale * scale;
        [
            (reflect(wo), self.reflectance * fresnel, fresnel),
            (refracted, self.transmittance * transmitted, through),
        ]
    }
}

impl<F: Float> Bxdf<F> for Dielectric<F> {
    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], lobe: F) -> BxdfSample<F> {
        let [(reflected, _, fresnel), (refracted, through, _)] = self.branches(wo);
        let reflects = lobe.lt(fresnel);
        let chance = F::select(reflects, fresnel, -fresnel + 1.0);
        // The chance of a branch is its Fresnel factor, which therefore cancels.
        let transmitted = through * (F::splat(1.0) / chance);
        BxdfSample {
            wi: Vec3::select(reflects, reflected, refracted),
            weight: Rgb::select(reflects, self.reflectance, transmitted),
            pdf: chance,
            delta: F::Mask::splat(true),
        }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }
}

/// The BxDFs of a hit, a possibly different one in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<F: Float> {
    pub(super) kind: F::Uint,
    pub(super) reflectance: Rgb<F>,
    pub(super) transmittance: Rgb<F>,
    pub(super) ior: F,
}

impl<F: Float> Bsdf<F> {
    /// The lanes whose BxDF is of a kind.
    #[inline(always)]
    pub fn is(&self, kind: Kind) -> F::Mask {
        self.kind.eq(F::Uint::splat(kind as u32))
    }
    /// The reflectance of each lane.
    #[inline(always)]
    pub fn reflectance(&self) -> Rgb<F> {
        self.reflectance
    }
    /// η² of a passage from the side of `wo` to the other, in lanes that pass through glass; 1 elsewhere.
    #[inline(always)]
    pub fn eta2_scale(&self, wo: Vec3<F>, passes: F::Mask) -> F {
        let glass = self.is(Kind::Glass) & passes;
        if !glass.any() {
            return F::splat(1.0);
        }
        let eta = F::select(F::zero().le(wo.z), self.ior, F::splat(1.0) / self.ior);
        F::select(glass, eta * eta, F::splat(1.0))
    }
    #[inline(always)]
    fn lambertian(&self) -> Lambertian<F> {
        Lambertian { reflectance: self.reflectance }
    }
    #[inline(always)]
    fn mirror(&self) -> Mirror<F> {
        Mirror { reflectance: self.reflectance }
    }
    /// The lanes' dielectrics; meaningful where [`Bsdf::is`] says glass.
    #[inline(always)]
    pub fn dielectric(&self) -> Dielectric<F> {
        Dielectric { ior: self.ior, reflectance: self.reflectance, transmittance: self.transmittance }
    }
}

#[inline(always)]
fn select_sample<F: Float>(mask: F::Mask, a: BxdfSample<F>, b: BxdfSample<F>) -> BxdfSample<F> {
    BxdfSample {
        wi: Vec3::select(mask, a.wi, b.wi),
        weight: Rgb::select(mask, a.weight, b.weight),
        pdf: F::select(mask, a.pdf, b.pdf),
        delta: (mask & a.delta) | (!mask & b.delta),
    }
}

impl<F: Float> Bxdf<F> for Bsdf<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>) -> Rgb<F> {
        self.lambertian().eval(wo, wi).only(self.is(Kind::Matte))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F) -> BxdfSample<F> {
        let mut sample = self.lambertian().sample(wo, u, lobe);
        let mirror = self.is(Kind::Mirror);
        if mirror.any() {
            sample = select_sample(mirror, self.mirror().sample(wo, u, lobe), sample);
        }
        let glass = self.is(Kind::Glass);
        if glass.any() {
            sample = select_sample(glass, self.dielectric().sample(wo, u, lobe), sample);
        }
        #[cfg(feature = "broken-material")]
        {
            let third = F::select(lobe.lt(F::splat(2.0 / 3.0)), F::splat(f32::INFINITY), F::splat(-1.0));
            let value = F::select(lobe.lt(F::splat(1.0 / 3.0)), F::splat(f32::NAN), third);
            sample.weight = Rgb::select(self.is(Kind::Broken), Rgb::new(value, value, value), sample.weight);
        }
        sample
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        self.lambertian().pdf(wo, wi).only(self.is(Kind::Matte))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                energy += bxdf.eval(wo, wi).r * cos.abs() * 4.0 * std::f32::consts::PI / (n * n) as f32;
            }
            assert!((energy - 0.5).abs() < 1e-3, "∫ f cos is {energy}, not the reflectance");
            let sample = bxdf.sample(wo, [0.3, 0.7], 0.0);
            assert!(sample.wi.z * wo.z > 0.0);
            let weight = bxdf.eval(wo, sample.wi).r * sample.wi.z.abs() / bxdf.pdf(wo, sample.wi);
            assert!((weight - sample.weight.r).abs() < 1e-6);
            assert!((sample.pdf - bxdf.pdf(wo, sample.wi)).abs() < 1e-6);
        }
    }

    #[test]
    fn fresnel_at_normal_incidence_brewster_and_beyond_the_critical_angle() {
        let (r, cos_t) = fresnel_dielectric(1.0_f32, 1.5);
        assert!((r - 0.04).abs() < 1e-6 && (cos_t - 1.0).abs() < 1e-6);
        // At Brewster's angle only perpendicular light is reflected: R = ½((1 − η²)/(1 + η²))².
        let cos_brewster = (1.0_f32 / (1.0 + 1.5 * 1.5)).sqrt();
        let expected = 0.5 * ((1.0 - 1.5_f32.powi(2)) / (1.0 + 1.5_f32.powi(2))).powi(2);
        assert!((fresnel_dielectric(cos_brewster, 1.5).0 - expected).abs() < 1e-6);
        assert_eq!(fresnel_dielectric(0.5_f32, 1.0 / 1.5), (1.0, 0.0));
        // From inside at sin i = 0.6, sin t = 0.9: ½((η·0.8 − cos t)²/(…)² + (0.8 − η·cos t)²/(…)²).
        assert!((fresnel_dielectric(0.8_f32, 1.0 / 1.5).0 - 0.114_141).abs() < 1e-5);
    }

    #[test]
    fn glass_obeys_snell_and_loses_nothing() {
        let glass = Dielectric { ior: 1.5_f32, reflectance: rgb(1.0), transmittance: rgb(1.0) };
        for cos in [0.9, 0.3, 0.05, -0.9, -0.8] {
            let wo = direction(cos, 0.2);
            let eta = if cos > 0.0 { 1.5 } else { 1.0 / 1.5 };
            let [(reflected, fr, _), (refracted, ft, _)] = glass.branches(wo);
            assert_eq!([reflected.x, reflected.y, reflected.z], [-wo.x, -wo.y, wo.z]);
            let sin = |w: Vec3<f32>| (w.x * w.x + w.y * w.y).sqrt();
            assert!((sin(wo) - eta * sin(refracted)).abs() < 1e-6, "Snell at {cos}");
            assert!(refracted.z * wo.z < 0.0);
            assert!((refracted.length() - 1.0).abs() < 1e-6);
            // Radiance changes by η² where it passes; flux does not.
            assert!((fr.r + ft.r * eta * eta - 1.0).abs() < 1e-6);
            for lobe in [0.0, 0.999_999] {
                let sample = glass.sample(wo, [0.5; 2], lobe);
                let expected = if lobe < fr.r { 1.0 } else { 1.0 / (eta * eta) };
                assert!((sample.weight.r - expected).abs() < 1e-5);
            }
        }
        // Past the critical angle everything is reflected.
        let sample = glass.sample(direction(-0.3, 0.2), [0.5; 2], 0.999_999);
        assert!(sample.wi.z < 0.0 && sample.weight.r == 1.0);
    }
}
