//! The extra sums of a film of weighted samples from which its variance is estimated.
//!
//! A pixel is P = Σ w L ⁄ Σ w. To first order in the errors of the sums, its variance is Σ w² |L − P|² ⁄ (Σ w)² (Owen,
//! *Monte Carlo theory, methods and examples*, section 9.2, on self-normalised weights). With
//! |L − P|² = |L|² − 2 P·L + |P|² three more sums suffice: of w², w² L and w² |L|². They are stored separately from the
//! film's other words, and only on request.
//!
//! w² is the product of two squared taps, each rounded to a multiple of 2⁻¹⁴ like the taps themselves, so that its
//! product with a radiance is exact. Because all three sums use the same w², the variance cannot fall below zero.

use super::fixed::{FRACTION_BITS, QUANTUM, TAP_BITS};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Fractional bits of w² |L|²: dark pictures have small squares.
pub(super) const SQUARE_BITS: u32 = 48;

/// Fractional bits of a square in the low word of a band.
pub(super) const LOW_BITS: u32 = 32;

/// The square of a tap, both in multiples of 2^−[`TAP_BITS`], halves rounded up.
#[inline(always)]
pub(super) fn squared(tap: i32) -> i32 {
    (tap * tap + (1 << (TAP_BITS - 1))) >> TAP_BITS
}

/// r² + g² + b², in multiples of 2^−[`SQUARE_BITS`]: up to 2¹¹⁰.
#[inline(always)]
pub(super) fn scaled_square([r, g, b]: [f32; 3]) -> f64 {
    let [r, g, b] = [f64::from(r), f64::from(g), f64::from(b)];
    (r * r + g * g + b * b) * (1_u64 << SQUARE_BITS) as f64
}

/// A single sample has no variance estimate, nor do several if one outweighs all others. The value 1 − 1/n for n equal
/// samples must exceed this, or the estimate would consist of rounding errors.
const LEAST_FREE: f64 = 1.0 / 1024.0;

/// The extra sums of one pixel: 64 bytes, in the order of a film file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub(super) struct SpreadPixel {
    /// Low 64 bits of the sums of w² L, in multiples of the quantum.
    rgb_low: [u64; 3],
    /// The two lower words of the sum of w² |L|², in multiples of 2^−[`SQUARE_BITS`].
    squares_low: [u64; 2],
    /// The sum of w², in multiples of 2⁻²⁸: less than nine times 2³² of them.
    weight: u64,
    /// High 32 bits of the sums of w² L.
    rgb_high: [u32; 3],
    /// High 32 bits of the sum of w² |L|².
    squares_high: u32,
}

impl SpreadPixel {
    pub(super) const BYTES: usize = size_of::<SpreadPixel>();

    /// Adds w² L, w² and w² |L|².
    #[inline]
    pub(super) fn add(&mut self, rgb: [u128; 3], weight: u64, squares: u128) {
        for (channel, value) in rgb.into_iter().enumerate() {
            let sum = self.radiance_words(channel).wrapping_add(value);
            (self.rgb_low[channel], self.rgb_high[channel]) = (sum as u64, (sum >> 64) as u32);
        }
        self.weight = self.weight.wrapping_add(weight);
        self.add_squares(squares, 0);
    }

    fn add_squares(&mut self, low: u128, high: u32) {
        let (sum, carry) = self.square_words().overflowing_add(low);
        self.squares_low = [sum as u64, (sum >> 64) as u64];
        self.squares_high = self.squares_high.wrapping_add(high).wrapping_add(carry.into());
    }

    /// Adds the words of another film's pixel. Overflow wraps: such words are not sums of samples.
    pub(super) fn merge(&mut self, other: &SpreadPixel) {
        self.add([0, 1, 2].map(|channel| other.radiance_words(channel)), other.weight, 0);
        self.add_squares(other.square_words(), other.squares_high);
    }

    fn radiance_words(&self, channel: usize) -> u128 {
        u128::from(self.rgb_high[channel]) << 64 | u128::from(self.rgb_low[channel])
    }

    fn square_words(&self) -> u128 {
        let [low, high] = self.squares_low;
        u128::from(high) << 64 | u128::from(low)
    }

