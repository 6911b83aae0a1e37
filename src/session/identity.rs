//! The metadata of a render's files.

use super::error::Written;
use super::settings::RenderSettings;
use crate::film::cryptomatte::{Mattes, Names};
use crate::film::head::{Head, NAMES};
use crate::film::{Channel, Identity, Layer, Picture, SampleRanges, ViewTransform};
use crate::output::{Crop, FilmSink, OutputError, PictureOptions, write_picture};
use crate::sampling::Region;
use crate::scene::{Fingerprint, UNLIMITED, Viewpoint};
use std::path::Path;

/// The facts that determine the bits of a render's samples on a device.
fn identity(settings: &RenderSettings, device: &str) -> Identity {
    let (scene, region) = (&settings.job.scene, settings.job.picture_region());
    let max_depth = match scene.render.max_depth {
        UNLIMITED => "unlimited".to_owned(),
        bounces => bounces.to_string(),
    };
    let identity = Identity::default()
        .with("program", concat!("stride ", env!("CARGO_PKG_VERSION")))
        .with("scene", settings.job.fingerprint.as_ref().map_or("unknown".to_owned(), Fingerprint::digits))
        .with("size", format_args!("{}x{}", scene.film.width, scene.film.height))
        .with("crop", format_args!("{},{},{},{}", region.x, region.y, region.width, region.height))
        .with("filter", scene.film.filter)
        .with("mode", scene.film.mode())
        .with("integrator", scene.render.integrator)
        .with("sampler", scene.render.sampler)
        .with("max depth", max_depth)
        .with("seed", scene.render.seed)
        .with("device", device);
    // With adaptive sampling the distribution of samples depends on the end of the render.
    let identity = match settings.stopping.goal().filter(|_| settings.stopping.adaptive) {
        None => identity,
        Some(noise) if settings.stopping.spp == u32::MAX => {
            identity.with("adaptive", format_args!("noise {noise}"))
        }
        Some(noise) => identity
            .with("adaptive", format_args!("noise {noise}, at most {} samples", settings.stopping.spp)),
    };
    match &settings.job.moved {
        Some(camera) => identity.with("camera", one_line(camera)),
        None => identity,
    }
}

/// The text of a camera, on one line.
fn one_line(camera: &Viewpoint) -> String {
    camera.to_string().lines().skip(1).collect::<Vec<_>>().join("; ")
}

/// The header of a film file of this render.
pub(super) fn head(settings: &RenderSettings, device: &str) -> Head {
    let range = settings.range();
    let mut notes = Identity::default()
        .with("exposure", settings.job.scene.film.exposure)
        .with("tone", settings.job.scene.film.tone.name())
        .with("asked", format_args!("{}..{}", range.start, range.end));
    if !settings.outputs.layers.is_empty() {
        let names: Vec<&str> = settings.outputs.layers.iter().map(|layer| layer.name()).collect();
        notes = notes.with("layers", names.join(","));
    }
    let mattes = Mattes::of(&settings.job.scene);
    let layers = [(Layer::CryptoEntity, &mattes.entities), (Layer::CryptoMaterial, &mattes.materials)];
    for (name, (layer, names)) in NAMES.into_iter().zip(layers) {
        if settings.job.layers.contains(layer) {
            notes = notes.with(name, names.list());
        }
    }
    if let Some(outline) = settings.job.fingerprint.as_ref().and_then(Fingerprint::outline) {
        notes = notes.with("parts", outline);
    }
    Head { layout: settings.job.layout(), identity: identity(settings, device), notes }
}

/// The notes in a sample dump: unlike facts they do not determine the bits of samples.
pub(crate) const NOTES: [&str; 5] = ["exposure", "tone", "asked", "layers", "rendered"];

/// The metadata of a dump of this render's samples: facts and notes of a film, and the region with samples. The header
/// has no room for the outline of the scene and for names, which only serve messages and Cryptomatte layers.
pub(super) fn dumped(settings: &RenderSettings, head: &Head) -> Identity {
    let Region { x, y, width, height, .. } = settings.job.region;
    let notes = head.notes.facts().filter(|(name, _)| NOTES.contains(name));
    let all = head.identity.facts().chain(notes);
    all.fold(Identity::default(), |all, (name, value)| all.with(name, value))
        .with("rendered", format_args!("{x},{y},{width},{height}"))
}

/// Checks before the render that the requested film file can store its header.
pub(super) fn check_film(settings: &RenderSettings, head: &Head) -> Written {
    let Some(path) = &settings.outputs.film else { return Ok(()) };
    head.check().map_err(|error| OutputError::from_io(path, error))
}

/// The writer of the film file, if one is requested.
pub(super) fn film_sink(settings: &RenderSettings, head: &Head) -> Option<FilmSink> {
    settings.outputs.film.clone().map(|path| FilmSink { path, head: head.clone(), range: settings.range() })
}

/// The metadata of an EXR file: the facts that determine its bits.
pub(crate) fn facts(identity: &Identity, sample_ranges: &SampleRanges) -> Identity {
    identity.clone().with("samples", sample_ranges)
}

/// The names in the Cryptomatte layers among these.
pub(super) fn mattes_of<'m>(layers: &[Layer], mattes: &'m Mattes) -> Vec<&'m Names> {
    layers.iter().filter_map(|layer| layer.names(mattes)).collect()
}

/// Writes a picture file with layers and metadata.
pub(super) fn write_with_facts(
    path: &Path,
    picture: &Picture,
    facts: &Identity,
    (channels, mattes): (&[Channel], &[&Names]),
    view: ViewTransform,
) -> Written {
    let mattes = if channels.is_empty() { &[] } else { mattes };
    let options = PictureOptions { view, facts: Some(facts), channels, mattes, crop: Crop::of(facts) };
    write_picture(path, picture, &options)
}
