//! The dielectrics that contain a path, in scenes with media (see [`Media`]), and surfaces that paths pass straight
//! through.
//!
//! Light is absorbed along a segment by the effective medium: the dielectric of the highest priority that contains the
//! path, and among equal priorities the one entered last. In scenes with priorities, a surface is an interface only if
//! the effective medium changes there; it refracts by the indices of both media. Paths pass straight through other
//! surfaces of dielectrics (Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced Images"). Thin sheets and
//! metals reflect by their indices relative to the effective medium.
//!
//! - A path starts inside the dielectrics that an upward ray from the camera's eye leaves without having entered them,
//!   for every position on the lens or the film. A path that leaves a dielectric without having entered it has been
//!   inside all along.
//! - At most [`MOST_INTERIORS`] dielectrics are stored. Beyond that, the one of the lowest precedence is dropped: if
//!   all others are left before it, the path continues as if it were outside.
//! - Shadow rays end at every surface, except at holes. They are absorbed by the medium on the side where they start.
//!   No shadow ray could reach emission behind a surface that the path passed straight through, so such emission has an
//!   MIS weight of 1.
//! - At a hole the medium does not change, and shadow rays can reach the emission behind it.
//! - A ray cannot tell coincident surfaces apart: it hits the first one and continues beyond both. Dielectrics that
//!   touch must overlap slightly, such as water that extends into its glass.
//! - Passing straight through a surface is no bounce. A path passes at most [`MOST_PASSED`] surfaces in a row.

use crate::material::{Bsdf, MOST_INTERIORS, Media};
use crate::math::lanes::{Layout, Part, Value};
use crate::math::{Float, Mask, Rgb, Uint, Vec3, function, value};
use crate::world::{CompiledScene, Interaction};
use std::cell::Cell;

/// The maximum number of surfaces in a row that a path passes straight through. It bounds the work; no scene should
/// reach it.
pub(crate) const MOST_PASSED: u32 = 1024;

/// The maximum number of holes that a path passes through. Behind them, surfaces are opaque and occlude lights, so that
/// every path ends.
pub(super) const MOST_HOLES: u32 = 1024;

/// The media that contain a path: see [`Media::packed`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interiors<F: Float> {
    pub(crate) words: [F::Uint; 2],
}

/// The surroundings of a path: its media, and counters of surfaces passed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around<F: Float> {
    /// The media along the ray.
    pub(crate) here: Interiors<F>,
    /// The media beyond the surface that the path hit.
    pub(crate) beyond: Interiors<F>,
    /// In scenes with priorities, the index of refraction above that surface: that of the effective medium outside a
    /// dielectric, and on both sides of other surfaces. Otherwise 1.
    pub(crate) outside: F,
    /// The number of surfaces passed since the last bounce, without holes.
    pub(crate) passed: F::Uint,
    /// The number of surfaces passed by the path, through holes or because they are no interfaces; with `whitted`, by all
    /// branches of the sample. The random numbers of the next surface depend on it, so that no two surfaces share them.
    pub(crate) holes: F::Uint,
}

value!(Interiors { words });
value!(Around { here, beyond, outside, passed, holes });

impl<F: Float> Interiors<F> {
    #[inline(always)]
    fn outside_of_everything() -> Self {
        Interiors { words: [F::Uint::splat(0); 2] }
    }

    #[inline(always)]
    fn media(self) -> [F::Uint; MOST_INTERIORS] {
        let low = F::Uint::splat(0xffff);
        let [first, second] = self.words;
        [first & low, first.shr::<16>(), second & low, second.shr::<16>()]
    }

    #[inline(always)]
    fn of([a, b, c, d]: [F::Uint; MOST_INTERIORS]) -> Self {
        Interiors { words: [a | b.shl::<16>(), c | d.shl::<16>()] }
    }

    /// The effective medium.
    #[inline(always)]
    fn first(self) -> F::Uint {
        self.words[0] & F::Uint::splat(0xffff)
    }

