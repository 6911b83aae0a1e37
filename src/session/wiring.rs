//! The wiring diagram: creates the channels of a render and starts its processes.
//!
//! ```text
//!  workers ──SampleBatch──▶ accumulator ──samples──▶ dump        (without loss)
//!     ▲                        │  │ │├────pieces───▶ film file   (when it is due)
//!     │                        │  │ └┴───barriers─▶ pictures    (without loss)
//!     └────────orders──────────┘  ├────snapshots──▶ window, tev (frames may drop)
//!                                 └────progress───▶ narrator    (frames may drop)
//! ```
//!
//! Every arrow is a bounded channel. Processes that write files report problems to the narrator, which forwards them to
//! the caller. The accumulator is part of the *finisher*, one process from the film to the files: when the accumulator
//! ends, the finisher writes them.
//!
//! Ctrl-C closes the `stop` channel, and a viewer or a sink that ends closes its own. Either makes the accumulator
//! stop: it closes the orders and asks the workers to stop, which they check at each bounce. A worker that does not end
//! is abandoned: its thread is detached, and ends with the program.
//!
//! Saves of the window and the final outputs are the same files. The finisher announces the end to the saver, and
//! writes when the saver is waiting.

use super::error::{SessionError, Written};
use super::event::{Event, report_events, report_notes};
use super::finishing::{self, Finished, Finisher};
use super::identity;
use super::layers::preview;
use super::pictures::{Ended, Pictures, note};
use super::process::Process;
use super::settings::RenderSettings;
use super::worker_pool::{self, RunningPool, Threads, WorkerPool};
use crate::film::cryptomatte::Mattes;
use crate::film::file::Piece;
use crate::film::head::Head;
use crate::film::{Channel, Film, Milestone, Picture, Snapshot};
use crate::integrator::Integrator;
use crate::output::window::{ExitReason, Feed, Request, Window};
use crate::output::{FilmSink, SampleDump, Tev, tev};
use crate::render::accumulator::{Goal, Inbox, Outbox, Outcome};
use crate::render::schedule::GRACE;
use crate::render::{Accumulator, Change, Configuration, SampleBatch, Schedule};
use crate::sampling::Sample;
use crossbeam_channel::{Receiver, Sender, bounded, never};
use std::convert::Infallible;
use std::sync::Arc;
use std::thread::Scope;
use std::time::{Duration, Instant};

/// The render of one camera.
pub(super) struct Task<'a> {
    pub(super) settings: &'a RenderSettings,
    pub(super) pool: WorkerPool,
    pub(super) head: &'a Head,
    pub(super) initial: InitialFilm,
    pub(super) dump: Option<SampleDump>,
    /// The channel to the caller for all samples, if requested.
    pub(super) samples: Option<Sender<Vec<Sample>>>,
    pub(super) tev: Option<Tev>,
}

/// A film to start with, its last milestone, and the time spent on it before.
pub(super) struct InitialFilm {
    pub(super) film: Film,
    pub(super) milestone: Option<Milestone>,
    pub(super) spent: Duration,
}

/// The result of a task.
pub(super) struct Rendered {
    pub(super) outcome: Outcome,
    pub(super) picture: Picture,
    pub(super) layers: Vec<Channel>,
    pub(super) tev: Option<Tev>,
    /// The reason why the window left it, if there is a window.
    pub(super) exit_reason: Option<ExitReason>,
    /// Whether it is suspended: it may be resumed, and its files are not written yet.
    pub(super) is_suspended: bool,
    /// Whether all requested files were written.
    pub(super) is_written: bool,
    /// The failure that ended it, if there was one.
    pub(super) problem: Option<SessionError>,
}

/// Shows a render until the user closes the view or selects another render.
pub(super) trait Viewer {
    /// Shows a render until it is left. `is_moved` is set if the camera is not the scene's own.
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> ExitReason;
}

impl Viewer for Window {
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> ExitReason {
        self.run(feed, requests, is_moved)
    }
}

