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
    /// Samples per pixel that the films must have together: unless they are exactly the samples 0 to N − 1, nothing is
    /// written
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
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

/// A film whose pixels have not been read yet. The file is closed, and its header is not kept, which may have megabytes
/// of names: there may be thousands of films.
#[derive(Debug, PartialEq)]
struct Part<'a> {
    path: &'a Path,
    layout: Layout,
    /// The layers that it was rendered with.
    shown: Vec<Layer>,
    sample_ranges: SampleRanges,
}

impl<'a> Part<'a> {
    fn of(path: &'a Path, file: &FilmFile) -> Part<'a> {
        let (head, sample_ranges) = (file.head(), file.sample_ranges().clone());
        Part { path, layout: head.layout, shown: head.layers_shown(), sample_ranges }
    }
}

/// Films of one render, in the order of the command line.
struct Parts<'a> {
    /// The header of the first film, with the facts that all have in common.
    head: Head,
    all: Vec<Part<'a>>,
}

impl<'a> Parts<'a> {
    /// Reads everything except pixels. Fails if the films belong to different renders.
    fn read(paths: &'a [PathBuf]) -> Result<Parts<'a>, Failure> {
        let [first, others @ ..] = paths else { return Err(usage("there is no film to merge")) };
        let file = open_film(first)?;
        let mut parts = Parts { head: file.head().clone(), all: vec![Part::of(first, &file)] };
        for path in others {
            let file = open_film(path)?;
            if let Some(difference) = parts.head.difference(file.head()) {
                let remedy = if difference.name == LAYERS {
                    "; only films with the same --layers can be merged: render one again with the layers of the other"
                } else {
                    ""
                };
                return Err(anyhow::anyhow!(
                    "{path:?} and {first:?} belong to different renders: of the first, {difference}{remedy}"
                )
                .into());
            }
            parts.all.push(Part::of(path, &file));
        }
        Ok(parts)
    }

    /// The names in their Cryptomatte layers.
    fn mattes(&self) -> Result<Mattes, FilmError> {
        self.head.mattes().ok_or_else(|| {
            let reason = FilmFileError::Contradiction("its lists of names are malformed");
            FilmError { path: self.all[0].path.to_path_buf(), reason }
        })
    }

    /// Opens a film again, and checks that it is the same film.
    fn open(&self, part: &Part<'_>) -> Result<FilmFile, Failure> {
        let file = open_film(part.path)?;
        if self.head.difference(file.head()).is_none() && Part::of(part.path, &file) == *part {
            return Ok(file);
        }
        Err(anyhow::anyhow!("{:?} changed while it was read; merge again when it is complete", part.path)
            .into())
    }

    /// The samples of all films together; fails if films have common samples.
    fn sample_ranges(&self, to_film: bool) -> Result<SampleRanges, Failure> {
        let all: Vec<&SampleRanges> = self.all.iter().map(|part| &part.sample_ranges).collect();
        if let Some((places, both)) = SampleRanges::first_overlap(&all) {
            let [path, other] = places.map(|place| self.all[place].path);
            return Err(anyhow::anyhow!(
                "{path:?} and {other:?} both have the samples {}; omit one of them",
                Ranges(&[both])
            )
            .into());
        }
        let mut interrupted = self.all.iter().filter(|part| part.sample_ranges.open().is_some());
        if let (Some(Part { path, .. }), Some(Part { path: other, .. }), true) =
            (interrupted.next(), interrupted.next(), to_film)
        {
            return Err(anyhow::anyhow!(
                "{path:?} and {other:?} were both interrupted, and a film can store only one unfinished range; finish one with --resume, or write a picture (-o FILE.exr)"
            )
            .into());
        }
        Ok(SampleRanges::of_all(all))
    }

    /// The layers that the films were rendered with.
    fn shown(&self) -> Vec<Layer> {
        let is_shown = |layer: &Layer| self.all.iter().any(|part| part.shown.contains(layer));
        Layer::ALL.into_iter().filter(is_shown).collect()
    }
}

pub(super) fn run(arguments: &MergeArguments) -> Result<(), Failure> {
    check_outputs(&arguments.outputs)?;
    refuse_inputs_as_outputs(arguments)?;
    let parts = Parts::read(&arguments.films)?;
    let sample_ranges = parts.sample_ranges(arguments.outputs.iter().any(|path| is_film(path)))?;
    if let Some(spp) = arguments.spp
        && sample_ranges != SampleRanges::prefix(0..spp, spp.into(), spp.into())
    {
        return Err(anyhow::anyhow!(
            "the films have the samples {sample_ranges}, and --spp {spp} requires exactly 0..{spp}"
        )
        .into());
    }
    let shown = parts.shown();
    let (layers, no_variance) = layers(&arguments.layers, &shown, &parts)?;
    let mattes = parts.mattes()?;

    // Memory for one film, regardless of their number; with the sums for a variance if all of them have these.
    let spreads = parts.all.iter().all(|part| part.layout.spreads);
    let layout = Layout { spreads, ..parts.head.layout };
    let mut film = Film::with_layout(layout)?;
    for part in &parts.all {
        let path = part.path.to_path_buf();
        parts.open(part)?.add_to(&mut film).map_err(|reason| FilmError { path, reason })?;
    }
    let note = |name: &str| parts.head.notes.get(name);
    let exposure = arguments.exposure.or_else(|| note("exposure")?.parse().ok());
    let tone = arguments.tone.or_else(|| note("tone")?.parse().ok());
    let view = ViewTransform { exposure: exposure.unwrap_or(0.0), tone: tone.unwrap_or_default() };
    let head = Head { layout, ..merged_head(&parts.head, &shown, &sample_ranges, view) };
    write_outputs(&arguments.outputs, &head, &film, &sample_ranges, view, (&layers, &mattes))?;
    if !arguments.quiet {
        // Standard error may be closed, which is not an error.
        let layer_names = (layout.layers, &shown[..]);
        let _ =
            print_summary(arguments, &sample_ranges, layer_names, no_variance, &mut std::io::stderr().lock());
    }
    Ok(())
}

/// The layers to write; and a film without variance, if that layer is requested implicitly and cannot be written.
fn layers<'p, 'a>(
    asked: &[Layers],
    shown: &[Layer],
    parts: &'p Parts<'a>,
) -> Result<(Vec<Layer>, Option<&'p Part<'a>>), Failure> {
    let has = parts.head.layout.layers;
    let no_variance = parts.all.iter().find(|part| part.layout.lacks_variance());
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
    let wanted = |layer: &Layer| match asked {
        [] => shown.contains(layer) || has.contains(*layer),
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
    match part.layout.light {
        Some(_) => "has a light image, whose variance is unknown",
        None => "is in mode \"continuous\" and was begun without --layers variance: it lacks the sums for it",
    }
}

fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("film"))
}

