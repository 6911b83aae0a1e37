//! Collects the results of a job until its film is complete.

use super::broker::Broker;
use super::collector::{Collector, Step};
use super::gathering::Gathering;
use super::job::{Job, Lease, machine, unique};
use super::mail::{JobMail, Mail, modify};
use super::notes::Notes;
use super::renderer::Renderer;
use super::scene_files::Cache;
use super::unit::{Beat, Unit};
use super::uploads::forget;
use super::{Stop, Tell};
use crate::api::Render;
use crate::fleet::{Collecting, FleetError, JobState, Notice, Server};
use crate::session::{DeviceChoice, RenderSettings};
use crossbeam_channel::{RecvTimeoutError, bounded};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The pause before the server is asked for results again.
const PAUSE: Duration = Duration::from_millis(100);

/// The pause before a server that does not answer is asked again.
const LONG_PAUSE: Duration = Duration::from_millis(500);

/// The time without an answer of the server after which another collector gets its whole patience again.
const LONG_GAP: Duration = Duration::from_secs(2);

/// What follows from a request to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OnStop {
    /// The job continues without a collector.
    Leave,
    /// The outputs are written with the samples so far: the server ends, too.
    End,
}

/// Collects the results of a job until it is complete or cancelled, and writes the outputs. Continues from the film of an
/// earlier collector. On a request to stop, the checkpoint is written and the job continues without a collector, which is
/// an error because the outputs are not written.
pub fn collect(
    server: &Server,
    id: &str,
    collecting: &Collecting,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    let (job, _) = JobMail { broker: &broker, id }.job()?;
    let cache = Cache::open(&collecting.cache, u64::MAX)?;
    let loaded = patiently(stop, tell, || cache.load(&broker, &job))?.ok_or_else(|| stopped(id))?;
    let render = job.settings.render(loaded)?;
    collect_job(&broker, &job, render, (collecting, OnStop::Leave), stop, tell)
}

/// The render with the end and the outputs of a job.
pub(super) fn with_outputs(render: Render, job: &Job, collecting: &Collecting) -> Render {
    let render = render
        .range(None)
        .samples((job.target < u32::MAX).then_some(job.target))
        .noise(job.noise)
        .device(DeviceChoice::Cpu);
    let render = collecting.film.iter().fold(render, Render::film);
    collecting.pictures.iter().fold(render, Render::output)
}

/// The film file of checkpoints.
fn checkpoint(job: &Job, collecting: &Collecting) -> PathBuf {
    collecting.film.clone().unwrap_or_else(|| {
        let picture = collecting.pictures.first().map_or(Path::new("render"), PathBuf::as_path);
        let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
        picture.with_file_name(format!("{stem}-{}.film", job.id))
    })
}

pub(super) fn collect_job(
    broker: &Broker,
    job: &Job,
    render: Render,
    (collecting, on_stop): (&Collecting, OnStop),
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    let settings = with_outputs(render.clone(), job, collecting).settings()?;
    job.check(&settings)?;
    let owner = format!("{}-{}", machine(), unique("c"));
    let mail = JobMail { broker, id: &job.id };
    let before = acquire(&mail, &owner, stop, tell)?.ok_or_else(|| stopped(&job.id))?;
    let collected = std::thread::scope(|scope| {
        let (_open, done) = bounded(0);
        let owner = &owner;
        scope.spawn(move || keep_lease(broker, job, owner, &done));
        collect_owned(broker, job, (render, settings, owner.clone()), (collecting, on_stop), stop, tell)
    });
    if collected.is_err() {
        // Otherwise the next collector waits. If it fails, it does so.
        let _ = give_up(&mail, &owner, before);
    }
    collected
}

/// The state of a job and its number of samples per pixel, before its lease was taken.
#[derive(Clone, Copy)]
struct Before {
    state: JobState,
    target: u32,
}

/// Gives the lease back after an error, if it is ours.
fn give_up(mail: &impl Mail, owner: &str, before: Before) -> Result<(), FleetError> {
    modify(mail, |job| {
        if job.is_collected_by(owner) {
            job.collector = None;
            // It may have been extended or cancelled meanwhile.
            if job.state == JobState::Open && job.target == before.target {
                job.state = before.state;
            }
        }
        Ok(())
    })
    .map(drop)
}

/// The error of a collector that was asked to stop.
fn stopped(id: &str) -> FleetError {
    FleetError::Job(format!(
        "stopped; job {id} continues on the server: collect it with stride jobs collect {id}, or end it with stride jobs cancel {id}"
    ))
}

/// Renews the lease until `done` closes, however long a step of the collector takes.
fn keep_lease(broker: &Broker, job: &Job, owner: &str, done: &Stop) {
    let mail = JobMail { broker, id: &job.id };
    while let Err(RecvTimeoutError::Timeout) = done.recv_timeout(job.patience() / 4) {
        // Errors are those of a server that does not answer, or is full: then nobody else can take the lease either.
        let _ = modify(&mail, |job| {
            let lease = job.collector.iter_mut().find(|lease| lease.owner == owner);
            lease.into_iter().for_each(|lease| lease.renewed = lease.renewed.wrapping_add(1));
            Ok(())
        });
    }
}

