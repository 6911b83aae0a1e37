//! Exact sums.
//!
//! Each sample is rounded once, to a multiple of the [`QUANTUM`], and from then on everything is integer
//! addition. Integers commute, so the picture does not depend on the order in which samples arrive, and
//! films of disjoint samples merge exactly.

use super::fixed::{QUANTUM, SCALE, WEIGHT_BITS, round_small};
use super::layer_sums::LayerSums;
use super::layout::BYTES_PER_PIXEL;
use super::light_image::LightPixel;
use super::reject::{Reject, check};
use super::spread::SpreadPixel;
use super::{Layout, Picture};
use serde::{Deserialize, Serialize};

/// The largest radiance that [`PixelSums`] accept; brighter samples are sent singly.
pub const MAX_SUMMED: f32 = 1024.0;

/// The most samples that may be added to one [`PixelSums`]: each adds less than 2⁵⁴ to its largest word.
pub const MAX_COUNT: u32 = 512;

/// The squared radiance in sums, r² + g² + b², scaled and rounded half up to an integer: at
/// most 2⁵⁴ for a radiance that [`fits`], 2⁹⁴ for any that a film accepts.
#[inline(always)]
fn scaled_square([r, g, b]: [f32; 3]) -> f64 {
    let [r, g, b] = [f64::from(r), f64::from(g), f64::from(b)];
    (r * r + g * g + b * b) * SCALE + 0.5
}

/// Sums of a few samples of one pixel, sent in a batch: 64-bit words, because their additions are cheap. At most
/// [`MAX_COUNT`] samples of at most [`MAX_SUMMED`] fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PixelSums {
    /// Radiance, in multiples of the quantum.
    pub rgb: [i64; 3],
    /// Sum of squared radiance, in multiples of 2⁻³².
    pub squares: i64,
    /// Samples added.
    pub count: u32,
    /// Samples rejected.
    pub rejected: u32,
}

impl PixelSums {
    /// Adds a sample that [`fits`].
    #[inline(always)]
    pub fn add(&mut self, radiance: [f32; 3]) {
        for (sum, c) in self.rgb.iter_mut().zip(radiance) {
            *sum += round_small(f64::from(c) * SCALE);
        }
        self.squares += scaled_square(radiance) as i64;
        self.count += 1;
    }
}

/// Sums of one pixel that exceed the 64-bit words of [`PixelSums`], from a worker that sums all samples itself. Their
/// counts are in the [`PixelSums`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct WideSums {
    /// Radiance, in multiples of the quantum: less than 2⁹⁵.
    pub rgb: [i128; 3],
    /// Sum of squared radiance, in multiples of 2⁻³².
    pub squares: u128,
}

/// Whether a radiance fits into [`PixelSums`].
#[inline(always)]
pub fn fits([r, g, b]: [f32; 3]) -> bool {
    let fits = |c: f32| (0.0..=MAX_SUMMED).contains(&c);
    fits(r) & fits(g) & fits(b)
}

/// One pixel of a film: 64 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub(super) struct FilmPixel {
    /// Low 64 bits of the radiance sums, in two's complement.
    rgb_low: [u64; 3],
    /// Sum of squares, low and high word. If samples have weights, the sum of weights, in two's complement.
    squares: [u64; 2],
    pub(super) count: u64,
    /// High 32 bits of the radiance sums.
    rgb_high: [i32; 3],
    pub(super) rejected: u32,
}

impl FilmPixel {
    #[inline(always)]
    pub(super) fn add_radiance(&mut self, channel: usize, value: i64) {
        let (low, carry) = self.rgb_low[channel].overflowing_add(value as u64);
        self.rgb_low[channel] = low;
        self.rgb_high[channel] += (value >> 63) as i32 + i32::from(carry);
    }

    #[inline(always)]
    fn add_square(&mut self, value: u128) {
        let [low, high] = self.squares;
        let sum = (u128::from(high) << 64 | u128::from(low)) + value;
        self.squares = [sum as u64, (sum >> 64) as u64];
    }

    /// Adds a weight, in multiples of 2^−[`WEIGHT_BITS`].
    #[inline(always)]
    pub(super) fn add_weight(&mut self, weight: i64) {
        let [low, high] = self.squares;
        let (low, carry) = low.overflowing_add(weight as u64);
        let sign = (weight >> 63) as u64;
        self.squares = [low, high.wrapping_add(sign).wrapping_add(u64::from(carry))];
    }

