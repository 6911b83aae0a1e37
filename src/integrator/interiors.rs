//! The dielectrics that a path is inside of, in scenes that have media (see [`Media`]), and surfaces that paths pass
//! straight through.
//!
//! Light fades along a segment by the absorption of the medium that counts: that of the highest priority among all
//! that the path is inside of, and of equal ones that which was entered last. Where any has a priority, a surface is an
//! interface only if the medium that counts is another one beyond it, and refracts by the indices of these two; other
//! surfaces of dielectrics are passed straight through (Schmidt and Budge 2002, "Simple Nested Dielectrics in Ray Traced
//! Images").
//!
//! What holds of these paths:
//! - They begin inside of what a ray from the camera's eye upwards leaves without having entered it, whatever their place
//!   on the lens or the film. What a path leaves without having entered it, it was inside of all the same.
//! - [`MOST_INTERIORS`] dielectrics are kept. Inside of more, the one that would count last is forgotten: if all others
//!   are left before it, the path goes on as if it were outside of it.
//! - Rays to lights end at every surface, but for its holes. They fade by the medium on the side where they set out. What
//!   a path finds behind a surface that it passed through no such ray could have found, so that it has all the weight.
//! - At a hole no medium changes, and what a path finds behind it a ray to a light could have found.
//! - Two surfaces in the same place are one to a ray, which meets the first and sets out beyond both: dielectrics that
//!   touch have to overlap a little, as water reaches into its glass.
//! - A surface passed through is no bounce, and at most [`MOST_PASSED`] are passed in a row.

use crate::material::{Bsdf, MOST_INTERIORS, Media};
use crate::math::lanes::{Layout, Part, Value};
use crate::math::{Float, Mask, Rgb, Uint, Vec3, function, value};
use crate::world::{CompiledScene, Interaction};
use std::cell::Cell;

/// The most surfaces in a row that paths pass straight through: a bound on the work, which no scene should reach.
pub(crate) const MOST_PASSED: u32 = 1024;

/// The most holes that paths go through. A surface behind as many is met whatever its opacity, and hides lights, so that no
/// path is without an end.
pub(super) const MOST_HOLES: u32 = 1024;

/// The media that a path is inside of: see [`Media::packed`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interiors<F: Float> {
    pub(crate) words: [F::Uint; 2],
}

/// The surroundings of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around<F: Float> {
    /// Along the ray.
    pub(crate) here: Interiors<F>,
    /// Beyond the surface that it met.
    pub(crate) beyond: Interiors<F>,
    /// The index of refraction around that surface's dielectric; 1 for other surfaces.
    pub(crate) outside: F,
    /// Surfaces that were passed since the last bounce, by no holes.
    pub(crate) passed: F::Uint,
    /// Holes that the path has gone through so far; with `whitted`, all branches of the sample.
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

    /// The medium that counts.
    #[inline(always)]
    fn first(self) -> F::Uint {
        self.words[0] & F::Uint::splat(0xffff)
    }

    /// With a medium in front of those of its priority; the last of too many is forgotten. Zero changes nothing.
    #[inline(always)]
    fn with(self, media: &Media, medium: F::Uint) -> Self {
        let [a, b, c, d] = self.media();
        let own = media.priority(medium);
        // Whether each comes before it; the priorities fall.
        let (first, second) = (own.lt(media.priority(a)), own.lt(media.priority(b)));
        let (third, fourth) = (own.lt(media.priority(c)), own.lt(media.priority(d)));
        Interiors::of([
            F::Uint::select(first, a, medium),
            F::Uint::select(second, b, F::Uint::select(first, medium, a)),
            F::Uint::select(third, c, F::Uint::select(second, medium, b)),
            F::Uint::select(fourth, d, F::Uint::select(third, medium, c)),
        ])
    }

    /// The lanes in which a medium is among them.
    #[inline(always)]
    fn has(self, medium: F::Uint) -> F::Mask {
        let [a, b, c, d] = self.media();
        a.eq(medium) | b.eq(medium) | c.eq(medium) | d.eq(medium)
    }

    /// Without the first that is a medium, if there is one. Zero changes nothing.
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
    /// Those of a path that leaves the camera.
    #[inline(always)]
    pub(crate) fn at_camera(scene: &CompiledScene) -> Self {
        let nothing = Around::nothing();
        if scene.materials.media().is_none() {
            return nothing;
        }
        let [first, second] = &scene.inside;
        Around { here: Interiors { words: [F::Uint::given(first), F::Uint::given(second)] }, ..nothing }
    }

    /// Those of a path that is inside of nothing.
    #[inline(always)]
    pub(crate) fn nothing() -> Self {
        let (nothing, zero) = (Interiors::outside_of_everything(), F::Uint::splat(0));
        Around { here: nothing, beyond: nothing, outside: F::splat(1.0), passed: zero, holes: zero }
    }
}

