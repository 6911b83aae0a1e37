//! The layers of a render.

use super::settings::RenderSettings;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Film, Layer};
use crate::integrator::Integrator;
use crate::render;
use std::sync::Arc;

/// Samples per pixel of the layers in the window.
const PREVIEW: u32 = 2;

/// The layers of first hits for the window, before the render has them; without Cryptomatte layers, whose values are
/// ids and not colours.
pub(super) fn preview(
    settings: &RenderSettings,
    integrator: &Arc<dyn Integrator>,
    mattes: &Mattes,
) -> Vec<Channel> {
    let shows = |layer: &Layer| layer.names(mattes).is_none();
    let layers: Vec<Layer> = settings.outputs.layers.iter().copied().filter(shows).collect();
    let (level, region) = (settings.devices.level, settings.job.picture_region());
    render::preview(integrator, level, region, PREVIEW, &layers, mattes)
}

/// The requested layers of a finished render.
pub(super) fn layers(settings: &RenderSettings, mattes: &Mattes, film: &Film) -> Vec<Channel> {
    settings.outputs.layers.iter().flat_map(|&layer| film.channels(layer, mattes)).collect()
}