    /// The sums of radiance, and of squares or weights, as integers.
    #[cfg(test)]
    pub(super) fn words(&self) -> ([i128; 3], i128) {
        let [low, high] = self.squares;
        ([0, 1, 2].map(|c| self.radiance_words(c)), i128::from(high as i64) << 64 | i128::from(low))
    }

    /// The sum of weights.
    fn weight(&self) -> f64 {
        let [low, high] = self.squares;
        (i128::from(high as i64) << 64 | i128::from(low)) as f64 * (1.0 / (1_u64 << WEIGHT_BITS) as f64)
    }

    pub(super) fn seen(&self) -> u64 {
        self.count.saturating_add(u64::from(self.rejected))
    }

    /// The words in the format of a film file: in the order of the fields, little-endian.
    fn to_bytes(self) -> [u8; 64] {
        let mut bytes = [0; 64];
        let [a, b, c] = self.rgb_low;
        let [low, high] = self.squares;
        for (to, word) in bytes.chunks_exact_mut(8).zip([a, b, c, low, high, self.count]) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        let [a, b, c] = self.rgb_high;
        for (to, word) in bytes[48..].chunks_exact_mut(4).zip([a as u32, b as u32, c as u32, self.rejected]) {
            to.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    fn from_bytes(bytes: &[u8; 64]) -> FilmPixel {
        let (longs, _) = bytes[..48].as_chunks();
        let (shorts, _) = bytes[48..].as_chunks();
        let long = |i: usize| u64::from_le_bytes(longs[i]);
        let short = |i: usize| u32::from_le_bytes(shorts[i]);
        FilmPixel {
            rgb_low: [0, 1, 2].map(long),
            squares: [long(3), long(4)],
            count: long(5),
            rgb_high: [0, 1, 2].map(|i| short(i) as i32),
            rejected: short(3),
        }
    }

    /// Adds the words of another film's pixel. Overflow wraps: such words are not sums of samples.
    fn merge(&mut self, other: &FilmPixel) {
        for channel in 0..3 {
            let sum = self.radiance_words(channel).wrapping_add(other.radiance_words(channel));
            (self.rgb_low[channel], self.rgb_high[channel]) = (sum as u64, (sum >> 64) as i32);
        }
        let words = |[low, high]: [u64; 2]| u128::from(high) << 64 | u128::from(low);
        let squares = words(self.squares).wrapping_add(words(other.squares));
        self.squares = [squares as u64, (squares >> 64) as u64];
        self.count = self.count.wrapping_add(other.count);
        self.rejected = self.rejected.wrapping_add(other.rejected);
    }

    fn radiance_words(&self, channel: usize) -> i128 {
        i128::from(self.rgb_high[channel]) << 64 | i128::from(self.rgb_low[channel])
    }

    fn radiance_sum(&self, channel: usize) -> f64 {
        self.radiance_words(channel) as f64 * QUANTUM
    }
}

/// There is not enough memory for a film.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error(
    "a film of {width}×{height} pixels needs {} of memory, but {}; render a smaller picture (`size`) or a part of it (`crop`)",
    human_bytes(*.needed),
    match .available { Some(bytes) => format!("only {} is free", human_bytes(*bytes)), None => "it could not be allocated".to_owned() }
)]
pub struct MemoryError {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes needed.
    pub needed: u64,
    /// Free bytes, if the system reports them.
    pub available: Option<u64>,
}

