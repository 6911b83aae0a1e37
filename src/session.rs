//! Runs a render from settings to files: devices, processes, outputs.
//!
//! | file | what is in it |
//! |---|---|
//! | `settings` | the settings of a render |
//! | `worker_pool` | the workers: CPU threads, a GPU, or both |
//! | `wiring`, `process` | the processes of a render and the channels between them |
//! | `finishing` | the outputs at the end, and errors |
//! | `opening`, `camera_moves` | the window, and the renders of cameras moved in it |
//! | `gathering` | films that are gathered elsewhere: their headers and pictures |
//! | `resuming` | the film at the start of a render |
//! | `pictures`, `layers`, `identity` | picture files, their layers and their metadata |
//! | `event`, `report` | events during a render, and its result |
//!
//! This module prints nothing, and two renders in one process share nothing.

mod camera_moves;
mod error;
mod event;
mod finishing;
mod gathering;
mod identity;
mod layers;
mod opening;
mod pictures;
mod process;
mod report;
mod resuming;
mod settings;
mod wiring;
mod worker_pool;

pub use error::SessionError;
pub use event::{Conclusion, Event};
pub use gathering::{film_head, write_film_pictures};
pub use report::{Noise, Report};
pub use settings::{
    ADAPTIVE_NOISE, DeviceChoice, Devices, MOST_THREADS, Outputs, RenderJob, RenderSettings, Stopping,
    ViewerSettings, WindowChoice,
};
pub use worker_pool::CPU;

pub(crate) use identity::{NOTES, facts};
pub(crate) use report::sample_counts;

use crate::film::ViewTransform;
use crate::film::cryptomatte::Mattes;
use crate::integrator::Integrator;
use crate::output::{SampleDump, Tev};
use crate::render::accumulator::Outcome;
use crate::sampling::Sample;
use camera_moves::{CameraMoves, conclude};
use crossbeam_channel::{Receiver, Sender, never};
use finishing::write_suspended;
use identity::mattes_of;
use opening::open_window;
use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};
use wiring::{InitialFilm, Rendered, Task, Viewer, render};
use worker_pool::WorkerPool;

/// The former name of [`RenderJob`].
#[deprecated(note = "renamed to `RenderJob`")]
pub type Job = RenderJob;

/// The former name of [`RenderSettings`].
#[deprecated(note = "renamed to `RenderSettings`")]
pub type Settings = RenderSettings;

/// The former name of [`ViewerSettings`].
#[deprecated(note = "renamed to `ViewerSettings`")]
pub type View = ViewerSettings;

/// A render that is ready to run: the scene is compiled, and the devices are prepared. No file has been written yet.
pub struct Prepared<'a> {
    settings: &'a RenderSettings,
    events: Sender<Event>,
    pool: WorkerPool,
    build: Duration,
    samples: Option<Sender<Vec<Sample>>>,
}

/// Compiles the scene and prepares the devices. Requests to stop are ignored during this, so that a caller that handles
/// Ctrl-C should install its handler afterwards.
///
/// Events are sent until the render ends. The caller must either receive them or close the channel: the render waits
/// for a full channel.
pub fn prepare(settings: &RenderSettings, events: Sender<Event>) -> Result<Prepared<'_>, SessionError> {
    let build_start = Instant::now();
    let pool = WorkerPool::new(settings, &events, &never())?;
    Ok(Prepared { settings, events, pool, build: build_start.elapsed(), samples: None })
}

/// The compiled scene of a render, for further renders of the same scene and camera. Only CPU threads can share it.
#[derive(Clone, Default)]
pub struct CompiledScene(Option<Arc<dyn Integrator>>);

/// The same as [`prepare`] for a scene that an earlier render has compiled.
pub fn prepare_again<'a>(
    settings: &'a RenderSettings,
    compiled: &CompiledScene,
    events: Sender<Event>,
) -> Result<Prepared<'a>, SessionError> {
    let build_start = Instant::now();
    let shared = compiled.0.as_ref().filter(|_| settings.devices.choice == DeviceChoice::Cpu);
    let pool = WorkerPool::for_other_camera(settings, shared, &events, &never())?;
    Ok(Prepared { settings, events, pool, build: build_start.elapsed(), samples: None })
}