/// What becomes of the interiors at a surface.
#[derive(Clone, Copy)]
struct Crossing<F: Float> {
    beyond: Interiors<F>,
    outside: F,
    /// The lanes in which the medium that counts is the same on both sides, though there is one within the surface.
    passes: F::Mask,
}

value!(Crossing { beyond, outside, passes });

/// Where the surroundings of paths are kept: nowhere, in a value, or in a place of their own.
///
/// Lanes keep them in memory, so that paths in scenes in which they [are not kept](are_kept) do not carry them along. A
/// recorded program has them as a value, and nothing at all in such scenes. What is done with them is done in functions of their own, to
/// which closures take copies: a reference would keep the state of paths in memory everywhere.
pub(crate) trait Surroundings<F: Float>: Value<F> {
    /// The media of the scene, if it has any and they are kept track of.
    fn media<'s>(&self, scene: &'s CompiledScene) -> Option<&'s Media>;
    /// What they are.
    fn get(&self) -> Around<F>;
    /// The same with others in some lanes.
    fn set(self, lanes: F::Mask, around: Around<F>) -> Self;
}

/// Nowhere.
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

/// A place of their own, for lanes. As a value it has no numbers: whatever is given back, the place is the same.
#[derive(Clone, Copy)]
pub(super) struct Kept<'a, F: Float>(pub(super) &'a Cell<Around<F>>);

impl<F: Float> Value<F> for Kept<'_, F> {
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

impl<F: Float> Surroundings<F> for Kept<'_, F> {
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

/// Whether surroundings are kept in a scene: whether it has media or holes.
#[inline(always)]
pub(super) fn are_kept(scene: &CompiledScene) -> bool {
    scene.materials.media().is_some() | scene.materials.has_holes()
}

/// The surroundings of paths some of which have just left the camera.
#[inline(always)]
pub(super) fn started<F: Float, S: Surroundings<F>>(scene: &CompiledScene, around: S, lanes: F::Mask) -> S {
    if !are_kept(scene) {
        return around;
    }
    F::out_of_line(
        #[inline(always)]
        move || around.set(lanes, Around::at_camera(scene)),
    )
}

/// What is left of a throughput after so long a way along the ray, which may be infinite.
#[inline(always)]
pub(crate) fn absorbed<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    around: &S,
    beta: Rgb<F>,
    length: F,
) -> Rgb<F> {
    let Some(media) = around.media(scene) else { return beta };
    let around = *around;
    // Only the factor comes from out of line: see `MaterialTable::bsdf`.
    beta * F::out_of_line(
        #[inline(always)]
        move || media.transmittance(around.get().here.first(), length),
    )
}

/// What is left of light that comes to an interaction from `wi`, along so long a way.
#[inline(always)]
pub(super) fn faded<F: Float, S: Surroundings<F>>(
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

/// The lanes in which a direction leads to the other side of the surface than the one that the ray came from.
#[inline(always)]
fn crosses<F: Float>(at: &Interaction<F>, d: Vec3<F>) -> F::Mask {
    (d.dot(at.point.n) * at.cos_o).lt(F::zero())
}

/// What paths find at surfaces, in the lanes of `met`: the surroundings, and the lanes in which the surface is none, as the
/// medium that counts is the same on both sides.
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
                function!(F, meet_interface(here, material, enters), { meet(media, here, material, enters) });
            (around.set(met, Around { beyond, outside, ..own }), met & passes)
        },
    )
}

/// What becomes of interiors at a surface of a material, from outside where it is entered.
#[inline(always)]
fn meet<F: Float>(media: &Media, here: Interiors<F>, material: F::Uint, enters: F::Mask) -> Crossing<F> {
    let medium = media.medium(material);
    let (entered, left) = (here.with(media, medium), here.without(medium));
    // Where a dielectric is left that was never entered, the path was inside of it all the same.
    let inner = Interiors::blend(!enters & here.has(medium), here, entered);
    let outer = Interiors::blend(enters, here, left);
    let beyond = Interiors::blend(enters, inner, outer);
    if !media.nests() {
        return Crossing { beyond, outside: F::splat(1.0), passes: F::Mask::splat(false) };
    }
    let is_bounded = F::Uint::splat(0).lt(medium);
    let around = outer.first();
    Crossing {
        beyond,
        outside: F::select(is_bounded, media.index(around), F::splat(1.0)),
        passes: is_bounded & around.eq(inner.first()),
    }
}

