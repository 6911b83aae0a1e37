//! The layers of a render.

use super::settings::Settings;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Film, Layer};
use crate::integrator::Integrator;
use crate::render;
use std::sync::Arc;

/// Samples of a pixel that the window's layers are means of.
const PREVIEW: u32 = 2;

/// The layers that first hits tell, for the window, before there are any; without mattes, whose values are ids and no
/// colours.
pub(super) fn preview(
    settings: &Settings,
    integrator: &Arc<dyn Integrator>,
    mattes: &Mattes,
) -> Vec<Channel> {
    let shows = |layer: &Layer| layer.names(mattes).is_none();
    let layers: Vec<Layer> = settings.outputs.layers.iter().copied().filter(shows).collect();
    let (level, region) = (settings.devices.level, settings.job.picture_region());
    render::preview(integrator, level, region, PREVIEW, &layers, mattes)
}

/// The layers that are wanted, of what the render came to.
pub(super) fn layers(settings: &Settings, mattes: &Mattes, film: &Film) -> Vec<Channel> {
    settings.outputs.layers.iter().flat_map(|&layer| film.channels(layer, mattes)).collect()
}
