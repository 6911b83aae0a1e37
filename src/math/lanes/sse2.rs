//! Lanes in SSE2 registers, which every x86-64 processor has: four lanes in one register, eight in two.
//!
//! Plain arrays, which the compiler would vectorise, are not used: the vectoriser of LLVM 22.1.2 miscompiled them (see
//! `tests/transport/trees.rs`).
//!
//! # Safety
//! Every intrinsic here needs only SSE2: none takes a pointer.
#![allow(unsafe_code, reason = "processor intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "argued once, in the module's own words")]

use super::macros::{for_lanes, numbers};
use super::{Float, Kernel, LaneFloat, LaneMask, LaneUint, Mask, Uint};
use bytemuck::cast;
use std::arch::x86_64::*;
use std::array::from_fn;

/// Lanes per register.
const N: usize = 4;

/// Booleans in `M` registers: all ones or all zeros in 32 bits.
#[derive(Clone, Copy)]
pub struct Booleans<const M: usize>([__m128; M]);
/// Wrapping `u32` in `M` registers.
#[derive(Clone, Copy)]
pub struct Uints<const M: usize>([__m128i; M]);
/// `f32` in `M` registers.
#[derive(Clone, Copy)]
pub struct Floats<const M: usize>([__m128; M]);

/// Four lanes.
pub(super) type Four = Floats<1>;
/// Eight lanes.
pub(super) type Eight = Floats<2>;

/// Operations that are computed separately for each register.
macro_rules! registers {
    ($type:ident, |$r:ident| $register:expr) => {
        $type(from_fn(
            #[inline(always)]
            |$r| $register,
        ))
    };
}

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl<const M: usize> std::ops::$trait for $type<M> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                registers!($type, |r| unsafe { $intrinsic(self.0[r], other.0[r]) })
            }
        }
    };
}
operator!(Booleans, BitAnd, bitand, _mm_and_ps);
operator!(Booleans, BitOr, bitor, _mm_or_ps);
operator!(Uints, Add, add, _mm_add_epi32);
operator!(Uints, BitAnd, bitand, _mm_and_si128);
operator!(Uints, BitOr, bitor, _mm_or_si128);
operator!(Uints, BitXor, bitxor, _mm_xor_si128);
operator!(Floats, Add, add, _mm_add_ps);
operator!(Floats, Sub, sub, _mm_sub_ps);
operator!(Floats, Mul, mul, _mm_mul_ps);
operator!(Floats, Div, div, _mm_div_ps);

macro_rules! scalar_operator {
    ($trait:ident, $method:ident) => {
        impl<const M: usize> std::ops::$trait<f32> for Floats<M> {
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

/// The low halves of products of 32 bits. SSE2 multiplies every second number, with a result of 64 bits.
#[inline(always)]
fn product(a: __m128i, b: __m128i) -> __m128i {
    unsafe {
        let even = _mm_mul_epu32(a, b);
        let odd = _mm_mul_epu32(_mm_srli_epi64::<32>(a), _mm_srli_epi64::<32>(b));
        _mm_unpacklo_epi32(_mm_shuffle_epi32::<0b10_00>(even), _mm_shuffle_epi32::<0b10_00>(odd))
    }
}

/// Swaps neighbouring groups of `K` bits; `low` selects the lower group of each pair.
#[inline(always)]
fn swapped<const K: i32>(x: __m128i, low: i32) -> __m128i {
    unsafe {
        let low = _mm_set1_epi32(low);
        _mm_or_si128(_mm_and_si128(_mm_srli_epi32::<K>(x), low), _mm_slli_epi32::<K>(_mm_and_si128(x, low)))
    }
}

/// Reverses the bits of every number.
#[inline(always)]
fn reversed(x: __m128i) -> __m128i {
    let x = unsafe { _mm_or_si128(_mm_slli_epi32::<16>(x), _mm_srli_epi32::<16>(x)) };
    let x = unsafe { _mm_or_si128(_mm_slli_epi16::<8>(x), _mm_srli_epi16::<8>(x)) };
    swapped::<1>(swapped::<2>(swapped::<4>(x, 0x0f0f_0f0f), 0x3333_3333), 0x5555_5555)
}

/// `a` where the mask holds, `b` elsewhere.
#[inline(always)]
fn blend(mask: __m128, a: __m128, b: __m128) -> __m128 {
    unsafe { _mm_or_ps(_mm_and_ps(mask, a), _mm_andnot_ps(mask, b)) }
}

/// The largest integers that are not above the values. SSE2 rounds through integers of 32 bits.
#[inline(always)]
fn floor(x: __m128) -> __m128 {
    unsafe {
        let sign = _mm_set1_ps(-0.0);
        let towards_zero = _mm_cvtepi32_ps(_mm_cvttps_epi32(x));
        let above = _mm_and_ps(_mm_cmpgt_ps(towards_zero, x), _mm_set1_ps(1.0));
        // A zero keeps its sign.
        let whole = _mm_or_ps(_mm_sub_ps(towards_zero, above), _mm_and_ps(sign, x));
        // Floats from 2²³ on are integers already. NaN is kept, too.
        let has_fraction = _mm_cmplt_ps(_mm_andnot_ps(sign, x), _mm_set1_ps(8_388_608.0));
        blend(has_fraction, whole, x)
    }
}

impl<const M: usize> std::ops::Not for Booleans<M> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let ones = unsafe { _mm_castsi128_ps(_mm_set1_epi32(-1)) };
        registers!(Booleans, |r| unsafe { _mm_xor_ps(self.0[r], ones) })
    }
}

impl<const M: usize> std::ops::Neg for Floats<M> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        registers!(Floats, |r| unsafe { _mm_xor_ps(self.0[r], _mm_set1_ps(-0.0)) })
    }
}

