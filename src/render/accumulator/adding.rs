//! Adds batches to the film, and counts rejected samples.

use crate::film::{Film, Reject, RejectCounts, Splatter};
use crate::render::batch::{FirstHits, Payload, Traced};
use crate::render::faint::Faint;
use crate::render::outcome::NAMED_REJECTS;
use crate::render::stride::Stride;
use crate::sampling::{Contribution, Region, Sample};
use std::sync::Arc;

/// The film, and the samples it rejected.
pub(super) struct Adder {
    pub(super) film: Film,
    region: Region,
    splatter: Option<Arc<Splatter>>,
    light: Option<Arc<Splatter>>,
    /// Some of the rejected samples, or samples with rejected contributions.
    pub(super) rejects: Vec<(Traced, Reject)>,
    pub(super) reject_counts: RejectCounts,
    pub(super) faint: Faint,
}

/// The pixels whose sums change together when a batch is added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AffectedPixels {
    /// Each pixel separately: a sample contributes only to its own pixel.
    Single,
    /// A sample may contribute to several pixels from the first index to the last.
    Places([u32; 2]),
    /// A sample may contribute to any pixel.
    All,
}

impl Adder {
    pub(super) fn new(
        film: Film,
        region: Region,
        splatter: Option<Arc<Splatter>>,
        light: Option<Arc<Splatter>>,
    ) -> Adder {
        let (rejects, reject_counts, faint) = (Vec::new(), RejectCounts::default(), Faint::default());
        Adder { film, region, splatter, light, rejects, reject_counts, faint }
    }

    /// Whether samples contribute to pixels other than their own.
    pub(super) fn reaches_others(&self) -> bool {
        self.splatter.is_some() || self.light.is_some()
    }

    /// The pixels that a payload and the contributions of its samples change together.
    pub(super) fn reach(&self, payload: &Payload, contributions: &[Contribution]) -> AffectedPixels {
        match (payload, &self.splatter) {
            _ if !contributions.is_empty() => AffectedPixels::All,
            (Payload::Samples(_), Some(_)) => AffectedPixels::All,
            (Payload::Splats { band, bright, .. }, Some(splatter)) => {
                let Region { width, height, .. } = self.region;
                let alone = |sample| splatter.places(sample, self.region.place(sample.pixel), width, height);
                let all = band.places(width, height).into_iter().chain(bright.iter().map(alone));
                all.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
                    .map_or(AffectedPixels::Single, AffectedPixels::Places)
            }
            (Payload::Samples(_) | Payload::Sums { .. } | Payload::Splats { .. }, _) => {
                AffectedPixels::Single
            }
        }
    }

    /// Adds the counts of samples that a worker rejected.
    pub(super) fn count(&mut self, rejects: Vec<(Traced, Reject)>, counts: &RejectCounts, faint: &Faint) {
        self.faint.merge(faint);
        self.reject_counts.merge(counts);
        rejects.into_iter().for_each(|reject| self.record_reject(reject));
    }

    /// Adds a payload of a stride. Returns the samples if the payload consisted of samples.
    pub(super) fn add(&mut self, stride: Stride, payload: Payload) -> Option<Vec<Sample>> {
        match payload {
            Payload::Samples(samples) => {
                for &sample in &samples {
                    self.add_sample(sample);
                }
                return Some(samples);
            }
            Payload::Sums { first_slot, sums, bright, wide } => {
                for (slot, sums) in (first_slot..).zip(&sums) {
                    self.film.add_sums(stride.place(slot) as usize, sums);
                }
                for sample in bright {
                    self.add_sample(sample);
                }
                for (slot, sums) in &wide {
                    self.film.add_wide(stride.place(*slot) as usize, sums);
                }
            }
            Payload::Splats { first_slot, made, band, bright } => {
                self.film.add_band(&band);
                for (slot, &made) in (first_slot..).zip(&made) {
                    self.film.add_made(stride.place(slot) as usize, made);
                }
                for sample in bright {
                    self.add_sample(sample);
                }
            }
        }
        None
    }

    fn add_sample(&mut self, sample: Sample) {
        let place = self.region.place(sample.pixel) as usize;
        let added = match &self.splatter {
            Some(splatter) => self.film.splat(splatter, place, &sample),
            None => self.film.add_sample(place, sample.radiance),
        };
        if let Err(reject) = added {
            self.reject_counts.add(reject, 1);
            self.record_reject((Traced { pixel: sample.pixel, sample: sample.sample }, reject));
        }
    }

    /// Adds contributions of samples to any pixel.
    pub(super) fn contribute(&mut self, contributions: &[Contribution]) {
        if contributions.is_empty() {
            return;
        }
        let Some(splatter) = self.light.clone() else {
            unreachable!("contributions without a splatter");
        };
        for contribution in contributions {
            let Contribution { pixel, sample, .. } = *contribution;
            let place = self.region.place(pixel) as usize;
            if let Err(reject) = self.film.contribute(&splatter, place, contribution) {
                self.reject_counts.add(reject, 1);
                self.record_reject((Traced { pixel, sample }, reject));
            }
        }
    }

    /// Adds the first hits of samples of a stride, each to its own pixel.
    pub(super) fn add_first_hits(&mut self, stride: Stride, first_hits: &FirstHits) {
        let FirstHits { first_slot, sums } = first_hits;
        for (slot, other) in (*first_slot..).zip(0..sums.len()) {
            self.film.add_first_hits(stride.place(slot) as usize, sums, other);
        }
    }

    fn record_reject(&mut self, reject: (Traced, Reject)) {
        if self.rejects.len() < NAMED_REJECTS {
            self.rejects.push(reject);
        }
    }
}
