//! `stride render`: arguments → a render, which checks them → session → exit code.

use super::arguments::{SCENE_HEADING, SceneArguments, crop, duration, range};
use super::events::print_events;
use super::failure::{Failure, usage};
use super::stats::Stats;
use super::stop;
use crate::api::Render;
use crate::film::{LAYER_SAMPLES, Layer};
use crate::math::lanes::Level;
use crate::output::atomic;
use crate::scene::{EXPOSURES, Loaded, Scene, Sources, Tone};
use crate::session::{self, DeviceChoice, MOST_THREADS, Report, ViewerSettings, WindowChoice};
use crate::world::AcceleratorChoice;
use clap::ValueEnum;
use std::io::Write;
use std::ops::Range;
use std::path::PathBuf;
use std::time::{Duration, Instant};

// Headings of options in the help text.
const END: &str = "End of the render";
const FILES: &str = "Files";
const DEVICES: &str = "Devices";
const VIEWERS: &str = "Viewers";

#[derive(Clone, Debug, clap::Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    pub(super) scene: SceneArguments,
    /// Picture to write: .png, .exr or .hdr; may be given several times [default: the scene's name with .png,
    /// in the current folder; none for a --range that is rendered to a --film]
    #[arg(help_heading = FILES, short, long = "output", value_name = "FILE")]
    pub(super) outputs: Vec<PathBuf>,
    /// Samples per pixel, instead of the scene's: those with the indices 0 to N − 1, even if --resume continues a film
    /// that begins later
    #[arg(help_heading = END, long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,
    /// Render only these samples, for merging: 16..32 are the samples 16 to 31 of each pixel, and 16.. all from 16 on
    /// until --time or Ctrl-C
    #[arg(help_heading = END, long, allow_hyphen_values = true, value_name = "FIRST..END", value_parser = range, conflicts_with = "spp")]
    pub(super) range: Option<Range<u32>>,
    /// Stop at a whole sample after this time (250ms, 30s, 1.5m, 2h), or at the end of --spp or --range. The scene's
    /// samples and those requested for a resumed film are ignored
    #[arg(help_heading = END, long, value_name = "TIME", allow_hyphen_values = true, value_parser = duration)]
    time: Option<Duration>,
    /// Stop when the estimated error is this small: 0.05 is a preview, 0.01 is clean. The render also ends at --spp or
    /// --time, with a warning; the scene's samples are ignored. The error is the noise of `stride compare`, relative to
    /// the picture's brightness, so that units of length and radiance do not matter. The estimate starts at 16 samples
    /// per pixel. A black picture has none
    #[arg(help_heading = END, long, value_name = "ERROR", allow_negative_numbers = true, value_parser = error, conflicts_with = "range")]
    noise: Option<f64>,
    /// Distribute samples by error, until the picture has the error of --noise [default: 0.01] or pixels have --spp
    /// samples. Without --noise, the scene's samples are the limit. Same as adaptive = true in the scene
    #[arg(help_heading = END, long)]
    adaptive: bool,
    #[arg(help_heading = DEVICES, long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=i64::from(MOST_THREADS)),
        help = format!("Rendering threads, 1 to {MOST_THREADS} [default: one per core]"))]
    threads: Option<u16>,
    /// Part of the film to render, in pixels
    #[arg(help_heading = SCENE_HEADING, long, allow_hyphen_values = true, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// Acceleration structure on the CPU; it does not affect the picture [default: the faster one for the number of
    /// surfaces]
    #[arg(help_heading = DEVICES, long, value_enum, value_name = "NAME")]
    world: Option<WorldName>,
    /// Device that renders: cpu, gpu, or all for both; gpu:NAME and all:NAME select a GPU whose name contains NAME
    #[arg(help_heading = DEVICES, long, value_name = "DEVICE", value_parser = device, default_value = "cpu")]
    device: DeviceChoice,
    /// Show the render in a window; fail if there is no display
    #[arg(help_heading = VIEWERS, long, conflicts_with = "headless")]
    window: bool,
    /// Open no window
    #[arg(help_heading = VIEWERS, long)]
    headless: bool,
    /// Also show the render in the viewer tev at this address: localhost:14158
    #[arg(help_heading = VIEWERS, long, value_name = "HOST:PORT", value_parser = address)]
    tev: Option<String>,
    /// Exposure of PNG files and the window in stops, instead of the scene's
    #[arg(help_heading = SCENE_HEADING, long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG files and the window, instead of the scene's: srgb (clamped at white) or filmic
    #[arg(help_heading = SCENE_HEADING, long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Colour pixels of PNG files by the worker that renders them
    #[arg(help_heading = FILES, long, value_enum, value_name = "NAME")]
    overlay: Option<Overlay>,
    /// Also write numbered pictures at these numbers of samples: 10,100,500
    #[arg(help_heading = FILES, long, allow_hyphen_values = true, value_name = "N,N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    dump_at: Vec<u32>,
    /// Layers for EXR files and films: albedo, normal, position, depth, uv, variance, samples, crypto-entity and
    /// crypto-material (Cryptomatte), or all. Layers other than variance and samples use only the samples 0 to 31 of
    /// each pixel [default: none; with --resume those that the film was last rendered with]
    #[arg(help_heading = FILES, long, value_name = "NAME,…", value_delimiter = ',', value_parser = layer)]
    layers: Vec<Layers>,
    /// Write every sample to a NumPy file
    #[arg(help_heading = FILES, long, value_name = "FILE.npy")]
    samples: Option<PathBuf>,
    /// Write a film file, for resuming (--resume) and merging (stride merge)
    #[arg(help_heading = FILES, long, value_name = "FILE.film")]
    pub(super) film: Option<PathBuf>,
    /// Resume the film of --film if it exists, and begin it otherwise, so that the same command starts a render and
    /// continues it
    #[arg(help_heading = FILES, long = "continue", requires = "film", conflicts_with = "resume")]
    continues: bool,
    /// Interval at which the film file is written during the render [default: 60s]
    #[arg(help_heading = FILES, long, allow_hyphen_values = true, value_name = "TIME", value_parser = duration)]
    checkpoint: Option<Duration>,
    /// Resume the render of a film file, which is also written unless --film names another
    #[arg(help_heading = FILES, long, value_name = "FILE.film")]
    resume: Option<PathBuf>,
    /// Write statistics of the run as JSON
    #[arg(help_heading = FILES, long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Print only errors and warnings about the result
    #[arg(short, long)]
    pub(super) quiet: bool,
}

