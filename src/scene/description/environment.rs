//! The environment.

use crate::parameter::{Colour, ImageIndex, Number};
use crate::texture::{ColorSpace, ImageTexture, TexelFilter, Wrap};
use glam::DVec3;

/// An environment picture, infinitely far away: equirectangular, interpolated bilinearly between the centres of texels,
/// periodic along its width and clamped at its upper and lower edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentPicture {
    /// The index of its file among the images of the scene; it must not consist of tiles. 8 and 16 bits are decoded
    /// from sRGB, floats are linear.
    pub file: ImageIndex,
    /// The factor for its radiance.
    pub scale: Colour,
    /// The rotation about `up` in radians, counter-clockwise as seen from above.
    pub rotate: f64,
    /// The direction of its upper edge, of unit length. With +z and without rotation, its centre column is in direction
    /// +x, and the column a quarter left of the centre in direction +y.
    pub up: DVec3,
}

impl EnvironmentPicture {
    /// The range of the rotation, in degrees.
    pub const TURNS: Number = Number::between(-1e6, 1e6);

    /// The picture of a file, without rotation, with up +z.
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
