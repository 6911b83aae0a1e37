//! The units of a job: which have been issued, which are missing, and how large the next ones are.

use crate::film::SampleRanges;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Units grow by this factor at most from one issue to the next: first speeds are uncertain.
const MOST_GROWTH: u32 = 16;

/// The most units of a job. More would only cost messages.
const MOST_UNITS: u32 = 1 << 20;

/// The number of runs from which on the size of units does not change any more: the job is one message.
const MOST_RUNS: usize = 1000;

/// The largest unit.
const MOST_SAMPLES: f64 = (1 << 20) as f64;

/// Units of equal size, one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Run {
    first: u32,
    end: u32,
    step: u32,
}

/// The issued units: their boundaries never change, so that results of one unit are in no other one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Plan(Vec<Run>);

impl Plan {
    /// Whether the units follow each other from sample 0 on, and there are not too many.
    pub(super) fn is_sound(&self) -> bool {
        let mut at = 0;
        for run in &self.0 {
            if run.first != at || run.end <= run.first || run.step == 0 {
                return false;
            }
            at = run.end;
        }
        self.len() <= u64::from(MOST_UNITS)
    }

    /// The number of units.
    fn len(&self) -> u64 {
        self.0.iter().map(|run| u64::from((run.end - run.first).div_ceil(run.step))).sum()
    }

    /// Whether this range is a unit.
    pub(super) fn contains(&self, range: &Range<u32>) -> bool {
        let run = self.0.iter().find(|run| (run.first..run.end).contains(&range.start));
        run.is_some_and(|run| {
            (range.start - run.first).is_multiple_of(run.step)
                && range.end == range.start.saturating_add(run.step).min(run.end)
        })
    }

    /// Samples per pixel of all units.
    pub(super) fn end(&self) -> u32 {
        self.0.last().map_or(0, |run| run.end)
    }

    /// The size of the last units.
    fn step(&self) -> Option<u32> {
        self.0.last().map(|run| run.step)
    }

    /// All units, ascending.
    pub(super) fn units(&self) -> impl Iterator<Item = Range<u32>> + '_ {
        self.0.iter().flat_map(|run| {
            (run.first..run.end)
                .step_by(run.step as usize)
                .map(move |first| first..first.saturating_add(run.step).min(run.end))
        })
    }

    /// Units of which a film lacks the samples.
    pub(super) fn missing<'a>(&'a self, held: &'a SampleRanges) -> impl Iterator<Item = Range<u32>> + 'a {
        // Both are ascending.
        let mut whole = held.whole().iter().peekable();
        self.units().filter(move |unit| {
            while whole.next_if(|range| range.end < unit.end).is_some() {}
            !whole.peek().is_some_and(|range| range.start <= unit.start && unit.end <= range.end)
        })
    }

    /// Adds units for the samples of a film that are beyond the last unit: the server has lost an older plan.
    pub(super) fn cover(&mut self, held: &SampleRanges) {
        for range in held.whole() {
            let (end, start) = (self.end(), range.start.max(self.end()));
            if range.end > start {
                self.extend(start, (start - end).div_ceil(64).max(self.step().unwrap_or(1)));
                self.extend(range.end, range.end - start);
            }
        }
    }

    /// Adds units of `size` up to the sample `end`. Returns the new ones.
    pub(super) fn extend(&mut self, end: u32, size: u32) -> Vec<Range<u32>> {
        let (first, step) = (self.end(), size.max(1));
        if end <= first {
            return Vec::new();
        }
        match self.0.last_mut() {
            // Its last unit is a whole one.
            Some(run) if run.step == step && (run.end - run.first).is_multiple_of(step) => run.end = end,
            _ => self.0.push(Run { first, end, step }),
        }
        self.units().skip_while(|unit| unit.start < first).collect()
    }

    /// The size of the next units, if a worker takes `pace` seconds for one sample of every pixel, a unit should take
    /// `wanted` seconds, and `left` samples remain for this many workers. The last units are small, so that no worker waits
    /// long for another. Sizes are powers of two and change rarely: each change is a run more.
    pub(super) fn next_size(&self, pace: Option<f64>, wanted: f64, left: u32, workers: u32) -> u32 {
        let least = self.least_size(left);
        let Some(pace) = pace.filter(|&pace| pace > 0.0) else { return least };
        if self.0.len() >= MOST_RUNS {
            return least.max(self.step().unwrap_or(1));
        }
        let by_time = (wanted / pace).clamp(1.0, MOST_SAMPLES) as u32;
        let size = by_time.min(self.step().unwrap_or(1).saturating_mul(MOST_GROWTH));
        let is_near = |step: &u32| size >= step - step / 3 && size / 2 < *step;
        let size = self.step().filter(is_near).unwrap_or_else(|| power_of_two(size));
        let by_rest = power_of_two(left.div_ceil(2 * workers.max(1)));
        size.min(by_rest).max(least)
    }

    /// The size with which half of the units that may still be issued are enough.
    fn least_size(&self, left: u32) -> u32 {
        let more = u64::from(MOST_UNITS).saturating_sub(self.len()) / 2;
        u64::from(left).div_ceil(more.max(1)).max(1) as u32
    }
}

