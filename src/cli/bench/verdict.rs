//! The comparison of two curves of errors: the ratio of the numbers of samples, or of the times, that lead to the same
//! error.

/// A curve of errors against a cost, the number of samples or a time, in the order of increasing cost.
pub(super) type Costs = Vec<(f64, f64)>;

/// The cost at which a curve has an error, by a straight line on logarithmic axes between the neighbouring points.
///
/// The curve is searched from its end, so that it may be noisy at the beginning. An error just below the last one lies on
/// the extension of the last line. `None` if the first error is already below, or for fewer than two points.
pub(super) fn cost_of(curve: &Costs, error: f64) -> Option<f64> {
    let segment = curve.windows(2).rev().find(|pair| pair[0].1 >= error)?;
    let [(x0, y0), (x1, y1)] = [segment[0], segment[1]].map(|(x, y)| (x.ln(), y.ln()));
    let cost = (x0 + (error.ln() - y0) * (x1 - x0) / (y1 - y0)).exp();
    // A horizontal line has no cost, and an extension beyond twice the last cost is no measurement.
    let most = 2.0 * curve.last()?.0;
    (cost.is_finite() && cost <= most).then_some(cost)
}

/// The cost of the last error of `baseline`, divided by that of the same error of `other`.
pub(super) fn advantage(baseline: &Costs, other: &Costs) -> Option<f64> {
    let &(cost, error) = baseline.last()?;
    Some(cost / cost_of(other, error)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(error: impl Fn(f64) -> f64) -> Costs {
        (0..9).map(|power| f64::from(1 << power)).map(|n| (n, error(n))).collect()
    }

    #[test]
    fn the_advantage_is_exact_for_straight_lines() {
        let independent = curve(|n| n.powf(-0.5));
        for factor in [1.0, 2.0, 3.1, 100.0] {
            // As if each sample counted for several.
            let other = curve(|n| (n * factor).powf(-0.5));
            let found = advantage(&independent, &other).unwrap();
            assert!((found / factor - 1.0).abs() < 1e-12, "{found} is not {factor}");
        }
        // n⁻¹ = 256^(−½) at 16.
        let found = advantage(&independent, &curve(|n| 1.0 / n)).unwrap();
        assert!((found - 16.0).abs() < 1e-9, "{found}");
    }

    #[test]
    fn errors_beyond_the_measured_ones_have_no_cost() {
        let independent = curve(|n| n.powf(-0.5));
        // A single sample is better than all.
        assert_eq!(advantage(&independent, &curve(|n| 0.01 * n.powf(-0.5))), None);
        assert_eq!(cost_of(&independent, 0.02), None);
        assert!((cost_of(&independent, 0.05).unwrap() - 400.0).abs() < 1e-9);
        assert_eq!(cost_of(&curve(|_| 0.5), 0.5), None);
        assert_eq!(cost_of(&vec![(1.0, 0.5)], 0.5), None);
    }
}
