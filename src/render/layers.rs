//! Traces the first hits of samples for layers.

use super::batch::FirstHits;
use super::stride::Stride;
use crate::film::cryptomatte::Mattes;
use crate::film::{Channel, Layer, LayerSet, LayerSums, layer_samples};
use crate::integrator::{FirstHit, Integrator, Paths};
use crate::math::lanes::Level;
use crate::sampling::{Pixel, Region};
use std::ops::Range;
use std::sync::Arc;

/// Adds the first hits of some samples of some pixels to sums, for those samples that contribute to layers. `place`
/// maps each pixel to its index among the sums. `hits` is a reusable buffer.
pub(super) fn trace_first_hits(
    integrator: &dyn Integrator,
    level: Level,
    pixels: &[Pixel],
    samples: &Range<u32>,
    place: impl Fn(usize) -> usize,
    hits: &mut Vec<FirstHit>,
    sums: &mut LayerSums,
) {
    let traced = layer_samples(samples);
    if traced.is_empty() || pixels.is_empty() || sums.set().is_empty() {
        return;
    }
    hits.clear();
    let samples = traced.end - traced.start;
    integrator.first_hits(level, &Paths { pixels, first_sample: traced.start, samples }, hits);
    sums.grow(place(pixels.len() - 1) + 1);
    for (pixel, hits) in hits.chunks_exact(samples as usize).enumerate() {
        sums.add(place(pixel), traced.start, hits);
    }
}

/// Traces first hits on the CPU for a worker on another device.
#[derive(Clone)]
pub struct FirstHitTracer {
    /// The integrator that traces camera rays.
    pub integrator: Arc<dyn Integrator>,
    /// The SIMD level.
    pub level: Level,
    /// The layers of the film.
    pub layers: LayerSet,
    /// The rendered part of the film.
    pub region: Region,
    /// The number of threads.
    pub threads: usize,
}

impl FirstHitTracer {
    /// Traces the first hits of some samples of some slots of a stride.
    pub fn trace_first_hits(&self, stride: Stride, slots: Range<u32>, samples: &Range<u32>) -> FirstHits {
        let mut all = FirstHits::none(self.layers, slots.start);
        if layer_samples(samples).is_empty() || slots.is_empty() || self.layers.is_empty() {
            return all;
        }
        let share = slots.len().div_ceil(self.threads.max(1)).max(1);
        let shares: Vec<_> =
            slots.clone().step_by(share).map(|from| from..slots.end.min(from + share as u32)).collect();
        std::thread::scope(|scope| {
            let trace = |slots| self.trace_alone(stride, slots, samples);
            let threads: Vec<_> =
                shares.iter().skip(1).cloned().map(|slots| scope.spawn(move || trace(slots))).collect();
            all.sums.append(trace(shares[0].clone()));
            for thread in threads {
                // A panic is propagated, as it would be without threads.
                let sums = thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                all.sums.append(sums);
            }
        });
        all
    }

    fn trace_alone(&self, stride: Stride, slots: Range<u32>, samples: &Range<u32>) -> LayerSums {
        const BLOCK: usize = 128;
        let (mut sums, mut hits) = (LayerSums::new(self.layers), Vec::new());
        let pixels: Vec<Pixel> = slots.map(|slot| self.region.pixel(stride.place(slot))).collect();
        for (block, pixels) in pixels.chunks(BLOCK).enumerate() {
            let place = |i| block * BLOCK + i;
            trace_first_hits(&*self.integrator, self.level, pixels, samples, place, &mut hits, &mut sums);
        }
        sums
    }
}

/// The channels of some layers of a part of the film before it is rendered, from a few samples of each pixel, with the
/// names of entities and materials.
pub fn preview(
    integrator: &Arc<dyn Integrator>,
    level: Level,
    region: Region,
    samples: u32,
    layers: &[Layer],
    mattes: &Mattes,
) -> Vec<Channel> {
    let set = LayerSet::new(layers, mattes.entities.len(), mattes.materials.len());
    let tracer =
        FirstHitTracer { integrator: Arc::clone(integrator), level, layers: set, region, threads: 1 };
    let names = set.layers().flat_map(Layer::channels);
    let mut all: Vec<Channel> = names.map(|name| Channel { name, values: Vec::new() }).collect();
    // The sums of a pixel are several times as large as its channels, so only one row is in memory at a time.
    for row in 0..region.height {
        let slots = row * region.width..(row + 1) * region.width;
        let sums = tracer.trace_first_hits(Stride::ALL, slots, &(0..samples)).sums;
        let of_row = set.layers().flat_map(|layer| sums.channels(layer, 0..sums.len(), layer.names(mattes)));
        all.iter_mut().zip(of_row).for_each(|(channel, more)| channel.values.extend(more.values));
    }
    all
}
