//! `stride info`: the contents of a file, or the available devices.

use super::arguments::range;
use super::failure::{Failure, usage};
use super::print::print;
use super::reading::ReadingArguments;
use super::{contents, devices, program};
use crate::film::cryptomatte::Names;
use crate::film::{Identity, Ranges};
use crate::output::{FilmError, Format, exr, npy, open_film, read_picture};
use crate::scene::formats as scenes;
use std::fmt::Write;
use std::fs::File;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct InfoArguments {
    #[arg(conflicts_with = "devices", help = format!("Film, picture, sample dump, scene or mesh: {}", readable()))]
    file: Option<PathBuf>,
    /// List the devices that can render, and their limits
    #[arg(long)]
    devices: bool,
    /// Print the WGSL program that a GPU runs for a scene
    #[arg(long, conflicts_with = "devices")]
    wgsl: bool,
    #[command(flatten)]
    reading: ReadingArguments,
}

/// The extensions of files that have contents to be printed.
fn readable() -> String {
    let scenes = scenes::Format::extensions().join(", ");
    format!(".film, .png, .exr, .hdr, .npy, {scenes}, .ply, .obj, .glb or .gltf")
}

pub(super) fn run(arguments: &InfoArguments) -> Result<(), Failure> {
    let path = match &arguments.file {
        Some(path) => path,
        None if arguments.devices => return Ok(print(&devices::list())?),
        None => {
            return Err(usage("name a file, or list the devices: stride info --devices"));
        }
    };
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let is_scene = scenes::Format::of(path).is_some();
    let text = if arguments.wgsl {
        if !is_scene {
            return Err(usage(format!(
                "--wgsl: {} is not a scene; name a file that ends in {}",
                path.display(),
                scenes::Format::extensions().join(" or ")
            )));
        }
        program::of_scene(path, &arguments.reading)?
    } else if extension == "film" {
        film(path)?
    } else if extension == "npy" {
        samples(path)?
    } else if is_scene {
        contents::of_scene(path, &arguments.reading)?
    } else if ["ply", "obj", "glb", "gltf"].contains(&extension.as_str()) {
        contents::of_mesh(path)?
    } else if Format::of(path).is_ok() {
        picture(path)?
    } else {
        return Err(usage(format!("{} does not end in {}", path.display(), readable())));
    };
    Ok(print(&text)?)
}

/// A film, which is read completely, so that damage is detected.
fn film(path: &Path) -> Result<String, Failure> {
    let file = open_film(path)?;
    let (head, sample_ranges) = (file.head().clone(), file.sample_ranges().clone());
    let film = file.read().map_err(|reason| FilmError { path: path.to_path_buf(), reason })?;
    let mut text = String::new();
    let mut line = |name: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{name:<12}{value}");
    };
    let shown = head.layout.shown;
    line("film", format!("{}×{} pixels", shown.width, shown.height));
    head.identity
        .facts()
        .chain(head.notes.facts())
        .for_each(|(name, value)| line(name, shown_fact(name, value)));
    line("samples", sample_ranges.to_string());
    if sample_ranges.open().is_some() {
        let [least, most] = film.seen_range();
        line("per pixel", format!("{least} to {most} samples"));
    }
    let missing = sample_ranges.missing();
    if !missing.is_empty() {
        line("missing", Ranges(&missing).to_string());
    }
    if head.layout.spreads {
        line("variance", "the film has the sums for it".to_owned());
    }
    if !head.layout.layers.is_empty() {
        line("first hits", format!("the film has the sums for {}", head.layout.layers));
    }
    let [lost, outside] = film.lost_contributions();
    line("rejected", format!("{} samples", film.rejected().saturating_sub(lost)));
    if film.has_light_image() {
        line("light image", format!("{lost} contributions rejected, {outside} outside the film"));
    }
    line("mean", mean(&film.picture().rgb));
    Ok(text)
}

/// A fact or a note for users: open ranges have no end, and long lists are replaced by their lengths.
fn shown_fact(name: &str, value: &str) -> String {
    match (name, range(value)) {
        ("asked", Ok(asked)) => Ranges(&[asked]).to_string(),
        ("parts", _) => {
            format!("{} of the scene, to find differences between scenes", value.matches(';').count())
        }
        ("entities" | "materials", _) => {
            let names = Names::of_list("", value).map_or(0, |names| names.len());
            format!("{names} names, for Cryptomatte")
        }
        _ => value.to_owned(),
    }
}

/// The metadata of a sample dump.
fn samples(path: &Path) -> Result<String, Failure> {
    let dump = npy::read::open_dump(path)?;
    let mut text = format!("{:<12}{} of {} bytes\n", "samples", dump.count(), npy::RECORD_BYTES);
    let facts = dump.facts().into_iter().flat_map(Identity::facts);
    for (name, value) in facts {
        let _ = writeln!(text, "{name:<12}{}", shown_fact(name, value));
    }
    if dump.facts().is_none() {
        let _ = writeln!(text, "{:<12}unknown: the file has no metadata", "film");
    }
    Ok(text)
}

/// A description of a format's numbers.
fn kind(format: Format) -> &'static str {
    match format {
        Format::Png => "PNG: display values of 8 or 16 bits; the mean is that of linear light",
        Format::Exr => "EXR: radiance in floating point",
        Format::Hdr => "Radiance HDR: radiance with a shared exponent of 8 bits per pixel",
    }
}

fn picture(path: &Path) -> Result<String, Failure> {
    let (format, picture) = read_picture(path)?;
    let mut text = String::new();
    let _ = writeln!(text, "{:<12}{}×{} pixels", "picture", picture.width, picture.height);
    let _ = writeln!(text, "{:<12}{}", "format", kind(format));
    let facts = (format == Format::Exr).then(|| File::open(path).ok().and_then(exr::facts)).flatten();
    if format == Format::Exr
        && let Ok(file) = File::open(path)
    {
        let _ = writeln!(text, "{:<12}{}", "channels", exr::channels(file).join(", "));
    }
    let mattes = File::open(path).ok().filter(|_| format == Format::Exr).map(exr::mattes).unwrap_or_default();
    if !mattes.is_empty() {
        let listed: Vec<_> = mattes.iter().map(|(layer, names)| format!("{layer} ({names} names)")).collect();
        let _ = writeln!(text, "{:<12}{}", "mattes", listed.join(", "));
    }
    for (name, value) in facts.iter().flat_map(Identity::facts) {
        let _ = writeln!(text, "{name:<12}{value}");
    }
    let _ = writeln!(text, "{:<12}{}", "mean", mean(&picture.rgb));
    Ok(text)
}

/// Mean radiance of all pixels: red, green, blue.
fn mean(rgb: &[[f32; 3]]) -> String {
    let sum = |channel: usize| rgb.iter().map(|rgb| f64::from(rgb[channel])).sum::<f64>();
    let [r, g, b] = [0, 1, 2].map(|channel| sum(channel) / rgb.len().max(1) as f64);
    format!("{r:.6} {g:.6} {b:.6}")
}
