//! Path tracing with next-event estimation.

use super::blocks::path::LIGHT;
use super::holes::seen_through;
use super::interiors::{self, Surroundings};
use super::observe::{Event, Observer, rgb, vec3};
use super::vertex::{Departure, Scattering, State, Vertex, View};
use crate::light::NO_LIGHT;
use crate::material::TransportMode;
use crate::math::{Float, Rgb, Uint, function, value};
use crate::world::Interaction;

/// Path tracing with next-event estimation: at each vertex a light is chosen by an estimate of its contribution and
/// sampled, and the BxDF's own direction may find it too; multiple importance sampling weighs the two (Veach 1997,
/// ch. 9, the power heuristic). Russian roulette ends paths whose throughput is low (report §6.2.1).
///
/// The constant environment is left to the BxDF (see [`Environment`](crate::light::Environment)).
#[derive(Clone, Copy, Debug)]
pub struct NextEvent {
    /// Whether Russian roulette is played.
    pub roulette: bool,
}

impl Default for NextEvent {
    fn default() -> Self {
        NextEvent { roulette: true }
    }
}

/// The power heuristic for one sample of each of two densities: the weight of the first.
#[inline(always)]
fn power_heuristic<F: Float>(first: F, second: F) -> F {
    // Written with one ratio, so that squares of large densities can't overflow.
    let ratio = second / first;
    F::splat(1.0) / (ratio * ratio + 1.0)
}

/// The weight of a light at infinity that the BxDF's direction found, against the density `asked` with which sampling
/// lights would have found it.
#[inline(always)]
pub(super) fn weight_of_escaped<F: Float>(departure: &Departure<F>, asked: F) -> F {
    F::select(departure.pdf.gt(F::zero()), power_heuristic(departure.pdf, asked), F::splat(1.0))
}

/// The weight of emission that the BxDF's direction found, against the density with which sampling lights would
/// have found it.
#[inline(always)]
pub(super) fn weight_of_met<F: Float>(view: &View<'_>, state: &State<F>, vertex: &Vertex<F>) -> F {
    let (departure, vertex) = (state.departure, *vertex);
    function!(F, weight_of_met(departure, vertex), {
        let one = F::splat(1.0);
        let light = view.scene.surfaces.light(&vertex.at.point);
        let Departure { p, n, pdf, .. } = departure;
        let contested = vertex.met
            & light.lt(F::Uint::splat(NO_LIGHT))
            & pdf.gt(F::zero())
            & vertex.at.cos_o.gt(F::zero());
        F::guard(
            contested,
            one,
            #[inline(always)]
            || {
                let lights = &view.scene.lights;
                // Lanes without a light look up the first one, in vain.
                let light = F::Uint::select(contested, light, F::Uint::splat(0));
                let mut distance = vertex.hit.t;
                if view.scene.materials.has_holes() {
                    // The ray may have started anew behind a hole.
                    distance = (vertex.at.point.p - p).length();
                }
                let asked = lights.chance(p, n, light, contested)
                    * lights.pdf(light, p, vertex.at.point.p, distance, vertex.at.cos_o);
                F::select(contested, power_heuristic(pdf, asked), one)
            },
        )
    })
}

/// The direct light at a vertex.
#[derive(Clone, Copy)]
pub(super) struct DirectLight<F: Float> {
    /// Radiance that is sent back along the ray.
    pub added: Rgb<F>,
    /// The lanes that traced a shadow ray.
    pub traced: F::Mask,
}

value!(DirectLight { added, traced });

/// Radiance that a chosen light sends back along the ray by way of a vertex, weighed against the chance
/// that the BxDF finds the same light.
#[inline(always)]
pub(super) fn direct_light<F: Float, S: Surroundings<F>>(
    view: &View<'_>,
    state: &State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    asks: F::Mask,
    around: S,
    observer: &mut Observer<'_>,
) -> DirectLight<F> {
    let (state, at, scattering) = (*state, *at, *scattering);
    function!(F, direct_light(state, at, scattering, asks, around), {
        let point = &at.point;
        let lights = &view.scene.lights;
        let [u, v, choice, _] = view.settings.sampler.draw(state.id, LIGHT.at::<F>(state.depth));
        let (light, chance) = lights.choose(point.p, point.n, choice, asks);
        let sample = lights.sample(light, point.p, [u, v]);
        let (bsdf, Scattering { frame, wo, .. }) = (scattering.bsdf(view.scene), scattering);
        let wi = frame.to_local(sample.wi);
        // All lanes that matter scatter by other lobes than deltas.
        let f = bsdf.eval_non_delta(wo, wi, TransportMode::Radiance) * wi.z.abs();
        let pdf = sample.pdf * chance;
        let share = f * sample.radiance * (F::splat(1.0) / pdf);
        let possible = asks
            & view.scene.passes(&at, sample.wi, wi)
            & pdf.gt(F::zero())
            & share.max_channel().gt(F::zero());
        let added = F::guard(
            possible,
            Rgb::black(),
            #[inline(always)]
            || {
                let found = bsdf.pdf_non_delta(wo, wi).only(!sample.delta);
                let (shadow, length) = at.shadow(&sample);
                let past_triangles = lights.is_past_triangles::<F>(light);
                let hidden = view.world.occluded(&shadow, length, possible, past_triangles);
                let weighted = share * power_heuristic(pdf, found);
                let mut added = weighted.only(possible & !hidden);
                if view.scene.materials.has_holes() {
                    let asks = possible & hidden;
                    added = F::branch(
                        asks,
                        added,
                        #[inline(always)]
                        || {
                            weighted
                                * seen_through(view, &state, &around, &shadow, length, asks, past_triangles)
                        },
                    );
                }
                let added = interiors::faded(view.scene, &around, &at, sample.wi, length, added);
                observer.event::<F>(|| Event::Light { direction: vec3(sample.wi), added: rgb(added) });
                added
            },
        );
        DirectLight { added, traced: possible }
    })
}