/// Collects a job whose lease is ours.
fn collect_owned(
    broker: &Broker,
    job: &Job,
    (render, settings, owner): (Render, RenderSettings, String),
    (collecting, on_stop): (&Collecting, OnStop),
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    let mail = JobMail { broker, id: &job.id };
    let folder = tempfile::Builder::new().prefix("stride-collect-").tempdir();
    let folder = folder.map_err(|reason| FleetError::File { path: std::env::temp_dir(), reason })?;
    let mut renderer = None;
    // Whether the judge was stopped: its results are still on the server.
    let is_interrupted = Cell::new(false);
    let is_cpu = job.device.choice() == DeviceChoice::Cpu;
    let mut judge = |unit: &Unit| {
        if !is_cpu {
            return Ok(None);
        }
        let renderer = match &mut renderer {
            Some(renderer) => renderer,
            none => none.insert(Renderer::new(render.clone())?),
        };
        match renderer.render(&unit.range(), stop, |_| ())? {
            Some(film) => Ok(Some(film.digest)),
            None => {
                is_interrupted.set(true);
                Err(stopped(&job.id))
            }
        }
    };
    let heard = broker.listen(format!("stride.beat.{}.*", job.id))?;
    let notes = broker.listen(format!("stride.note.{}", job.id))?;
    let gathering = Gathering::open(settings, job.device.clone(), &checkpoint(job, collecting))?;
    let place = (folder.path(), collecting.checkpoint);
    let mut collector = Collector::new(&mail, owner, gathering, place, &mut judge)?;
    let start = Instant::now();
    let mut is_answering = true;
    let mut shown = Notes::default();
    let end = loop {
        let now = start.elapsed();
        heard.try_iter().filter_map(|text| Beat::parse(&text)).for_each(|beat| {
            collector.hear(beat, now);
        });
        notes.try_iter().filter_map(|text| shown.take(&text)).for_each(|line| tell(Notice::Line(line)));
        let step = collector.step(now);
        collector.take_notes().into_iter().for_each(|note| tell(Notice::Line(note)));
        let pause = match step {
            Ok(Step::Busy) => Duration::ZERO,
            Ok(Step::Waits) => PAUSE,
            Ok(end) => break end,
            Err(error) if error.is_temporary() => {
                if std::mem::take(&mut is_answering) {
                    tell(Notice::Line(format!("{error}; waiting for it, nothing is lost")));
                }
                LONG_PAUSE
            }
            Err(_) if is_interrupted.get() => Duration::ZERO,
            Err(error) => return Err(error),
        };
        if pause < LONG_PAUSE && !std::mem::replace(&mut is_answering, true) {
            tell(Notice::Line("the server answers again".to_owned()));
        }
        tell(Notice::Progress(collector.progress(now), collector.present(now)));
        if !matches!(stop.recv_timeout(pause), Err(RecvTimeoutError::Timeout)) {
            return match on_stop {
                OnStop::Leave => suspend(&mut collector, &job.id, start.elapsed(), tell),
                OnStop::End => {
                    // There is no other collector, and the server may have ended.
                    let is_written = collector.gathering().write(|| Ok(()))?;
                    say_written(&collector, collecting, is_written, tell);
                    collector.gathering().remove_checkpoint();
                    match is_written {
                        true => Ok(()),
                        false => Err(FleetError::Job("stopped before the first result".to_owned())),
                    }
                }
            };
        }
    };
    tell(Notice::Ended(collector.progress(start.elapsed())));
    finish(broker, &mut collector, end, collecting, stop, tell)
}

/// Repeats a request while the server does not answer. Returns nothing on a request to stop.
fn patiently<T>(
    stop: &Stop,
    tell: Tell<'_>,
    mut request: impl FnMut() -> Result<T, FleetError>,
) -> Result<Option<T>, FleetError> {
    let mut is_answering = true;
    loop {
        match request() {
            Err(error) if error.is_temporary() => {
                if std::mem::take(&mut is_answering) {
                    tell(Notice::Line(format!("{error}; waiting for it, nothing is lost")));
                }
            }
            other => return other.map(Some),
        }
        if !matches!(stop.recv_timeout(LONG_PAUSE), Err(RecvTimeoutError::Timeout)) {
            return Ok(None);
        }
    }
}

