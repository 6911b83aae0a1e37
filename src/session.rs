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
use crate::film::{Film, Milestone, Picture, ViewTransform};
use crate::integrator::{Integrator, Paths};
use crate::output::window::orbit::Orbit;
use crate::output::window::{self, Feed, Left, Request, Window, WindowOptions};
use crate::output::{SampleDump, Tev, tev};
use crate::render::accumulator::{Inbox, Outbox, Outcome, Unanswered};
use crate::render::schedule::GRACE;
use crate::render::{Accumulator, Barrier, Held, Region, Schedule, Stride};
use crate::scene::Scene;
use crew::{ANSWERED_WITHIN, Crew, GPU_ANSWERS_WITHIN};
use crossbeam_channel::{Receiver, Sender, bounded, never};
use keeping::Written;
use layers::{layers, preview};
use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};
use terminal::{sample_counts, show_notes, show_progress, tell, warn_of_noise, warn_of_radiance};

mod crew;
mod error;
mod keeping;
mod layers;
mod report;
mod settings;
mod terminal;

pub use error::SessionError;
pub use report::{Noise, Report};
pub use settings::{ADAPTIVE_NOISE, DeviceChoice, Settings, View};

pub(crate) use keeping::{NOTES, facts};

/// A render that can begin: the scene is compiled, and the devices are ready. Nothing has been written yet.
pub struct Prepared<'a> {
    settings: &'a Settings,
    crew: Crew,
    build: Duration,
}

/// Compiles the scene and prepares the devices. No request to stop is heard meanwhile, so that whoever takes over
/// Ctrl-C does it after this.
pub fn prepare(settings: &Settings) -> Result<Prepared<'_>, SessionError> {
    let build_start = Instant::now();
    let crew = Crew::new(settings, &never())?;
    Ok(Prepared { settings, crew, build: build_start.elapsed() })
}

/// Prepares and runs a render. Any failure is an error.
pub fn run(settings: &Settings, stop: &Receiver<Infallible>) -> Result<Report, SessionError> {
    let mut report = prepare(settings)?.run(stop)?;
    report.problem.take().map_or(Ok(report), Err)
}

impl Prepared<'_> {
    /// Renders. Closing `stop` ends the render with what there is. A failure after the first sample leaves a report
    /// with a [`Report::problem`].
    ///
    /// Where the camera is moved in the window, the render of the scene's own camera is set aside, to be gone on with
    /// when that is wanted back, and is written in the end.
    ///
    /// Must run on the main thread if a window may open.
    pub fn run(self, stop: &Receiver<Infallible>) -> Result<Report, SessionError> {
        run_prepared(self, stop)
    }
}

fn run_prepared(prepared: Prepared<'_>, stop: &Receiver<Infallible>) -> Result<Report, SessionError> {
    let Prepared { settings, crew, build } = prepared;
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
    let mut own = render(task, window.as_mut().map(|window| window as &mut dyn Viewer), stop)?;
    let mut toured = Ok(());
    if let Some(window) = window.as_mut().filter(|_| own.problem.is_none()) {
        toured = tour(settings, (&head, &device), &mut own, integrator.as_ref(), window, stop);
    }
    if own.is_aside {
        write_aside(settings, &head, &own, stop)?;
    } else if own.problem.is_none()
        && let Err(error) = toured
    {
        // The render that went on with the film has taken it along.
        return Err(error);
    }
    let noise = conclude(settings, &own);
    let Rendered { outcome, picture, problem, .. } = own;
    let problem = problem.or(toured.err());
    let spp_range = outcome.film.seen_range();
    let Outcome { totals, whole, lost, made, .. } = outcome;
    let made = |workers: Range<usize>| made[workers].iter().sum();
    let devices = devices.into_iter().map(|(name, workers)| (name, made(workers))).collect();
    let lost = lost.map(|lost| lost.to_string());
    Ok(Report { totals, noise, spp_range, whole, device, devices, lost, threads, build, picture, problem })
}

/// Prints the warnings and the words at the end of a render, also of one that failed; returns the noise that it came
/// to.
fn conclude(settings: &Settings, rendered: &Rendered) -> Option<Noise> {
    let Rendered { outcome, is_written, .. } = rendered;
    warn_of_radiance(settings, outcome);
    let noise = warn_of_noise(settings, outcome);
    if settings.view != View::Quiet {
        // Standard error may be closed: these are courtesies.
        let _ = tell(settings, outcome, *is_written, &mut std::io::stderr().lock());
    }
    noise
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
    /// Whether all files were written that were to be.
    is_written: bool,
    /// The failure that ended it, if one did.
    problem: Option<SessionError>,
}

