//! What the collector needs of a server, and jobs on a server.

use super::broker::{Answer, Broker, JOBS, RESULTS, UNITS};
use super::job::Job;
use super::pack::unpack;
use super::relief::PartCounts;
use super::unit::{Posted, Unit};
use crate::fleet::{FleetError, JobState};
use std::io::{self, Read, Write};
use std::ops::Range;

/// A result with its own number, if there is one; an error in its place if it is malformed.
pub(super) type NextResult = Result<Option<(u64, Result<Posted, FleetError>)>, FleetError>;

/// The messages of one job.
pub(super) trait Mail {
    /// The job, and the number of its message.
    fn job(&self) -> Result<(Job, u64), FleetError>;

    /// Replaces the job if its message still has this number. Returns the new number.
    fn replace(&self, job: &Job, number: u64) -> Result<Option<u64>, FleetError>;

    /// Issues a unit. One that waits already is not doubled.
    fn issue(&self, unit: &Unit) -> Result<(), FleetError>;

    /// Removes a unit that waits.
    fn withdraw(&self, unit: &Unit) -> Result<(), FleetError>;

    /// The number of units that wait, and of those in the hands of workers.
    fn queued(&self) -> Result<[u64; 2], FleetError>;

    /// The first result after the message with the number `after`, with its own number.
    fn next_result(&self, after: u64) -> NextResult;

    /// Writes the film file of a result. Returns the numbers of the messages with its parts. After an error of `out` the
    /// returned one is of any kind.
    fn film(&self, posted: &Posted, out: &mut dyn Write) -> Result<Vec<u64>, FleetError>;

    /// Removes a result.
    fn discard(&self, posted: &Posted) -> Result<(), FleetError>;

    /// Removes all results of a unit, given the numbers of messages that belong to them.
    fn discard_unit(&self, range: &Range<u32>, messages: &[u64]) -> Result<(), FleetError>;

    /// Results of which there are parts and no announcement, by their places in subjects, with the numbers of parts.
    fn unannounced(&self) -> Result<PartCounts, FleetError>;

    /// Removes the parts of a result, given its place in subjects.
    fn discard_parts(&self, place: &str) -> Result<(), FleetError>;
}

/// Changes a job, whatever others change meanwhile. The change may be applied several times.
pub(super) fn modify(
    mail: &impl Mail,
    mut change: impl FnMut(&mut Job) -> Result<(), FleetError>,
) -> Result<(Job, u64), FleetError> {
    loop {
        let (mut job, number) = mail.job()?;
        let before = job.clone();
        change(&mut job)?;
        if job == before {
            return Ok((job, number));
        }
        if let Some(number) = mail.replace(&job, number)? {
            return Ok((job, number));
        }
    }
}

/// The messages of a job on a server.
pub(super) struct JobMail<'a> {
    pub(super) broker: &'a Broker,
    pub(super) id: &'a str,
}

impl Mail for JobMail<'_> {
    fn job(&self) -> Result<(Job, u64), FleetError> {
        let missing = || FleetError::NoJob(self.id.to_owned());
        let stored = self.broker.last(JOBS, &job_subject(self.id)?)?.ok_or_else(missing)?;
        let job = Job::parse(&stored.payload)?;
        match job.id == self.id {
            true => Ok((job, stored.sequence)),
            false => {
                Err(FleetError::Refused(format!("job {} has the id of another one, {}", self.id, job.id)))
            }
        }
    }

    fn replace(&self, job: &Job, number: u64) -> Result<Option<u64>, FleetError> {
        match self.broker.store(job_subject(self.id)?, job.to_bytes(), Some(number))? {
            Answer::Stored(number) => Ok(Some(number)),
            Answer::Conflict | Answer::Exists => Ok(None),
        }
    }

    fn issue(&self, unit: &Unit) -> Result<(), FleetError> {
        let text = serde_json::to_vec(unit).unwrap_or_default();
        self.broker.store(unit.subject(), text, None).map(drop)
    }

    fn withdraw(&self, unit: &Unit) -> Result<(), FleetError> {
        self.broker.remove_all(UNITS, &unit.subject())
    }

    fn queued(&self) -> Result<[u64; 2], FleetError> {
        if let Some(queued) = self.broker.queued(self.id)? {
            return Ok(queued);
        }
        // Whoever submitted or extended the job may have died before that.
        let (job, _) = self.job()?;
        if job.state == JobState::Open {
            self.broker.create_queue(&job)?;
        }
        Ok([0; 2])
    }

    fn next_result(&self, after: u64) -> NextResult {
        let filter = format!("stride.done.{}.>", self.id);
        let stored = self.broker.next(RESULTS, after, &filter)?;
        let Some(stored) = stored else { return Ok(None) };
        let posted = Posted::parse(self.id, &stored.subject, &stored.payload);
        if posted.is_err() {
            // Otherwise it would be read again and again, and its parts would remain.
            if let Some(place) = Posted::place_in(self.id, &stored.subject) {
                self.discard_parts(place)?;
            }
            self.broker.remove(RESULTS, stored.sequence)?;
        }
        Ok(Some((stored.sequence, posted)))
    }

    fn film(&self, posted: &Posted, out: &mut dyn Write) -> Result<Vec<u64>, FleetError> {
        let (part, numbers) = (io::Cursor::default(), Vec::new());
        let mut parts = Parts { broker: self.broker, posted, numbers, part, failure: None };
        let unpacked = unpack(&mut parts, posted.bytes, out);
        if let Some(failure) = parts.failure {
            return Err(failure);
        }
        unpacked.map_err(|error| FleetError::Refused(error.to_string()))?;
        Ok(parts.numbers)
    }

    fn discard(&self, posted: &Posted) -> Result<(), FleetError> {
        self.broker.remove_all(RESULTS, &posted.subject())?;
        self.broker.remove_all(RESULTS, &posted.all_parts())
    }

    fn discard_unit(&self, range: &Range<u32>, messages: &[u64]) -> Result<(), FleetError> {
        messages.iter().try_for_each(|&number| self.broker.remove(RESULTS, number))?;
        // Those of other attempts, of which there are few.
        let Range { start, end } = range;
        self.broker.remove_all(RESULTS, &format!("stride.done.{}.{start}.{end}.>", self.id))?;
        self.broker.remove_all(RESULTS, &format!("stride.part.{}.{start}.{end}.>", self.id))
    }

    fn unannounced(&self) -> Result<PartCounts, FleetError> {
        let [parts, done] = ["part", "done"].map(|kind| format!("stride.{kind}.{}.", self.id));
        let mut counts = PartCounts::new();
        for subject in self.broker.subjects(RESULTS, &format!("{parts}>"))? {
            if let Some((place, _)) = subject.strip_prefix(&parts).and_then(|rest| rest.rsplit_once('.')) {
                *counts.entry(place.to_owned()).or_default() += 1;
            }
        }
        // Parts are stored before their announcement.
        for subject in self.broker.subjects(RESULTS, &format!("{done}>"))? {
            subject.strip_prefix(&done).map(|place| counts.remove(place));
        }
        Ok(counts)
    }

    fn discard_parts(&self, place: &str) -> Result<(), FleetError> {
        self.broker.remove_all(RESULTS, &format!("stride.part.{}.{place}.*", self.id))
    }
}

