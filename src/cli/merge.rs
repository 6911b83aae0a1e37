//! `stride merge`: films of disjoint samples add up to one, exactly.

use super::failure::{Failure, usage};
use super::render::Layers;
use crate::film::file::Head;
use crate::film::{Channel, Film, Holding, Identity, Layer, Layout, Ranges, ViewTransform};
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
    /// What to write: .film, .exr, .png or .hdr; may be given several times
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    outputs: Vec<PathBuf>,
    /// Layers that EXR files get beside colour, of those that films tell: variance, samples [default: those that the
    /// films were rendered with]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = super::render::layer)]
    layers: Vec<Layers>,
    /// Exposure of PNG in stops, instead of the films'
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = super::render::exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG, srgb or filmic, instead of the first film's
    #[arg(long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// A film whose pixels have not been read yet. The file is closed: there may be thousands.
struct Part<'a> {
    path: &'a Path,
    head: Head,
    holding: Holding,
}

impl<'a> Part<'a> {
    fn read(path: &'a Path) -> Result<Part<'a>, FilmError> {
        let file = open_film(path)?;
        Ok(Part { path, head: file.head().clone(), holding: file.holding().clone() })
    }

    /// The file again, if it is still the same film.
    fn open(&self) -> Result<FilmFile, Failure> {
        let file = open_film(self.path)?;
        if *file.head() == self.head && *file.holding() == self.holding {
            return Ok(file);
        }
        Err(anyhow::anyhow!("{:?} changed while it was read; merge again when it is finished", self.path)
            .into())
    }
}

pub(super) fn run(arguments: &MergeArguments) -> Result<(), Failure> {
    check_outputs(&arguments.outputs)?;
    refuse_inputs_as_outputs(arguments)?;
    let parts: Vec<Part<'_>> =
        arguments.films.iter().map(|path| Part::read(path)).collect::<Result<_, _>>()?;
    let Some(first) = parts.first() else { return Err(usage("there is no film to merge")) };
    let (layers, missing) = layers(&arguments.layers, &parts)?;
    let holding = join(first, &parts, arguments.outputs.iter().any(|path| is_film(path)))?;

    // One film's memory, however many there are; with what a variance takes if all of them have it.
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
    let head = Head { layout, ..merged_head(&parts, first, &holding, view) };
    write_outputs(&arguments.outputs, &head, &film, &holding, view, &layers)?;
    if !arguments.quiet {
        // Standard error may be closed: these are courtesies.
        let _ = tell(arguments, &holding, &missing, &mut std::io::stderr().lock());
    }
    Ok(())
}

/// Layers that would be written if the films told them.
struct Missing<'a> {
    /// Those that are made of the scene, which the films were rendered with.
    of_scene: Vec<Layer>,
    /// A film that has no variance, where that is wanted.
    no_variance: Option<&'a Path>,
}

/// The layers to write, and those that are missing.
fn layers<'a>(asked: &[Layers], parts: &[Part<'a>]) -> Result<(Vec<Layer>, Missing<'a>), Failure> {
    if let Some(layer) = asked.iter().filter_map(|asked| asked.0).find(|layer| !layer.is_of_film()) {
        return Err(usage(format!("a film does not tell the layer {}; {}", layer.name(), remedy(&[layer]))));
    }
    let lacking = parts.iter().find(|part| part.head.layout.weighted && !part.head.layout.spreads);
    if let Some(part) = lacking.filter(|_| asked.iter().any(|asked| asked.0 == Some(Layer::Variance))) {
        return Err(usage(format!("--layers variance: {:?} {NO_SPREADS}", part.path)));
    }
    let noted = noted_layers(parts);
    let noted = |layer: &Layer| noted.contains(layer);
    let wanted = |layer: &Layer| match asked {
        [] => noted(layer),
        asked => asked.iter().any(|asked| asked.0.is_none_or(|asked| asked == *layer)),
    };
    let told = |layer: &Layer| layer.is_of_film() && !(lacking.is_some() && *layer == Layer::Variance);
    let of_film = Layer::ALL.into_iter().filter(told).filter(wanted).collect();
    let of_scene = Layer::ALL.into_iter().filter(|layer| !layer.is_of_film() && noted(layer)).collect();
    let no_variance = lacking.filter(|_| wanted(&Layer::Variance)).map(|part| part.path);
    Ok((of_film, Missing { of_scene, no_variance }))
}

/// Why a film tells no variance.
const NO_SPREADS: &str =
    "is of mode \"continuous\" and was begun without --layers variance: it has not the sums that this takes";