    /// The sums as integers; the sum of squares modulo 2¹²⁸.
    #[cfg(test)]
    pub(super) fn words(&self) -> ([u128; 3], u64, u128) {
        ([0, 1, 2].map(|channel| self.radiance_words(channel)), self.weight, self.square_words())
    }

    /// The words in the format of a film file: in the order of the fields, little-endian.
    pub(super) fn to_bytes(self) -> [u8; SpreadPixel::BYTES] {
        let mut bytes = [0; SpreadPixel::BYTES];
        let [r, g, b] = self.rgb_low;
        let [low, high] = self.squares_low;
        for (to, word) in bytes.chunks_exact_mut(8).zip([r, g, b, low, high, self.weight]) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        let [r, g, b] = self.rgb_high;
        for (to, word) in bytes[48..].chunks_exact_mut(4).zip([r, g, b, self.squares_high]) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    pub(super) fn from_bytes(bytes: &[u8; SpreadPixel::BYTES]) -> SpreadPixel {
        let (longs, _) = bytes[..48].as_chunks();
        let (shorts, _) = bytes[48..].as_chunks();
        let long = |i: usize| u64::from_le_bytes(longs[i]);
        let short = |i: usize| u32::from_le_bytes(shorts[i]);
        SpreadPixel {
            rgb_low: [0, 1, 2].map(long),
            squares_low: [long(3), long(4)],
            weight: long(5),
            rgb_high: [0, 1, 2].map(short),
            squares_high: short(3),
        }
    }

    /// The variance of a pixel's radiance, summed over its channels, given the mean radiance and the sum of weights.
    /// Zero if a single sample dominates.
    pub(super) fn variance(&self, mean: [f64; 3], weights: f64) -> f64 {
        const SQUARE: f64 = 1.0 / (1_u64 << SQUARE_BITS) as f64;
        let weight = self.weight as f64 * (1.0 / (1_u64 << (2 * TAP_BITS)) as f64);
        let squares = f64::from(self.squares_high) * 2.0_f64.powi(128) + self.square_words() as f64;
        let dot: f64 =
            (0..3).map(|channel| mean[channel] * (self.radiance_words(channel) as f64 * QUANTUM)).sum();
        let length = mean.iter().map(|c| c * c).sum::<f64>();
        let spread = squares * SQUARE - 2.0 * dot + length * weight;
        // The factor n − 1 ⁄ n of n equal weights: samples are nearer to their own mean than to the expectation.
        let free = 1.0 - weight / (weights * weights);
        if weights > 0.0 && free > LEAST_FREE { (spread / (weights * weights * free)).max(0.0) } else { 0.0 }
    }
}

/// The extra sums of a band. The arrays are laid out such that whole registers are added.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Spreads {
    /// w² L and w² of each pixel.
    pub(super) sums: Vec<[i64; 4]>,
    /// w² |L|² of each pixel, in a high and a low word, both signed: a sample adds at most half of 2^[`LOW_BITS`] to
    /// the low word, so that more than 2³⁰ samples fit.
    pub(super) squares: [Vec<i64>; 2],
}

impl Spreads {
    /// Bytes per pixel.
    pub(super) const BYTES: usize = size_of::<[i64; 4]>() + 2 * size_of::<i64>();

    /// The sums of this number of pixels without samples.
    pub(super) fn new(len: usize) -> Spreads {
        Spreads { sums: vec![[0; 4]; len], squares: [vec![0; len], vec![0; len]] }
    }

    /// Adds the sums of some pixels to a film's.
    pub(super) fn add_to(&self, pixels: Range<usize>, film: &mut [SpreadPixel]) {
        let [high, low] = self.squares.each_ref().map(|words| &words[pixels.clone()]);
        for (to, (sums, (&high, &low))) in
            film.iter_mut().zip(self.sums[pixels].iter().zip(high.iter().zip(low)))
        {
            let [r, g, b, weight] = *sums;
            let squares = (i128::from(high) << LOW_BITS) + i128::from(low);
            to.add([r, g, b].map(|c| c as u128), weight as u64, squares as u128);
        }
    }
}

const _: () = assert!(SpreadPixel::BYTES == 64 && FRACTION_BITS == 32);

#[cfg(test)]
mod tests;
