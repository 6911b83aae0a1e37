//! Advice about options of other programs.

use clap::Error;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Options of other programs, and what to give here. The parser would suggest the most similar name, which often means
/// something else.
const OPTIONS: &[(&[&str], &str)] = &[
    (
        &["--denoise", "--denoiser"],
        "there is no denoiser; write the layers that other denoisers need with --layers albedo,normal",
    ),
    (&["--width", "--height", "--resolution", "--res"], "the size of the picture is --size 640x480"),
    (&["--pixelsamples", "--pixel-samples", "-s"], "samples per pixel are --spp 64"),
    (&["--bounces", "--max-bounces", "--maxdepth"], "the largest number of bounces is --max-depth 8"),
];

/// Replaces the suggestions of an error by better ones, if there are any.
pub(super) fn add(error: &mut Error) {
    let word = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(word.clone()),
        _ => None,
    };
    let advice = match error.kind() {
        ErrorKind::UnknownArgument => word(ContextKind::InvalidArg).and_then(|given| of_option(&given)),
        ErrorKind::InvalidSubcommand => {
            word(ContextKind::InvalidSubcommand).and_then(|given| of_scene(&given))
        }
        _ => None,
    };
    if let Some(advice) = advice {
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![StyledStr::from(advice)]));
    }
}

fn of_option(given: &str) -> Option<String> {
    let row = OPTIONS.iter().find(|(names, _)| names.contains(&given));
    row.map(|(_, advice)| (*advice).to_owned())
}

/// Advice about a scene in place of a command.
fn of_scene(given: &str) -> Option<String> {
    let is_scene = given.ends_with(".toml") || given.ends_with(".xml");
    is_scene.then(|| format!("to render a scene, write: stride render {given}"))
}
