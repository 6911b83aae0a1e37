//! The scattering function of a hit: whichever lobe its material has, a possibly different one in each lane.

use super::bxdf::{Bxdf, BxdfSample, TransportMode};
use super::kind::Kind;
use super::lobes::{Dielectric, Lambertian, Mirror};
use crate::math::{Float, Mask, Rgb, Uint, Vec3};

/// The scattering functions of hits. Integrators see no more of a material than this.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<F: Float> {
    pub(super) kind: F::Uint,
    pub(super) reflectance: Rgb<F>,
    pub(super) transmittance: Rgb<F>,
    pub(super) ior: F,
}

impl<F: Float> Bsdf<F> {
    /// The lanes whose lobe is of a kind.
    #[inline(always)]
    fn is(&self, kind: Kind) -> F::Mask {
        self.kind.eq(F::Uint::splat(kind as u32))
    }

    /// The lanes that reflect no light.
    #[inline(always)]
    pub fn is_black(&self) -> F::Mask {
        self.reflectance.max_channel().le(F::zero())
    }

    /// Both delta branches of a surface that [transmits](Bsdf::transmits), for integrators that follow both: directions,
    /// weights f·|cos θ|, and the probabilities with which [`Bxdf::sample`] chooses them.
    #[inline(always)]
    pub fn branches(&self, wo: Vec3<F>, mode: TransportMode) -> [(Vec3<F>, Rgb<F>, F); 2] {
        self.dielectric().branches(wo, mode)
    }

    #[inline(always)]
    fn lambertian(&self) -> Lambertian<F> {
        Lambertian { reflectance: self.reflectance }
    }

    #[inline(always)]
    fn mirror(&self) -> Mirror<F> {
        Mirror { reflectance: self.reflectance }
    }

    #[inline(always)]
    fn dielectric(&self) -> Dielectric<F> {
        Dielectric { ior: self.ior, reflectance: self.reflectance, transmittance: self.transmittance }
    }
}

impl<F: Float> Bxdf<F> for Bsdf<F> {
    #[inline(always)]
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F> {
        self.lambertian().eval(wo, wi, mode).only(self.is(Kind::Matte))
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F> {
        let mut sample = self.lambertian().sample(wo, u, lobe, mode);
        let mirror = self.is(Kind::Mirror);
        if mirror.any() {
            sample = select(mirror, self.mirror().sample(wo, u, lobe, mode), sample);
        }
        let glass = self.is(Kind::Glass);
        if glass.any() {
            sample = select(glass, self.dielectric().sample(wo, u, lobe, mode), sample);
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

    #[inline(always)]
    fn albedo(&self) -> Rgb<F> {
        Rgb::select(self.is(Kind::Glass), self.dielectric().albedo(), self.reflectance)
    }

    #[inline(always)]
    fn is_smooth(&self) -> F::Mask {
        self.kind.lt(F::Uint::splat(Kind::FIRST_DELTA))
    }

    #[inline(always)]
    fn transmits(&self) -> F::Mask {
        self.is(Kind::Glass)
    }
}

#[inline(always)]
fn select<F: Float>(mask: F::Mask, a: BxdfSample<F>, b: BxdfSample<F>) -> BxdfSample<F> {
    BxdfSample {
        wi: Vec3::select(mask, a.wi, b.wi),
        weight: Rgb::select(mask, a.weight, b.weight),
        pdf: F::select(mask, a.pdf, b.pdf),
        delta: (mask & a.delta) | (!mask & b.delta),
        eta: F::select(mask, a.eta, b.eta),
    }
}
