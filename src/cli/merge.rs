//! `stride merge`: adds films of disjoint samples, exactly.

use super::failure::{Failure, usage};
use super::render::Layers;
use crate::film::cryptomatte::Mattes;
use crate::film::file::FilmFileError;
use crate::film::head::{Head, LAYERS, NAMES};
use crate::film::{
    Channel, Film, Identity, LAYER_SAMPLES, Layer, LayerSet, Layout, Ranges, SampleRanges, ViewTransform,
};
use crate::output::{
    self, Crop, FilmError, FilmFile, Format, OutputError, PictureOptions, film, open_film, write_film,
    write_picture,
};
use crate::scene::Tone;
use crate::session;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(super) struct MergeArguments {
    /// Films of one render, of different samples (render --range)
    #[arg(required = true, value_name = "FILE.film")]
    films: Vec<PathBuf>,
    /// File to write: .film, .exr, .png or .hdr; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    outputs: Vec<PathBuf>,
    /// Layers for EXR files, among those that the films have [default: those that they were rendered with]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = super::render::layer)]
    layers: Vec<Layers>,
    /// Exposure of PNG files in stops, instead of the films'
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = super::render::exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG files, srgb or filmic, instead of the first film's
    #[arg(long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Print only errors
    #[arg(short, long)]
    quiet: bool,
}

/// A film whose pixels have not been read yet. The file is closed: there may be thousands of films.
struct Part<'a> {
    path: &'a Path,
    head: Head,
    sample_ranges: SampleRanges,
}

impl<'a> Part<'a> {
    fn read(path: &'a Path) -> Result<Part<'a>, FilmError> {
        let file = open_film(path)?;
        Ok(Part { path, head: file.head().clone(), sample_ranges: file.sample_ranges().clone() })
    }

    /// The names in its Cryptomatte layers.
    fn mattes(&self) -> Result<Mattes, FilmError> {
        self.head.mattes().ok_or_else(|| {
            let reason = FilmFileError::Contradiction("its lists of names are malformed");
            FilmError { path: self.path.to_path_buf(), reason }
        })
    }

    /// Opens the file again, and checks that it is the same film.
    fn open(&self) -> Result<FilmFile, Failure> {
        let file = open_film(self.path)?;
        if *file.head() == self.head && *file.sample_ranges() == self.sample_ranges {
            return Ok(file);
        }
        Err(anyhow::anyhow!("{:?} changed while it was read; merge again when it is complete", self.path)
            .into())
    }
}

pub(super) fn run(arguments: &MergeArguments) -> Result<(), Failure> {
    check_outputs(&arguments.outputs)?;
    refuse_inputs_as_outputs(arguments)?;
    let parts: Vec<Part<'_>> =
        arguments.films.iter().map(|path| Part::read(path)).collect::<Result<_, _>>()?;
    let Some(first) = parts.first() else { return Err(usage("there is no film to merge")) };
    let sample_ranges = join(first, &parts, arguments.outputs.iter().any(|path| is_film(path)))?;
    let (layers, no_variance) = layers(&arguments.layers, first, &parts)?;
    let mattes = first.mattes()?;

    // Memory for one film, regardless of their number; with the sums for a variance if all of them have these.
    let spreads = parts.iter().all(|part| part.head.layout.spreads);
    let layout = Layout { spreads, ..first.head.layout };
    let mut film = Film::with_layout(layout)?;
    for part in &parts {
        let path = part.path.to_path_buf();
        part.open()?.add_to(&mut film).map_err(|reason| FilmError { path, reason })?;
    }
    let exposure = arguments.exposure.or_else(|| first.head.notes.get("exposure")?.parse().ok());
    let tone = arguments.tone.or_else(|| first.head.notes.get("tone")?.parse().ok());
    let view = ViewTransform { exposure: exposure.unwrap_or(0.0), tone: tone.unwrap_or_default() };
    let head = Head { layout, ..merged_head(&parts, first, &sample_ranges, view) };
    write_outputs(&arguments.outputs, &head, &film, &sample_ranges, view, (&layers, &mattes))?;
    if !arguments.quiet {
        // Standard error may be closed, which is not an error.
        let layer_names = (layout.layers, &noted_layers(&parts)[..]);
        let _ =
            print_summary(arguments, &sample_ranges, layer_names, no_variance, &mut std::io::stderr().lock());
    }
    Ok(())
}

/// The layers to write; and a film without variance, if that layer is requested implicitly and cannot be written.
fn layers<'p, 'a>(
    asked: &[Layers],
    first: &Part<'_>,
    parts: &'p [Part<'a>],
) -> Result<(Vec<Layer>, Option<&'p Part<'a>>), Failure> {
    let has = first.head.layout.layers;
    let no_variance = parts.iter().find(|part| part.head.layout.lacks_variance());
    for layer in asked.iter().filter_map(|asked| asked.0) {
        match (layer, no_variance) {
            (Layer::Variance, Some(part)) => {
                return Err(usage(format!("--layers variance: {:?} {}", part.path, why_no_variance(part))));
            }
            _ if layer.is_of_radiance() || has.contains(layer) => {}
            _ => {
                return Err(usage(format!(
                    "the films were begun without the layer {name}; begin them with render --layers {name}",
                    name = layer.name()
                )));
            }
        }
    }
    let noted = noted_layers(parts);
    let wanted = |layer: &Layer| match asked {
        [] => noted.contains(layer) || has.contains(*layer),
        asked => asked.iter().any(|asked| asked.0.is_none_or(|asked| asked == *layer)),
    };
    let is_available = |layer: &Layer| match layer {
        Layer::Variance => no_variance.is_none(),
        Layer::Samples => true,
        _ => has.contains(*layer),
    };
    let written = Layer::ALL.into_iter().filter(wanted).filter(is_available).collect();
    Ok((written, no_variance.filter(|_| wanted(&Layer::Variance))))
}

