//! Sixteen lanes in AVX-512 registers.
//!
//! # Safety
//! The types here are private to `lanes`: the only code that names them is [`super::dispatch`], which has
//! asked the processor for AVX-512 F, BW, DQ and VL first. That is the argument of every block below that calls an
//! intrinsic; the few that touch memory say more.
#![allow(unsafe_code, reason = "processor intrinsics")]
#![allow(clippy::undocumented_unsafe_blocks, reason = "argued once, in the module's own words")]

use super::macros::{for_lanes, gathers, numbers};
use super::{Float, Kernel, LaneFloat, LaneMask, LaneUint, Mask, Uint, no_table};
use std::arch::x86_64::*;

const N: usize = 16;

/// Sixteen booleans: one bit each.
#[derive(Clone, Copy)]
pub(super) struct Mask16(__mmask16);
/// Sixteen wrapping `u32`.
#[derive(Clone, Copy)]
pub(super) struct Uint16(__m512i);
/// Sixteen `f32`.
#[derive(Clone, Copy)]
pub(super) struct Float16(__m512);

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
operator!(Mask16, BitAnd, bitand, _kand_mask16);
operator!(Mask16, BitOr, bitor, _kor_mask16);
operator!(Uint16, Add, add, _mm512_add_epi32);
operator!(Uint16, Mul, mul, _mm512_mullo_epi32);
operator!(Uint16, BitAnd, bitand, _mm512_and_si512);
operator!(Uint16, BitOr, bitor, _mm512_or_si512);
operator!(Uint16, BitXor, bitxor, _mm512_xor_si512);
operator!(Float16, Add, add, _mm512_add_ps);
operator!(Float16, Sub, sub, _mm512_sub_ps);
operator!(Float16, Mul, mul, _mm512_mul_ps);
operator!(Float16, Div, div, _mm512_div_ps);

macro_rules! scalar_operator {
    ($trait:ident, $method:ident) => {
        impl std::ops::$trait<f32> for Float16 {
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

impl std::ops::Not for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Mask16(!self.0)
    }
}

impl std::ops::Neg for Float16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Float16(unsafe { _mm512_xor_ps(self.0, _mm512_set1_ps(-0.0)) })
    }
}

numbers!(Float16, Uint16, Mask16);

impl Mask for Mask16 {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Mask16(if value { 0xffff } else { 0 })
    }
    for_lanes!(mask);
}

