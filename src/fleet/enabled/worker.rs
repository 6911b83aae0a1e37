//! A worker: takes units, renders them, and sends their films.
//!
//! A unit is acknowledged when its result is stored. Until then the server is told at intervals that it is being rendered;
//! if that stops, the server gives it to another worker. A worker keeps nothing that cannot be made again.

use super::broker::{Answer, Broker, Delivery, JOBS, Queue};
use super::job::{Job, machine, token, unique};
use super::mail::{JobMail, Mail, jobs};
use super::pack::pack;
use super::renderer::{Renderer, UnitFilm};
use super::scene_files::Cache;
use super::unit::{Beat, Posted};
use super::{Stop, Tell};
use crate::fleet::{FleetError, JobState, Notice, Server, WorkerSettings};
use crossbeam_channel::{RecvTimeoutError, Sender, TryRecvError, bounded, select, tick};
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;
use std::fs::File;
use std::io::{self, BufReader, Write};
use std::time::{Duration, Instant};

/// The pause of a worker without work.
const PAUSE: Duration = Duration::from_millis(300);

/// The time after which the jobs are listed again: others may have come, or changed their priority.
const LISTED: Duration = Duration::from_secs(1);

/// The pause before a server that does not answer is asked again.
const LONG_PAUSE: Duration = Duration::from_secs(1);

/// The time after which a unit that this worker must not render is offered to others again.
const NOT_MINE: Duration = Duration::from_millis(500);

/// Attempts to store a message from one report that there is no room to the next.
const SAID_EVERY: u32 = 5;

/// The longest interval between messages about a unit.
const BEAT: Duration = Duration::from_secs(1);

