//! Slopes on logarithmic axes, and standard errors over independent seeds.

/// A straight line through the logarithms of points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fit {
    pub(super) slope: f64,
    /// The coefficient of determination R², 0 to 1.
    pub(super) explained: f64,
}

/// Least squares; `None` for fewer than three points, because any line fits two, or if an ordinate has no logarithm.
pub(super) fn fit(points: impl Iterator<Item = (f64, f64)>) -> Option<Fit> {
    let points: Vec<(f64, f64)> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
    if points.len() < 3 || points.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
        return None;
    }
    let count = points.len() as f64;
    let (mean_x, mean_y) =
        points.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let sum = |term: &dyn Fn(f64, f64) -> f64| -> f64 {
        points.iter().map(|(x, y)| term(x - mean_x, y - mean_y)).sum()
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    let residual = sum(&|x, y| (y - slope * x).powi(2));
    let explained = if yy > 0.0 { 1.0 - residual / yy } else { 1.0 };
    Some(Fit { slope, explained })
}

/// The standard error of a figure of `seeds` independent seeds, by the jackknife (Tukey 1958; Efron 1982, §3):
/// `without(i)` is the figure of all seeds but `i`. For a mean it is the standard deviation over √seeds.
///
/// `None` for fewer than two seeds, or if a figure does not exist.
///
/// The errors at n and 2n samples of one seed are correlated, because the second picture contains the samples of the
/// first. Leaving out whole seeds takes that into account; the residuals of a fitted line do not.
pub(super) fn standard_error(seeds: usize, without: impl Fn(usize) -> Option<f64>) -> Option<f64> {
    if seeds < 2 {
        return None;
    }
    let figures: Vec<f64> = (0..seeds).map(without).collect::<Option<_>>()?;
    let count = seeds as f64;
    let mean = figures.iter().sum::<f64>() / count;
    let squares: f64 = figures.iter().map(|figure| (figure - mean).powi(2)).sum();
    Some(((count - 1.0) / count * squares).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_fits_exactly_and_a_bent_one_does_not() {
        let line = |n: i32| (f64::from(1 << n), 3.0 * f64::from(1 << n).powf(-0.5));
        let found = fit((0..6).map(line)).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-12 && found.explained > 1.0 - 1e-12);
        // Logarithms 0, 0, −1 at 0, 1, 2: slope −½, residuals 1/6, −1/3, 1/6.
        let bent = [(1.0, 1.0), (1f64.exp(), 1.0), (2f64.exp(), (-1f64).exp())];
        let found = fit(bent.into_iter()).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-12);
        assert!((found.explained - 0.75).abs() < 1e-12);
    }

    #[test]
    fn too_few_points_or_no_error_have_no_slope() {
        assert_eq!(fit([(1.0, 1.0), (2.0, 0.5)].into_iter()), None);
        assert_eq!(fit([(1.0, 0.0), (2.0, 0.0), (4.0, 0.0)].into_iter()), None);
    }

    #[test]
    fn the_standard_error_of_a_mean_is_the_deviation_over_the_root_of_the_number() {
        // Mean 3, squared deviations 4 + 1 + 0 + 0 + 9 = 14.
        let values = [1.0, 2.0, 3.0, 3.0, 6.0];
        let mean_without = |left: usize| Some((15.0 - values[left]) / 4.0);
        let found = standard_error(5, mean_without).unwrap();
        assert!((found - (14.0f64 / 4.0 / 5.0).sqrt()).abs() < 1e-12, "{found}");
        assert_eq!(standard_error(1, mean_without), None);
        assert_eq!(standard_error(5, |_| None), None);
    }

    /// Errors of one seed at 1, 2, 4, …, 32 samples: the mean square of 50 running means of a normal variable. The
    /// numbers are those of a linear congruential generator (Knuth).
    fn curve(state: &mut u64) -> [f64; 6] {
        let mut uniform = || {
            *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut squares = [0.0; 6];
        for _ in 0..50 {
            let mut sum = 0.0;
            for n in 1..=32u32 {
                sum += (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                if n.is_power_of_two() {
                    squares[n.ilog2() as usize] += (sum / f64::from(n)).powi(2) / 50.0;
                }
            }
        }
        squares
    }

    // The mean of 300 estimates of the variance, each of 8 seeds, against the variance of 300 slopes: relative standard
    // errors of 3% and 8%, so that a quarter is three of them. The estimate from the residuals of the fitted line,
    // which takes the six errors for independent, fails the same test.
    #[test]
    fn the_standard_error_of_a_slope_is_its_spread_over_repetitions() {
        let mut state = 1;
        let slope = |curves: &[[f64; 6]]| {
            let root = |n: usize| curves.iter().map(|curve| curve[n]).sum::<f64>().sqrt();
            fit((0..6).map(|n| (f64::from(1 << n), root(n)))).unwrap().slope
        };
        let (mut slopes, mut variances, mut residuals) = (Vec::new(), 0.0, 0.0);
        for _ in 0..300 {
            let curves: Vec<[f64; 6]> = (0..8).map(|_| curve(&mut state)).collect();
            let found = standard_error(8, |left| {
                let others: Vec<_> =
                    curves.iter().enumerate().filter(|(i, _)| *i != left).map(|(_, c)| *c).collect();
                Some(slope(&others))
            });
            variances += found.unwrap().powi(2) / 300.0;
            let all = slope(&curves);
            slopes.push(all);
            let logs: Vec<f64> =
                (0..6).map(|n| curves.iter().map(|c| c[n]).sum::<f64>().ln() / 2.0).collect();
            let mean = logs.iter().sum::<f64>() / 6.0;
            let residual = |n: usize| logs[n] - mean - all * (n as f64 - 2.5) * 2f64.ln();
            let xx = 17.5 * 2f64.ln().powi(2);
            residuals += (0..6).map(|n| residual(n).powi(2)).sum::<f64>() / 4.0 / xx / 300.0;
        }
        let mean = slopes.iter().sum::<f64>() / 300.0;
        let spread = slopes.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>() / 299.0;
        assert!((mean + 0.5).abs() < 0.01, "{mean}");
        assert!((0.75..1.25).contains(&(variances / spread)), "{}", variances / spread);
        assert!(!(0.75..1.25).contains(&(residuals / spread)), "{}", residuals / spread);
    }
}