fn human_bytes(bytes: u64) -> String {
    match bytes {
        0..=999_999 => format!("{} kB", bytes.div_ceil(1000)),
        1_000_000..=999_999_999 => format!("{} MB", bytes.div_ceil(1_000_000)),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Free memory in bytes, if the system reports it.
fn available_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// A vector of default values; `None` if there is not enough memory.
fn reserved<T: Clone + Default>(len: usize) -> Option<Vec<T>> {
    let mut entries = Vec::new();
    entries.try_reserve_exact(len).ok()?;
    entries.resize(len, T::default());
    Some(entries)
}

/// Exact sums for every pixel of a rectangle, row-major from the top left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    layout: Layout,
    pub(super) pixels: Vec<FilmPixel>,
    /// The extra sums for a variance, one entry per pixel if the layout has them.
    pub(super) spreads: Vec<SpreadPixel>,
    /// The light image, one entry per pixel if the layout has one.
    pub(super) light: Vec<LightPixel>,
    /// Sums of first hits, one entry per pixel if the layout has layers.
    first_hits: LayerSums,
}

const _: () = assert!(size_of::<FilmPixel>() as u64 == BYTES_PER_PIXEL);

impl Film {
    /// Bytes that a render of such a film needs: the sums, a picture of them, and the owner of each pixel.
    pub fn memory(layout: &Layout) -> u64 {
        layout.len() * (layout.pixel_bytes() + 12 + 4)
    }

    /// An empty film of unweighted samples.
    pub fn new(width: u32, height: u32) -> Result<Film, MemoryError> {
        Film::with_layout(Layout::plain(width, height))
    }

    /// An empty film; fails if there is not enough memory for it and its pictures.
    pub fn with_layout(layout: Layout) -> Result<Film, MemoryError> {
        let Layout { width, height, .. } = layout;
        let needed = Film::memory(&layout);
        let available = available_memory();
        let error = MemoryError { width, height, needed, available };
        if available.is_some_and(|available| needed > available) {
            return Err(error);
        }
        let len = usize::try_from(u64::from(width) * u64::from(height)).map_err(|_| error.clone())?;
        let pixels = reserved(len).ok_or_else(|| error.clone())?;
        let spreads = reserved(if layout.spreads { len } else { 0 }).ok_or_else(|| error.clone())?;
        let light = reserved(if layout.light.is_some() { len } else { 0 }).ok_or_else(|| error.clone())?;
        let words = reserved(len * layout.layers.words_of_pixel()).ok_or(error)?;
        let first_hits = LayerSums::of_words(layout.layers, words);
        Ok(Film { layout, pixels, spreads, light, first_hits })
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.layout.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.layout.height
    }

    /// The size of the film, and the kinds of its sums.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Adds a batch's sums to a pixel.
    #[inline(always)]
    pub fn add_sums(&mut self, pixel: usize, sums: &PixelSums) {
        let to = &mut self.pixels[pixel];
        for (channel, &value) in sums.rgb.iter().enumerate() {
            to.add_radiance(channel, value);
        }
        to.add_square(sums.squares as u128);
        to.count += u64::from(sums.count);
        to.rejected += sums.rejected;
    }

    /// Adds sums of more than 64 bits to a pixel.
    pub fn add_wide(&mut self, pixel: usize, sums: &WideSums) {
        let to = &mut self.pixels[pixel];
        for (channel, value) in sums.rgb.into_iter().enumerate() {
            let sum = to.radiance_words(channel) + value;
            (to.rgb_low[channel], to.rgb_high[channel]) = (sum as u64, (sum >> 64) as i32);
        }
        to.add_square(sums.squares);
    }

    /// Adds one sample, or counts it as rejected.
    pub fn add_sample(&mut self, pixel: usize, radiance: [f32; 3]) -> Result<(), Reject> {
        let to = &mut self.pixels[pixel];
        if let Err(reject) = check(radiance) {
            to.rejected += 1;
            return Err(reject);
        }
        for (channel, c) in radiance.into_iter().enumerate() {
            // At most 2⁶², and above 2⁵¹ already an integer.
            let scaled = f64::from(c) * SCALE;
            let rounded = if scaled < 1e15 { round_small(scaled) } else { scaled as i64 };
            to.add_radiance(channel, rounded);
        }
        to.add_square(scaled_square(radiance) as u128);
        to.count += 1;
        Ok(())
    }

    /// The sums of first hits, for layers.
    pub fn first_hits(&self) -> &LayerSums {
        &self.first_hits
    }

    /// Adds the first hits of pixel `other` of `sums` to those of a pixel; both have sums of the same layers.
    pub fn add_first_hits(&mut self, pixel: usize, sums: &LayerSums, other: usize) {
        self.first_hits.merge(pixel, sums, other);
    }

    /// Samples in a pixel.
    pub fn count(&self, pixel: usize) -> u64 {
        self.pixels[pixel].count
    }

    /// Samples made for a pixel, rejected ones included.
    pub fn seen(&self, pixel: usize) -> u64 {
        self.pixels[pixel].seen()
    }

    /// The minimum and the maximum number of samples made for a pixel.
    pub fn seen_range(&self) -> [u64; 2] {
        let seen = self.pixels.iter().map(FilmPixel::seen);
        seen.fold([u64::MAX, 0], |[least, most], seen| [least.min(seen), most.max(seen)])
    }

    /// The words of some pixels in the format of a film file: [`Layout::pixel_bytes`] each.
    pub fn bytes(&self, pixels: std::ops::Range<usize>) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(pixels.len() * self.layout.pixel_bytes() as usize);
        for pixel in pixels {
            bytes.extend(self.pixels[pixel].to_bytes());
            bytes.extend(self.spreads.get(pixel).into_iter().flat_map(|spread| spread.to_bytes()));
            bytes.extend(self.light.get(pixel).into_iter().flat_map(|light| light.to_bytes()));
            if !self.layout.layers.is_empty() {
                bytes.extend(self.first_hits.pixel_bytes(pixel));
            }
        }
        bytes
    }

    /// Adds the words of another film's pixels in the format of a film file, from the pixel `first` on. The other film
    /// has all sums of this one. Calls `check` for each pixel with the number of samples made for it and, if there are
    /// layers, with bit masks of the samples whose first hit was traced and of those that met a surface.
    pub(super) fn add_bytes(
        &mut self,
        first: usize,
        bytes: &[u8],
        other: &Layout,
        mut check: impl FnMut(u64, Option<[u32; 2]>),
    ) {
        for (place, bytes) in (first..).zip(bytes.chunks_exact(other.pixel_bytes() as usize)) {
            let (parts, _) = bytes.as_chunks();
            let pixel = FilmPixel::from_bytes(&parts[0]);
            self.pixels[place].merge(&pixel);
            if self.layout.spreads {
                self.spreads[place].merge(&SpreadPixel::from_bytes(&parts[1]));
            }
            if self.layout.light.is_some() {
                let light = 1 + usize::from(other.spreads);
                self.light[place].merge(&LightPixel::from_bytes(&parts[light]));
            }
            let before = (other.pixel_bytes() - other.layers.pixel_bytes()) as usize;
            let has_layers = !self.layout.layers.is_empty();
            let samples = has_layers.then(|| self.first_hits.add_bytes(place, &bytes[before..]));
            check(pixel.seen(), samples);
        }
    }

    /// Rejected samples and contributions, over all pixels.
    pub fn rejected(&self) -> u64 {
        let [contributions, _] = self.lost_contributions();
        self.pixels.iter().map(|p| u64::from(p.rejected)).sum::<u64>().saturating_add(contributions)
    }

    /// Whether [`Film::variance`] is an estimate. The variance of a light image is unknown.
    pub fn has_variance(&self) -> bool {
        !self.layout.lacks_variance()
    }

    /// Mean radiance of the samples of a pixel, without the light image; black without samples, and if the sum of
    /// weights is not positive.
    pub fn mean(&self, pixel: usize) -> [f32; 3] {
        self.mean_of_samples(pixel).map(|c| c as f32)
    }

    fn mean_of_samples(&self, pixel: usize) -> [f64; 3] {
        let from = &self.pixels[pixel];
        let by = if self.layout.weighted { from.weight() } else { from.count as f64 };
        [0, 1, 2].map(|channel| if by > 0.0 { from.radiance_sum(channel) / by } else { 0.0 })
    }

    /// The estimated variance of a pixel's mean radiance, summed over its channels: correct for independent samples,
    /// too large for low-discrepancy ones. Zero with fewer than two samples, and for weighted samples without the extra
    /// sums for a variance.
    pub fn variance(&self, pixel: usize) -> f64 {
        let from = &self.pixels[pixel];
        if self.layout.weighted {
            let weight = from.weight();
            let mean = [0, 1, 2].map(|channel| from.radiance_sum(channel) / weight);
            return self.spreads.get(pixel).map_or(0.0, |spread| spread.variance(mean, weight));
        }
        if from.count < 2 {
            return 0.0;
        }
        let [low, high] = from.squares;
        let (count, squares) = (from.count as f64, (u128::from(high) << 64 | u128::from(low)) as f64 / SCALE);
        let mean = [0, 1, 2].map(|channel| from.radiance_sum(channel) / count);
        let spread = squares / count - mean.iter().map(|mean| mean * mean).sum::<f64>();
        (spread / (count - 1.0)).max(0.0)
    }

    /// The picture so far, of the shown part of the film.
    pub fn picture(&self) -> Picture {
        let shown = self.layout.shown;
        let rgb = match self.light_unit() {
            None => self.layout.places().map(|pixel| self.mean(pixel)).collect(),
            Some(unit) => {
                let both = |pixel| {
                    let ([r, g, b], [s, t, u]) = (self.mean_of_samples(pixel), self.light(pixel, unit));
                    [r + s, g + t, b + u].map(|c| c as f32)
                };
                self.layout.places().map(both).collect()
            }
        };
        Picture { width: shown.width, height: shown.height, rgb }
    }
}

#[cfg(test)]
mod tests;
