//! The wiring diagram: creates the channels and starts everybody.
//!
//! ```text
//!  workers ──SampleBatch──▶ accumulator ──samples──▶ dump        (without loss)
//!     ▲                        │  │ │├────pieces───▶ film file   (when it is due)
//!     │                        │  │ └┴───barriers─▶ pictures    (without loss)
//!     └────────orders──────────┘  ├────snapshots──▶ window, tev (frames may drop)
//!                                 └────progress───▶ terminal    (frames may drop)
//! ```
//!
//! Workers are CPU threads, a GPU, or both (`crew.rs`). If a GPU is lost beside threads, these hear what pixels have and
//! get its orders.
//!
//! What the window saves and what is written at the end are the same files: the finisher tells the saver that the
//! end is coming, and writes when the saver waits for it.
//!
//! Every arrow is a bounded channel. Ctrl-C closes the `stop` channel, a viewer or a sink that goes away
//! closes its own, and either makes the accumulator stop; it closes the orders and asks the workers to stop, which they
//! look for at each bounce. One that does not end is abandoned: its thread belongs to nobody, and ends with the program.
//!
//! Where the window moves the camera, all this is wired up again for each place that the scene is seen from.

use crate::film::cryptomatte::Mattes;
use crate::film::file::Head;
use crate::film::noise::{FIRST_MILESTONE, brightness};
use crate::film::{
    Channel, Film, Layer, Layout, MemoryError, Milestone, Picture, Rectangle, Reject, ViewTransform,
};
use crate::gpu;
use crate::integrator::{Integrator, Paths};
use crate::math::lanes::Level;
use crate::output::window::orbit::Orbit;
use crate::output::window::{self, Feed, Left, Window, WindowOptions};
use crate::output::{FilmError, OutputError, Progress, Reporter, SampleDump, Tev, TevError, tev};
use crate::render::accumulator::{Inbox, Outbox, Outcome, Totals, Unanswered, WorkerFailure};
use crate::render::schedule::GRACE;
use crate::render::{Accumulator, Barrier, Held, Region, Schedule, first_hit_layers, layer_samples};
use crate::scene::{FilmMode, Fingerprint, Scene};
use crate::world::Finder;
use crew::Crew;
use crossbeam_channel::{Receiver, bounded, select};
use keeping::Written;
use std::convert::Infallible;
use std::fmt;
use std::io::Write;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

mod crew;
mod keeping;

pub(crate) use keeping::{NOTES, facts};

/// Everything that a render is asked for, checked.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What the window and the progress call it.
    pub name: String,
    /// The scene, with whatever the command line changed in it.
    pub scene: Arc<Scene>,
    /// The part of the film that is rendered.
    pub region: Region,
    /// The part of that which becomes the picture: around it are pixels whose samples reach into it.
    pub shown: Rectangle,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// Samples a pixel, unless the time is up before.
    pub spp: u32,
    /// Stop at the first whole sample after this long.
    pub time: Option<Duration>,
    /// Stop when the estimated error, √relMSE_scaled without the worst 0.5% of pixels, is this small.
    pub noise: Option<f64>,
    /// Spend samples where the error is, `spp` of them a pixel at most.
    pub adaptive: bool,
    /// CPU workers.
    pub threads: NonZeroUsize,
    /// Which lanes they use.
    pub level: Level,
    /// What finds the surfaces that rays meet, on the CPU.
    pub finder: Finder,
    /// Who renders.
    pub device: DeviceChoice,
    /// Picture files.
    pub outputs: Vec<PathBuf>,
    /// Sample counts to write numbered pictures at.
    pub dump_at: Vec<u32>,
    /// Layers that EXR files get beside colour, at the end.
    pub layers: Vec<Layer>,
    /// Keep what a variance takes where samples are weighed, which costs memory and time.
    pub spreads: bool,
    /// Where every sample goes, if anywhere.
    pub samples: Option<PathBuf>,
    /// A film file to write, for going on and merging, if any.
    pub film: Option<PathBuf>,
    /// How often it is written while the render runs.
    pub checkpoint: Duration,
    /// The film file of a run that this one goes on with.
    pub resume: Option<PathBuf>,
    /// What tells the scene from others, where films or pictures are to say so.
    pub fingerprint: Option<Fingerprint>,
    /// Show which worker owns each pixel instead of what it saw: in the pictures, which then have to be PNG
    /// files, and at first in the window.
    pub overlay: bool,
    /// What people see of it.
    pub view: View,
    /// The camera as it stands in a scene file, where it is not the scene's own: it was moved in the window.
    pub moved: Option<String>,
    /// The host and port of a tev that shows it, too.
    pub tev: Option<String>,
}

