//! The readers of scene files, by the extensions of their names.
//!
//! | module | what is in it |
//! |---|---|
//! | `options` | options of readers |
//! | [`mitsuba`] | the reader of Mitsuba's scene files, `.xml` |
//!
//! The reader of TOML, stride's own format, is [`crate::scene::toml`]. Each reader has a folder and a line in `READERS`.

pub mod mitsuba;
mod options;

pub use options::LoadOptions;

use super::description::Scene;
use super::diagnostic::SceneErrors;
use super::mesh::cache::Watch;
use super::toml::{self, Loaded};
use std::path::Path;

/// A reader: the extensions of its files, and the function that reads one.
struct Reader {
    extensions: &'static [&'static str],
    read: fn(&Path, &LoadOptions, Watch<'_>) -> Result<Loaded, SceneErrors>,
}

/// All readers except that of TOML, which reads files of all other extensions.
static READERS: &[Reader] = &[Reader { extensions: &["xml"], read: mitsuba::load }];

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
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let fits = |reader: &&Reader| reader.extensions.iter().any(|known| known.eq_ignore_ascii_case(extension));
    match READERS.iter().find(fits) {
        Some(reader) => (reader.read)(path, options, watch),
        None => {
            let refuse = |message: &str| Err(SceneErrors::one(path, None, message.into(), None));
            if let Some((name, _)) = options.defines.first() {
                return refuse(&format!(
                    "a scene file in TOML has no variables: remove the value of {name:?}"
                ));
            }
            if let Some(camera) = &options.camera {
                return refuse(&format!(
                    "a scene file in TOML has one camera, without a name: remove the name {camera:?}"
                ));
            }
            toml::load_watched(path, watch)
        }
    }
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
