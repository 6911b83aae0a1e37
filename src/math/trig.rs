//! Trigonometry by polynomials: the same bits on all machines, unlike the system's library.

use super::{Float, Uint, function};

/// (sin 2πu, cos 2πu) for u in [0, 1], within 2⁻²².
///
/// The nearest quarter turn is subtracted; near-minimax polynomials cover the remaining eighth of a turn.
#[inline(always)]
pub fn sin_cos_turns<F: Float>(u: F) -> (F, F) {
    function!(F, sin_cos_turns(u), {
        let quarters = u * 4.0;
        let nearest = (quarters + 0.5).floor();
        let r = quarters - nearest;
        let z = r * r;
        let sin = r
            * ((((z * 1.582_065_3e-4 - 4.681_266_4e-3) * z + 0.079_692_58) * z - 0.645_964_1) * z
                + 1.570_796_4);
        let cos = (((z * 9.036_299e-4 - 0.020_860_07) * z + 0.253_669_2) * z - 1.233_700_5) * z + 1.0;
        let quadrant = nearest.to_uint();
        let one = F::Uint::splat(1);
        let swap = (quadrant & one).eq(one);
        let sin_sign = (quadrant & F::Uint::splat(2)).shl::<30>();
        let cos_sign = ((quadrant + one) & F::Uint::splat(2)).shl::<30>();
        let (s, c) = (F::select(swap, cos, sin), F::select(swap, sin, cos));
        (F::from_bits(s.to_bits() ^ sin_sign), F::from_bits(c.to_bits() ^ cos_sign))
    })
}

/// The angle of (x, y) over 2π, in [0, 1), within 2⁻²²; zero for the origin.
#[inline(always)]
pub fn angle_turns<F: Float>(y: F, x: F) -> F {
    function!(F, angle_turns(y, x), {
        let (ax, ay) = (x.abs(), y.abs());
        let (small, large) = (ax.min(ay), ax.max(ay));
        let q = small / large.max(F::splat(f32::MIN_POSITIVE));
        let z = q * q;
        let mut p = F::splat(0.002_834_064_2);
        for c in [
            -0.016_005_03,
            0.042_587_608,
            -0.074_954_46,
            0.106_367_54,
            -0.142_025_71,
            0.199_924_84,
            -0.333_330_66,
            1.0,
        ] {
            p = p * z + c;
        }
        let eighth = q * p * std::f32::consts::FRAC_1_PI * 0.5;
        let first = F::select(ay.gt(ax), -eighth + 0.25, eighth);
        let upper = F::select(x.lt(F::zero()), -first + 0.5, first);
        let turns = F::select(y.lt(F::zero()), -upper + 1.0, upper);
        F::select(turns.lt(F::splat(1.0)), turns, F::zero())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_double_precision() {
        for i in 0..=100_000 {
            let u = i as f32 / 100_000.0;
            let (s, c) = sin_cos_turns(u);
            let (es, ec) = (f64::from(u) * std::f64::consts::TAU).sin_cos();
            assert!((f64::from(s) - es).abs() < 2.4e-7, "sin at {u}: {s} is not {es}");
            assert!((f64::from(c) - ec).abs() < 2.4e-7, "cos at {u}: {c} is not {ec}");
        }
    }

    #[test]
    fn angles_agree_with_double_precision_in_all_quadrants() {
        for i in 0..100_000 {
            let turns = (f64::from(i) + 0.5) / 100_000.0;
            let (y, x) = (turns * std::f64::consts::TAU).sin_cos();
            let got = angle_turns(y as f32 * 3.0, x as f32 * 3.0);
            assert!((f64::from(got) - turns).abs() < 2.4e-7, "{got} is not {turns}");
        }
        assert_eq!(angle_turns(0.0_f32, 0.0), 0.0);
    }
}