/// Why a film has no variance estimate.
fn why_no_variance(part: &Part<'_>) -> &'static str {
    match part.head.layout.light {
        Some(_) => "has a light image, whose variance is unknown",
        None => "is in mode \"continuous\" and was begun without --layers variance: it lacks the sums for it",
    }
}

/// The layers that the films were rendered with.
fn noted_layers(parts: &[Part<'_>]) -> Vec<Layer> {
    let noted: Vec<Layer> = parts.iter().flat_map(|part| part.head.layers_shown()).collect();
    Layer::ALL.into_iter().filter(|layer| noted.contains(layer)).collect()
}

fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("film"))
}

fn check_outputs(outputs: &[PathBuf]) -> Result<(), OutputError> {
    for path in outputs {
        if is_film(path) {
            film::check_writable(path)?;
        } else {
            output::check_writable(path)?;
        }
    }
    Ok(())
}

/// An output must not replace an input: merged again, the same samples would count twice.
fn refuse_inputs_as_outputs(arguments: &MergeArguments) -> Result<(), Failure> {
    for output in &arguments.outputs {
        if let Some(film) = arguments.films.iter().find(|film| is_same_file(film, output)) {
            return Err(usage(format!(
                "-o {} would replace one of the films to merge, {}; choose another name for the result",
                output.display(),
                film.display()
            )));
        }
    }
    Ok(())
}

/// Whether two paths denote the same file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (a.metadata(), b.metadata()) {
        use std::os::unix::fs::MetadataExt;
        return (a.dev(), a.ino()) == (b.dev(), b.ino());
    }
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// The samples of all films together; fails if they belong to different renders or have common samples.
fn join(first: &Part<'_>, parts: &[Part<'_>], to_film: bool) -> Result<SampleRanges, Failure> {
    let mut all = SampleRanges::default();
    for (i, part) in parts.iter().enumerate() {
        if let Some(difference) = first.head.difference(&part.head) {
            let (path, other) = (part.path, first.path);
            let remedy = if difference.name == LAYERS {
                "; only films with the same --layers can be merged: render one again with the layers of the other"
            } else {
                ""
            };
            return Err(anyhow::anyhow!(
                "{path:?} and {other:?} belong to different renders: of the first, {difference}{remedy}"
            )
            .into());
        }
        for before in &parts[..i] {
            if let Some(both) = before.sample_ranges.overlap(&part.sample_ranges) {
                let (path, other) = (before.path, part.path);
                return Err(anyhow::anyhow!(
                    "{path:?} and {other:?} both have the samples {}; omit one of them",
                    Ranges(&[both])
                )
                .into());
            }
            if to_film && !before.sample_ranges.can_join(&part.sample_ranges) {
                let (path, other) = (before.path, part.path);
                return Err(anyhow::anyhow!(
                    "{path:?} and {other:?} were both interrupted, and a film can store only one unfinished range; finish one with --resume, or write a picture (-o FILE.exr)"
                )
                .into());
            }
        }
        all.join(&part.sample_ranges);
    }
    Ok(all)
}

