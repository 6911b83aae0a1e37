//! Lists and changes jobs.

use super::broker::{Broker, JOBS};
use super::collect::{change, clean};
use super::mail::{JobMail, Mail, jobs};
use super::unit::Beat;
use super::{Stop, Tell};
use crate::fleet::{FleetError, JobState, JobSummary, Notice, Server};
use crate::output::Progress;
use crossbeam_channel::RecvTimeoutError;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The interval of [`watch`].
const LOOK: Duration = Duration::from_millis(500);

/// The time after which a silent worker no longer counts.
const SILENCE: Duration = Duration::from_secs(20);

/// Lists the jobs in the order of rendering.
pub fn list(server: &Server) -> Result<Vec<JobSummary>, FleetError> {
    let broker = Broker::connect(server)?;
    if !broker.has_stream(JOBS)? {
        return Ok(Vec::new());
    }
    Ok(jobs(&broker)?.iter().map(|job| job.summary()).collect())
}

/// Cancels a job: its units are removed, and its collector writes the samples so far. Of a job that is done, it removes
/// the files of the scene.
pub fn cancel(server: &Server, id: &str) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    let mut had_collector = false;
    change(&broker, id, |job| {
        job.state = JobState::Cancelled;
        had_collector = job.collector.is_some();
        Ok(())
    })?;
    broker.delete_queue(id)?;
    // The collector needs the results until it has ended.
    if had_collector { Ok(()) } else { clean(&broker, id) }
}

/// Changes the number of samples per pixel. A job that is done continues with the next `collect`.
pub fn extend(server: &Server, id: &str, samples: u32) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    let job = change(&broker, id, |job| {
        if job.state == JobState::Cancelled {
            return Err(FleetError::Job(format!("job {id} was cancelled; submit it again")));
        }
        let least = if job.target < u32::MAX { job.target } else { job.plan.end() };
        // An answer may have been lost: the same change again is no error.
        if samples < least {
            return Err(FleetError::Job(format!(
                "job {id} is to have {least} samples per pixel already; request more"
            )));
        }
        job.target = samples;
        job.state = JobState::Open;
        Ok(())
    })?;
    // That of a job that was done has been removed.
    broker.create_queue(&job)
}

/// Changes the priority.
pub fn prioritise(server: &Server, id: &str, priority: i32) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    change(&broker, id, |job| {
        job.priority = priority;
        Ok(())
    })
    .map(drop)
}

/// Shows the progress of a job until it is over.
pub fn watch(server: &Server, id: &str, stop: &Stop, tell: Tell<'_>) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    let mail = JobMail { broker: &broker, id };
    let beats = broker.listen(format!("stride.beat.{id}.*"))?;
    let notes = broker.listen(format!("stride.note.{id}"))?;
    let start = Instant::now();
    let mut workers: BTreeMap<String, (Instant, f64)> = BTreeMap::new();
    let mut before = None;
    loop {
        for beat in beats.try_iter().filter_map(|text| serde_json::from_slice::<Beat>(&text).ok()) {
            workers.insert(beat.worker, (Instant::now(), beat.done));
        }
        for note in notes.try_iter() {
            tell(Notice::Line(String::from_utf8_lossy(&note).into_owned()));
        }
        workers.retain(|_, (heard, _)| heard.elapsed() < SILENCE);
        match mail.job() {
            Ok((job, _)) => {
                let held = f64::from(job.held);
                let done = held + workers.values().map(|(_, done)| done).sum::<f64>();
                let before = *before.get_or_insert(held);
                let progress = Progress {
                    spp_done: done.min(f64::from(job.target)),
                    spp_before: before,
                    spp_target: (job.target < u32::MAX).then_some(job.target),
                    seconds: start.elapsed().as_secs_f64(),
                    ..Progress::default()
                };
                if job.state != JobState::Open {
                    tell(Notice::Ended(Progress { spp_done: held, ..progress }));
                    tell(Notice::Line(format!("job {id} is {}", job.state)));
                    return Ok(());
                }
                tell(Notice::Progress(progress, workers.len()));
            }
            Err(error) if error.is_temporary() => {}
            Err(error) => return Err(error),
        }
        if !matches!(stop.recv_timeout(LOOK), Err(RecvTimeoutError::Timeout)) {
            return Ok(());
        }
    }
}
