//! The layout of a film: the kinds of its sums, and the part that becomes the picture.

use super::layer_set::LayerSet;
use super::light_image::{LightPixel, LightScale};
use super::spread::SpreadPixel;
use crate::sampling::Rectangle;

/// Bytes per pixel, without the extra sums for a variance of weighted samples, a light image, and layers of first hits.
pub(super) const BYTES_PER_PIXEL: u64 = 64;

/// The size of a film, and the kinds of its sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Whether samples have weights, which pixels then sum as well.
    pub weighted: bool,
    /// Whether weighted pixels have the extra sums that their variance needs.
    pub spreads: bool,
    /// The scale of the light image, if samples may contribute to any pixel.
    pub light: Option<LightScale>,
    /// The layers of first hits whose sums it has.
    pub layers: LayerSet,
    /// The part that becomes the picture. Pixels around it are rendered because their samples contribute to it.
    pub shown: Rectangle,
}

impl Layout {
    /// A film of unweighted samples that is shown as a whole.
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

    /// Bytes per pixel.
    pub fn pixel_bytes(&self) -> u64 {
        let light = if self.light.is_some() { LightPixel::BYTES as u64 } else { 0 };
        let spreads = if self.spreads { SpreadPixel::BYTES as u64 } else { 0 };
        BYTES_PER_PIXEL + spreads + light + self.layers.pixel_bytes()
    }

    /// Whether the film cannot estimate the variance of its pixels: with weights that needs extra sums, and for a light
    /// image it is unknown.
    pub fn lacks_variance(&self) -> bool {
        (self.weighted && !self.spreads) || self.light.is_some()
    }

    /// The same layout without the extra sums for a variance.
    pub fn without_spreads(self) -> Layout {
        Layout { spreads: false, ..self }
    }

    /// Pixels of the film.
    pub fn len(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Whether the film has no pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pixels of the picture.
    pub fn shown_len(&self) -> u64 {
        u64::from(self.shown.width) * u64::from(self.shown.height)
    }

    /// Indices of the film's pixels that become the picture, row by row.
    pub fn places(&self) -> impl Iterator<Item = usize> + Clone {
        self.shown.places(self.width)
    }
}
