//! The order of work: which samples which pixels get next.
//!
//! Every worker's stride is cut into *shares*, strides themselves, and orders are for a share. A worker carries
//! out those of its own stride; one that is done with them takes over shares of another that has fallen behind,
//! so that a core that is slowed down holds up nobody. What becomes of a pixel does not depend on who renders it.
//!
//! All shares pass the same barriers, each in its own time: sample counts that every pixel reaches exactly. A
//! picture at a barrier is gathered share by share as they come by, and nobody waits. A share is with one worker
//! at a time, so that its samples arrive in order and what a film holds of a pixel are always its first ones.

use super::stride::Stride;
use crate::film::Layout;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Work for one worker: these sample indices for every pixel of a share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// The share, as places in the region.
    pub stride: Stride,
    /// The first sample index.
    pub first: u32,
    /// One past the last.
    pub end: u32,
}

/// The answer to a worker that asks for work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deal {
    /// Do this.
    Order(Order),
    /// Ask again after the next completed order.
    Later,
    /// There is nothing left to do.
    Done,
}

/// The most samples in one order: sums of them fit into 64 bits, and a stop is never far.
const LONGEST_ORDER: u32 = 256;
const _: () = assert!(LONGEST_ORDER <= crate::film::sums::MAX_COUNT);

/// How long it should take all workers from one barrier to the next: long enough that messages cost nothing,
/// short enough that a time limit is kept.
const TARGET: Duration = Duration::from_millis(500);

/// How long after its deadline a render may come to a whole sample. None is begun that is expected to take longer.
pub const GRACE: Duration = Duration::from_millis(750);

/// Shares of a stride: as many as can be taken over from a worker that is slow.
const SHARES: u32 = 8;

/// Pixels that a share has at least, unless its whole stride has fewer: with less, lanes run empty.
const FEWEST_PIXELS: u32 = 64;

/// Stripes of rows in a share, where there are enough rows: what is slow in a picture is in all of them.
const STRIPES: u32 = 4;

/// Rows of a stripe at most: with that many, few samples count beyond it.
const MOST_ROWS: u32 = 8;

/// A worker that is this many barriers ahead of another helps it out. One less, and equals would take each
/// other's shares all the time.
const AHEAD: usize = 2;

/// How much wider than a share of another worker's the stride of a fast one may be.
const MOST_TIMES: f64 = 65_536.0;

/// Shares of a stride of so many pixels.
fn shares_each(pixels: f64) -> u32 {
    ((pixels / f64::from(FEWEST_PIXELS)) as u32).clamp(1, SHARES)
}

