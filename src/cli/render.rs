//! `stride render`: arguments → checked settings → session → exit code.

use super::arguments::{SceneArguments, crop, duration, range, region};
use super::failure::{Failure, usage};
use super::stats::Stats;
use super::stop;
use super::told::told;
use crate::film::Layer;
use crate::math::lanes::Level;
use crate::output::{self, atomic};
use crate::scene::{FilmMode, Fingerprint, Scene, Tone};
use crate::session::{
    self, DeviceChoice, Devices, Job, Outputs, Report, Settings, Stopping, View, WindowChoice,
};
use crate::world::Finder;
use clap::ValueEnum;
use std::io::Write;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

#[derive(Debug, clap::Args)]
pub(super) struct RenderArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Picture to write: .png, .exr or .hdr; may be given several times [default: the scene's name with .png,
    /// in the current folder]
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,
    /// Samples a pixel, instead of the scene's: those with the numbers 0 to N − 1, also where --resume goes on with
    /// a film that begins later
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Render these samples only, for merging: 16..32 are the samples 16 to 31 of each pixel, and 16.. all from 16 on,
    /// until --time or Ctrl-C
    #[arg(long, allow_hyphen_values = true, value_name = "FIRST..END", value_parser = range, conflicts_with = "spp")]
    range: Option<Range<u32>>,
    /// Stop at a whole sample after this time (250ms, 30s, 1.5m, 2h) or at the end of --spp or --range; neither the
    /// scene's samples nor those that a resumed film was begun for count then
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = duration)]
    time: Option<Duration>,
    /// Stop when the estimated error is this small: 0.05 is a preview, 0.01 is clean; or at --spp (and say so), like
    /// --time. The error is what `stride compare` calls noise, and relative to the picture's own brightness: no unit
    /// of length or radiance matters. It is known from 16 samples a pixel on, and never of a black picture
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true, value_parser = noise, conflicts_with = "range")]
    noise: Option<f64>,
    /// Spend samples where the error is, until it is that of --noise [default: 0.01] on the whole or pixels have --spp,
    /// or the scene's samples without --noise; like adaptive = true in the scene
    #[arg(long)]
    adaptive: bool,
    /// Threads that render, 1 to 1024 [default: one a core]
    #[arg(long, allow_negative_numbers = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Part of the film to render, in pixels
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// What finds the surfaces that rays meet, on the CPU; the picture is the same [default: the faster one for
    /// as many surfaces as there are]
    #[arg(long, value_enum, value_name = "NAME")]
    world: Option<WorldName>,
    /// Who renders: cpu, gpu, all for both, or gpu:NAME and all:NAME with a GPU whose name contains NAME
    #[arg(long, value_name = "DEVICE", value_parser = device, default_value = "cpu")]
    device: DeviceChoice,
    /// Show the render in a window, or fail without a display
    #[arg(long, conflicts_with = "headless")]
    window: bool,
    /// Open no window
    #[arg(long)]
    headless: bool,
    /// Show the render in the viewer tev as well, which listens at this address: localhost:14158
    #[arg(long, value_name = "HOST:PORT", value_parser = address)]
    tev: Option<String>,
    /// Exposure of PNG and window in stops, instead of the scene's
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG and window, instead of the scene's: srgb, clipped at white, or filmic
    #[arg(long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Colour pixels by the worker that owns them (report figure 3.1)
    #[arg(long, value_enum, value_name = "NAME")]
    overlay: Option<Overlay>,
    /// Also write numbered pictures at these sample counts: 10,100,500
    #[arg(long, allow_hyphen_values = true, value_name = "N,N,…", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..))]
    dump_at: Vec<u32>,
    /// Layers that EXR files get beside colour: albedo, normal, position, depth, uv, variance,
    /// samples, crypto-entity and crypto-material (Cryptomatte), or all
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = layer)]
    layers: Vec<Layers>,
    /// Dump every sample to a NumPy file
    #[arg(long, value_name = "FILE.npy")]
    samples: Option<PathBuf>,
    /// Write a film file, which can be gone on with (--resume) and merged (stride merge)
    #[arg(long, value_name = "FILE.film")]
    film: Option<PathBuf>,
    /// How often the film file is written while the render runs [default: 60s]
    #[arg(long, allow_hyphen_values = true, value_name = "TIME", value_parser = duration)]
    checkpoint: Option<Duration>,
    /// Go on where a film stopped, and write the same film [unless --film names another]
    #[arg(long, value_name = "FILE.film")]
    resume: Option<PathBuf>,
    /// Write the figures of the run as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// How often a film file is written unless it is said.