/// The largest power of two that is not larger.
fn power_of_two(size: u32) -> u32 {
    1 << size.max(1).ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranges(plan: &Plan) -> Vec<Range<u32>> {
        plan.units().collect()
    }

    #[test]
    fn units_follow_each_other_whatever_is_added() {
        let mut plan = Plan::default();
        assert_eq!(plan.extend(2, 1), [0..1, 1..2]);
        assert_eq!(plan.extend(4, 1), [2..3, 3..4]);
        assert_eq!(plan.extend(9, 3), [4..7, 7..9]);
        assert_eq!(plan.extend(12, 3), std::slice::from_ref(&(9..12)));
        assert!(plan.extend(12, 7).is_empty());
        assert_eq!(ranges(&plan), [0..1, 1..2, 2..3, 3..4, 4..7, 7..9, 9..12]);
        assert!(plan.is_sound() && plan.end() == 12);
        let text = serde_json::to_string(&plan).unwrap();
        assert_eq!(serde_json::from_str::<Plan>(&text).unwrap(), plan);
        for bad in [r#"[{"first":1,"end":2,"step":1}]"#, r#"[{"first":0,"end":2,"step":0}]"#] {
            assert!(!serde_json::from_str::<Plan>(bad).unwrap().is_sound());
        }
    }

    #[test]
    fn missing_units_are_those_that_no_range_covers() {
        let mut plan = Plan::default();
        plan.extend(10, 2);
        let mut held = SampleRanges::default();
        assert_eq!(plan.missing(&held).count(), 5);
        held.join(&SampleRanges::prefix(2..6, 4, 4));
        held.join(&SampleRanges::prefix(8..10, 2, 2));
        assert_eq!(plan.missing(&held).collect::<Vec<_>>(), [0..2, 6..8]);
    }

    #[test]
    fn sizes_follow_speed_with_limits() {
        let mut plan = Plan::default();
        assert_eq!(plan.next_size(None, 10.0, 1000, 3), 1);
        assert_eq!(plan.next_size(Some(0.001), 10.0, 100_000, 3), 16);
        plan.extend(16, 16);
        assert_eq!(plan.next_size(Some(0.1), 10.0, 100_000, 3), 64);
        assert_eq!(plan.next_size(Some(60.0), 10.0, 100_000, 3), 1);
        assert_eq!(plan.next_size(Some(0.1), 10.0, 12, 3), 2);
        // Near the last size it stays.
        for (seconds, size) in [(0.99, 8), (0.9, 16), (0.33, 16), (0.3, 32)] {
            assert_eq!(plan.next_size(Some(seconds), 10.0, 100_000, 3), size, "{seconds}");
        }
    }

    #[test]
    fn plans_stay_small_whatever_the_speeds() {
        let mut plan = Plan::default();
        for turn in 0..20_000 {
            let (pace, end) = ([1e-6, 10.0][turn % 2], plan.end());
            let size = plan.next_size(Some(pace), 10.0, u32::MAX - end, 1);
            plan.extend(end.saturating_add(size.saturating_mul(8)), size);
        }
        assert!(plan.is_sound() && plan.0.len() <= MOST_RUNS + 1, "{}", plan.0.len());
        // The rest in one step.
        let size = plan.next_size(None, 10.0, u32::MAX - plan.end(), 1);
        plan.extend(u32::MAX, size);
        assert!(plan.is_sound() && plan.end() == u32::MAX, "{} units", plan.len());
    }

    #[test]
    fn only_units_are_contained() {
        let mut plan = Plan::default();
        plan.extend(9, 2);
        plan.extend(12, 3);
        for unit in ranges(&plan) {
            assert!(plan.contains(&unit));
        }
        for range in [1..3, 0..4, 0..1, 8..10, 9..11, 12..15, 14..15] {
            assert!(!plan.contains(&range), "{range:?}");
        }
    }

    #[test]
    fn a_film_beyond_the_plan_is_made_of_units() {
        let mut plan = Plan::default();
        plan.extend(4, 2);
        let mut held = SampleRanges::default();
        for range in [2..6, 8..12] {
            let len = u64::from(range.end - range.start);
            held.join(&SampleRanges::prefix(range, len, len));
        }
        plan.cover(&held);
        assert_eq!(ranges(&plan), [0..2, 2..4, 4..6, 6..8, 8..12]);
        assert_eq!(plan.missing(&held).collect::<Vec<_>>(), [0..2, 6..8]);
    }
}