/// A view of a render, until its user closes it or wants to see another.
trait Viewer {
    /// Shows a render until it is left. `is_moved` tells that the camera is not the scene's own.
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> Left;
}

impl Viewer for Window {
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> Left {
        self.run(feed, requests, is_moved)
    }
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
                let crew = Crew::again(&settings, integrator, stop)?;
                let head = keeping::head(&settings, &crew.description());
                let film = Film::with_layout(head.layout)?;
                let begun = Begun { film, milestone: None, spent: Duration::ZERO };
                let task = Task { settings: &settings, crew, head: &head, begun, dump: None, tev: None };
                let view = render(task, Some(&mut *window), stop)?;
                if !view.is_aside {
                    conclude(&settings, &view);
                }
                if let Some(problem) = view.problem {
                    return Err(problem);
                }
                left = view.left;
            }
            Some(Left::Home) => {
                let crew = Crew::of_film(settings, integrator, device, stop)?;
                let film = std::mem::replace(&mut own.outcome.film, Film::new(1, 1)?);
                // From here on it is that render's to write, even if it fails.
                own.is_aside = false;
                let milestone = own.outcome.milestone.take();
                let begun = Begun { film, milestone, spent: own.outcome.totals.elapsed };
                let task = Task { settings, crew, head, begun, dump: None, tev: own.tev.take() };
                let mut further = render(task, Some(&mut *window), stop)?;
                further.outcome.follow(&own.outcome);
                left = further.left.take();
                *own = further;
                if own.problem.is_some() {
                    return Ok(());
                }
            }
        }
    }
}

/// Whether a render is set aside: the camera has moved on, and nothing has failed. A render that failed is not gone on
/// with, so that it is written.
fn is_aside(outcome: &Outcome, left: Option<&Left>) -> bool {
    outcome.failure.is_none()
        && outcome.unanswered.is_empty()
        && matches!(left, Some(Left::Moved(_) | Left::Home))
}