impl Settings {
    /// What the film's words are.
    pub fn layout(&self) -> Layout {
        let (Region { width, height, .. }, shown) = (self.region, self.shown);
        let weighted = self.scene.film.mode() == FilmMode::Continuous;
        Layout { width, height, weighted, spreads: weighted && self.spreads, shown }
    }

    /// The part of the film that becomes the picture.
    pub fn picture_region(&self) -> Region {
        let (Region { film_width, x, y, .. }, shown) = (self.region, self.shown);
        Region { film_width, x: x + shown.x, y: y + shown.y, width: shown.width, height: shown.height }
    }

    /// The indices of each pixel's samples.
    pub fn range(&self) -> Range<u32> {
        self.first..self.first.saturating_add(self.spp)
    }

    /// The error at which the render ends, if it does at one.
    pub fn goal(&self) -> Option<f64> {
        self.noise.or(self.adaptive.then_some(ADAPTIVE_NOISE))
    }
}

/// The error that adaptive sampling ends at unless another is asked for.
pub const ADAPTIVE_NOISE: f64 = 0.01;

/// Who renders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The CPU.
    Cpu,
    /// A GPU, of this name if one is given.
    Gpu(Option<String>),
    /// The CPU and a GPU, likewise.
    All(Option<String>),
}

/// What people see of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// A window, or an error without a display.
    Window,
    /// A window where there is a display, progress elsewhere.
    WindowIfPossible,
    /// Progress on the terminal.
    Progress,
    /// Nothing.
    Quiet,
}

/// What a render came to.
#[derive(Clone, Debug)]
pub struct Report {
    /// The figures.
    pub totals: Totals,
    /// What became of the error that was asked for.
    pub noise: Option<Noise>,
    /// The fewest and the most samples that a pixel has.
    pub spp_range: [u64; 2],
    /// Whether every pixel has the same number of samples.
    pub whole: bool,
    /// What rendered.
    pub device: String,
    /// Each device, and how many samples it made.
    pub devices: Vec<(String, u64)>,
    /// What became of a device that was lost on the way.
    pub lost: Option<String>,
    /// Threads that rendered.
    pub threads: usize,
    /// Time to compile the scene.
    pub build: Duration,
    /// The picture.
    pub picture: Picture,
}

/// What became of an error that a render was to end at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The error that was asked for.
    pub asked: f64,
    /// The error by estimate, where there were samples enough for one.
    pub estimated: Option<f64>,
    /// Samples that every pixel has.
    pub spp: u32,
    /// Whether the picture has no brightness that an error could be relative to.
    pub is_black: bool,
}

impl Noise {
    fn of(asked: f64, outcome: &Outcome) -> Noise {
        let Totals { noise, spp, .. } = outcome.totals;
        let is_black = noise.is_none() && brightness(&outcome.film.picture().rgb) == 0.0;
        Noise { asked, estimated: noise.map(|[now, _]| now), spp, is_black }
    }

    /// Whether it is as small as was asked for, as far as is known.
    pub fn reached(&self) -> bool {
        self.estimated.is_some_and(|estimated| estimated <= self.asked)
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Noise { asked, estimated, spp, is_black } = *self;
        let least = 2 * FIRST_MILESTONE;
        match estimated {
            Some(now) if self.reached() => {
                write!(f, "the error is {now:.5} by estimate; {asked} was asked for")
            }
            Some(now) => write!(
                f,
                "the error that was asked for, {asked}, is not reached: it is {now:.5} by estimate at {spp} samples a pixel"
            ),
            None if is_black && spp >= least => write!(
                f,
                "whether the error that was asked for, {asked}, is reached is not known: errors are relative to the picture's brightness, and the picture is black"
            ),
            None => write!(
                f,
                "whether the error that was asked for, {asked}, is reached is not known: an estimate takes {least} samples a pixel, and the render ended at {spp}"
            ),
        }
    }
}

