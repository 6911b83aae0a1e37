//! Path tracing with next-event estimation.

use super::lanes::{Departure, Scattering, State, Vertex, View};
use super::observe::{Event, Observer, first, rgb, vec3};
use crate::light::NO_LIGHT;
use crate::material::{Bxdf, TransportMode};
use crate::math::{Float, Mask, Rgb, Uint};
use crate::sampling::Block;
use crate::world::Interaction;

/// Bounces that every path makes before Russian roulette may end it.
pub const ROULETTE_FROM: u32 = 2;

/// The chance to survive is this much for each unit of throughput, and certainty above its inverse: a path
/// goes on unthinned until it is worth a quarter of one that has just begun. Measured: beside thinning at any
/// loss, as the report does, variance falls more than time grows, and most where samples are well spread.
pub const ROULETTE_KEEPS: f32 = 4.0;

/// From this depth on no path survives with more than [`ROULETTE_AT_MOST`], so that even one that loses
/// nothing, between perfect mirrors say, comes to an end.
pub const ROULETTE_AT_MOST_FROM: u32 = 256;

/// See [`ROULETTE_AT_MOST_FROM`]. The nearer to one the better: among surfaces that lose a smaller share of
/// light at a bounce than the square root of this, a few survivors would have to stand for all the others.
pub const ROULETTE_AT_MOST: f32 = 0.999;

/// Path tracing with next-event estimation: at each vertex a light is chosen by what it may contribute and
/// asked directly, and the BxDF's own direction may find it too; multiple importance sampling weighs the
/// two (Veach 1997, ch. 9, the power heuristic). Russian roulette ends paths whose throughput is low
/// (report §6.2.1).
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

/// Russian roulette: thins paths that are worth less than a quarter of one that has just begun, and weighs up the
/// survivors. `survival` is uniform in [0, 1). Returns the lanes that go on.
#[inline(always)]
pub(super) fn roulette<F: Float>(
    state: &mut State<F>,
    going: F::Mask,
    survival: F,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let chance = state.beta.max_channel() * state.departure.eta_scale * ROULETTE_KEEPS;
    let long = !state.depth.lt(F::Uint::splat(ROULETTE_AT_MOST_FROM));
    let at_most = F::splat(ROULETTE_AT_MOST);
    let chance = F::select(long & at_most.lt(chance), at_most, chance);
    let plays = going & !state.depth.lt(F::Uint::splat(ROULETTE_FROM)) & chance.lt(F::splat(1.0));
    // NaN is never less than anything: it survives to be counted.
    let ends = plays & chance.le(survival);
    let reward = F::select(plays, F::splat(1.0) / chance, F::splat(1.0));
    state.beta = state.beta * reward;
    if observer.listens::<F>() && first(plays & !ends) {
        observer.event::<F>(|| Event::Survive { chance: chance.lane(0), throughput: rgb(state.beta) });
    }
    if observer.listens::<F>() && first(ends) {
        observer.event::<F>(|| Event::End { reason: "Russian roulette", radiance: rgb(state.l) });
    }
    going & !ends
}

/// The power heuristic for one sample of each of two densities: the weight of the first.
#[inline(always)]
fn power_heuristic<F: Float>(first: F, second: F) -> F {
    // Written with one ratio, so that squares of large densities can't overflow.
    let ratio = second / first;
    F::splat(1.0) / (ratio * ratio + 1.0)
}

/// The weight of a light at infinity that the BxDF's direction found, against the density of having asked for it.
#[inline(always)]
pub(super) fn weight_of_escaped<F: Float>(departure: &Departure<F>, asked: F) -> F {
    F::select(departure.pdf.gt(F::zero()), power_heuristic(departure.pdf, asked), F::splat(1.0))
}

/// The weight of emission that the BxDF's direction found, against having asked for it.
#[inline(always)]
pub(super) fn weight_of_met<F: Float>(view: &View<'_>, state: &State<F>, vertex: &Vertex<F>) -> F {
    let one = F::splat(1.0);
    let light = view.scene.surfaces.light(&vertex.at.point);
    let Departure { p, n, pdf, .. } = state.departure;
    let contested =
        vertex.met & light.lt(F::Uint::splat(NO_LIGHT)) & pdf.gt(F::zero()) & vertex.at.cos_o.gt(F::zero());
    if !contested.any() {
        return one;
    }
    let lights = &view.scene.lights;
    // Lanes without a light look up the first one, in vain.
    let light = F::Uint::select(contested, light, F::Uint::splat(0));
    let asked = lights.chance(p, n, light, contested) * lights.pdf(light, p, vertex.hit.t, vertex.at.cos_o);
    F::select(contested, power_heuristic(pdf, asked), one)
}

/// Radiance that a chosen light sends back along the ray by way of a vertex, weighed against the chance
/// that the BxDF finds the same light.
#[inline(always)]
pub(super) fn direct_light<F: Float>(
    view: &View<'_>,
    state: &State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    asks: F::Mask,
    rays: &mut u64,
    observer: &mut Observer<'_>,
) -> Rgb<F> {
    let point = &at.point;
    let lights = &view.scene.lights;
    let [u, v, choice, _] = view.settings.sampler.draw(state.id, Block::LIGHT.at::<F>(state.depth));
    let (light, chance) = lights.choose(point.p, point.n, choice, asks);
    let sample = lights.sample(light, point.p, [u, v]);
    let Scattering { bsdf, frame, wo, .. } = scattering;
    let wi = frame.to_local(sample.wi);
    let f = bsdf.eval(*wo, wi, TransportMode::Radiance) * wi.z.abs();
    let pdf = sample.pdf * chance;
    let share = f * sample.radiance * (F::splat(1.0) / pdf);
    let possible = asks & at.passes(sample.wi, wi) & pdf.gt(F::zero()) & share.max_channel().gt(F::zero());
    if !possible.any() {
        return Rgb::black();
    }
    let found = bsdf.pdf(*wo, wi).only(!sample.delta);
    *rays += u64::from(possible.bits().count_ones());
    let (shadow, length) = at.shadow(&sample);
    let past_triangles = lights.is_past_triangles::<F>(light);
    let visible = possible & !view.world.occluded(&shadow, length, possible, past_triangles);
    let added = (share * power_heuristic(pdf, found)).only(visible);
    observer.event::<F>(|| Event::Light { direction: vec3(sample.wi), added: rgb(added) });
    added
}