impl RenderArguments {
    /// The film file to resume.
    fn resumed(&self) -> Option<&PathBuf> {
        let continued = self
            .film
            .as_ref()
            .filter(|film| self.continues && !film.try_exists().is_ok_and(|exists| !exists));
        self.resume.as_ref().or(continued)
    }

    /// Whether only a film is written: a picture of some of the samples is written on request only.
    fn is_film_only(&self) -> bool {
        let is_part = self.range.is_some() && self.film.is_some();
        is_part && self.outputs.is_empty() && self.dump_at.is_empty()
    }

    /// The picture files to write, by default the scene's name with .png.
    pub(super) fn pictures(&self) -> Result<Vec<PathBuf>, Failure> {
        if !self.outputs.is_empty() {
            return Ok(self.outputs.clone());
        }
        let stem = self.scene.scene.file_stem();
        let stem = stem
            .ok_or_else(|| usage("the scene file has no name from which to derive the picture's; use -o"))?;
        Ok(vec![PathBuf::from(stem).with_extension("png")])
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WorldName {
    /// Test rays against every surface
    Simple,
    /// Bounding volume hierarchy
    Bvh,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Overlay {
    /// The worker that renders each pixel
    Owner,
}

pub(super) fn device(text: &str) -> Result<DeviceChoice, String> {
    let (kind, name) = match text.split_once(':') {
        Some((kind, name)) if !name.is_empty() => (kind, Some(name.to_owned())),
        Some(_) => ("", None),
        None => (text, None),
    };
    match (kind, name) {
        ("cpu", None) => Ok(DeviceChoice::Cpu),
        ("gpu", name) => Ok(DeviceChoice::Gpu(name)),
        ("all", name) => Ok(DeviceChoice::All(name)),
        _ => Err("a device is cpu, gpu, all, gpu:NAME or all:NAME".to_owned()),
    }
}

/// One layer, or all (`None`).
#[derive(Clone, Copy, Debug)]
pub(super) struct Layers(pub(super) Option<Layer>);

pub(super) fn layer(text: &str) -> Result<Layers, String> {
    if text == "all" {
        return Ok(Layers(None));
    }
    let known = || Layer::ALL.map(Layer::name).join(", ");
    let found = Layer::ALL.into_iter().find(|layer| layer.name() == text);
    found.map(|layer| Layers(Some(layer))).ok_or_else(|| format!("a layer is one of {}, or all", known()))
}

/// The layers without duplicates, in an order that does not depend on the request.
pub(super) fn layers(asked: &[Layers]) -> Vec<Layer> {
    let wanted = |layer: &Layer| asked.iter().any(|asked| asked.0.is_none_or(|asked| asked == *layer));
    Layer::ALL.into_iter().filter(wanted).collect()
}

fn address(text: &str) -> Result<String, String> {
    let parts = text.rsplit_once(':').filter(|(host, _)| !host.is_empty());
    let port = parts.and_then(|(_, port)| port.parse::<u16>().ok()).filter(|&port| port > 0);
    let address = port.map(|_| text.to_owned());
    address.ok_or_else(|| "an address is HOST:PORT, like localhost:14158".to_owned())
}

pub(super) fn error(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "an error is a number above 0 and below 1, like 0.01".to_owned())
}

pub(super) fn exposure(text: &str) -> Result<f64, String> {
    let stops = text.parse().map_err(|_| "an exposure is a number of stops, like 1.5".to_owned())?;
    EXPOSURES.objection(stops).map_or(Ok(stops), |objection| Err(format!("an exposure in stops {objection}")))
}

pub(super) fn run(arguments: RenderArguments) -> Result<(), Failure> {
    let level = Level::from_environment().map_err(usage)?;
    let load_start = Instant::now();
    let Loaded { scene, sources, crop, .. } = arguments.scene.load_whole(arguments.quiet)?;
    let load = load_start.elapsed();
    let settings = asked(&arguments, &scene, sources, crop, level)?.settings()?;
    if let Some(film) = &settings.outputs.film
        && settings.outputs.resume.is_none()
        && film.exists()
        && !arguments.quiet
    {
        let film = film.display();
        let _ = writeln!(std::io::stderr(), "warning: {film} will be replaced; use --resume to continue it");
    }
    let layers = settings.job.layers;
    if !layers.is_empty() && settings.range().start >= LAYER_SAMPLES && !arguments.quiet {
        let last = LAYER_SAMPLES - 1;
        let until = match &settings.outputs.film {
            Some(_) => " until its film is merged with films of these samples",
            None => "; add --film to merge them with films of these samples",
        };
        let _ = writeln!(
            std::io::stderr(),
            "warning: the layers {layers} use only the samples 0 to {last}, which this render does not make: they stay empty{until}"
        );
    }

    let report = print_events(arguments.quiet, |events| -> Result<Report, Failure> {
        let prepared = session::prepare(&settings, events)?;
        // Until here Ctrl-C ends the program at once: there is nothing to write.
        let stop = stop::handler()?;
        Ok(prepared.run(&stop)?)
    })?;
    if let Some(path) = &arguments.stats {
        let stats = Stats::new(&report, load, level.to_string(), &settings.devices.choice);
        atomic::write_atomically(path, |out| {
            serde_json::to_writer_pretty(&mut *out, &stats)?;
            out.write_all(b"\n")
        })?;
    }
    report.problem.map_or(Ok(()), |problem| Err(problem.into()))
}

/// The requested render. Without outputs it writes the scene's name with .png, or nothing but the film of a range.
pub(super) fn asked(
    arguments: &RenderArguments,
    scene: &Scene,
    sources: Sources,
    crop: Option<[u32; 4]>,
    level: Level,
) -> Result<Render, Failure> {
    let layers = layers(&arguments.layers);
    let is_exr = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let resumed = arguments.resumed();
    let keeps_layers = arguments.film.is_some() || resumed.is_some() || arguments.outputs.iter().any(is_exr);
    if !layers.is_empty() && !keeps_layers {
        return Err(usage("--layers needs an .exr file or a film; add -o FILE.exr or --film FILE.film"));
    }
    let window = match (arguments.quiet, arguments.window, arguments.headless) {
        (_, true, _) => WindowChoice::Required,
        (false, _, false) => WindowChoice::IfPossible,
        (false, _, true) | (true, ..) => WindowChoice::None,
    };
    let render = Render::new(scene)
        .sources(sources)
        .exposure(arguments.exposure)
        .tone(arguments.tone)
        .crop(arguments.crop.or(crop))
        .samples(arguments.spp)
        .range(arguments.range.clone())
        .time(arguments.time)
        .noise(arguments.noise)
        .adaptive(arguments.adaptive.then_some(true))
        .threads(arguments.threads.map(usize::from))
        .level(level)
        .world(match arguments.world {
            None => AcceleratorChoice::Fastest,
            Some(WorldName::Simple) => AcceleratorChoice::Simple,
            Some(WorldName::Bvh) => AcceleratorChoice::Bvh,
        })
        .device(arguments.device.clone())
        .overlay(arguments.overlay.is_some())
        .dump_at(arguments.dump_at.iter().copied())
        .layers(layers)
        .checkpoint(arguments.checkpoint)
        .keep(&arguments.scene.scene)
        .view(ViewerSettings { name: arguments.scene.name(), window, tev: arguments.tev.clone() });
    let outputs = if arguments.is_film_only() { Vec::new() } else { arguments.pictures()? };
    let render = outputs.into_iter().fold(render, Render::output);
    let render = arguments.samples.iter().fold(render, Render::sample_file);
    let render = arguments.film.iter().fold(render, Render::film);
    let render = resumed.into_iter().fold(render, Render::resume);
    Ok(arguments.stats.iter().fold(render, Render::beside))
}
