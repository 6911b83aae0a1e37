//! The readers of scene files, by the extensions of their names.
//!
//! | module | what is in it |
//! |---|---|
//! | `options` | what a reader may be told |
//! | `registry` | all formats: their names, extensions and readers |
//! | `lookup` | files that are not there |
//! | [`mitsuba`] | the reader of Mitsuba's scene files, `.xml` |
//!
//! The reader of this program's own format, TOML, is [`crate::scene::toml`]. A reader is one folder and a line in
//! the registry.

mod lookup;
pub mod mitsuba;
mod options;
mod registry;

pub use options::LoadOptions;
pub use registry::Format;

use super::description::Scene;
use super::diagnostic::SceneErrors;
use super::mesh::cache::Watch;
use super::toml::Loaded;
use std::path::Path;

/// The error for options that do not apply to the format of `path`, if any are given.
pub fn unsuitable(path: &Path, options: &LoadOptions) -> Option<SceneErrors> {
    let format = Format::of(path).unwrap_or(Format::own());
    if format.has_choices {
        return None;
    }
    let error = |message: String, help: String| Some(SceneErrors::one(path, None, message, Some(help)));
    if let Some((name, _)) = options.defines.first() {
        let message = format!("a scene file in {} has no variables", format.name);
        return error(message, format!("leave out -D {name}, and change the value in the file"));
    }
    let camera = options.camera.as_ref()?;
    let message = format!("a scene file in {} has one camera", format.name);
    error(message, format!("leave out --camera {camera}"))
}

/// Reads the scene file at `path`.
pub fn load(path: &Path) -> Result<Loaded, SceneErrors> {
    load_watched(path, &mut |_, _, _| {})
}

/// Reads the scene file at `path`, and reports the progress of reading the files that it refers to.
pub fn load_watched(path: &Path, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    load_with(path, &LoadOptions::default(), watch)
}

/// Reads the scene file at `path` with options, and reports progress.
pub fn load_with(path: &Path, options: &LoadOptions, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    if let Some(errors) = unsuitable(path, options) {
        return Err(errors);
    }
    lookup::present(path)?;
    (Format::of(path).unwrap_or(Format::own()).read)(path, options, watch)
}

impl Scene {
    /// Reads a scene file: TOML, or Mitsuba's `.xml`. [`load()`] also returns the warnings and the files of meshes.
    ///
    /// # Errors
    ///
    /// All mistakes in the file, each with line and column; or the reason why a file cannot be read.
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneErrors> {
        load(path.as_ref()).map(|loaded| loaded.scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_are_found_by_extensions_in_any_case() {
        for format in Format::all() {
            let upper = format!("a.{}", format.extension.to_uppercase());
            assert_eq!(Format::of(upper.as_ref()).map(|format| format.name), Some(format.name));
        }
        assert!(Format::of("toml".as_ref()).is_none() && Format::of("a.png".as_ref()).is_none());
        assert_eq!(Format::names(), "TOML, or Mitsuba's XML");
        assert_eq!(Format::extensions(), [".toml", ".xml"]);
    }

    #[test]
    fn scene_files_of_pbrt_are_refused_by_their_extension() {
        let folder = tempfile::tempdir().unwrap();
        for (name, is_refused) in [("a.pbrt", true), ("a.PBRT", true), ("pbrt", false), ("a.txt", false)] {
            let path = folder.path().join(name);
            std::fs::write(&path, "LookAt 0 0 5").unwrap();
            let said = load(&path).unwrap_err().to_string();
            let told = "this format is not read; the formats are TOML, or Mitsuba's XML (.toml, .xml)";
            assert_eq!(said.ends_with(told), is_refused, "{said}");
        }
    }

    #[test]
    fn options_are_unsuitable_for_files_without_choices() {
        let defines = vec![("spp".to_owned(), "3".to_owned())];
        let variable = LoadOptions { defines, ..LoadOptions::default() };
        let camera = LoadOptions { camera: Some("front".into()), ..LoadOptions::default() };
        for path in ["a.toml", "a", "a.txt"] {
            let message = |options| unsuitable(path.as_ref(), options).map(|errors| errors.to_string());
            let told =
                "a scene file in TOML has no variables; leave out -D spp, and change the value in the file";
            assert_eq!(message(&variable), Some(format!("{path}: {told}")));
            let told = "a scene file in TOML has one camera; leave out --camera front";
            assert_eq!(message(&camera), Some(format!("{path}: {told}")));
            assert_eq!(message(&LoadOptions::default()), None);
        }
        assert!(unsuitable("a.XML".as_ref(), &variable).is_none());
    }
}