    /// Inserts a medium before those of equal priority, and drops the last of too many. Zero changes nothing.
    #[inline(always)]
    fn with(self, media: &Media, medium: F::Uint) -> Self {
        let [a, b, c, d] = self.media();
        let own = media.priority(medium);
        // Whether each medium precedes it; priorities descend.
        let (first, second) = (own.lt(media.priority(a)), own.lt(media.priority(b)));
        let (third, fourth) = (own.lt(media.priority(c)), own.lt(media.priority(d)));
        Interiors::of([
            F::Uint::select(first, a, medium),
            F::Uint::select(second, b, F::Uint::select(first, medium, a)),
            F::Uint::select(third, c, F::Uint::select(second, medium, b)),
            F::Uint::select(fourth, d, F::Uint::select(third, medium, c)),
        ])
    }

    /// The lanes whose media include `medium`.
    #[inline(always)]
    fn has(self, medium: F::Uint) -> F::Mask {
        let [a, b, c, d] = self.media();
        a.eq(medium) | b.eq(medium) | c.eq(medium) | d.eq(medium)
    }

    /// Removes the first occurrence of a medium, if there is one. Zero changes nothing.
    #[inline(always)]
    fn without(self, medium: F::Uint) -> Self {
        let [a, b, c, d] = self.media();
        let first = a.eq(medium);
        let second = first | b.eq(medium);
        let third = second | c.eq(medium);
        let fourth = third | d.eq(medium);
        Interiors::of([
            F::Uint::select(first, b, a),
            F::Uint::select(second, c, b),
            F::Uint::select(third, d, c),
            F::Uint::select(fourth, F::Uint::splat(0), d),
        ])
    }
}

impl<F: Float> Around<F> {
    /// The surroundings of a path that leaves the camera.
    #[inline(always)]
    pub(crate) fn at_camera(scene: &CompiledScene) -> Self {
        let nothing = Around::nothing();
        if scene.materials.media().is_none() {
            return nothing;
        }
        let [first, second] = &scene.inside;
        Around { here: Interiors { words: [F::Uint::given(first), F::Uint::given(second)] }, ..nothing }
    }

    /// The surroundings of a path outside of all dielectrics.
    #[inline(always)]
    pub(crate) fn nothing() -> Self {
        let (nothing, zero) = (Interiors::outside_of_everything(), F::Uint::splat(0));
        Around { here: nothing, beyond: nothing, outside: F::splat(1.0), passed: zero, holes: zero }
    }
}

/// The change of interiors at a surface.
#[derive(Clone, Copy)]
struct Crossing<F: Float> {
    beyond: Interiors<F>,
    outside: F,
    /// The lanes in which the effective medium is the same on both sides and is a dielectric.
    passes: F::Mask,
}

value!(Crossing { beyond, outside, passes });

/// Storage for the surroundings of paths: none, a value, or memory.
///
/// Lanes store them in memory, so that paths in scenes that [do not need them](are_tracked) carry no state for them.
/// Recorded programs hold them as a value, or not at all in such scenes. They are changed in separate functions, whose
/// closures take copies: a reference would keep the state of paths in memory everywhere.
pub(crate) trait Surroundings<F: Float>: Value<F> {
    /// The media of the scene, if it has any and they are tracked.
    fn media<'s>(&self, scene: &'s CompiledScene) -> Option<&'s Media>;
    /// The current surroundings.
    fn get(&self) -> Around<F>;
    /// The surroundings, replaced by `around` in some lanes.
    fn set(self, lanes: F::Mask, around: Around<F>) -> Self;
}

/// No storage.
impl<F: Float> Surroundings<F> for () {
    #[inline(always)]
    fn media<'s>(&self, _scene: &'s CompiledScene) -> Option<&'s Media> {
        None
    }
    #[inline(always)]
    fn get(&self) -> Around<F> {
        Around::nothing()
    }
    #[inline(always)]
    fn set(self, _lanes: F::Mask, _around: Around<F>) -> Self {}
}

impl<F: Float> Surroundings<F> for Around<F> {
    #[inline(always)]
    fn media<'s>(&self, scene: &'s CompiledScene) -> Option<&'s Media> {
        scene.materials.media()
    }
    #[inline(always)]
    fn get(&self) -> Around<F> {
        *self
    }
    #[inline(always)]
    fn set(self, lanes: F::Mask, around: Around<F>) -> Self {
        Around::blend(lanes, around, self)
    }
}

