//! A CPU worker: a thread that traces the paths of its orders.

use super::assignment::Assignment;
use super::batch::{FirstHits, NAMED_REJECTS, Payload, SampleBatch, Traced};
use super::layers::trace_first_hits;
use super::stride::Stride;
use crate::film::reject::{Reject, RejectCounts, check};
use crate::film::splat::BAND_BYTES;
use crate::film::sums::{PixelSums, fits};
use crate::film::{Band, LayerSet, Made, Splatter, layer_samples};
use crate::integrator::{Finished, FirstHit, Found, Integrator, Paths};
use crate::math::lanes::Level;
use crate::sampling::{Pixel, Region, Sample};
use crossbeam_channel::{Receiver, Sender, never};
use std::ops::Range;
use std::time::{Duration, Instant};

/// The maximum number of paths traced at a time: enough that idle lanes at the end of a block do not matter, few enough
/// that their samples fit into the cache.
const LARGEST_BLOCK: usize = 4096;

/// The initial number, before the speed of paths is known.
const FIRST_BLOCK: usize = 256;

/// Blocks are halved if they take longer than this, and doubled if they take less than a quarter of it.
const LONGEST_BLOCK: Duration = Duration::from_millis(40);

/// The age at which a batch is sent, so that viewers get updates; with the current block it stays below
/// 100 ms, unless a single pixel takes longer.
const SEND_AFTER: Duration = Duration::from_millis(50);

/// The size in bytes of listed samples and contributions at which a batch is sent.
const MOST_LISTED: usize = 7 << 18;

/// The size in bytes of these and of sums over slots at which a batch is sent. A worker fills one batch and has at most
/// two in its channel: together less than 16 MiB.
const MOST_BYTES: usize = 5 << 20;
const _: () = assert!(3 * MOST_BYTES <= 16 << 20 && 3 * (BAND_BYTES + MOST_LISTED) <= 16 << 20);

/// The settings of a worker.
pub struct Worker<'a> {
    /// Its number.
    pub index: usize,
    /// The integrator.
    pub integrator: &'a dyn Integrator,
    /// The SIMD level.
    pub level: Level,
    /// The rendered part of the film.
    pub region: Region,
    /// Whether a sink wants every sample.
    pub sends_samples: bool,
    /// Adds weighted samples to the pixels around them, if the film has them.
    pub splatter: Option<&'a Splatter>,
    /// The layers of the film, for which first hits are traced.
    pub layers: LayerSet,
}

