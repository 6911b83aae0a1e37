//! Path tracing with next-event estimation.

use super::lanes::{Scattering, State, Transport, Vertex, View, go_on, meet};
use super::observe::{Event, Observer, first, rgb, vec3};
use crate::light::NO_LIGHT;
use crate::material::{Bxdf, TransportMode};
use crate::math::{Float, Mask, Rgb, Uint, Vec3};
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

/// What the weight of a light that is met depends on: the vertex that the ray left.
#[derive(Clone, Copy)]
pub(super) struct Departure<F> {
    p: Vec3<F>,
    n: Vec3<F>,
    /// Density of the direction by solid angle; zero where nothing but the BxDF could have found it.
    pdf: F,
    /// Product of (η transmitted/η incident)² along the path: radiance scales with it, the path's worth
    /// does not.
    eta_scale: F,
}

impl Transport for NextEvent {
    type Memory<F: Float> = Departure<F>;

    #[inline(always)]
    fn fresh<F: Float>() -> Departure<F> {
        Departure { p: Vec3::zero(), n: Vec3::zero(), pdf: F::zero(), eta_scale: F::splat(1.0) }
    }

    #[inline(always)]
    fn select<F: Float>(mask: F::Mask, a: Departure<F>, b: Departure<F>) -> Departure<F> {
        Departure {
            p: Vec3::select(mask, a.p, b.p),
            n: Vec3::select(mask, a.n, b.n),
            pdf: F::select(mask, a.pdf, b.pdf),
            eta_scale: F::select(mask, a.eta_scale, b.eta_scale),
        }
    }

    #[inline(always)]
    fn step<F: Float>(
        self,
        view: &View<'_>,
        state: &mut State<F, Departure<F>>,
        alive: F::Mask,
        rays: &mut u64,
        observer: &mut Observer<'_>,
    ) -> F::Mask {
        let vertex = meet(
            view,
            state,
            alive,
            rays,
            observer,
            #[inline(always)]
            |departure, asked| weight_of_escaped(departure, asked),
        );
        let Some(vertex) = vertex else { return F::Mask::splat(false) };
        let met = vertex.met;
        let weight = weight_of_met(view, state, &vertex);
        state.l = Rgb::select(met, state.l + state.beta * vertex.emitted * weight, state.l);
        let mut going = met & state.depth.lt(F::Uint::splat(view.settings.max_depth));
        if !going.any() {
            observer.event::<F>(|| Event::End { reason: "the depth limit", radiance: rgb(state.l) });
            return going;
        }

        let scattering = Scattering::new(view.scene, &vertex.at, &state.ray);
        // Lamps are black more often than not.
        let smooth = going & !scattering.bsdf.is_black() & scattering.bsdf.is_smooth();
        if !view.scene.lights.is_empty() && smooth.any() {
            let direct = direct_light(view, state, &vertex.at, &scattering, smooth, rays, observer);
            state.l = Rgb::select(smooth, state.l + state.beta * direct, state.l);
        }

        let [u, v, lobe, survival] =
            view.settings.sampler.draw(state.id, Block::SCATTER.at::<F>(state.depth));
        let scattered = scattering.bsdf.sample(scattering.wo, [u, v], lobe, TransportMode::Radiance);
        going = going & !go_on(state, &vertex.at, &scattering, &scattered, observer);

        let point = &vertex.at.point;
        let scale = state.memory.eta_scale * (scattered.eta * scattered.eta);
        state.memory =
            Departure { p: point.p, n: point.n, pdf: scattered.pdf.only(!scattered.delta), eta_scale: scale };
        if self.roulette {
            let chance = state.beta.max_channel() * scale * ROULETTE_KEEPS;
            let long = !state.depth.lt(F::Uint::splat(ROULETTE_AT_MOST_FROM));
            let at_most = F::splat(ROULETTE_AT_MOST);
            let chance = F::select(long & at_most.lt(chance), at_most, chance);
            let plays = going & !state.depth.lt(F::Uint::splat(ROULETTE_FROM)) & chance.lt(F::splat(1.0));
            // NaN is never less than anything: it survives to be counted.
            let ends = plays & chance.le(survival);
            let reward = F::select(plays, F::splat(1.0) / chance, F::splat(1.0));
            state.beta = state.beta * reward;
            going = going & !ends;
            if observer.listens::<F>() && first(plays & !ends) {
                observer
                    .event::<F>(|| Event::Survive { chance: chance.lane(0), throughput: rgb(state.beta) });
            }
            if observer.listens::<F>() && first(ends) {
                observer.event::<F>(|| Event::End { reason: "Russian roulette", radiance: rgb(state.l) });
            }
        }
        going
    }
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
fn weight_of_escaped<F: Float>(departure: &Departure<F>, asked: F) -> F {
    F::select(departure.pdf.gt(F::zero()), power_heuristic(departure.pdf, asked), F::splat(1.0))
}

/// The weight of emission that the BxDF's direction found, against having asked for it.
#[inline(always)]
fn weight_of_met<F: Float>(view: &View<'_>, state: &State<F, Departure<F>>, vertex: &Vertex<F>) -> F {
    let one = F::splat(1.0);
    let light = view.scene.surfaces.light(&vertex.at.point);
    let Departure { p, n, pdf, .. } = state.memory;
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
fn direct_light<F: Float>(
    view: &View<'_>,
    state: &State<F, Departure<F>>,
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
