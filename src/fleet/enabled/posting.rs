//! Sends the film of a unit: in parts, then its announcement.
//!
//! The film is compressed into a file first. Thus its size is known, and nothing is sent for which there is no room. If
//! the room is taken by others meanwhile, the attempt ends and a later one begins anew. The collector removes the parts
//! of attempts that have ended, so that workers that hold parts each cannot wait for each other.

use super::broker::{Answer, Broker, RESULTS};
use super::hooks;
use super::job::unique;
use super::pack::pack;
use super::renderer::UnitFilm;
use super::unit::{Beat, Posted, Unit};
use super::{Stop, Tell};
use crate::fleet::{FleetError, Notice};
use crossbeam_channel::RecvTimeoutError;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek};
use std::time::Duration;

/// The pause before a server that does not answer is asked again.
const PAUSE: Duration = Duration::from_secs(1);

/// The shortest random pause, and the longest addition to it.
const AGAIN: [Duration; 2] = [Duration::from_millis(500), Duration::from_millis(1000)];

/// Bytes of a stored part beside its payload, at most.
const PART_OVERHEAD: u64 = 512;

/// Bytes of an announcement, at most.
const ANNOUNCEMENT: u64 = 4 << 10;

/// The result of an attempt.
enum Attempt {
    Stored,
    /// There is no room.
    Full(FleetError),
    Stopped,
}

/// Sends films of a worker.
pub(super) struct Poster<'a> {
    pub(super) broker: &'a Broker,
    pub(super) worker: &'a str,
}

impl Poster<'_> {
    /// Sends the film of a unit. Waits while the server has no room or does not answer. Returns false on a request to stop.
    pub(super) fn post(
        &self,
        unit: Unit,
        film: &UnitFilm,
        stop: &Stop,
        tell: Tell<'_>,
    ) -> Result<bool, FleetError> {
        let mut has_told = false;
        let mut posted = Posted {
            unit,
            worker: self.worker.to_owned(),
            nonce: String::new(),
            parts: 0,
            bytes: film.bytes,
            digest: film.digest.clone(),
            seconds: film.took.as_secs_f64(),
        };
        let path = film.path.with_extension("packed");
        let failed = |reason| FleetError::File { path: path.clone(), reason };
        let packed = || -> std::io::Result<(File, u64)> {
            let [head, record] = film.layout;
            let source = BufReader::with_capacity(1 << 20, File::open(&film.path)?);
            let mut out = BufWriter::with_capacity(1 << 20, File::create(&path)?);
            pack(source, head, record, &mut out)?;
            drop(out.into_inner()?);
            let file = File::open(&path)?;
            let bytes = file.metadata()?.len();
            Ok((file, bytes))
        };
        let (mut file, bytes) = packed().map_err(failed)?;
        loop {
            posted.nonce = unique("n");
            file.rewind().map_err(failed)?;
            let why = match self.attempt(&mut posted, &mut file, bytes, stop)? {
                Attempt::Stored => return Ok(true),
                Attempt::Stopped => return Ok(false),
                Attempt::Full(why) => why,
            };
            // With each attempt, for those who have come to listen since.
            let job = &posted.unit.job;
            let note = format!("worker {} waits with a result: {why}", self.worker);
            if !std::mem::replace(&mut has_told, true) {
                tell(Notice::Line(note.clone()));
            }
            let _ = self.broker.say(format!("stride.note.{job}"), note.into_bytes());
            let beat = Beat { worker: self.worker.to_owned(), done: 0.0, waits: true };
            let _ = say(self.broker, job, &beat);
            if !matches!(stop.recv_timeout(random_pause()), Err(RecvTimeoutError::Timeout)) {
                return Ok(false);
            }
        }
    }

    fn attempt(
        &self,
        posted: &mut Posted,
        file: &mut File,
        bytes: u64,
        stop: &Stop,
    ) -> Result<Attempt, FleetError> {
        let size = self.broker.part_bytes() as u64;
        let parts = bytes.div_ceil(size);
        let needed = bytes + parts * PART_OVERHEAD + ANNOUNCEMENT;
        let [used, most] = loop {
            match self.broker.room(RESULTS) {
                Ok(room) => break room,
                Err(error) if error.is_temporary() => {}
                Err(error) => return Err(error),
            }
            if is_stopped(stop) {
                return Ok(Attempt::Stopped);
            }
        };
        if needed > most {
            return Err(FleetError::Job(format!(
                "a result needs {needed} bytes on the server, which keeps at most {most} of results: raise max_file_store of the server and remove the stream {RESULTS}, or crop the picture"
            )));
        }
        if used.saturating_add(needed) > most {
            // Without numbers that differ each time.
            let why = format!("results fill the {most} bytes that it keeps of them");
            return Ok(Attempt::Full(FleetError::Full(why)));
        }
        posted.parts = parts as u32;
        for part in 0..posted.parts {
            let mut text = Vec::with_capacity(size as usize);
            let read = Read::by_ref(file).take(size).read_to_end(&mut text);
            read.map_err(|reason| FleetError::File { path: "the compressed film".into(), reason })?;
            match self.store(posted.part_subject(part), text, stop)? {
                Attempt::Stored => {}
                other => return Ok(other),
            }
        }
        hooks::die_before_announcement();
        let text = serde_json::to_vec(&posted).unwrap_or_default();
        self.store(posted.subject(), text, stop)
    }

    /// Stores a message. Waits while the server does not answer.
    fn store(&self, subject: String, text: Vec<u8>, stop: &Stop) -> Result<Attempt, FleetError> {
        loop {
            match self.broker.store(subject.clone(), text.clone(), None) {
                // An answer may have been lost: then it is there already.
                Ok(Answer::Stored(_) | Answer::Exists | Answer::Conflict) => return Ok(Attempt::Stored),
                Err(error @ FleetError::Full(_)) => return Ok(Attempt::Full(error)),
                Err(error) if error.is_temporary() => {}
                Err(error) => return Err(error),
            }
            if is_stopped(stop) {
                return Ok(Attempt::Stopped);
            }
        }
    }
}

/// Sends a message to the collector, if there is one.
pub(super) fn say(broker: &Broker, job: &str, beat: &Beat) -> Result<(), FleetError> {
    let text = serde_json::to_vec(beat).unwrap_or_default();
    broker.say(format!("stride.beat.{job}.{}", beat.worker), text)
}

/// Waits a moment. Returns whether the unit is to be stopped.
fn is_stopped(stop: &Stop) -> bool {
    !matches!(stop.recv_timeout(PAUSE), Err(RecvTimeoutError::Timeout))
}

/// A pause that is different each time, so that workers do not do the same together again and again.
pub(super) fn random_pause() -> Duration {
    let [least, more] = AGAIN;
    least + more.mul_f64(f64::from(Sha256::digest(unique("p"))[0]) / 256.0)
}
