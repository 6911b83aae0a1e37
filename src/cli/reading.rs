//! What readers of scene files may be told on the command line.

use super::failure::{Failure, usage};
use super::loading::Loading;
use crate::scene::formats::{Format, unsuitable};
use crate::scene::{self, LoadOptions, Loaded};
use std::path::Path;

/// What readers of scene files may be told.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct ReadingArguments {
    /// Value of a variable of the scene file (Mitsuba), which is written $name there; may be given several times
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = define)]
    defines: Vec<(String, String)>,
    /// Camera, of a scene file that has several [default: the first one]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Take it for an error if something in a scene file of another program has no counterpart
    #[arg(long)]
    strict: bool,
    /// Let a scene file of another program name files outside of its folder
    #[arg(long)]
    allow_outside: bool,
}

/// "spp=64".
fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("a variable is given a value like spp=64".to_owned()),
    }
}

impl ReadingArguments {
    /// Reads a scene file, showing how far it has come unless `quiet`.
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