fn merged_head(
    parts: &[Part<'_>],
    first: &Part<'_>,
    sample_ranges: &SampleRanges,
    view: ViewTransform,
) -> Head {
    let ranges = || sample_ranges.whole().iter().chain(sample_ranges.open());
    let asked = ranges().map(|range| range.start).min().unwrap_or(0)
        ..ranges().map(|range| range.end).max().unwrap_or(0);
    let mut notes = Identity::default()
        .with("exposure", view.exposure)
        .with("tone", view.tone.name())
        .with("asked", format_args!("{}..{}", asked.start, asked.end));
    let layers: Vec<&str> = noted_layers(parts).iter().map(|layer| layer.name()).collect();
    if !layers.is_empty() {
        notes = notes.with("layers", layers.join(","));
    }
    // Films of one render have them in common.
    for name in NAMES.into_iter().chain(["parts"]) {
        if let Some(value) = first.head.notes.get(name) {
            notes = notes.with(name, value);
        }
    }
    Head { notes, ..first.head.clone() }
}

/// Writes all files, even if one fails, and returns the first error.
fn write_outputs(
    outputs: &[PathBuf],
    head: &Head,
    film: &Film,
    sample_ranges: &SampleRanges,
    view: ViewTransform,
    (layers, mattes): (&[Layer], &Mattes),
) -> Result<(), OutputError> {
    let channels: Vec<Channel> = layers.iter().flat_map(|&layer| film.channels(layer, mattes)).collect();
    let mattes: Vec<_> = layers.iter().filter_map(|layer| layer.names(mattes)).collect();
    let mut first_error = Ok(());
    let needs_picture = outputs.iter().any(|path| Format::of(path).is_ok());
    let picture = needs_picture.then(|| film.picture());
    let facts = session::facts(&head.identity, sample_ranges);
    for path in outputs {
        let written = match &picture {
            Some(picture) if !is_film(path) => {
                let (facts, crop) = (Some(&facts), Crop::of(&head.identity));
                let options = PictureOptions { view, facts, channels: &channels, mattes: &mattes, crop };
                write_picture(path, picture, &options)
            }
            _ => write_film(path, head, film, sample_ranges, None),
        };
        first_error = first_error.and(written);
    }
    first_error
}

fn print_summary(
    arguments: &MergeArguments,
    sample_ranges: &SampleRanges,
    (layers, noted): (LayerSet, &[Layer]),
    no_variance: Option<&Part<'_>>,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let names: Vec<String> = arguments.outputs.iter().map(|path| path.display().to_string()).collect();
    let count = arguments.films.len();
    let films = if count == 1 { "film has" } else { "films have" };
    writeln!(out, "{count} {films} the samples {sample_ranges}; wrote {}", names.join(", "))?;
    let is_exr = |path: &PathBuf| Format::of(path).is_ok_and(|format| format == Format::Exr);
    if let Some(part) = no_variance.filter(|_| arguments.outputs.iter().any(is_exr)) {
        writeln!(out, "without the layer variance: {:?} {}", part.path, why_no_variance(part))?;
    }
    let missing = sample_ranges.missing_of_layers();
    if !layers.is_empty() && !missing.is_empty() {
        let missing = Ranges(&missing);
        writeln!(out, "the layers {layers} lack the samples {missing} of 0..{LAYER_SAMPLES}")?;
    }
    let missing = sample_ranges.missing();
    if !missing.is_empty() {
        let hint = Ranges(&missing[..1]);
        let names: Vec<&str> = noted.iter().map(|layer| layer.name()).collect();
        let with = if names.is_empty() { String::new() } else { format!(" --layers {}", names.join(",")) };
        writeln!(out, "missing: {} (render --range {hint}{with})", Ranges(&missing))?;
    }
    Ok(())
}
