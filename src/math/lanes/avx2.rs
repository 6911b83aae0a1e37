//! Eight lanes in AVX2 registers.
//!
//! # Safety
//! The types here are private to `lanes`: the only code that names them is [`super::dispatch`], which has
//! asked the processor for AVX2 first, and `avx512`, whose processors all have AVX2 too. That is the argument
//! of every block below that calls an intrinsic; the few that touch memory say more.
#![allow(unsafe_code, reason = "processor intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "argued once, in the module's own words")]

use super::macros::{for_lanes, gathers, numbers};
use super::{Float, Kernel, LaneFloat, LaneMask, LaneUint, Mask, Uint, no_table};
use std::arch::x86_64::*;

const N: usize = 8;

/// Eight booleans: all ones or all zeros in 32 bits.
#[derive(Clone, Copy)]
pub(super) struct Mask8(__m256);
/// Eight wrapping `u32`.
#[derive(Clone, Copy)]
pub(super) struct Uint8(__m256i);
/// Eight `f32`.
#[derive(Clone, Copy)]
pub(super) struct Float8(__m256);

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl std::ops::$trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                $type(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}
operator!(Mask8, BitAnd, bitand, _mm256_and_ps);
operator!(Mask8, BitOr, bitor, _mm256_or_ps);
operator!(Uint8, Add, add, _mm256_add_epi32);
operator!(Uint8, Mul, mul, _mm256_mullo_epi32);
operator!(Uint8, BitAnd, bitand, _mm256_and_si256);
operator!(Uint8, BitOr, bitor, _mm256_or_si256);
operator!(Uint8, BitXor, bitxor, _mm256_xor_si256);
operator!(Float8, Add, add, _mm256_add_ps);
operator!(Float8, Sub, sub, _mm256_sub_ps);
operator!(Float8, Mul, mul, _mm256_mul_ps);
operator!(Float8, Div, div, _mm256_div_ps);

macro_rules! scalar_operator {
    ($trait:ident, $method:ident) => {
        impl std::ops::$trait<f32> for Float8 {
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

impl std::ops::Not for Mask8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Mask8(unsafe { _mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) })
    }
}

impl std::ops::Neg for Float8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Float8(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

numbers!(Float8, Uint8, Mask8);

impl Mask for Mask8 {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Mask8(unsafe { _mm256_castsi256_ps(_mm256_set1_epi32(-i32::from(value))) })
    }
    for_lanes!(mask);
}

impl LaneMask for Mask8 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        unsafe {
            let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), bit);
            Mask8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bit)))
        }
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

