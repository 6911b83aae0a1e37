//! The owner overlay: each pixel in the colour of the worker that owns it (report figure 3.1).

use std::path::Path;

use super::error::OutputError;
use super::{atomic, picture, png};
use crate::film::tone::srgb_to_linear;

/// Levels of red, green and blue for the colours; their cube is the number of candidates.
const LEVELS: u8 = 12;

/// The colour of every pixel's owner. `owners` are row-major, `width × height` of them.
///
/// # Panics
/// If the number of owners is different.
pub fn owner_overlay(owners: &[u32], width: u32, height: u32) -> Vec<[u8; 3]> {
    assert_eq!(owners.len(), width as usize * height as usize, "a pixel without an owner");
    let colours = palette(workers(owners));
    owners.iter().map(|&owner| colours[owner as usize % colours.len()]).collect()
}

/// Writes the overlay as a PNG file, completely or not at all.
pub fn write_owner_overlay(path: &Path, owners: &[u32], width: u32, height: u32) -> Result<(), OutputError> {
    check_writable(path)?;
    let colours = owner_overlay(owners, width, height);
    atomic::write_atomically(path, |out| png::encode(width, height, &colours, out))
}

/// Checks that the overlay can be written to `path`, which must be a PNG file. Leaves no file behind.
pub fn check_writable(path: &Path) -> Result<(), OutputError> {
    match picture::Format::of(path) {
        Ok(picture::Format::Png) => atomic::check_place(path),
        _ => Err(OutputError::UnknownFormat {
            path: path.to_path_buf(),
            extension: path.extension().unwrap_or_default().to_string_lossy().into_owned(),
            known: ".png for the owner overlay".into(),
        }),
    }
}

/// The number of workers: one more than the largest index.
pub(crate) fn workers(owners: &[u32]) -> usize {
    owners.iter().max().map_or(1, |&most| most as usize + 1)
}

/// `count` sRGB colours, each as far as possible from the ones before it, so that few workers have very
/// different colours and many are still distinguishable. The first colours do not depend on the count. More workers
/// than colours (1728, less the dark ones) share them.
pub fn palette(count: usize) -> Vec<[u8; 3]> {
    let level = |i: u8| i * (255 / (LEVELS - 1)) + i.min(255 % (LEVELS - 1));
    let all = (0..LEVELS)
        .flat_map(|r| (0..LEVELS).flat_map(move |g| (0..LEVELS).map(move |b| [r, g, b].map(level))));
    // The area around the picture in a window is black, and dark colours look alike on most screens.
    let mut candidates: Vec<_> = all
        .map(|rgb| (rgb, oklab(rgb)))
        .filter(|(_, lab)| lab[0] > 0.35)
        .map(|(rgb, lab)| (rgb, lab, f64::INFINITY))
        .collect();

    let mut colours = Vec::new();
    // A quiet blue first: the picture of a single worker is uniform in it.
    let mut next = candidates.iter().position(|(rgb, ..)| rgb[0] < rgb[1] && rgb[1] < rgb[2]).unwrap_or(0);
    while colours.len() < count && !candidates.is_empty() {
        let (rgb, lab, _) = candidates.swap_remove(next);
        colours.push(rgb);
        let mut farthest = 0.0;
        next = 0;
        for (i, (_, other, distance)) in candidates.iter_mut().enumerate() {
            *distance = distance.min(distance_squared(lab, *other));
            if *distance > farthest {
                (farthest, next) = (*distance, i);
            }
        }
    }
    colours
}

fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Oklab (Ottosson 2020), in which equal distances are about equal perceived differences.
fn oklab(rgb: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = rgb.map(|code| srgb_to_linear(f64::from(code) / 255.0));
    let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
    let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
    let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest distance between two colours, squared.
    fn closest(colours: &[[u8; 3]]) -> f64 {
        let mut smallest = f64::INFINITY;
        for (i, &a) in colours.iter().enumerate() {
            for &b in &colours[..i] {
                smallest = smallest.min(distance_squared(oklab(a), oklab(b)));
            }
        }
        smallest
    }

    #[test]
    fn colours_can_be_told_apart() {
        // 0.02 in Oklab is about a just noticeable difference of adjacent colours.
        for (count, apart) in [(2, 0.3), (8, 0.2), (25, 0.12), (64, 0.08), (256, 0.045), (1024, 0.02)] {
            let colours = palette(count);
            assert_eq!(colours.len(), count);
            let distance = closest(&colours).sqrt();
            assert!(distance >= apart, "{count} colours: {distance}");
        }
        // Negative control: two similar colours are detected.
        let mut colours = palette(25);
        colours.push(colours[3]);
        assert!(closest(&colours) < 0.01);
    }

    #[test]
    fn a_worker_keeps_its_colour_when_others_come() {
        assert_eq!(palette(100)[..7], palette(7)[..]);
    }

    #[test]
    fn oklab_of_white_and_grey_has_no_colour() {
        for code in [64, 128, 255] {
            let [l, a, b] = oklab([code; 3]);
            assert!(a.abs() < 1e-6 && b.abs() < 1e-6 && l > 0.0);
        }
        assert!((oklab([255; 3])[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn pixels_take_the_colours_of_their_workers() {
        // 25 workers on 10 columns, in strides.
        let owners: Vec<u32> = (0..100).map(|pixel| pixel % 25).collect();
        let overlay = owner_overlay(&owners, 10, 10);
        let colours = palette(25);
        for (pixel, colour) in overlay.iter().enumerate() {
            assert_eq!(*colour, colours[pixel % 25]);
        }
        assert_ne!(overlay[0], overlay[1]);
        assert_eq!(owner_overlay(&[0], 1, 1), [colours[0]]);
    }

    #[test]
    fn more_workers_than_colours_share_them() {
        let colours = palette(100_000).len();
        assert!((1200..1728).contains(&colours), "{colours}");
        let overlay = owner_overlay(&[0, 99_999], 2, 1);
        assert_eq!(overlay[0], palette(1)[0]);
    }

    #[test]
    fn the_overlay_is_a_png_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_owner_overlay(&path, &[0, 1, 2, 0, 1, 2], 3, 2).unwrap();
        let read = image::open(&path).unwrap().to_rgb8();
        let pixels: Vec<[u8; 3]> = read.pixels().map(|p| p.0).collect();
        assert_eq!(pixels, owner_overlay(&[0, 1, 2, 0, 1, 2], 3, 2));
        let error = write_owner_overlay(&folder.path().join("a.exr"), &[0], 1, 1).unwrap_err();
        assert!(error.to_string().contains(".png for the owner overlay"), "{error}");
    }
}
