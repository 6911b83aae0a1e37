//! The layers of a render: those of the film, and those that first hits tell.

use super::settings::Settings;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Layer};
use crate::integrator::Integrator;
use crate::render::accumulator::Outcome;
use crate::render::{first_hit_layers, layer_samples};
use crossbeam_channel::{Receiver, TryRecvError};
use std::convert::Infallible;

/// Whether the end of a render is asked for.
fn is_asked(stop: &Receiver<Infallible>) -> bool {
    matches!(stop.try_recv(), Err(TryRecvError::Disconnected))
}

/// Samples of a pixel that the window's layers are means of.
const PREVIEW: u32 = 2;

/// The layers that first hits tell, for the window; without mattes, whose values are ids and no colours.
pub(super) fn preview(settings: &Settings, integrator: &dyn Integrator, mattes: &Mattes) -> Vec<Channel> {
    let shows = |layer: &Layer| layer.names(mattes).is_none();
    let layers: Vec<Layer> = settings.outputs.layers.iter().copied().filter(shows).collect();
    let samples = settings.job.first..settings.job.first.saturating_add(PREVIEW);
    let (level, region) = (settings.devices.level, settings.job.picture_region());
    first_hit_layers(integrator, level, region, &|| samples.clone(), 1, &layers, mattes)
}

/// The layers that are wanted, of what the render came to. First hits are of one sample once the end is asked for, and
/// there are none where a worker was abandoned: its path may never come back from them either.
pub(super) fn layers(
    settings: &Settings,
    layer_integrator: Option<&dyn Integrator>,
    mattes: &Mattes,
    outcome: &Outcome,
    stop: &Receiver<Infallible>,
) -> Vec<Channel> {
    let mut channels: Vec<Channel> =
        settings.outputs.layers.iter().flat_map(|layer| layer.channels_of_film(&outcome.film)).collect();
    if let Some(integrator) = layer_integrator.filter(|_| outcome.unanswered.is_empty()) {
        let (first, threads, wanted) =
            (settings.job.first, settings.devices.threads.get(), &settings.outputs.layers);
        let (level, region) = (settings.devices.level, settings.job.picture_region());
        let samples = || {
            let samples = if is_asked(stop) { 1 } else { layer_samples(outcome.totals.spp) };
            first..first.saturating_add(samples)
        };
        channels.extend(first_hit_layers(integrator, level, region, &samples, threads, wanted, mattes));
    }
    channels
}