impl Worker<'_> {
    /// Executes orders until their channel or that of the batches closes.
    pub fn run(&self, orders: &Receiver<Assignment>, batches: &Sender<SampleBatch>) {
        self.run_until(orders, &never(), batches);
    }

    /// Executes orders like [`Worker::run`], and stops as soon as there is a message in `stop`, which it leaves there.
    /// Samples finished by then have been sent; an interrupted block contributes no samples.
    ///
    /// The request is a message rather than the closing of the channel, because packets check it at each bounce:
    /// whether a channel is empty takes two loads to find out, and whether it is closed takes ten times as long.
    pub fn run_until(
        &self,
        orders: &Receiver<Assignment>,
        stop: &Receiver<()>,
        batches: &Sender<SampleBatch>,
    ) {
        self.run_by(&Instant::now, orders, stop, batches);
    }

    /// The same with another clock, which determines the numbers of paths per block and of blocks per batch.
    pub fn run_by(
        &self,
        clock: &dyn Fn() -> Instant,
        orders: &Receiver<Assignment>,
        stop: &Receiver<()>,
        batches: &Sender<SampleBatch>,
    ) {
        let mut scratch = Scratch::new();
        for assignment in orders {
            if self.carry_out(&assignment, &mut scratch, clock, stop, batches).is_none() {
                return;
            }
        }
    }

    /// Executes an order block by block. Returns `None` if it is to stop, or the channel of batches is closed.
    fn carry_out(
        &self,
        assignment: &Assignment,
        scratch: &mut Scratch,
        clock: &dyn Fn() -> Instant,
        stop: &Receiver<()>,
        batches: &Sender<SampleBatch>,
    ) -> Option<()> {
        let order = assignment.order;
        let slots = order.stride.len(self.region.len());
        let mut since = clock();
        let (mut batch, mut last) = self.empty_batch(order.stride, 0..slots);
        let mut slot = 0;
        while slot < slots {
            let start = clock();
            let traced;
            (slot, traced) = match &assignment.rest {
                None => {
                    let samples = order.first..order.end;
                    let slots_per_block = (scratch.block / samples.len().max(1)).max(1) as u32;
                    let block = slot..last.min(slot.saturating_add(slots_per_block));
                    let pixels = block.clone().map(|slot| self.region.pixel(order.stride.place(slot)));
                    let traced = self.trace_block(pixels, &samples, scratch, stop, &mut batch);
                    if traced.is_some() {
                        self.trace_first_hits(block.clone(), &samples, scratch, &mut batch);
                    }
                    (block.end, traced)
                }
                // All pixels of a block have the same samples, except for those without remaining ones.
                Some(rest) => {
                    let (block, samples) = assignment.block(slot..last, scratch.block);
                    let lacks = |slot: &u32| !rest[*slot as usize].is_empty();
                    let pixels = block.clone().filter(lacks);
                    let pixels = pixels.map(|slot| self.region.pixel(order.stride.place(slot)));
                    let traced = self.trace_block(pixels, &samples, scratch, stop, &mut batch);
                    if traced.is_some() {
                        spread(&mut batch.payload, scratch.pixels.len(), block.clone(), lacks);
                        self.trace_first_hits(block.clone().filter(lacks), &samples, scratch, &mut batch);
                    }
                    (block.end, traced)
                }
            };
            if traced.is_none() {
                // The receiver may have gone.
                let _ = batches.send(batch);
                return None;
            }
            let now = clock();
            scratch.adapt(now.duration_since(start));
            if slot < slots && (is_full(&batch) || slot == last || now.duration_since(since) >= SEND_AFTER) {
                let (next, until) = self.empty_batch(order.stride, slot..slots);
                batches.send(std::mem::replace(&mut batch, next)).ok()?;
                (last, since) = (until, clock());
            }
        }
        batch.completes = Some(order.end);
        batches.send(batch).ok()
    }

    /// A batch for the first of some slots, and the slot at which it is full.
    fn empty_batch(&self, stride: Stride, slots: Range<u32>) -> (SampleBatch, u32) {
        let (first_slot, mut last) = (slots.start, slots.end);
        let payload = match self.splatter {
            None => Payload::sums(first_slot),
            Some(splatter) => {
                let band;
                (band, last) = self.band(splatter, stride, slots);
                Payload::Splats { first_slot, made: Vec::new(), band, bright: Vec::new() }
            }
        };
        let first_hits = FirstHits::none(self.layers, first_slot);
        (SampleBatch { first_hits, ..SampleBatch::empty(self.index, stride, payload) }, last)
    }

    /// A band for the first of the slots, as many as can share one, and the end of these.
    fn band(&self, splatter: &Splatter, stride: Stride, slots: Range<u32>) -> (Band, u32) {
        if slots.is_empty() {
            return (Band::empty(), slots.end);
        }
        let first = stride.place(slots.start);
        let end = u64::from(first) + u64::from(splatter.places_from(first, self.region.width));
        // Places ascend with slots: bisection finds the first slot past the end.
        let (mut inside, mut outside) = (slots.start, slots.end);
        while inside + 1 < outside {
            let middle = inside + (outside - inside) / 2;
            if u64::from(stride.place(middle)) < end { inside = middle } else { outside = middle }
        }
        (splatter.band(first, stride.place(inside), self.region.width), outside)
    }

    /// Traces the first hits of a block of these slots after its paths.
    fn trace_first_hits(
        &self,
        slots: impl Iterator<Item = u32>,
        samples: &Range<u32>,
        scratch: &mut Scratch,
        batch: &mut SampleBatch,
    ) {
        if self.layers.is_empty() || layer_samples(samples).is_empty() {
            return;
        }
        let FirstHits { first_slot, sums } = &mut batch.first_hits;
        let Scratch { pixels, hits, rows, .. } = scratch;
        rows.clear();
        rows.extend(slots.map(|slot| (slot - *first_slot) as usize));
        trace_first_hits(self.integrator, self.level, pixels, samples, |i| rows[i], hits, sums);
    }

    /// Traces some samples of some pixels. Returns `None` if it is to stop before all of them are done.
    fn trace_block(
        &self,
        pixels: impl Iterator<Item = Pixel>,
        samples: &Range<u32>,
        scratch: &mut Scratch,
        stop: &Receiver<()>,
        batch: &mut SampleBatch,
    ) -> Option<()> {
        scratch.pixels.clear();
        scratch.pixels.extend(pixels);
        scratch.found.clear();
        let paths = Paths {
            pixels: &scratch.pixels,
            first_sample: samples.start,
            samples: samples.end - samples.start,
        };
        let stop = || !stop.is_empty();
        batch.rays += self.integrator.trace_until(self.level, &paths, &stop, &mut scratch.found)?;
        batch.paths += paths.len() as u64;
        let Found { finished, contributions } = &mut scratch.found;
        batch.contributions.append(contributions);
        if samples.start == 0 {
            batch.faint.count(finished);
        }
        if self.sends_samples {
            batch.samples.extend(finished.iter().map(|f| f.sample));
        }
        match &mut batch.payload {
            // A CPU worker always sends sums.
            Payload::Samples(_) => {}
            Payload::Splats { made, band, bright, .. } => {
                let Some(splatter) = self.splatter else {
                    // An early return would look like a response to the request to stop.
                    unreachable!("a batch of splats without a splatter");
                };
                let base = made.len();
                made.resize(base + scratch.pixels.len(), Made::default());
                let made = &mut made[base..];
                for index in splatter.add(self.level, finished, band, made) {
                    let Finished { slot, sample } = finished[index];
                    let rejected = &mut made[slot as usize].rejected;
                    let (rejects, counts) = (&mut batch.rejects, &mut batch.reject_counts);
                    add_unusual(sample, rejected, bright, rejects, counts);
                }
            }
            Payload::Sums { sums, bright, .. } => {
                let base = sums.len();
                sums.resize(base + scratch.pixels.len(), PixelSums::default());
                let sums = &mut sums[base..];
                for finished in &*finished {
                    let sum = &mut sums[finished.slot as usize];
                    if fits(finished.sample.radiance) {
                        sum.add(finished.sample.radiance);
                    } else {
                        add_unusual(
                            finished.sample,
                            &mut sum.rejected,
                            bright,
                            &mut batch.rejects,
                            &mut batch.reject_counts,
                        );
                    }
                }
            }
        }
        Some(())
    }
}

