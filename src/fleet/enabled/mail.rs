//! What the collector needs of a server, and jobs on a server.

use super::broker::{Answer, Broker, JOBS, RESULTS};
use super::job::Job;
use super::pack::unpack;
use super::unit::{Posted, Unit};
use crate::fleet::FleetError;
use std::io::{self, Read, Write};
use std::ops::Range;

/// The messages of one job.
pub(super) trait Mail {
    /// The job, and the number of its message.
    fn job(&self) -> Result<(Job, u64), FleetError>;

    /// Replaces the job if its message still has this number. Returns the new number.
    fn replace(&self, job: &Job, number: u64) -> Result<Option<u64>, FleetError>;

    /// Issues a unit. One that waits already is not doubled.
    fn issue(&self, unit: &Unit) -> Result<(), FleetError>;

    /// The number of units that wait, and of those in the hands of workers.
    fn queued(&self) -> Result<[u64; 2], FleetError>;

    /// The first result after the message with the number `after`, with its own number.
    fn next_result(&self, after: u64) -> Result<Option<(u64, Result<Posted, FleetError>)>, FleetError>;

    /// Writes the film file of a result.
    fn film(&self, posted: &Posted, out: &mut dyn Write) -> Result<(), FleetError>;

    /// Removes a result.
    fn discard(&self, posted: &Posted) -> Result<(), FleetError>;

    /// Removes all results of a unit.
    fn discard_unit(&self, range: &Range<u32>) -> Result<(), FleetError>;
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
        Ok((Job::parse(&stored.payload)?, stored.sequence))
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

    fn queued(&self) -> Result<[u64; 2], FleetError> {
        self.broker.queued(self.id)
    }

    fn next_result(&self, after: u64) -> Result<Option<(u64, Result<Posted, FleetError>)>, FleetError> {
        let filter = format!("stride.done.{}.>", self.id);
        let stored = self.broker.next(RESULTS, after, &filter)?;
        Ok(stored.map(|stored| {
            let posted = Posted::parse(self.id, &stored.subject, &stored.payload);
            (stored.sequence, posted)
        }))
    }

    fn film(&self, posted: &Posted, out: &mut dyn Write) -> Result<(), FleetError> {
        let mut parts =
            Parts { broker: self.broker, posted, next: 0, part: io::Cursor::default(), failure: None };
        let unpacked = unpack(&mut parts, posted.bytes, out);
        if let Some(failure) = parts.failure {
            return Err(failure);
        }
        unpacked.map_err(|error| FleetError::Refused(error.to_string()))
    }

    fn discard(&self, posted: &Posted) -> Result<(), FleetError> {
        self.broker.purge(RESULTS, &posted.subject())?;
        self.broker.purge(RESULTS, &posted.all_parts())
    }

    fn discard_unit(&self, range: &Range<u32>) -> Result<(), FleetError> {
        let Range { start, end } = range;
        self.broker.purge(RESULTS, &format!("stride.done.{}.{start}.{end}.>", self.id))?;
        self.broker.purge(RESULTS, &format!("stride.part.{}.{start}.{end}.>", self.id))
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
    let (mut jobs, mut after) = (Vec::new(), 0);
    while let Some(stored) = broker.next(JOBS, after, "stride.job.*")? {
        after = stored.sequence;
        jobs.extend(Job::parse(&stored.payload).ok());
    }
    jobs.sort_by(|a: &Job, b| {
        b.priority.cmp(&a.priority).then(a.created.cmp(&b.created)).then(a.id.cmp(&b.id))
    });
    Ok(jobs)
}

/// The parts of a result as one stream of bytes.
struct Parts<'a> {
    broker: &'a Broker,
    posted: &'a Posted,
    next: u32,
    part: io::Cursor<Vec<u8>>,
    /// The error that ended it.
    failure: Option<FleetError>,
}

impl Read for Parts<'_> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.part.read(to)?;
            if read > 0 || to.is_empty() || self.next == self.posted.parts {
                return Ok(read);
            }
            let part = match self.broker.last(RESULTS, &self.posted.part_subject(self.next)) {
                Ok(Some(part)) => part.payload,
                Ok(None) => {
                    let message = format!("part {} of {} is missing", self.next + 1, self.posted.parts);
                    self.failure = Some(FleetError::Refused(message));
                    return Err(io::Error::other("a part is missing"));
                }
                Err(error) => {
                    self.failure = Some(error);
                    return Err(io::Error::other("the server does not answer"));
                }
            };
            self.part = io::Cursor::new(part);
            self.next += 1;
        }
    }
}
