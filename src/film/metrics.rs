//! Relative errors of pixels, and the means over a picture that errors are relative to and summed up in.

/// The share of pixels, those with the largest errors or the brightest, that figures of noise leave out: a few that a
/// rare path made far too bright would outweigh all others.
pub const WORST: f64 = 0.005;

/// Added to the square of the reference, in units of the square of a brightness, so that what is nearly black does not
/// count for everything.
const RELATIVE_FLOOR: f64 = 0.01;

/// The squared error of a channel relative to a radiance in a picture of a brightness. Infinite where both of these are
/// zero, unless there is no error.
pub(super) fn relative_square(a: f64, b: f64, relative_to: f64, brightness: f64) -> f64 {
    if a == b {
        return 0.0;
    }
    (a - b) * (a - b) / (relative_to * relative_to + RELATIVE_FLOOR * (brightness * brightness))
}

/// The squared error of a pixel relative to a radiance in a picture of a brightness, the mean over its channels.
pub(super) fn relative_error(a: [f32; 3], b: [f32; 3], relative_to: [f32; 3], brightness: f64) -> f64 {
    let channel = |i: usize| {
        let [a, b, to] = [a, b, relative_to].map(|rgb| f64::from(rgb[i]));
        relative_square(a, b, to, brightness)
    };
    (channel(0) + channel(1) + channel(2)) / 3.0
}

/// What relative errors take as the brightness of a picture: the mean over its pixels and channels, without the
/// [`WORST`] of the pixels, those whose channels have the largest sums. Zero where there is nothing else to see.
pub fn brightness<'a>(rgb: impl IntoIterator<Item = &'a [f32; 3]>) -> f64 {
    let of_pixel = |rgb: &[f32; 3]| rgb.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0;
    mean_without_largest(rgb.into_iter().map(of_pixel).collect())
}

/// √ of the mean of relative squared errors without the [`WORST`] of them.
pub fn root_mean_without_worst(errors: Vec<f64>) -> f64 {
    mean_without_largest(errors).sqrt()
}

/// The mean of values without the [`WORST`] of them, the largest. It depends on the order in which they come, not on
/// the one in which some algorithm leaves them.
fn mean_without_largest(mut values: Vec<f64>) -> f64 {
    let (kept, bound) = (kept(values.len()), bound_of_worst(&values));
    // As many as are needed of those that are as large as the smallest that is left out.
    values.retain(|&value| value < bound);
    let as_large = kept - values.len();
    let sum = values.iter().sum::<f64>() + if as_large > 0 { as_large as f64 * bound } else { 0.0 };
    sum / kept.max(1) as f64
}

/// The least of the [`WORST`] values, which figures of noise leave out; infinity where none is.
pub(super) fn bound_of_worst(values: &[f64]) -> f64 {
    let kept = kept(values.len());
    match kept < values.len() {
        true => *values.to_vec().select_nth_unstable_by(kept, f64::total_cmp).1,
        false => f64::INFINITY,
    }
}

/// How many of so many values are not among the [`WORST`].
fn kept(len: usize) -> usize {
    len - (len as f64 * WORST).floor() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_is_the_mean_of_pixels_and_channels_without_the_brightest() {
        let mut rgb: Vec<[f32; 3]> = (0..400).map(|i| [0.25, 0.5, (i % 4) as f32]).collect();
        assert_eq!(brightness(&rgb[..100]), (0.25 + 0.5 + 1.5) / 3.0);
        // Of 400 pixels two are left out: neither of 1000 in one channel, and one of the brightest others.
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
        // Of four of each, the five largest go: all of 249 and one of 248.
        let sum = 4.0 * (0..248).map(f64::from).sum::<f64>() + 3.0 * 248.0;
        assert_eq!(root_mean_without_worst(errors.clone()), (sum / 995.0).sqrt());
        errors.reverse();
        assert_eq!(root_mean_without_worst(errors), (sum / 995.0).sqrt());
        assert_eq!(root_mean_without_worst(vec![4.0, 9.0, 5.0]), 6.0_f64.sqrt());
        assert_eq!(root_mean_without_worst(Vec::new()), 0.0);
    }
}
