//! The order of work: which samples every pixel gets next.
//!
//! All workers pass the same barriers, each in its own time: sample counts that every pixel reaches exactly.
//! A picture at a barrier is gathered stride by stride as the workers come by, and nobody waits.

use std::time::{Duration, Instant};

/// Work for one worker: these sample indices for every pixel of its stride.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    /// The first sample index.
    pub first: u32,
    /// One past the last.
    pub end: u32,
}

/// The most samples in one order: sums of them fit into 64 bits, and a stop is never far.
const LONGEST_ORDER: u32 = 256;
const _: () = assert!(LONGEST_ORDER <= crate::film::sums::MAX_COUNT);

/// How long an order should take: long enough that its messages cost nothing, short enough that a time
/// limit is kept.
const TARGET: Duration = Duration::from_millis(500);

/// Decides the barriers, one after the other.
#[derive(Debug)]
pub struct Schedule {
    /// Sample counts that pixels reach together, ascending.
    barriers: Vec<u32>,
    /// How many barriers each worker has been ordered to pass.
    ordered: Vec<usize>,
    /// Where everything ends.
    target: u32,
    deadline: Option<Instant>,
    /// Sample counts that must be barriers, ascending.
    stops: Vec<u32>,
}

impl Schedule {
    /// A schedule for some workers that ends at `target` samples a pixel, or before, at the first barrier
    /// after the deadline, and passes each of `stops`.
    pub fn new(workers: usize, target: u32, deadline: Option<Instant>, mut stops: Vec<u32>) -> Schedule {
        stops.sort_unstable();
        Schedule { barriers: Vec::new(), ordered: vec![0; workers], target, deadline, stops }
    }

    /// The next order for a worker, or none when there is nothing left to do. `pace` is the time that one
    /// sample of every pixel takes, as far as that is known.
    pub fn next(&mut self, worker: usize, pace: Option<Duration>) -> Option<Order> {
        let index = self.ordered[worker];
        if index == self.barriers.len() {
            let end = self.next_barrier(pace)?;
            self.barriers.push(end);
        }
        self.ordered[worker] += 1;
        let first = if index == 0 { 0 } else { self.barriers[index - 1] };
        Some(Order { first, end: self.barriers[index] })
    }

    /// How many orders a worker should have at a time: two, but only one where a second could end long after
    /// the deadline.
    pub fn ahead(&self, pace: Option<Duration>) -> usize {
        match self.deadline {
            Some(_) if pace.is_none_or(|pace| pace > TARGET / 10) => 1,
            _ => 2,
        }
    }

    /// The sample count where the render ends, once that is decided.
    pub fn last(&self) -> u32 {
        self.barriers.last().copied().unwrap_or(0)
    }

    fn next_barrier(&self, pace: Option<Duration>) -> Option<u32> {
        let from = self.last();
        let late = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
        if from >= self.target || (late && from > 0) {
            return None;
        }
        // The first samples come one by one, so that there is something to see; then orders double until
        // they are as long as they should be.
        let left = self.deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
        let length = left.map_or(TARGET, |left| TARGET.min(left / 4));
        let longest = pace.map_or(1, |pace| {
            (length.as_secs_f64() / pace.as_secs_f64().max(1e-9)).min(f64::from(LONGEST_ORDER)) as u32
        });
        let step = longest.clamp(1, from.max(1));
        let end = from.saturating_add(step).min(self.target);
        Some(self.stops.iter().copied().find(|&stop| stop > from && stop < end).unwrap_or(end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orders(schedule: &mut Schedule, worker: usize, pace: Option<Duration>) -> Vec<(u32, u32)> {
        std::iter::from_fn(|| schedule.next(worker, pace)).map(|o| (o.first, o.end)).collect()
    }

    #[test]
    fn orders_double_meet_every_stop_and_end_at_the_target() {
        let mut schedule = Schedule::new(2, 50, None, vec![30, 10]);
        let quick = Some(Duration::from_micros(1));
        let first = orders(&mut schedule, 0, quick);
        assert_eq!(first, [(0, 1), (1, 2), (2, 4), (4, 8), (8, 10), (10, 20), (20, 30), (30, 50)]);
        // The other worker passes the same barriers, whatever the pace has become.
        assert_eq!(orders(&mut schedule, 1, None), first);
    }

    #[test]
    fn slow_scenes_get_one_sample_at_a_time_and_orders_never_grow_without_bound() {
        let mut slow = Schedule::new(1, 5, None, vec![]);
        assert_eq!(orders(&mut slow, 0, Some(Duration::from_secs(9))).len(), 5);
        let mut fast = Schedule::new(1, 100_000, None, vec![]);
        let longest = orders(&mut fast, 0, Some(Duration::ZERO)).iter().map(|(a, b)| b - a).max();
        assert_eq!(longest, Some(LONGEST_ORDER));
    }

    #[test]
    fn a_deadline_in_the_past_still_gives_one_sample() {
        let mut schedule = Schedule::new(1, 100, Some(Instant::now()), vec![]);
        assert_eq!(orders(&mut schedule, 0, None), [(0, 1)]);
    }
}
