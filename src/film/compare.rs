//! Comparison of two pictures.

use super::Picture;
use super::flip::{hdr_flip, ldr_flip};
use super::metrics::{brightness, relative_error, relative_square, root_mean_without_worst};

/// The result of [`compare`]. All figures are over the pixels that are finite in both pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Number of compared pixels.
    pub compared: u64,
    /// Pixels of each picture that contain a NaN or an infinity, and are left out.
    pub non_finite: [u64; 2],
    /// Mean of each picture and channel: scene-linear radiance.
    pub means: [[f64; 3]; 2],
    /// Mean squared error over pixels and channels.
    pub mse: f64,
    /// Mean of (a − b)² / (b² + 0.01) over pixels and channels: b is the reference.
    pub relative_mse: f64,
    /// m, the [`brightness`] of b.
    pub brightness: f64,
    /// Mean of (a − b)² / (b² + 0.01·m²) over pixels and channels, which does not depend on the unit of radiance.
    /// Infinite if b is black, so that m is 0, and a is not.
    pub relative_mse_scaled: f64,
    /// The square root of [`Comparison::relative_mse_scaled`] without the pixels of the largest errors: the figure that
    /// `--noise` estimates.
    pub noise: f64,
    /// The perceived difference.
    pub flip: Flip,
}

/// The mean FLIP of two pictures, 0 (equal) to 1. Pixels that are not finite count as black in both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Flip {
    /// LDR-FLIP (2020) of the pictures clamped to 0…1.
    Ldr(f64),
    /// HDR-FLIP (2021).
    Hdr(super::flip::HdrFlip),
}

/// The variant of FLIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlipKind {
    /// For pictures tone mapped for a screen.
    Ldr,
    /// For radiance.
    Hdr,
}

/// The reason why pictures cannot be compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CompareError {
    /// Their sizes differ.
    #[error("the images differ in size: {}×{} and {}×{} pixels", .0[0], .0[1], .1[0], .1[1])]
    Sizes([u32; 2], [u32; 2]),
    /// There is no pixel to compare.
    #[error("no pixel is finite in both images")]
    NothingFinite,
}

/// The brightness that the floor of relMSE is relative to: pictures are assumed to be about as bright as white.
const WHITE: f64 = 1.0;

/// Compares a picture with a reference of the same size.
pub fn compare(a: &Picture, b: &Picture, kind: FlipKind) -> Result<Comparison, CompareError> {
    let sizes = [a, b].map(|picture| [picture.width, picture.height]);
    if sizes[0] != sizes[1] {
        return Err(CompareError::Sizes(sizes[0], sizes[1]));
    }
    let finite = |rgb: &[f32; 3]| rgb.iter().all(|c| c.is_finite());
    let non_finite = [a, b].map(|picture| picture.rgb.iter().filter(|rgb| !finite(rgb)).count() as u64);

    let pairs = || a.rgb.iter().zip(&b.rgb).filter(|(a, b)| finite(a) && finite(b));
    let brightness = brightness(pairs().map(|(_, b)| b));
    let (mut compared, mut means) = (0u64, [[0.0; 3]; 2]);
    let (mut squares, mut relative, mut errors) = (0.0, 0.0, Vec::new());
    for (a, b) in pairs() {
        compared += 1;
        errors.push(relative_error(*a, *b, *b, brightness));
        for channel in 0..3 {
            let [a, b] = [a, b].map(|rgb| f64::from(rgb[channel]));
            means[0][channel] += a;
            means[1][channel] += b;
            squares += (a - b) * (a - b);
            relative += relative_square(a, b, b, WHITE);
        }
    }
    if compared == 0 {
        return Err(CompareError::NothingFinite);
    }
    let pixels = compared as f64;
    let flip = if non_finite == [0, 0] {
        flip(a, b, kind)
    } else {
        let (a, b) = blackened(a, b, finite);
        flip(&a, &b, kind)
    };
    Ok(Comparison {
        compared,
        non_finite,
        means: means.map(|mean| mean.map(|sum| sum / pixels)),
        mse: squares / (3.0 * pixels),
        relative_mse: relative / (3.0 * pixels),
        brightness,
        relative_mse_scaled: errors.iter().sum::<f64>() / pixels,
        noise: root_mean_without_worst(errors),
        flip,
    })
}