/// Takes the lease. If another collector has it, waits until it is no longer renewed. Returns nothing on a request to stop.
fn acquire(mail: &impl Mail, owner: &str, stop: &Stop, tell: Tell<'_>) -> Result<Option<Before>, FleetError> {
    let mut before = None;
    let mut seen: Option<(Lease, Instant)> = None;
    let mut read = Instant::now();
    loop {
        let Some((mut job, number)) = patiently(stop, tell, || mail.job())? else { return Ok(None) };
        if std::mem::replace(&mut read, Instant::now()).elapsed() > job.patience().max(LONG_GAP) {
            // The server was away, and the other collector could not renew its lease.
            seen.iter_mut().for_each(|(_, since)| *since = read);
        }
        if job.state == JobState::Cancelled {
            return Err(FleetError::Job(format!("job {} was cancelled", job.id)));
        }
        // An answer may have been lost.
        if job.collector.as_ref().is_some_and(|lease| lease.owner == owner) {
            return Ok(Some(before.unwrap_or(Before { state: JobState::Open, target: job.target })));
        }
        if let Some(lease) = &job.collector {
            match &seen {
                Some((before, since)) if before == lease => {
                    if since.elapsed() > job.patience() {
                        job.collector = None;
                    }
                }
                _ => {
                    if seen.is_none() {
                        tell(Notice::Line(format!(
                            "job {} has a collector, {}; waiting up to {} s until it is silent",
                            job.id,
                            lease.owner,
                            job.patience().as_secs_f64()
                        )));
                    }
                    seen = Some((lease.clone(), Instant::now()));
                }
            }
        }
        if job.collector.is_none() {
            let found = Before { state: job.state, target: job.target };
            before = Some(found);
            job.collector = Some(Lease { owner: owner.to_owned(), renewed: 0 });
            if job.state == JobState::Done {
                job.state = JobState::Open;
            }
            match patiently(stop, tell, || mail.replace(&job, number))? {
                None => return Ok(None),
                Some(Some(_)) => return Ok(Some(found)),
                Some(None) => seen = None,
            }
            continue;
        }
        if !matches!(stop.recv_timeout(PAUSE), Err(RecvTimeoutError::Timeout)) {
            return Ok(None);
        }
    }
}

/// Leaves a job that goes on without a collector. The error says so, since the outputs have not been written.
fn suspend<M: Mail>(
    collector: &mut Collector<'_, M>,
    id: &str,
    now: Duration,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    if let Err(error) = collector.save(now).and_then(|()| collector.release(None)) {
        // The results since the last checkpoint are still on the server.
        tell(Notice::Line(format!("warning: {error}")));
    }
    Err(stopped(id))
}

/// Says which outputs have been written.
fn say_written<M: Mail>(
    collector: &Collector<'_, M>,
    collecting: &Collecting,
    is_written: bool,
    tell: Tell<'_>,
) {
    let names: Vec<String> =
        collecting.pictures.iter().chain(&collecting.film).map(|path| path.display().to_string()).collect();
    if is_written && !names.is_empty() {
        let held = collector.gathering().held();
        tell(Notice::Line(format!("wrote {} (samples {held})", names.join(", "))));
    }
}

/// Writes the outputs, and removes what the job has left on the server.
fn finish<M: Mail>(
    broker: &Broker,
    collector: &mut Collector<'_, M>,
    end: Step,
    collecting: &Collecting,
    stop: &Stop,
    tell: Tell<'_>,
) -> Result<(), FleetError> {
    let job = collector.job().clone();
    let Some(is_written) = patiently(stop, tell, || collector.write())? else {
        return Err(FleetError::Job(format!(
            "stopped before the files were written; write them with stride jobs collect {}",
            job.id
        )));
    };
    say_written(collector, collecting, is_written, tell);
    let is_cancelled = end == Step::Cancelled;
    let state = (!is_cancelled).then_some(JobState::Done);
    patiently(stop, tell, || match collector.release(state).and_then(|()| clean(broker, &job.id)) {
        // It has been removed meanwhile.
        Err(FleetError::NoJob(_)) => Ok(()),
        other => other,
    })?;
    if is_cancelled {
        return Err(FleetError::Job(match is_written {
            true => format!("job {} was cancelled; the samples so far have been written", job.id),
            false => format!("job {} was cancelled before the first result", job.id),
        }));
    }
    if let Some([now, asked]) = collector.gathering().noise().filter(|[now, asked]| now > asked) {
        tell(Notice::Line(format!(
            "warning: the requested error of {asked} was not reached: the estimate is {now:.5}"
        )));
    }
    collector.gathering().remove_checkpoint();
    Ok(())
}

/// Removes units and results of a job, unless it was extended meanwhile. Files are kept until it is cancelled: it may be
/// extended.
pub(super) fn clean(broker: &Broker, id: &str) -> Result<(), FleetError> {
    let mail = JobMail { broker, id };
    let (job, _) = mail.job()?;
    if job.state == JobState::Open {
        return Ok(());
    }
    broker.delete_queue(id)?;
    for subject in ["part", "done"] {
        broker.remove_all(super::broker::RESULTS, &format!("stride.{subject}.{id}.>"))?;
    }
    if job.state == JobState::Cancelled { forget(broker, &job) } else { Ok(()) }
}

/// Changes a job on the server.
pub(super) fn change(
    broker: &Broker,
    id: &str,
    change: impl FnMut(&mut Job) -> Result<(), FleetError>,
) -> Result<Job, FleetError> {
    Ok(modify(&JobMail { broker, id }, change)?.0)
}