/// Storage in memory, for lanes. As a [`Value`] it has no components: blending returns the same reference.
#[derive(Clone, Copy)]
pub(super) struct InMemory<'a, F: Float>(pub(super) &'a Cell<Around<F>>);

impl<F: Float> Value<F> for InMemory<'_, F> {
    #[inline(always)]
    fn blend(_mask: F::Mask, a: Self, _b: Self) -> Self {
        a
    }
    fn layout() -> Layout {
        Layout::List(Vec::new())
    }
    fn parts(&self, _parts: &mut Vec<Part<F>>) {}
    fn of_parts(_parts: &mut impl Iterator<Item = Part<F>>) -> Self {
        unreachable!("a place is not made of numbers")
    }
}

impl<F: Float> Surroundings<F> for InMemory<'_, F> {
    #[inline(always)]
    fn media<'s>(&self, scene: &'s CompiledScene) -> Option<&'s Media> {
        scene.materials.media()
    }
    #[inline(always)]
    fn get(&self) -> Around<F> {
        self.0.get()
    }
    #[inline(always)]
    fn set(self, lanes: F::Mask, around: Around<F>) -> Self {
        self.0.set(Around::blend(lanes, around, self.0.get()));
        self
    }
}

/// Whether a scene needs surroundings: whether it has media or holes.
#[inline(always)]
pub(super) fn are_tracked(scene: &CompiledScene) -> bool {
    scene.materials.has_surroundings()
}

/// Resets the surroundings of the paths in `lanes` to those at the camera.
#[inline(always)]
pub(super) fn reset<F: Float, S: Surroundings<F>>(scene: &CompiledScene, around: S, lanes: F::Mask) -> S {
    if !are_tracked(scene) {
        return around;
    }
    F::out_of_line(
        #[inline(always)]
        move || around.set(lanes, Around::at_camera(scene)),
    )
}

/// The throughput after absorption along the ray over `length`, which may be infinite.
#[inline(always)]
pub(crate) fn absorbed<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    around: &S,
    beta: Rgb<F>,
    length: F,
) -> Rgb<F> {
    let Some(media) = around.media(scene) else { return beta };
    let around = *around;
    // Only the factor is computed out of line: see `MaterialTable::bsdf`.
    beta * F::out_of_line(
        #[inline(always)]
        move || media.transmittance(around.get().here.first(), length),
    )
}

/// The light from `wi` at an interaction, after absorption over `length`.
#[inline(always)]
pub(super) fn attenuated<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    around: &S,
    at: &Interaction<F>,
    wi: Vec3<F>,
    length: F,
    light: Rgb<F>,
) -> Rgb<F> {
    let Some(media) = around.media(scene) else { return light };
    let (around, crosses) = (*around, crosses(at, wi));
    light
        * F::out_of_line(
            #[inline(always)]
            move || {
                let Around { here, beyond, .. } = around.get();
                let medium = F::Uint::select(crosses, beyond.first(), here.first());
                media.transmittance(medium, length)
            },
        )
}

/// The lanes in which a direction leads to the opposite side of the surface from the ray's origin.
#[inline(always)]
fn crosses<F: Float>(at: &Interaction<F>, d: Vec3<F>) -> F::Mask {
    (d.dot(at.point.n) * at.cos_o).lt(F::zero())
}

/// The surroundings after a hit, in the lanes of `met`, and the lanes that pass straight through the surface because
/// the effective medium does not change.
#[inline(always)]
pub(crate) fn at_surface<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    around: S,
    at: &Interaction<F>,
    met: F::Mask,
) -> (S, F::Mask) {
    let Some(media) = around.media(scene) else { return (around, F::Mask::splat(false)) };
    let (material, enters) = (at.material, at.cos_o.gt(F::zero()));
    F::out_of_line(
        #[inline(always)]
        move || {
            let own = around.get();
            let here = own.here;
            let Crossing { beyond, outside, passes } =
                function!(F, meet_interface(here, material, enters), {
                    cross(media, here, material, enters)
                });
            (around.set(met, Around { beyond, outside, ..own }), met & passes)
        },
    )
}

