//! Pixels, and the samples that are made for them.

use serde::{Deserialize, Serialize};

/// One sample: its place on the film and its radiance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[u32; 7]", into = "[u32; 7]")]
#[repr(C)]
pub struct Sample {
    /// The pixel it was made for: its index on the full film, row-major from the top left.
    pub pixel: u32,
    /// Its index among the pixel's samples.
    pub sample: u32,
    /// Film position in pixels from the film's left edge.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709.
    pub radiance: [f32; 3],
}

/// The bits, as they travel: a sample may be no number.
impl From<Sample> for [u32; 7] {
    fn from(Sample { pixel, sample, x, y, radiance: [r, g, b] }: Sample) -> [u32; 7] {
        let [x, y, r, g, b] = [x, y, r, g, b].map(f32::to_bits);
        [pixel, sample, x, y, r, g, b]
    }
}

impl From<[u32; 7]> for Sample {
    fn from([pixel, sample, x, y, r, g, b]: [u32; 7]) -> Sample {
        let [x, y, r, g, b] = [x, y, r, g, b].map(f32::from_bits);
        Sample { pixel, sample, x, y, radiance: [r, g, b] }
    }
}

/// A pixel of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// Index on the full film, row-major from the top left.
    pub index: u32,
    /// Column, from the left.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
}