/// Renders, and writes the outputs unless the render is suspended.
pub(super) fn render(
    task: Task<'_>,
    window: Option<&mut dyn Viewer>,
    events: &Sender<Event>,
    stop: &Receiver<Infallible>,
) -> Result<Rendered, SessionError> {
    let Task { settings, pool, head, initial, dump, samples, tev } = task;
    let sink = identity::film_sink(settings, head);
    let first_hit_tracer = pool.first_hit_tracer();
    let mattes = Mattes::of(&settings.job.scene);
    let gpu = pool.gpu_worker();

    std::thread::scope(|scope| {
        let (notes_out, notes) = bounded(16);
        let (samples_out, dump) = start_dump(scope, dump, samples);
        let (film_out, film_writer) = start_film_writer(scope, sink.as_ref(), &notes_out);
        let (remote_out, tev) = start_tev(scope, tev, &notes_out);
        let (barriers_out, barriers) = bounded(1);
        let (progress_out, progress) = bounded(1);
        let (snapshots_out, snapshots) = bounded(1);
        let is_watched = window.is_some();
        let outbox = Outbox {
            samples: samples_out,
            barriers: Some(barriers_out),
            film: film_out,
            snapshots: is_watched.then_some(snapshots_out),
            remote: remote_out,
            progress: (!is_watched).then_some(progress_out),
            notes: Some(notes_out.clone()),
        };
        let Wired { accumulator, batches, changes, threads } = start_workers(settings, pool, initial, outbox);
        let names = threads.names();

        // The channel of notes closes with the last writer.
        let owners = accumulator.owners();
        let pictures =
            Pictures { settings, identity: &head.identity, mattes: &mattes, owners, notes: notes_out };
        let painter = Process::start(scope, "picture writer", {
            let pictures = pictures.clone();
            move || pictures.write_barriers(&barriers)
        });
        let (viewing, viewer) = bounded(0);
        let viewer = if is_watched { viewer } else { never() };
        let inbox = Inbox { batches, changes, stop: stop.clone(), viewer };
        let (exit_reason_out, exit_reason) = bounded(1);
        let (ending_out, ending) = bounded(0);
        let finisher = Finisher {
            pictures: pictures.clone(),
            sink: sink.as_ref(),
            film_writer,
            exit_reason,
            ending: ending_out,
        };
        let finisher = Process::start(scope, "accumulator", move || finisher.run(accumulator, inbox));

        let exit_reason = match window {
            Some(window) => {
                scope.spawn(move || report_notes(&notes, events));
                let requests = start_saver(scope, pictures, ending, events);
                let layers = start_preview(settings, first_hit_tracer);
                let feed = Feed { snapshots, layers, stop: stop.clone() };
                let exit_reason = window.show(&feed, &requests, settings.job.moved.is_some());
                // It is in the channel before the accumulator notices that the viewer was left.
                let _ = exit_reason_out.send(exit_reason.clone());
                drop(viewing);
                Some(exit_reason)
            }
            None => {
                drop((pictures, ending));
                report_events(settings, &progress, &notes, events);
                None
            }
        };

        let finished = finisher.join().and_then(|finished| finished);
        let dumped = dump.map_or(Ok(Ok(())), Process::join);
        let painted = painter.join();
        let tev = tev.map_or(Ok(None), Process::join);
        let Finished { outcome, picture, layers, written, is_suspended } = finished?;
        threads.join(|worker| outcome.unanswered.iter().any(|silent| silent.worker == worker));
        let is_written = written.is_ok() && [&dumped, &painted].iter().all(|it| matches!(it, Ok(Ok(()))));
        let abandoned = |silent: &_| finishing::describe_abandoned(silent, &names, gpu, settings.job.region);
        let problem = finishing::problem(&outcome, written, dumped, painted, abandoned);
        Ok(Rendered { outcome, picture, layers, tev: tev?, exit_reason, is_suspended, is_written, problem })
    })
}

/// Running workers that wait for orders, and the accumulator that will give them.
struct Wired {
    accumulator: Accumulator,
    batches: Receiver<SampleBatch>,
    changes: Receiver<Change>,
    threads: Threads,
}

