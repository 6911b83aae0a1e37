//! The schedule: the order in which pixels get their samples.
//!
//! Every worker's stride is divided into *shares*, which are strides themselves, and an order covers one share. A
//! worker executes the orders of its own stride. When these are done, it takes over shares of a worker that has fallen
//! behind, so that a slow core does not delay the render. The samples of a pixel do not depend on the worker.
//!
//! All shares pass the same barriers: sample counts that every pixel reaches exactly. A picture at a barrier is
//! gathered share by share, without waiting. Only one worker at a time has orders for a share, so that its samples
//! arrive in order and a film always has the first samples of a pixel.

use super::stride::Stride;
use crate::film::Layout;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Work for one worker: a range of sample indices for every pixel of a share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// The share, as places in the region.
    pub stride: Stride,
    /// The first sample index.
    pub first: u32,
    /// One past the last sample index.
    pub end: u32,
}

/// The response to a worker's request for work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dispatch {
    /// An order.
    Order(Order),
    /// No work at present: ask again after the next completed order.
    Later,
    /// No work remains.
    Done,
}

/// The maximum number of samples per pixel in an order: their sums fit into 64 bits, and a stop is never far.
const LONGEST_ORDER: u32 = 256;
const _: () = assert!(LONGEST_ORDER <= crate::film::sums::MAX_COUNT);

/// The intended time from one barrier to the next: long enough that messages cost nothing, short enough to keep a time
/// limit.
const TARGET: Duration = Duration::from_millis(500);

/// The time after its deadline within which a render may complete a whole sample. None is started that is expected to
/// take longer.
pub const GRACE: Duration = Duration::from_millis(750);

/// Shares per stride: enough to take over in parts from a slow worker.
const SHARES: u32 = 8;

/// The minimum number of pixels in a share, unless its whole stride has fewer: with less, SIMD lanes are idle.
const FEWEST_PIXELS: u32 = 64;

/// Stripes of rows in a share, if there are enough rows: slow regions of a picture are distributed over all shares.
const STRIPES: u32 = 4;

/// The maximum number of rows of a stripe: with that many, few samples contribute to pixels beyond it.
const MOST_ROWS: u32 = 8;

/// The number of barriers by which a worker must be ahead of another to take over its shares. With one less, workers of
/// equal speed would exchange shares all the time.
const AHEAD: usize = 2;

/// The maximum speed of a fast worker relative to the others.
const MOST_TIMES: f64 = 65_536.0;

/// The number of shares of a stride of this many pixels.
fn shares_each(pixels: f64) -> u32 {
    ((pixels / f64::from(FEWEST_PIXELS)) as u32).clamp(1, SHARES)
}

/// Decides the barriers one after the other, and assigns the work in between.
#[derive(Debug)]
pub struct Schedule {
    /// Sample counts that pixels reach together, ascending.
    barriers: Vec<u32>,
    /// The present workers, each with its speed relative to the initial ones.
    workers: BTreeMap<usize, f64>,
    /// Pixels of the region.
    pixels: u32,
    shares: Vec<Share>,
    /// The number of parts into which each share is to be divided once it has no unfinished order.
    cuts: u32,
    /// The sample index at which the schedule begins.
    start: u32,
    /// Samples that some pixels already have.
    most: u32,
    /// The sample index at which the schedule ends.
    target: u32,
    /// A barrier at which all shares wait for a decision.
    gate: Option<u32>,
    deadline: Option<Instant>,
    /// Sample counts that must be barriers, ascending.
    stops: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Share {
    stride: Stride,
    /// The worker whose stride it is part of.
    owner: usize,
    /// The number of barriers up to which orders have been given.
    ordered: usize,
    /// Samples that each of its pixels has.
    completed: u32,
    /// The worker with unfinished orders for it, and their number.
    holder: Option<usize>,
    under_way: u32,
    /// Whether it is to be divided once it has no unfinished order.
    is_to_be_cut: bool,
}

impl Share {
    fn new(stride: Stride, owner: usize) -> Share {
        Share { stride, owner, ordered: 0, completed: 0, holder: None, under_way: 0, is_to_be_cut: false }
    }

