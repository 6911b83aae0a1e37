//! Lists and changes jobs.

use super::broker::{Broker, JOBS};
use super::collect::{change, clean};
use super::collector::{MOST_WORKERS, SILENCE};
use super::mail::{JobMail, Mail, job_subject, jobs};
use super::notes::{Notes, plain};
use super::unit::Beat;
use super::{Stop, Tell};
use crate::fleet::{FleetError, JobState, JobSummary, Notice, Server};
use crate::output::Progress;
use crossbeam_channel::RecvTimeoutError;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The interval of [`watch`].
const LOOK: Duration = Duration::from_millis(500);

/// Lists the jobs in the order of rendering.
pub fn list(server: &Server) -> Result<Vec<JobSummary>, FleetError> {
    let broker = Broker::connect(server)?;
    Ok(jobs(&broker)?.iter().map(|job| job.summary()).collect())
}

/// Cancels a job: its units are removed, and its collector writes the samples so far. Of a job that is done, it removes
/// the files of the scene.
///
/// Returns the name of the collector. If it has died, [`remove`] removes what it would have removed.
pub fn cancel(server: &Server, id: &str) -> Result<Option<String>, FleetError> {
    let broker = Broker::connect(server)?;
    let mut collector = None;
    change(&broker, id, |job| {
        job.state = JobState::Cancelled;
        collector = job.collector.as_ref().map(|lease| plain(&lease.owner));
        Ok(())
    })?;
    broker.delete_queue(id)?;
    // The collector needs the results until it has ended.
    if collector.is_none() {
        clean(&broker, id)?;
    }
    Ok(collector)
}

/// Removes a job that is over from the server, with everything that belongs to it.
pub fn remove(server: &Server, id: &str) -> Result<(), FleetError> {
    let broker = Broker::connect(server)?;
    change(&broker, id, |job| {
        if job.state == JobState::Open {
            return Err(FleetError::Job(format!(
                "job {id} is open; end it first with stride jobs cancel {id}"
            )));
        }
        // It cannot be extended from now on.
        job.state = JobState::Cancelled;
        Ok(())
    })?;
    clean(&broker, id)?;
    // Last, so that an interrupted removal can be repeated.
    broker.remove_all(JOBS, &job_subject(id)?)
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
                "job {id} already has a target of {least} samples per pixel; request more"
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
    let (mut before, mut shown) = (None, Notes::default());
    loop {
        for beat in beats.try_iter().filter_map(|text| Beat::parse(&text)) {
            if workers.len() < MOST_WORKERS || workers.contains_key(&beat.worker) {
                workers.insert(beat.worker, (Instant::now(), beat.done));
            }
        }
        notes.try_iter().filter_map(|text| shown.take(&text)).for_each(|line| tell(Notice::Line(line)));
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
            Err(FleetError::NoJob(_)) if before.is_some() => {
                tell(Notice::Line(format!("job {id} was removed")));
                return Ok(());
            }
            Err(error) => return Err(error),
        }
        if !matches!(stop.recv_timeout(LOOK), Err(RecvTimeoutError::Timeout)) {
            return Ok(());
        }
    }
}
