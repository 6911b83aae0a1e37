//! Options of readers of scene files.

use super::failure::{Failure, usage};
use super::loading::Loading;
use crate::scene::formats::{Format, unsuitable};
use crate::scene::{self, LoadOptions, Loaded};
use std::path::Path;

/// The heading of these options.
const HEADING: &str = "Options for Mitsuba scenes";

/// Options of readers of scene files.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct ReadingArguments {
    /// Value of a variable, which the scene refers to as $NAME; may be given several times
    #[arg(short = 'D', long = "define", help_heading = HEADING, value_name = "NAME=VALUE", value_parser = define)]
    pub(super) defines: Vec<(String, String)>,
    /// Camera of a scene with several cameras [default: the first one]
    #[arg(long, value_name = "NAME", help_heading = HEADING)]
    pub(super) camera: Option<String>,
    /// Fail if a part of the scene has no counterpart, instead of warning
    #[arg(long, help_heading = HEADING)]
    pub(super) strict: bool,
    /// Allow the scene to refer to files outside its folder
    #[arg(long, help_heading = HEADING)]
    pub(super) allow_outside: bool,
}

/// Parses "spp=64".
fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("expected NAME=VALUE, such as spp=64".to_owned()),
    }
}

impl ReadingArguments {
    /// Reads a scene file, and shows progress unless `quiet`.
    pub(super) fn load(&self, path: &Path, quiet: bool) -> Result<Loaded, Failure> {
        let options = LoadOptions {
            defines: self.defines.clone(),
            camera: self.camera.clone(),
            strict: self.strict,
            allow_outside: self.allow_outside,
        };
        if let Some(errors) = unsuitable(path, &options) {
            return Err(usage(errors));
        }
        Ok(scene::load_with(path, &options, &mut Loading::stderr(quiet).watch())?)
    }
}

/// The help text of a scene file.
pub(super) fn scene_file() -> String {
    format!("Scene file ({})", Format::names())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_have_names() {
        assert_eq!(define("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert_eq!(define("a="), Ok(("a".into(), String::new())));
        for bad in ["", "a", "=1"] {
            assert!(define(bad).is_err(), "{bad}");
        }
    }
}