/// The change of interiors at a surface of a material, which the path enters in the lanes of `enters` and leaves in
/// others.
#[inline(always)]
fn cross<F: Float>(media: &Media, here: Interiors<F>, material: F::Uint, enters: F::Mask) -> Crossing<F> {
    let medium = media.medium(material);
    let (entered, left) = (here.with(media, medium), here.without(medium));
    // A path that leaves a dielectric without having entered it has been inside all along.
    let inner = Interiors::blend(!enters & here.has(medium), here, entered);
    let outer = Interiors::blend(enters, here, left);
    let beyond = Interiors::blend(enters, inner, outer);
    if !media.nests() {
        return Crossing { beyond, outside: F::splat(1.0), passes: F::Mask::splat(false) };
    }
    let is_bounded = F::Uint::splat(0).lt(medium);
    let around = outer.first();
    Crossing { beyond, outside: media.index(around), passes: is_bounded & around.eq(inner.first()) }
}

/// The BSDF at an interaction. Interfaces refract by the indices of the two effective media.
#[inline(always)]
pub(super) fn bsdf<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    at: &Interaction<F>,
    around: &S,
) -> Bsdf<F> {
    let bsdf = scene.bsdf(at);
    if around.media(scene).is_some_and(Media::nests) { bsdf.within(around.get().outside) } else { bsdf }
}

/// The surroundings of paths that leave an interaction towards `d` after a bounce, in some lanes.
#[inline(always)]
pub(crate) fn after_bounce<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    around: S,
    at: &Interaction<F>,
    d: Vec3<F>,
    lanes: F::Mask,
) -> S {
    if around.media(scene).is_none() {
        return around;
    }
    let crosses = crosses(at, d);
    F::out_of_line(
        #[inline(always)]
        move || {
            let own = around.get();
            let here = Interiors::blend(crosses, own.beyond, own.here);
            around.set(lanes, Around { here, passed: F::Uint::splat(0), ..own })
        },
    )
}

