//! Reflection and refraction at a rough surface.

use super::dielectric::{fresnel_by_cosines, fresnel_dielectric};
use super::ggx::{Ggx, LEAST_LENGTH};
use super::{raised, same_side};
use crate::material::bxdf::{Bxdf, BxdfSample, TransportMode};
use crate::math::{Float, Mask, Rgb, Vec3, value};

/// A rough dielectric interface (Walter et al. 2007, §5): each microfacet reflects the Fresnel fraction of light and
/// refracts the rest. Light that meets a second microfacet is lost.
///
/// [`Bxdf::eval`] is the same for both modes, because light along a path from a light swaps its arguments. It is the
/// scattering function itself, for which f(wo, wi)/n(wo)² = f(wi, wo)/n(wi)² holds.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric<F> {
    /// The index of refraction below the surface over that above it, which is not one.
    pub ior: F,
    /// Tint of reflected light.
    pub reflectance: Rgb<F>,
    /// Tint of transmitted light.
    pub transmittance: Rgb<F>,
    /// The distribution of its microfacets.
    pub normals: Ggx<F>,
}

value!(RoughDielectric { ior, reflectance, transmittance, normals });

/// A microfacet that scatters one direction into another, seen from the side of the first.
struct Facet<F: Float> {
    /// The directions, mirrored so that the first is above the surface.
    o: Vec3<F>,
    i: Vec3<F>,
    reflects: F::Mask,
    /// The microfacet's normal, above the surface.
    h: Vec3<F>,
    /// Whether it faces both directions as required.
    faces: F::Mask,
    /// Its Fresnel reflectance.
    fresnel: F,
    /// |dh/dwi| of refraction.
    per_normal: F,
    /// The index of refraction of the far side over that of the near side.
    eta: F,
}

impl<F: Float> RoughDielectric<F> {
    /// The index of refraction on the far side of the surface over that on the side of `wo`.
    #[inline(always)]
    fn eta(&self, wo: Vec3<F>) -> F {
        F::select(F::zero().le(wo.z), self.ior, F::splat(1.0) / self.ior)
    }

    /// |dh/dwi| of refraction, from the cosines between the normal and both directions.
    #[inline(always)]
    fn per_normal(cos_o: F, cos_i: F, eta: F) -> F {
        let sum = cos_i + cos_o / eta;
        cos_i.abs() / (sum * sum).max(F::splat(f32::MIN_POSITIVE))
    }

    #[inline(always)]
    fn facet(&self, wo: Vec3<F>, wi: Vec3<F>) -> Facet<F> {
        let (one, eta, reflects) = (F::splat(1.0), self.eta(wo), same_side(wo, wi));
        let (o, i) = (raised(wo), Vec3::new(wi.x, wi.y, wi.z * one.copysign(wo.z)));
        let sum = o + i * F::select(reflects, one, eta);
        let h = sum * (one / sum.length().max(F::splat(LEAST_LENGTH)));
        let h = h * one.copysign(h.z);
        let (cos_o, cos_i) = (o.dot(h), i.dot(h));
        let zero = F::zero();
        let faces = cos_o.gt(zero) & ((reflects & cos_i.gt(zero)) | (!reflects & cos_i.lt(zero)));
        let (reflected, _) = fresnel_dielectric(cos_o.max(zero).min(one), eta);
        // Close to the critical angle, the cosine of refraction is more accurate from the direction than from the angle
        // of incidence.
        let refracted = fresnel_by_cosines(cos_o, cos_i.abs(), eta);
        let fresnel = F::select(reflects, reflected, refracted);
        let per_normal = RoughDielectric::per_normal(cos_o, cos_i, eta);
        Facet { o, i, reflects, h, faces, fresnel, per_normal, eta }
    }
}

impl<F: Float> Bxdf<F> for RoughDielectric<F> {
    const TRANSMITS: bool = true;

    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, _mode: TransportMode) -> Rgb<F> {
        let Facet { o, i, reflects, h, faces, fresnel, per_normal, eta } = self.facet(wo, wi);
        let share = self.normals.density(h) * self.normals.visibility(o, raised(i));
        let refracted = share * (-fresnel + 1.0) * o.dot(h) * per_normal * 4.0 / (eta * eta);
        let f = Rgb::select(reflects, self.reflectance * (share * fresnel), self.transmittance * refracted);
        f.only(faces & !(wi.z * wo.z).abs().le(F::zero()))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F> {
        let (one, zero, normals) = (F::splat(1.0), F::zero(), &self.normals);
        let (o, eta) = (raised(wo), self.eta(wo));
        let h = normals.sample(o, u);
        let cos = o.dot(h).max(zero).min(one);
        let (fresnel, cos_t) = fresnel_dielectric(cos, eta);
        let reflects = lobe.lt(fresnel);
        let reflected = h * (cos * 2.0) - o;
        // Into a much thinner medium the difference cancels, and its length is inaccurate.
        let refracted = (h * (cos / eta - cos_t) - o * (one / eta)).normalized();
        let i = Vec3::select(reflects, reflected, refracted);
        // A direction on the other side than that of its microfacet meets a second one.
        let leaves = ((reflects & i.z.gt(zero)) | (!reflects & i.z.lt(zero))) & cos.gt(zero) & o.z.gt(zero);
        // G₂/G₁: the Fresnel factor and the density of visible normals cancel.
        let masked = normals.visibility(o, raised(i)) * i.z.abs() * 4.0 / normals.masking(o);
        let squeezed = match mode {
            TransportMode::Radiance => masked / (eta * eta),
            TransportMode::Importance => masked,
        };
        let weight =
            Rgb::select(reflects, self.reflectance * masked, self.transmittance * squeezed).only(leaves);
        let visible = normals.density(h) * normals.masking(o);
        let per_normal = RoughDielectric::per_normal(cos, -cos_t, eta);
        let pdf =
            F::select(reflects, visible * fresnel * 0.25, visible * (-fresnel + 1.0) * cos * per_normal);
        BxdfSample {
            wi: Vec3::new(i.x, i.y, i.z * one.copysign(wo.z)),
            weight,
            pdf: pdf.only(leaves),
            delta: F::Mask::splat(false),
            eta: F::select(reflects, one, eta),
        }
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        let Facet { o, reflects, h, faces, fresnel, per_normal, .. } = self.facet(wo, wi);
        let visible = self.normals.density(h) * self.normals.masking(o);
        let refracted = visible * (-fresnel + 1.0) * o.dot(h) * per_normal;
        let pdf = F::select(reflects, visible * fresnel * 0.25, refracted);
        pdf.only(faces & !(wi.z * wo.z).abs().le(F::zero()))
    }

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        self.transmittance
    }
}
