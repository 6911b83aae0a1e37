//! Transmittance of shadow rays through holes of surfaces.

use super::interiors::{MOST_HOLES, Surroundings};
use super::vertex::{State, TraceContext, material_block};
use crate::math::{Float, Mask, Ray, Uint, function, value};
use crate::sampling::EndlessStream;
use crate::world::{FIRST_TRIANGLE, Uv};

/// The state of a shadow ray.
#[derive(Clone, Copy)]
struct Shadow<F: Float> {
    ray: Ray<F>,
    /// The remaining distance to the light.
    left: F,
    /// The transmittance so far.
    share: F,
    /// The number of surfaces hit so far.
    met: F::Uint,
    /// The lanes whose rays are not finished.
    lives: F::Mask,
    /// The random numbers by which mixed materials are chosen.
    stream: EndlessStream<F>,
}

value!(Shadow { ray, left, share, met, lives, stream });

/// The transmittance of shadow rays up to the distance `end`, in the lanes of `active`: the product of 1 − opacity over
/// all surfaces. Lanes in `ignores_meshes` ignore meshes.
///
/// The product has less noise than a random choice at each surface, which paths make.
#[inline(always)]
pub(super) fn seen_through<F: Float>(
    context: &TraceContext<'_>,
    state: &State<F>,
    around: &impl Surroundings<F>,
    shadow: &Ray<F>,
    end: F,
    active: F::Mask,
    ignores_meshes: F::Mask,
) -> F {
    let (path, block, shadow) = (state.id, material_block(state, around), *shadow);
    function!(F, seen_through(path, block, shadow, end, active, ignores_meshes), {
        F::out_of_line(
            #[inline(always)]
            move || {
                let (scene, one) = (context.scene, F::splat(1.0));
                let stream = context.settings.sampler.endless(path, block);
                let start = Shadow {
                    ray: shadow,
                    left: end,
                    share: one,
                    met: F::Uint::splat(0),
                    lives: active,
                    stream,
                };
                let last = F::repeat(
                    active,
                    start,
                    #[inline(always)]
                    |shadow| {
                        let Shadow { ray, left, share, met, lives, mut stream } = shadow;
                        let hit = context.world.intersect_apart(&ray, lives);
                        let mut hides = lives & hit.is_some() & hit.t.lt(left);
                        let [number, ..] = stream.draw(hides);
                        let at = scene.interaction_apart(&ray, &hit, hides, Uv::IfTextured);
                        // Most surfaces are opaque.
                        let may = hides & scene.materials.may_have_holes::<F>(at.material);
                        let opacity = F::branch(
                            may,
                            one,
                            #[inline(always)]
                            || scene.modified(at, ray.d, may, F::Mask::splat(false), number).1,
                        );
                        let beyond = at.straight_on(&ray);
                        let meets = hides;
                        if scene.surfaces.triangles().is_some() {
                            hides =
                                hides & !(ignores_meshes & !hit.surface.lt(F::Uint::splat(FIRST_TRIANGLE)));
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