impl Uint for Uint8 {
    type Float = Float8;
    type Mask = Mask8;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Uint8(unsafe { _mm256_set1_epi32(value as i32) })
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        // The slice has as many values as it says.
        let [found] = unsafe { look_up([table.as_ptr().cast()], table.len(), index.0) };
        Uint8(unsafe { _mm256_castps_si256(found) })
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        Uint8(unsafe { _mm256_sll_epi32(self.0, _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        Uint8(unsafe { _mm256_srl_epi32(self.0, _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // Both halves of every byte are reversed by a lookup, then the bytes are swapped.
        unsafe {
            let low = _mm256_broadcastsi128_si256(_mm_setr_epi8(
                0x00, -0x80, 0x40, -0x40, 0x20, -0x60, 0x60, -0x20, 0x10, -0x70, 0x50, -0x30, 0x30, -0x50,
                0x70, -0x10,
            ));
            let high = _mm256_broadcastsi128_si256(_mm_setr_epi8(
                0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15,
            ));
            let order = _mm256_broadcastsi128_si256(_mm_setr_epi8(
                3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12,
            ));
            let half = _mm256_set1_epi8(0x0f);
            let raised = _mm256_shuffle_epi8(low, _mm256_and_si256(self.0, half));
            let lowered = _mm256_shuffle_epi8(high, _mm256_and_si256(_mm256_srli_epi32::<4>(self.0), half));
            Uint8(_mm256_shuffle_epi8(_mm256_or_si256(raised, lowered), order))
        }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask8 {
        Mask8(unsafe { _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        // AVX2 compares signed numbers: flipping the top bit maps the order of one onto the other.
        unsafe {
            let flip = _mm256_set1_epi32(i32::MIN);
            let less = _mm256_cmpgt_epi32(_mm256_xor_si256(other.0, flip), _mm256_xor_si256(self.0, flip));
            Mask8(_mm256_castsi256_ps(less))
        }
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        Uint8(unsafe { _mm256_blendv_epi8(b.0, a.0, _mm256_castps_si256(mask.0)) })
    }
    #[inline(always)]
    fn to_float(self) -> Float8 {
        Float8(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
    for_lanes!(uint);
}

impl LaneUint for Uint8 {
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        // The slice index proves that there are eight values; the load needs no alignment.
        Uint8(unsafe { _mm256_loadu_si256(from[..N].as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        // The slice index proves that there is room for eight; the store needs no alignment.
        unsafe { _mm256_storeu_si256(into[..N].as_mut_ptr().cast(), self.0) }
    }
}

/// The lanes, as a mask, in which an unsigned number is at most its end. A closure might not be inlined.
#[inline(always)]
fn not_above(numbers: __m256i, ends: __m256i) -> __m256i {
    unsafe { _mm256_cmpeq_epi32(_mm256_min_epu32(numbers, ends), numbers) }
}

/// Entries of tables. Most tables have at most eight, for which this takes the fewest instructions.
///
/// # Safety
/// Each of `tables` holds `len` values.
#[inline(always)]
unsafe fn look_up<const T: usize>(tables: [*const f32; T], len: usize, index: __m256i) -> [__m256; T] {
    // An empty table is last among the lengths.
    let last = len.wrapping_sub(1);
    // Every index is at most `last` after the unsigned minimum, hence inside the table; a short table is not loaded
    // beyond its end, and a long one is no longer than an index of the processor's gather reaches.
    unsafe {
        let ends = _mm256_set1_epi32(last as i32);
        let index = _mm256_min_epu32(index, ends);
        let mut found = [_mm256_setzero_ps(); T];
        let mut i = 0;
        if last < N {
            let there = not_above(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), ends);
            while i < T {
                found[i] = _mm256_permutevar8x32_ps(_mm256_maskload_ps(tables[i], there), index);
                i += 1;
            }
        } else if last < 2 * N {
            let there = not_above(_mm256_setr_epi32(8, 9, 10, 11, 12, 13, 14, 15), ends);
            // The bit that selects the register, moved to the position where a blend reads it.
            let is_high = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index));
            while i < T {
                let low = _mm256_permutevar8x32_ps(_mm256_loadu_ps(tables[i]), index);
                let high = _mm256_maskload_ps(tables[i].add(N), there);
                found[i] = _mm256_blendv_ps(low, _mm256_permutevar8x32_ps(high, index), is_high);
                i += 1;
            }
        } else if last < i32::MAX as usize {
            while i < T {
                found[i] = _mm256_i32gather_ps::<4>(tables[i], index);
                i += 1;
            }
        } else {
            no_table(len)
        }
        found
    }
}

impl Float for Float8 {
    type Uint = Uint8;
    type Mask = Mask8;
    const LANES: usize = N;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Float8(unsafe { _mm256_set1_ps(value) })
    }
    gathers!(Float8, Uint8);
    #[inline(always)]
    fn sqrt(self) -> Self {
        Float8(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Float8(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Float8(unsafe { _mm256_floor_ps(self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Float8(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Float8(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask8 {
        Mask8(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask8 {
        Mask8(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Mask8, a: Self, b: Self) -> Self {
        Float8(unsafe { _mm256_blendv_ps(b.0, a.0, mask.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Uint8 {
        Uint8(unsafe { _mm256_castps_si256(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Uint8) -> Self {
        Float8(unsafe { _mm256_castsi256_ps(bits.0) })
    }
    #[inline(always)]
    fn to_uint(self) -> Uint8 {
        Uint8(unsafe { _mm256_cvttps_epi32(self.0) })
    }
    for_lanes!(float);
}

impl LaneFloat for Float8 {
    type Octet = super::avx2::Float8;
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        // The slice index proves that there are eight values; the load needs no alignment.
        Float8(unsafe { _mm256_loadu_ps(from[..N].as_ptr()) })
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        // The slice index proves that there is room for eight; the store needs no alignment.
        unsafe { _mm256_storeu_ps(into[..N].as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        #[inline(never)]
        fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Float8>()
        }
        unsafe { run(kernel) }
    }

    #[inline(always)]
    fn seldom<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx2")]
        #[cold]
        #[inline(never)]
        fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Float8>()
        }
        unsafe { run(kernel) }
    }
}
