//! A checkerboard of two textures.

use super::columns::Instructions;
use super::files::ImageFile;
use super::instruction::{Instruction, Op};
use super::program::{Builder, Cost, TextureParameters};
use super::slope_step::SlopeStep;
use crate::math::{Float, Uint};
use crate::parameter::limits::{LENGTH, RADIANCE};
use crate::parameter::{ParameterKind, Varying, parameters};

parameters! {
    /// Alternates two textures over the surface's uv: `even` is used where ⌊u·a⌋ + ⌊v·b⌋ is even, with a and b checks
    /// per unit. A texture within a check uses coordinates within it, scaled to 0…1.
    pub struct CheckerboardTexture: "checkerboard", "a checkerboard texture" {
        /// The value on checks whose numbers along u and v have an even sum: a number, a colour, or the name of a
        /// texture.
        even: Varying = ParameterKind::Varying(RADIANCE),
        /// The value on the other checks.
        odd: Varying = ParameterKind::Varying(RADIANCE),
        /// Checks per unit of uv: one number, or one along u and one along v. A plane's uv are lengths in the plane.
        checks_per_unit: [f64; 2] = ParameterKind::Pair(LENGTH) => "1",
    }
}

/// The distance over which slopes are measured, relative to the side of a check: heights rise over this width at its
/// edge.
const SLOPE_STEP: f64 = 1.0 / 32.0;

/// The bit of a checkerboard that leaves uv unchanged, because none of its textures depends on them.
const KEEPS_UV: u32 = 1;

impl TextureParameters for CheckerboardTexture {
    fn cost(&self, known: &[Cost]) -> Cost {
        let [even, odd] = [&self.even, &self.odd].map(|value| Cost::of(value, known));
        let within_uses_uv = even.uses_uv || odd.uses_uv;
        Cost {
            // Uv may have to be saved and restored.
            instructions: even.instructions.saturating_add(odd.instructions).saturating_add(3),
            depth: even.depth.max(odd.depth) + usize::from(within_uses_uv),
            uses_uv: true,
        }
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        let within_uses_uv = builder.uses_uv(&self.even) || builder.uses_uv(&self.odd);
        let saves = within_uses_uv && next != super::instruction::END;
        let then = if saves { builder.push(Instruction::new(Op::Restore, next)) } else { next };
        let even = builder.value(&self.even, then);
        let odd = builder.value(&self.odd, then);
        let [a, b] = self.checks_per_unit.map(|x| x as f32);
        let check = builder.push(Instruction {
            other: odd,
            flags: if within_uses_uv { 0 } else { KEEPS_UV },
            numbers: [a, b, 0.0, 0.0, 0.0, 0.0],
            ..Instruction::new(Op::Check, even)
        });
        if saves { builder.push(Instruction::new(Op::Save, check)) } else { check }
    }

    fn slope_step(&self, named: SlopeStep, _images: &[ImageFile]) -> SlopeStep {
        let within = named.min(SlopeStep { uv: [SLOPE_STEP; 2], ..SlopeStep::NONE });
        let [a, b] = self.checks_per_unit;
        SlopeStep { uv: [within.uv[0] / a, within.uv[1] / b], ..within }
    }
}

/// The instruction that a checkerboard continues with, and uv there.
#[inline(always)]
pub(super) fn choose<F: Float>(all: &Instructions, at: F::Uint, [u, v]: [F; 2]) -> (F::Uint, [F; 2]) {
    let a = u * all.number::<F>(0, at);
    let b = v * all.number::<F>(1, at);
    let (line, column) = (a.floor(), b.floor());
    let half = (line + column) * 0.5;
    let is_even = half.floor().ge(half);
    let next = F::Uint::select(is_even, all.next(at), all.other(at));
    let keeps = keeps_uv::<F>(all, at);
    (next, [F::select(keeps, u, a - line), F::select(keeps, v, b - column)])
}

/// The area of uv within a check per area of uv.
#[inline(always)]
pub(super) fn uv_area_scale<F: Float>(all: &Instructions, at: F::Uint) -> F {
    let scale = (all.number::<F>(0, at) * all.number::<F>(1, at)).abs();
    F::select(keeps_uv::<F>(all, at), F::splat(1.0), scale)
}

/// Whether uv, and the area of them that a pixel covers, remain unchanged, so that they need not be restored.
#[inline(always)]
fn keeps_uv<F: Float>(all: &Instructions, at: F::Uint) -> F::Mask {
    all.flags(at).eq(F::Uint::splat(KEEPS_UV))
}