    fn is_open_to(&self, worker: usize) -> bool {
        !self.is_to_be_cut && self.holder.is_none_or(|holder| holder == worker)
    }
}

impl Schedule {
    /// A schedule for these workers, possibly none, over a region of this many pixels. It ends at `target` samples per
    /// pixel, or earlier at the first barrier after the deadline, or the last one that is expected within [`GRACE`] of
    /// it. It passes each of `stops`. Every pixel gets at least one sample.
    pub fn new(
        workers: usize,
        pixels: u32,
        target: u32,
        deadline: Option<Instant>,
        mut stops: Vec<u32>,
    ) -> Schedule {
        stops.sort_unstable();
        let a_worker = match workers {
            // There is no worker to help.
            0 | 1 => 1,
            _ => shares_each(f64::from(pixels) / workers as f64),
        };
        // Share i is the stride of places i, i + n, i + 2n, … for n shares in all. Without workers they are kept for
        // the first that joins.
        let owners = workers.max(1);
        let n = owners as u32 * a_worker;
        let shares = (0..n).map(|i| Share::new(Stride::every(n, i), i as usize % owners)).collect();
        Schedule {
            barriers: Vec::new(),
            workers: (0..workers).map(|worker| (worker, 1.0)).collect(),
            pixels,
            shares,
            cuts: 1,
            start: 0,
            most: 0,
            target,
            gate: None,
            deadline,
            stops,
        }
    }

    /// Makes shares of stripes of rows instead of pixels, for a region with rows of this width: weighted samples are
    /// summed over neighbouring pixels.
    pub fn in_stripes(mut self, pixels: u32, width: u32) -> Schedule {
        // All shares have the same size.
        let step = self.shares.first().map_or(1, |share| share.stride.step);
        let rows = (pixels / width / step.saturating_mul(STRIPES)).clamp(1, MOST_ROWS);
        // With fewer rows than stripes in a step, stripes are parts of a row.
        let stripe = (rows * width).min(pixels.div_ceil(step)).max(1);
        for share in &mut self.shares {
            let Stride { first, step, run } = share.stride;
            share.stride = Stride { first: first * stripe, step: step * stripe, run: run * stripe };
        }
        self
    }

    /// Begins at this sample index: earlier samples exist already, or are made elsewhere. Some pixels have samples up
    /// to
    /// `most` already, so that the render cannot end before.
    pub fn starting_at(mut self, start: u32, most: u32) -> Schedule {
        (self.start, self.most) = (start, most);
        self.shares.iter_mut().for_each(|share| share.completed = start);
        self
    }

    /// Makes the last worker's stride wider: it is this many times as fast as the others.
    pub fn with_faster(mut self, pixels: u32, times: f64) -> Schedule {
        let last = self.workers.len().saturating_sub(1);
        self.workers.insert(last, times);
        let others = last as u32;
        let a_worker = shares_each(f64::from(pixels) / (f64::from(others) + times));
        // In units of one share of another worker.
        let wide = (times * f64::from(a_worker)).round().clamp(1.0, MOST_TIMES) as u32;
        let narrow = others * a_worker;
        let step = narrow + wide;
        self.shares = (0..narrow)
            .map(|i| Share::new(Stride::every(step, i), (i % others) as usize))
            .chain((0..SHARES.min(wide)).map(|i| {
                let whole = Stride { first: narrow, step, run: wide };
                let part = if wide == 1 { whole } else { whole.split(i, SHARES.min(wide)) };
                Share::new(part, last)
            }))
            .collect();
        self
    }

    /// The gate that all shares have reached and wait at, if there is one.
    pub fn waits_at(&self) -> Option<u32> {
        self.gate.filter(|&gate| gate < self.target && gate == self.completed())
    }

    /// Opens the gate: the schedule ends at `end`, if given, and the next decision is due at `gate`.
    pub fn decide(&mut self, end: Option<u32>, gate: Option<u32>) {
        self.target = end.map_or(self.target, |end| end.max(self.most).min(self.target));
        self.gate = gate;
    }

    /// The sample index at which the schedule ends, if it is known.
    pub fn target(&self) -> u32 {
        self.target
    }

    /// The number of shares.
    pub fn shares(&self) -> usize {
        self.shares.len()
    }

    /// The next order for a worker. `pace` is the time for one sample of every pixel, if it is known.
    pub fn next(&mut self, worker: usize, pace: Option<Duration>) -> Dispatch {
        let own = self.least_advanced(|share| share.owner == worker, worker);
        let own = own.filter(|&share| self.has_next(share, pace));
        let others = self.least_advanced(|share| share.owner != worker, worker);
        let others = others.filter(|&share| self.shares[share].ordered < self.barriers.len());
        let advance = |share: usize| self.shares[share].ordered;
        let chosen = match (own, others) {
            (Some(own), Some(other)) if advance(other) + AHEAD <= advance(own) => Some(other),
            (own, other) => own.or(other),
        };
        match chosen {
            Some(share) => Dispatch::Order(self.order(share, worker)),
            None if self.is_over(pace) => Dispatch::Done,
            None => Dispatch::Later,
        }
    }