/// The layers that the films were rendered with.
fn noted_layers(parts: &[Part<'_>]) -> Vec<Layer> {
    let noted = |layer: &Layer| {
        let mut notes = parts.iter().filter_map(|part| part.head.notes.get("layers"));
        notes.any(|names| names.split(',').any(|name| name == layer.name()))
    };
    Layer::ALL.into_iter().filter(noted).collect()
}

/// How to get layers that are made of the scene.
fn remedy(layers: &[Layer]) -> String {
    let names: Vec<&str> = layers.iter().map(|layer| layer.name()).collect();
    format!(
        "render SCENE --resume FILE.film --layers {} -o FILE.exr writes it all from a whole film",
        names.join(",")
    )
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

/// What is written must not replace what it was made of: merged once more, the same samples would count twice.
fn refuse_inputs_as_outputs(arguments: &MergeArguments) -> Result<(), Failure> {
    for output in &arguments.outputs {
        if let Some(film) = arguments.films.iter().find(|film| is_same_file(film, output)) {
            return Err(usage(format!(
                "-o {} would replace one of the films to merge, {}; give the sum a name of its own",
                output.display(),
                film.display()
            )));
        }
    }
    Ok(())
}

/// Whether two paths lead to one file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(a), Ok(b)) = (a.metadata(), b.metadata()) {
        use std::os::unix::fs::MetadataExt;
        return (a.dev(), a.ino()) == (b.dev(), b.ino());
    }
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// What all films hold together, if they are of one render and no sample is in two.
fn join(first: &Part<'_>, parts: &[Part<'_>], to_film: bool) -> Result<Holding, Failure> {
    let mut all = Holding::default();
    for (i, part) in parts.iter().enumerate() {
        if let Some(difference) = first.head.difference(&part.head) {
            let (path, other) = (part.path, first.path);
            return Err(anyhow::anyhow!(
                "{path:?} and {other:?} are of different renders: of the first, {difference}"
            )
            .into());
        }
        for before in &parts[..i] {
            if let Some(both) = before.holding.overlap(&part.holding) {
                let (path, other) = (before.path, part.path);
                return Err(anyhow::anyhow!(
                    "{path:?} and {other:?} both hold the samples {}; leave one of them out",
                    Ranges(&[both])
                )
                .into());
            }
            if to_film && !before.holding.can_join(&part.holding) {
                let (path, other) = (before.path, part.path);
                return Err(anyhow::anyhow!(
                    "{path:?} and {other:?} were both interrupted, and a film can say of one range only how far each pixel has come; finish one with --resume, or write a picture (-o FILE.exr)"
                )
                .into());
            }
        }
        all.join(&part.holding);
    }
    Ok(all)
}

fn merged_head(parts: &[Part<'_>], first: &Part<'_>, holding: &Holding, view: ViewTransform) -> Head {
    let ranges = || holding.whole().iter().chain(holding.open());
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
    if let Some(outline) = first.head.notes.get("parts") {
        notes = notes.with("parts", outline);
    }
    Head { notes, ..first.head.clone() }
}

/// Writes all of them, even if one fails, and returns the first error.
fn write_outputs(
    outputs: &[PathBuf],
    head: &Head,
    film: &Film,
    holding: &Holding,
    view: ViewTransform,
    layers: &[Layer],
) -> Result<(), OutputError> {
    let channels: Vec<Channel> = layers.iter().flat_map(|layer| layer.channels_of_film(film)).collect();
    let mut first_error = Ok(());
    let needs_picture = outputs.iter().any(|path| Format::of(path).is_ok());
    let picture = needs_picture.then(|| film.picture());
    let facts = session::facts(&head.identity, holding);
    for path in outputs {
        let written = match &picture {
            Some(picture) if !is_film(path) => {
                let (facts, crop) = (Some(&facts), Crop::of(&head.identity));
                let options = PictureOptions { view, facts, channels: &channels, mattes: &[], crop };
                write_picture(path, picture, &options)
            }
            _ => write_film(path, head, film, holding, None),
        };
        first_error = first_error.and(written);
    }
    first_error
}

fn tell(
    arguments: &MergeArguments,
    holding: &Holding,
    missing: &Missing<'_>,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let names: Vec<String> = arguments.outputs.iter().map(|path| path.display().to_string()).collect();
    let count = arguments.films.len();
    let films = if count == 1 { "film has" } else { "films have" };
    writeln!(out, "{count} {films} the samples {holding}; wrote {}", names.join(", "))?;
    let is_exr = |path: &PathBuf| Format::of(path).is_ok_and(|format| format == Format::Exr);
    let writes_layers = arguments.outputs.iter().any(is_exr);
    let Missing { of_scene, no_variance } = missing;
    if !of_scene.is_empty() && writes_layers {
        let names: Vec<&str> = of_scene.iter().map(|layer| layer.name()).collect();
        writeln!(out, "without the layers {}, which no film tells: {}", names.join(", "), remedy(of_scene))?;
    }
    if let Some(path) = no_variance.filter(|_| writes_layers) {
        writeln!(out, "without the layer variance: {path:?} {NO_SPREADS}")?;
    }
    let missing = holding.missing();
    if !missing.is_empty() {
        let hint = Ranges(&missing[..1]);
        writeln!(out, "missing: {} (render --range {hint})", Ranges(&missing))?;
    }
    Ok(())
}
