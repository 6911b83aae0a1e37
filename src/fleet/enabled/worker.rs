//! A worker: takes units, renders them, and sends their films.
//!
//! A unit is acknowledged when its result is stored. Until then the server is told at intervals that it is being rendered;
//! if that stops, the server gives it to another worker. A worker keeps nothing that cannot be made again.

use super::broker::{Broker, Delivery, Queue};
use super::hooks;
use super::job::{Job, machine, token, unique};
use super::mail::{Changed, JobMail, Mail};
use super::posting::{Poster, random_pause, say};
use super::renderer::Renderer;
use super::scene_files::Cache;
use super::unit::Beat;
use super::{Stop, Tell, is_asked_to_stop};
use crate::fleet::{FleetError, JobState, Notice, Server, WorkerSettings};
use crate::session::SessionError;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, select, tick};
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;
use std::time::{Duration, Instant};

/// The pause of a worker without work.
const PAUSE: Duration = Duration::from_millis(300);

/// The time after which the jobs are listed again: others may have come, or changed their priority.
const LISTED: Duration = Duration::from_secs(1);

/// The pause before a server that does not answer is asked again.
const LONG_PAUSE: Duration = Duration::from_secs(1);

/// The time after which a unit that this worker must not render is offered to others.
const NOT_MINE: Duration = Duration::from_millis(50);

/// The time after which a job is tried again whose unit failed for a reason that may pass.
const LONG_REST: Duration = Duration::from_secs(30);

/// The longest interval between messages about a unit.
const BEAT: Duration = Duration::from_secs(1);

/// Renders units of jobs until `stop` closes, or until no job is open if that is requested.
pub fn work(
    server: &Server,
    settings: &WorkerSettings,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    if settings.name.as_deref() == Some("") {
        return Err(FleetError::Job("the name of a worker must not be empty".to_owned()));
    }
    let cache = Cache::open(&settings.cache, settings.cache_bytes)?;
    let broker = Broker::connect(server)?;
    let name = settings.name.as_deref().map_or_else(|| format!("{}-{}", machine(), unique("w")), token);
    tell(Notice::Line(format!("worker {name} waits for jobs")));
    let mut worker = Worker {
        broker: &broker,
        settings,
        name,
        cache,
        queues: HashMap::new(),
        open: Changed::default(),
        listed: None,
        current: None,
        refused: HashSet::new(),
        resting: HashMap::new(),
    };
    let mut is_answering = true;
    loop {
        let pause = match worker.turn(stop, tell) {
            Ok(Turn::Worked) => Duration::ZERO,
            Ok(Turn::Idle) => PAUSE,
            Ok(Turn::NoJobs) if settings.ends_when_idle => return Ok(()),
            Ok(Turn::NoJobs) => PAUSE,
            Err(error) if error.is_temporary() => {
                // A server that comes back may have lost its last messages.
                (worker.open, worker.listed) = (Changed::default(), None);
                if std::mem::take(&mut is_answering) {
                    tell(Notice::Line(format!("{error}; waiting for it")));
                }
                LONG_PAUSE
            }
            Err(error) => return Err(error),
        };
        if pause < LONG_PAUSE && !std::mem::replace(&mut is_answering, true) {
            tell(Notice::Line("the server answers again".to_owned()));
        }
        if !matches!(stop.recv_timeout(pause), Err(RecvTimeoutError::Timeout)) {
            return Ok(());
        }
    }
}

/// What a worker has done in a turn.
enum Turn {
    Worked,
    Idle,
    NoJobs,
}

struct Worker<'a> {
    broker: &'a Broker,
    settings: &'a WorkerSettings,
    name: String,
    cache: Cache,
    queues: HashMap<String, Queue>,
    /// The open jobs, and when their changes were read.
    open: Changed,
    listed: Option<Instant>,
    /// The renderer of the last job.
    current: Option<(String, Renderer)>,
    /// Jobs that this worker cannot render.
    refused: HashSet<String>,
    /// Jobs of which it takes no unit before this time, so that another worker takes the one that it must not render.
    resting: HashMap<String, Instant>,
}

