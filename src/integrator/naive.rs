//! The direct light of `path-naive`, the report's path tracer (§4.3). Directions come from the BxDF alone, so that area
//! lights are found by chance. Delta lights, which no path can hit, are sampled here.

use super::blocks::path::LIGHT;
use super::holes::seen_through;
use super::interiors::{self, Surroundings};
use super::next_event::DirectLight;
use super::observe::{Event, Observer, rgb, vec3};
use super::vertex::{Scattering, State, TraceContext};
use crate::material::{Bxdf, TransportMode};
use crate::math::{Float, Mask, function};
use crate::world::Interaction;

/// Radiance from one delta light that a vertex sends back along the ray. All lanes in `active` trace a shadow ray.
#[inline(always)]
pub(super) fn delta_light<F: Float, S: Surroundings<F>>(
    context: &TraceContext<'_>,
    state: &State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    active: F::Mask,
    around: S,
    observer: &mut Observer<'_>,
) -> DirectLight<F> {
    let (state, at, scattering) = (*state, *at, *scattering);
    function!(F, delta_light(state, at, scattering, active, around), {
        let [_, _, choice, _] = context.settings.sampler.draw(state.id, LIGHT.at::<F>(state.depth));
        let light = context.scene.lights.sample_delta(at.point.p, choice);
        let wi = scattering.frame.to_local(light.wi);
        let (shadow, length) = at.shadow(&light);
        let none = F::Mask::splat(false);
        let visible = !context.world.occluded(&shadow, length, active, none);
        let (bsdf, wo) = (scattering.bsdf(context.scene), scattering.wo);
        let passes = context.scene.passes(&at, light.wi, wi);
        let share = bsdf.eval(wo, wi, TransportMode::Radiance) * light.weight() * wi.z.abs();
        let mut added = share.only(visible & passes);
        if context.scene.materials.has_holes() {
            let hidden = active & passes & !visible;
            added = F::branch(
                hidden,
                added,
                #[inline(always)]
                || share * seen_through(context, &state, &around, &shadow, length, hidden, none),
            );
        }
        let added = interiors::attenuated(context.scene, &around, &at, light.wi, length, added);
        observer.event::<F>(|| Event::Light { direction: vec3(light.wi), added: rgb(added) });
        DirectLight { added, traced: active }
    })
}
