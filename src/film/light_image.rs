//! The light image: contributions of samples to any pixel of the film, in addition to the radiance of pixels' own
//! samples.
//!
//! A contribution is added to all pixels within the radius of the film's filter. The summand is its radiance times two
//! taps, an exact product, rounded once to a multiple of 2^−[`LIGHT_BITS`]; all additions are of integers. With n
//! samples made for all pixels of the film together, rejected ones included, and sums Σ, a pixel of the light image is
//!
//! Σ ⁄ n × (pixels of the full film) ⁄ (the filter's integral)²
//!
//!
//! so that it depends only on the set of samples: parts of a render add up, and a render may end between two samples. A
//! crop shows the contributions of its own pixels' samples alone, at the brightness of the full film. pbrt's films
//! treat splats likewise (Pharr, Jakob and Humphreys, *Physically Based Rendering*, 2023, §5.4); pbrt traces as many
//! light paths as there are samples.

use super::weights::Weights;

/// Fractional bits of its sums: the light of a sample is often distributed over many faint contributions.
pub const LIGHT_BITS: u32 = 48;

/// The factors from the sums of a light image to radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightScale {
    /// Pixels of the full film, of which the film may be a part.
    pub pixels: u32,
    /// The integral of the taps along an axis, in multiples of 2⁻³¹: see [`Weights::integral`].
    pub integral: u32,
}

impl LightScale {
    /// The scale for a full film of this many pixels and a filter's weights.
    pub fn new(pixels: u32, weights: &Weights) -> LightScale {
        LightScale { pixels, integral: weights.integral() }
    }

    /// Whether a light image of this many pixels can have the scale.
    pub(super) fn is_possible(self, pixels: u64) -> bool {
        self.integral > 0 && u64::from(self.pixels) >= pixels
    }

    /// The radiance of a sum of one unit, with this number of samples.
    pub(super) fn of(self, samples: u64) -> f64 {
        const UNIT: f64 = 1.0 / (1_u64 << LIGHT_BITS) as f64;
        let integral = f64::from(self.integral) / f64::from(1_u32 << 31);
        f64::from(self.pixels) / (integral * integral) * UNIT / samples as f64
    }
}

/// One pixel of a light image: 64 bytes, in the order of a film file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub(super) struct LightPixel {
    /// Sums of radiance × weight, in multiples of 2^−[`LIGHT_BITS`]: at most 2⁷⁸ per contribution.
    pub(super) rgb: [i128; 3],
    /// Rejected contributions of samples of this pixel.
    pub(super) rejected: u64,
    /// Contributions of samples of this pixel that reached no pixel of the film.
    pub(super) outside: u64,
}

impl LightPixel {
    pub(super) const BYTES: usize = size_of::<LightPixel>();

    /// The words in the format of a film file: in the order of the fields, little-endian.
    pub(super) fn to_bytes(self) -> [u8; LightPixel::BYTES] {
        let mut bytes = [0; LightPixel::BYTES];
        for (to, word) in bytes.chunks_exact_mut(16).zip(self.rgb) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        for (to, word) in bytes[48..].chunks_exact_mut(8).zip([self.rejected, self.outside]) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    pub(super) fn from_bytes(bytes: &[u8; LightPixel::BYTES]) -> LightPixel {
        let (sums, _) = bytes[..48].as_chunks();
        let (counts, _) = bytes[48..].as_chunks();
        LightPixel {
            rgb: [0, 1, 2].map(|i| i128::from_le_bytes(sums[i])),
            rejected: u64::from_le_bytes(counts[0]),
            outside: u64::from_le_bytes(counts[1]),
        }
    }

    /// Adds the words of another film's pixel. Overflow wraps: such words are not sums of contributions.
    pub(super) fn merge(&mut self, other: &LightPixel) {
        self.rgb.iter_mut().zip(other.rgb).for_each(|(sum, value)| *sum = sum.wrapping_add(value));
        self.rejected = self.rejected.wrapping_add(other.rejected);
        self.outside = self.outside.wrapping_add(other.outside);
    }
}

const _: () = assert!(LightPixel::BYTES == 64);
