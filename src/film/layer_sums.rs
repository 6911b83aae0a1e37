//! Exact sums of the first hits of a pixel's samples, for its layers.
//!
//! The sums include the samples with an index below [`LAYER_SAMPLES`], regardless of other samples: parts of a render
//! add up to the whole, and a resumed render keeps its layers. Each component is rounded once and then added as an
//! integer. Bits per sample record whether its first hit was traced and whether it met a surface. Cryptomatte layers
//! store the number of the entity or material of each sample in the sample's own slot. So nothing depends on the order
//! of samples.

use super::cryptomatte::{CHANNELS, Names};
use super::fixed::{SCALE, round_small};
use super::layer_set::{LAYER_SAMPLES, LayerSet};
use super::layers::{Channel, Layer, NO_DEPTH};
use crate::integrator::FirstHit;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The largest albedo or component of a normal that is added: 2²⁵. They are at most one for valid materials; 32 of
/// them, in multiples of 2⁻³², are 2⁶².
const MOST_UNIT: f64 = (1_u32 << 25) as f64;

/// Fractional bits of positions, depths and uv: scenes may use any unit of length.
const WIDE_BITS: i32 = 64;

/// The factor from these to an integer.
const WIDE_SCALE: f64 = (1_u128 << WIDE_BITS) as f64;

/// The base-2 logarithm of the largest of these that is added: 32 of them, in multiples of 2⁻⁶⁴, are 2¹²⁶.
const MOST_WIDE: i32 = 57;

/// The part of a range of samples that contributes to layers.
pub fn layer_samples(samples: &Range<u32>) -> Range<u32> {
    samples.start.min(LAYER_SAMPLES)..samples.end.min(LAYER_SAMPLES)
}

/// Sums of consecutive pixels. The first word of a pixel has a bit for each sample: in the low half those whose first
/// hit was traced, in the high half those that met a surface. The words of its layers follow.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LayerSums {
    set: LayerSet,
    words: Vec<u64>,
}

impl LayerSums {
    /// The sums of no pixels.
    pub fn new(set: LayerSet) -> LayerSums {
        LayerSums { set, words: Vec::new() }
    }

    /// The sums in these words.
    pub(super) fn of_words(set: LayerSet, words: Vec<u64>) -> LayerSums {
        LayerSums { set, words }
    }

    /// The summed layers.
    pub fn set(&self) -> LayerSet {
        self.set
    }