/// The BSDF at an interaction; that of an interface refracts by the indices of the two media that meet there.
#[inline(always)]
pub(super) fn bsdf<F: Float, S: Surroundings<F>>(
    scene: &CompiledScene,
    at: &Interaction<F>,
    around: &S,
) -> Bsdf<F> {
    let bsdf = scene.bsdf(at);
    if around.media(scene).is_some_and(Media::nests) { bsdf.within(around.get().outside) } else { bsdf }
}

/// The surroundings of paths that set out from an interaction towards `d` after a bounce, in some lanes.
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

/// The surroundings of paths that go straight on: through surfaces that are none, in the lanes of `is_none`, and through
/// holes; and the lanes of these that may.
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
            let beyond = Around { here: own.beyond, passed: own.passed + one, ..own };
            let around = around.set(is_none, beyond).set(holes, Around { holes: own.holes + one, ..own });
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

    /// Follows a path through surfaces of rows, in and out, and tells the index around each, or none if it is passed.
    fn follow(media: &Media, surfaces: &[(u32, bool)]) -> (Vec<Option<f32>>, [u32; MOST_INTERIORS]) {
        let mut here = Interiors::<f32>::outside_of_everything();
        let mut indices = Vec::new();
        for &(row, enters) in surfaces {
            let Crossing { beyond, outside, passes } = meet(media, here, Wrapping(row), enters);
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
    fn of_overlapping_dielectrics_the_highest_counts() {
        let media = &media();
        let none = [0; MOST_INTERIORS];
        // Into the lower one, from there into the higher one; the end of the lower one lies within that.
        let way = [(ONE, true), (TWO, true), (ONE, false), (TWO, false)];
        assert_eq!(follow(media, &way), (vec![Some(1.0), Some(3.0), None, Some(1.0)], none));
        // The other way round.
        let back = [(TWO, true), (ONE, true), (TWO, false), (ONE, false)];
        assert_eq!(follow(media, &back), (vec![Some(1.0), None, Some(3.0), Some(1.0)], none));
        // One altogether within another.
        let within = [(ONE, true), (TWO, true), (TWO, false), (ONE, false)];
        assert_eq!(follow(media, &within).0, vec![Some(1.0), Some(3.0), Some(3.0), Some(1.0)]);
        let hidden = [(TWO, true), (ONE, true), (ONE, false), (TWO, false)];
        assert_eq!(follow(media, &hidden).0, vec![Some(1.0), None, None, Some(1.0)]);
        // What is no dielectric is always met, and has no index around it.
        assert_eq!(follow(media, &[(TWO, true), (0, true)]).0, vec![Some(1.0), Some(1.0)]);
    }

    #[test]
    fn of_equal_ones_the_last_counts_and_the_same_one_joins() {
        let media = &media();
        let way = [(GLASS, true), (ZERO, true), (GLASS, false), (ZERO, false)];
        assert_eq!(follow(media, &way).0, vec![Some(1.0), Some(1.5), None, Some(1.0)]);
        let joined = [(ONE, true), (ONE, true), (ONE, false), (ONE, false)];
        assert_eq!(follow(media, &joined).0, vec![Some(1.0), None, None, Some(1.0)]);
    }

    #[test]
    fn what_was_never_entered_can_be_left() {
        let media = &media();
        let out = [(TWO, false), (ONE, true), (TWO, false)];
        assert_eq!(
            follow(media, &out),
            (vec![Some(1.0), Some(1.0), Some(3.0)], [media.medium(Wrapping(ONE)).0, 0, 0, 0])
        );
        assert_eq!(follow(media, &[(TWO, true), (ONE, false)]).0, vec![Some(1.0), None]);
    }

    #[test]
    fn the_one_that_would_count_last_is_forgotten() {
        let media = &media();
        let in_all: Vec<_> = (ZERO..ZERO + 6).map(|row| (row, true)).collect();
        let medium = |row| media.medium(Wrapping(row)).0;
        assert_eq!(follow(media, &in_all).1, [7, 6, 5, 4].map(medium));
        let in_all: Vec<_> = in_all.into_iter().rev().collect();
        assert_eq!(follow(media, &in_all).1, [7, 6, 5, 4].map(medium));
    }

    #[test]
    fn without_priorities_every_surface_is_met() {
        let media = Media::new(&[dielectric(1.5, 0.0, 1.0), dielectric(1.3, 0.0, 2.0)]);
        let way = [(0, true), (1, true), (0, false), (1, false)];
        assert_eq!(follow(&media, &way), (vec![Some(1.0); 4], [0; MOST_INTERIORS]));
        assert_eq!(follow(&media, &way[..2]).1, [2, 1, 0, 0]);
    }
}
