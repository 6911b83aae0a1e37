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

/// How many paths are traced at a time, where they are quick: enough that the lanes' last stragglers don't
/// count, few enough that their samples stay in the cache.
const LARGEST_BLOCK: usize = 4096;

/// And at first, before it is known how long paths take here.
const FIRST_BLOCK: usize = 256;

/// Blocks are halved when they take longer than this, and doubled when they take less than a quarter of it.
const LONGEST_BLOCK: Duration = Duration::from_millis(40);

/// After this long a batch is sent, so that pictures move; with the block that is under way it stays under
/// 100 ms, unless a single pixel takes longer.
const SEND_AFTER: Duration = Duration::from_millis(50);

/// A batch is sent when it lists samples and contributions of so many bytes.
const MOST_LISTED: usize = 7 << 18;

/// Or has so many bytes of these and of sums over slots. A worker fills one batch and has sent two at most that nobody has
/// taken yet: with all that is in them, less than 16 MiB.
const MOST_BYTES: usize = 5 << 20;
const _: () = assert!(3 * MOST_BYTES <= 16 << 20 && 3 * (BAND_BYTES + MOST_LISTED) <= 16 << 20);

/// The settings of a worker.
pub struct Worker<'a> {
    /// Its number.
    pub index: usize,
    /// The integrator.
    pub integrator: &'a dyn Integrator,
    /// Which lanes to use.
    pub level: Level,
    /// The part of the film that is rendered.
    pub region: Region,
    /// Whether a sink wants every sample.
    pub sends_samples: bool,
    /// What puts samples on a film where they count in all pixels around them.
    pub splatter: Option<&'a Splatter>,
    /// The layers of the film, for which first hits are traced.
    pub layers: LayerSet,
}

impl Worker<'_> {
    /// Carries out orders until their channel closes or nobody wants the batches any more.
    pub fn run(&self, orders: &Receiver<Assignment>, batches: &Sender<SampleBatch>) {
        self.run_until(orders, &never(), batches);
    }

    /// The same, and gives up as soon as there is a message in `stop`, which stays there. What was finished by then has
    /// been sent: of a block that is cut short no sample counts.
    ///
    /// It is a message and not the end of the channel because a packet looks for it at each of its bounces: whether a
    /// channel is empty takes two loads to tell, and whether it is closed ten times as long.
    pub fn run_until(
        &self,
        orders: &Receiver<Assignment>,
        stop: &Receiver<()>,
        batches: &Sender<SampleBatch>,
    ) {
        self.run_by(&Instant::now, orders, stop, batches);
    }

    /// The same by another clock: how many paths a block has, and how many blocks a batch, depends on what it says.
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

    /// Traces an order block by block. Returns `None` when it is to stop, or nobody wants the batches any more.
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
                // A block has the same samples for each of its pixels, but for those that lack none.
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
                // Nobody may be there to take it any more.
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

    /// A band for as many of the slots, from the first on, as may share one, and the end of these.
    fn band(&self, splatter: &Splatter, stride: Stride, slots: Range<u32>) -> (Band, u32) {
        if slots.is_empty() {
            return (Band::empty(), slots.end);
        }
        let first = stride.place(slots.start);
        let end = u64::from(first) + u64::from(splatter.places_from(first, self.region.width));
        // Places ascend with slots: the first slot past the end, by bisection.
        let (mut inside, mut outside) = (slots.start, slots.end);
        while inside + 1 < outside {
            let middle = inside + (outside - inside) / 2;
            if u64::from(stride.place(middle)) < end { inside = middle } else { outside = middle }
        }
        (splatter.band(first, stride.place(inside), self.region.width), outside)
    }

    /// Traces the first hits of a block whose paths have been traced. Its pixels are of these slots.
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

    /// Traces some samples of some pixels, or returns `None` when it is to stop before it has done all of them.
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
            // A CPU worker always has sums.
            Payload::Samples(_) => {}
            Payload::Splats { made, band, bright, .. } => {
                let Some(splatter) = self.splatter else {
                    // To give up here would look like an answer to the request to stop.
                    unreachable!("a batch of splats is of a worker with a splatter");
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

/// Makes room in the last `traced` entries of a payload for those slots of a block that nothing was traced for.
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

/// What becomes of a sample that doesn't fit into sums.
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

/// Buffers that are filled anew for each block.
struct Scratch {
    pixels: Vec<Pixel>,
    found: Found,
    hits: Vec<FirstHit>,
    /// Where among a batch's first hits each of the pixels is.
    rows: Vec<usize>,
    /// How many paths to trace at a time. No result depends on it.
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
