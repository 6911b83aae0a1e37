//! The reader of scene files of Mitsuba 2 and 3, in XML.
//!
//! `docs/mitsuba.md` lists the counterparts of all plugins, and the differences between conventions.
//!
//! | file | what is in it |
//! |---|---|
//! | `limits` | what a file may ask for at most |
//! | `report` | errors, warnings, and what has no counterpart, with their places |
//! | `text`, `variables` | numbers in attributes; `$name` |
//! | `files`, `contents` | where files are looked for, and what is in them |
//! | `spectrum`, `cie`, `indices` | spectra as colours; tables |
//! | `transform` | transforms |
//! | `object` | objects and their properties |
//! | `nesting`, `input`, `tags`, `xml` | from files to objects |
//! | `builder` | what a scene is made in |
//! | `shade`, `textures`, `materials` | what surfaces look like |
//! | [`serialized`], `formed`, `meshes`, `shapes` | surfaces |
//! | `emitters`, `camera`, `integrators` | the rest of a scene |
//!
//! Reading goes on after an error, so that all errors of a scene are shown at once. Whatever has no counterpart is reported
//! once, with the number of its occurrences and the first place, and the scene is rendered without it.

mod builder;
mod camera;
mod cie;
mod contents;
mod emitters;
mod files;
mod formed;
mod indices;
mod input;
mod integrators;
mod limits;
mod materials;
mod meshes;
mod nesting;
mod object;
mod report;
pub mod serialized;
mod shade;
mod shapes;
mod spectrum;
mod tags;
#[cfg(test)]
mod tests;
mod text;
mod textures;
mod transform;
mod variables;
mod xml;

use self::builder::{Builder, Places};
use self::files::Files;
use self::object::{Document, Tag};
use self::report::{Place, Read, Reports};
use super::options::LoadOptions;
use crate::scene::dark_lights::{DarkLights, dark_lights};
use crate::scene::description::Scene;
use crate::scene::diagnostic::SceneErrors;
use crate::scene::fingerprint::Sources;
use crate::scene::mesh::cache::{MeshCache, Watch};
use crate::scene::spelling::quote;
use crate::scene::toml::Loaded;
use glam::DAffine3;
use std::path::Path;
use std::sync::Arc;

/// Reads the scene file at `path`, and the files that it refers to.
pub fn load(path: &Path, options: &LoadOptions, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    let text = input::limited(path, limits::MOST_BYTES, input::too_much_xml)
        .map_err(|message| SceneErrors::one(path, None, message, None))?;
    parse_watched(text, path, options, Some(watch))
}

/// Reads a scene from the text of a file. `path` is its name in messages; other files are searched for beside it.
pub fn parse(text: &str, path: &Path, options: &LoadOptions) -> Result<Loaded, SceneErrors> {
    parse_watched(text.into(), path, options, None)
}

fn parse_watched(
    text: Arc<str>,
    path: &Path,
    options: &LoadOptions,
    watch: Option<Watch<'_>>,
) -> Result<Loaded, SceneErrors> {
    let (files, folders) = Files::of(path, options.allow_outside);
    let mut reports = Reports::default();
    let read = xml::parse(path, text, &options.defines, (&files, folders), &mut reports);
    let built = read.and_then(|document| {
        let meshes = MeshCache::new(files.folder(), watch);
        build(&document, options, Builder::new(&document, &mut reports, &files, meshes))
    });
    match built {
        Ok((scene, sources, crop, places)) => {
            if !scene.has_light() {
                let help = "the picture will be black";
                reports.warn(Place::default(), "nothing in the scene shines", Some(help.into()));
            }
            for DarkLights { first, message, help } in dark_lights(&scene, quote, "flip_normals") {
                reports.warn(places.of_light(first), message, Some(help));
            }
            Ok(Loaded { scene, warnings: reports.finish(options.strict)?, sources, crop })
        }
        Err(_) => match reports.finish(options.strict) {
            Err(errors) => Err(errors),
            Ok(_) => Err(SceneErrors::one(path, None, "the scene could not be converted".into(), None)),
        },
    }
}

/// Converts the objects of a scene.
fn build(
    document: &Document,
    options: &LoadOptions,
    mut builder: Builder<'_, '_>,
) -> Read<(Scene, Sources, camera::Crop, Places)> {
    let crop = builder.sensor(options.camera.as_deref());
    let mut outcome = builder.integrator();
    let scene = builder.object(0);
    for &shape in document.children(scene, Tag::Shape) {
        outcome = builder.shape(shape, DAffine3::IDENTITY).and(outcome);
    }
    for &emitter in document.children(scene, Tag::Emitter) {
        outcome = builder.emitter(emitter).and(outcome);
    }
    // Others are read where they are named.
    for tag in [Tag::Bsdf, Tag::Texture, Tag::Medium, Tag::Sensor] {
        document.children(scene, tag);
    }
    let crop = crop?;
    outcome?;
    builder.report_unused();
    let (scene, sources, places) = builder.finish()?;
    Ok((scene, sources, crop, places))
}
