//! Comparison of two images by the means of blocks.
//!
//! Single pixels are too noisy and entire images hide errors that cancel, so images are compared block by block and
//! channel by channel. If both images are estimates of the same radiance, the difference of two block means over its
//! standard deviation is a standard normal variable z, as a block holds thousands of samples of bounded radiance. The
//! test uses the largest |z| and the bound that all of them exceed with the probability [`ERROR_LEVEL`] (Šidák 1967;
//! the channels of a block are dependent, which makes the true level smaller).

use std::fmt;

/// The side of a block in pixels.
pub const SIDE: u32 = 8;

/// The probability that two estimates of the same image are rejected.
pub const ERROR_LEVEL: f64 = 1e-4;

/// The sums of a pixel's samples, and of their squares.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: u64,
    sum: [f64; 3],
    squares: [f64; 3],
}

/// An image with a noise estimate. Samples must be independent; those of a stratified sampler are not, but images with
/// different seeds are: add such images as samples.
pub struct Estimate {
    width: u32,
    height: u32,
    pixels: Vec<Moments>,
}

impl Estimate {
    pub fn new(width: u32, height: u32) -> Estimate {
        Estimate { width, height, pixels: vec![Moments::default(); (width * height) as usize] }
    }

    pub fn add(&mut self, pixel: usize, radiance: [f32; 3]) {
        let moments = &mut self.pixels[pixel];
        moments.count += 1;
        for (channel, x) in radiance.map(f64::from).into_iter().enumerate() {
            moments.sum[channel] += x;
            moments.squares[channel] += x * x;
        }
    }

    /// The mean of the whole image.
    pub fn mean(&self) -> [f64; 3] {
        self.blocks_of(self.width.max(self.height)).mean[0]
    }

    /// Means and noise in blocks of 8 × 8 pixels.
    pub fn blocks(&self) -> Blocks {
        self.blocks_of(SIDE)
    }

    fn blocks_of(&self, side: u32) -> Blocks {
        let mut blocks = Blocks::empty(self.width, self.height, side);
        for (index, m) in self.pixels.iter().enumerate() {
            assert!(m.count >= 2, "pixel {index} has {} samples: too few to estimate its noise", m.count);
            let n = m.count as f64;
            blocks.add(index, [0, 1, 2].map(|c| m.sum[c] / n), |c| {
                (m.squares[c] - m.sum[c] * m.sum[c] / n).max(0.0) / ((n - 1.0) * n)
            });
        }
        blocks.finish()
    }
}

/// An image of an independent renderer.
pub struct Reference {
    pub width: u32,
    pub height: u32,
    pub rgb: Vec<[f64; 3]>,
    pub noise: Noise,
}

/// The noise of a [`Reference`].
pub enum Noise {
    /// The standard error of each pixel, independent of that of other pixels.
    Measured(Vec<[f64; 3]>),
    /// Only the number of samples per pixel is known.
    Samples(u32),
}

impl Reference {
    /// Its blocks. If its noise is unknown, it is that of as many independent samples as those of `like`: an upper bound
    /// if the reference was made by a better method. A filter whose weights sum to one shares samples between
    /// neighbours, which does not increase the noise of a block.
    pub fn blocks(&self, like: &Estimate) -> Blocks {
        let mut blocks = Blocks::empty(self.width, self.height, SIDE);
        for (index, (rgb, m)) in self.rgb.iter().zip(&like.pixels).enumerate() {
            let n = m.count as f64;
            blocks.add(index, *rgb, |c| match &self.noise {
                Noise::Measured(errors) => errors[index][c] * errors[index][c],
                Noise::Samples(spp) => {
                    (m.squares[c] - m.sum[c] * m.sum[c] / n).max(0.0) / ((n - 1.0) * f64::from(*spp))
                }
            });
        }
        blocks.finish()
    }

    /// The mean of the whole image.
    pub fn mean(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| self.rgb.iter().map(|p| p[c]).sum::<f64>() / self.rgb.len() as f64)
    }
}

/// Block means, and the variances of these means.
pub struct Blocks {
    width: u32,
    side: u32,
    columns: u32,
    pixels: Vec<u32>,
    pub mean: Vec<[f64; 3]>,
    pub variance: Vec<[f64; 3]>,
}

impl Blocks {
    fn empty(width: u32, height: u32, side: u32) -> Blocks {
        let columns = width.div_ceil(side);
        let len = (columns * height.div_ceil(side)) as usize;
        let (mean, variance) = (vec![[0.0; 3]; len], vec![[0.0; 3]; len]);
        Blocks { width, side, columns, pixels: vec![0; len], mean, variance }
    }

    fn add(&mut self, pixel: usize, mean: [f64; 3], variance: impl Fn(usize) -> f64) {
        let (x, y) = (pixel as u32 % self.width, pixel as u32 / self.width);
        let block = (y / self.side * self.columns + x / self.side) as usize;
        self.pixels[block] += 1;
        for (c, mean) in mean.into_iter().enumerate() {
            self.mean[block][c] += mean;
            self.variance[block][c] += variance(c);
        }
    }

    fn finish(mut self) -> Blocks {
        for (block, &pixels) in self.pixels.iter().enumerate() {
            let n = f64::from(pixels);
            for c in 0..3 {
                self.mean[block][c] /= n;
                self.variance[block][c] /= n * n;
            }
        }
        self
    }
}

/// The result of a comparison.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The largest |z|.
    pub worst: f64,
    /// Its block, as column and row, and its channel.
    pub at: (u32, u32, usize),
    /// The bound for the largest |z| of equal images.
    pub bound: f64,
    /// The number of z.
    pub tests: usize,
    /// The root mean square of all z: one for equal images.
    pub rms: f64,
}

impl Verdict {
    /// Whether the images may be equal.
    pub fn agrees(&self) -> bool {
        self.worst <= self.bound
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (column, row, channel) = self.at;
        write!(
            f,
            "largest |z| {:.2} of {} in block ({column}, {row}) channel {channel}, bound {:.2}, rms {:.3}",
            self.worst, self.tests, self.bound, self.rms
        )
    }
}

/// Compares two images with independent noise.
pub fn compare(a: &Blocks, b: &Blocks) -> Verdict {
    assert_eq!((a.columns, a.mean.len()), (b.columns, b.mean.len()), "pictures of different sizes");
    let (mut worst, mut at, mut squares) = (0.0, (0, 0, 0), 0.0);
    let tests = a.mean.len() * 3;
    for block in 0..a.mean.len() {
        for c in 0..3 {
            let difference = a.mean[block][c] - b.mean[block][c];
            let variance = a.variance[block][c] + b.variance[block][c];
            // Radiance without noise may differ only by rounding.
            let z = difference.abs() / variance.sqrt().max(1e-6 * a.mean[block][c].abs()).max(1e-30);
            squares += z * z;
            // NaN counts as an infinite difference.
            if z > worst || z.is_nan() {
                worst = if z.is_nan() { f64::INFINITY } else { z };
                at = (block as u32 % a.columns, block as u32 / a.columns, c);
            }
        }
    }
    Verdict { worst, at, bound: sidak_bound(tests), tests, rms: (squares / tests as f64).sqrt() }
}

/// The bound that the largest of `tests` independent |z| exceeds with probability [`ERROR_LEVEL`].
fn sidak_bound(tests: usize) -> f64 {
    let single = -libm::expm1(libm::log1p(-ERROR_LEVEL) / tests as f64);
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let z: f64 = (low + high) / 2.0;
        if libm::erfc(z / std::f64::consts::SQRT_2) > single { low = z } else { high = z }
    }
    high
}
