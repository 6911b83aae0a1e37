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
//! Every arrow is a bounded channel. Those who write files tell the narrator of difficulties, and it tells the caller.
//! The accumulator is a part of the *finisher*, one process from the film to the files: when the accumulator ends, it
//! writes what there is.
//!
//! Ctrl-C closes the `stop` channel, a viewer or a sink that goes away closes its own, and either makes the accumulator
//! stop; it closes the orders and asks the workers to stop, which they look for at each bounce. One that does not end
//! is abandoned: its thread belongs to nobody, and ends with the program.
//!
//! What the window saves and what is written at the end are the same files: the finisher tells the saver that the
//! end is coming, and writes when the saver waits for it.

use super::crew::{self, Crew, RunningCrew, Threads};
use super::error::{SessionError, Written};
use super::event::{Event, narrate, narrate_notes};
use super::finishing::{self, Finished, Finisher};
use super::identity;
use super::layers::preview;
use super::pictures::{Ended, Pictures, note};
use super::process::Process;
use super::settings::Settings;
use crate::film::cryptomatte::Mattes;
use crate::film::file::Piece;
use crate::film::head::Head;
use crate::film::{Channel, Film, Milestone, Picture, Snapshot};
use crate::integrator::Integrator;
use crate::output::window::{Feed, Left, Request, Window};
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

/// A render of one camera.
pub(super) struct Task<'a> {
    pub(super) settings: &'a Settings,
    pub(super) crew: Crew,
    pub(super) head: &'a Head,
    pub(super) begun: Begun,
    pub(super) dump: Option<SampleDump>,
    /// Where the caller hears every sample, if it wants that.
    pub(super) samples: Option<Sender<Vec<Sample>>>,
    pub(super) tev: Option<Tev>,
}

/// A film to begin or go on with, its last milestone, and how long it was rendered before.
pub(super) struct Begun {
    pub(super) film: Film,
    pub(super) milestone: Option<Milestone>,
    pub(super) spent: Duration,
}

/// What became of a task.
pub(super) struct Rendered {
    pub(super) outcome: Outcome,
    pub(super) picture: Picture,
    pub(super) layers: Vec<Channel>,
    pub(super) tev: Option<Tev>,
    /// Why the window left it, if there is one.
    pub(super) left: Option<Left>,
    /// It is to be gone on with, and not written yet.
    pub(super) is_aside: bool,
    /// Whether all files were written that were to be.
    pub(super) is_written: bool,
    /// The failure that ended it, if one did.
    pub(super) problem: Option<SessionError>,
}

/// A view of a render, until its user closes it or wants to see another.
pub(super) trait Viewer {
    /// Shows a render until it is left. `is_moved` tells that the camera is not the scene's own.
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> Left;
}

impl Viewer for Window {
    fn show(&mut self, feed: &Feed, requests: &Sender<Request>, is_moved: bool) -> Left {
        self.run(feed, requests, is_moved)
    }
}

/// Renders, and writes what comes of it unless the camera moves on.
pub(super) fn render(
    task: Task<'_>,
    window: Option<&mut dyn Viewer>,
    events: &Sender<Event>,
    stop: &Receiver<Infallible>,
) -> Result<Rendered, SessionError> {
    let Task { settings, crew, head, begun, dump, samples, tev } = task;
    let sink = identity::film_sink(settings, head);
    let first_hit_tracer = crew.first_hit_tracer();
    let mattes = Mattes::of(&settings.job.scene);
    let gpu = crew.gpu_worker();

    std::thread::scope(|scope| {
        let (notes_out, notes) = bounded(16);
        let (samples_out, dump) = start_dump(scope, dump, samples);
        let (film_out, keeper) = start_keeper(scope, sink.as_ref(), &notes_out);
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
        let Wired { accumulator, batches, changes, threads } = start_workers(settings, crew, begun, outbox);
        let names = threads.names();

        // Notes end with the last of those who write.
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
        let (left_out, left) = bounded(1);
        let (ending_out, ending) = bounded(0);
        let finisher =
            Finisher { pictures: pictures.clone(), sink: sink.as_ref(), keeper, left, ending: ending_out };
        let finisher = Process::start(scope, "accumulator", move || finisher.run(accumulator, inbox));

        let left = match window {
            Some(window) => {
                scope.spawn(move || narrate_notes(&notes, events));
                let requests = start_saver(scope, pictures, ending, events);
                let layers = start_preview(settings, first_hit_tracer);
                let feed = Feed { snapshots, layers, stop: stop.clone() };
                let left = window.show(&feed, &requests, settings.job.moved.is_some());
                // It lies there before the accumulator sees that the viewer is left.
                let _ = left_out.send(left.clone());
                drop(viewing);
                Some(left)
            }
            None => {
                drop((pictures, ending));
                narrate(settings, &progress, &notes, events);
                None
            }
        };

        let finished = finisher.join().and_then(|finished| finished);
        let dumped = dump.map_or(Ok(Ok(())), Process::join);
        let painted = painter.join();
        let tev = tev.map_or(Ok(None), Process::join);
        let Finished { outcome, picture, layers, written, is_aside } = finished?;
        threads.join(|worker| outcome.unanswered.iter().any(|silent| silent.worker == worker));
        let is_written = written.is_ok() && [&dumped, &painted].iter().all(|it| matches!(it, Ok(Ok(()))));
        let abandoned = |silent: &_| finishing::describe_abandoned(silent, &names, gpu, settings.job.region);
        let problem = finishing::problem(&outcome, written, dumped, painted, abandoned);
        Ok(Rendered { outcome, picture, layers, tev: tev?, left, is_aside, is_written, problem })
    })
}

