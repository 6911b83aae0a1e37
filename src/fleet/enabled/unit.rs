//! Units and results as messages describe them.

use super::notes::plain;
use crate::fleet::FleetError;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A range of samples of every pixel, to be rendered by one worker.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Unit {
    pub(super) job: String,
    pub(super) first: u32,
    pub(super) end: u32,
    /// Zero, or the number of the check: the same samples once more.
    pub(super) check: u32,
    /// Workers that must not render it, because they did before.
    pub(super) not: Vec<String>,
}

impl Unit {
    pub(super) fn new(job: &str, range: &Range<u32>) -> Unit {
        Unit { job: job.to_owned(), first: range.start, end: range.end, check: 0, not: Vec::new() }
    }

    pub(super) fn range(&self) -> Range<u32> {
        self.first..self.end
    }

    pub(super) fn subject(&self) -> String {
        format!("stride.unit.{}.{}.{}.{}", self.job, self.first, self.end, self.check)
    }

    pub(super) fn parse(text: &[u8]) -> Result<Unit, FleetError> {
        let unit: Unit = serde_json::from_slice(text)
            .map_err(|error| FleetError::Refused(plain(&format!("a unit is malformed: {error}"))))?;
        match unit.first < unit.end {
            true => Ok(unit),
            false => Err(FleetError::Refused("a unit has no samples".to_owned())),
        }
    }
}

/// The announcement of a result, whose film lies in parts on the server.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Posted {
    pub(super) unit: Unit,
    pub(super) worker: String,
    /// Distinguishes results of the same unit.
    pub(super) nonce: String,
    pub(super) parts: u32,
    /// Bytes of the film file.
    pub(super) bytes: u64,
    /// The digest of the film file, in hexadecimal digits: equal films have equal ones.
    pub(super) digest: String,
    /// Seconds that the worker took to render it.
    pub(super) seconds: f64,
}

impl Posted {
    pub(super) fn subject(&self) -> String {
        format!("stride.done.{}.{}", self.unit.job, self.place())
    }

    pub(super) fn part_subject(&self, part: u32) -> String {
        format!("stride.part.{}.{}.{part}", self.unit.job, self.place())
    }

    /// The subjects of all its parts.
    pub(super) fn all_parts(&self) -> String {
        format!("stride.part.{}.{}.*", self.unit.job, self.place())
    }

    /// Its part of subjects: two numbers and the nonce.
    pub(super) fn place(&self) -> String {
        format!("{}.{}.{}", self.unit.first, self.unit.end, self.nonce)
    }

    /// The place in the subject of an announcement of a job, if it has the form of one.
    pub(super) fn place_in<'a>(job: &str, subject: &'a str) -> Option<&'a str> {
        let place = subject.strip_prefix("stride.done.")?.strip_prefix(job)?.strip_prefix('.')?;
        (place.split('.').count() == 3 && place.split('.').all(is_token)).then_some(place)
    }

    /// Parses an announcement on the subject of a job. Whatever leads elsewhere is refused.
    pub(super) fn parse(job: &str, subject: &str, text: &[u8]) -> Result<Posted, FleetError> {
        let refuse = |why: String| FleetError::Refused(plain(&format!("a result is malformed: {why}")));
        let posted: Posted = serde_json::from_slice(text).map_err(|error| refuse(error.to_string()))?;
        let is_sound = posted.unit.job == job
            && posted.unit.first < posted.unit.end
            && is_token(&posted.nonce)
            && is_token(&posted.worker)
            && posted.subject() == subject
            && posted.seconds >= 0.0;
        if is_sound { Ok(posted) } else { Err(refuse(format!("its subject {subject} does not match it"))) }
    }
}

/// What a worker says of itself while it renders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Beat {
    pub(super) worker: String,
    /// Samples per pixel of the unit so far.
    pub(super) done: f64,
    /// Whether it has a result for which the server has no room.
    pub(super) waits: bool,
}

impl Beat {
    /// Parses the message of a worker; nothing if it is malformed.
    pub(super) fn parse(text: &[u8]) -> Option<Beat> {
        let beat: Beat = serde_json::from_slice(text).ok()?;
        is_token(&beat.worker).then_some(beat)
    }
}

/// Whether a text can be one token of a subject.
fn is_token(text: &str) -> bool {
    (1..=80).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_".contains(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_that_lead_elsewhere_are_refused() {
        let unit = Unit::new("j1", &(4..8));
        let posted = Posted {
            unit,
            worker: "w".into(),
            nonce: "n1".into(),
            parts: 1,
            bytes: 9,
            digest: String::new(),
            seconds: 1.0,
        };
        let parse = |posted: &Posted, subject: &str| {
            Posted::parse("j1", subject, &serde_json::to_vec(posted).unwrap()).is_ok()
        };
        assert!(parse(&posted, "stride.done.j1.4.8.n1"));
        assert_eq!(Posted::place_in("j1", "stride.done.j1.4.8.n1"), Some("4.8.n1"));
        for elsewhere in [
            "stride.done.j2.4.8.n1",
            "stride.done.j1.4.8",
            "stride.done.j1.4.*.n1",
            "stride.done.j1.4.8.n1.>",
        ] {
            assert_eq!(Posted::place_in("j1", elsewhere), None, "{elsewhere}");
        }
        assert!(!parse(&posted, "stride.done.j1.4.8.n2") && !parse(&posted, "stride.done.j2.4.8.n1"));
        let elsewhere = Posted { nonce: "n.>".into(), ..posted.clone() };
        assert!(!parse(&elsewhere, &elsewhere.subject()));
        let other = Posted { unit: Unit::new("j2", &(4..8)), ..posted };
        assert!(!parse(&other, &other.subject()));
    }
}