/// Prepares and runs a render. Any failure is an error.
pub fn run(
    settings: &RenderSettings,
    events: Sender<Event>,
    stop: &Receiver<Infallible>,
) -> Result<Report, SessionError> {
    let mut report = prepare(settings, events)?.run(stop)?;
    report.problem.take().map_or(Ok(report), Err)
}

impl Prepared<'_> {
    /// The compiled scene, for [`prepare_again`].
    pub fn compiled(&self) -> CompiledScene {
        CompiledScene(self.pool.integrator())
    }

    /// Also sends every sample of this run, each (pixel, sample) once and in any order. The render waits until they are
    /// received, and ends if their channel is closed. [`Outputs::sends_samples`] must be set.
    pub fn sending(self, samples: Sender<Vec<Sample>>) -> Self {
        Prepared { samples: Some(samples), ..self }
    }

    /// Renders. Closing `stop` ends the render with the samples made so far. A failure after the first sample is
    /// returned in [`Report::problem`].
    ///
    /// If the camera is moved in the window, the render of the scene's own camera is suspended. It is resumed when the
    /// user returns to that camera, and written at the end.
    ///
    /// Must run on the main thread if a window may open.
    pub fn run(self, stop: &Receiver<Infallible>) -> Result<Report, SessionError> {
        let Prepared { settings, events, pool, build, samples } = self;
        let (device, devices, threads) = (pool.description(), pool.devices(), pool.workers());
        let integrator = pool.integrator();
        let head = identity::head(settings, &device);
        identity::check_film(settings, &head)?;
        let dumped = identity::dumped(settings, &head);
        let (film, milestone) = resuming::first_film(settings, &head)?;
        let (shown, view) = (settings.job.shown, &settings.view);
        let tev = view.tev.as_deref().map(|at| Tev::connect(at, &view.name, shown.width, shown.height));
        let tev = tev.transpose()?;
        let mut window = open_window(settings, integrator.as_deref())?;
        let dump = settings.outputs.samples.as_deref();
        let dump = dump.map(|path| SampleDump::create(path, &dumped)).transpose()?;

        let initial = InitialFilm { film, milestone, spent: Duration::ZERO };
        let task = Task { settings, pool, head: &head, initial, dump, samples, tev };
        let viewer = window.as_mut().map(|window| window as &mut dyn Viewer);
        let mut own = render(task, viewer, &events, stop)?;
        let mut followed = Ok(());
        if let Some(window) = window.as_mut().filter(|_| own.problem.is_none()) {
            let (device, integrator, events) = (&*device, integrator.as_ref(), &events);
            let moves = CameraMoves { settings, head: &head, device, integrator, events, stop };
            followed = moves.follow(&mut own, window);
        }
        if own.is_suspended {
            write_suspended(settings, &head, (&own.outcome, &own.picture), &events)?;
        } else if own.problem.is_none()
            && let Err(error) = followed
        {
            // The film belongs to the resumed render, which has failed.
            return Err(error);
        }
        let Conclusion { noise, is_noise_asked, .. } = conclude(settings, &own, &events);
        let Rendered { outcome, picture, layers, problem, .. } = own;
        let spp_range = outcome.film.seen_range();
        let mattes = Mattes::of(&settings.job.scene);
        let facts = facts(&head.identity, &settings.sample_ranges(spp_range));
        let Outcome { totals, whole, lost, made, .. } = outcome;
        let made = |workers: Range<usize>| made[workers].iter().sum();
        Ok(Report {
            totals,
            noise: noise.filter(|_| is_noise_asked),
            spp_range,
            whole,
            device,
            devices: devices.into_iter().map(|(name, workers)| (name, made(workers))).collect(),
            lost: lost.first().map(ToString::to_string),
            threads,
            build,
            picture,
            layers,
            facts,
            view: ViewTransform::of(&settings.job.scene.film),
            mattes: mattes_of(&settings.outputs.layers, &mattes).into_iter().cloned().collect(),
            problem: problem.or(followed.err()),
        })
    }
}