/// Workers that wait for orders, and the accumulator that is going to give them.
struct Wired {
    accumulator: Accumulator,
    batches: Receiver<SampleBatch>,
    changes: Receiver<Change>,
    threads: Threads,
}

/// Starts the workers, and tells the accumulator of them and of what is wanted.
fn start_workers(settings: &Settings, crew: Crew, begun: Begun, outbox: Outbox) -> Wired {
    let Begun { film, milestone, spent } = begun;
    let (job, stopping, outputs) = (&settings.job, &settings.stopping, &settings.outputs);
    let (region, workers) = (job.region, crew.workers());
    let planned = milestone.as_ref().filter(|milestone| milestone.plan.is_some());
    let time = stopping.time.map(|time| time.saturating_sub(spent));
    let deadline = time.and_then(|time| Instant::now().checked_add(time));
    let barriers: Vec<u32> = outputs.dump_at.iter().map(|at| job.first + at).collect();
    let [least, most] = film.seen_range().map(|seen| seen.min(u64::from(stopping.spp)) as u32);
    // Pixels that have stopped have passed the milestone, too.
    let least = planned.map_or(least, |milestone| milestone.samples);
    let schedule = Schedule::new(workers, region.len(), settings.range().end, deadline, barriers.clone())
        .starting_at(job.first + least, job.first + most);
    let schedule = crew.deal(region, schedule);
    let splatter = crew.splatter();
    let (batches_out, batches) = bounded(2 * workers);
    let (changes_out, changes) = bounded(workers);
    let RunningCrew { ports, threads } = crew.start(settings, &batches_out, &changes_out, None);
    let goal = |error| Goal { error, is_adaptive: stopping.adaptive, milestone };
    let accumulator = Accumulator::new(Configuration {
        first: job.first,
        splatter,
        light: crew::light(settings),
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

/// Starts the process that writes every sample, if they are to be written, and sends them on to the caller.
fn start_dump<'scope>(
    scope: &'scope Scope<'scope, '_>,
    dump: Option<SampleDump>,
    caller: Option<Sender<Vec<Sample>>>,
) -> (Option<Sender<Vec<Sample>>>, Option<Process<'scope, Written>>) {
    let Some(mut dump) = dump else { return (caller, None) };
    let (samples_out, samples) = bounded::<Vec<Sample>>(4);
    let keep = move || {
        for samples in samples {
            dump.write(&samples)?;
            if caller.as_ref().is_some_and(|caller| caller.send(samples).is_err()) {
                break;
            }
        }
        dump.finish().map(drop)
    };
    (Some(samples_out), Some(Process::start(scope, "sample dump", keep)))
}

/// Starts the process that writes the film file while the render runs, if there is one.
fn start_keeper<'scope>(
    scope: &'scope Scope<'scope, '_>,
    sink: Option<&'scope FilmSink>,
    notes: &Sender<String>,
) -> (Option<Sender<Piece>>, Option<Process<'scope, ()>>) {
    let Some(sink) = sink else { return (None, None) };
    let ((film_out, pieces), notes) = (bounded(2), notes.clone());
    let keep = move || sink.keep(&pieces, |line| note(&notes, line));
    (Some(film_out), Some(Process::start(scope, "film writer", keep)))
}

/// The channel of a viewer elsewhere.
type Remote = Sender<Arc<Snapshot>>;

/// Starts the process that sends pictures to a tev, if there is one. It comes back at the end, unless it has gone.
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

/// Starts the process that writes pictures whenever the window asks for it.
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

/// Starts the thread that looks at first hits for the window, if layers are wanted that need it. No end of the render
/// waits for it: a path may never come back from its first hit.
fn start_preview(settings: &Settings, integrator: Option<Arc<dyn Integrator>>) -> Receiver<Vec<Channel>> {
    let (layers_out, layers) = bounded(1);
    if let Some(integrator) = integrator {
        let settings = settings.clone();
        std::thread::spawn(move || {
            let mattes = Mattes::of(&settings.job.scene);
            // The viewer may have gone.
            let _ = layers_out.send(preview(&settings, &integrator, &mattes));
        });
    }
    layers
}
