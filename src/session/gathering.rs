//! Films that are gathered elsewhere, from films of parts of their samples: their headers and pictures.

use super::error::Written;
use super::identity::{facts, head, mattes_of, write_with_facts};
use super::layers::layers;
use super::settings::RenderSettings;
use crate::film::cryptomatte::Mattes;
use crate::film::head::Head;
use crate::film::{Film, SampleRanges, ViewTransform};

/// The header of the film of a render on the devices with this description.
pub fn film_head(settings: &RenderSettings, device: &str) -> Head {
    head(settings, device)
}

/// Writes the pictures of a render from a film that was gathered elsewhere: the files that the render itself would have
/// written. Tries all of them, and returns the first error.
pub fn write_film_pictures(
    settings: &RenderSettings,
    head: &Head,
    film: &Film,
    sample_ranges: &SampleRanges,
) -> Written {
    let mut written = Ok(());
    let mattes = Mattes::of(&settings.job.scene);
    let channels = layers(settings, &mattes, film);
    let names = mattes_of(&settings.outputs.layers, &mattes);
    let view = ViewTransform::of(&settings.job.scene.film);
    let facts = facts(&head.identity, sample_ranges);
    let picture = film.picture();
    for path in &settings.outputs.pictures {
        let one = write_with_facts(path, &picture, &facts, (&channels, &names), view);
        written = written.and(one);
    }
    written
}