impl Worker<'_> {
    /// Renders a unit of the first job that has one.
    fn turn(&mut self, stop: &Stop, tell: Tell<'_>) -> Result<Turn, FleetError> {
        if self.listed.is_none_or(|listed| listed.elapsed() > LISTED) {
            self.open.read(self.broker, |job| job.state == JobState::Open)?;
            self.listed = Some(Instant::now());
            // What is known of jobs that are over would add up.
            let is_open = |id: &String| self.open.jobs.iter().any(|job| job.id == *id);
            self.queues.retain(|id, _| is_open(id));
            self.resting.retain(|id, _| is_open(id));
            self.refused.retain(is_open);
        }
        let open = self.open.jobs.clone();
        if open.is_empty() {
            return Ok(Turn::NoJobs);
        }
        for job in &open {
            let is_mine = job.device.is_offered_by(&self.settings.device)
                && !self.refused.contains(&job.id)
                && !job.barred.contains(&self.name)
                && self.resting.get(&job.id).is_none_or(|until| *until <= Instant::now());
            if !is_mine {
                continue;
            }
            if let Some(delivery) = self.take(job, tell)? {
                if delivery.unit.not.contains(&self.name) || delivery.unit.job != job.id {
                    self.broker.hand_back(&delivery, NOT_MINE)?;
                    self.resting.insert(job.id.clone(), Instant::now() + random_pause());
                    continue;
                }
                self.unit(job, &delivery, stop, tell)?;
                return Ok(Turn::Worked);
            }
        }
        Ok(Turn::Idle)
    }

    fn take(&mut self, job: &Job, tell: Tell<'_>) -> Result<Option<Delivery>, FleetError> {
        if !self.queues.contains_key(&job.id) {
            let Some(queue) = self.broker.queue(&job.id)? else {
                if let Err(FleetError::NoJob(_)) = (JobMail { broker: self.broker, id: &job.id }).job() {
                    // It was removed, which is no message.
                    self.open.jobs.retain(|other| other.id != job.id);
                }
                return Ok(None);
            };
            self.queues.insert(job.id.clone(), queue);
        }
        let taken = self.queues.get(&job.id).map_or(Ok(None), |queue| self.broker.take(queue));
        if taken.is_err() {
            // The queue may have been removed or made anew.
            self.queues.remove(&job.id);
            if self.broker.queue(&job.id)?.is_none() {
                return Ok(None);
            }
        }
        match taken? {
            // One message must not end a worker.
            Some(Err(error)) => {
                tell(Notice::Line(format!("warning: {error}; it is ignored")));
                Ok(None)
            }
            Some(Ok(delivery)) => Ok(Some(delivery)),
            None => Ok(None),
        }
    }

    /// Renders a unit and sends its film. What fails is reported to the collector, and the unit is handed back.
    fn unit(
        &mut self,
        job: &Job,
        delivery: &Delivery,
        stop: &Stop,
        tell: Tell<'_>,
    ) -> Result<(), FleetError> {
        let (stop_out, unit_stop) = bounded::<Infallible>(0);
        let (progress_out, progress) = bounded::<f64>(1);
        let keeper = Keeper { broker: self.broker, worker: self.name.clone(), grace: self.settings.grace };
        let sent = std::thread::scope(|scope| {
            let (_open, done) = bounded::<Infallible>(0);
            // From the start: a scene may take longer than the server waits for a sign.
            scope.spawn(move || keeper.keep(job, delivery, stop, stop_out, &progress, &done));
            self.prepare(job)?;
            let Some((_, mut renderer)) = self.current.take() else { return Ok(None) };
            let report = move |spp| {
                let _ = progress_out.try_send(spp);
            };
            let sent = self.render(delivery, &mut renderer, &unit_stop, report, tell);
            self.current = Some((job.id.clone(), renderer));
            sent
        });
        match sent {
            Ok(Some(took)) => {
                let range = delivery.unit.range();
                tell(Notice::Line(format!(
                    "{} samples {}..{} in {:.1} s",
                    job.id,
                    range.start,
                    range.end,
                    took.as_secs_f64()
                )));
                Ok(())
            }
            Ok(None) => self.broker.hand_back(delivery, Duration::ZERO),
            Err(error) if error.is_temporary() => {
                // Another worker, or this one later, renders it again.
                let _ = self.broker.hand_back(delivery, Duration::ZERO);
                Err(error)
            }
            Err(error) => {
                self.broker.hand_back(delivery, Duration::ZERO)?;
                match may_pass(&error) {
                    true => drop(self.resting.insert(job.id.clone(), Instant::now() + LONG_REST)),
                    false => drop(self.refused.insert(job.id.clone())),
                }
                let note = format!("warning: worker {} does not render job {}: {error}", self.name, job.id);
                tell(Notice::Line(note.clone()));
                self.broker.say(format!("stride.note.{}", job.id), note.into_bytes())
            }
        }
    }

    /// Loads the scene of a job, and checks that it gives the samples of the job.
    fn prepare(&mut self, job: &Job) -> Result<(), FleetError> {
        if self.current.as_ref().is_some_and(|(id, _)| *id == job.id) {
            return Ok(());
        }
        self.current = None;
        let loaded = self.cache.load(self.broker, job)?;
        let render = job.settings.render(loaded)?;
        let renderer = Renderer::new(render.threads(self.settings.threads).device(job.device.choice()))?;
        job.check(renderer.settings())?;
        self.current = Some((job.id.clone(), renderer));
        Ok(())
    }

    /// Renders and sends. Returns the time, or nothing if the unit is to be handed back.
    fn render(
        &self,
        delivery: &Delivery,
        renderer: &mut Renderer,
        unit_stop: &Stop,
        report: impl Fn(f64) + Send,
        tell: Tell<'_>,
    ) -> Result<Option<Duration>, FleetError> {
        if hooks::hang(unit_stop) {
            return Ok(None);
        }
        let Some(film) = renderer.render(&delivery.unit.range(), unit_stop, report)? else { return Ok(None) };
        let poster = Poster { broker: self.broker, worker: &self.name };
        if !poster.post(delivery.unit.clone(), &film, unit_stop, tell)? {
            return Ok(None);
        }
        self.broker.acknowledge(delivery)?;
        Ok(Some(film.took))
    }
}