impl<const M: usize> std::ops::Mul for Uints<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        registers!(Uints, |r| product(self.0[r], other.0[r]))
    }
}

numbers!(generic [const M: usize] Floats<M>, Uints<M>, Booleans<M>);

impl<const M: usize> Mask for Booleans<M> {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Booleans([unsafe { _mm_castsi128_ps(_mm_set1_epi32(-i32::from(value))) }; M])
    }
    for_lanes!(mask);
}

impl<const M: usize> LaneMask for Booleans<M> {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        let bit = unsafe { _mm_setr_epi32(1, 2, 4, 8) };
        registers!(Booleans, |r| unsafe {
            let set = _mm_and_si128(_mm_set1_epi32((bits >> (N * r)) as i32), bit);
            _mm_castsi128_ps(_mm_cmpeq_epi32(set, bit))
        })
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        let mut bits = 0;
        for (r, &register) in self.0.iter().enumerate() {
            bits |= (unsafe { _mm_movemask_ps(register) } as u32) << (N * r);
        }
        bits
    }
}

impl<const M: usize> Uint for Uints<M> {
    type Float = Floats<M>;
    type Mask = Booleans<M>;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Uints([unsafe { _mm_set1_epi32(value as i32) }; M])
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        registers!(Uints, |r| cast(entries(table, index.0[r])))
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        registers!(Uints, |r| unsafe { _mm_sll_epi32(self.0[r], _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        registers!(Uints, |r| unsafe { _mm_srl_epi32(self.0[r], _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        registers!(Uints, |r| reversed(self.0[r]))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Booleans<M> {
        registers!(Booleans, |r| unsafe { _mm_castsi128_ps(_mm_cmpeq_epi32(self.0[r], other.0[r])) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Booleans<M> {
        // SSE2 compares signed numbers: flipping the top bit maps the order of one onto the other.
        let flip = unsafe { _mm_set1_epi32(i32::MIN) };
        registers!(Booleans, |r| unsafe {
            let [a, b] = [self.0[r], other.0[r]];
            _mm_castsi128_ps(_mm_cmplt_epi32(_mm_xor_si128(a, flip), _mm_xor_si128(b, flip)))
        })
    }
    #[inline(always)]
    fn select(mask: Booleans<M>, a: Self, b: Self) -> Self {
        Floats::select(mask, Floats::from_bits(a), Floats::from_bits(b)).to_bits()
    }
    #[inline(always)]
    fn to_float(self) -> Floats<M> {
        registers!(Floats, |r| unsafe { _mm_cvtepi32_ps(self.0[r]) })
    }
    for_lanes!(uint);
}

impl<const M: usize> LaneUint for Uints<M> {
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        let (fours, _) = from[..N * M].as_chunks::<N>();
        registers!(Uints, |r| cast(fours[r]))
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        let (fours, _) = into[..N * M].as_chunks_mut::<N>();
        for (four, register) in fours.iter_mut().zip(self.0) {
            *four = cast(register);
        }
    }
}

/// Entries of a table; an index beyond the end reads the last one.
#[inline(always)]
fn entries<T: Copy>(table: &[T], index: __m128i) -> [T; N] {
    let index: [u32; N] = cast(index);
    from_fn(
        #[inline(always)]
        |i| table[(index[i] as usize).min(table.len() - 1)],
    )
}

impl<const M: usize> Float for Floats<M> {
    type Uint = Uints<M>;
    type Mask = Booleans<M>;
    const LANES: usize = N * M;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Floats([unsafe { _mm_set1_ps(value) }; M])
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Uints<M>) -> Self {
        registers!(Floats, |r| cast(entries(table, index.0[r])))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        registers!(Floats, |r| unsafe { _mm_sqrt_ps(self.0[r]) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        registers!(Floats, |r| unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), self.0[r]) })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        registers!(Floats, |r| floor(self.0[r]))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        registers!(Floats, |r| unsafe { _mm_min_ps(self.0[r], other.0[r]) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        registers!(Floats, |r| unsafe { _mm_max_ps(self.0[r], other.0[r]) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Booleans<M> {
        registers!(Booleans, |r| unsafe { _mm_cmplt_ps(self.0[r], other.0[r]) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Booleans<M> {
        registers!(Booleans, |r| unsafe { _mm_cmple_ps(self.0[r], other.0[r]) })
    }
    #[inline(always)]
    fn select(mask: Booleans<M>, a: Self, b: Self) -> Self {
        registers!(Floats, |r| blend(mask.0[r], a.0[r], b.0[r]))
    }
    #[inline(always)]
    fn to_bits(self) -> Uints<M> {
        registers!(Uints, |r| unsafe { _mm_castps_si128(self.0[r]) })
    }
    #[inline(always)]
    fn from_bits(bits: Uints<M>) -> Self {
        registers!(Floats, |r| unsafe { _mm_castsi128_ps(bits.0[r]) })
    }
    #[inline(always)]
    fn to_uint(self) -> Uints<M> {
        registers!(Uints, |r| unsafe { _mm_cvttps_epi32(self.0[r]) })
    }
    for_lanes!(gathers);
    for_lanes!(float);
}

impl<const M: usize> LaneFloat for Floats<M> {
    type Octet = Eight;
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let (fours, _) = from[..N * M].as_chunks::<N>();
        registers!(Floats, |r| cast(fours[r]))
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        let (fours, _) = into[..N * M].as_chunks_mut::<N>();
        for (four, register) in fours.iter_mut().zip(self.0) {
            *four = cast(register);
        }
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
