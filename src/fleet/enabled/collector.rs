//! The collector of a job: the only owner of its film.
//!
//! It takes results in the order of the server and adds each once: what the film holds decides, not what was delivered. A
//! result is removed from the server when a checkpoint with it is on the disk. Everything else can be lost: a
//! collector that continues from the checkpoint finds the missing units in the plan, and their results on the server.
//!
//! Time is an argument, and the server is a trait: the simulation runs this code with a thousand workers.

mod judging;
mod relieving;

use super::checks::{Checks, Verdict};
use super::gathering::{Gathering, Refusal};
use super::job::Job;
use super::mail::{Mail, modify};
use super::notes::plain;
use super::plan::Plan;
use super::relief::Relief;
use super::spool;
use super::unit::{Beat, Posted, Unit};
use crate::fleet::{FleetError, JobState};
use crate::output::Progress;
use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The interval at which the job is read again, and the queue is looked at.
const LOOK: Duration = Duration::from_millis(500);

/// The time after which a worker that has said nothing no longer counts.
pub(super) const SILENCE: Duration = Duration::from_secs(20);

/// The most results added in one step, and the bytes of films after which no further one is, so that the caller can show
/// progress.
const MOST_ADDED: usize = 64;
const MOST_BYTES: u64 = 256 << 20;

/// The most workers of which something is known. Units are issued ahead for no more.
pub(super) const MOST_WORKERS: usize = 20_000;

/// The most workers that are barred: the job is one message.
const MOST_BARRED: usize = 1000;

/// Speeds of this many results are kept for each worker.
const SPEEDS: usize = 4;

/// Renders a unit here, and returns the digest of its film; `None` if this machine cannot.
pub(super) type Judge<'a> = &'a mut dyn FnMut(&Unit) -> Result<Option<String>, FleetError>;

/// What a step has led to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// There is more to do at once.
    Busy,
    /// There is nothing to do before the next result.
    Waits,
    /// The film is complete, and written to its checkpoint.
    Complete,
    /// The job was cancelled.
    Cancelled,
}

/// The state of a worker, as its results and messages show it.
#[derive(Default)]
struct Seen {
    heard: Duration,
    /// Seconds for one sample of every pixel, in its last results.
    paces: VecDeque<f64>,
    /// The samples of the unit that it renders.
    under_way: f64,
    /// Units that were added without a check.
    unchecked: u32,
}

pub(super) struct Collector<'a, M> {
    mail: &'a M,
    owner: String,
    gathering: Gathering,
    job: Job,
    /// The number of the last result.
    after: u64,
    /// Whether the last step has left results for the next one.
    has_more: bool,
    checks: Checks,
    /// Units on the film that the checkpoint lacks, with the numbers of the messages of their results.
    unsaved: Vec<(Range<u32>, Vec<u64>)>,
    spool: PathBuf,
    checkpoint: Duration,
    saved: Duration,
    looked: Option<Duration>,
    /// The number of units that wait, and of those in the hands of workers, at the last look.
    queued: [u64; 2],
    workers: BTreeMap<String, Seen>,
    judge: Judge<'a>,
    notes: Vec<String>,
    /// Samples per pixel at the start.
    before: f64,
    relief: Relief,
}

