//! The interface of lights.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::sample::{EmittedRay, Escaped, LightSample};
use crate::math::{Float, Rgb, Vec3};

/// The parameters of a light that is not a surface, as a scene describes it.
pub trait LightParameters {
    /// Adds the light to a list and returns its index. Its kind may depend on the parameters.
    fn add_to(&self, lights: &mut impl LightList) -> u32;
}

/// A list of lights of any kind.
pub trait LightList {
    /// Adds a light and returns its index.
    fn add<L: ListedLight>(&mut self, light: L) -> u32;
}

/// A light whose kind is listed in `kinds.rs`.
pub trait ListedLight: Light {
    /// Its [`LightKind`](super::LightKind).
    const KIND: u32;
}

/// A kind of light. A value is one light of a scene. The functions without `self` run on paths, where each lane looks
/// up a light of its own.
///
/// A new kind needs a file that implements this trait, a `mod` line, and a line in the list of `kinds.rs`; one that is
/// not a surface needs a line in `list.rs` too. Directions have length one, densities of directions are by solid angle,
/// and `emission` is that of the row unless a caller has scaled it.
pub trait Light {
    /// Whether its light reaches a point along a single direction, which sampling the BxDF cannot find, such as that of
    /// a point light or of a sun without a size. `path-naive` samples only these lights. Sampling one uses no random
    /// numbers.
    const DELTA: bool = false;

    /// Whether it is at infinity. Such lights have no bounds, and rays that leave the scene see them unless they are
    /// delta lights (see [`Light::escaped`]).
    const INFINITE: bool = false;

    /// Whether [`Light::pdf`] may differ from `by_area`.
    const HAS_OWN_PDF: bool = false;

    /// Whether it is sampled inline, as frequent kinds are. All other kinds together are out of line, because scenes
    /// without them would pay for tests and registers between the frequent ones.
    const IS_FREQUENT: bool = false;

    /// The light's row in the table.
    fn row(&self) -> LightRow;

    /// Its position, power and directions of emission, for the choice among lights; `None` at infinity.
    fn bounds(&self) -> Option<LightBounds>;

    /// A direction from `p` to the light, sampled with `u` in [0, 1)². The orientation of a surface at `p` matters only
    /// to the choice among lights (see [`LightTable::choose`](super::LightTable::choose)).
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F>;

    /// The density with which [`Light::sample`] from `p` would have sampled the direction of a ray that hit the light.
    /// The hit is at the point `on` at distance `t`, on the emitting side, and `cos_light` is the cosine between the
    /// normal there and the reverse direction. `by_area` is the density if points are sampled uniformly by area.
    #[inline(always)]
    fn pdf<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        on: Vec3<F>,
        t: F,
        cos_light: F,
        by_area: F,
    ) -> F {
        let _ = (lights, p, on, t, cos_light);
        by_area
    }

    /// The radiance of a light at infinity that is not a delta light, along a ray that leaves the scene in the
    /// direction `d`, and the density of that direction.
    #[inline(always)]
    fn escaped<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, d: Vec3<F>) -> Escaped<F> {
        let _ = (lights, emission, d);
        Escaped::none()
    }

    /// A ray that leaves the light, sampled with `u` in [0, 1)⁴: its origin with the first two numbers, its direction
    /// with the others. For a light at infinity it is an [`EmittedRay::from_infinity`].
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, u: [F; 4]) -> EmittedRay<F>;
}
