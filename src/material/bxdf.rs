//! The interface of scattering functions, between materials and integrators.
//!
//! Directions are in the shading frame, where +z is the outward normal. They have length one and point away from the
//! surface: `wo` towards where light goes, `wi` towards where it comes from. Densities are by solid angle.

use crate::math::{Float, Mask, Rgb, Vec3, value};

/// The quantity that a path transports.
///
/// It matters for refraction: radiance scales with the square of the index of refraction, power does not (Veach 1997,
/// §5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// A path from the camera transports radiance: it continues towards where light comes from.
    Radiance,
    /// A path from a light transports power: it continues in the direction of light. Such a path swaps its arguments of
    /// [`Bxdf::eval`], so that asymmetric functions mean the same in both directions.
    Importance,
}

/// A direction sampled from a BxDF.
#[derive(Clone, Copy, Debug)]
pub struct BxdfSample<F: Float> {
    /// The direction in which the path continues: where light comes from in [`TransportMode::Radiance`], where it goes
    /// in [`TransportMode::Importance`].
    pub wi: Vec3<F>,
    /// f·|cos θᵢ| / pdf, the factor of the path's throughput. f is that of the light along the path: f(wo, wi) in
    /// [`TransportMode::Radiance`] and f(wi, wo) in [`TransportMode::Importance`].
    pub weight: Rgb<F>,
    /// The density of `wi`; for a delta lobe, the probability of choosing it.
    pub pdf: F,
    /// Whether `wi` comes from a delta lobe, which no other sampling method can find.
    pub delta: F::Mask,
    /// The index of refraction on the side of `wi` over that on the side of `wo`; 1 if the path stays on its side.
    pub eta: F,
}

value!(BxdfSample { wi, weight, pdf, delta, eta });

/// One of the paths of light at a surface that transmits and has only delta lobes.
#[derive(Clone, Copy, Debug)]
pub struct Branch<F> {
    /// Its direction.
    pub wi: Vec3<F>,
    /// f·|cos θ|, without dividing by the probability.
    pub weight: Rgb<F>,
    /// The probability with which [`Bxdf::sample`] chooses it.
    pub probability: F,
}

value!(Branch { wi, weight, probability });

/// The interface of BxDFs.
///
/// `eval(wo, wi)` always means light that arrives along `wi` and leaves along `wo`.
pub trait Bxdf<F: Float> {
    /// Whether it has a lobe that is not a delta lobe, for which [`Bxdf::eval`] is defined and sampling lights makes
    /// sense.
    const HAS_NON_DELTA: bool = true;
    /// Whether it has a delta lobe, which only [`Bxdf::sample`] and [`Bxdf::branches`] include.
    const HAS_DELTA: bool = false;
    /// Whether it transmits light.
    const TRANSMITS: bool = false;

    /// f(wo, wi) per steradian, without delta lobes.
    fn eval(&self, wo: Vec3<F>, wi: Vec3<F>, mode: TransportMode) -> Rgb<F>;
    /// A direction in which a path that arrived along `wo` continues. Sampled with a pair of numbers for the direction
    /// and one for the lobe, all uniform in [0, 1).
    fn sample(&self, wo: Vec3<F>, u: [F; 2], lobe: F, mode: TransportMode) -> BxdfSample<F>;
    /// The density of [`Bxdf::sample`] at `wi`, without delta lobes.
    fn pdf(&self, wo: Vec3<F>, wi: Vec3<F>) -> F;
    /// The fraction of light that is reflected, or transmitted by a transmissive surface, for denoisers and
    /// compositors: approximately the mean over all directions, in [0, 1].
    fn albedo(&self) -> Rgb<F>;
    /// The lanes for which [`Bxdf::HAS_NON_DELTA`] is true.
    #[inline(always)]
    fn has_non_delta(&self) -> F::Mask {
        F::Mask::splat(Self::HAS_NON_DELTA)
    }
    /// The lanes for which [`Bxdf::HAS_DELTA`] is true.
    #[inline(always)]
    fn has_delta(&self) -> F::Mask {
        F::Mask::splat(Self::HAS_DELTA)
    }
    /// The lanes for which [`Bxdf::TRANSMITS`] is true.
    #[inline(always)]
    fn transmits(&self) -> F::Mask {
        F::Mask::splat(Self::TRANSMITS)
    }
    /// Both delta branches of a surface that transmits and has only delta lobes, for integrators that follow both.
    /// Other surfaces have none: black ones of probability zero.
    #[inline(always)]
    fn branches(&self, wo: Vec3<F>, _mode: TransportMode) -> [Branch<F>; 2] {
        [Branch { wi: wo, weight: Rgb::black(), probability: F::zero() }; 2]
    }
}