fn flip(a: &Picture, b: &Picture, kind: FlipKind) -> Flip {
    match kind {
        FlipKind::Ldr => Flip::Ldr(ldr_flip(a, b)),
        FlipKind::Hdr => Flip::Hdr(hdr_flip(a, b)),
    }
}

/// Both pictures, with pixels black in both where either fails the test `finite`.
fn blackened(a: &Picture, b: &Picture, finite: impl Fn(&[f32; 3]) -> bool) -> (Picture, Picture) {
    let (mut a, mut b) = (a.clone(), b.clone());
    for (a, b) in a.rgb.iter_mut().zip(&mut b.rgb).filter(|(a, b)| !finite(a) || !finite(b)) {
        (*a, *b) = ([0.0; 3], [0.0; 3]);
    }
    (a, b)
}

/// The squared error of each pixel: the mean over its channels.
///
/// # Panics
/// If the pictures differ in size.
pub fn squared_errors(a: &Picture, b: &Picture) -> Vec<f64> {
    assert_eq!((a.width, a.height), (b.width, b.height), "pictures of one size");
    let square = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2);
    let error = |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).map(square).sum::<f64>() / 3.0;
    a.rgb.iter().zip(&b.rgb).map(error).collect()
}

/// The mean of squared errors without the worst `share` of them, 0 to 1. A few fireflies can outweigh all other pixels;
/// this is the error of the rest.
pub fn mean_without_worst(errors: &[f64], share: f64) -> f64 {
    let kept = errors.len() - (errors.len() as f64 * share).floor() as usize;
    let mut errors = errors.to_vec();
    if kept < errors.len() {
        errors.select_nth_unstable_by(kept, f64::total_cmp);
    }
    errors[..kept].iter().sum::<f64>() / kept.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(rgb: &[[f32; 3]]) -> Picture {
        Picture { width: rgb.len() as u32, height: 1, rgb: rgb.to_vec() }
    }

    #[test]
    fn figures_follow_their_definitions() {
        let a = picture(&[[1.0, 0.5, 0.0], [0.0, 0.0, 2.0]]);
        let b = picture(&[[0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]);
        let found = compare(&a, &b, FlipKind::Hdr).unwrap();
        assert_eq!(found.compared, 2);
        assert_eq!(found.means, [[0.5, 0.25, 1.0], [0.25, 0.25, 0.5]]);
        assert!((found.mse - (0.25 + 1.0) / 6.0).abs() < 1e-12);
        assert!((found.relative_mse - (0.25 / 0.26 + 1.0 / 1.01) / 6.0).abs() < 1e-12);
        // The mean of b is a third.
        assert!((found.brightness - 1.0 / 3.0).abs() < 1e-12);
        let floor = 0.01 / 9.0;
        let scaled = (0.25 / (0.25 + floor) + 1.0 / (1.0 + floor)) / 6.0;
        assert!((found.relative_mse_scaled - scaled).abs() < 1e-12);
        assert!((found.noise - scaled.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_scaled_figures_do_not_depend_on_the_unit_of_radiance_and_the_others_do() {
        let figures = |scale: f32| {
            let pixel = |i: u32, c: f32| [i as f32 * c * scale, 0.5 * scale, 0.25 * scale];
            let of = |c: f32| picture(&(0..600).map(|i| pixel(i, c)).collect::<Vec<_>>());
            compare(&of(1.0 / 64.0), &of(1.0 / 60.0), FlipKind::Ldr).unwrap()
        };
        let one = figures(1.0);
        for scale in [libm::exp2f(-30.0), libm::exp2f(-10.0), 1024.0] {
            let found = figures(scale);
            assert_eq!((found.relative_mse_scaled, found.noise), (one.relative_mse_scaled, one.noise));
            assert_ne!(found.relative_mse, one.relative_mse);
        }
    }

    #[test]
    fn against_black_every_error_is_infinite() {
        let (black, other) = (picture(&[[0.0; 3]; 8]), picture(&[[0.5, 0.0, 0.0]; 8]));
        let found = compare(&other, &black, FlipKind::Ldr).unwrap();
        assert_eq!(
            (found.brightness, found.relative_mse_scaled, found.noise),
            (0.0, f64::INFINITY, f64::INFINITY)
        );
        let found = compare(&black, &black, FlipKind::Ldr).unwrap();
        assert_eq!((found.relative_mse_scaled, found.noise), (0.0, 0.0));
    }

    #[test]
    fn only_relative_errors_depend_on_the_order_of_the_pictures() {
        let (a, b) = (picture(&[[1.0, 0.4, 0.2]; 4]), picture(&[[0.5, 0.3, 0.1]; 4]));
        let (there, back) =
            (compare(&a, &b, FlipKind::Ldr).unwrap(), compare(&b, &a, FlipKind::Ldr).unwrap());
        assert_eq!((there.mse, there.flip), (back.mse, back.flip));
        assert!(there.relative_mse > 1.5 * back.relative_mse);
    }

    #[test]
    fn equal_pictures_have_no_error_and_different_ones_have() {
        let a = picture(&[[0.1, 0.2, 0.3], [4.0, 5.0, 6.0]]);
        let same = compare(&a, &a, FlipKind::Hdr).unwrap();
        let Flip::Hdr(flip) = same.flip else { panic!("not HDR-FLIP") };
        assert_eq!((same.mse, same.relative_mse, flip.mean), (0.0, 0.0, 0.0));
        let mut b = a.clone();
        b.rgb[1][2] += 0.01;
        let other = compare(&a, &b, FlipKind::Hdr).unwrap();
        let Flip::Hdr(flip) = other.flip else { panic!("not HDR-FLIP") };
        assert!(other.mse > 0.0 && other.relative_mse > 0.0 && flip.mean > 0.0);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let (good, bad) = ([0.5, 0.5, 0.5], [0.5, f32::NAN, 0.5]);
        let a = picture(&[good, bad, good, [f32::INFINITY; 3]]);
        let b = picture(&[good, good, [f32::NEG_INFINITY; 3], good]);
        for kind in [FlipKind::Ldr, FlipKind::Hdr] {
            let found = compare(&a, &b, kind).unwrap();
            assert_eq!((found.compared, found.non_finite), (1, [2, 1]));
            assert_eq!((found.mse, found.relative_mse), (0.0, 0.0));
            assert_eq!(found.means, [[0.5; 3]; 2]);
            let (Flip::Ldr(mean) | Flip::Hdr(super::super::flip::HdrFlip { mean, .. })) = found.flip;
            assert_eq!(mean, 0.0);
        }
        assert_eq!(
            compare(&picture(&[bad]), &picture(&[good]), FlipKind::Ldr),
            Err(CompareError::NothingFinite)
        );
    }

    #[test]
    fn pictures_of_different_sizes_are_not_compared() {
        let tall = Picture { width: 1, height: 2, rgb: vec![[0.0; 3]; 2] };
        let error = compare(&picture(&[[0.0; 3]; 2]), &tall, FlipKind::Ldr).unwrap_err();
        assert_eq!(error.to_string(), "the images differ in size: 2×1 and 1×2 pixels");
    }

    #[test]
    fn the_worst_pixels_can_be_left_out() {
        let (a, mut b) = (picture(&[[0.0; 3]; 400]), picture(&[[0.1; 3]; 400]));
        b.rgb[7] = [100.0; 3];
        b.rgb[300] = [50.0; 3];
        let errors = squared_errors(&a, &b);
        assert!(mean_without_worst(&errors, 0.0) > 30.0);
        // 0.25% of 400 pixels is one: the worst; 0.5% is both.
        assert!((mean_without_worst(&errors, 0.0025) - (2500.0 + 398.0 * 0.01) / 399.0).abs() < 1e-6);
        assert!((mean_without_worst(&errors, 0.005) - 0.01).abs() < 1e-6);
        assert!((mean_without_worst(&[4.0], 0.005) - 4.0).abs() < 1e-12);
    }
}
