//! The layers of a picture that first hits tell: means over the first samples of each pixel.
//!
//! They are no part of the film: the same scene, settings and seed give the same layers, so that they are made
//! when they are wanted, also by a render that goes on with a film.

use crate::film::cryptomatte::{self, Mattes, Names};
use crate::film::layers::{Channel, Layer, NO_DEPTH};
use crate::integrator::{FirstHit, Integrator, Paths};
use crate::math::lanes::Level;
use crate::sampling::Region;
use crossbeam_channel::bounded;
use std::ops::Range;

/// Samples of a pixel that layers look at, at most: edges are smooth with that many.
const MOST_SAMPLES: u32 = 32;

/// One in this many samples is looked at once more for the layers: camera rays alone are cheap.
const SHARE: u32 = 4;

/// How many samples of a pixel the layers of a render of so many are means of.
pub fn layer_samples(spp: u32) -> u32 {
    (spp / SHARE).clamp(1, MOST_SAMPLES)
}

/// The channels of the wanted layers that first hits tell, of some samples of each pixel, with the names of the scene's
/// things. Each of the threads takes every so-manieth row, and asks before each which samples it is to look at: a render
/// that is to end wants fewer.
pub fn first_hit_layers(
    integrator: &dyn Integrator,
    level: Level,
    region: Region,
    samples: &(dyn Fn() -> Range<u32> + Sync),
    threads: usize,
    wanted: &[Layer],
    mattes: &Mattes,
) -> Vec<Channel> {
    let len = region.len() as usize;
    let layers = || wanted.iter().filter(|layer| !layer.is_of_film());
    let names = layers().flat_map(|layer| layer.channels());
    let mut channels: Vec<Channel> = names.map(|name| Channel { name, values: vec![0.0; len] }).collect();
    if channels.is_empty() {
        return channels;
    }
    let wants =
        |layer: Layer| wanted.contains(&layer).then_some(mattes).and_then(|mattes| layer.names(mattes));
    let names = [wants(Layer::CryptoEntity), wants(Layer::CryptoMaterial)];
    let width = region.width as usize;
    std::thread::scope(|scope| {
        let (rows_out, rows) = bounded(2 * threads);
        for thread in 0..threads as u32 {
            let rows_out = rows_out.clone();
            scope.spawn(move || {
                let mut hits = Vec::new();
                for row in (thread..region.height).step_by(threads) {
                    let pixels: Vec<_> =
                        (0..region.width).map(|x| region.pixel(row * region.width + x)).collect();
                    hits.clear();
                    let Range { start: first_sample, end } = samples();
                    let samples = end - first_sample;
                    let paths = Paths { pixels: &pixels, first_sample, samples };
                    integrator.first_hits(level, &paths, &mut hits);
                    let means: Vec<Mean> =
                        hits.chunks(samples as usize).map(|hits| Mean::of(hits, names)).collect();
                    // Nobody listens any more only if all is over.
                    if rows_out.send((row, means)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(rows_out);
        for (row, means) in rows {
            for (x, mean) in means.iter().enumerate() {
                let values = layers().flat_map(|&layer| mean.values(layer));
                for (channel, &value) in channels.iter_mut().zip(values) {
                    channel.values[row as usize * width + x] = value;
                }
            }
        }
    });
    channels
}

/// A pixel's means. Of albedo and normal over all samples, so that they fade where the scene ends; of the rest
/// over those that met something.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mean {
    albedo: [f32; 3],
    normal: [f32; 3],
    position: [f32; 3],
    depth: [f32; 1],
    uv: [f32; 2],
    entities: [f32; cryptomatte::CHANNELS],
    materials: [f32; cryptomatte::CHANNELS],
}

impl Mean {
    /// Of a pixel's hits, with ranks where there are names for them.
    fn of(hits: &[FirstHit], [entities, materials]: [Option<&Names>; 2]) -> Mean {
        let ranks = |names: Option<&Names>, number: fn(&FirstHit) -> u32| {
            let met = hits.iter().filter(|hit| hit.met).map(number);
            names.map_or([0.0; cryptomatte::CHANNELS], |names| names.ranks(met, hits.len()))
        };
        let met = hits.iter().filter(|hit| hit.met).count();
        Mean {
            albedo: mean(hits, hits.len(), |hit| hit.albedo),
            normal: mean(hits, hits.len(), |hit| hit.normal),
            position: mean(hits, met, |hit| hit.position),
            depth: if met > 0 { mean(hits, met, |hit| [hit.depth]) } else { [NO_DEPTH] },
            uv: mean(hits, met, |hit| hit.uv),
            entities: ranks(entities, |hit| hit.entity),
            materials: ranks(materials, |hit| hit.material),
        }
    }

    fn values(&self, layer: Layer) -> &[f32] {
        match layer {
            Layer::Albedo => &self.albedo,
            Layer::Normal => &self.normal,
            Layer::Position => &self.position,
            Layer::Depth => &self.depth,
            Layer::Uv => &self.uv,
            Layer::CryptoEntity => &self.entities,
            Layer::CryptoMaterial => &self.materials,
            Layer::Variance | Layer::Samples => &[],
        }
    }
}

/// A mean in the order of the samples; those that met nothing add zero.
fn mean<const N: usize>(hits: &[FirstHit], count: usize, of: impl Fn(&FirstHit) -> [f32; N]) -> [f32; N] {
    let mut sums = [0.0_f64; N];
    for hit in hits {
        sums.iter_mut().zip(of(hit)).for_each(|(sum, value)| *sum += f64::from(value));
    }
    sums.map(|sum| (sum / count.max(1) as f64) as f32)
}
