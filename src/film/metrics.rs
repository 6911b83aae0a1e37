//! Relative errors of pixels, and robust means over a picture.

/// The fraction of pixels, those with the largest errors or the brightest, that error figures leave out: a few
/// fireflies would outweigh all other pixels.
pub const WORST: f64 = 0.005;

/// Added to the square of the reference, in units of the squared brightness, so that nearly black pixels do not
/// dominate.
const RELATIVE_FLOOR: f64 = 0.01;

/// The squared error of a channel relative to the radiance `relative_to` in a picture of this brightness. Infinite if
/// both are zero, unless there is no error.
pub(super) fn relative_square(a: f64, b: f64, relative_to: f64, brightness: f64) -> f64 {
    if a == b {
        return 0.0;
    }
    (a - b) * (a - b) / (relative_to * relative_to + RELATIVE_FLOOR * (brightness * brightness))
}

/// The squared error of a pixel relative to a radiance in a picture of this brightness: the mean over its channels.
pub(super) fn relative_error(a: [f32; 3], b: [f32; 3], relative_to: [f32; 3], brightness: f64) -> f64 {
    let channel = |i: usize| {
        let [a, b, to] = [a, b, relative_to].map(|rgb| f64::from(rgb[i]));
        relative_square(a, b, to, brightness)
    };
    (channel(0) + channel(1) + channel(2)) / 3.0
}

/// The brightness of a picture for relative errors: the mean over its pixels and channels, without the [`WORST`]
/// fraction of pixels, those whose channels have the largest sums. Zero if the others are black.
pub fn brightness<'a>(rgb: impl IntoIterator<Item = &'a [f32; 3]>) -> f64 {
    let of_pixel = |rgb: &[f32; 3]| rgb.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    mean_without_largest(rgb.into_iter().map(of_pixel).collect())
}

/// The square root of the mean of squared errors without the [`WORST`] fraction of them.
pub fn root_mean_without_worst(errors: Vec<f64>) -> f64 {
    mean_without_largest(errors).sqrt()
}

/// The mean of values without the [`WORST`] fraction of them, the largest. The sum is in the order of the values, which
/// no sorting algorithm affects.
fn mean_without_largest(mut values: Vec<f64>) -> f64 {
    let (kept, bound) = (kept(values.len()), bound_of_worst(&values));
    // Of the values that equal the smallest one left out, as many as needed are kept.
    values.retain(|&value| value < bound);
    let as_large = kept - values.len();
    let sum = values.iter().sum::<f64>() + if as_large > 0 { as_large as f64 * bound } else { 0.0 };
    sum / kept.max(1) as f64
}

/// The least of the [`WORST`] values, which error figures leave out; infinity if none is.
pub(super) fn bound_of_worst(values: &[f64]) -> f64 {
    let kept = kept(values.len());
    match kept < values.len() {
        true => *values.to_vec().select_nth_unstable_by(kept, f64::total_cmp).1,
        false => f64::INFINITY,
    }
}

/// The number of values that are kept of `len`.
fn kept(len: usize) -> usize {
    len - (len as f64 * WORST).floor() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_is_the_mean_without_the_brightest_pixels() {
        let mut rgb: Vec<[f32; 3]> = (0..400).map(|i| [0.25, 0.5, (i % 4) as f32]).collect();
        assert_eq!(brightness(&rgb[..100]), (0.25 + 0.5 + 1.5) / 3.0);
        // Of 400 pixels two are left out: neither the ones with 1000 in one channel, and one of the next brightest.
        rgb[7] = [1000.0, 0.0, 0.0];
        let sum = 400.0 * 0.75 + 600.0 - 0.75 - 3.0 - 0.75 - 3.0;
        assert!((brightness(&rgb) - sum / 398.0 / 3.0).abs() < 1e-12, "{}", brightness(&rgb));
        rgb.reverse();
        assert!((brightness(&rgb) - sum / 398.0 / 3.0).abs() < 1e-12);
        assert_eq!(brightness(&[]), 0.0);
    }

    #[test]
    fn the_worst_half_per_cent_is_left_out_in_any_order() {
        let mut errors: Vec<f64> = (0..1000).map(|i| f64::from(i % 250)).collect();
        // Of four of each value, the five largest are dropped: all of 249 and one of 248.
        let sum = 4.0 * (0..248).map(f64::from).sum::<f64>() + 3.0 * 248.0;
        assert_eq!(root_mean_without_worst(errors.clone()), (sum / 995.0).sqrt());
        errors.reverse();
        assert_eq!(root_mean_without_worst(errors), (sum / 995.0).sqrt());
        assert_eq!(root_mean_without_worst(vec![4.0, 9.0, 5.0]), 6.0_f64.sqrt());
        assert_eq!(root_mean_without_worst(Vec::new()), 0.0);
    }
}