impl<'a, M: Mail> Collector<'a, M> {
    /// A collector that owns the job's lease.
    pub(super) fn new(
        mail: &'a M,
        owner: String,
        gathering: Gathering,
        (spool, checkpoint): (&Path, Duration),
        judge: Judge<'a>,
    ) -> Result<Collector<'a, M>, FleetError> {
        let (job, _) = mail.job()?;
        let before = gathering.held().least() as f64;
        let mut collector = Collector {
            mail,
            owner,
            gathering,
            job,
            after: 0,
            has_more: false,
            checks: Checks::default(),
            unsaved: Vec::new(),
            spool: spool.join("result.film"),
            checkpoint,
            saved: Duration::ZERO,
            looked: None,
            queued: [0; 2],
            workers: BTreeMap::new(),
            judge,
            notes: Vec::new(),
            before,
            relief: Relief::default(),
        };
        collector.check_film()?;
        Ok(collector)
    }

    /// The film must consist of whole units: a unit cannot be added in part. Units that the server has lost are planned
    /// again.
    fn check_film(&mut self) -> Result<(), FleetError> {
        self.gathering.pass_gates();
        let held = self.gathering.held();
        if held.whole().last().is_some_and(|range| range.end > self.gathering.limit()) {
            return Err(FleetError::Job(format!(
                "the film has the samples {held}, and job {} has {} samples per pixel: request more with stride jobs extend, or name another film (--film)",
                self.job.id,
                self.gathering.limit()
            )));
        }
        self.job.plan.cover(held);
        let missing: u64 = self.job.plan.missing(held).map(|unit| u64::from(unit.end - unit.start)).sum();
        let fits = held.least() + missing == u64::from(self.job.plan.end())
            && held.whole().iter().all(|range| range.end <= self.job.plan.end());
        match fits {
            true => Ok(()),
            false => Err(FleetError::Job(format!(
                "the film has the samples {held}, which are not whole units of job {}; name another film (--film)",
                self.job.id
            ))),
        }
    }

    pub(super) fn gathering(&self) -> &Gathering {
        &self.gathering
    }

    pub(super) fn job(&self) -> &Job {
        &self.job
    }

    /// Lines for the user since the last call.
    pub(super) fn take_notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// A worker has said that it renders.
    pub(super) fn hear(&mut self, beat: Beat, now: Duration) {
        if beat.waits {
            self.relief.hear(now);
        }
        if let Some(seen) = self.seen(&beat.worker, now) {
            seen.under_way = beat.done.clamp(0.0, f64::from(u32::MAX));
        }
    }

    /// The state of a worker that has just been heard; nothing if there are too many.
    fn seen(&mut self, worker: &str, now: Duration) -> Option<&mut Seen> {
        if !self.workers.contains_key(worker) && self.workers.len() >= MOST_WORKERS {
            self.workers.retain(|_, seen| now.saturating_sub(seen.heard) < SILENCE);
            if self.workers.len() >= MOST_WORKERS {
                return None;
            }
        }
        let seen = self.workers.entry(worker.to_owned()).or_default();
        seen.heard = now;
        Some(seen)
    }

    /// Workers that were heard lately.
    pub(super) fn present(&self, now: Duration) -> usize {
        self.workers.values().filter(|seen| now.saturating_sub(seen.heard) < SILENCE).count()
    }

    pub(super) fn progress(&self, now: Duration) -> Progress {
        let held = self.gathering.held().least() as f64;
        let present = self.workers.values().filter(|seen| now.saturating_sub(seen.heard) < SILENCE);
        let end = self.gathering.end();
        let done = (held + present.map(|seen| seen.under_way).sum::<f64>()).min(f64::from(end));
        let pixels = f64::from(self.gathering.settings().job.region.len());
        Progress {
            spp_done: done,
            spp_before: self.before,
            spp_target: (end < u32::MAX).then_some(end),
            seconds: now.as_secs_f64(),
            samples: ((done - self.before).max(0.0) * pixels) as u64,
            time_limit: None,
            noise: self.gathering.noise(),
        }
    }

    /// Does what is due. After an error that is temporary it may be called again.
    pub(super) fn step(&mut self, now: Duration) -> Result<Step, FleetError> {
        let looks = self.looked.is_none_or(|looked| now.saturating_sub(looked) >= LOOK);
        if looks {
            self.looked = Some(now);
            self.refresh()?;
            // Before results are read: a unit that leaves the queue has its result on the server.
            self.queued = self.mail.queued()?;
            self.relieve(now)?;
        }
        if self.job.state == JobState::Cancelled {
            return Ok(Step::Cancelled);
        }
        let added = self.take_results(now);
        self.relief.observe(&added, now);
        let added = added?;
        self.gathering.pass_gates();
        if self.gathering.is_complete() {
            self.save(now)?;
            return Ok(Step::Complete);
        }
        // Units that check others may wait for a second worker.
        if looks && added == 0 && self.queued.iter().sum::<u64>() <= self.checks.len() as u64 {
            self.issue_lost(now)?;
            // A worker with a unit may have its result, and wait for room.
            if self.queued[1] == 0 {
                self.check_alone(now)?;
            }
        }
        let issued = self.issue(now);
        if let Err(FleetError::Full(_)) = issued {
            self.relief.hear(now);
        }
        issued?;
        if now.saturating_sub(self.saved) >= self.checkpoint && !self.unsaved.is_empty() {
            self.save(now)?;
        }
        Ok(if self.has_more { Step::Busy } else { Step::Waits })
    }

    /// Reads the job, which others may have changed.
    fn refresh(&mut self) -> Result<(), FleetError> {
        match self.mail.job() {
            Ok((job, _)) => self.set_job(job),
            // A job is removed when it is over.
            Err(FleetError::NoJob(_)) => {
                self.job.state = JobState::Cancelled;
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    fn set_job(&mut self, mut job: Job) -> Result<(), FleetError> {
        if !job.is_collected_by(&self.owner) && job.state != JobState::Cancelled {
            return Err(taken_over(&job.id));
        }
        restore(&mut job, &self.job.plan);
        self.gathering.set_target(job.target);
        self.job = job;
        Ok(())
    }

    /// Changes the job, if the lease is still ours.
    fn change(&mut self, mut change: impl FnMut(&mut Job)) -> Result<(), FleetError> {
        let (owner, plan) = (self.owner.clone(), self.job.plan.clone());
        let (job, _) = modify(self.mail, |job| {
            if job.is_collected_by(&owner) {
                restore(job, &plan);
                change(job);
            }
            Ok(())
        })?;
        self.set_job(job)
    }

    /// States what the checkpoint holds; fails if the lease is lost. A full server is no reason to stop: the results that
    /// fill it must be removed.
    fn state_held(&mut self) -> Result<(), FleetError> {
        let held = self.gathering.completed();
        match self.change(|job| job.held = held) {
            Err(FleetError::Full(_)) => self.refresh(),
            other => other,
        }
    }

    /// Fails if the lease is lost.
    fn is_owner(&self) -> Result<(), FleetError> {
        match self.mail.job() {
            Ok((job, _)) if job.is_collected_by(&self.owner) => Ok(()),
            Ok((job, _)) => Err(taken_over(&job.id)),
            // No other collector can have it.
            Err(FleetError::NoJob(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Writes the outputs, if the lease is still ours. Returns whether there are any samples.
    pub(super) fn write(&self) -> Result<bool, FleetError> {
        self.unless_taken_over(self.gathering.write(|| self.is_owner()))
    }

    /// The result of writing a file. A collector that takes the job over removes files that are being written.
    fn unless_taken_over<T>(&self, written: Result<T, FleetError>) -> Result<T, FleetError> {
        match written {
            Err(FleetError::Output(error)) => self.is_owner().and(Err(error.into())),
            other => other,
        }
    }

    /// Adds the results that have arrived, up to a number of them.
    fn take_results(&mut self, now: Duration) -> Result<usize, FleetError> {
        let (mut added, mut bytes) = (0, 0);
        while added < MOST_ADDED && bytes < MOST_BYTES {
            let Some((number, posted)) = self.mail.next_result(self.after)? else { break };
            match posted {
                Ok(posted) => {
                    let before = std::mem::replace(&mut self.after, number);
                    bytes = posted.bytes.saturating_add(bytes);
                    if let Err(error) = self.take(posted, now) {
                        // It is taken again.
                        self.after = self.after.min(before);
                        return Err(error);
                    }
                }
                Err(error) => {
                    self.after = number;
                    self.notes.push(format!("warning: {error}; it is ignored"));
                }
            }
            added += 1;
        }
        self.has_more = added == MOST_ADDED || bytes >= MOST_BYTES;
        Ok(added)
    }

    fn take(&mut self, posted: Posted, now: Duration) -> Result<(), FleetError> {
        let range = posted.unit.range();
        if !self.job.plan.contains(&range) {
            self.notes.push(format!(
                "warning: the result of worker {} for the samples {}..{} is dropped: the job has no such unit, or the server has lost it",
                posted.worker, range.start, range.end
            ));
            return self.mail.discard(&posted);
        }
        if let Some(seen) = self.seen(&posted.worker, now) {
            seen.under_way = 0.0;
            seen.paces.push_back(posted.seconds / f64::from(range.end - range.start));
            if seen.paces.len() > SPEEDS {
                seen.paces.pop_front();
            }
        }
        if self.gathering.has_some_of(&range) {
            // It came twice. The first one is on the server until the next checkpoint.
            let is_unsaved = self.unsaved.iter().any(|(unit, _)| *unit == range);
            return if is_unsaved { Ok(()) } else { self.mail.discard(&posted) };
        }
        if self.job.barred.contains(&posted.worker) {
            self.mail.discard(&posted)?;
            return self.issue_again(&range);
        }
        if !Checks::includes(&self.job.id, range.start, self.job.verify) {
            return self.add(posted, true);
        }
        if self.checks.holds(&posted) {
            return Ok(());
        }
        match self.checks.take(posted, now) {
            Verdict::Asks(unit) => self.mail.issue(&unit),
            Verdict::Again(posted) => self.mail.discard(&posted),
            Verdict::Agreed(posted) => self.add(posted, false),
            Verdict::Disagree(both) => self.judge(&both),
        }
    }

    /// Adds a result to the film.
    fn add(&mut self, posted: Posted, is_unchecked: bool) -> Result<(), FleetError> {
        let range = posted.unit.range();
        let layout = self.gathering.settings().job.layout();
        let mut messages = Vec::new();
        let added = match spool::fetch(self.mail, &posted, &layout, &self.spool) {
            Ok(numbers) => {
                messages = numbers;
                self.gathering.add(&posted, &self.spool)
            }
            Err(FleetError::Refused(why)) => Err(Refusal::Other(why)),
            Err(FleetError::Incomplete(why)) => {
                self.notes.push(format!(
                    "the result of worker {} for the samples {}..{} is incomplete on the server ({why}); it is rendered again",
                    posted.worker, range.start, range.end
                ));
                self.mail.discard(&posted)?;
                return self.issue_again(&range);
            }
            Err(error) => return Err(error),
        };
        let why = match added {
            Ok(()) => {
                if let Some(seen) = self.workers.get_mut(&posted.worker).filter(|_| is_unchecked) {
                    seen.unchecked += 1;
                }
                self.unsaved.push((range, messages));
                return Ok(());
            }
            Err(Refusal::Unread(error)) => return Err(error),
            Err(Refusal::Other(why)) => why,
            Err(Refusal::Spoiled(why)) => {
                // The results since the checkpoint are still on the server.
                self.gathering.reload()?;
                self.unsaved.clear();
                self.checks.clear();
                self.after = 0;
                why
            }
        };
        self.notes.push(format!(
            "warning: the result of worker {} for the samples {}..{} is refused: {}",
            posted.worker,
            range.start,
            range.end,
            plain(&why)
        ));
        self.bar(&posted)?;
        self.issue_again(&range)
    }

    fn issue_again(&self, range: &Range<u32>) -> Result<(), FleetError> {
        self.mail.issue(&Unit::new(&self.job.id, range))
    }

    /// Issues new units, as many as the workers can take before the next step.
    fn issue(&mut self, now: Duration) -> Result<(), FleetError> {
        let (limit, end) = (self.gathering.limit(), self.job.plan.end());
        if end >= limit {
            return Ok(());
        }
        // Those that have a unit without having been heard count as well.
        let workers = self.present(now).max(self.queued[1] as usize).clamp(1, MOST_WORKERS);
        let ahead = 2 * workers + 8;
        let outstanding = self.job.plan.missing(self.gathering.held()).take(ahead).count();
        if outstanding >= ahead {
            return Ok(());
        }
        let wanted = self.job.unit as f64 / 1000.0;
        let size = self.job.plan.next_size(self.pace(), wanted, limit - end, workers as u32);
        let more = (ahead - outstanding) as u32;
        let to = limit.min(end.saturating_add(size.saturating_mul(more)));
        self.change(|job| {
            job.plan.extend(to, size);
        })?;
        let id = self.job.id.clone();
        let new: Vec<Unit> = self
            .job
            .plan
            .units()
            .filter(|unit| unit.start >= end)
            .map(|unit| Unit::new(&id, &unit))
            .collect();
        new.iter().try_for_each(|unit| self.mail.issue(unit))
    }

    /// Seconds of one sample of every pixel: the median of the workers.
    fn pace(&self) -> Option<f64> {
        let slowest = |seen: &Seen| seen.paces.iter().copied().reduce(f64::max);
        let mut paces: Vec<f64> = self.workers.values().filter_map(slowest).collect();
        paces.sort_by(f64::total_cmp);
        paces.get(paces.len() / 2).copied()
    }

    /// Issues units again that were lost: they are missing, and none waits or is in the hands of workers.
    fn issue_lost(&mut self, now: Duration) -> Result<(), FleetError> {
        let limit = self.gathering.limit();
        if self.job.plan.missing(self.gathering.held()).next().is_none() {
            return Ok(());
        }
        // A result may have been passed over, or the server may have lost its last messages and uses their numbers again.
        self.after = 0;
        self.take_results(now)?;
        let held = self.gathering.held();
        let missing: Vec<Range<u32>> =
            self.job.plan.missing(held).filter(|unit| unit.start < limit).collect();
        for range in &missing {
            match self.checks.asked(range.start) {
                Some(unit) => self.mail.issue(&unit)?,
                None => self.issue_again(range)?,
            }
        }
        Ok(())
    }

    /// Writes the checkpoint, and only then removes its results from the server.
    pub(super) fn save(&mut self, now: Duration) -> Result<(), FleetError> {
        self.unless_taken_over(self.gathering.save(|| self.is_owner()))?;
        // A collector that has lost the lease must not touch the results.
        self.state_held()?;
        self.saved = now;
        while let Some((range, messages)) = self.unsaved.last() {
            self.mail.discard_unit(range, messages)?;
            self.unsaved.pop();
        }
        Ok(())
    }

    /// Gives the lease back, with the final state if there is one.
    pub(super) fn release(&mut self, state: Option<JobState>) -> Result<(), FleetError> {
        let (owner, held, target) = (self.owner.clone(), self.gathering.completed(), self.job.target);
        modify(self.mail, |job| {
            if job.is_collected_by(&owner) {
                job.collector = None;
                job.held = held;
                // It may have been extended meanwhile.
                if let Some(state) = state.filter(|_| job.state == JobState::Open && job.target == target) {
                    job.state = state;
                }
            }
            Ok(())
        })
        .map(drop)
    }
}

/// Restores what a server that has lost its last messages does not know any more: this collector has issued the units.
fn restore(job: &mut Job, plan: &Plan) {
    if job.plan.end() < plan.end() {
        job.plan = plan.clone();
    }
    job.target = job.target.max(job.plan.end());
}

fn taken_over(id: &str) -> FleetError {
    FleetError::Job(format!(
        "another collector has taken job {id} over, because this one was silent for too long; its film continues there"
    ))
}

impl<M> Drop for Collector<'_, M> {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.spool);
    }
}
