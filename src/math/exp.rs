//! The exponential function by a polynomial: the same bits everywhere, unlike the system's own.

use super::{Float, Uint, function};
use std::f32::consts::{LN_2, LOG2_E};

/// e⁻ˣ for x ≥ 0, also infinity, within 2⁻²² (1 + x) relative; zero beyond 87.3, where it is subnormal.
///
/// A power of two is taken off; the Taylor series of 2ʳ serves what is left, which is at most a half.
#[inline(always)]
pub fn exp_minus<F: Float>(x: F) -> F {
    function!(F, exp_minus(x), {
        let least = F::splat(-126.0);
        let exponent = x * -LOG2_E;
        // Also of an infinity, of which nothing may be taken off.
        let kept = exponent.max(least);
        let whole = (kept + 0.5).floor();
        let r = kept - whole;
        let mut power = F::splat(1.525_273_4e-5);
        for c in [1.540_353e-4, 1.333_355_8e-3, 9.618_129e-3, 5.550_411e-2, 2.402_265e-1, LN_2, 1.0] {
            power = power * r + c;
        }
        let scale = F::from_bits((whole + 127.0).to_uint().shl::<23>());
        (scale * power).only(least.le(exponent))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_e_agree_with_double_precision() {
        for i in 0..=87_000 {
            let x = i as f32 / 1000.0;
            let (got, expected) = (f64::from(exp_minus(x)), (-f64::from(x)).exp());
            let most = 2.4e-7 * (1.0 + f64::from(x)) * expected;
            assert!((got - expected).abs() < most, "{x}: {got} is not {expected}");
        }
    }

    #[test]
    fn nothing_is_left_of_very_little() {
        assert_eq!([0.0, 88.0, 1e30, f32::INFINITY].map(exp_minus::<f32>), [1.0, 0.0, 0.0, 0.0]);
    }
}
