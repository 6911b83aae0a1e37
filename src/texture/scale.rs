//! The product of two textures.

use super::instruction::{Instruction, Op};
use super::program::{Builder, Cost, TextureParameters};
use crate::parameter::limits::RADIANCE;
use crate::parameter::{ParameterKind, Varying, parameters};

parameters! {
    /// Multiplies two textures, channel by channel.
    pub struct ScaleTexture: "scale", "a scaled texture" {
        /// The first factor: a number, a colour, or the name of a texture.
        texture: Varying = ParameterKind::Varying(RADIANCE),
        /// The second factor.
        by: Varying = ParameterKind::Varying(RADIANCE),
    }
}

impl TextureParameters for ScaleTexture {
    fn cost(&self, known: &[Cost]) -> Cost {
        Cost::after(&[&self.texture, &self.by], known)
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        builder.operands(&[&self.texture, &self.by], Instruction::new(Op::Scale, next))
    }
}
