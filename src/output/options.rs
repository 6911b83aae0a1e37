//! What a picture file says beside the picture.

use crate::film::cryptomatte::Names;
use crate::film::{Channel, Identity, ViewTransform};

/// What a picture file depends on beside the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureOptions<'a> {
    /// How an 8-bit file shows it; linear files keep the radiance as it is.
    pub view: ViewTransform,
    /// What determines the bits of the picture, for formats that can tell: EXR.
    pub facts: Option<&'a Identity>,
    /// Layers beside colour, for the format that has room for them: EXR.
    pub channels: &'a [Channel],
    /// What those of the channels that are mattes are about.
    pub mattes: &'a [&'a Names],
    /// Where the picture lies on its film, for the format that can tell: EXR. None where it is the whole of it.
    pub crop: Option<Crop>,
}

/// A film and the place on it where a picture begins, in pixels from the top left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// Width and height of the film.
    pub film: [u32; 2],
    /// Column and row of the picture's first pixel.
    pub from: [u32; 2],
}

impl Crop {
    /// What a film says of itself: its facts `size` and `crop`.
    pub fn of(identity: &Identity) -> Option<Crop> {
        let (width, height) = identity.get("size")?.split_once('x')?;
        let mut numbers = identity.get("crop")?.split(',').map(|number| number.parse().ok());
        let from = [numbers.next()??, numbers.next()??];
        Some(Crop { film: [width.parse().ok()?, height.parse().ok()?], from })
    }
}
