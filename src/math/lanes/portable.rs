//! Lanes in plain arrays, for processors other than x86-64: the compiler vectorises them. LLVM 22.1.2 miscompiled this
//! on x86-64 (see `tests/transport/trees.rs`); other processors must be tested for it.
#![cfg_attr(
    target_arch = "x86_64",
    allow(unreachable_pub, reason = "x86-64 has it for tests of lanes alone")
)]

use super::macros::{for_lanes, numbers};
use super::{Float, Kernel, LaneFloat, LaneMask, LaneUint, Mask, Uint};
use std::array::from_fn;

/// `N` booleans.
#[derive(Clone, Copy)]
pub struct Booleans<const N: usize>([bool; N]);
/// `N` wrapping `u32`.
#[derive(Clone, Copy)]
pub struct Uints<const N: usize>([u32; N]);
/// `N` times `f32`.
#[derive(Clone, Copy)]
pub struct Floats<const N: usize>([f32; N]);

/// Four lanes.
pub(super) type Four = Floats<4>;
/// Eight lanes.
pub(super) type Eight = Floats<8>;

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $f:expr) => {
        impl<const N: usize> std::ops::$trait for $type<N> {
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
operator!(Booleans, BitAnd, bitand, |a: bool, b: bool| a & b);
operator!(Booleans, BitOr, bitor, |a: bool, b: bool| a | b);
operator!(Uints, Add, add, u32::wrapping_add);
operator!(Uints, Mul, mul, u32::wrapping_mul);
operator!(Uints, BitAnd, bitand, |a, b| a & b);
operator!(Uints, BitOr, bitor, |a, b| a | b);
operator!(Uints, BitXor, bitxor, |a, b| a ^ b);
operator!(Floats, Add, add, |a: f32, b: f32| a + b);
operator!(Floats, Sub, sub, |a: f32, b: f32| a - b);
operator!(Floats, Mul, mul, |a: f32, b: f32| a * b);
operator!(Floats, Div, div, |a: f32, b: f32| a / b);

macro_rules! scalar_operator {
    ($trait:ident, $method:ident) => {
        impl<const N: usize> std::ops::$trait<f32> for Floats<N> {
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

impl<const N: usize> std::ops::Not for Booleans<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Booleans(from_fn(|i| !self.0[i]))
    }
}

impl<const N: usize> std::ops::Neg for Floats<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Floats(from_fn(|i| -self.0[i]))
    }
}

numbers!(generic [const N: usize] Floats<N>, Uints<N>, Booleans<N>);

impl<const N: usize> Mask for Booleans<N> {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Booleans([value; N])
    }
    for_lanes!(mask);
}

impl<const N: usize> LaneMask for Booleans<N> {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Booleans(from_fn(|i| bits >> i & 1 != 0))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
}

impl<const N: usize> Uint for Uints<N> {
    type Float = Floats<N>;
    type Mask = Booleans<N>;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Uints([value; N])
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        Uints(from_fn(|i| table[(index.0[i] as usize).min(table.len() - 1)]))
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        Uints(from_fn(|i| self.0[i] << K))
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        Uints(from_fn(|i| self.0[i] >> K))
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Uints(from_fn(|i| self.0[i].reverse_bits()))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Booleans<N> {
        Booleans(from_fn(|i| self.0[i] == other.0[i]))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Booleans<N> {
        Booleans(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn select(mask: Booleans<N>, a: Self, b: Self) -> Self {
        Uints(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn to_float(self) -> Floats<N> {
        Floats(from_fn(|i| self.0[i] as i32 as f32))
    }
    for_lanes!(uint);
}

impl<const N: usize> LaneUint for Uints<N> {
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        Uints(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        into[..N].copy_from_slice(&self.0);
    }
}

impl<const N: usize> Float for Floats<N> {
    type Uint = Uints<N>;
    type Mask = Booleans<N>;
    const LANES: usize = N;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Floats([value; N])
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Uints<N>) -> Self {
        Floats(from_fn(|i| table[(index.0[i] as usize).min(table.len() - 1)]))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Floats(from_fn(|i| self.0[i].sqrt()))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Floats(from_fn(|i| self.0[i].abs()))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Floats(from_fn(|i| libm::floorf(self.0[i])))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Floats(from_fn(|i| Float::min(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Floats(from_fn(|i| Float::max(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Booleans<N> {
        Booleans(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Booleans<N> {
        Booleans(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn select(mask: Booleans<N>, a: Self, b: Self) -> Self {
        Floats(from_fn(|i| if mask.0[i] { a.0[i] } else { b.0[i] }))
    }
    #[inline(always)]
    fn to_bits(self) -> Uints<N> {
        Uints(from_fn(|i| self.0[i].to_bits()))
    }
    #[inline(always)]
    fn from_bits(bits: Uints<N>) -> Self {
        Floats(from_fn(|i| f32::from_bits(bits.0[i])))
    }
    #[inline(always)]
    fn to_uint(self) -> Uints<N> {
        Uints(from_fn(|i| self.0[i] as i32 as u32))
    }
    for_lanes!(gathers);
    for_lanes!(float);
}

impl<const N: usize> LaneFloat for Floats<N> {
    type Octet = Eight;
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        Floats(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        into[..N].copy_from_slice(&self.0);
    }

    #[inline(never)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Self>()
    }

    #[cold]
    #[inline(never)]
    fn seldom<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Self>()
    }
}
