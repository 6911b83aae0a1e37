//! Milestones: the pictures at powers of two of samples a pixel, by which it is decided where to end.

use super::configuration::Goal;
use crate::film::noise::FIRST_MILESTONE;
use crate::film::{Film, Milestone};

/// The way to an error.
pub(super) struct Milestones {
    asked: f64,
    is_adaptive: bool,
    last: Option<Milestone>,
    /// The sample index, exclusive, at which all wait for the next decision.
    next: Option<u32>,
}

impl Milestones {
    /// The way that is left with a film.
    pub(super) fn new(goal: Goal, film: &Film) -> Milestones {
        let Goal { error, is_adaptive, milestone } = goal;
        let [least, most] = film.seen_range();
        // A milestone with more than twice its samples behind it is of no use.
        let is_passed = |m: &Milestone| m.plan.is_some() || u64::from(m.samples) <= least;
        let last = milestone.filter(|m| is_passed(m) && most <= 2 * u64::from(m.samples));
        // The first power of two that no pixel has passed.
        let next = u32::try_from(most.max(1).next_power_of_two()).unwrap_or(1 << 31);
        let next = last.as_ref().map_or(next.max(FIRST_MILESTONE), |m| m.samples.saturating_mul(2));
        Milestones { asked: error, is_adaptive, last, next: Some(next) }
    }

    /// The last milestone that was passed.
    pub(super) fn last(&self) -> Option<&Milestone> {
        self.last.as_ref()
    }

    /// The last milestone, at the end.
    pub(super) fn into_last(self) -> Option<Milestone> {
        self.last
    }

    /// Where the next decision is due.
    pub(super) fn next(&self) -> Option<u32> {
        self.next
    }

    /// Where to end, if the last milestone decides it.
    pub(super) fn end(&self) -> Option<u32> {
        self.last.as_ref().and_then(|milestone| milestone.end(self.asked))
    }

    /// Whether pixels have stopped that the film's counts do not tell of.
    pub(super) fn is_planned(&self) -> bool {
        self.last.as_ref().is_some_and(|milestone| milestone.plan.is_some())
    }

    /// Passes the milestone that all wait at, with so many samples in every pixel that has not stopped, of `most` that
    /// it may get. What is decided follows from sums that are exact, and hence the same however they came about.
    pub(super) fn pass(&mut self, samples: u32, film: &Film, most: u32) {
        let (picture, last) = (film.picture(), self.last.as_ref());
        let milestone = match self.is_adaptive {
            false => Milestone::new(samples, picture, last),
            true => Milestone::adaptive(samples, picture, last, self.asked, most),
        };
        self.next = self.next.and_then(|next| next.checked_mul(2));
        self.last = Some(milestone);
    }

    /// The error by estimate at so many samples a pixel, and the one to end at.
    pub(super) fn noise(&self, spp: u32) -> Option<[f64; 2]> {
        let error = self.last.as_ref().and_then(|milestone| milestone.error_at(spp));
        error.map(|error| [error, self.asked])
    }
}
