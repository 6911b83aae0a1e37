//! Lanes: many independent numbers that march through one program.
//!
//! Everything that lies on a path (shapes, BxDFs, lights, warps, random streams) is written once,
//! generic over [`Float`], and reads like the mathematics for one number. With `F = f32` it traces a
//! single path; with a wider type it traces four, eight or sixteen side by side. A branch becomes a
//! [`Mask`] and a `select`.
//!
//! Every operation here is exact or correctly rounded by IEEE 754 and never fused, so that a lane holds
//! the same bits at every [`Level`]. That is why there is no `mul_add`, no reciprocal estimate, and why
//! `min` and `max` say what they do with NaN.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod level;
mod portable;
pub mod scalar;
#[cfg(test)]
mod tests;

pub use level::{Level, UnknownLevel, dispatch};

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// One boolean a lane.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// The same truth in every lane.
    fn splat(value: bool) -> Self;
    /// Lane `i` is bit `i`; bits past the last lane are ignored.
    fn from_bits(bits: u32) -> Self;
    /// Bit `i` is lane `i`; bits past the last lane are zero.
    fn bits(self) -> u32;
    /// Whether any lane is true.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// One `u32` a lane, with wrapping arithmetic.
pub trait Uint:
    Copy
    + Add<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    /// The float of as many lanes.
    type Float: Float<Uint = Self, Mask = Self::Mask>;
    /// What comparisons give.
    type Mask: Mask;

    /// The same value in every lane.
    fn splat(value: u32) -> Self;
    /// The first values of a slice, one a lane. The slice holds at least as many values as there are lanes.
    fn load(from: &[u32]) -> Self;
    /// Writes the lanes to the front of a slice, which has room for all of them.
    fn store(self, into: &mut [u32]);
    /// `table[index]` for each lane; an index past the end reads the last entry. The table is not empty
    /// and has at most `i32::MAX` entries. Tables no longer than a register are the quickest.
    fn gather(table: &[u32], index: Self) -> Self;
    /// Shifts every lane left by `K` bits.
    fn shl<const K: u32>(self) -> Self;
    /// Shifts every lane right by `K` bits, filling with zeros.
    fn shr<const K: u32>(self) -> Self;
    /// Every lane's bits in the opposite order.
    fn reverse_bits(self) -> Self;
    /// For each true lane how many true ones come before it; other lanes hold nothing of use, below 16.
    #[inline(always)]
    fn rank(mask: Self::Mask) -> Self {
        let mut ranks = [0; MAX_LANES];
        let mut lanes = mask.bits();
        let mut rank = 0;
        while lanes != 0 {
            ranks[lanes.trailing_zeros() as usize & (MAX_LANES - 1)] = rank;
            rank += 1;
            lanes &= lanes - 1;
        }
        Self::load(&ranks)
    }
    /// Equality, lane by lane.
    fn eq(self, other: Self) -> Self::Mask;
    /// Unsigned "less than", lane by lane.
    fn lt(self, other: Self) -> Self::Mask;
    /// `a` where the mask holds, `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The nearest float of values below 2³¹; larger ones are unspecified.
    fn to_float(self) -> Self::Float;
    /// A float in [0, 1), uniform if the bits are: the upper 24 bits over 2²⁴.
    #[inline(always)]
    fn to_unit(self) -> Self::Float {
        self.shr::<8>().to_float() * (1.0 / 16_777_216.0)
    }
}

/// One `f32` a lane.
pub trait Float:
    Copy
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f32, Output = Self>
    + Sub<f32, Output = Self>
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
{
    /// The integer of as many lanes.
    type Uint: Uint<Float = Self, Mask = Self::Mask>;
    /// What comparisons give.
    type Mask: Mask;
    /// Eight floats, as fast as this level has them: for looking at eight things with one ray.
    type Octet: Float;
    /// How many lanes there are: 1 to 16.
    const LANES: usize;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// The first values of a slice, one a lane. The slice holds at least as many values as there are lanes.
    fn load(from: &[f32]) -> Self;
    /// Writes the lanes to the front of a slice, which has room for all of them.
    fn store(self, into: &mut [f32]);
    /// `table[index]` for each lane; an index past the end reads the last entry. The table is not empty
    /// and has at most `i32::MAX` entries.
    fn gather(table: &[f32], index: Self::Uint) -> Self;
    /// The correctly rounded square root.
    fn sqrt(self) -> Self;
    /// The magnitude: clears the sign bit.
    fn abs(self) -> Self;
    /// The largest integer not above.
    fn floor(self) -> Self;
    /// `self` if it is less than `other`, else `other` (also when either is NaN, and for two zeros).
    fn min(self, other: Self) -> Self;
    /// `self` if it is greater than `other`, else `other` (also when either is NaN, and for two zeros).
    fn max(self, other: Self) -> Self;
    /// Less than; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Less than or equal; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Greater than; false for NaN.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// Greater than or equal; false for NaN.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `a` where the mask holds, `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The bit pattern.
    fn to_bits(self) -> Self::Uint;
    /// The float of a bit pattern.
    fn from_bits(bits: Self::Uint) -> Self;
    /// Rounds towards zero, for values in [0, 2³¹); others are unspecified but never undefined.
    fn to_uint(self) -> Self::Uint;

    /// Runs a program with these lanes in a function of its own, for what is too large to be inlined wherever
    /// it is called. The function is compiled for the level's instructions, as [`dispatch`]'s are.
    fn outlined<K: Kernel>(kernel: K) -> K::Output;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// The value where the mask holds, zero elsewhere.
    #[inline(always)]
    fn only(self, mask: Self::Mask) -> Self {
        Self::select(mask, self, Self::zero())
    }
    /// `self` with the sign of `sign`.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::Uint::splat(0x8000_0000);
        Self::from_bits(self.abs().to_bits() | (sign.to_bits() & bit))
    }
    /// One lane's value.
    #[inline(always)]
    fn lane(self, i: usize) -> f32 {
        let mut all = [0.0; MAX_LANES];
        self.store(&mut all);
        all[i]
    }
}

/// The most lanes that any level has.
pub const MAX_LANES: usize = 16;

/// A program that is compiled once for each level.
pub trait Kernel {
    /// What the program gives back.
    type Output;
    /// The program. Mark it, and all that it calls for each lane, `#[inline(always)]`: only code that is
    /// inlined into the level's entry point is compiled with the level's instructions.
    fn run<F: Float>(self) -> Self::Output;
}