const CHECKPOINT: Duration = Duration::from_secs(60);

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WorldName {
    /// Try every surface
    Simple,
    /// Find the way through a tree of boxes
    Bvh,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Overlay {
    /// Which worker owns a pixel
    Owner,
}

fn device(text: &str) -> Result<DeviceChoice, String> {
    let (kind, name) = match text.split_once(':') {
        Some((kind, name)) if !name.is_empty() => (kind, Some(name.to_owned())),
        Some(_) => ("", None),
        None => (text, None),
    };
    match (kind, name) {
        ("cpu", None) => Ok(DeviceChoice::Cpu),
        ("gpu", name) => Ok(DeviceChoice::Gpu(name)),
        ("all", name) => Ok(DeviceChoice::All(name)),
        _ => Err("the devices are cpu, gpu, all, gpu:NAME and all:NAME".to_owned()),
    }
}

/// One layer, or all.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layers(pub(super) Option<Layer>);

pub(super) fn layer(text: &str) -> Result<Layers, String> {
    if text == "all" {
        return Ok(Layers(None));
    }
    let known = || Layer::ALL.map(Layer::name).join(", ");
    let found = Layer::ALL.into_iter().find(|layer| layer.name() == text);
    found.map(|layer| Layers(Some(layer))).ok_or_else(|| format!("the layers are {} and all", known()))
}

/// Each once, in an order that does not depend on how they were asked for.
pub(super) fn layers(asked: &[Layers]) -> Vec<Layer> {
    let wanted = |layer: &Layer| asked.iter().any(|asked| asked.0.is_none_or(|asked| asked == *layer));
    Layer::ALL.into_iter().filter(wanted).collect()
}

fn noise(text: &str) -> Result<f64, String> {
    let error = || "an error is a number above 0 and below 1, like 0.01".to_owned();
    text.parse().ok().filter(|error: &f64| *error > 0.0 && *error < 1.0).ok_or_else(error)
}

fn address(text: &str) -> Result<String, String> {
    let parts = text.rsplit_once(':').filter(|(host, _)| !host.is_empty());
    let port = parts.and_then(|(_, port)| port.parse::<u16>().ok()).filter(|&port| port > 0);
    let address = port.map(|_| text.to_owned());
    address.ok_or_else(|| "an address is a host and a port, like localhost:14158".to_owned())
}

pub(super) fn exposure(text: &str) -> Result<f64, String> {
    let error = || "an exposure is a number of stops between −100 and 100".to_owned();
    text.parse().ok().filter(|stops: &f64| stops.abs() <= 100.0).ok_or_else(error)
}

pub(super) fn run(arguments: RenderArguments) -> Result<(), Failure> {
    let level = Level::from_environment().map_err(usage)?;
    let load_start = Instant::now();
    let (mut scene, sources) = arguments.scene.load_with_sources(arguments.quiet)?;
    let load = load_start.elapsed();
    if let Some(exposure) = arguments.exposure {
        scene.film.exposure = exposure;
    }
    if let Some(tone) = arguments.tone {
        scene.film.tone = tone;
    }
    let mut settings = settings(&arguments, scene, level)?;
    check_places(&arguments, &settings.outputs)?;
    settings.job.fingerprint = Some(Fingerprint::of(&settings.job.scene, &sources));
    if let Some(film) = &settings.outputs.film
        && arguments.resume.is_none()
        && film.exists()
        && !arguments.quiet
    {
        let film = film.display();
        let _ =
            writeln!(std::io::stderr(), "warning: {film} will be replaced; --resume goes on with it instead");
    }

    let report = told(arguments.quiet, |events| -> Result<Report, Failure> {
        let prepared = session::prepare(&settings, events)?;
        // Until here Ctrl-C ends the program at once: there is nothing to write.
        let stop =
            stop::on_interrupt().map_err(|error| anyhow::anyhow!("Ctrl-C can't be caught: {error}"))?;
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

fn settings(arguments: &RenderArguments, scene: Scene, level: Level) -> Result<Settings, Failure> {
    let finder = match arguments.world {
        None => Finder::Fastest,
        Some(WorldName::Simple) => Finder::Simple,
        Some(WorldName::Bvh) => Finder::Bvh,
    };
    let picture = region(arguments.crop, scene.film.width, scene.film.height)?;
    let resumed = arguments.resume.as_deref().map(Resumed::read).transpose()?;
    let Range { start: first, end } = samples(arguments, resumed.as_ref(), scene.render.samples)?;
    let layers = layers(&arguments.layers);
    // What a film has goes on, whatever is written this time.
    let spreads = layers.contains(&Layer::Variance) || resumed.is_some_and(|film| film.spreads);
    let spp = end - first;
    if arguments.noise.is_some() && first > 0 {
        return Err(usage("--noise tells the error of renders from sample 0 on, and this film begins later"));
    }
    let adaptive = arguments.adaptive || scene.render.adaptive;
    if adaptive {
        refuse_with_adaptive(arguments, first, scene.film.mode())?;
    }
    if let Some(late) = arguments.dump_at.iter().find(|&&at| at > spp) {
        return Err(usage(format!(
            "--dump-at {late} lies past the end of the render at {spp} samples a pixel"
        )));
    }
    let default_output =
        || arguments.scene.scene.file_stem().map(|stem| PathBuf::from(stem).with_extension("png"));
    let pictures = if arguments.outputs.is_empty() {
        vec![
            default_output()
                .ok_or_else(|| usage("the scene has no name to derive the picture's from; use -o"))?,
        ]
    } else {
        arguments.outputs.clone()
    };
    let window = match (arguments.quiet, arguments.window, arguments.headless) {
        (_, true, _) => WindowChoice::Required,
        (false, _, false) => WindowChoice::IfPossible,
        (false, _, true) | (true, ..) => WindowChoice::None,
    };
    let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
    let threads = arguments.threads.and_then(|n| NonZeroUsize::new(n.into())).unwrap_or(cores);
    let mut dump_at = arguments.dump_at.clone();
    dump_at.sort_unstable();
    dump_at.dedup();
    Ok(Settings {
        job: Job { first, spreads, ..Job::new(Arc::new(scene), picture) },
        stopping: Stopping { spp, time: arguments.time, noise: arguments.noise, adaptive },
        devices: Devices { choice: arguments.device.clone(), threads, level, finder },
        outputs: Outputs {
            pictures,
            overlay: arguments.overlay.is_some(),
            dump_at,
            layers,
            samples: arguments.samples.clone(),
            sends_samples: false,
            film: arguments.film.clone().or_else(|| arguments.resume.clone()),
            checkpoint: arguments.checkpoint.unwrap_or(CHECKPOINT),
            resume: arguments.resume.clone(),
        },
        view: View { name: arguments.scene.name(), window, tev: arguments.tev.clone() },
    })
}

/// What adaptive sampling can't be had with, and why.
fn refuse_with_adaptive(arguments: &RenderArguments, first: u32, mode: FilmMode) -> Result<(), Failure> {
    let reason = if arguments.range.is_some() || first > 0 {
        "decides where samples go by all from sample 0 on: it can't render a range of them (--range)"
    } else if !arguments.dump_at.is_empty() {
        "gives pixels different numbers of samples: there are no pictures of one number on the way (--dump-at)"
    } else if arguments.device != DeviceChoice::Cpu {
        "is the CPU's: a GPU renders the same samples for all pixels of an order; use --device cpu"
    } else if mode == FilmMode::Continuous {
        "needs pixels whose samples are their own: with mode \"continuous\" they share them; use mode \"importance\" (--film-mode importance)"
    } else {
        return Ok(());
    };
    Err(usage(format!("adaptive sampling {reason}")))
}

/// The samples that a pixel is to have: `of_scene` many where nothing says more.
fn samples(
    arguments: &RenderArguments,
    resumed: Option<&Resumed>,
    of_scene: u32,
) -> Result<Range<u32>, Failure> {
    if let Some(range) = &arguments.range {
        return Ok(range.clone());
    }
    let (first, begun_for) = resumed.map_or((0, None), |film| (film.first, film.end));
    let end = match (arguments.spp, begun_for) {
        (Some(spp), _) if spp > first => spp,
        (Some(spp), _) => {
            return Err(usage(format!(
                "--spp {spp} asks for the samples 0 to {}, and this film begins with sample {first}; to go on with it, ask for more",
                spp - 1
            )));
        }
        // With a limit of time or error alone, that decides, whatever the film was begun for.
        (None, _) if arguments.time.is_some() || arguments.noise.is_some() => u32::MAX,
        (None, Some(end)) => end,
        (None, None) => first.saturating_add(of_scene),
    };
    Ok(first..end)
}

/// What a film that is gone on with has to say about that.
struct Resumed {
    /// Its first sample.
    first: u32,
    /// The end that it was begun for, where that is known.
    end: Option<u32>,
    /// Whether it has what a variance takes where samples are weighed.
    spreads: bool,
}

impl Resumed {
    fn read(path: &Path) -> Result<Resumed, Failure> {
        let film = output::open_film(path)?;
        let asked = film.head().asked();
        let first = film.holding().start().or(asked.as_ref().map(|asked| asked.start)).unwrap_or(0);
        let end = asked.map(|asked| asked.end).filter(|&end| end > first && end < u32::MAX);
        Ok(Resumed { first, end, spreads: film.head().layout.spreads })
    }
}

/// Finds out before the render whether its files can be written after it, each in a place of its own.
fn check_places(arguments: &RenderArguments, outputs: &Outputs) -> Result<(), Failure> {
    if outputs.overlay {
        let plain = outputs
            .pictures
            .iter()
            .find(|path| !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")));
        if let Some(path) = plain {
            return Err(usage(format!(
                "--overlay colours .png files; {} would hold the picture",
                path.display()
            )));
        }
    }
    let is_exr = |path: &PathBuf| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    if !outputs.layers.is_empty() && !outputs.pictures.iter().any(is_exr) {
        return Err(usage("--layers go into .exr files, and none is written; add -o FILE.exr"));
    }
    if arguments.checkpoint.is_some() && outputs.film.is_none() {
        return Err(usage(
            "--checkpoint says how often a film file is written, and none is; add --film FILE.film",
        ));
    }
    let mut pictures = outputs.pictures.clone();
    for path in &outputs.pictures {
        pictures.extend(outputs.dump_at.iter().map(|&at| output::numbered_path(path, at)));
    }
    let scene = &arguments.scene.scene;
    let mut taken = vec![place(scene)];
    for path in pictures.iter().chain(&outputs.samples).chain(&outputs.film).chain(&arguments.stats) {
        let place = place(path);
        if taken.contains(&place) {
            return Err(usage(format!(
                "{} would be written twice, or over the scene; give each file a name of its own",
                path.display()
            )));
        }
        taken.push(place);
    }
    for path in &pictures {
        output::check_writable(path)?;
    }
    if let Some(path) = &outputs.samples {
        if outputs.resume.is_some() && path.exists() {
            return Err(usage(format!(
                "{} may hold the samples of the run that this one goes on with; give the rest a file of its own",
                path.display()
            )));
        }
        output::npy::check_writable(path)?;
    }
    if let Some(path) = &outputs.film {
        output::film::check_writable(path)?;
    }
    if let Some(path) = &arguments.stats {
        atomic::check_place(path)?;
    }
    Ok(())
}

/// Where a path leads, as far as its folder exists: two ways of writing one place are equal.
fn place(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}
