//! The outcome of a render, its progress figures, and failures of workers.

use super::batch::Traced;
use super::faint::Faint;
use super::schedule::Order;
use crate::film::RejectCounts;
use crate::film::{Film, Milestone, Reject};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// The progress figures of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Samples in the film, rejected ones included.
    pub samples: u64,
    /// The samples among them from before this run.
    pub before: u64,
    /// Rejected samples and contributions.
    pub rejected: u64,
    /// Rays traced.
    pub rays: u64,
    /// Time from the first order to the last batch.
    pub elapsed: Duration,
    /// Time spent adding batches, without waiting for sinks.
    pub adding: Duration,
    /// Samples that every pixel has.
    pub spp: u32,
    /// The estimated and the requested error, if the render is to end at an error.
    pub noise: Option<[f64; 2]>,
}

impl Totals {
    /// Samples made by this run.
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
    /// The last milestone, if the render was to end at an error.
    pub milestone: Option<Milestone>,
    /// Whether every pixel has exactly [`Totals::spp`] samples.
    pub whole: bool,
    /// The worker that failed, if one did.
    pub failure: Option<WorkerFailure>,
    /// The workers that were lost and replaced by others.
    pub lost: Vec<WorkerFailure>,
    /// The workers that did not stop on request.
    pub unanswered: Vec<Unanswered>,
    /// Whether the time was up long before the next whole sample.
    pub overtime: bool,
    /// Samples made by each worker, indexed by worker number.
    pub made: Vec<u64>,
    /// The worker that owns each pixel at the end.
    pub owners: Arc<Vec<u32>>,
    /// The sample indices of requested pictures that were not reached.
    pub unreached: Vec<u32>,
    /// Some of the rejected samples, or samples with rejected contributions.
    pub rejects: Vec<(Traced, Reject)>,
    /// Numbers of samples and contributions that this run rejected.
    pub reject_counts: RejectCounts,
    /// Counts of faint radiance over the first samples of pixels.
    pub faint: Faint,
    /// Whether the run has warned about radiance that is too small for the film.
    pub has_warned_of_faint: bool,
}

impl Outcome {
    /// Adds the figures of an earlier render that this one has continued. The numbers of workers may differ by one.
    pub fn add_earlier(&mut self, earlier: &Outcome) {
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

/// A failure of a worker.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{worker} failed: {message}")]
pub struct WorkerFailure {
    /// Its number.
    pub index: usize,
    /// The name of the worker for users.
    pub worker: String,
    /// Its message.
    pub message: String,
}

/// A worker that did not stop on request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unanswered {
    /// Its number.
    pub worker: usize,
    /// Its time limit.
    pub within: Duration,
    /// Its unfinished order, if it had one, and the slots whose samples have not been received.
    pub order: Option<(Order, Range<u32>)>,
}

/// The maximum number of rejected samples that are listed.
pub(super) const NAMED_REJECTS: usize = 8;
