//! `stride submit`: a job for the workers of a NATS server.

use super::arguments::{SceneArguments, crop, duration};
use super::broker::{BrokerArguments, Notices, default_cache};
use super::failure::{Failure, usage};
use super::render::{Layers, device, error, exposure, layer, layers};
use super::stop;
use crate::fleet::{self, Collecting, JobSettings, Submission};
use crate::scene::{Choice, Tone};
use crate::session::DeviceChoice;
use std::path::PathBuf;
use std::time::Duration;

#[derive(Debug, clap::Args)]
pub(super) struct SubmitArguments {
    #[command(flatten)]
    job: JobArguments,
    #[command(flatten)]
    broker: BrokerArguments,
    /// Return as soon as the job is on the server; collect it with stride jobs collect, which has the options of outputs
    #[arg(long, conflicts_with_all = ["outputs", "film", "checkpoint"])]
    detach: bool,
}

/// A job: the scene and its settings, the outputs, and how workers share it.
#[derive(Debug, clap::Args)]
pub(super) struct JobArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    outputs: OutputArguments,
    /// Samples per pixel, instead of the scene's
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    /// Stop when the estimated error is this small, at the sample where one machine would stop
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true, value_parser = error)]
    noise: Option<f64>,
    /// Part of the film to render, in pixels
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y,W,H", value_parser = crop)]
    crop: Option<[u32; 4]>,
    /// Layers for EXR files and films, as in stride render
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = layer)]
    layers: Vec<Layers>,
    /// Exposure of PNG files in stops, instead of the scene's
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<f64>,
    /// Tone curve of PNG files, srgb or filmic, instead of the scene's
    #[arg(long, value_name = "NAME")]
    tone: Option<Tone>,
    /// Device of the samples: cpu, gpu, all, gpu:NAME or all:NAME. All samples of a job come from equal devices
    #[arg(long, value_name = "DEVICE", value_parser = device, default_value = "cpu")]
    device: DeviceChoice,
    /// Priority: jobs with a higher number are rendered first
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 0)]
    priority: i32,
    /// Share of the units that two workers render, to compare their results: 0.01 is one in a hundred
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = share, default_value = "0")]
    verify: f64,
    /// Time after which the unit of a silent worker is given to another one
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = duration, default_value = "30s")]
    patience: Duration,
    /// Rendering time of a unit
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = duration, default_value = "10s")]
    unit: Duration,
    /// Print only errors and warnings about the result
    #[arg(short, long)]
    quiet: bool,
}

/// The outputs of a job.
#[derive(Debug, clap::Args)]
pub(super) struct OutputArguments {
    /// Picture to write: .png, .exr or .hdr; may be given several times
    #[arg(short, long = "output", value_name = "FILE")]
    outputs: Vec<PathBuf>,
    /// Write the film file, which is also the checkpoint from which a job is collected further [default: a file beside
    /// the first picture, removed at the end]
    #[arg(long, value_name = "FILE.film")]
    film: Option<PathBuf>,
    /// Interval of checkpoints
    #[arg(long, allow_hyphen_values = true, value_name = "TIME", value_parser = duration, default_value = "60s")]
    checkpoint: Duration,
    /// Folder with the files of scenes [default: stride in the user's cache folder]
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,
}

impl OutputArguments {
    /// What is collected; with a picture of this name if nothing else is named.
    pub(super) fn collecting(&self, default: Option<PathBuf>) -> Collecting {
        let is_empty = self.outputs.is_empty() && self.film.is_none();
        Collecting {
            pictures: self.outputs.iter().cloned().chain(default.filter(|_| is_empty)).collect(),
            film: self.film.clone(),
            checkpoint: self.checkpoint,
            cache: self.cache.clone().unwrap_or_else(default_cache),
        }
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "a share is a number from 0 to 1, like 0.01".to_owned())
}

impl JobArguments {
    pub(super) fn quiet(&self) -> bool {
        self.quiet
    }

    pub(super) fn submission(&self, is_detached: bool) -> Result<Submission, Failure> {
        let SceneArguments { scene, reading, seed, size, integrator, sampler, max_depth, filter, film_mode } =
            &self.scene;
        if self.outputs.outputs.is_empty() && scene.file_stem().is_none() {
            return Err(usage("the scene file has no name from which to derive the picture's; use -o"));
        }
        let default = scene.file_stem().map(|stem| PathBuf::from(stem).with_extension("png"));
        let named = |name: &'static str| name.to_owned();
        Ok(Submission {
            scene: scene.clone(),
            is_strict: reading.strict,
            allow_outside: reading.allow_outside,
            settings: JobSettings {
                defines: reading.defines.clone(),
                camera: reading.camera.clone(),
                size: *size,
                seed: *seed,
                integrator: integrator.map(|it| named(it.name())),
                sampler: sampler.as_ref().map(|it| named(it.first().name())),
                max_depth: *max_depth,
                filter: filter.map(|it| named(it.name())),
                film_mode: film_mode.map(|it| named(it.name())),
                exposure: self.exposure,
                tone: self.tone.map(|it| named(it.name())),
                crop: self.crop,
                layers: layers(&self.layers).iter().map(|layer| layer.name().to_owned()).collect(),
            },
            spp: self.spp,
            noise: self.noise,
            device: self.device.clone(),
            priority: self.priority,
            verify: self.verify,
            patience: self.patience,
            unit: self.unit,
            is_detached,
            collecting: self.outputs.collecting(default),
        })
    }
}

pub(super) fn run(arguments: &SubmitArguments) -> Result<(), Failure> {
    let submission = arguments.job.submission(arguments.detach)?;
    let stop = stop::handler()?;
    let mut notices = Notices::new(arguments.job.quiet);
    let server = arguments.broker.server();
    let id = fleet::submit(&server, &submission, &stop, &mut |notice| notices.tell(notice))?;
    if arguments.detach {
        super::print::print(&format!("{id}\n"))?;
    }
    Ok(())
}
