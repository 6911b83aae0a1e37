//! The readers of scene files, by the extensions of their names.
//!
//! | module | what is in it |
//! |---|---|
//! | `options` | what a reader may be told |
//! | [`mitsuba`] | the reader of Mitsuba's scene files, `.xml` |
//!
//! The reader of this program's own format, TOML, is [`crate::scene::toml`]. A reader is one folder and a line in `READERS`.

pub mod mitsuba;
mod options;

pub use options::LoadOptions;

use super::description::Scene;
use super::diagnostic::SceneErrors;
use super::mesh::cache::Watch;
use super::toml::{self, Loaded};
use std::path::Path;

/// A reader: the extensions of its files, and what reads one.
struct Reader {
    extensions: &'static [&'static str],
    read: fn(&Path, &LoadOptions, Watch<'_>) -> Result<Loaded, SceneErrors>,
}

/// All readers but that of TOML, which reads what has no other reader.
static READERS: &[Reader] = &[Reader { extensions: &["xml"], read: mitsuba::load }];

/// Reads the scene file at `path`.
pub fn load(path: &Path) -> Result<Loaded, SceneErrors> {
    load_watched(path, &mut |_, _, _| {})
}

/// Reads the scene file at `path`, and tells how far the files have been read that it names.
pub fn load_watched(path: &Path, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    load_with(path, &LoadOptions::default(), watch)
}

/// The same for a reader that is told something.
pub fn load_with(path: &Path, options: &LoadOptions, watch: Watch<'_>) -> Result<Loaded, SceneErrors> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let fits = |reader: &&Reader| reader.extensions.iter().any(|known| known.eq_ignore_ascii_case(extension));
    match READERS.iter().find(fits) {
        Some(reader) => (reader.read)(path, options, watch),
        None => {
            let refuse = |message: &str| Err(SceneErrors::one(path, None, message.into(), None));
            if let Some((name, _)) = options.defines.first() {
                return refuse(&format!("a scene file in TOML has no variables, and {name:?} is given"));
            }
            if let Some(camera) = &options.camera {
                return refuse(&format!("a scene file in TOML has one camera, and {camera:?} is asked for"));
            }
            toml::load_watched(path, watch)
        }
    }
}

impl Scene {
    /// Reads a scene file. [`load()`] tells besides what is legal but surely unmeant, and which files its meshes come from.
    pub fn load(path: impl AsRef<Path>) -> Result<Scene, SceneErrors> {
        load(path.as_ref()).map(|loaded| loaded.scene)
    }
}