/// Renders, and writes what comes of it unless the camera moves on.
fn render(
    task: Task<'_>,
    window: Option<&mut dyn Viewer>,
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
    let (layer_integrator, splatter) = (crew.layer_integrator(settings)?, crew.splatter());
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
    let (spare, gpu) = (crew.spare(), crew.gpu_worker());
    let mattes = Mattes::of(&settings.scene);

    std::thread::scope(|scope| {
        let (batches_out, batches) = bounded(2 * workers);
        let (failures_out, failures) = bounded(workers);
        let crew::RunningCrew { orders, updates, stops: requests, threads } =
            crew.start(settings, held, &batches_out, &failures_out, None);
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
        if let Some(gpu) = gpu {
            accumulator = accumulator.with_patience(gpu, GPU_ANSWERS_WITHIN);
        }
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
        let (viewing, viewer) = bounded(0);
        let viewer = if window.is_some() { viewer } else { never() };
        let inbox = Inbox { batches, failures, stop: stop.clone(), viewer };
        let (left_out, left_in) = bounded::<Left>(1);
        let (ending_out, ending) = bounded(0);
        // One thread from the film to the files, so that they are written while the window stays open.
        let finisher = scope.spawn({
            let (pictures, sink) = (pictures.clone(), sink.as_ref());
            let layer_integrator = layer_integrator.clone();
            move || {
                let outcome = accumulator.run(inbox);
                let is_aside = is_aside(&outcome, left_in.try_recv().ok().as_ref());
                // Whose pixels they are may have changed on the way.
                let owners = outcome.owners.clone().unwrap_or_else(|| Arc::clone(&pictures.owners));
                let pictures = keeping::Pictures { owners, ..pictures };
                let picture = outcome.film.picture();
                // Neither a checkpoint that is still on its way nor what the window saves must replace the end.
                let kept = keeper.is_none_or(|keeper| keeper.join().is_ok());
                let (written_out, written) = bounded(0);
                // Without a window there is nobody to wait for.
                let _ = ending_out.send(written);
                let layers = || layers(settings, layer_integrator.as_deref(), mattes, &outcome, stop);
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
                    // No end of the render waits for it: a path may never come back from its first hit.
                    let settings = settings.clone();
                    std::thread::spawn(move || {
                        let mattes = Mattes::of(&settings.scene);
                        // The viewer may have gone.
                        let _ = layers_out.send(preview(&settings, &*integrator, &mattes));
                    });
                }
                let feed = Feed { snapshots, layers, stop: stop.clone() };
                let left = window.show(&feed, &requests_out, settings.moved.is_some());
                // It lies there before the accumulator sees that the viewer is left.
                let _ = left_out.send(left.clone());
                drop(viewing);
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
        let (outcome, picture, written, is_aside) = finished?;
        threads.join(|worker| outcome.unanswered.iter().any(|silent| silent.worker == worker));
        let is_written = written.is_ok() && [&dumped, &painted].iter().all(|it| matches!(it, Ok(Ok(()))));
        let abandoned = |silent: &Unanswered| describe_abandoned(silent, &names, gpu, settings.region);
        let problem = problem(&outcome, written, dumped, painted, abandoned);
        Ok(Rendered { outcome, picture, tev: tev?, left, is_aside, is_written, problem })
    })
}

/// Writes the render of the scene's own camera that was set aside.
fn write_aside(
    settings: &Settings,
    head: &Head,
    own: &Rendered,
    stop: &Receiver<Infallible>,
) -> Result<(), SessionError> {
    let (outcome, sink) = (&own.outcome, keeping::film_sink(settings, head));
    if outcome.totals.samples == 0 {
        return Ok(());
    }
    let mattes = Mattes::of(&settings.scene);
    let integrator = crew::layer_integrator(settings)?;
    let (notes_out, notes) = bounded(16);
    let written = std::thread::scope(|scope| {
        scope.spawn(move || show_notes(&notes));
        let owners = outcome.owners.clone().unwrap_or_default();
        let (identity, mattes) = (&head.identity, &mattes);
        let pictures = keeping::Pictures { settings, identity, mattes, owners, notes: notes_out };
        let layers = || layers(settings, integrator.as_deref(), mattes, outcome, stop);
        pictures.write_end(sink.as_ref(), outcome, &own.picture, layers)
    });
    Ok(written?)
}

/// The first thing that went wrong, if any did.
fn problem(
    outcome: &Outcome,
    written: Written,
    dumped: Result<Written, SessionError>,
    painted: Result<Written, SessionError>,
    abandoned: impl Fn(&Unanswered) -> String,
) -> Option<SessionError> {
    if outcome.failure.is_some() || !outcome.unanswered.is_empty() {
        let kept = match written {
            Err(error) => format!("the picture so far could not be written: {error}"),
            Ok(()) if outcome.totals.samples == 0 => "nothing had been rendered yet".to_owned(),
            Ok(()) => format!("the picture so far has been written: {}", sample_counts(outcome)),
        };
        return Some(match &outcome.failure {
            Some(failure) => SessionError::Worker(failure.clone(), kept),
            None => {
                let silent: Vec<String> = outcome.unanswered.iter().map(abandoned).collect();
                SessionError::Unanswered(silent.join("; "), kept)
            }
        });
    }
    let files = || -> Result<(), SessionError> {
        written?;
        dumped??;
        painted??;
        Ok(())
    };
    files().err()
}

/// Describes a worker that did not stop: its whole order, so that it can be repeated, and a way to find the path that
/// takes long.
fn describe_abandoned(silent: &Unanswered, names: &[String], gpu: Option<usize>, region: Region) -> String {
    let name = names.get(silent.worker).map_or("a worker", String::as_str);
    let within = silent.within.as_secs_f64();
    let silence = format!("{name} did not stop within {within} s of the request to, and was abandoned");
    let Some((order, slots)) = silent.order.as_ref().filter(|(_, slots)| !slots.is_empty()) else {
        return format!("{silence}: it held no order");
    };
    let Stride { first, step, run } = order.stride;
    let place = match run {
        1 => format!("{first} + {step}·i"),
        run => format!("{first} + {step}·(i div {run}) + (i mod {run})"),
    };
    let Region { x, y, width, .. } = region;
    let from = region.pixel(order.stride.place(slots.start));
    let [first_sample, last_sample] = [order.first, order.end - 1];
    let hint = if gpu == Some(silent.worker) {
        "a CPU takes the same paths, and shows whether the scene or the device is slow"
    } else {
        "one of them is slow or takes forever"
    };
    format!(
        "{silence}: it held the samples {first_sample} to {last_sample} of {} pixels, which have numbers i from {} to {}, each in column {x} + p mod {width} and row {y} + p div {width} for p = {place}; {hint}: try them with stride trace SCENE --pixel {},{} --sample {first_sample}",
        slots.len(),
        slots.start,
        slots.end - 1,
        from.x,
        from.y,
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