impl LaneMask for Mask16 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Mask16(bits as u16)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Uint for Uint16 {
    type Float = Float16;
    type Mask = Mask16;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Uint16(unsafe { _mm512_set1_epi32(value as i32) })
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        // The slice has as many values as it says.
        let [found] = unsafe { look_up([table.as_ptr().cast()], table.len(), index.0) };
        Uint16(unsafe { _mm512_castps_si512(found) })
    }
    #[inline(always)]
    fn shl<const K: u32>(self) -> Self {
        Uint16(unsafe { _mm512_sll_epi32(self.0, _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn shr<const K: u32>(self) -> Self {
        Uint16(unsafe { _mm512_srl_epi32(self.0, _mm_cvtsi32_si128(K as i32)) })
    }
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        // Both halves of every byte are reversed by a lookup, then the bytes are swapped.
        unsafe {
            let low = _mm512_broadcast_i32x4(_mm_setr_epi8(
                0x00, -0x80, 0x40, -0x40, 0x20, -0x60, 0x60, -0x20, 0x10, -0x70, 0x50, -0x30, 0x30, -0x50,
                0x70, -0x10,
            ));
            let high =
                _mm512_broadcast_i32x4(_mm_setr_epi8(0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15));
            let order =
                _mm512_broadcast_i32x4(_mm_setr_epi8(3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12));
            let half = _mm512_set1_epi8(0x0f);
            let raised = _mm512_shuffle_epi8(low, _mm512_and_si512(self.0, half));
            let lowered = _mm512_shuffle_epi8(high, _mm512_and_si512(_mm512_srli_epi32::<4>(self.0), half));
            Uint16(_mm512_shuffle_epi8(_mm512_or_si512(raised, lowered), order))
        }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask16 {
        Mask16(unsafe { _mm512_cmpeq_epi32_mask(self.0, other.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask16 {
        Mask16(unsafe { _mm512_cmplt_epu32_mask(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Mask16, a: Self, b: Self) -> Self {
        Uint16(unsafe { _mm512_mask_blend_epi32(mask.0, b.0, a.0) })
    }
    #[inline(always)]
    fn to_float(self) -> Float16 {
        Float16(unsafe { _mm512_cvtepi32_ps(self.0) })
    }
    for_lanes!(uint);
}

impl LaneUint for Uint16 {
    #[inline(always)]
    fn load(from: &[u32]) -> Self {
        // The slice index proves that there are sixteen values; the load needs no alignment.
        Uint16(unsafe { _mm512_loadu_si512(from[..N].as_ptr().cast()) })
    }
    #[inline(always)]
    fn store(self, into: &mut [u32]) {
        // The slice index proves that there is room for sixteen; the store needs no alignment.
        unsafe { _mm512_storeu_si512(into[..N].as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn rank(mask: Mask16) -> Self {
        Uint16(unsafe {
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            _mm512_maskz_expand_epi32(mask.0, lanes)
        })
    }
}

/// Entries of tables.
///
/// # Safety
/// Each of `tables` holds `len` values.
#[inline(always)]
unsafe fn look_up<const T: usize>(tables: [*const f32; T], len: usize, index: __m512i) -> [__m512; T] {
    // An empty table is last among the lengths.
    let last = len.wrapping_sub(1);
    // Every index is at most `last` after the unsigned minimum, hence inside the table; a short table is not loaded
    // beyond its end, and a long one is no longer than an index of the processor's gather reaches.
    unsafe {
        let index = _mm512_min_epu32(index, _mm512_set1_epi32(last as i32));
        let mut found = [_mm512_setzero_ps(); T];
        let mut i = 0;
        if last < N {
            let there = up_to(last as i32);
            while i < T {
                found[i] = _mm512_permutexvar_ps(index, _mm512_maskz_loadu_ps(there, tables[i]));
                i += 1;
            }
        } else if last < i32::MAX as usize {
            while i < T {
                found[i] = _mm512_i32gather_ps::<4>(index, tables[i]);
                i += 1;
            }
        } else {
            no_table(len)
        }
        found
    }
}

impl Float for Float16 {
    type Uint = Uint16;
    type Mask = Mask16;
    const LANES: usize = N;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Float16(unsafe { _mm512_set1_ps(value) })
    }
    gathers!(Float16, Uint16);
    #[inline(always)]
    fn sqrt(self) -> Self {
        Float16(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Float16(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Float16(unsafe { _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Float16(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Float16(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask16 {
        Mask16(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask16 {
        Mask16(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: Mask16, a: Self, b: Self) -> Self {
        Float16(unsafe { _mm512_mask_blend_ps(mask.0, b.0, a.0) })
    }
    #[inline(always)]
    fn to_bits(self) -> Uint16 {
        Uint16(unsafe { _mm512_castps_si512(self.0) })
    }
    #[inline(always)]
    fn from_bits(bits: Uint16) -> Self {
        Float16(unsafe { _mm512_castsi512_ps(bits.0) })
    }
    #[inline(always)]
    fn to_uint(self) -> Uint16 {
        Uint16(unsafe { _mm512_cvttps_epi32(self.0) })
    }
    for_lanes!(float);
}

impl LaneFloat for Float16 {
    type Octet = super::avx2::Float8;
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        // The slice index proves that there are sixteen values; the load needs no alignment.
        Float16(unsafe { _mm512_loadu_ps(from[..N].as_ptr()) })
    }
    #[inline(always)]
    fn store(self, into: &mut [f32]) {
        // The slice index proves that there is room for sixteen; the store needs no alignment.
        unsafe { _mm512_storeu_ps(into[..N].as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn outlined<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        #[inline(never)]
        fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Float16>()
        }
        unsafe { run(kernel) }
    }

    // Octets with the instructions of this level, which has more registers.
    #[inline(always)]
    fn with_octets<K: Kernel>(kernel: K) -> K::Output {
        Self::outlined(kernel)
    }

    #[inline(always)]
    fn seldom<K: Kernel>(kernel: K) -> K::Output {
        #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
        #[cold]
        #[inline(never)]
        fn run<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<Float16>()
        }
        unsafe { run(kernel) }
    }
}

/// The lanes up to and including `last`, which is below sixteen.
#[inline(always)]
fn up_to(last: i32) -> __mmask16 {
    u16::MAX >> (N as i32 - 1 - last)
}
