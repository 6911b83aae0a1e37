//! Fixed point: the units of a film's words, and rounding to them.

/// Fractional bits of every sum: radiance is in multiples of 2⁻³², squares in multiples of 2⁻³² of their own unit.
pub const FRACTION_BITS: u32 = 32;

pub(super) const SCALE: f64 = (1_u64 << FRACTION_BITS) as f64;

/// The rounding unit of radiance.
pub const QUANTUM: f64 = 1.0 / SCALE;

/// Fractional bits of a tap.
pub const TAP_BITS: u32 = 14;

/// Fractional bits of a pixel's weight, which is a product of two taps.
pub const WEIGHT_BITS: u32 = 2 * TAP_BITS;

/// 1.5·2⁵².
pub(super) const MAGIC: f64 = 6_755_399_441_055_744.0;

/// Rounds to the nearest integer, ties to even, for |x| < 2⁵¹: in that range adding 1.5·2⁵² leaves the
/// integer in the low bits of the sum, on every processor and without a call.
#[inline(always)]
pub(super) fn round_small(x: f64) -> i64 {
    (x + MAGIC).to_bits() as i64 - MAGIC.to_bits() as i64
}

/// Rounds to the nearest integer, ties to even, for |x| < 2⁶³.
#[inline]
pub(super) fn round_large(x: f64) -> i64 {
    if x.abs() < 1e15 { round_small(x) } else { x.round_ties_even() as i64 }
}