/// Renders units of jobs until `stop` closes, or until no job is open if that is requested.
pub fn work(
    server: &Server,
    settings: &WorkerSettings,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
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
        open: Vec::new(),
        listed: None,
        current: None,
        refused: HashSet::new(),
    };
    let mut is_answering = true;
    loop {
        let pause = match worker.turn(stop, tell) {
            Ok(Turn::Worked) => Duration::ZERO,
            Ok(Turn::Idle) => PAUSE,
            Ok(Turn::NoJobs) if settings.ends_when_idle => return Ok(()),
            Ok(Turn::NoJobs) => PAUSE,
            Err(error) if error.is_temporary() => {
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
    /// The open jobs in the order of rendering, and when they were listed.
    open: Vec<Job>,
    listed: Option<Instant>,
    /// The renderer of the last job.
    current: Option<(String, Renderer)>,
    /// Jobs that this worker cannot render.
    refused: HashSet<String>,
}

impl Worker<'_> {
    /// Renders a unit of the first job that has one.
    fn turn(&mut self, stop: &Stop, tell: Tell<'_>) -> Result<Turn, FleetError> {
        if self.listed.is_none_or(|listed| listed.elapsed() > LISTED) {
            let jobs = match jobs(self.broker) {
                Ok(jobs) => jobs,
                // Before the first job is submitted.
                Err(FleetError::Unreachable(_)) if !self.broker.has_stream(JOBS)? => Vec::new(),
                Err(error) => return Err(error),
            };
            self.open = jobs.into_iter().filter(|job| job.state == JobState::Open).collect();
            self.listed = Some(Instant::now());
        }
        let open = self.open.clone();
        if open.is_empty() {
            return Ok(Turn::NoJobs);
        }
        for job in &open {
            let is_mine = job.device.is_offered_by(&self.settings.device)
                && !self.refused.contains(&job.id)
                && !job.barred.contains(&self.name);
            if !is_mine {
                continue;
            }
            if let Some(delivery) = self.take(job)? {
                if delivery.unit.not.contains(&self.name) || delivery.unit.job != job.id {
                    self.broker.hand_back(&delivery, NOT_MINE)?;
                    continue;
                }
                self.unit(job, &delivery, stop, tell)?;
                return Ok(Turn::Worked);
            }
        }
        Ok(Turn::Idle)
    }

    fn take(&mut self, job: &Job) -> Result<Option<Delivery>, FleetError> {
        if !self.queues.contains_key(&job.id) {
            let Some(queue) = self.broker.queue(&job.id)? else { return Ok(None) };
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
        taken
    }

    /// Renders a unit and sends its film. What fails is reported to the collector, and the unit is handed back.
    fn unit(
        &mut self,
        job: &Job,
        delivery: &Delivery,
        stop: &Stop,
        tell: Tell<'_>,
    ) -> Result<(), FleetError> {
        if let Err(error) = self.prepare(job) {
            self.broker.hand_back(delivery, Duration::ZERO)?;
            if error.is_temporary() {
                return Err(error);
            }
            self.refused.insert(job.id.clone());
            let note = format!("worker {} does not render job {}: {error}", self.name, job.id);
            tell(Notice::Line(note.clone()));
            return self.broker.say(format!("stride.note.{}", job.id), note.into_bytes());
        }
        let Some((_, mut renderer)) = self.current.take() else { return Ok(()) };
        let sent = self.render(job, delivery, &mut renderer, stop);
        self.current = Some((job.id.clone(), renderer));
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
                self.refused.insert(job.id.clone());
                let note = format!("worker {} gives job {} up: {error}", self.name, job.id);
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
        let render = job.settings.render(&loaded.scene, loaded.sources)?;
        let renderer = Renderer::new(render.threads(self.settings.threads).device(job.device.choice()))?;
        job.check(renderer.settings())?;
        self.current = Some((job.id.clone(), renderer));
        Ok(())
    }

    /// Renders and sends. Returns the time, or nothing if the unit is to be handed back.
    fn render(
        &self,
        job: &Job,
        delivery: &Delivery,
        renderer: &mut Renderer,
        stop: &Stop,
    ) -> Result<Option<Duration>, FleetError> {
        let (stop_out, unit_stop) = bounded::<Infallible>(0);
        let (progress_out, progress) = bounded::<f64>(1);
        let (done_out, done) = bounded::<Infallible>(0);
        std::thread::scope(|scope| {
            scope.spawn(move || self.keep(job, delivery, stop, stop_out, &progress, &done));
            let report = move |spp| {
                let _ = progress_out.try_send(spp);
            };
            let rendered = renderer.render(&delivery.unit.range(), &unit_stop, report)?;
            let sent = match &rendered {
                Some(film) => self.send(delivery, film, &unit_stop)?,
                None => false,
            };
            if sent {
                self.broker.acknowledge(delivery)?;
            }
            drop(done_out);
            Ok(rendered.filter(|_| sent).map(|film| film.took))
        })
    }

    /// Tells server and collector that a unit is being rendered, until `done` closes. Drops `unit_stop` if the job is
    /// cancelled, or the worker is asked to end and the unit takes too long.
    fn keep(
        &self,
        job: &Job,
        delivery: &Delivery,
        stop: &Stop,
        unit_stop: Sender<Infallible>,
        progress: &crossbeam_channel::Receiver<f64>,
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
            let beat = Beat { worker: self.name.clone(), first: delivery.unit.first, done: last };
            let text = serde_json::to_vec(&beat).unwrap_or_default();
            let _ = self.broker.say(format!("stride.beat.{}.{}", job.id, self.name), text);
            if !matches!(stop.try_recv(), Err(TryRecvError::Empty)) {
                let asked = *asked.get_or_insert_with(Instant::now);
                if asked.elapsed() >= self.settings.grace {
                    unit_stop = None;
                }
            }
            if unit_stop.is_some() && mail.job().is_ok_and(|(job, _)| job.state == JobState::Cancelled) {
                unit_stop = None;
            }
        }
    }

    /// Sends a film in parts, then its announcement. While the server has no room, waits for it. Returns false on a request
    /// to stop.
    fn send(&self, delivery: &Delivery, film: &UnitFilm, stop: &Stop) -> Result<bool, FleetError> {
        let mut posted = Posted {
            unit: delivery.unit.clone(),
            worker: self.name.clone(),
            nonce: unique("n"),
            parts: 0,
            bytes: film.bytes,
            digest: film.digest.clone(),
            seconds: film.took.as_secs_f64(),
        };
        let failed = |reason| FleetError::File { path: film.path.clone(), reason };
        let file = BufReader::with_capacity(1 << 20, File::open(&film.path).map_err(failed)?);
        let size = self.broker.part_bytes();
        let mut parts =
            Parts { worker: self, posted: &mut posted, stop, size, part: Vec::new(), failure: None };
        let [head, record] = film.layout;
        let packed = pack(file, head, record, &mut parts).and_then(|()| parts.end());
        match (packed, parts.failure) {
            (Ok(()), _) => {}
            // The parts stay until the unit is collected from another attempt.
            (Err(_), Some(Failure::Stopped)) => return Ok(false),
            (Err(_), Some(Failure::Server(error))) => return Err(error),
            (Err(error), None) => return Err(failed(error)),
        }
        let text = serde_json::to_vec(&posted).unwrap_or_default();
        self.store(posted.subject(), text, stop)
    }

    /// Stores a message. Waits while the server has no room or does not answer. Returns false on a request to stop.
    fn store(&self, subject: String, text: Vec<u8>, stop: &Stop) -> Result<bool, FleetError> {
        let mut attempts = 0_u32;
        loop {
            match self.broker.store(subject.clone(), text.clone(), None) {
                // An answer that was lost: it is there already.
                Ok(Answer::Stored(_) | Answer::Exists | Answer::Conflict) => return Ok(true),
                Err(error) if error.is_temporary() => {
                    // Again after a while, for those who have come to listen.
                    if attempts.is_multiple_of(SAID_EVERY) && matches!(error, FleetError::Full(_)) {
                        let job = subject.split('.').nth(2).unwrap_or_default().to_owned();
                        let note = format!("worker {} waits with a result: {error}", self.name);
                        let _ = self.broker.say(format!("stride.note.{job}"), note.into_bytes());
                    }
                }
                Err(error) => return Err(error),
            }
            attempts += 1;
            if !matches!(stop.recv_timeout(LONG_PAUSE), Err(RecvTimeoutError::Timeout)) {
                return Ok(false);
            }
        }
    }
}

/// Why a film was not sent.
enum Failure {
    Stopped,
    Server(FleetError),
}

/// Cuts a stream of bytes into parts, and stores each.
struct Parts<'a, 'w> {
    worker: &'a Worker<'w>,
    posted: &'a mut Posted,
    stop: &'a Stop,
    size: usize,
    part: Vec<u8>,
    failure: Option<Failure>,
}

impl Parts<'_, '_> {
    fn send(&mut self, part: Vec<u8>) -> io::Result<()> {
        let subject = self.posted.part_subject(self.posted.parts);
        self.failure = match self.worker.store(subject, part, self.stop) {
            Ok(true) => {
                self.posted.parts += 1;
                return Ok(());
            }
            Ok(false) => Some(Failure::Stopped),
            Err(error) => Some(Failure::Server(error)),
        };
        Err(io::Error::other("the film was not sent"))
    }

    /// Sends the rest.
    fn end(&mut self) -> io::Result<()> {
        let part = std::mem::take(&mut self.part);
        if part.is_empty() { Ok(()) } else { self.send(part) }
    }
}

impl Write for Parts<'_, '_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let room = self.size - self.part.len();
        let taken = bytes.len().min(room);
        self.part.extend_from_slice(&bytes[..taken]);
        if self.part.len() == self.size {
            let part = std::mem::take(&mut self.part);
            self.send(part)?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
