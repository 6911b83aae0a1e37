//! The interface of scattering functions, between materials and integrators.
//!
//! Directions are in the shading frame, where +z is the outward normal; they have length one and point
//! away from the surface: `wo` towards where light goes, `wi` towards where it comes from. Densities are
//! by solid angle.

use crate::math::{Float, Mask, Rgb, Vec3, value};

/// The quantity that a path carries.
///
/// It matters where light is refracted: radiance scales with the square of the index of refraction, power does not
/// (Veach 1997, §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// A path from the camera carries radiance: it goes on towards where light comes from.
    Radiance,
    /// A path from a light carries power: it goes on towards where light goes. Such a path swaps its arguments of
    /// [`Bxdf::eval`], so that functions that are not symmetric mean the same in both directions.
    Importance,
}

/// A direction drawn from a BxDF.
#[derive(Clone, Copy, Debug)]
pub struct BxdfSample<F: Float> {
    /// Where the path goes on: where light comes from in [`TransportMode::Radiance`], where it goes in
    /// [`TransportMode::Importance`].
    pub wi: Vec3<F>,
    /// f·|cos θᵢ| / pdf: what the path's throughput is multiplied by. f is that of light which goes along the path, so
    /// f(wo, wi) in [`TransportMode::Radiance`] and f(wi, wo) in [`TransportMode::Importance`].
    pub weight: Rgb<F>,
    /// Density of `wi`; for a delta lobe, the probability of choosing it.
    pub pdf: F,
    /// Whether `wi` comes from a delta lobe, which no other way of sampling can find.
    pub delta: F::Mask,
    /// The index of refraction on the side of `wi` over that on the side of `wo`; 1 where the path stays on its side.
    pub eta: F,
}

value!(BxdfSample { wi, weight, pdf, delta, eta });

/// One of the ways that light takes at a surface that transmits and has delta lobes alone.
#[derive(Clone, Copy, Debug)]
pub struct Branch<F> {
    /// Its direction.
    pub wi: Vec3<F>,
    /// f·|cos θ|, without the probability.
    pub weight: Rgb<F>,
    /// The probability with which [`Bxdf::sample`] chooses it.
    pub chance: F,
}

value!(Branch { wi, weight, chance });

/// The interface of BxDFs.
///
/// `eval(wo, wi)` always means light that arrives along `wi` and leaves along `wo`.
pub trait Bxdf<F: Float> {
    /// Whether it has a lobe that is not a delta, so that [`Bxdf::eval`] says something and sampling lights makes sense.
    const HAS_NON_DELTA: bool = true;
    /// Whether it has a delta lobe, which only [`Bxdf::sample`] and [`Bxdf::branches`] know.
    const HAS_DELTA: bool = false;
    /// Whether it lets light through.
    const TRANSMITS: bool = false;

    /// f(wo, wi) per steradian, without delta lobes.
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F>;
    /// A direction in which a path goes on that came along `wo`, from a pair for the direction and a number for the lobe, both uniform in [0, 1).
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F>;
    /// Density of [`Bxdf::sample`] at `wi`, without delta lobes.
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F;
    /// The fraction of light that is reflected, or transmitted by a transmissive surface, for denoisers and
    /// compositors: about the mean over all directions, in [0, 1].
    fn albedo(&self) -> Rgb<F>;
    /// The lanes that [`Bxdf::HAS_NON_DELTA`] is true of.
    #[inline(always)]
    fn has_non_delta(&self) -> F::Mask {
        F::Mask::splat(Self::HAS_NON_DELTA)
    }
    /// The lanes that [`Bxdf::HAS_DELTA`] is true of.
    #[inline(always)]
    fn has_delta(&self) -> F::Mask {
        F::Mask::splat(Self::HAS_DELTA)
    }
    /// The lanes that [`Bxdf::TRANSMITS`] is true of.
    #[inline(always)]
    fn transmits(&self) -> F::Mask {
        F::Mask::splat(Self::TRANSMITS)
    }
    /// Both delta branches of a surface that transmits and has delta lobes alone, for integrators that follow both. Other
    /// surfaces have none: black ones of no probability.
    #[inline(always)]
    fn branches(&self, wo: Vec3<F>, _mode: TransportMode) -> [Branch<F>; 2] {
        [Branch { wi: wo, weight: Rgb::black(), chance: F::zero() }; 2]
    }
}