pub(super) fn check_outputs(outputs: &[PathBuf]) -> Result<(), OutputError> {
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

fn merged_head(first: &Head, shown: &[Layer], sample_ranges: &SampleRanges, view: ViewTransform) -> Head {
    let ranges = || sample_ranges.whole().iter().chain(sample_ranges.open());
    let asked = ranges().map(|range| range.start).min().unwrap_or(0)
        ..ranges().map(|range| range.end).max().unwrap_or(0);
    let mut notes = Identity::default()
        .with("exposure", view.exposure)
        .with("tone", view.tone.name())
        .with("asked", format_args!("{}..{}", asked.start, asked.end));
    let layers: Vec<&str> = shown.iter().map(|layer| layer.name()).collect();
    if !layers.is_empty() {
        notes = notes.with("layers", layers.join(","));
    }
    // Films of one render have them in common.
    for name in NAMES.into_iter().chain(["parts"]) {
        if let Some(value) = first.notes.get(name) {
            notes = notes.with(name, value);
        }
    }
    Head { notes, ..first.clone() }
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
    (layers, shown): (LayerSet, &[Layer]),
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
        let names: Vec<&str> = shown.iter().map(|layer| layer.name()).collect();
        let with = if names.is_empty() { String::new() } else { format!(" --layers {}", names.join(",")) };
        writeln!(out, "missing: {} (render --range {hint}{with})", Ranges(&missing))?;
    }
    Ok(())
}
