//! What a film's words are, and which pixels become the picture.

use super::layer_set::LayerSet;
use super::light_image::{LightPixel, LightScale};
use super::spread::SpreadPixel;
use crate::sampling::Rectangle;

/// Bytes that a pixel takes, but for what a variance takes beside them where samples are weighed, a light image, and
/// layers of first hits.
pub(super) const BYTES_PER_PIXEL: u64 = 64;

/// How a film lies in memory, and what its words are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Whether samples count by weights, which a pixel's words then sum up.
    pub weighted: bool,
    /// Whether the words of a film whose samples count by weights have more beside them, which its variance takes.
    pub spreads: bool,
    /// What makes radiance of the sums of its light image, if samples may contribute to any pixel.
    pub light: Option<LightScale>,
    /// The layers of first hits that it has the sums of.
    pub layers: LayerSet,
    /// The part of it that becomes the picture. Pixels around it are there because their samples reach into it.
    pub shown: Rectangle,
}

impl Layout {
    /// A film whose samples all count the same and that is shown as a whole.
    pub fn plain(width: u32, height: u32) -> Layout {
        Layout {
            width,
            height,
            weighted: false,
            spreads: false,
            light: None,
            layers: LayerSet::NONE,
            shown: Rectangle { x: 0, y: 0, width, height },
        }
    }

    /// Bytes that a pixel's words take.
    pub fn pixel_bytes(&self) -> u64 {
        let light = if self.light.is_some() { LightPixel::BYTES as u64 } else { 0 };
        let spreads = if self.spreads { SpreadPixel::BYTES as u64 } else { 0 };
        BYTES_PER_PIXEL + spreads + light + self.layers.pixel_bytes()
    }

    /// Whether a film cannot tell the variance of its pixels: weights take more words for it, and of a light image it is
    /// not known.
    pub fn lacks_variance(&self) -> bool {
        (self.weighted && !self.spreads) || self.light.is_some()
    }

    /// The same without what only a variance takes.
    pub fn without_spreads(self) -> Layout {
        Layout { spreads: false, ..self }
    }

    /// Pixels of the film.
    pub fn len(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pixels of the picture.
    pub fn shown_len(&self) -> u64 {
        u64::from(self.shown.width) * u64::from(self.shown.height)
    }

    /// Places of the film that become the picture, row by row.
    pub fn places(&self) -> impl Iterator<Item = usize> + Clone {
        self.shown.places(self.width)
    }
}
