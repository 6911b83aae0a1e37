//! Pixels, the samples that are made for them, and the light that samples put on others.

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

/// Light that a sample puts on the film, wherever it lands: the end of a path from a light, or a step of a chain. A
/// sample may have any number of them. They count in the film's light image, apart from the radiance of pixels' own
/// samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[u32; 7]", into = "[u32; 7]")]
#[repr(C)]
pub struct Contribution {
    /// The pixel that the sample was made for: its index on the full film, row-major from the top left.
    pub pixel: u32,
    /// The sample's index among the pixel's.
    pub sample: u32,
    /// Film position in pixels from the film's left edge; it need not be on the film.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709, as if the full film were a single pixel: what the contributions of a
    /// sample add up to on the film is expected to be the mean of the light image. For a path from a light that is
    /// radiance × importance ⁄ density, with an importance whose integral over the film is one.
    pub radiance: [f32; 3],
}

/// Lets a type be serialised as its bits: text has no name for a radiance that is no number.
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
