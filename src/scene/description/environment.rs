//! The environment.

use crate::parameter::{Colour, ImageIndex, Number};
use crate::texture::{ColorSpace, ImageTexture, TexelFilter, Wrap};
use glam::DVec3;

/// A picture of what is all around, infinitely far away: equirectangular, bilinear between the centres of its texels, around
/// along its width and clamped at its upper and lower edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentPicture {
    /// Its file among the images of the scene, which is none of tiles. 8 and 16 bits are taken for sRGB, floats for
    /// linear.
    pub file: ImageIndex,
    /// What its radiance is multiplied by.
    pub scale: Colour,
    /// Radians by which it is turned about `up`, counter-clockwise seen from above.
    pub rotate: f64,
    /// The direction to its upper edge, of length one. With +z and without rotation its middle column is seen along +x and
    /// the quarter left of the middle along +y.
    pub up: DVec3,
}

impl EnvironmentPicture {
    /// Degrees that it may be turned by.
    pub const TURNS: Number = Number::between(-1e6, 1e6);

    /// The picture of a file as it is, with up +z.
    pub fn of(file: ImageIndex) -> EnvironmentPicture {
        EnvironmentPicture { file, scale: [1.0; 3], rotate: 0.0, up: DVec3::Z }
    }

    /// The picture as a texture.
    pub fn texture(&self) -> ImageTexture {
        ImageTexture {
            file: self.file,
            color_space: ColorSpace::Auto,
            wrap: [Wrap::Repeat, Wrap::Clamp],
            filter: TexelFilter::Linear,
            mipmap: false,
            uv_scale: [1.0; 2],
            uv_offset: [0.0; 2],
            uv_rotate: 0.0,
            uv_set: 0.0,
        }
    }
}
