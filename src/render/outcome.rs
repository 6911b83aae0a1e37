//! The outcome of a render, its figures on the way, and failures of workers.

use super::batch::Traced;
use super::faint::Faint;
use super::schedule::Order;
use crate::film::RejectCounts;
use crate::film::{Film, Milestone, Reject};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Samples in the film, and those left out.
    pub samples: u64,
    /// How many of them were there before this run.
    pub before: u64,
    /// Samples and contributions left out.
    pub rejected: u64,
    /// Rays traced.
    pub rays: u64,
    /// Time from the first order to the last batch.
    pub elapsed: Duration,
    /// Time that adding took, without waiting for sinks.
    pub adding: Duration,
    /// Samples that every pixel has.
    pub spp: u32,
    /// What the error is by estimate, and what is asked for, where the render is to end at an error.
    pub noise: Option<[f64; 2]>,
}

impl Totals {
    /// Samples that this run made.
    pub fn made(&self) -> u64 {
        self.samples - self.before
    }
}

/// The result of a render.
pub struct Outcome {
    /// The film.
    pub film: Film,
    /// The figures.
    pub totals: Totals,
    /// The last milestone, where the render was to end at an error.
    pub milestone: Option<Milestone>,
    /// Whether every pixel has [`Totals::spp`] samples and no other.
    pub whole: bool,
    /// The worker that failed, if one did.
    pub failure: Option<WorkerFailure>,
    /// The workers that were lost, and whose work others took over.
    pub lost: Vec<WorkerFailure>,
    /// The workers that did not answer the request to stop.
    pub unanswered: Vec<Unanswered>,
    /// Whether the time was up, and it would have taken too long to come to a whole sample.
    pub overtime: bool,
    /// Samples that each worker made.
    pub made: Vec<u64>,
    /// The worker that owns each pixel in the end.
    pub owners: Arc<Vec<u32>>,
    /// The ends of pictures that were asked for and not reached.
    pub unreached: Vec<u32>,
    /// Some of the samples that were left out, or whose contributions were.
    pub rejects: Vec<(Traced, Reject)>,
    /// Numbers of samples and of contributions that this run left out.
    pub reject_counts: RejectCounts,
    /// The counts over the first samples of pixels.
    pub faint: Faint,
    /// Whether the run has warned of radiance that is too small for the film.
    pub has_warned_of_faint: bool,
}

impl Outcome {
    /// Counts what was done before, by a render that this one has gone on with; it may have had a worker more, or one
    /// less.
    pub fn follow(&mut self, earlier: &Outcome) {
        let totals = &mut self.totals;
        totals.before = earlier.totals.before;
        totals.rays += earlier.totals.rays;
        totals.elapsed += earlier.totals.elapsed;
        totals.adding += earlier.totals.adding;
        self.made.resize(self.made.len().max(earlier.made.len()), 0);
        self.made.iter_mut().zip(&earlier.made).for_each(|(made, before)| *made += before);
        self.lost.splice(0..0, earlier.lost.iter().cloned());
        self.rejects.splice(0..0, earlier.rejects.iter().cloned());
        self.rejects.truncate(NAMED_REJECTS);
        self.faint.merge(&earlier.faint);
        self.reject_counts.merge(&earlier.reject_counts);
        self.has_warned_of_faint |= earlier.has_warned_of_faint;
    }
}

/// A worker could not go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{worker} failed: {message}")]
pub struct WorkerFailure {
    /// Its number.
    pub index: usize,
    /// Which worker, as a user knows it.
    pub worker: String,
    /// Its message.
    pub message: String,
}

/// A worker that did not end when it was asked to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unanswered {
    /// Its number.
    pub worker: usize,
    /// The time that it had for an answer.
    pub within: Duration,
    /// The order that it held, and the slots of it whose samples had not come, if it held any.
    pub order: Option<(Order, Range<u32>)>,
}

/// How many rejected samples are remembered by name.
pub(super) const NAMED_REJECTS: usize = 8;