    /// Records that an order for a share has been completed: its pixels have `spp` samples now.
    pub fn complete(&mut self, stride: Stride, spp: u32) {
        // All shares begin at different places.
        let Some(share) = self.shares.iter_mut().find(|share| share.stride.first == stride.first) else {
            return;
        };
        share.completed = spp;
        share.under_way -= 1;
        if share.under_way == 0 {
            share.holder = None;
            if share.is_to_be_cut {
                self.cut();
            }
        }
    }

    /// Adds a worker of this speed relative to the initial ones. It gets its part of the shares; if there are too few
    /// shares for that, they are divided once they have no unfinished orders.
    pub fn join(&mut self, worker: usize, speed: f64) {
        self.workers.insert(worker, speed);
        let workers = self.workers.len() as u32;
        let wanted = workers * shares_each(f64::from(self.pixels) / f64::from(workers));
        let wanted = wanted.min(self.pixels);
        let there = self.shares.len() as u32;
        if self.shares.iter().any(|share| share.is_to_be_cut) {
            self.cuts = self.cuts.max(wanted.div_ceil(there));
        } else if there < wanted {
            self.cuts = wanted.div_ceil(there);
            self.shares.iter_mut().for_each(|share| share.is_to_be_cut = true);
        }
        self.cut();
    }

    /// Removes a worker that leaves or is lost: its unfinished work is assigned again, to the others, which own its
    /// shares from now on.
    pub fn lose(&mut self, worker: usize) {
        self.workers.remove(&worker);
        for share in &mut self.shares {
            if share.holder == Some(worker) {
                share.ordered -= share.under_way as usize;
                share.under_way = 0;
                share.holder = None;
            }
        }
        self.cut();
    }

    /// Divides the shares that are to be divided and have no unfinished orders, and distributes them among the workers.
    fn cut(&mut self) {
        let (cuts, mut all) = (self.cuts, Vec::with_capacity(self.shares.len()));
        for share in std::mem::take(&mut self.shares) {
            if !share.is_to_be_cut || share.under_way > 0 {
                all.push(share);
                continue;
            }
            let parts = match share.stride.run {
                1 => cuts,
                run => cuts.min(run),
            };
            // Each part has a pixel: with more parts, steps would exceed the region.
            let parts = parts.min(share.stride.len(self.pixels).max(1));
            let part =
                |i| Share { stride: share.stride.split(i, parts), is_to_be_cut: false, ..share.clone() };
            let pixels = self.pixels;
            all.extend((0..parts).map(part).filter(|part| part.stride.len(pixels) > 0));
        }
        self.shares = all;
        self.divide();
    }

    /// Moves shares from workers with more than their part, or that have gone, to those with the least of theirs.
    fn divide(&mut self) {
        let speeds: f64 = self.workers.values().sum();
        let part = |speed: f64| f64::from(self.pixels) * speed / speeds;
        // The number of excess pixels of each owner.
        let mut surplus: BTreeMap<usize, f64> =
            self.workers.iter().map(|(&worker, &speed)| (worker, -part(speed))).collect();
        for share in &self.shares {
            if let Some(surplus) = surplus.get_mut(&share.owner) {
                *surplus += f64::from(share.stride.len(self.pixels));
            }
        }
        for share in &mut self.shares {
            let len = f64::from(share.stride.len(self.pixels));
            let poorest = surplus.iter().min_by(|(_, a), (_, b)| a.total_cmp(b));
            let Some((&poorest, &least)) = poorest else { return };
            // A move must not make the receiver own more than the giver did.
            let has_too_many = |surplus: &f64| surplus - least > len;
            if surplus.get(&share.owner).is_none_or(has_too_many) {
                surplus.entry(share.owner).and_modify(|surplus| *surplus -= len);
                surplus.entry(poorest).and_modify(|surplus| *surplus += len);
                share.owner = poorest;
            }
        }
    }

    /// The worker that owns each pixel of a film's picture.
    pub fn owners(&self, layout: &Layout) -> Vec<u32> {
        let len = layout.len() as u32;
        let mut owners = vec![0; len as usize];
        for share in &self.shares {
            for slot in 0..share.stride.len(len) {
                owners[share.stride.place(slot) as usize] = share.owner as u32;
            }
        }
        layout.places().map(|place| owners[place]).collect()
    }

