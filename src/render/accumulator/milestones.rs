//! Milestones: the pictures at powers of two of samples per pixel, from which the end of the render is decided.

use super::configuration::Goal;
use crate::film::noise::FIRST_MILESTONE;
use crate::film::{Film, Milestone};

/// The milestones of a render with a requested error.
pub(super) struct Milestones {
    asked: f64,
    is_adaptive: bool,
    last: Option<Milestone>,
    /// The sample index, exclusive, at which all pixels wait for the next decision.
    next: Option<u32>,
}

impl Milestones {
    /// The remaining milestones of a render that starts with this film.
    pub(super) fn new(goal: Goal, film: &Film) -> Milestones {
        let Goal { error, is_adaptive, milestone } = goal;
        let [least, most] = film.seen_range();
        // A milestone is of no use at more than twice its samples.
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

    /// The sample index of the next decision.
    pub(super) fn next(&self) -> Option<u32> {
        self.next
    }

    /// The sample index at which the render ends, if the last milestone determines it.
    pub(super) fn end(&self) -> Option<u32> {
        self.last.as_ref().and_then(|milestone| milestone.end(self.asked))
    }

    /// Whether the plan has stopped pixels, which the film's counts do not show.
    pub(super) fn is_planned(&self) -> bool {
        self.last.as_ref().is_some_and(|milestone| milestone.plan.is_some())
    }

    /// Passes the milestone at which all pixels wait, with this number of samples in every pixel that has not stopped
    /// and
    /// `most` as the maximum. The decision depends only on exact sums, and hence not on the order of samples.
    pub(super) fn pass(&mut self, samples: u32, film: &Film, most: u32) {
        let (picture, last) = (film.picture(), self.last.as_ref());
        let milestone = match self.is_adaptive {
            false => Milestone::new(samples, picture, last),
            true => Milestone::adaptive(samples, picture, last, self.asked, most),
        };
        self.next = self.next.and_then(|next| next.checked_mul(2));
        self.last = Some(milestone);
    }

    /// The estimated error at this number of samples per pixel, and the requested error.
    pub(super) fn noise(&self, spp: u32) -> Option<[f64; 2]> {
        let error = self.last.as_ref().and_then(|milestone| milestone.error_at(spp));
        error.map(|error| [error, self.asked])
    }
}