/// Whether the reason of an error may pass: a full disk, or a file that is on its way.
fn may_pass(error: &FleetError) -> bool {
    matches!(
        error,
        FleetError::File { .. }
            | FleetError::Incomplete(_)
            | FleetError::Output(_)
            | FleetError::Film(_)
            | FleetError::Session(SessionError::Output(_) | SessionError::Film(_))
    )
}

/// Tells server and collector that a unit is being rendered.
struct Keeper<'a> {
    broker: &'a Broker,
    worker: String,
    grace: Duration,
}

impl Keeper<'_> {
    /// Does so until `done` closes. Drops `unit_stop` if the job is over, or the worker is asked to end and the unit takes
    /// too long.
    fn keep(
        &self,
        job: &Job,
        delivery: &Delivery,
        stop: &Stop,
        unit_stop: Sender<Infallible>,
        progress: &Receiver<f64>,
        done: &Stop,
    ) {
        let mut unit_stop = Some(unit_stop);
        let ticks = tick((job.patience() / 4).min(BEAT));
        let mail = JobMail { broker: self.broker, id: &job.id };
        let mut asked: Option<Instant> = None;
        let mut last = 0.0;
        loop {
            select! {
                recv(done) -> _ => return,
                recv(ticks) -> _ => {}
            }
            last = progress.try_iter().last().unwrap_or(last);
            // Errors are those of a server that does not answer: the unit may come to another worker, too.
            let _ = self.broker.keep(delivery);
            let beat = Beat { worker: self.worker.clone(), done: last, waits: false };
            let _ = say(self.broker, &job.id, &beat);
            if is_asked_to_stop(stop) {
                let asked = *asked.get_or_insert_with(Instant::now);
                if asked.elapsed() >= self.grace {
                    unit_stop = None;
                }
            }
            if unit_stop.is_some() {
                match mail.job() {
                    Ok((job, _)) if job.state == JobState::Open => {}
                    Ok(_) | Err(FleetError::NoJob(_)) => unit_stop = None,
                    Err(_) => {}
                }
            }
        }
    }
}
