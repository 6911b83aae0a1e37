//! Path tracing with next-event estimation.

use super::blocks::path::LIGHT;
use super::holes::seen_through;
use super::interiors::{self, Surroundings};
use super::observe::{Event, Observer, rgb, vec3};
use super::vertex::{PreviousVertex, Scattering, State, TraceContext, Vertex};
use crate::light::NO_LIGHT;
use crate::material::TransportMode;
use crate::math::{Float, Rgb, Uint, function, value};
use crate::world::Interaction;

/// Path tracing with next-event estimation. Each vertex samples a light, chosen by an estimate of its contribution, and
/// the BxDF may sample a direction to it, too. Multiple importance sampling combines the two (Veach 1997, ch. 9, the
/// power heuristic). Russian roulette ends paths of low throughput (report §6.2.1).
///
/// The constant environment is found by BxDF sampling only (see [`Environment`](crate::light::Environment)).
#[derive(Clone, Copy, Debug)]
pub struct NextEvent {
    /// Whether Russian roulette is enabled.
    pub roulette: bool,
}

impl Default for NextEvent {
    fn default() -> Self {
        NextEvent { roulette: true }
    }
}

/// The power heuristic for one sample from each of two densities: the weight of the first.
#[inline(always)]
fn power_heuristic<F: Float>(first: F, second: F) -> F {
    // Written with a ratio, so that squares of large densities cannot overflow.
    let ratio = second / first;
    F::splat(1.0) / (ratio * ratio + 1.0)
}

/// The weight of a light at infinity that BxDF sampling found, against the density `light_pdf` of light sampling.
#[inline(always)]
pub(super) fn weight_of_escaped<F: Float>(previous: &PreviousVertex<F>, light_pdf: F) -> F {
    F::select(previous.pdf.gt(F::zero()), power_heuristic(previous.pdf, light_pdf), F::splat(1.0))
}

/// The weight of emission that BxDF sampling found, against the density of light sampling.
#[inline(always)]
pub(super) fn weight_of_met<F: Float>(context: &TraceContext<'_>, state: &State<F>, vertex: &Vertex<F>) -> F {
    let (previous, vertex) = (state.previous, *vertex);
    function!(F, weight_of_met(previous, vertex), {
        let one = F::splat(1.0);
        let light = context.scene.surfaces.light(&vertex.at.point);
        let PreviousVertex { p, n, pdf, .. } = previous;
        let contested = vertex.met
            & light.lt(F::Uint::splat(NO_LIGHT))
            & pdf.gt(F::zero())
            & vertex.at.cos_o.gt(F::zero());
        F::guard(
            contested,
            one,
            #[inline(always)]
            || {
                let lights = &context.scene.lights;
                // Lanes without a light look up the first one; the result is not used.
                let light = F::Uint::select(contested, light, F::Uint::splat(0));
                let mut distance = vertex.hit.t;
                if context.scene.materials.has_holes() {
                    // The ray may have been restarted behind a hole.
                    distance = (vertex.at.point.p - p).length();
                }
                let light_pdf = lights.pmf(p, n, light, contested)
                    * lights.pdf(light, p, vertex.at.point.p, distance, vertex.at.cos_o);
                F::select(contested, power_heuristic(pdf, light_pdf), one)
            },
        )
    })
}

/// The direct light at a vertex.
#[derive(Clone, Copy)]
pub(super) struct DirectLight<F: Float> {
    /// Radiance sent back along the ray, before throughput.
    pub added: Rgb<F>,
    /// The lanes that traced a shadow ray.
    pub traced: F::Mask,
}

value!(DirectLight { added, traced });

/// Radiance from a sampled light that a vertex sends back along the ray, with its MIS weight against BxDF sampling.
#[inline(always)]
pub(super) fn direct_light<F: Float, S: Surroundings<F>>(
    context: &TraceContext<'_>,
    state: &State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    active: F::Mask,
    around: S,
    observer: &mut Observer<'_>,
) -> DirectLight<F> {
    let (state, at, scattering) = (*state, *at, *scattering);
    function!(F, direct_light(state, at, scattering, active, around), {
        let point = &at.point;
        let lights = &context.scene.lights;
        let [u, v, choice, _] = context.settings.sampler.draw(state.id, LIGHT.at::<F>(state.depth));
        let (light, pmf) = lights.choose(point.p, point.n, choice, active);
        let sample = lights.sample(light, point.p, [u, v]);
        let (bsdf, Scattering { frame, wo, .. }) = (scattering.bsdf(context.scene), scattering);
        let wi = frame.to_local(sample.wi);
        // All active lanes have non-delta lobes.
        let f = bsdf.eval_non_delta(wo, wi, TransportMode::Radiance) * wi.z.abs();
        let pdf = sample.pdf * pmf;
        let share = f * sample.radiance * (F::splat(1.0) / pdf);
        let possible = active
            & context.scene.passes(&at, sample.wi, wi)
            & pdf.gt(F::zero())
            & share.max_channel().gt(F::zero());
        let added = F::guard(
            possible,
            Rgb::black(),
            #[inline(always)]
            || {
                let found = bsdf.pdf_non_delta(wo, wi).only(!sample.delta);
                let (shadow, length) = at.shadow(&sample);
                let ignores_meshes = lights.is_convex_emitter::<F>(light);
                let hidden = context.world.occluded(&shadow, length, possible, ignores_meshes);
                let weighted = share * power_heuristic(pdf, found);
                let mut added = weighted.only(possible & !hidden);
                if interiors::are_tracked(context.scene) {
                    if context.scene.materials.has_holes() {
                        let active = possible & hidden;
                        added = F::branch(
                            active,
                            added,
                            #[inline(always)]
                            || {
                                let share = seen_through(
                                    context,
                                    &state,
                                    &around,
                                    &shadow,
                                    length,
                                    active,
                                    ignores_meshes,
                                );
                                weighted * share
                            },
                        );
                    }
                    added = interiors::attenuated(context.scene, &around, &at, sample.wi, length, added);
                }
                observer.event::<F>(|| Event::Light { direction: vec3(sample.wi), added: rgb(added) });
                added
            },
        );
        DirectLight { added, traced: possible }
    })
}