    /// The number of pixels.
    pub fn len(&self) -> usize {
        self.words.len() / self.set.words_of_pixel().max(1)
    }

    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// The samples of a pixel whose first hit was traced, one bit each.
    pub fn samples(&self, pixel: usize) -> u32 {
        self.row(pixel).first().map_or(0, |&seen| seen as u32)
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.words[..])
    }

    /// Extends the sums to this number of pixels; the new ones have no first hits.
    pub fn grow(&mut self, pixels: usize) {
        let words = pixels * self.set.words_of_pixel();
        self.words.resize(self.words.len().max(words), 0);
    }

    /// Appends the pixels of other sums of the same set.
    pub fn append(&mut self, mut other: LayerSums) {
        debug_assert_eq!(self.set, other.set);
        self.words.append(&mut other.words);
    }

    fn row(&self, pixel: usize) -> &[u64] {
        let words = self.set.words_of_pixel();
        &self.words[pixel * words..][..words]
    }

    /// The words of a layer of a pixel; empty if the layer is not in the set.
    fn layer(&self, pixel: usize, layer: Layer) -> &[u64] {
        let before: usize =
            self.set.layers().take_while(|&it| it != layer).map(|layer| self.set.words(layer)).sum();
        match self.set.words(layer) {
            0 => &[],
            words => &self.row(pixel)[1 + before..][..words],
        }
    }

    /// Adds the first hits of a pixel's samples from this index on, all below [`LAYER_SAMPLES`]. Components that are
    /// too large are clamped, and NaN counts as zero.
    pub fn add(&mut self, pixel: usize, first_sample: u32, hits: &[FirstHit]) {
        let (set, words) = (self.set, self.set.words_of_pixel());
        let Some((seen, mut rest)) = self.words[pixel * words..][..words].split_first_mut() else { return };
        for (sample, hit) in (first_sample..).zip(hits) {
            *seen |= 1 << sample | u64::from(hit.met) << (LAYER_SAMPLES + sample);
        }
        let mut next = |layer| {
            let (own, others) = std::mem::take(&mut rest).split_at_mut(set.words(layer));
            rest = others;
            own
        };
        // Samples that met no surface are zeros.
        add_units(next(Layer::Albedo), hits, |hit| hit.albedo);
        add_units(next(Layer::Normal), hits, |hit| hit.normal);
        add_wides(next(Layer::Position), hits, |hit| hit.position);
        add_wides(next(Layer::Depth), hits, |hit| [hit.depth]);
        add_wides(next(Layer::Uv), hits, |hit| hit.uv);
        let entity: fn(&FirstHit) -> u32 = |hit| hit.entity;
        for (layer, number) in [(Layer::CryptoEntity, entity), (Layer::CryptoMaterial, |hit| hit.material)] {
            let (own, bytes) = (next(layer), set.number_bytes(layer));
            if bytes > 0 {
                for (sample, hit) in (first_sample as usize..).zip(hits) {
                    let at = sample * bytes;
                    own[at / 8] |= u64::from(number(hit)) << (8 * (at % 8));
                }
            }
        }
    }

    /// Adds a pixel of other sums, of the same set and of other samples, to one of these.
    pub fn merge(&mut self, pixel: usize, other: &LayerSums, other_pixel: usize) {
        debug_assert_eq!(self.set, other.set);
        self.merge_words(pixel, other.row(other_pixel));
    }

    /// Overflow wraps: such words are not sums of first hits.
    fn merge_words(&mut self, pixel: usize, from: &[u64]) {
        let set = self.set;
        let to = &mut self.words[pixel * from.len()..][..from.len()];
        to[0] |= from[0];
        let mut at = 1;
        for layer in set.layers() {
            let words = at..at + set.words(layer);
            at = words.end;
            let (to, from) = (&mut to[words.clone()], &from[words]);
            match layer {
                Layer::Albedo | Layer::Normal => {
                    to.iter_mut().zip(from).for_each(|(sum, value)| *sum = sum.wrapping_add(*value));
                }
                Layer::Position | Layer::Depth | Layer::Uv => {
                    let (to, _) = to.as_chunks_mut();
                    let (from, _) = from.as_chunks();
                    to.iter_mut().zip(from).for_each(|(sum, value)| *sum = add_pair(*sum, pair(*value)));
                }
                _ => to.iter_mut().zip(from).for_each(|(numbers, other)| *numbers |= *other),
            }
        }
    }

    /// The words of a pixel in the format of a film file.
    pub(super) fn pixel_bytes(&self, pixel: usize) -> impl Iterator<Item = u8> + '_ {
        self.row(pixel).iter().flat_map(|word| word.to_le_bytes())
    }

    /// Adds the words of a pixel of a film file. Returns the samples whose first hit was traced and those that met a
    /// surface, one bit each.
    pub(super) fn add_bytes(&mut self, pixel: usize, bytes: &[u8]) -> [u32; 2] {
        let mut words = [0; LayerSet::MOST_WORDS];
        let words = &mut words[..self.set.words_of_pixel()];
        words.iter_mut().zip(bytes.as_chunks().0).for_each(|(to, from)| *to = u64::from_le_bytes(*from));
        self.merge_words(pixel, words);
        [words[0] as u32, (words[0] >> LAYER_SAMPLES) as u32]
    }

    /// The channels of a layer at some pixels, with the names for a Cryptomatte layer. Albedo and normal are means over
    /// all samples whose first hit was traced, so that they fade at the edges of the scene; the others are means over
    /// the samples that met a surface. Empty if the layer is not in the set.
    pub fn channels(
        &self,
        layer: Layer,
        pixels: impl Iterator<Item = usize>,
        names: Option<&Names>,
    ) -> Vec<Channel> {
        if !self.set.contains(layer) {
            return Vec::new();
        }
        let mut channels: Vec<Channel> =
            layer.channels().into_iter().map(|name| Channel { name, values: Vec::new() }).collect();
        for pixel in pixels {
            let values = self.values(pixel, layer, names);
            channels.iter_mut().zip(values).for_each(|(channel, value)| channel.values.push(value));
        }
        channels
    }

    /// The values of a pixel's channels of a layer, followed by zeros.
    fn values(&self, pixel: usize, layer: Layer, names: Option<&Names>) -> [f32; CHANNELS] {
        let (words, mut values) = (self.layer(pixel, layer), [0.0; CHANNELS]);
        let seen = self.row(pixel)[0];
        let (traced, met) = (f64::from((seen as u32).count_ones()), (seen >> LAYER_SAMPLES) as u32);
        let hits = f64::from(met.count_ones());
        match layer {
            Layer::Depth if met == 0 => values[0] = NO_DEPTH,
            Layer::Albedo | Layer::Normal => {
                let sums = words.iter().map(|&sum| sum as i64 as f64 / SCALE);
                values.iter_mut().zip(sums).for_each(|(to, sum)| *to = (sum / traced.max(1.0)) as f32);
            }
            Layer::Position | Layer::Depth | Layer::Uv => {
                let sums = words.as_chunks().0.iter().map(|&sum| pair(sum) as f64 / WIDE_SCALE);
                values.iter_mut().zip(sums).for_each(|(to, sum)| *to = (sum / hits.max(1.0)) as f32);
            }
            _ => {
                let bytes = self.set.number_bytes(layer);
                let number = |sample: u32| {
                    let at = sample as usize * bytes;
                    (words[at / 8] >> (8 * (at % 8))) as u32 & (u32::MAX >> (32 - 8 * bytes))
                };
                let met = (0..LAYER_SAMPLES).filter(|sample| met >> sample & 1 != 0).map(number);
                if let Some(names) = names {
                    values = names.ranks(met, traced as usize);
                }
            }
        }
        values
    }
}

