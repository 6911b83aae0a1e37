//! Reflection and transmission at a dielectric sheet that is too thin to displace light.

use super::dielectric::fresnel_dielectric;
use super::ggx::{Ggx, halfway};
use super::{raised, reflect, same_side};
use crate::material::bxdf::{Branch, Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, value};

/// Two parallel interfaces with multiple reflections between them.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<F> {
    /// The index of refraction of the sheet over that around it.
    pub ior: F,
    /// Tint of reflected light.
    pub reflectance: Rgb<F>,
    /// Tint of transmitted light.
    pub transmittance: Rgb<F>,
}

value!(Sheet { ior, reflectance, transmittance });

impl<F: Float> Sheet<F> {
    /// The fraction of light reflected at a cosine of incidence: R + T²·R + T²·R³ + … = 2R/(1 + R).
    #[inline(always)]
    fn reflected(&self, cos: F) -> F {
        let (fresnel, _) = fresnel_dielectric(cos, self.ior);
        fresnel * 2.0 / (fresnel + 1.0)
    }
}

/// A smooth sheet: light passes straight through or is reflected.
#[derive(Clone, Copy, Debug)]
pub struct SmoothSheet<F> {
    /// The sheet.
    pub sheet: Sheet<F>,
}

value!(SmoothSheet { sheet });

impl<F: Float> Bxdf<F> for SmoothSheet<F> {
    const HAS_NON_DELTA: bool = false;
    const HAS_DELTA: bool = true;
    const TRANSMITS: bool = true;

    #[inline(always)]
    fn eval(&self, _wo: Vec3<F>, _wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        Rgb::black()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, _u: [F; 2], lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let (one, sheet) = (F::splat(1.0), &self.sheet);
        let reflected = sheet.reflected(wo.z.abs().min(one));
        let reflects = lobe.lt(reflected);
        BxdfSample {
            wi: Vec3::select(reflects, reflect(wo), -wo),
            weight: Rgb::select(reflects, sheet.reflectance, sheet.transmittance),
            pdf: F::select(reflects, reflected, -reflected + 1.0),
            delta: F::Mask::splat(true),
            eta: one,
        }
    }

    #[inline(always)]
    fn pdf(&self, _wo: Vec3<F>, _wi: Vec3<F>) -> F {
        F::zero()
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.sheet.transmittance
    }

    #[inline(always)]
    fn branches(&self, wo: Vec3<F>, _mode: TransportMode) -> [Branch<F>; 2] {
        let sheet = &self.sheet;
        let reflected = sheet.reflected(wo.z.abs().min(F::splat(1.0)));
        let through = -reflected + 1.0;
        [
            Branch { wi: reflect(wo), weight: sheet.reflectance * reflected, probability: reflected },
            Branch { wi: -wo, weight: sheet.transmittance * through, probability: through },
        ]
    }
}

/// A rough sheet: light is spread by microfacets as in reflection, on both sides.
#[derive(Clone, Copy, Debug)]
pub struct RoughSheet<F> {
    /// The sheet.
    pub sheet: Sheet<F>,
    /// The distribution of its microfacets.
    pub normals: Ggx<F>,
}

value!(RoughSheet { sheet, normals });

impl<F: Float> Bxdf<F> for RoughSheet<F> {
    const TRANSMITS: bool = true;

    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        let (o, i, sheet) = (raised(wo), raised(wi), &self.sheet);
        let (h, cos) = halfway(o, i);
        let reflected = sheet.reflected(cos);
        let tinted = Rgb::select(
            same_side(wo, wi),
            sheet.reflectance * reflected,
            sheet.transmittance * (-reflected + 1.0),
        );
        let f = tinted * (self.normals.density(h) * self.normals.visibility(o, i));
        f.only(!(o.z * i.z).le(F::zero()))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, _mode: TransportMode) -> BxdfSample<F> {
        let (one, zero, sheet, normals) = (F::splat(1.0), F::zero(), &self.sheet, &self.normals);
        let o = raised(wo);
        let h = normals.sample(o, u);
        let cos = o.dot(h).max(zero).min(one);
        let i = h * (cos * 2.0) - o;
        let reflected = sheet.reflected(cos);
        let reflects = lobe.lt(reflected);
        let leaves = i.z.gt(zero) & cos.gt(zero) & o.z.gt(zero);
        let masked = normals.visibility(o, i) * i.z * 4.0 / normals.masking(o);
        let probability = F::select(reflects, reflected, -reflected + 1.0);
        let side = F::select(reflects, wo.z, -wo.z);
        BxdfSample {
            wi: Vec3::new(i.x, i.y, i.z.copysign(side)),
            weight: (Rgb::select(reflects, sheet.reflectance, sheet.transmittance) * masked).only(leaves),
            pdf: (normals.density(h) * normals.masking(o) * 0.25 * probability).only(leaves),
            delta: F::Mask::splat(false),
            eta: one,
        }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        let (o, i) = (raised(wo), raised(wi));
        let (h, cos) = halfway(o, i);
        let reflected = self.sheet.reflected(cos);
        let probability = F::select(same_side(wo, wi), reflected, -reflected + 1.0);
        let pdf = self.normals.density(h) * self.normals.masking(o) * 0.25 * probability;
        pdf.only(!(o.z * i.z).le(F::zero()))
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.sheet.transmittance
    }
}
