//! What every kind of light tells.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::sample::{EmittedRay, Escaped, LightSample};
use crate::math::{Float, Rgb, Vec3};

/// The parameters of a light that is not a surface, as a scene describes it.
pub trait LightParameters {
    /// The light that lanes look up.
    type Light: Light;
    /// The light.
    fn light(&self) -> Self::Light;
}

/// A kind of light. One value is one light as the scene has it; what runs on a path looks lights up by lanes.
///
/// A new kind is a file with this contract in it, a `mod` line, and a line in the list of `kinds`. Directions are of
/// length one, densities of directions by solid angle, and `emission` is that of the row unless a caller has scaled it.
pub trait Light {
    /// Whether its light comes to a point along one direction only, which a BxDF's own direction has no chance to
    /// find: a point, the sun without a size. It is sampled even where all other lights are left to chance, and needs
    /// no numbers for it.
    const DELTA: bool = false;

    /// Whether it is at infinity. Then it has no bounds, and rays that leave the scene see it (see
    /// [`Light::escaped`]).
    const INFINITE: bool = false;

    /// What lanes look up.
    fn row(&self) -> LightRow;

    /// Its place, its power, and where it shines, for the choice among lights; `None` at infinity.
    fn bounds(&self) -> Option<LightBounds>;

    /// A direction from `p` to the light, drawn with `u` in [0, 1)². Which way a surface at `p` faces counts for the
    /// choice among lights alone (see [`LightTable::choose`](super::LightTable::choose)).
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F>;

    /// Density with which [`Light::sample`] from `p` would have drawn the direction of a ray that met the light at
    /// distance `t`, on the side that emits, with the cosine `cos_light` between the normal there and the way back.
    /// It is given for the lanes of the mask; in all others, and for `None` in all lanes, it is that of a point drawn
    /// uniformly by area.
    #[inline(always)]
    fn pdf<F: Float>(lights: &LaneLights<'_, F>, p: Vec3<F>, t: F, cos_light: F) -> Option<(F::Mask, F)> {
        let _ = (lights, p, t, cos_light);
        None
    }

    /// Of a light at infinity: what a ray sees of it that leaves the scene in the direction `d`.
    #[inline(always)]
    fn escaped<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, d: Vec3<F>) -> Escaped<F> {
        let _ = (lights, emission, d);
        Escaped::nothing()
    }

    /// A ray that leaves the light, drawn with `u` in [0, 1)⁴: its origin with the first two numbers, its direction
    /// with the others. From infinity it is an [`EmittedRay::from_beyond`].
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, u: [F; 4]) -> EmittedRay<F>;
}