/// The subject of a job.
pub(super) fn job_subject(id: &str) -> Result<String, FleetError> {
    match !id.is_empty() && id.bytes().all(|b| b.is_ascii_alphanumeric()) {
        true => Ok(format!("stride.job.{id}")),
        false => Err(FleetError::NoJob(id.to_owned())),
    }
}

/// All jobs, in the order of rendering: by priority, then by age. Malformed ones are left out.
pub(super) fn jobs(broker: &Broker) -> Result<Vec<Job>, FleetError> {
    let mut changed = Changed::default();
    changed.read(broker, |_| true)?;
    Ok(changed.jobs)
}

/// Jobs of a server, of which only those that have changed are read again.
#[derive(Default)]
pub(super) struct Changed {
    /// In the order of rendering.
    pub(super) jobs: Vec<Job>,
    /// The number of the last message.
    after: u64,
}

impl Changed {
    /// Reads the changes: each is a message with a new number. Keeps jobs that are chosen.
    pub(super) fn read(
        &mut self,
        broker: &Broker,
        is_chosen: impl Fn(&Job) -> bool,
    ) -> Result<(), FleetError> {
        let Some(last) = broker.last_number(JOBS)? else {
            // Before the first job is submitted.
            *self = Changed::default();
            return Ok(());
        };
        if last < self.after {
            // The server has lost its last messages, and uses their numbers again.
            *self = Changed::default();
        }
        if last == self.after {
            return Ok(());
        }
        while let Some(stored) = broker.next(JOBS, self.after, "stride.job.*")? {
            self.after = stored.sequence;
            self.jobs.retain(|job| stored.subject.strip_prefix("stride.job.") != Some(&job.id));
            let job = Job::parse(&stored.payload).ok();
            let is_own = |job: &Job| stored.subject.strip_prefix("stride.job.") == Some(&job.id);
            self.jobs.extend(job.filter(|job| is_own(job) && is_chosen(job)));
        }
        self.jobs.sort_by(|a, b| {
            b.priority.cmp(&a.priority).then(a.created.cmp(&b.created)).then(a.id.cmp(&b.id))
        });
        Ok(())
    }
}

/// The parts of a result as one stream of bytes.
struct Parts<'a> {
    broker: &'a Broker,
    posted: &'a Posted,
    /// The numbers of the parts so far.
    numbers: Vec<u64>,
    part: io::Cursor<Vec<u8>>,
    /// The error that ended it.
    failure: Option<FleetError>,
}

impl Read for Parts<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.part.read(to)?;
            let next = self.numbers.len() as u32;
            if read > 0 || to.is_empty() || next == self.posted.parts {
                return Ok(read);
            }
            let part = match self.broker.last(RESULTS, &self.posted.part_subject(next)) {
                Ok(Some(part)) => part,
                Ok(None) => {
                    let message = format!("part {} of {} is missing", next + 1, self.posted.parts);
                    self.failure = Some(FleetError::Incomplete(message));
                    return Err(io::Error::other("a part is missing"));
                }
                Err(error) => {
                    self.failure = Some(error);
                    return Err(io::Error::other("the server does not answer"));
                }
            };
            self.part = io::Cursor::new(part.payload);
            self.numbers.push(part.sequence);
        }
    }
}
