//! Pearson's χ² test of directions against their density.
//!
//! 10⁶ directions are counted in 80 × 160 bins of (cos θ, φ), all of equal solid angle. The bins cover the bounding box
//! of the directions, so that a light as small as a star is resolved as finely as the sky. Each test is made twice. A
//! narrow error is significant in the fine bins. A smooth deviation is significant in 8 × 16 bins, which it changes by
//! many times their noise.
//!
//! Expected counts integrate the density over each bin by 16 × 16 stratified points. For a density that is smooth in
//! the bin, their error is that of a rule of second order with steps of a 16th of the bin. If an outline crosses the
//! bin, only the strata on it, about 16 of 256, are uncertain, each by half at most and at random. This is about 1% of
//! a count of 78, a tenth of its own noise.
//!
//! χ² compares shapes: the fine bins hardly detect a density that is too high everywhere by 2%. But every sampled
//! direction is somewhere, so that the density must integrate to exactly one, which is checked separately.

use super::statistics::{chi_square_tail, sidak};
use glam::DVec3;
use std::f64::consts::TAU;
use stride::math::Vec3;
use stride::math::lanes::scalar::Wrapping;
use stride::sampling::{Independent, PathId};

const ROWS: usize = 80;
const COLUMNS: usize = 160;
/// The number of fine bins per coarse one, along each axis.
const COARSE: usize = 10;
const DRAWS: u32 = 1_000_000;
/// The number of strata of the integration over a bin, along each axis.
const STRATA: u32 = 16;
/// Smaller counts are not normal enough for χ².
const LEAST_EXPECTED: f64 = 5.0;
/// The probability that any of the tests of a kind rejects a correct density.
const LEVEL: f64 = 0.01;
/// The tolerance for the integral of a density: ten times the error of the integration.
const MASS_TOLERANCE: f64 = 1e-3;

/// Four independent numbers in [0, 1).
pub fn draw(seed: u32, index: u32) -> [f32; 4] {
    let path = PathId { pixel: Wrapping(index), sample: Wrapping(0) };
    Independent { seed }.draw::<f32>(path, Wrapping(0))
}

pub fn wide(v: Vec3<f32>) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

pub fn narrow(v: DVec3) -> Vec3<f32> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

/// The coordinates of the bins: 1 − cos θ, which keeps its digits in a narrow cone, and φ.
#[derive(Clone, Copy)]
pub struct Polar {
    s: DVec3,
    t: DVec3,
    axis: DVec3,
}

impl Polar {
    /// Around an axis; φ is half a turn towards `middle`, so that directions around it are not divided.
    pub fn new(axis: DVec3, middle: DVec3) -> Polar {
        let axis = axis.normalize();
        let across = middle.reject_from_normalized(axis);
        let s = if across.length() > 1e-6 { -across.normalize() } else { axis.any_orthonormal_vector() };
        Polar { s, t: axis.cross(s), axis }
    }

    fn of(&self, w: DVec3) -> [f64; 2] {
        let (x, y, z) = (w.dot(self.s), w.dot(self.t), w.dot(self.axis));
        let versine = if z > 0.0 { (x * x + y * y) / (1.0 + z) } else { 1.0 - z };
        [versine, libm::atan2(y, x).rem_euclid(TAU)]
    }

    fn direction(&self, [versine, phi]: [f64; 2]) -> DVec3 {
        let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
        self.axis * (1.0 - versine) + (self.s * phi.cos() + self.t * phi.sin()) * sin
    }
}

/// A χ² statistic.
#[derive(Clone, Copy, Debug)]
pub struct Pearson {
    pub chi2: f64,
    pub degrees: usize,
    /// The probability of the same value or a larger one under the density.
    pub p: f64,
}

/// The result of a comparison of directions with a density.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    pub fine: Pearson,
    pub coarse: Pearson,
    /// The integral of the density over the box of the directions, and the fraction of draws without a direction.
    pub mass: f64,
    /// The standard deviation of that fraction.
    pub noise: f64,
}

impl Outcome {
    /// Whether the directions may follow the density, as one of `tests` comparisons.
    pub fn agrees(&self, tests: usize) -> bool {
        let level = sidak(LEVEL, 2 * tests);
        self.fine.p > level
            && self.coarse.p > level
            && (self.mass - 1.0).abs() < MASS_TOLERANCE + 5.0 * self.noise
    }
}

/// Compares directions made from four numbers with their density by solid angle.
pub fn compare(
    polar: Polar,
    seed: u32,
    sample: impl Fn([f32; 4]) -> Vec3<f32>,
    pdf: impl Fn(Vec3<f32>) -> f32,
) -> Outcome {
    compare_some(polar, seed, |u| Some(sample(u)), pdf)
}

