//! FLIP: the perceived difference of two pictures that alternate on a screen, from 0 (none) to 1.
//!
//! LDR-FLIP is Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator
//! for Alternating Images" (2020); HDR-FLIP is Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors
//! in Rendered High Dynamic Range Images" (2021). Symbols follow the papers. The viewer sits 0.7 m from a screen 0.7 m
//! and 3840 pixels wide, as the papers suggest: 67 pixels per degree.

use super::Picture;
use super::plane::{Plane, convolve};
use super::tone::{aces, aces_inverse};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Pixels per degree of visual angle: distance × pixels per length × one degree.
const PIXELS_PER_DEGREE: f64 = 0.7 * (3840.0 / 0.7) * (PI / 180.0);

/// Exponent of the colour difference.
const QC: f32 = 0.7;
/// The fraction of the largest colour difference below which differences get most of the range.
const PC: f32 = 0.4;
/// The end of the range of differences below that fraction.
const PT: f32 = 0.95;
/// Exponent of the feature difference.
const QF: f32 = 0.5;
/// Width of the features that the eye sees best, in degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// The mean LDR-FLIP of two pictures whose scene-linear values are clamped to 0…1 first. Symmetric.
///
/// # Panics
/// If the pictures differ in size. Values must be finite.
pub fn ldr_flip(a: &Picture, b: &Picture) -> f64 {
    let viewer = Viewer::new();
    let clamped = |rgb: [f32; 3]| rgb.map(|c| c.clamp(0.0, 1.0));
    mean(&viewer.differences(&mapped(a, clamped), &mapped(b, clamped)))
}

/// The result of HDR-FLIP, and the range of exposures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HdrFlip {
    /// The mean over the picture of each pixel's largest difference at any of the exposures.
    pub mean: f64,
    /// The darkest exposure, in stops.
    pub start: f64,
    /// The brightest exposure, in stops.
    pub stop: f64,
    /// Number of exposures, evenly spaced, ends included.
    pub exposures: u32,
}

/// The HDR-FLIP of two scene-linear pictures, tone mapped by the ACES curve. The exposures range from those that map
/// the reference's brightest and median luminance to 85% of white, with at most one stop between them.
///
/// # Panics
/// If the pictures differ in size or have no pixels. Values must be finite; negative ones count as black.
pub fn hdr_flip(test: &Picture, reference: &Picture) -> HdrFlip {
    let viewer = Viewer::new();
    let (start, stop) = exposure_range(reference);
    let exposures = (stop - start).ceil().max(2.0) as u32;
    let mut worst = vec![0.0f32; reference.rgb.len()];
    for step in 0..exposures {
        let stops = start + (stop - start) * f64::from(step) / f64::from(exposures - 1);
        let gain = libm::exp2(stops);
        let shown = |rgb: [f32; 3]| rgb.map(|c| aces(f64::from(c).max(0.0) * gain) as f32);
        let seen = viewer.differences(&mapped(test, shown), &mapped(reference, shown));
        worst.iter_mut().zip(seen).for_each(|(worst, seen)| *worst = worst.max(seen));
    }
    HdrFlip { mean: mean(&worst), start, stop, exposures }
}

/// The exposures, in stops, that map the brightest and the median luminance to 85% of white.
fn exposure_range(reference: &Picture) -> (f64, f64) {
    let colours = Colours::new();
    let mut luminances: Vec<f32> = reference.rgb.iter().map(|&rgb| colours.relative_xyz(rgb)[1]).collect();
    let middle = luminances.len() / 2;
    let (_, &mut median, above) = luminances.select_nth_unstable_by(middle, f32::total_cmp);
    let brightest = above.iter().copied().fold(median, f32::max);
    // With a median of black the exposure would be infinite.
    let stops = |luminance: f32| libm::log2(aces_inverse(0.85) / f64::from(luminance.max(f32::EPSILON)));
    (stops(brightest), stops(median))
}

fn mapped(picture: &Picture, map: impl Fn([f32; 3]) -> [f32; 3]) -> Picture {
    Picture { rgb: picture.rgb.iter().map(|&rgb| map(rgb)).collect(), ..*picture }
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&value| f64::from(value)).sum::<f64>() / values.len() as f64
}

/// Conversions from linear Rec. 709 to the colour spaces of the papers, relative to white.
struct Colours {
    to_xyz: [[f32; 3]; 3],
    from_xyz: [[f32; 3]; 3],
}