/// The surroundings of paths that continue straight on, in the lanes of `is_none` past surfaces that are no interfaces,
/// and in those of `holes` through holes. Also returns the lanes in which this is allowed.
#[inline(always)]
pub(crate) fn straight_on<F: Float, S: Surroundings<F>>(
    around: S,
    is_none: F::Mask,
    holes: F::Mask,
) -> (S, F::Mask) {
    F::out_of_line(
        #[inline(always)]
        move || {
            let (own, one) = (around.get(), F::Uint::splat(1));
            let may = is_none & own.passed.lt(F::Uint::splat(MOST_PASSED));
            let own = Around { holes: own.holes + one, ..own };
            let beyond = Around { here: own.beyond, passed: own.passed + one, ..own };
            let around = around.set(is_none, beyond).set(holes, own);
            (around, may | holes)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{DielectricParameters, GlassParameters, MaterialParameters, MatteParameters, Row};
    use crate::math::lanes::scalar::Wrapping;

    fn dielectric(ior: f64, priority: f64, absorption: f64) -> Row {
        DielectricParameters {
            ior,
            roughness: [0.0; 2],
            absorption: [absorption; 3],
            thin_walled: false,
            priority,
            reflectance: [1.0; 3],
            transmittance: [1.0; 3],
        }
        .row()
    }

    /// Air, smooth glass, and dielectrics of the priorities 0 to 5.
    fn media() -> Media {
        let mut rows = vec![
            MatteParameters { reflectance: [0.5; 3], roughness: 0.0 }.row(),
            GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: [1.0; 3] }.row(),
        ];
        rows.extend((0..6).map(|i| dielectric(2.0 + f64::from(i), f64::from(i), 0.0)));
        Media::new(&rows)
    }

    /// Follows a path through surfaces of rows, entering and leaving, and returns the outside index at each, or `None`
    /// where it passes straight through.
    fn follow(media: &Media, surfaces: &[(u32, bool)]) -> (Vec<Option<f32>>, [u32; MOST_INTERIORS]) {
        let mut here = Interiors::<f32>::outside_of_everything();
        let mut indices = Vec::new();
        for &(row, enters) in surfaces {
            let Crossing { beyond, outside, passes } = cross(media, here, Wrapping(row), enters);
            indices.push((!passes).then_some(outside));
            here = beyond;
        }
        (indices, here.media().map(|medium| medium.0))
    }

    const GLASS: u32 = 1;
    const ZERO: u32 = 2;
    const ONE: u32 = 3;
    const TWO: u32 = 4;

    #[test]
    fn the_highest_priority_of_overlapping_dielectrics_is_effective() {
        let media = &media();
        let none = [0; MOST_INTERIORS];
        // Enters the lower priority, then the higher one; the lower medium ends within the higher.
        let way = [(ONE, true), (TWO, true), (ONE, false), (TWO, false)];
        assert_eq!(follow(media, &way), (vec![Some(1.0), Some(3.0), None, Some(1.0)], none));
        // In the reverse order.
        let back = [(TWO, true), (ONE, true), (TWO, false), (ONE, false)];
        assert_eq!(follow(media, &back), (vec![Some(1.0), None, Some(3.0), Some(1.0)], none));
        // One entirely within another.
        let within = [(ONE, true), (TWO, true), (TWO, false), (ONE, false)];
        assert_eq!(follow(media, &within).0, vec![Some(1.0), Some(3.0), Some(3.0), Some(1.0)]);
        let hidden = [(TWO, true), (ONE, true), (ONE, false), (TWO, false)];
        assert_eq!(follow(media, &hidden).0, vec![Some(1.0), None, None, Some(1.0)]);
        // Opaque materials are always hit, with the index of the medium that they are in.
        assert_eq!(follow(media, &[(TWO, true), (0, true)]).0, vec![Some(1.0), Some(4.0)]);
        assert_eq!(follow(media, &[(0, true)]).0, vec![Some(1.0)]);
    }

    #[test]
    fn the_last_of_equal_priorities_is_effective_and_equal_media_merge() {
        let media = &media();
        let way = [(GLASS, true), (ZERO, true), (GLASS, false), (ZERO, false)];
        assert_eq!(follow(media, &way).0, vec![Some(1.0), Some(1.5), None, Some(1.0)]);
        let joined = [(ONE, true), (ONE, true), (ONE, false), (ONE, false)];
        assert_eq!(follow(media, &joined).0, vec![Some(1.0), None, None, Some(1.0)]);
    }

    #[test]
    fn dielectrics_that_were_never_entered_can_be_left() {
        let media = &media();
        let out = [(TWO, false), (ONE, true), (TWO, false)];
        assert_eq!(
            follow(media, &out),
            (vec![Some(1.0), Some(1.0), Some(3.0)], [media.medium(Wrapping(ONE)).0, 0, 0, 0])
        );
        assert_eq!(follow(media, &[(TWO, true), (ONE, false)]).0, vec![Some(1.0), None]);
    }

    #[test]
    fn the_medium_of_lowest_precedence_is_dropped() {
        let media = &media();
        let in_all: Vec<_> = (ZERO..ZERO + 6).map(|row| (row, true)).collect();
        let medium = |row| media.medium(Wrapping(row)).0;
        assert_eq!(follow(media, &in_all).1, [7, 6, 5, 4].map(medium));
        let in_all: Vec<_> = in_all.into_iter().rev().collect();
        assert_eq!(follow(media, &in_all).1, [7, 6, 5, 4].map(medium));
    }

    #[test]
    fn without_priorities_every_surface_is_an_interface() {
        let media = Media::new(&[dielectric(1.5, 0.0, 1.0), dielectric(1.3, 0.0, 2.0)]);
        let way = [(0, true), (1, true), (0, false), (1, false)];
        assert_eq!(follow(&media, &way), (vec![Some(1.0); 4], [0; MOST_INTERIORS]));
        assert_eq!(follow(&media, &way[..2]).1, [2, 1, 0, 0]);
    }
}
