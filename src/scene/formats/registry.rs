//! The formats of scene files.

use super::mitsuba;
use super::options::LoadOptions;
use crate::scene::diagnostic::SceneErrors;
use crate::scene::mesh::cache::Watch;
use crate::scene::toml::{self, Loaded};
use std::path::Path;

/// A format of scene files.
#[derive(Debug)]
pub struct Format {
    /// The name in messages.
    pub name: &'static str,
    /// The extension of its files, in lower case and without a point.
    pub extension: &'static str,
    /// Whether its files have variables, and cameras to choose from.
    pub(super) has_choices: bool,
    pub(super) read: fn(&Path, &LoadOptions, Watch<'_>) -> Result<Loaded, SceneErrors>,
}

/// All formats. The first one is that of files with any other extension.
#[rustfmt::skip]
static FORMATS: [Format; 2] = [
    Format { name: "TOML", extension: "toml", has_choices: false, read: |path, _, watch| toml::load_watched(path, watch) },
    Format { name: "Mitsuba's XML", extension: "xml", has_choices: true, read: mitsuba::load },
];

impl Format {
    /// All formats, that of this program first.
    pub fn all() -> &'static [Format] {
        &FORMATS
    }

    /// That of this program, in which scenes are written.
    pub fn own() -> &'static Format {
        &FORMATS[0]
    }

    /// The format of files with the extension of this path, in any case; `None` if it is not that of a scene file.
    pub fn of(path: &Path) -> Option<&'static Format> {
        let extension = path.extension()?.to_str()?;
        FORMATS.iter().find(|format| format.extension.eq_ignore_ascii_case(extension))
    }

    /// The names of all formats, as a message lists them.
    pub fn names() -> String {
        FORMATS.each_ref().map(|format| format.name).join(", or ")
    }

    /// The extensions of all formats, each with its point.
    pub fn extensions() -> Vec<String> {
        FORMATS.iter().map(|format| format!(".{}", format.extension)).collect()
    }
}