/// Why a render failed. Whatever was rendered has been written all the same.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The film is too large.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// There is no window.
    #[error(transparent)]
    Window(#[from] window::WindowError),
    /// There is no tev.
    #[error(transparent)]
    Tev(#[from] TevError),
    /// The GPU can't do it.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// A file can't be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A film can't be read.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A film is not one of this render.
    #[error("cannot go on with {path:?}: {reason}")]
    Resume {
        /// The film.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// The device that a render was begun on is gone, and there is another.
    #[error("the render was begun on {begun}, and now there is {found}: it can't be gone on with here")]
    OtherDevice {
        /// What it was begun on.
        begun: String,
        /// What is there.
        found: String,
    },
    /// A worker failed.
    #[error("{0}; {1}")]
    Worker(WorkerFailure, String),
    /// A worker did not stop when it was asked to.
    #[error("{0}; {1}")]
    Unanswered(String, String),
    /// A process failed that should not.
    #[error("the {0} failed; this is a bug in stride: please report it with the scene and the command")]
    Process(&'static str),
}

/// Renders. Closing `stop` ends the render with what there is.
///
/// Where the camera is moved in the window, the render of the scene's own camera is set aside, to be gone on with
/// when that is wanted back, and is written in the end.
///
/// Must run on the main thread if a window may open.
pub fn run(settings: &Settings, stop: &Receiver<Infallible>) -> Result<Report, SessionError> {
    let build_start = Instant::now();
    let crew = Crew::new(settings)?;
    let build = build_start.elapsed();
    let (device, devices, threads) = (crew.description(), crew.devices(), crew.workers());
    let integrator = crew.integrator();
    let head = keeping::head(settings, &device);
    keeping::check_film(settings, &head)?;
    let dumped = keeping::dumped(settings, &head);
    let (film, milestone) = keeping::first_film(settings, &head)?;
    let shown = settings.shown;
    let tev = settings.tev.as_deref().map(|at| Tev::connect(at, &settings.name, shown.width, shown.height));
    let tev = tev.transpose()?;
    let mut window = open_window(settings, integrator.as_deref())?;
    let dump = settings.samples.as_deref().map(|path| SampleDump::create(path, &dumped)).transpose()?;

    let begun = Begun { film, milestone, spent: Duration::ZERO };
    let task = Task { settings, crew, head: &head, begun, dump, tev };
    let mut own = render(task, window.as_mut(), stop)?;
    let mut toured = Ok(());
    if let Some(window) = &mut window {
        toured = tour(settings, (&head, &device), &mut own, integrator.as_ref(), window, stop);
    }
    if own.is_aside {
        write_aside(settings, &head, &own)?;
    }
    warn_of_faint(settings, &own.outcome);
    let noise = warn_of_noise(settings, &own.outcome);
    if settings.view != View::Quiet {
        // Standard error may be closed: these are courtesies.
        let _ = tell(settings, &own.outcome, &mut std::io::stderr().lock());
    }
    toured?;
    let Rendered { outcome, picture, .. } = own;
    let spp_range = outcome.film.seen_range();
    let Outcome { totals, whole, lost, made, .. } = outcome;
    let made = |workers: Range<usize>| made[workers].iter().sum();
    let devices = devices.into_iter().map(|(name, workers)| (name, made(workers))).collect();
    let lost = lost.map(|lost| lost.to_string());
    Ok(Report { totals, noise, spp_range, whole, device, devices, lost, threads, build, picture })
}

/// Warns of radiance that is too small for the film, unless that was done on the way: those who want quiet, too, for
/// the picture is not that of the scene.
fn warn_of_faint(settings: &Settings, outcome: &Outcome) {
    if !outcome.told_faint
        && outcome.totals.samples > 0
        && let Some(warning) = outcome.faint.warning(&outcome.film, settings.scene.has_light())
    {
        let _ = writeln!(std::io::stderr(), "warning: {warning}");
    }
}

/// What came of the goal of an error, if one was asked for. Those who want quiet are warned, too, where it was missed:
/// the picture is not what was asked for.
fn warn_of_noise(settings: &Settings, outcome: &Outcome) -> Option<Noise> {
    let noise = settings.noise.map(|asked| Noise::of(asked, outcome))?;
    if !noise.reached() && outcome.totals.samples > 0 {
        let _ = writeln!(std::io::stderr(), "warning: {noise}");
    }
    Some(noise)
}

/// A film to begin or go on with, its last milestone, and how long it was rendered before.
struct Begun {
    film: Film,
    milestone: Option<Milestone>,
    spent: Duration,
}

/// A render of one camera.
struct Task<'a> {
    settings: &'a Settings,
    crew: Crew,
    head: &'a Head,
    begun: Begun,
    dump: Option<SampleDump>,
    tev: Option<Tev>,
}

/// What became of it.
struct Rendered {
    outcome: Outcome,
    picture: Picture,
    tev: Option<Tev>,
    /// Why the window left it, if there is one.
    left: Option<Left>,
    /// It is to be gone on with, and not written yet.
    is_aside: bool,
}

/// Renders what the user moves the camera to, until the window is closed. The render of the scene's own camera is of
/// the devices of this description.
fn tour(
    settings: &Settings,
    (head, device): (&Head, &str),
    own: &mut Rendered,
    integrator: Option<&Arc<dyn Integrator>>,
    window: &mut Window,
    stop: &Receiver<Infallible>,
) -> Result<(), SessionError> {
    let mut left = own.left.take();
    loop {
        match left {
            None | Some(Left::Closed | Left::Over) => return Ok(()),
            Some(Left::Moved(camera)) => {
                let settings = keeping::moved(settings, camera)?;
                let crew = Crew::again(&settings, integrator)?;
                let head = keeping::head(&settings, &crew.description());
                let film = Film::with_layout(head.layout)?;
                let begun = Begun { film, milestone: None, spent: Duration::ZERO };
                let task = Task { settings: &settings, crew, head: &head, begun, dump: None, tev: None };
                let view = render(task, Some(window), stop)?;
                if !view.is_aside {
                    warn_of_faint(&settings, &view.outcome);
                    warn_of_noise(&settings, &view.outcome);
                }
                if !view.is_aside && settings.view != View::Quiet {
                    let _ = tell(&settings, &view.outcome, &mut std::io::stderr().lock());
                }
                left = view.left;
            }
            Some(Left::Home) => {
                let crew = Crew::of_film(settings, integrator, device)?;
                let film = std::mem::replace(&mut own.outcome.film, Film::new(1, 1)?);
                // From here on it is that render's to write, even if it fails.
                own.is_aside = false;
                let milestone = own.outcome.milestone.take();
                let begun = Begun { film, milestone, spent: own.outcome.totals.elapsed };
                let task = Task { settings, crew, head, begun, dump: None, tev: own.tev.take() };
                let mut further = render(task, Some(window), stop)?;
                further.outcome.follow(&own.outcome);
                left = further.left.take();
                *own = further;
            }
        }
    }
}

/// How long workers may take to answer the request to stop. They look for it all the time: this is for machines with
/// many more threads than cores.
const ANSWERED_WITHIN: Duration = Duration::from_secs(1);

/// Renders, and writes what comes of it unless the camera moves on.
fn render(
    task: Task<'_>,
    window: Option<&mut Window>,
    stop: &Receiver<Infallible>,
) -> Result<Rendered, SessionError> {
    let Task { settings, crew, head, begun: Begun { film, milestone, spent }, dump, tev } = task;
    let region = settings.region;
    let plan = milestone.as_ref().and_then(|milestone| Some((milestone.samples, milestone.plan.clone()?)));
    let held = match &plan {
        Some((_, plan)) => Some(Held::planned(&film, region, Arc::clone(plan))),
        None => Held::of(&film, region, settings.first),
    };
    let held = held.map(Arc::new);
    let sink = keeping::film_sink(settings, head);
    let (layer_integrator, splatter) = (crew.layer_integrator(settings), crew.splatter());
    let workers = crew.workers();
    let time = settings.time.map(|time| time.saturating_sub(spent));
    let deadline = time.and_then(|time| Instant::now().checked_add(time));
    let stops: Vec<u32> = settings.dump_at.iter().map(|at| settings.first + at).collect();
    let [least, most] = film.seen_range().map(|seen| seen.min(u64::from(settings.spp)) as u32);
    // Pixels that have stopped have passed the milestone, too.
    let least = plan.as_ref().map_or(least, |(samples, _)| *samples);
    let schedule = Schedule::new(workers, region.len(), settings.range().end, deadline, stops.clone())
        .starting_at(settings.first + least, settings.first + most);
    let schedule = crew.deal(region, schedule);
    let owners = Arc::new(schedule.owners(&settings.layout()));
    let spare = crew.spare();
    let mattes = Mattes::of(&settings.scene);

    std::thread::scope(|scope| {
        let (batches_out, batches) = bounded(2 * workers);
        let (failures_out, failures) = bounded(workers);
        let crew::AtWork { orders, updates, stops: requests, threads } =
            crew.start(settings, held, &batches_out, &failures_out);
        drop((batches_out, failures_out));
        let names = threads.names();
        let (notes_out, notes) = bounded(16);

        let (samples_out, dumper) = match dump {
            Some(dump) => {
                let (sender, samples) = bounded(4);
                (Some(sender), Some(scope.spawn(move || keeping::keep_samples(dump, &samples))))
            }
            None => (None, None),
        };
        let (barriers_out, barriers) = bounded::<Barrier>(1);
        let (film_out, pieces) = bounded(2);
        let keeper = sink.as_ref().map(|sink| {
            let notes = notes_out.clone();
            scope.spawn(move || keeping::keep_film(sink, &pieces, &notes))
        });
        // Notes end with the last of those who write.
        let (identity, mattes, owned) = (&head.identity, &mattes, Arc::clone(&owners));
        let faint_out = notes_out.clone();
        let pictures = keeping::Pictures { settings, identity, mattes, owners: owned, notes: notes_out };
        let painter = scope.spawn({
            let pictures = pictures.clone();
            move || pictures.write_barriers(&barriers)
        });
        let (progress_out, progress) = bounded(1);
        let (snapshots_out, snapshots) = bounded(1);
        let watched = window.is_some();
        let (remote_out, remote) = bounded(tev::MOST_WAITING);
        let has_tev = tev.is_some();
        let tev = tev.map(|tev| {
            let notes = pictures.notes.clone();
            scope.spawn(move || tev.show(&remote, |line| keeping::tell(&notes, line)))
        });
        let outbox = Outbox {
            orders,
            samples: samples_out,
            barriers: Some(barriers_out),
            film: sink.is_some().then_some(film_out),
            snapshots: watched.then_some(snapshots_out),
            remote: has_tev.then_some(remote_out),
            progress: (!watched).then_some(progress_out),
        };
        let target = (settings.spp < u32::MAX).then_some(settings.spp);
        let mut accumulator = Accumulator::new(film, region, schedule, &stops, target, outbox)
            .with_owners(Arc::clone(&owners))
            .with_checkpoints(settings.checkpoint)
            .with_stops(requests, ANSWERED_WITHIN)
            .with_overtime(deadline.and_then(|deadline| deadline.checked_add(GRACE)))
            .going_on(settings.first)
            .with_notes(faint_out);
        if let Some(splatter) = splatter {
            accumulator = accumulator.with_splatter(splatter);
        }
        if let Some(spare) = spare {
            accumulator = accumulator.with_spare(spare, updates.clone());
        }
        if settings.adaptive {
            accumulator = accumulator.adaptively(updates);
        }
        if let Some(noise) = settings.goal() {
            accumulator = accumulator.until_noise(noise, milestone);
        }
        let inbox = Inbox { batches, failures, stop: stop.clone() };
        let (left_out, left_in) = bounded::<Left>(1);
        let (ending_out, ending) = bounded(0);
        // One thread from the film to the files, so that they are written while the window stays open.
        let finisher = scope.spawn({
            let (pictures, sink) = (pictures.clone(), sink.as_ref());
            let layer_integrator = layer_integrator.clone();
            move || {
                let outcome = accumulator.run(inbox);
                // What failed is not gone on with: it is written, wherever the camera has gone meanwhile.
                let is_aside = outcome.failure.is_none()
                    && matches!(left_in.try_recv(), Ok(Left::Moved(_) | Left::Home));
                // Whose pixels they are may have changed on the way.
                let owners = outcome.owners.clone().unwrap_or_else(|| Arc::clone(&pictures.owners));
                let pictures = keeping::Pictures { owners, ..pictures };
                let picture = outcome.film.picture();
                // Neither a checkpoint that is still on its way nor what the window saves must replace the end.
                let kept = keeper.is_none_or(|keeper| keeper.join().is_ok());
                let (written_out, written) = bounded(0);
                // Without a window there is nobody to wait for.
                let _ = ending_out.send(written);
                let layers = || layers(settings, layer_integrator.as_deref(), mattes, &outcome);
                // A black picture is no replacement for whatever is there.
                let written = match outcome.totals.samples {
                    0 => Ok(()),
                    _ if is_aside => Ok(()),
                    _ => pictures.write_end(sink, &outcome, &picture, layers),
                };
                drop(written_out);
                (outcome, picture, written, kept, is_aside)
            }
        });
        let left = match window {
            Some(window) => {
                let (requests_out, requests) = bounded(1);
                scope.spawn(move || pictures.save_on_request(&requests, &ending));
                scope.spawn(move || show_notes(&notes));
                let (layers_out, layers) = bounded(1);
                if let Some(integrator) = layer_integrator {
                    scope.spawn(move || layers_out.send(preview(settings, &*integrator, mattes)));
                }
                let feed = Feed { snapshots, layers, stop: stop.clone() };
                let left = window.run(&feed, &requests_out, settings.moved.is_some());
                // It lies there before the accumulator sees that nobody watches any more, when the feed goes.
                let _ = left_out.send(left.clone());
                Some(left)
            }
            None => {
                drop((pictures, ending));
                show_progress(settings, &progress, &notes);
                None
            }
        };
        let finished = finisher.join().map_err(|_| SessionError::Process("accumulator"));
        let finished = finished.and_then(|(outcome, picture, written, kept, is_aside)| match kept {
            true => Ok((outcome, picture, written, is_aside)),
            false => Err(SessionError::Process("film writer")),
        });
        let dumped =
            dumper.map_or(Ok(Ok(())), |d| d.join().map_err(|_| SessionError::Process("sample dump")));
        let painted = painter.join().map_err(|_| SessionError::Process("picture writer"));
        let tev = tev.map_or(Ok(None), |tev| tev.join().map_err(|_| SessionError::Process("tev sender")));
        if let Ok((outcome, ..)) = &finished {
            threads.join(|worker| outcome.unanswered.iter().any(|silent| silent.worker == worker));
        }
        let abandoned = |silent: &Unanswered| describe_abandoned(silent, &names, settings.region);
        let (outcome, picture, is_aside) = combine(finished, dumped, painted, abandoned)?;
        Ok(Rendered { outcome, picture, tev: tev?, left, is_aside })
    })
}

/// Writes the render of the scene's own camera that was set aside.
fn write_aside(settings: &Settings, head: &Head, own: &Rendered) -> Result<(), SessionError> {
    let (outcome, sink) = (&own.outcome, keeping::film_sink(settings, head));
    if outcome.totals.samples == 0 {
        return Ok(());
    }
    let mattes = Mattes::of(&settings.scene);
    let (notes_out, notes) = bounded(16);
    let written = std::thread::scope(|scope| {
        scope.spawn(move || show_notes(&notes));
        let owners = outcome.owners.clone().unwrap_or_default();
        let (identity, mattes) = (&head.identity, &mattes);
        let pictures = keeping::Pictures { settings, identity, mattes, owners, notes: notes_out };
        let integrator = crew::layer_integrator(settings);
        let layers = || layers(settings, integrator.as_deref(), mattes, outcome);
        pictures.write_end(sink.as_ref(), outcome, &own.picture, layers)
    });
    Ok(written?)
}

/// Samples of a pixel that the window's layers are means of.
const PREVIEW: u32 = 2;

/// The layers that first hits tell, for the window; without mattes, whose values are ids and no colours.
fn preview(settings: &Settings, integrator: &dyn Integrator, mattes: &Mattes) -> Vec<Channel> {
    let shows = |layer: &Layer| layer.names(mattes).is_none();
    let layers: Vec<Layer> = settings.layers.iter().copied().filter(shows).collect();
    let samples = settings.first..settings.first.saturating_add(PREVIEW);
    let (level, region) = (settings.level, settings.picture_region());
    first_hit_layers(integrator, level, region, samples, 1, &layers, mattes)
}

/// The layers that are wanted, of what the render came to.
fn layers(
    settings: &Settings,
    layer_integrator: Option<&dyn Integrator>,
    mattes: &Mattes,
    outcome: &Outcome,
) -> Vec<Channel> {
    let mut channels: Vec<Channel> =
        settings.layers.iter().flat_map(|layer| layer.channels_of_film(&outcome.film)).collect();
    if let Some(integrator) = layer_integrator {
        let samples = layer_samples(outcome.totals.spp);
        let (first, threads) = (settings.first, settings.threads.get());
        let (level, region) = (settings.level, settings.picture_region());
        channels.extend(first_hit_layers(
            integrator,
            level,
            region,
            first..first.saturating_add(samples),
            threads,
            &settings.layers,
            mattes,
        ));
    }
    channels
}

/// The outcome, or the first thing that went wrong.
fn combine(
    finished: Result<(Outcome, Picture, Written, bool), SessionError>,
    dumped: Result<Written, SessionError>,
    painted: Result<Written, SessionError>,
    abandoned: impl Fn(&Unanswered) -> String,
) -> Result<(Outcome, Picture, bool), SessionError> {
    let (outcome, picture, written, is_aside) = finished?;
    if outcome.failure.is_some() || !outcome.unanswered.is_empty() {
        let kept = match written {
            Err(error) => format!("the picture so far could not be written: {error}"),
            Ok(()) if outcome.totals.samples == 0 => "nothing had been rendered yet".to_owned(),
            Ok(()) => "the picture so far has been written".to_owned(),
        };
        return Err(match outcome.failure {
            Some(failure) => SessionError::Worker(failure, kept),
            None => {
                let silent: Vec<String> = outcome.unanswered.iter().map(abandoned).collect();
                SessionError::Unanswered(silent.join("; "), kept)
            }
        });
    }
    written?;
    dumped??;
    painted??;
    Ok((outcome, picture, is_aside))
}

/// What there is to know of a worker that did not stop, and how to find out what keeps it.
fn describe_abandoned(silent: &Unanswered, names: &[String], region: Region) -> String {
    /// Pixels that are named.
    const NAMED: usize = 8;
    let name = names.get(silent.worker).map_or("a worker", String::as_str);
    let Some((order, slots)) = silent.order.as_ref().filter(|(_, slots)| !slots.is_empty()) else {
        return format!("{name} did not stop when it was asked to, and held no order");
    };
    let pixels = slots.clone().map(|slot| region.pixel(order.stride.place(slot)));
    let places: Vec<String> = pixels.take(NAMED).map(|pixel| format!("{},{}", pixel.x, pixel.y)).collect();
    let more = if slots.len() > NAMED { ", …" } else { "" };
    format!(
        "{name} did not stop when it was asked to, and was abandoned: it held the samples {} to {} of {} pixels ({}{more}), of which one takes forever; look for it with stride trace SCENE --pixel {} --sample {}",
        order.first,
        order.end - 1,
        slots.len(),
        places.join(" "),
        places.first().map_or("X,Y", String::as_str),
        order.first,
    )
}

fn open_window(
    settings: &Settings,
    integrator: Option<&dyn Integrator>,
) -> Result<Option<Window>, SessionError> {
    if matches!(settings.view, View::Progress | View::Quiet) {
        return Ok(None);
    }
    let camera = if settings.samples.is_some() || !settings.dump_at.is_empty() {
        Err("the camera stays: --samples and --dump-at are of one render".to_owned())
    } else {
        Ok(Orbit::new(&settings.scene.camera, distance(settings, integrator)))
    };
    let (shown, film) = (settings.picture_region(), &settings.scene.film);
    let options = WindowOptions {
        name: settings.name.clone(),
        width: shown.width,
        height: shown.height,
        film_height: film.height,
        corner: (shown.x, shown.y),
        view: ViewTransform::of(film),
        overlay: settings.overlay,
        time_limit: settings.time.map(|time| time.as_secs_f64()),
        camera,
    };
    match window::open(&options) {
        Ok(window) => Ok(Some(window)),
        Err(error) if settings.view == View::Window => Err(error.into()),
        Err(_) => Ok(None),
    }
}

/// How far in front of the camera a mouse turns it about: at what is seen in the middle of the film, or else as far
/// as the origin.
fn distance(settings: &Settings, integrator: Option<&dyn Integrator>) -> f64 {
    let Scene { film, camera, .. } = &*settings.scene;
    let mut hits = Vec::new();
    if let Some(integrator) = integrator {
        let middle = film.height / 2 * film.width + film.width / 2;
        let pixels = [Region::whole(film.width, film.height).pixel(middle)];
        let paths = Paths { pixels: &pixels, first_sample: settings.first, samples: 1 };
        integrator.first_hits(settings.level, &paths, &mut hits);
    }
    let seen = hits.first().filter(|hit| hit.met).map(|hit| f64::from(hit.depth));
    let origin = -camera.eye.dot(camera.forward);
    seen.into_iter().chain([origin]).find(|&distance| distance > 0.0).unwrap_or(1.0)
}

/// Says where the pictures are, and what a user would not expect: samples that were left out and how to look at
/// one of them, pictures that were not reached, nothing at all.
fn tell(settings: &Settings, outcome: &Outcome, out: &mut impl Write) -> std::io::Result<()> {
    let files = settings.outputs.iter().chain(&settings.film).chain(&settings.samples);
    let names: Vec<String> = files.map(|path| path.display().to_string()).collect();
    if outcome.totals.samples > 0 && !names.is_empty() {
        let spp = outcome.totals.spp;
        let early = settings.time.is_none() && settings.goal().is_none() && spp < settings.spp;
        let note = match outcome.film.seen_range() {
            _ if early => format!(" (stopped early, before {} spp)", settings.spp),
            [least, most] if outcome.overtime => format!(
                " (the time was up long before the next sample of every pixel was done: pixels have {least} to {most} samples)"
            ),
            _ => String::new(),
        };
        writeln!(out, "wrote {}{note}", names.join(", "))?;
    }
    if let Some(camera) = settings.moved.as_ref().filter(|_| outcome.totals.samples > 0) {
        writeln!(out, "seen from\n{}", camera.trim_end())?;
    }
    if let Some(lost) = &outcome.lost {
        let note = if outcome.whole { ", and nothing is missing" } else { "" };
        writeln!(out, "warning: {lost}; the CPU went on{note}")?;
    }
    if let Some(noise) = settings.goal().map(|asked| Noise::of(asked, outcome))
        && (noise.reached() || settings.noise.is_none())
    {
        writeln!(out, "{noise}")?;
    }
    if settings.adaptive && outcome.totals.samples > 0 {
        let ([least, most], len) = (outcome.film.seen_range(), f64::from(settings.region.len()));
        let mean = outcome.totals.samples as f64 / len;
        writeln!(out, "pixels have {least} to {most} samples, {mean:.1} on average")?;
    }
    let rejected = outcome.totals.rejected;
    if rejected > 0 {
        writeln!(out, "{rejected} {} left out:", if rejected == 1 { "sample was" } else { "samples were" })?;
    }
    for (traced, reject) in &outcome.rejects {
        writeln!(out, "  pixel {} sample {}: {reject}", traced.pixel, traced.sample)?;
    }
    if let Some((traced, _)) = outcome.rejects.first() {
        let (x, y) = (traced.pixel % settings.region.film_width, traced.pixel / settings.region.film_width);
        writeln!(out, "  look at one: stride trace SCENE --pixel {x},{y} --sample {}", traced.sample)?;
    }
    if outcome.rejects.iter().any(|(_, reject)| *reject == Reject::TooBright) {
        let remedy = "divide every emission, intensity and radiance of the scene by one number and raise its exposure, or, where point lights light it, measure lengths in a smaller unit";
        writeln!(out, "  radiance above 2³⁰ does not fit a film: {remedy}")?;
    }
    for &spp in &outcome.unreached {
        let spp = spp - settings.first;
        writeln!(out, "the render ended before {spp} samples a pixel: there is no picture of them")?;
    }
    if outcome.totals.samples == 0 {
        writeln!(out, "nothing was rendered yet: no picture is written")?;
    }
    Ok(())
}

fn show_progress(settings: &Settings, totals: &Receiver<Totals>, notes: &Receiver<String>) {
    let mut reporter = Reporter::stderr(settings.view == View::Quiet);
    let mut last = Totals::default();
    loop {
        select! {
            recv(totals) -> totals => match totals {
                Ok(totals) => {
                    reporter.update(&progress(settings, &totals));
                    last = totals;
                }
                Err(_) => break,
            },
            recv(notes) -> note => match note {
                // Also for those who want quiet: a note is of what went wrong.
                Ok(note) if settings.view == View::Quiet => show_note(&note),
                Ok(note) => reporter.note(&note),
                Err(_) => break,
            },
        }
    }
    reporter.finish(&progress(settings, &last));
    show_notes(notes);
}

fn show_notes(notes: &Receiver<String>) {
    notes.iter().for_each(|note| show_note(&note));
}

fn show_note(note: &str) {
    let _ = writeln!(std::io::stderr(), "{note}");
}

fn progress(settings: &Settings, totals: &Totals) -> Progress {
    let len = f64::from(settings.region.len());
    Progress {
        spp_done: totals.samples as f64 / len,
        spp_before: totals.before as f64 / len,
        spp_target: (settings.spp < u32::MAX).then_some(settings.spp),
        seconds: totals.elapsed.as_secs_f64(),
        samples: totals.made(),
        time_limit: settings.time.map(|time| time.as_secs_f64()),
        noise: totals.noise,
    }
}
