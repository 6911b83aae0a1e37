//! Errors about scene files that do not exist.

use super::registry::Format;
use crate::scene::diagnostic::SceneErrors;
use crate::scene::mesh;
use crate::scene::spelling;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// The extensions of scenes of other programs.
const FOREIGN: [&str; 8] = ["pbrt", "blend", "usd", "usda", "usdc", "usdz", "fbx", "abc"];

/// Checks that `path` exists and is of no foreign format. The error about a missing file suggests one with a similar
/// name, if there is one.
pub(super) fn present(path: &Path) -> Result<(), SceneErrors> {
    let fail = |message: &str, help: Option<String>| Err(SceneErrors::one(path, None, message.into(), help));
    match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => {
            fail("this is a folder", Some("name a scene file, such as cover.toml, in it".into()))
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            fail("there is no such file", similar_file(path))
        }
        // The reader reports other errors.
        _ => is_scene(path),
    }
}

/// Checks that the extension is not one of a file that is often given for a scene.
fn is_scene(path: &Path) -> Result<(), SceneErrors> {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let fail = |message: &str, help: String| Err(SceneErrors::one(path, None, message.into(), Some(help)));
    if mesh::EXTENSIONS.contains(&&*extension) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let shape = format!("shape = {{ type = \"mesh\", file = {} }}", spelling::quote(&name));
        return fail("this is a mesh", format!("write a scene with an entity that has {shape}"));
    }
    if FOREIGN.contains(&&*extension) {
        let formats = format!("the formats are {} ({})", Format::names(), Format::extensions().join(", "));
        return fail("this format is not read", formats);
    }
    Ok(())
}

/// A scene file in the folder of `path` with a similar name.
fn similar_file(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let beside = spelling::files_beside(path, |other| Format::of(other.as_ref()).is_some());
    let with_extension = Format::extensions().into_iter().map(|extension| format!("{name}{extension}"));
    let completed = with_extension.into_iter().find(|whole| beside.contains(whole));
    let nearest = || spelling::nearest(name, beside.iter().map(String::as_str)).map(str::to_owned);
    Some(format!("did you mean {}?", spelling::quote(&completed.or_else(nearest)?)))
}