impl Colours {
    fn new() -> Colours {
        let xyz = |x: f64, y: f64| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
        // IEC 61966-2-1: the primaries, and the D65 white that they sum to.
        let primaries = DMat3::from_cols(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
        let white = xyz(0.3127, 0.3290);
        let rgb_to_xyz = primaries * DMat3::from_diagonal(primaries.inverse() * white);
        let relative = DMat3::from_diagonal(white.recip()) * rgb_to_xyz;
        let rows = |m: DMat3| m.transpose().to_cols_array_2d().map(|row| row.map(|c| c as f32));
        Colours { to_xyz: rows(relative), from_xyz: rows(relative.inverse()) }
    }

    /// CIE XYZ relative to white, which is (1, 1, 1).
    fn relative_xyz(&self, rgb: [f32; 3]) -> [f32; 3] {
        transform(&self.to_xyz, rgb)
    }

    /// YCxCz, a linear space whose Y is close to Lab's lightness: the space in which contrast sensitivity is applied.
    fn ycxcz(&self, rgb: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.relative_xyz(rgb);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// CIE Lab of a YCxCz colour, clamped to the screen's gamut, with the Hunt effect: dim colours appear less
    /// saturated.
    fn hunt_lab(&self, [luma, cx, cz]: [f32; 3]) -> [f32; 3] {
        let y = (luma + 16.0) / 116.0;
        let rgb = transform(&self.from_xyz, [y + cx / 500.0, y, y - cz / 200.0]);
        let [x, y, z] = self.relative_xyz(rgb.map(|c| c.clamp(0.0, 1.0))).map(lab_root);
        let lightness = 116.0 * y - 16.0;
        let hunt = 0.01 * lightness;
        [lightness, 500.0 * (x - y) * hunt, 200.0 * (y - z) * hunt]
    }
}

fn transform(rows: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The cube root of CIE Lab, linear near zero.
fn lab_root(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { libm::cbrtf(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// HyAB distance (Abasi, Tehran and Fairchild 2020), intended for large differences.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [lightness, u, v] = [0, 1, 2].map(|i| a[i] - b[i]);
    lightness.abs() + (u * u + v * v).sqrt()
}

/// A Gaussian of the contrast sensitivity function: an amplitude and a spread in degrees².
struct Lobe {
    amplitude: f64,
    spread: f64,
}

/// Contrast sensitivity for lightness, red-green and blue-yellow: sums of Gaussians.
const SENSITIVITY: [&[Lobe]; 3] = [
    &[Lobe { amplitude: 1.0, spread: 0.0047 }],
    &[Lobe { amplitude: 1.0, spread: 0.0053 }],
    &[Lobe { amplitude: 34.1, spread: 0.04 }, Lobe { amplitude: 13.5, spread: 0.025 }],
];
/// The largest spread; all kernels extend to three of its standard deviations.
const WIDEST_SPREAD: f64 = 0.04;

/// The viewing conditions: precomputed filters and colour spaces.
struct Viewer {
    colours: Colours,
    /// For each channel, Gaussians with their weights in the sum.
    blurs: [Vec<(f32, Vec<f32>)>; 3],
    /// A Gaussian as wide as the features, and its first and second derivative: their positive weights sum to
    /// 1, their negative ones to −1.
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
    /// The largest colour difference, between green and blue, to the power of [`QC`].
    largest: f32,
}

impl Viewer {
    fn new() -> Viewer {
        let colours = Colours::new();
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| colours.hunt_lab(colours.ycxcz(c)));
        let largest = libm::powf(hyab(green, blue), QC);

        let reach = (3.0 * (WIDEST_SPREAD / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let blurs = SENSITIVITY.map(|lobes| blur(lobes, reach));

        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let reach = (3.0 * deviation).ceil() as i32;
        let gauss = |x: f64| libm::exp(-x * x / (2.0 * deviation * deviation));
        let edge = kernel(reach, |x| -x * gauss(x));
        let point = kernel(reach, |x| (x * x / (deviation * deviation) - 1.0) * gauss(x));
        let smooth = scaled(&kernel(reach, gauss), |sum, _| 1.0 / sum);
        let signed = |values: &[f64]| -> Vec<f32> {
            let sum = |keep: fn(f64) -> bool| values.iter().copied().filter(|&v| keep(v)).sum::<f64>().abs();
            let (up, down) = (sum(|v| v > 0.0), sum(|v| v < 0.0));
            scaled(values, |_, value| 1.0 / if value > 0.0 { up } else { down })
        };
        Viewer { blurs, smooth, edge: signed(&edge), point: signed(&point), largest, colours }
    }

    /// The difference of every pixel of two pictures, 0 to 1.
    fn differences(&self, a: &Picture, b: &Picture) -> Vec<f32> {
        assert_eq!((a.width, a.height), (b.width, b.height), "pictures of one size");
        let [a, b] = [a, b].map(|picture| {
            let opponent: Vec<[f32; 3]> = picture.rgb.iter().map(|&rgb| self.colours.ycxcz(rgb)).collect();
            let planes = [0, 1, 2].map(|channel| Plane {
                width: picture.width as usize,
                values: opponent.iter().map(|colour| colour[channel]).collect(),
            });
            let (edges, points) = self.features(&planes[0]);
            (self.perceived(&planes), edges, points)
        });
        let features = a.1.iter().zip(&b.1).zip(a.2.iter().zip(&b.2));
        let colours = a.0.iter().zip(&b.0);
        colours
            .zip(features)
            .map(|((&a, &b), ((edge_a, edge_b), (point_a, point_b)))| {
                let colour = self.colour_difference(a, b);
                let most = (edge_a - edge_b).abs().max((point_a - point_b).abs());
                let feature = libm::powf(most * std::f32::consts::FRAC_1_SQRT_2, QF);
                libm::powf(colour, 1.0 - feature)
            })
            .collect()
    }

    /// The colours after contrast sensitivity filtering.
    fn perceived(&self, planes: &[Plane; 3]) -> Vec<[f32; 3]> {
        let blurred = [0, 1, 2].map(|channel| {
            let mut sum = vec![0.0f32; planes[channel].values.len()];
            for (weight, kernel) in &self.blurs[channel] {
                let part = convolve(&planes[channel], kernel, kernel);
                sum.iter_mut().zip(&part.values).for_each(|(sum, part)| *sum += weight * part);
            }
            sum
        });
        let [luma, cx, cz] = &blurred;
        luma.iter().zip(cx).zip(cz).map(|((&luma, &cx), &cz)| self.colours.hunt_lab([luma, cx, cz])).collect()
    }

    /// The strength of the edge, and of the point or line, at each pixel.
    fn features(&self, luma: &Plane) -> (Vec<f32>, Vec<f32>) {
        let grey =
            Plane { width: luma.width, values: luma.values.iter().map(|y| (y + 16.0) / 116.0).collect() };
        let [edges, points] = [&self.edge, &self.point].map(|derivative| {
            let across = convolve(&grey, derivative, &self.smooth);
            let down = convolve(&grey, &self.smooth, derivative);
            across.values.iter().zip(&down.values).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        });
        (edges, points)
    }

    /// The difference of two colours, 0 to 1. Small differences, which are the most common, get most of the range.
    fn colour_difference(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let difference = libm::powf(hyab(a, b), QC);
        let knee = PC * self.largest;
        let spread = if difference < knee {
            PT / knee * difference
        } else {
            PT + (difference - knee) / (self.largest - knee) * (1.0 - PT)
        };
        spread.clamp(0.0, 1.0)
    }
}

/// The kernels of one channel's contrast sensitivity. The papers normalise the sum of the two-dimensional
/// Gaussians, so the weight of each is its share of that sum.
fn blur(lobes: &[Lobe], reach: i32) -> Vec<(f32, Vec<f32>)> {
    let parts: Vec<(f64, Vec<f64>)> = lobes
        .iter()
        .map(|lobe| {
            let gauss = |x: f64| {
                let degrees = x / PIXELS_PER_DEGREE;
                libm::exp(-PI * PI * degrees * degrees / lobe.spread)
            };
            let kernel = kernel(reach, gauss);
            let sum: f64 = kernel.iter().sum();
            (lobe.amplitude * (PI / lobe.spread).sqrt() * sum * sum, kernel)
        })
        .collect();
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    parts
        .iter()
        .map(|(weight, kernel)| ((weight / total) as f32, scaled(kernel, |sum, _| 1.0 / sum)))
        .collect()
}

/// A function at the integers from −`reach` to `reach`.
fn kernel(reach: i32, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (-reach..=reach).map(|x| weight(f64::from(x))).collect()
}

/// A kernel times a factor that may depend on its sum and on the value.
fn scaled(kernel: &[f64], factor: impl Fn(f64, f64) -> f64) -> Vec<f32> {
    let sum = kernel.iter().sum();
    kernel.iter().map(|&value| (value * factor(sum, value)) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: u32 = 32;
    const HEIGHT: u32 = 24;

    fn draw(value: impl Fn(u32, u32, u32) -> f32) -> Picture {
        let pixels = (0..WIDTH * HEIGHT).map(|i| (i % WIDTH, i / WIDTH));
        let rgb = pixels.map(|(x, y)| [0, 1, 2].map(|channel| value(x, y, channel))).collect();
        Picture { width: WIDTH, height: HEIGHT, rgb }
    }

    /// Detail in all directions.
    fn pattern(x: u32, y: u32, channel: u32) -> f32 {
        ((x * 3 + y * 5 + channel * 7) % 23) as f32 / 22.0
    }

    /// From black to a warm white.
    fn ramp(x: u32, y: u32, channel: u32) -> f32 {
        (x + y) as f32 / 54.0 * [1.0, 0.8, 0.6][channel as usize]
    }

    /// From black to a warm white, up to well above white.
    fn light(x: u32, y: u32, channel: u32) -> f32 {
        10.0 * ramp(x, y, channel).powi(2) + 0.05
    }

    // The expected values in the next two tests are from the authors' own program (`flip-evaluator` 1.7 from PyPI).
    // On renders of the cover scene with 16 and 64 samples per pixel the two also agree to 1e-5.
    #[test]
    fn ldr_flip_matches_the_reference_program() {
        for (test, expected) in [
            (draw(pattern), 0.615_587),
            (draw(|x, y, c| 0.9 * ramp(x, y, c) + 0.1 * pattern(x, y, c)), 0.141_726),
        ] {
            let found = ldr_flip(&test, &draw(ramp));
            assert!((found - expected).abs() < 1e-4, "{found} is not {expected}");
        }
    }

    #[test]
    fn hdr_flip_matches_the_reference_program() {
        let dim = |x, y, c| 10.0 * ramp(x, y, c).powi(2) + 0.05 * pattern(x, y, c);
        for (test, expected) in [(draw(dim), 0.070_862), (draw(pattern), 0.878_014)] {
            let found = hdr_flip(&test, &draw(light));
            assert!((found.mean - expected).abs() < 1e-4, "{found:?} is not {expected}");
            assert!((found.start + 1.726_776).abs() < 1e-3 && (found.stop - 0.242_693).abs() < 1e-3);
            assert_eq!(found.exposures, 2);
        }
    }

    #[test]
    fn equal_pictures_have_no_difference() {
        for picture in [draw(pattern), draw(light), draw(|_, _, _| 0.0)] {
            assert_eq!(ldr_flip(&picture, &picture), 0.0);
            assert_eq!(hdr_flip(&picture, &picture).mean, 0.0);
        }
    }

    #[test]
    fn ldr_flip_is_symmetric_and_hdr_flip_is_not() {
        let (a, b) = (draw(pattern), draw(ramp));
        assert_eq!(ldr_flip(&a, &b), ldr_flip(&b, &a));
        let (there, back) = (hdr_flip(&a, &draw(light)), hdr_flip(&draw(light), &a));
        assert_ne!((there.start, there.stop), (back.start, back.stop));
    }

    #[test]
    fn flip_grows_with_the_visible_difference() {
        let reference = draw(pattern);
        let brightened = |gain: f32| draw(|x, y, c| pattern(x, y, c) * gain);
        let shifted = draw(|x, y, c| pattern(x + 1, y, c));
        let found = [1.0, 0.98, 0.9, 0.5, 0.0].map(|gain| ldr_flip(&brightened(gain), &reference));
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{found:?}");
        assert!(ldr_flip(&shifted, &reference) > 0.1);
        assert!(found.iter().all(|flip| (0.0..=1.0).contains(flip)));
    }

    #[test]
    fn black_and_white_have_the_largest_difference() {
        let found = ldr_flip(&draw(|_, _, _| 0.0), &draw(|_, _, _| 1.0));
        assert!((0.95..=1.0).contains(&found), "{found}");
    }

    #[test]
    fn the_tone_map_can_be_inverted() {
        for linear in [0.01, 0.3, 1.0, 5.0] {
            assert!((aces_inverse(aces(linear)) - linear).abs() < 1e-9);
        }
        assert_eq!((aces(0.0), aces(1e30)), (0.0, 1.0));
    }

    #[test]
    fn a_reference_that_is_mostly_black_or_tiny_has_finite_exposures() {
        let spot = draw(|x, y, _| if x == 3 && y == 4 { 1e4 } else { 0.0 });
        let found = hdr_flip(&draw(ramp), &spot);
        assert!(found.mean.is_finite() && found.start.is_finite() && found.stop.is_finite(), "{found:?}");
        let dot = |value| Picture { width: 1, height: 1, rgb: vec![[value; 3]] };
        assert!(hdr_flip(&dot(-1.0), &dot(0.5)).mean > 0.0);
    }
}