/// Starts the workers, and configures the accumulator.
fn start_workers(settings: &RenderSettings, pool: WorkerPool, initial: InitialFilm, outbox: Outbox) -> Wired {
    let InitialFilm { film, milestone, spent } = initial;
    let (job, stopping, outputs) = (&settings.job, &settings.stopping, &settings.outputs);
    let (region, workers) = (job.region, pool.workers());
    let planned = milestone.as_ref().filter(|milestone| milestone.plan.is_some());
    let time = stopping.time.map(|time| time.saturating_sub(spent));
    let deadline = time.and_then(|time| Instant::now().checked_add(time));
    let barriers: Vec<u32> = outputs.dump_at.iter().map(|at| job.first + at).collect();
    let [least, most] = film.seen_range().map(|seen| seen.min(u64::from(stopping.spp)) as u32);
    // Stopped pixels have passed the milestone as well.
    let least = planned.map_or(least, |milestone| milestone.samples);
    let schedule = Schedule::new(workers, region.len(), settings.range().end, deadline, barriers.clone())
        .starting_at(job.first + least, job.first + most);
    let schedule = pool.distribute(region, schedule);
    let splatter = pool.splatter();
    let (batches_out, batches) = bounded(2 * workers);
    let (changes_out, changes) = bounded(workers);
    let RunningPool { ports, threads } = pool.start(settings, &batches_out, &changes_out, None);
    let goal = |error| Goal { error, is_adaptive: stopping.adaptive, milestone };
    let accumulator = Accumulator::new(Configuration {
        first: job.first,
        splatter,
        light: worker_pool::light(settings),
        barriers,
        goal: stopping.goal().map(goal),
        checkpoint: outputs.checkpoint,
        overtime: deadline.and_then(|deadline| deadline.checked_add(GRACE)),
        target: settings.target(),
        outbox,
        ..Configuration::new(film, region, schedule, ports)
    });
    Wired { accumulator, batches, changes, threads }
}

/// Starts the process that writes all samples, if requested, and forwards them to the caller.
fn start_dump<'scope>(
    scope: &'scope Scope<'scope, '_>,
    dump: Option<SampleDump>,
    caller: Option<Sender<Vec<Sample>>>,
) -> (Option<Sender<Vec<Sample>>>, Option<Process<'scope, Written>>) {
    let Some(mut dump) = dump else { return (caller, None) };
    let (samples_out, samples) = bounded::<Vec<Sample>>(4);
    let write = move || {
        for samples in samples {
            dump.write(&samples)?;
            if caller.as_ref().is_some_and(|caller| caller.send(samples).is_err()) {
                break;
            }
        }
        dump.finish().map(drop)
    };
    (Some(samples_out), Some(Process::start(scope, "sample dump", write)))
}

/// Starts the process that writes checkpoints of the film file, if there is one.
fn start_film_writer<'scope>(
    scope: &'scope Scope<'scope, '_>,
    sink: Option<&'scope FilmSink>,
    notes: &Sender<String>,
) -> (Option<Sender<Piece>>, Option<Process<'scope, ()>>) {
    let Some(sink) = sink else { return (None, None) };
    let ((film_out, pieces), notes) = (bounded(2), notes.clone());
    let write = move || sink.write_checkpoints(&pieces, |line| note(&notes, line));
    (Some(film_out), Some(Process::start(scope, "film writer", write)))
}

/// The channel of a remote viewer.
type Remote = Sender<Arc<Snapshot>>;

/// Starts the process that sends pictures to tev, if requested. It returns the connection at the end, unless it was
/// lost.
fn start_tev<'scope>(
    scope: &'scope Scope<'scope, '_>,
    tev: Option<Tev>,
    notes: &Sender<String>,
) -> (Option<Remote>, Option<Process<'scope, Option<Tev>>>) {
    let Some(tev) = tev else { return (None, None) };
    let ((remote_out, remote), notes) = (bounded(tev::MOST_WAITING), notes.clone());
    let show = move || tev.show(&remote, |line| note(&notes, line));
    (Some(remote_out), Some(Process::start(scope, "tev sender", show)))
}

/// Starts the process that writes pictures on request of the window.
fn start_saver<'scope>(
    scope: &'scope Scope<'scope, '_>,
    pictures: Pictures<'scope>,
    ending: Receiver<Ended>,
    events: &'scope Sender<Event>,
) -> Sender<Request> {
    let (requests_out, requests) = bounded(1);
    scope.spawn(move || pictures.save_on_request(&requests, &ending, events));
    requests_out
}

/// Starts the thread that traces first hits for the window, if its layers need them. The end of the render does not
/// wait for it: a path may hang before its first hit.
fn start_preview(
    settings: &RenderSettings,
    integrator: Option<Arc<dyn Integrator>>,
) -> Receiver<Vec<Channel>> {
    let (layers_out, layers) = bounded(1);
    if let Some(integrator) = integrator {
        let settings = settings.clone();
        std::thread::spawn(move || {
            let mattes = Mattes::of(&settings.job.scene);
            // The viewer may have closed.
            let _ = layers_out.send(preview(&settings, &integrator, &mattes));
        });
    }
    layers
}
