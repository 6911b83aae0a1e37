//! Light that comes to a path through holes of the surfaces between it and a light.

use super::interiors::{MOST_HOLES, Surroundings};
use super::vertex::{State, View, meeting};
use crate::math::{Float, Ray, Uint, function, value};
use crate::sampling::EndlessStream;
use crate::world::{FIRST_TRIANGLE, Uv};

/// A shadow ray on its way.
#[derive(Clone, Copy)]
struct Shadow<F: Float> {
    ray: Ray<F>,
    /// The distance that is left to the light.
    left: F,
    /// The share of light that comes through what has been met so far.
    share: F,
    /// Surfaces that have been met.
    met: F::Uint,
    /// The lanes that are on their way.
    lives: F::Mask,
    /// Numbers by which mixed materials are chosen.
    stream: EndlessStream<F>,
}

value!(Shadow { ray, left, share, met, lives, stream });

/// The share of light that comes along shadow rays, in the lanes of `asks`, through all that is nearer than the distance
/// `end`: the product of what each surface lets through. For lanes in `past_triangles`, meshes hide nothing.
///
/// The product itself has less noise than chance would, as it is with rays that are followed.
#[inline(always)]
pub(super) fn seen_through<F: Float>(
    view: &View<'_>,
    state: &State<F>,
    around: &impl Surroundings<F>,
    shadow: &Ray<F>,
    end: F,
    asks: F::Mask,
    past_triangles: F::Mask,
) -> F {
    let (path, block, shadow) = (state.id, meeting(state, around), *shadow);
    function!(F, seen_through(path, block, shadow, end, asks, past_triangles), {
        F::out_of_line(
            #[inline(always)]
            move || {
                let (scene, one) = (view.scene, F::splat(1.0));
                let stream = view.settings.sampler.endless(path, block);
                let start = Shadow {
                    ray: shadow,
                    left: end,
                    share: one,
                    met: F::Uint::splat(0),
                    lives: asks,
                    stream,
                };
                let last = F::repeat(
                    asks,
                    start,
                    #[inline(always)]
                    |shadow| {
                        let Shadow { ray, left, share, met, lives, mut stream } = shadow;
                        let hit = view.world.intersect(&ray, lives);
                        let mut hides = lives & hit.is_some() & hit.t.lt(left);
                        let [number, ..] = stream.draw(hides);
                        let at = scene.interaction(&ray, &hit, hides, Uv::WherePatterned);
                        let (at, opacity) = scene.modified(at, ray.d, hides, number);
                        let beyond = at.straight_on(&ray);
                        let meets = hides;
                        if scene.surfaces.triangles().is_some() {
                            hides =
                                hides & !(past_triangles & !hit.surface.lt(F::Uint::splat(FIRST_TRIANGLE)));
                        }
                        let goes = meets & met.lt(F::Uint::splat(MOST_HOLES));
                        let share = F::select(hides, share * (one - opacity), share);
                        let share = F::select(meets & !goes, F::zero(), share);
                        let lives = goes & share.gt(F::zero());
                        let left = left - (beyond.o - ray.o).dot(ray.d);
                        let met = met + F::Uint::splat(1);
                        (Shadow { ray: beyond, left, share, met, lives, stream }, lives)
                    },
                );
                last.share
            },
        )
    })
}
