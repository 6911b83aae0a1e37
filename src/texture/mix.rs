//! A mix of two textures.

use super::instruction::{Instruction, Op};
use super::program::{Builder, Cost, TextureParameters};
use crate::math::{Float, Rgb};
use crate::parameter::limits::RADIANCE;
use crate::parameter::{Number, ParameterKind, Varying, parameters};

parameters! {
    /// Mixes two textures, channel by channel.
    pub struct MixTexture: "mix", "a mix of textures" {
        /// The value where `amount` is 0: a number, a colour, or the name of a texture.
        a: Varying = ParameterKind::Varying(RADIANCE),
        /// The value where `amount` is 1.
        b: Varying = ParameterKind::Varying(RADIANCE),
        /// The fraction of `b`, limited to 0…1; a texture's red channel is used.
        amount: Varying = ParameterKind::Varying(Number::between(0.0, 1.0)) => "0.5",
    }
}

impl TextureParameters for MixTexture {
    fn cost(&self, known: &[Cost]) -> Cost {
        Cost::after(&[&self.a, &self.b, &self.amount], known)
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        builder.operands(&[&self.a, &self.b, &self.amount], Instruction::new(Op::Mix, next))
    }
}

/// The mix of two colours by the first channel of `amount`.
#[inline(always)]
pub(super) fn mixed<F: Float>(a: Rgb<F>, b: Rgb<F>, amount: F) -> Rgb<F> {
    let amount = amount.max(F::zero()).min(F::splat(1.0));
    a * (F::splat(1.0) - amount) + b * amount
}
