//! Welch's t-test of whether two estimators have the same mean everywhere on the film, tile by tile.
//!
//! An image is rendered at least 16 times on each side, each time with another seed, and averaged over tiles of 8 × 8
//! pixels. The spread of a tile over the replicates is its noise for any sampler: within a pixel, the samples of a
//! low-discrepancy sampler are no measure of its error. A tile holds thousands of paths, so its mean is close to
//! normal, and Welch's t (1947) has Student's distribution.
//!
//! There are two criteria, both at [`LEVEL`] together with all others of the same test: no tile differs significantly,
//! and the p-values of all tiles are uniform (Kolmogorov–Smirnov). The p-values are one-sided, so that a small error of
//! one sign in all tiles is detected.

use super::statistics::{sidak, student, uniformity};
use std::fmt;

/// The probability that any comparison of a test rejects two estimators of the same mean.
pub const LEVEL: f64 = 0.01;

const SIDE: u32 = 8;
const LEAST_REPLICATES: usize = 16;

/// The means of tiles in each replicate, summed over channels: these share their paths and are not independent.
pub struct Replicates(Vec<Vec<f64>>);

impl Replicates {
    /// Replicates of an image of `width` × `height` pixels. `make` makes the replicate with a given number: it returns
    /// the sum of the `samples` of each pixel, in parts and in any order.
    pub fn of(
        [width, height]: [u32; 2],
        samples: u32,
        mut make: impl FnMut(u32, &mut dyn FnMut(u32, [f64; 3])),
    ) -> Replicates {
        assert!(width.is_multiple_of(SIDE) && height.is_multiple_of(SIDE), "tiles are whole");
        let columns = width / SIDE;
        let scale = 1.0 / f64::from(SIDE * SIDE * samples);
        let mut picture = |replicate: u32| {
            let mut tiles = vec![0.0; (columns * height / SIDE) as usize];
            make(replicate, &mut |pixel, radiance| {
                let (x, y) = (pixel % width, pixel / width);
                tiles[(y / SIDE * columns + x / SIDE) as usize] += radiance.iter().sum::<f64>() * scale;
            });
            tiles
        };
        Replicates((0..LEAST_REPLICATES as u32).map(&mut picture).collect())
    }

    /// Each tile's mean, and the variance of that mean.
    fn moments(&self) -> Vec<[f64; 2]> {
        let n = self.0.len() as f64;
        assert!(self.0.len() >= LEAST_REPLICATES, "too few replicates to estimate their variance");
        (0..self.0[0].len())
            .map(|tile| {
                let mean = self.0.iter().map(|r| r[tile]).sum::<f64>() / n;
                let squares: f64 = self.0.iter().map(|r| (r[tile] - mean) * (r[tile] - mean)).sum();
                [mean, squares / (n - 1.0) / n]
            })
            .collect()
    }

    /// The mean over all tiles.
    pub fn mean(&self) -> f64 {
        let moments = self.moments();
        moments.iter().map(|m| m[0]).sum::<f64>() / moments.len() as f64
    }
}

/// Two means without any noise are equal if they differ only by rounding.
const ROUNDING: f64 = 1e-5;

/// The result of a comparison.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The smallest two-sided p-value of a tile.
    pub least: f64,
    /// The p-value of the uniformity of all.
    pub uniformity: f64,
    /// The number of tiles with noise.
    pub tiles: usize,
}

impl Verdict {
    /// Whether the means may be equal, as one of `comparisons`.
    pub fn agrees(&self, comparisons: usize) -> bool {
        let level = sidak(LEVEL, 2 * comparisons);
        self.least > sidak(level, self.tiles) && self.uniformity > level
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "least p {:.2e} of {} tiles, uniform with p {:.2e}",
            self.least, self.tiles, self.uniformity
        )
    }
}

/// Compares two estimators, whose seeds must differ. If neither has any noise, they must agree up to rounding.
pub fn welch(a: &Replicates, b: &Replicates) -> Verdict {
    let (n, m) = (a.0.len() as f64, b.0.len() as f64);
    let mut p = Vec::new();
    for ([mean_a, var_a], [mean_b, var_b]) in a.moments().into_iter().zip(b.moments()) {
        let variance = var_a + var_b;
        let rounding = ROUNDING * mean_a.abs().max(mean_b.abs());
        if variance.sqrt() > rounding {
            let degrees = variance * variance / (var_a * var_a / (n - 1.0) + var_b * var_b / (m - 1.0));
            p.push(student((mean_a - mean_b) / variance.sqrt(), degrees));
        } else if (mean_a - mean_b).abs() > rounding {
            return Verdict { least: 0.0, uniformity: 0.0, tiles: 1 };
        }
    }
    let least = p.iter().map(|p| 2.0 * p.min(1.0 - p)).fold(1.0, f64::min);
    let uniformity = if p.is_empty() { 1.0 } else { uniformity(&p) };
    Verdict { least, uniformity, tiles: p.len() }
}
