//! The report's path tracer.

use super::lanes::{Scattering, State, Transport, View, go_on, meet};
use super::observe::{Event, Observer, rgb, vec3};
use crate::material::{Bxdf, TransportMode};
use crate::math::{Float, Mask, Rgb, Uint};
use crate::sampling::Block;
use crate::world::Interaction;

/// The path tracer of the report's §4.3: directions come from the BxDF alone, and lights are found by
/// chance. Delta lights, which no path can hit, are sampled directly.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Naive;

impl Transport for Naive {
    type Memory<F: Float> = ();

    #[inline(always)]
    fn fresh<F: Float>() {}

    #[inline(always)]
    fn select<F: Float>(_mask: F::Mask, _a: (), _b: ()) {}

    #[inline(always)]
    fn step<F: Float>(
        self,
        view: &View<'_>,
        state: &mut State<F, ()>,
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
            |_, _| F::splat(1.0),
        );
        let Some(vertex) = vertex else { return F::Mask::splat(false) };
        let met = vertex.met;
        state.l = Rgb::select(met, state.l + state.beta * vertex.emitted, state.l);
        let going = met & state.depth.lt(F::Uint::splat(view.settings.max_depth));
        if !going.any() {
            observer.event::<F>(|| Event::End { reason: "the depth limit", radiance: rgb(state.l) });
            return going;
        }

        let scattering = Scattering::new(view.scene, &vertex.at, &state.ray);
        let smooth = going & scattering.bsdf.is_smooth();
        if !view.scene.lights.delta_lights().is_empty() && smooth.any() {
            *rays += u64::from(smooth.bits().count_ones());
            let direct = delta_light(view, state, &vertex.at, &scattering, smooth, observer);
            state.l = Rgb::select(smooth, state.l + state.beta * direct, state.l);
        }

        let [u, v, lobe, _] = view.settings.sampler.draw(state.id, Block::SCATTER.at::<F>(state.depth));
        let scattered = scattering.bsdf.sample(scattering.wo, [u, v], lobe, TransportMode::Radiance);
        going & !go_on(state, &vertex.at, &scattering, &scattered, observer)
    }
}

/// Radiance that one delta light sends back along the ray by way of a vertex.
#[inline(always)]
fn delta_light<F: Float>(
    view: &View<'_>,
    state: &State<F, ()>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    asks: F::Mask,
    observer: &mut Observer<'_>,
) -> Rgb<F> {
    let [_, _, choice, _] = view.settings.sampler.draw(state.id, Block::LIGHT.at::<F>(state.depth));
    let light = view.scene.lights.sample_delta(at.point.p, choice);
    let wi = scattering.frame.to_local(light.wi);
    let (shadow, length) = at.shadow(&light);
    let visible = !view.world.occluded(&shadow, length, asks, F::Mask::splat(false));
    let Scattering { bsdf, wo, .. } = scattering;
    let seen = visible & at.passes(light.wi, wi);
    let added = (bsdf.eval(*wo, wi, TransportMode::Radiance) * light.weight() * wi.z.abs()).only(seen);
    observer.event::<F>(|| Event::Light { direction: vec3(light.wi), added: rgb(added) });
    added
}
