//! Batches, the messages of workers.

use super::faint::Faint;
use super::stride::Stride;
use crate::film::{Band, LayerSet, LayerSums, Made, PixelSums, Reject, RejectCounts, WideSums};
use crate::sampling::{Contribution, Sample};
use serde::{Deserialize, Serialize};

/// Samples of some of the pixels of an order: themselves, or exact sums of them.
///
/// The accumulator believes workers: each batch must be of the oldest order that the worker has not completed, and bring
/// what no other batch has brought.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SampleBatch {
    /// The worker that made them.
    pub worker: usize,
    /// The pixels that the order is for, as places in the region.
    pub stride: Stride,
    /// The samples.
    pub payload: Payload,
    /// Every one of them, where a sink wants that and the payload is sums of them.
    pub samples: Vec<Sample>,
    /// What the samples contribute to any pixel.
    pub contributions: Vec<Contribution>,
    /// The first hits of the samples, for the layers of the film.
    pub first_hits: FirstHits,
    /// Paths that were traced for this batch, rejected ones included.
    pub paths: u64,
    /// Rays that were traced for this batch.
    pub rays: u64,
    /// A few of the samples that were left out, with the reason.
    pub rejects: Vec<(Traced, Reject)>,
    /// Numbers of samples that were left out, without those that the accumulator sorts out itself.
    pub reject_counts: RejectCounts,
    /// What is counted of the first sample of each pixel, by a worker that counts.
    pub faint: Faint,
    /// With the last batch of an order: each pixel of the stride now has exactly this many samples.
    pub completes: Option<u32>,
}

/// How many rejected samples a batch names.
pub const NAMED_REJECTS: usize = 4;

impl SampleBatch {
    /// A batch with nothing in it yet but for its payload.
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

/// Sums of the first hits of those of the samples that layers are of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FirstHits {
    /// The first slot of the stride.
    pub first_slot: u32,
    /// Those of consecutive slots from that one on, each as a pixel; of no slot where layers are of none of the samples.
    pub sums: LayerSums,
}

impl FirstHits {
    /// Of no slot yet, from one on.
    pub fn none(layers: LayerSet, first_slot: u32) -> FirstHits {
        FirstHits { first_slot, sums: LayerSums::new(layers) }
    }
}

/// Enough to trace one path again.
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
    /// Every sample, from a worker that has no sums of them. The accumulator sorts out those that a film can't take.
    Samples(Vec<Sample>),
    /// Exact sums over consecutive slots of the stride.
    Sums {
        /// The first slot.
        first_slot: u32,
        /// The sums, a slot each.
        sums: Vec<PixelSums>,
        /// Samples that are too bright to be summed in 64 bits, but that a film takes.
        bright: Vec<Sample>,
        /// Slots whose sums don't fit into 64 bits, from a worker that adds bright samples up itself: more
        /// of their radiance and squares. Their counts are among `sums`.
        wide: Vec<(u32, WideSums)>,
    },
    /// Exact sums over a band of rows, of samples that count in all pixels around them.
    Splats {
        /// The first of consecutive slots of the stride that the samples were made for.
        first_slot: u32,
        /// How many were made for each of them.
        made: Vec<Made>,
        /// The sums.
        band: Band,
        /// Samples that it has no room for: they are too bright to be summed in 64 bits, or count in pixels beyond it.
        bright: Vec<Sample>,
    },
}

impl Payload {
    /// One past the last slot that there are sums for; zero where samples come one by one.
    pub fn slots_end(&self) -> u32 {
        match self {
            Payload::Samples(_) => 0,
            Payload::Sums { first_slot, sums, .. } => first_slot + sums.len() as u32,
            Payload::Splats { first_slot, made, .. } => first_slot + made.len() as u32,
        }
    }

    /// Sums from a slot on, of nothing yet.
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
    fn a_batch_travels_as_text_without_loss() {
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