/// The same for directions that may be absent.
pub fn compare_some(
    polar: Polar,
    seed: u32,
    sample: impl Fn([f32; 4]) -> Option<Vec3<f32>>,
    pdf: impl Fn(Vec3<f32>) -> f32,
) -> Outcome {
    let places: Vec<[f64; 2]> = (0..DRAWS)
        .filter_map(|i| {
            let w = wide(sample(draw(seed, i))?);
            assert!((w.length() - 1.0).abs() < 1e-5, "{w} is no direction");
            Some(polar.of(w.normalize()))
        })
        .collect();
    let lost = 1.0 - places.len() as f64 / f64::from(DRAWS);
    let extent = |axis: usize, most: f64| {
        let range =
            places.iter().fold([f64::INFINITY, 0.0], |[lo, hi], p| [p[axis].min(lo), p[axis].max(hi)]);
        // A small margin for points between the outermost directions and the outline.
        let room = 1e-3 * (range[1] - range[0]);
        [(range[0] - room).max(0.0), (range[1] + room).min(most)]
    };
    let range = [extent(0, 2.0), extent(1, TAU)];
    let step = [(range[0][1] - range[0][0]) / ROWS as f64, (range[1][1] - range[1][0]) / COLUMNS as f64];

    let mut seen = vec![0.0; ROWS * COLUMNS];
    for place in &places {
        let bin =
            |axis: usize, bins: usize| (((place[axis] - range[axis][0]) / step[axis]) as usize).min(bins - 1);
        seen[bin(0, ROWS) * COLUMNS + bin(1, COLUMNS)] += 1.0;
    }
    let expected: Vec<f64> = (0..ROWS * COLUMNS)
        .map(|bin| {
            let mut sum = 0.0;
            for stratum in 0..STRATA * STRATA {
                let [a, b, ..] = draw(seed.wrapping_add(1), bin as u32 * STRATA * STRATA + stratum);
                let at = |index: usize, stratum: u32, u: f32, axis: usize| {
                    let within = (f64::from(stratum) + f64::from(u)) / f64::from(STRATA);
                    range[axis][0] + (index as f64 + within) * step[axis]
                };
                let place =
                    [at(bin / COLUMNS, stratum / STRATA, a, 0), at(bin % COLUMNS, stratum % STRATA, b, 1)];
                sum += f64::from(pdf(narrow(polar.direction(place))));
            }
            f64::from(DRAWS) * sum / f64::from(STRATA * STRATA) * step[0] * step[1]
        })
        .collect();
    let mass = expected.iter().sum::<f64>() / f64::from(DRAWS) + lost;
    let noise = (lost * (1.0 - lost) / f64::from(DRAWS)).sqrt();
    let (fine, coarse) = (pearson(&seen, &expected), pearson(&coarse(&seen), &coarse(&expected)));
    Outcome { fine, coarse, mass, noise }
}

/// The same counts in bins ten times as large along each axis.
fn coarse(bins: &[f64]) -> Vec<f64> {
    let columns = COLUMNS / COARSE;
    let mut sums = vec![0.0; ROWS / COARSE * columns];
    for (bin, count) in bins.iter().enumerate() {
        sums[bin / COLUMNS / COARSE * columns + bin % COLUMNS / COARSE] += count;
    }
    sums
}

/// Pearson's statistic. Bins with too small an expectation are merged into one.
pub fn pearson(seen: &[f64], expected: &[f64]) -> Pearson {
    let (mut cells, mut rest) = (Vec::new(), [0.0; 2]);
    for (&seen, &expected) in seen.iter().zip(expected) {
        if expected >= LEAST_EXPECTED {
            cells.push([seen, expected]);
        } else {
            rest = [rest[0] + seen, rest[1] + expected];
        }
    }
    // If its count is still too small, it is merged with the bin of the smallest expected count, where it has the
    // largest weight.
    let least = (0..cells.len()).min_by(|&a, &b| cells[a][1].total_cmp(&cells[b][1]));
    match least {
        Some(least) if rest[1] < LEAST_EXPECTED => {
            cells[least] = [cells[least][0] + rest[0], cells[least][1] + rest[1]];
        }
        _ => cells.push(rest),
    }
    let chi2 = cells.iter().map(|[seen, expected]| (seen - expected) * (seen - expected) / expected).sum();
    let degrees = cells.len() - 1;
    Pearson { chi2, degrees, p: if degrees == 0 { 0.0 } else { chi_square_tail(chi2, degrees) } }
}
