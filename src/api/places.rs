//! Checks of output files: each has a different path and can be written.

use super::error::{Error, SettingsError};
use crate::output::{self, atomic};
use crate::session::Outputs;
use std::path::{Path, PathBuf};

/// Checks before the render that its files can be written after it, each to a different path that is neither one of the
/// `kept` files nor one of the `others` that the caller writes.
pub(super) fn check_places(outputs: &Outputs, kept: &[PathBuf], others: &[PathBuf]) -> Result<(), Error> {
    let is_png = |path: &&PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if outputs.overlay
        && let Some(path) = outputs.pictures.iter().find(|path| !is_png(path))
    {
        return Err(SettingsError::Overlay(path.clone()).into());
    }
    let mut pictures = outputs.pictures.clone();
    for path in &outputs.pictures {
        pictures.extend(outputs.dump_at.iter().map(|&at| output::numbered_path(path, at)));
    }
    let mut taken: Vec<PathBuf> = kept.iter().map(|path| place(path)).collect();
    for path in pictures.iter().chain(&outputs.samples).chain(&outputs.film).chain(others) {
        let place = place(path);
        if taken.contains(&place) {
            return Err(SettingsError::Twice(path.clone()).into());
        }
        taken.push(place);
    }
    for path in &pictures {
        output::check_writable(path)?;
    }
    if let Some(path) = &outputs.samples {
        if outputs.resume.is_some() && path.exists() {
            return Err(SettingsError::SamplesOfEarlierRun(path.clone()).into());
        }
        output::npy::check_writable(path)?;
    }
    if let Some(path) = &outputs.film {
        output::film::check_writable(path)?;
    }
    others.iter().try_for_each(|path| Ok(atomic::check_place(path)?))
}

/// The target of a path, as far as its folder exists: two spellings of one path are equal.
fn place(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}