/// Decides the barriers, one after the other, and deals the work in between.
#[derive(Debug)]
pub struct Schedule {
    /// Sample counts that pixels reach together, ascending.
    barriers: Vec<u32>,
    /// The workers that are there, each with its speed in that of the first ones.
    workers: BTreeMap<usize, f64>,
    /// Pixels of the region.
    pixels: u32,
    shares: Vec<Share>,
    /// Into how many parts each share is to be cut as soon as no order for it is under way.
    cuts: u32,
    /// Where everything begins.
    start: u32,
    /// Samples that some pixels have already.
    most: u32,
    /// Where everything ends.
    target: u32,
    /// A barrier at which all wait until it is decided how to go on.
    gate: Option<u32>,
    deadline: Option<Instant>,
    /// Sample counts that must be barriers, ascending.
    stops: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Share {
    stride: Stride,
    /// Whose stride it is a part of.
    owner: usize,
    /// How many barriers it has been ordered to pass.
    ordered: usize,
    /// Samples that each of its pixels has.
    completed: u32,
    /// Who works at it, and how many orders for it are under way there.
    holder: Option<usize>,
    under_way: u32,
    /// Whether it is to be cut as soon as no order for it is under way.
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
    /// A schedule for some workers, which may be none yet, over a region of so many pixels. It ends at `target` samples a
    /// pixel, or before, at the first barrier after the deadline or the last one that is expected within [`GRACE`] of it,
    /// and passes each of `stops`. There is one sample of every pixel at least.
    pub fn new(
        workers: usize,
        pixels: u32,
        target: u32,
        deadline: Option<Instant>,
        mut stops: Vec<u32>,
    ) -> Schedule {
        stops.sort_unstable();
        let a_worker = match workers {
            // There is nobody to help.
            0 | 1 => 1,
            _ => shares_each(f64::from(pixels) / workers as f64),
        };
        // Share i is the stride of places i, i + n, i + 2n, … for n shares in all. Those of a render without workers wait
        // for the first that joins.
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

    /// The same over stripes of rows instead of pixels, of a region with so many pixels in a row: samples that count in
    /// all pixels around them are summed up over what lies side by side.
    pub fn in_stripes(mut self, pixels: u32, width: u32) -> Schedule {
        // All shares have the same.
        let step = self.shares.first().map_or(1, |share| share.stride.step);
        let rows = (pixels / width / step.saturating_mul(STRIPES)).clamp(1, MOST_ROWS);
        // With fewer rows than there are stripes in a step, less than a row.
        let stripe = (rows * width).min(pixels.div_ceil(step)).max(1);
        for share in &mut self.shares {
            let Stride { first, step, run } = share.stride;
            share.stride = Stride { first: first * stripe, step: step * stripe, run: run * stripe };
        }
        self
    }

    /// The same, beginning with this sample index: what comes before is there, or somebody else's. Some pixels
    /// have samples up to `most` already, so that nothing can end before.
    pub fn starting_at(mut self, start: u32, most: u32) -> Schedule {
        (self.start, self.most) = (start, most);
        self.shares.iter_mut().for_each(|share| share.completed = start);
        self
    }

    /// The same, where the last worker is as fast as so many of the others: its stride is as much wider.
    pub fn with_faster(mut self, pixels: u32, times: f64) -> Schedule {
        let last = self.workers.len().saturating_sub(1);
        self.workers.insert(last, times);
        let others = last as u32;
        let a_worker = shares_each(f64::from(pixels) / (f64::from(others) + times));
        // In units of which each share of the others has one.
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

    /// The barrier that all have come to and wait at, if there is one.
    pub fn waits_at(&self) -> Option<u32> {
        self.gate.filter(|&gate| gate < self.target && gate == self.completed())
    }

    /// Opens the gate: everything ends at `end`, if that is said, and the next decision is due at `gate`.
    pub fn decide(&mut self, end: Option<u32>, gate: Option<u32>) {
        self.target = end.map_or(self.target, |end| end.max(self.most).min(self.target));
        self.gate = gate;
    }

    /// Where everything ends, as far as that is known.
    pub fn target(&self) -> u32 {
        self.target
    }

    /// How many shares the work is cut into.
    pub fn shares(&self) -> usize {
        self.shares.len()
    }

    /// Deals a worker its next order. `pace` is the time that one sample of every pixel takes, as far as that
    /// is known.
    pub fn next(&mut self, worker: usize, pace: Option<Duration>) -> Deal {
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
            Some(share) => Deal::Order(self.order(share, worker)),
            None if self.is_over(pace) => Deal::Done,
            None => Deal::Later,
        }
    }

    /// Takes note that an order for a share has been carried out: its pixels have `spp` samples now.
    pub fn complete(&mut self, stride: Stride, spp: u32) {
        // No two shares begin at the same place.
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

    /// Takes a worker on, which is as fast as so many of the first ones. It owns its part of the work from now on; where
    /// there are too few shares for that, they are cut as soon as no order for them is under way.
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

    /// Takes everything from a worker that leaves or is lost: what it has not completed is dealt again, to the others,
    /// who own its shares from now on.
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

    /// Cuts what is to be cut and no order is under way for, and divides the shares anew.
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
            // Each part has a pixel: more parts than that would have steps beyond the last.
            let parts = parts.min(share.stride.len(self.pixels).max(1));
            let part =
                |i| Share { stride: share.stride.split(i, parts), is_to_be_cut: false, ..share.clone() };
            let pixels = self.pixels;
            all.extend((0..parts).map(part).filter(|part| part.stride.len(pixels) > 0));
        }
        self.shares = all;
        self.divide();
    }

    /// Gives shares of workers with more than their part, or that are no longer there, to those with the least of theirs.
    fn divide(&mut self) {
        let speeds: f64 = self.workers.values().sum();
        let part = |speed: f64| f64::from(self.pixels) * speed / speeds;
        // How many pixels each owns too many.
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
            // What is moved must not make the poorest richer than the owner was.
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

    /// Whether all has been carried out.
    pub fn is_done(&self, pace: Option<Duration>) -> bool {
        self.is_idle() && self.is_over(pace)
    }

    /// Whether no order is under way.
    pub fn is_idle(&self) -> bool {
        self.shares.iter().all(|share| share.under_way == 0)
    }

    /// The samples that every pixel has.
    pub fn completed(&self) -> u32 {
        self.shares.iter().map(|share| share.completed).min().unwrap_or(0)
    }

    /// How many orders a worker should have at a time: two, but only one where a second could end long after
    /// the deadline.
    pub fn ahead(&self, pace: Option<Duration>) -> usize {
        match self.deadline {
            Some(_) if pace.is_none_or(|pace| pace > TARGET / 10) => 1,
            _ => 2,
        }
    }

    /// The share that has passed the fewest barriers, of those meant that a worker may have.
    fn least_advanced(&self, is_meant: impl Fn(&Share) -> bool, worker: usize) -> Option<usize> {
        let shares = self.shares.iter().enumerate();
        let open = shares.filter(|(_, share)| is_meant(share) && share.is_open_to(worker));
        open.min_by_key(|(_, share)| share.ordered).map(|(index, _)| index)
    }

    /// Whether there is another barrier for a share to pass; decides it if need be.
    fn has_next(&mut self, share: usize, pace: Option<Duration>) -> bool {
        if self.shares[share].ordered == self.barriers.len()
            && let Some(end) = self.next_barrier(pace)
        {
            let from = self.barriers.last().copied().unwrap_or(self.start);
            if from > self.start && from >= self.most && self.is_too_far(end, pace) {
                // It stays so: the others must not go on without those that have ended.
                self.target = from;
            } else {
                self.barriers.push(end);
            }
        }
        self.shares[share].ordered < self.barriers.len()
    }

    /// Whether it is expected that all come to a barrier long after the deadline.
    fn is_too_far(&self, end: u32, pace: Option<Duration>) -> bool {
        let (Some(deadline), Some(pace)) = (self.deadline, pace) else { return false };
        let missing = |share: &Share| {
            let ordered = share.ordered.checked_sub(1).map_or(self.start, |last| self.barriers[last]);
            // Of what is under way half is done, more or less.
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
        // The first samples come one by one, so that there is something to see; then orders double until
        // they are as long as they should be.
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
