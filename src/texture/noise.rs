//! Noise.

use super::columns::Instructions;
use super::files::ImageFile;
use super::instruction::{Instruction, Op};
use super::program::{Builder, Cost, TextureParameters};
use super::slope_step::SlopeStep;
use crate::math::{Float, Mask, Uint, Vec3, function};
use crate::parameter::limits::RADIANCE;
use crate::parameter::{Number, ParameterKind, Varying, parameters};

/// The maximum number of octaves: further ones would be smaller than 32 bits can resolve.
const MOST_OCTAVES: u32 = 16;

parameters! {
    /// Mixes two textures by Perlin's gradient noise, in several octaves, at the point in the scene's space.
    pub struct NoiseTexture: "noise", "a noise texture" {
        /// The value where the noise is lowest: a number, a colour, or the name of a texture.
        a: Varying = ParameterKind::Varying(RADIANCE) => "0",
        /// The value where the noise is highest.
        b: Varying = ParameterKind::Varying(RADIANCE) => "1",
        /// Features of the first octave per unit of length.
        scale: f64 = ParameterKind::Number(Number::positive(1e-9, 1e9)) => "1",
        /// The number of octaves, each with half the feature size of the one before.
        octaves: f64 = ParameterKind::Integer(1, MOST_OCTAVES) => "1",
        /// The amplitude of each octave relative to the one before.
        roughness: f64 = ParameterKind::Number(Number::between(0.0, 1.0)) => "0.5",
    }
}

impl TextureParameters for NoiseTexture {
    fn cost(&self, known: &[Cost]) -> Cost {
        Cost::after(&[&self.a, &self.b], known)
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        let octaves = self.octaves as u32;
        let whole: f64 = (0..octaves).map(|octave| libm::pow(self.roughness, f64::from(octave))).sum();
        let [scale, roughness, share] = [self.scale, self.roughness, 0.5 / whole].map(|x| x as f32);
        let instruction = Instruction {
            link: octaves,
            numbers: [scale, roughness, share, 0.0, 0.0, 0.0],
            ..Instruction::new(Op::Noise, next)
        };
        builder.operands(&[&self.a, &self.b], instruction)
    }

    fn slope_step(&self, named: SlopeStep, _images: &[ImageFile]) -> SlopeStep {
        let features = self.scale * libm::exp2(self.octaves - 1.0);
        named.min(SlopeStep { length: SLOPE_STEP / features, ..SlopeStep::NONE })
    }
}

/// The length over which slopes are measured, relative to a feature of the last octave. Noise is nearly linear there.
const SLOPE_STEP: f64 = 1.0 / 32.0;

/// The fraction of the second colour at a point, 0 to 1.
#[inline(always)]
pub(super) fn share<F: Float>(all: &Instructions, at: F::Uint, p: Vec3<F>) -> F {
    let (octaves, roughness) = (all.link(at), all.number::<F>(1, at));
    let start = p * all.number::<F>(0, at);
    let first = F::Uint::splat(0);
    let (sum, ..) = F::repeat(
        F::Mask::splat(true),
        (F::zero(), F::splat(1.0), start, first),
        #[inline(always)]
        |(sum, strength, p, octave)| {
            let noise = gradient_noise(p, octave);
            let next = octave + F::Uint::splat(1);
            ((sum + noise * strength, strength * roughness, p + p, next), next.lt(octaves))
        },
    );
    (sum * all.number::<F>(2, at) + 0.5).max(F::zero()).min(F::splat(1.0))
}

/// The number of cells along each axis after which the noise repeats, which floats represent exactly.
const PERIOD: u32 = 1 << 16;

/// Perlin's noise (2002, "Improving Noise"), between −1 and 1 or slightly beyond, and zero at the corners of cells of
/// side one. Each octave has gradients of its own.
#[inline(always)]
fn gradient_noise<F: Float>(p: Vec3<F>, octave: F::Uint) -> F {
    function!(F, gradient_noise(p, octave), {
        let period = PERIOD as f32;
        let (mut low, mut within, mut fade) = ([octave; 3], [p.x; 3], [p.x; 3]);
        let mut i = 0;
        while i < 3 {
            let x = p.coordinates()[i];
            let cell = x.floor();
            let t = x - cell;
            low[i] = (cell - (cell * (1.0 / period)).floor() * period).to_uint();
            within[i] = t;
            fade[i] = t * t * t * ((t * 6.0 - 15.0) * t + 10.0);
            i += 1;
        }
        let (one, mask) = (F::Uint::splat(1), F::Uint::splat(PERIOD - 1));
        let mut along = [F::zero(); 4];
        let mut edge = 0;
        while edge < 4 {
            let mut ends = [F::zero(); 2];
            let mut end = 0;
            while end < 2 {
                let corner = [end, edge & 1, edge >> 1];
                let (mut cell, mut offset) = (low, within);
                let mut i = 0;
                while i < 3 {
                    if corner[i] == 1 {
                        cell[i] = (cell[i] + one) & mask;
                        offset[i] = offset[i] - 1.0;
                    }
                    i += 1;
                }
                ends[end] = slope(hash(cell, octave), offset);
                end += 1;
            }
            along[edge] = between(ends[0], ends[1], fade[0]);
            edge += 1;
        }
        let [a, b, c, d] = along;
        between(between(a, b, fade[1]), between(c, d, fade[1]), fade[2])
    })
}

#[inline(always)]
fn between<F: Float>(a: F, b: F, t: F) -> F {
    a + (b - a) * t
}

/// Four random bits of a corner.
#[inline(always)]
fn hash<U: Uint>([x, y, z]: [U; 3], octave: U) -> U {
    let mut h = (x * U::splat(73_856_093)) ^ (y * U::splat(19_349_663)) ^ (z * U::splat(83_492_791));
    h = (h + octave * U::splat(2_654_435_769)) * U::splat(747_796_405) + U::splat(2_891_336_453);
    h = (h ^ h.shr::<16>()) * U::splat(0x85eb_ca6b);
    h = (h ^ h.shr::<13>()) * U::splat(0xc2b2_ae35);
    h.shr::<28>()
}

/// The dot product of a vector with one of twelve gradients, which point from the centre of a cube to the middles of
/// its edges.
#[inline(always)]
fn slope<F: Float>(bits: F::Uint, [x, y, z]: [F; 3]) -> F {
    let is_last = (bits & F::Uint::splat(13)).eq(F::Uint::splat(12));
    let a = F::select(bits.lt(F::Uint::splat(8)), x, y);
    let b = F::select(bits.lt(F::Uint::splat(4)), y, F::select(is_last, x, z));
    let (one, two) = (F::Uint::splat(1), F::Uint::splat(2));
    F::select((bits & one).eq(one), -a, a) + F::select((bits & two).eq(two), -b, b)
}
