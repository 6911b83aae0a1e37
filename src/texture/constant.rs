//! The constant texture.

use super::program::{Builder, Cost, TextureParameters};
use crate::parameter::limits::RADIANCE;
use crate::parameter::{ParameterKind, Varying, parameters};

parameters! {
    /// The same value everywhere.
    pub struct ConstantTexture: "constant", "a constant texture" {
        /// A number, a colour, or the name of a texture.
        value: Varying = ParameterKind::Varying(RADIANCE),
    }
}

impl TextureParameters for ConstantTexture {
    fn cost(&self, known: &[Cost]) -> Cost {
        Cost::of(&self.value, known)
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        builder.value(&self.value, next)
    }
}
