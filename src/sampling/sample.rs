//! Pixels, their samples, and contributions of samples to other pixels.

use serde::{Deserialize, Serialize};

/// One sample: its position on the film and its radiance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[u32; 7]", into = "[u32; 7]")]
#[repr(C)]
pub struct Sample {
    /// Its pixel: the index on the full film, row-major from the top left.
    pub pixel: u32,
    /// Its index among the samples of the pixel.
    pub sample: u32,
    /// Film position in pixels from the film's left edge.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709.
    pub radiance: [f32; 3],
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

/// Light that a sample adds anywhere on the film: the end of a path from a light, or a step of a chain. A sample may
/// have any number of contributions. They are collected in the film's light image, separate from the radiance of
/// samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[u32; 7]", into = "[u32; 7]")]
#[repr(C)]
pub struct Contribution {
    /// The pixel of the sample: the index on the full film, row-major from the top left.
    pub pixel: u32,
    /// The index of the sample in its pixel.
    pub sample: u32,
    /// Film position in pixels from the film's left edge; it may be outside the film.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709, as if the full film were a single pixel: the expected sum of a sample's
    /// contributions on the film is the mean of the light image. For a path from a light it is radiance × importance ⁄
    /// density, with an importance whose integral over the film is one.
    pub radiance: [f32; 3],
}

/// Serialises a type as its bits, because text formats have no NaN.
macro_rules! serialised_as_bits {
    ($($Type:ident)*) => {
        $(
            impl From<$Type> for [u32; 7] {
                fn from($Type { pixel, sample, x, y, radiance: [r, g, b] }: $Type) -> [u32; 7] {
                    let [x, y, r, g, b] = [x, y, r, g, b].map(f32::to_bits);
                    [pixel, sample, x, y, r, g, b]
                }
            }

            impl From<[u32; 7]> for $Type {
                fn from([pixel, sample, x, y, r, g, b]: [u32; 7]) -> $Type {
                    let [x, y, r, g, b] = [x, y, r, g, b].map(f32::from_bits);
                    $Type { pixel, sample, x, y, radiance: [r, g, b] }
                }
            }
        )*
    };
}

serialised_as_bits! { Sample Contribution }
