//! Batches, the messages of workers.

use super::faint::Faint;
use super::stride::Stride;
use crate::film::{Band, LayerSet, LayerSums, Made, PixelSums, Reject, RejectCounts, WideSums};
use crate::sampling::{Contribution, Sample};
use serde::{Deserialize, Serialize};

/// Samples of some of the pixels of an order: single samples, or exact sums of them.
///
/// The accumulator does not verify batches: each must belong to the oldest order that the worker has not completed, and
/// contain only samples that no other batch contains.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SampleBatch {
    /// The worker that made them.
    pub worker: usize,
    /// The pixels of the order, as places in the region.
    pub stride: Stride,
    /// The samples.
    pub payload: Payload,
    /// All samples, if a sink wants them and the payload consists of sums.
    pub samples: Vec<Sample>,
    /// Contributions of the samples to any pixel.
    pub contributions: Vec<Contribution>,
    /// The first hits of the samples, for the layers of the film.
    pub first_hits: FirstHits,
    /// Paths traced for this batch, rejected ones included.
    pub paths: u64,
    /// Rays traced for this batch.
    pub rays: u64,
    /// A few of the rejected samples, with the reasons.
    pub rejects: Vec<(Traced, Reject)>,
    /// Numbers of rejected samples, without those that the accumulator rejects itself.
    pub reject_counts: RejectCounts,
    /// Counts of faint radiance over the first sample of each pixel, from workers that count it.
    pub faint: Faint,
    /// In the last batch of an order: the number of samples that each pixel of the stride now has.
    pub completes: Option<u32>,
}

/// The maximum number of rejected samples that a batch lists.
pub const NAMED_REJECTS: usize = 4;

impl SampleBatch {
    /// A batch without samples, except for its payload.
    pub fn empty(worker: usize, stride: Stride, payload: Payload) -> SampleBatch {
        SampleBatch {
            worker,
            stride,
            payload,
            samples: Vec::new(),
            contributions: Vec::new(),
            first_hits: FirstHits::none(LayerSet::NONE, 0),
            paths: 0,
            rays: 0,
            rejects: Vec::new(),
            reject_counts: RejectCounts::default(),
            faint: Faint::default(),
            completes: None,
        }
    }
}

/// Sums of the first hits of samples that contribute to layers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FirstHits {
    /// The first slot of the stride.
    pub first_slot: u32,
    /// Sums of consecutive slots from that one on, one pixel each; empty if none of the samples contributes to layers.
    pub sums: LayerSums,
}

impl FirstHits {
    /// Empty sums that begin at a slot.
    pub fn none(layers: LayerSet, first_slot: u32) -> FirstHits {
        FirstHits { first_slot, sums: LayerSums::new(layers) }
    }
}

/// A sample that can be traced again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traced {
    /// The pixel's index on the full film.
    pub pixel: u32,
    /// The index among its samples.
    pub sample: u32,
}

/// Samples, or sums of them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Payload {
    /// Every sample, from a worker that makes no sums. The accumulator rejects invalid ones.
    Samples(Vec<Sample>),
    /// Exact sums over consecutive slots of the stride.
    Sums {
        /// The first slot.
        first_slot: u32,
        /// The sums, one per slot.
        sums: Vec<PixelSums>,
        /// Samples that are too bright for sums of 64 bits, but valid for a film.
        bright: Vec<Sample>,
        /// Slots whose sums do not fit into 64 bits, from a worker that sums bright samples itself: the rest of their
        /// radiance and squares. Their counts are in `sums`.
        wide: Vec<(u32, WideSums)>,
    },
    /// Exact sums over a band of rows, of weighted samples.
    Splats {
        /// The first of consecutive slots of the stride that the samples were made for.
        first_slot: u32,
        /// The number of samples made for each of them.
        made: Vec<Made>,
        /// The sums.
        band: Band,
        /// Samples that do not fit into the band: too bright for sums of 64 bits, or near pixels outside it.
        bright: Vec<Sample>,
    },
}

impl Payload {
    /// One past the last slot with sums; zero for single samples.
    pub fn slots_end(&self) -> u32 {
        match self {
            Payload::Samples(_) => 0,
            Payload::Sums { first_slot, sums, .. } => first_slot + sums.len() as u32,
            Payload::Splats { first_slot, made, .. } => first_slot + made.len() as u32,
        }
    }

    /// Empty sums that begin at a slot.
    pub fn sums(first_slot: u32) -> Payload {
        Payload::Sums { first_slot, sums: Vec::new(), bright: Vec::new(), wide: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Layer;
    use crate::integrator::FirstHit;

    fn as_text(batch: &SampleBatch) -> SampleBatch {
        serde_json::from_str(&serde_json::to_string(batch).unwrap()).unwrap()
    }

    #[test]
    fn a_batch_is_serialised_without_loss() {
        let sample = |radiance| Sample { pixel: u32::MAX, sample: 7, x: 0.1, y: 1e-30, radiance };
        let odd = [[f32::NAN, -0.0, f32::INFINITY], [1.0 / 3.0, f32::MIN_POSITIVE, f32::MAX]].map(sample);
        let sums = PixelSums { rgb: [i64::MAX, i64::MIN, -1], squares: i64::MAX, count: 1, rejected: 2 };
        let wide = WideSums { rgb: [i128::MAX, i128::MIN, (1 << 95) - 1], squares: u128::MAX };
        let payloads = [
            Payload::Samples(odd.to_vec()),
            Payload::Sums { first_slot: 3, sums: vec![sums], bright: odd.to_vec(), wide: vec![(4, wide)] },
            Payload::Splats {
                first_slot: 5,
                made: vec![Made { count: 1, rejected: u32::MAX }],
                band: Band::empty(),
                bright: odd.to_vec(),
            },
        ];
        for payload in payloads {
            let mut batch = SampleBatch::empty(9, Stride { first: 1, step: 2, run: 1 }, payload);
            batch.rejects.push((Traced { pixel: 1, sample: 2 }, Reject::NotANumber));
            (batch.paths, batch.completes, batch.samples) = (u64::MAX, Some(8), odd.to_vec());
            let contribution = |&sample: &Sample| Contribution::from(<[u32; 7]>::from(sample));
            batch.contributions = odd.iter().map(contribution).collect();
            let layers = LayerSet::new(&Layer::ALL, 2, 300);
            batch.first_hits = FirstHits::none(layers, 3);
            batch.first_hits.sums.grow(2);
            let hit = FirstHit { met: true, position: [-1e10, 1e-20, f32::MAX], ..FirstHit::default() };
            batch.first_hits.sums.add(1, 31, &[hit]);
            let bits = |samples: &[Sample]| samples.iter().map(|&s| <[u32; 7]>::from(s)).collect::<Vec<_>>();
            let read = as_text(&batch);
            assert_eq!(format!("{read:?}"), format!("{batch:?}"));
            assert_eq!(read.first_hits, batch.first_hits);
            assert_eq!(bits(&read.samples), bits(&batch.samples));
        }
    }
}