/// A two's complement sum in two words, the low one first.
fn pair([low, high]: [u64; 2]) -> i128 {
    (u128::from(high) << 64 | u128::from(low)) as i128
}

fn add_pair(sum: [u64; 2], value: i128) -> [u64; 2] {
    let sum = pair(sum).wrapping_add(value);
    [sum as u64, (sum >> 64) as u64]
}

fn add_units<const N: usize>(sums: &mut [u64], hits: &[FirstHit], of: impl Fn(&FirstHit) -> [f32; N]) {
    for (component, sum) in sums.iter_mut().enumerate() {
        let added: i64 = hits.iter().map(|hit| unit(of(hit)[component])).sum();
        *sum = sum.wrapping_add(added as u64);
    }
}

fn add_wides<const N: usize>(sums: &mut [u64], hits: &[FirstHit], of: impl Fn(&FirstHit) -> [f32; N]) {
    for (component, sum) in sums.as_chunks_mut().0.iter_mut().enumerate() {
        let added: i128 = hits.iter().map(|hit| wide(of(hit)[component])).sum();
        *sum = add_pair(*sum, added);
    }
}

/// A component of at most one in multiples of 2⁻³², ties to even.
fn unit(value: f32) -> i64 {
    let value = f64::from(value).clamp(-MOST_UNIT, MOST_UNIT);
    if value.is_nan() {
        0
    } else if value.abs() < 1024.0 {
        round_small(value * SCALE)
    } else {
        // Already an integer.
        (value * SCALE) as i64
    }
}

/// A number of any magnitude in multiples of 2⁻⁶⁴, ties to even. Numbers from 2⁻⁴¹ on are exact.
fn wide(value: f32) -> i128 {
    let exponent = (value.to_bits() >> 23 & 0xff) as i32 - 127;
    if value.is_nan() {
        return 0;
    }
    let size = if exponent < 23 - WIDE_BITS {
        i128::from(round_small(f64::from(value.abs()) * WIDE_SCALE))
    } else if exponent >= MOST_WIDE {
        1 << (WIDE_BITS + MOST_WIDE)
    } else {
        let digits = i128::from(value.to_bits() & 0x7f_ffff | 0x80_0000);
        digits << (exponent + WIDE_BITS - 23)
    };
    if value < 0.0 { -size } else { size }
}

#[cfg(test)]
mod tests;
