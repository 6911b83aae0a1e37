//! Four lanes in plain arrays, for processors that the other levels do not know. Baseline x86-64 and
//! AArch64 have registers of this width, which the compiler finds by itself.

use super::{Float, Mask, Uint};
use std::array::from_fn;

const N: usize = 4;

/// Four booleans.
#[derive(Clone, Copy)]
pub(super) struct Mask4([bool; N]);
/// Four wrapping `u32`.
#[derive(Clone, Copy)]
pub(super) struct Uint4([u32; N]);
/// Four `f32`.
#[derive(Clone, Copy)]
pub(super) struct Float4([f32; N]);

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $f:expr) => {
        impl std::ops::$trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                #[allow(clippy::redundant_closure_call, reason = "one macro, all operators")]
                $type(from_fn(
                    #[inline(always)]
                    |i| $f(self.0[i], other.0[i]),
                ))
            }
        }
    };
}
operator!(Mask4, BitAnd, bitand, |a: bool, b: bool| a & b);
operator!(Mask4, BitOr, bitor, |a: bool, b: bool| a | b);
operator!(Uint4, Add, add, u32::wrapping_add);
operator!(Uint4, Mul, mul, u32::wrapping_mul);
operator!(Uint4, BitAnd, bitand, |a, b| a & b);
operator!(Uint4, BitOr, bitor, |a, b| a | b);
operator!(Uint4, BitXor, bitxor, |a, b| a ^ b);
operator!(Float4, Add, add, |a: f32, b: f32| a + b);
operator!(Float4, Sub, sub, |a: f32, b: f32| a - b);
operator!(Float4, Mul, mul, |a: f32, b: f32| a * b);
operator!(Float4, Div, div, |a: f32, b: f32| a / b);

macro_rules! scalar_operator {
    ($trait:ident, $method:ident) => {
        impl std::ops::$trait<f32> for Float4 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f32) -> Self {
                std::ops::$trait::$method(self, Self::splat(other))
            }
        }
    };
}
scalar_operator!(Add, add);
scalar_operator!(Sub, sub);
scalar_operator!(Mul, mul);
scalar_operator!(Div, div);

impl std::ops::Not for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Mask4(from_fn(|i| !self.0[i]))
    }
}

impl std::ops::Neg for Float4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Float4(from_fn(|i| -self.0[i]))
    }
}

impl Mask for Mask4 {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Mask4([value; N])
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Mask4(from_fn(|i| bits >> i & 1 != 0))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

impl Uint for Uint4 {
    type Float = Float4;
    type Mask = Mask4;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Uint4([value; N])
    }
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        Uint4(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        into[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        Uint4(from_fn(|i| table[(index.0[i] as usize).min(table.len() - 1)]))
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        Uint4(from_fn(|i| self.0[i] << K))
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        Uint4(from_fn(|i| self.0[i] >> K))
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Uint4(from_fn(|i| self.0[i].reverse_bits()))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask4 {
        Mask4(from_fn(|i| self.0[i] == other.0[i]))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask4 {
        Mask4(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn select(mask: Mask4, a: Self, b: Self) -> Self {
        Uint4(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn to_float(self) -> Float4 {
        Float4(from_fn(|i| self.0[i] as i32 as f32))
    }
}

impl Float for Float4 {
    type Uint = Uint4;
    type Mask = Mask4;
    const LANES: usize = N;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Float4([value; N])
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        Float4(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        into[..N].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Uint4) -> Self {
        Float4(from_fn(|i| table[(index.0[i] as usize).min(table.len() - 1)]))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Float4(from_fn(|i| self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Float4(from_fn(|i| self.0[i].abs()))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Float4(from_fn(|i| libm::floorf(self.0[i])))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Float4(from_fn(|i| Float::min(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Float4(from_fn(|i| Float::max(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask4 {
        Mask4(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask4 {
        Mask4(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn select(mask: Mask4, a: Self, b: Self) -> Self {
        Float4(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn to_bits(self) -> Uint4 {
        Uint4(from_fn(|i| self.0[i].to_bits()))
    }
    #[inline(always)]
    fn from_bits(bits: Uint4) -> Self {
        Float4(from_fn(|i| f32::from_bits(bits.0[i])))
    }
    #[inline(always)]
    fn to_uint(self) -> Uint4 {
        Uint4(from_fn(|i| self.0[i] as i32 as u32))
    }
}