    /// Whether all work is done.
    pub fn is_done(&self, pace: Option<Duration>) -> bool {
        self.is_idle() && self.is_over(pace)
    }

    /// Whether there is no unfinished order.
    pub fn is_idle(&self) -> bool {
        self.shares.iter().all(|share| share.under_way == 0)
    }

    /// The samples that every pixel has.
    pub fn completed(&self) -> u32 {
        self.shares.iter().map(|share| share.completed).min().unwrap_or(0)
    }

    /// The number of orders that a worker should have at a time: two, or one if a second could end long after the
    /// deadline.
    pub fn ahead(&self, pace: Option<Duration>) -> usize {
        match self.deadline {
            Some(_) if pace.is_none_or(|pace| pace > TARGET / 10) => 1,
            _ => 2,
        }
    }

    /// The share with the fewest barriers passed among those that `is_meant` selects and the worker may take.
    fn least_advanced(&self, is_meant: impl Fn(&Share) -> bool, worker: usize) -> Option<usize> {
        let shares = self.shares.iter().enumerate();
        let open = shares.filter(|(_, share)| is_meant(share) && share.is_open_to(worker));
        open.min_by_key(|(_, share)| share.ordered).map(|(index, _)| index)
    }

    /// Whether there is another barrier for a share to pass. Decides the barrier if necessary.
    fn has_next(&mut self, share: usize, pace: Option<Duration>) -> bool {
        if self.shares[share].ordered == self.barriers.len()
            && let Some(end) = self.next_barrier(pace)
        {
            let from = self.barriers.last().copied().unwrap_or(self.start);
            if from > self.start && from >= self.most && self.is_too_far(end, pace) {
                // The end is final: other shares must not continue without those that have ended.
                self.target = from;
            } else {
                self.barriers.push(end);
            }
        }
        self.shares[share].ordered < self.barriers.len()
    }

    /// Whether the next barrier is expected long after the deadline.
    fn is_too_far(&self, end: u32, pace: Option<Duration>) -> bool {
        let (Some(deadline), Some(pace)) = (self.deadline, pace) else { return false };
        let missing = |share: &Share| {
            let ordered = share.ordered.checked_sub(1).map_or(self.start, |last| self.barriers[last]);
            // Unfinished orders are half done on average.
            f64::from(end - share.completed) - 0.5 * f64::from(ordered.saturating_sub(share.completed))
        };
        let mean = self.shares.iter().map(missing).sum::<f64>() / self.shares.len().max(1) as f64;
        let left = deadline.saturating_duration_since(Instant::now()) + GRACE;
        pace.as_secs_f64() * mean > left.as_secs_f64()
    }

    fn order(&mut self, index: usize, worker: usize) -> Order {
        let share = &mut self.shares[index];
        let first = share.ordered.checked_sub(1).map_or(self.start, |last| self.barriers[last]);
        let end = self.barriers[share.ordered];
        share.ordered += 1;
        share.holder = Some(worker);
        share.under_way += 1;
        Order { stride: share.stride, first, end }
    }

    fn is_over(&self, pace: Option<Duration>) -> bool {
        let all = self.shares.iter().all(|share| share.ordered == self.barriers.len());
        let undecided = self.gate.is_some_and(|gate| gate < self.target && !self.is_late());
        all && !undecided && self.next_barrier(pace).is_none()
    }

    fn is_late(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    fn next_barrier(&self, pace: Option<Duration>) -> Option<u32> {
        let from = self.barriers.last().copied().unwrap_or(self.start);
        let limit = self.gate.map_or(self.target, |gate| gate.min(self.target));
        if from >= limit || (self.is_late() && from > self.start && from >= self.most) {
            return None;
        }
        // The first samples come one by one, so that a picture appears early; then orders double up to
        // their intended length.
        let left = self.deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
        let length = left.map_or(TARGET, |left| TARGET.min(left / 4));
        let longest = pace.map_or(1, |pace| {
            (length.as_secs_f64() / pace.as_secs_f64().max(1e-9)).min(f64::from(LONGEST_ORDER)) as u32
        });
        let step = longest.clamp(1, from.max(1));
        let end = from.saturating_add(step).min(limit);
        Some(self.stops.iter().copied().find(|&stop| stop > from && stop < end).unwrap_or(end))
    }
}

#[cfg(test)]
mod tests;