/// Whether a batch is to be sent before more is added to it.
fn is_full(batch: &SampleBatch) -> bool {
    let (summed, alone) = match &batch.payload {
        Payload::Samples(samples) => (0, samples),
        Payload::Sums { sums, bright, .. } => (size_of_val(&sums[..]), bright),
        Payload::Splats { bright, .. } => (BAND_BYTES, bright),
    };
    let samples = size_of_val(&batch.samples[..]) + size_of_val(&alone[..]);
    let listed = samples + size_of_val(&batch.contributions[..]);
    listed >= MOST_LISTED || listed + summed + batch.first_hits.sums.bytes() >= MOST_BYTES
}

/// Inserts empty entries among the last `traced` entries of a payload for the slots of a block that were not traced.
fn spread(payload: &mut Payload, traced: usize, block: Range<u32>, is_traced: impl Fn(&u32) -> bool) {
    match payload {
        Payload::Sums { sums, .. } => spread_out(sums, traced, block, is_traced),
        Payload::Splats { made, .. } => spread_out(made, traced, block, is_traced),
        Payload::Samples(_) => {}
    }
}

fn spread_out<T: Default>(
    all: &mut Vec<T>,
    traced: usize,
    block: Range<u32>,
    is_traced: impl Fn(&u32) -> bool,
) {
    if traced < block.len() {
        let mut traced = all.split_off(all.len() - traced).into_iter();
        all.extend(block.map(|slot| match is_traced(&slot) {
            true => traced.next().unwrap_or_default(),
            false => T::default(),
        }));
    }
}

/// Handles a sample that does not fit into sums.
#[cold]
fn add_unusual(
    sample: Sample,
    rejected: &mut u32,
    bright: &mut Vec<Sample>,
    rejects: &mut Vec<(Traced, Reject)>,
    counts: &mut RejectCounts,
) {
    match check(sample.radiance) {
        Ok(()) => bright.push(sample),
        Err(reject) => {
            *rejected += 1;
            counts.add(reject, 1);
            if rejects.len() < NAMED_REJECTS {
                rejects.push((Traced { pixel: sample.pixel, sample: sample.sample }, reject));
            }
        }
    }
}

/// Buffers that are reused for each block.
struct Scratch {
    pixels: Vec<Pixel>,
    found: Found,
    hits: Vec<FirstHit>,
    /// The index of each pixel in a batch's first hits.
    rows: Vec<usize>,
    /// The number of paths to trace at a time. It does not affect any result.
    block: usize,
}

impl Scratch {
    fn new() -> Scratch {
        let (pixels, hits, rows) = (Vec::new(), Vec::new(), Vec::new());
        Scratch { pixels, found: Found::default(), hits, rows, block: FIRST_BLOCK }
    }

    fn adapt(&mut self, took: Duration) {
        if took > LONGEST_BLOCK {
            self.block = (self.block / 2).max(1);
        } else if took < LONGEST_BLOCK / 4 {
            self.block = (self.block * 2).min(LARGEST_BLOCK);
        }
    }
}
