//! The textures in scenes.

use super::program::TextureParameters;
use crate::parameter::family;

family! {
    /// A texture, as a scene describes it.
    pub enum TextureKind {
        Constant(constant::ConstantTexture),
        Image(image::ImageTexture),
        Checkerboard(checkerboard::CheckerboardTexture),
        Mix(mix::MixTexture),
        Scale(scale::ScaleTexture),
        Noise(noise::NoiseTexture),
    }

    /// Its program.
    pub(crate) fn program(&self) -> &dyn TextureParameters = texture => texture;
}
