//! Errors about scene files that do not exist.

use super::registry::Format;
use crate::scene::diagnostic::SceneErrors;
use crate::scene::spelling;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// Checks that `path` can be read. The error suggests a file with a similar name, if there is one.
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
        _ => Ok(()),
    }
}

/// A scene file in the folder of `path` with a similar name.
fn similar_file(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_str()?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The folder may contain millions of files. A suggestion is not worth reading all of them.
    let beside: Vec<String> = fs::read_dir(folder)
        .ok()?
        .take(1000)
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|other| Format::of(other.as_ref()).is_some())
        .collect();
    let with_extension = Format::extensions().into_iter().map(|extension| format!("{name}{extension}"));
    let completed = with_extension.into_iter().find(|whole| beside.contains(whole));
    let nearest = || spelling::nearest(name, beside.iter().map(String::as_str)).map(str::to_owned);
    Some(format!("did you mean {}?", spelling::quote(&completed.or_else(nearest)?)))
}
