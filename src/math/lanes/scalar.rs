//! One lane: plain numbers.

use super::macros::{for_lanes, numbers};
use super::{Float, Kernel, LaneFloat, LaneMask, LaneUint, Mask, Uint};

numbers!(f32, Wrapping, bool);

impl Mask for bool {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        value
    }
    for_lanes!(mask);
}

impl LaneMask for bool {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits & 1 != 0
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

/// `u32`'s own `+` and `*` panic on overflow in debug builds; lanes wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wrapping(pub u32);

macro_rules! operator {
    ($trait:ident, $method:ident, $inherent:expr) => {
        impl std::ops::$trait for Wrapping {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                #[allow(clippy::redundant_closure_call, reason = "one macro, five operators")]
                Wrapping($inherent(self.0, other.0))
            }
        }
    };
}
operator!(Add, add, u32::wrapping_add);
operator!(Mul, mul, u32::wrapping_mul);
operator!(BitAnd, bitand, |a, b| a & b);
operator!(BitOr, bitor, |a, b| a | b);
operator!(BitXor, bitxor, |a, b| a ^ b);

impl Uint for Wrapping {
    type Float = f32;
    type Mask = bool;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Wrapping(value)
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        Wrapping(table[(index.0 as usize).min(table.len() - 1)])
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        Wrapping(self.0 << K)
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        Wrapping(self.0 >> K)
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        Wrapping(self.0.reverse_bits())
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self.0 == other.0
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.0 < other.0
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn to_float(self) -> f32 {
        self.0 as f32
    }
    for_lanes!(uint);
}

impl LaneUint for Wrapping {
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        Wrapping(from[0])
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        into[0] = self.0;
    }
}

impl Float for f32 {
    type Uint = Wrapping;
    type Mask = bool;
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Wrapping) -> Self {
        table[(index.0 as usize).min(table.len() - 1)]
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        libm::floorf(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn to_bits(self) -> Wrapping {
        Wrapping(f32::to_bits(self))
    }
    #[inline(always)]
    fn from_bits(bits: Wrapping) -> Self {
        f32::from_bits(bits.0)
    }
    #[inline(always)]
    fn to_uint(self) -> Wrapping {
        Wrapping(self as u32)
    }
    for_lanes!(gathers);
    for_lanes!(float);
}

impl LaneFloat for f32 {
    type Octet = super::Eight;
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        from[0]
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        into[0] = self;
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
