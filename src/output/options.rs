//! The view and the metadata of a picture file.

use crate::film::cryptomatte::Names;
use crate::film::{Channel, Identity, ViewTransform};

/// The contents of a picture file beside the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureOptions<'a> {
    /// The view transform of an 8-bit file; linear files store radiance.
    pub view: ViewTransform,
    /// The facts that determine the bits of the picture, for EXR.
    pub facts: Option<&'a Identity>,
    /// Layers beside colour, for EXR.
    pub channels: &'a [Channel],
    /// The names in those of the channels that are Cryptomatte layers.
    pub mattes: &'a [&'a Names],
    /// The position of the picture on its film, for EXR; `None` if it is the whole film.
    pub crop: Option<Crop>,
}

/// The size of a film, and the position of a picture on it, in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// Width and height of the film.
    pub film: [u32; 2],
    /// Column and row of the picture's first pixel.
    pub from: [u32; 2],
}

impl Crop {
    /// From the facts `size` and `crop` of a film.
    pub fn of(identity: &Identity) -> Option<Crop> {
        let (width, height) = identity.get("size")?.split_once('x')?;
        let mut numbers = identity.get("crop")?.split(',').map(|number| number.parse().ok());
        let from = [numbers.next()??, numbers.next()??];
        Some(Crop { film: [width.parse().ok()?, height.parse().ok()?], from })
    }
}
