//! Weighted samples: each is added to all pixels within the filter radius.
//!
//! The summand of a pixel is the sample's radiance times two taps, an exact product, rounded once to the film's
//! quantum. The product of the taps, a multiple of 2⁻²⁸, is added to the pixel's weight. A pixel of the picture is the
//! quotient of the two sums. Workers sum *bands* of some rows in 64-bit words and send them; the film adds bands to
//! wider words.

use super::fixed::{MAGIC, SCALE, TAP_BITS, WEIGHT_BITS, round_large, round_small};
use super::reject::{Reject, check};
use super::spread::{self, LOW_BITS, Spreads, squared};
use super::sums::{Film, fits};
use super::weights::{MOST_TAPS, Weights, taps, with_width};
use crate::integrator::Finished;
use crate::math::Float;
use crate::math::lanes::{Kernel, Level, dispatch};
use crate::sampling::{Rectangle, Sample};
use serde::{Deserialize, Serialize};

/// The maximum size of a band in bytes. A worker fills one and has at most two in its channel.
pub const BAND_BYTES: usize = 3 << 20;

/// The maximum number of rows whose samples a CPU worker adds to one band.
pub const BAND_ROWS: u32 = 16;

/// One unit of a tap.
const TAP: f64 = 1.0 / (1_u32 << TAP_BITS) as f64;

/// The samples made for a pixel, regardless of the pixels that they are added to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// Samples added.
    pub count: u32,
    /// Samples rejected.
    pub rejected: u32,
}

/// Sums of samples over some rows, sent in a batch. At most [`MAX_COUNT`](super::sums::MAX_COUNT) samples per pixel
/// fit, of at most [`MAX_SUMMED`](super::sums::MAX_SUMMED): a pixel gets less than nine times the samples of one,
/// because the absolute values of a filter's taps sum to one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Band {
    /// The first column, relative to the film's; may be negative.
    x: i64,
    /// The first row, relative to the film's; may be negative.
    y: i64,
    width: usize,
    height: usize,
    /// For each pixel, row by row: radiance in multiples of the quantum, weight in multiples of 2^−[`WEIGHT_BITS`].
    sums: Vec<Sums>,
    /// The extra sums for a variance, if requested.
    spreads: Option<Spreads>,
}

type Sums = [i64; 4];

impl Band {
    /// A band without pixels.
    pub fn empty() -> Band {
        Band { x: 0, y: 0, width: 0, height: 0, sums: Vec::new(), spreads: None }
    }

    /// Bytes of its sums.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.sums[..]) + self.spreads.as_ref().map_or(0, |_| self.sums.len() * Spreads::BYTES)
    }

    /// The first column and the first row, relative to the film's.
    pub fn corner(&self) -> [i64; 2] {
        [self.x, self.y]
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.sums.len()
    }

    /// For each pixel, row by row: radiance in multiples of the quantum, weight in multiples of 2^−[`WEIGHT_BITS`].
    pub fn sums_mut(&mut self) -> &mut [[i64; 4]] {
        &mut self.sums
    }

    /// The part of the band that lies on a film of this size.
    fn on(&self, width: u32, height: u32) -> Option<Rectangle> {
        let clip = |from: i64, len: usize, side: u32| {
            let (first, end) = (from.max(0), (from + len as i64).min(i64::from(side)));
            (first < end).then_some((first as u32, (end - first) as u32))
        };
        let ((x, width), (y, height)) =
            (clip(self.x, self.width, width)?, clip(self.y, self.height, height)?);
        Some(Rectangle { x, y, width, height })
    }

    /// The index among the sums of the first pixel of a square whose first column and row on the film are these; `None`
    /// if the square is not completely in the band.
    #[inline(always)]
    fn square(&self, side: usize, column: i64, row: i64) -> Option<usize> {
        // As an unsigned number a negative one is far beyond the end.
        let [x, y] = [column - self.x, row - self.y].map(|from| from as usize);
        let fits = |from: usize, len: usize| from.saturating_add(side) <= len;
        (fits(x, self.width) & fits(y, self.height)).then_some(y.wrapping_mul(self.width).wrapping_add(x))
    }

    /// The first and the last pixel index of a film of this size that the band may add to.
    pub fn places(&self, width: u32, height: u32) -> Option<[u32; 2]> {
        let on = self.on(width, height)?;
        Some([on.y * width + on.x, (on.y + on.height - 1) * width + on.x + on.width - 1])
    }
}

/// Adds weighted samples to a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Splatter {
    weights: Weights,
    /// Column and row of the film's first pixel in the coordinates of sample positions.
    origin: [i64; 2],
    /// Whether it also computes the extra sums for a variance.
    spreads: bool,
}

impl Splatter {
    /// Adds samples to a film whose first pixel has this column and row in the coordinates of sample positions.
    pub fn new(weights: Weights, origin: [u32; 2]) -> Splatter {
        Splatter { weights, origin: origin.map(i64::from), spreads: false }
    }

    /// Sets whether it also computes the extra sums for a variance, which a film's layout must match.
    pub fn with_spreads(self, spreads: bool) -> Splatter {
        Splatter { spreads, ..self }
    }

    /// Column and row of the film's first pixel in the coordinates of sample positions.
    pub fn origin(&self) -> [i64; 2] {
        self.origin
    }

    /// The weights.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Columns and rows by which a band exceeds the pixels it is filled from.
    fn margin(&self) -> u32 {
        2 * self.weights.reach() + self.weights.width() as u32
    }

    /// Whether its bands have the extra sums for a variance.
    pub fn has_spreads(&self) -> bool {
        self.spreads
    }

    /// The number of pixels, from this index on, whose samples may share a band on a film with rows of this length.
    pub fn places_from(&self, place: u32, film_width: u32) -> u32 {
        self.places_in_rows(place, film_width, BAND_ROWS)
    }

    /// The same number for a band of any number of rows.
    pub fn most_places_from(&self, place: u32, film_width: u32) -> u32 {
        self.places_in_rows(place, film_width, u32::MAX)
    }

    /// The maximum number of pixels of a band on a film of this size.
    pub fn most_pixels(&self, width: u32, height: u32) -> u32 {
        let margin = self.margin();
        let [width, height] = [width, height].map(|side| u64::from(side) + u64::from(margin));
        (width * height).min(self.band_pixels().into()) as u32
    }

    fn places_in_rows(&self, place: u32, film_width: u32, most_rows: u32) -> u32 {
        let (margin, most) = (self.margin(), self.band_pixels());
        let rows = (most / (film_width + margin)).saturating_sub(margin).min(most_rows);
        let left_in_row = film_width - place % film_width;
        if rows > 0 {
            left_in_row + (rows - 1) * film_width
        } else {
            left_in_row.min((most / (margin + 1)).saturating_sub(margin).max(1))
        }
    }

    /// The maximum number of pixels of a band.
    fn band_pixels(&self) -> u32 {
        let spread = if self.spreads { Spreads::BYTES } else { 0 };
        (BAND_BYTES / (size_of::<Sums>() + spread)) as u32
    }

    /// An empty band for samples of the pixels with these indices.
    pub fn band(&self, first: u32, last: u32, film_width: u32) -> Band {
        let [top, bottom] = [first, last].map(|place| place / film_width);
        let columns =
            if top == bottom { [first % film_width, last % film_width] } else { [0, film_width - 1] };
        let (reach, margin) = (i64::from(self.weights.reach()), self.margin());
        let (width, height) =
            ((columns[1] - columns[0] + 1 + margin) as usize, (bottom - top + 1 + margin) as usize);
        let (x, y) = (i64::from(columns[0]) - reach, i64::from(top) - reach);
        let len = width * height;
        let spreads = self.spreads.then(|| Spreads::new(len));
        Band { x, y, width, height, sums: vec![[0; 4]; len], spreads }
    }

    /// The first and the last pixel index of a film of this size that a sample may be added to, or is counted in.
    pub fn places(&self, sample: &Sample, counted: u32, width: u32, height: u32) -> [u32; 2] {
        // Positions are rounded: one more row on each side.
        let first = (f64::from(sample.y) + self.weights.shift()).floor().clamp(-1e9, 1e9) as i64;
        let first = first - self.origin[1] - 1;
        let rows =
            (first..first + self.weights.width() as i64 + 2).filter(|row| (0..height.into()).contains(row));
        let places = rows.map(|row| row as u32 * width).flat_map(|place| [place, place + width - 1]);
        places.fold([counted; 2], |[least, most], place| [least.min(place), most.max(place)])
    }

    /// Adds samples to a band and counts them in the pixels that they were made for. Returns the indices of the samples
    /// that do not fit: they are too bright for its words, or reach pixels outside it.
    pub fn add(&self, level: Level, samples: &[Finished], band: &mut Band, made: &mut [Made]) -> Vec<usize> {
        let mut unusual = Vec::new();
        dispatch(level, Add { splatter: self, samples, band, made, unusual: &mut unusual });
        unusual
    }
}

/// The body of [`Splatter::add`], compiled for the instructions of each SIMD level.
struct Add<'a> {
    splatter: &'a Splatter,
    samples: &'a [Finished],
    band: &'a mut Band,
    made: &'a mut [Made],
    unusual: &'a mut Vec<usize>,
}

impl Kernel for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Float>(mut self) {
        with_width!(self.splatter.weights.width(), N => {
            self.spread_with::<N>();
            self.run_with::<N>();
        });
    }
}

impl Add<'_> {
    #[inline(always)]
    fn run_with<const N: usize>(self) {
        let Splatter { weights, origin: [left, top], .. } = self.splatter;
        let (rows, shift) = (weights.rows::<N>(), weights.shift());
        let width = self.band.width;
        for (i, finished) in self.samples.iter().enumerate() {
            let Sample { x, y, radiance, .. } = finished.sample;
            let (column, across) = taps::<N>(rows, shift, x);
            let (row, down) = taps::<N>(rows, shift, y);
            let square = self.band.square(N, column - left, row - top);
            let Some(mut first) = square.filter(|_| fits(radiance)) else {
                self.unusual.push(i);
                continue;
            };
            self.made[finished.slot as usize].count += 1;
            let [r, g, b] = radiance;
            let sample = [
                f64::from(r) * SCALE,
                f64::from(g) * SCALE,
                f64::from(b) * SCALE,
                (1_u32 << WEIGHT_BITS) as f64,
            ];
            // All products are exact. Plain arrays let the compiler use whole registers.
            let mut product = [[0.0; 4]; N];
            let mut weights = [0.0; N];
            for k in 0..N {
                let weight = f64::from(across[k]) * TAP;
                product[k] = [sample[0] * weight, sample[1] * weight, sample[2] * weight, sample[3] * weight];
                weights[k] = f64::from(down[k]) * TAP;
            }
            for weight in weights {
                let to = &mut self.band.sums[first..first + N];
                for (to, product) in to.iter_mut().zip(&product) {
                    for (to, product) in to.iter_mut().zip(product) {
                        *to += round_small(product * weight);
                    }
                }
                first += width;
            }
        }
    }

    /// Adds the samples that fit to the extra sums for a variance, if requested.
    #[inline(always)]
    fn spread_with<const N: usize>(&mut self) {
        const LOW: f64 = (1_u64 << LOW_BITS) as f64;
        let Some(mut spreads) = self.band.spreads.take() else { return };
        let Spreads { sums: to_sums, squares: [to_high, to_low] } = &mut spreads;
        let Splatter { weights, origin: [left, top], .. } = self.splatter;
        let (rows, shift) = (weights.rows::<N>(), weights.shift());
        let width = self.band.width;
        for Finished { sample: Sample { x, y, radiance, .. }, .. } in self.samples {
            let (column, across) = taps::<N>(rows, shift, *x);
            let (row, down) = taps::<N>(rows, shift, *y);
            let square = self.band.square(N, column - left, row - top);
            let Some(mut first) = square.filter(|_| fits(*radiance)) else { continue };
            let [r, g, b] = radiance.map(|c| f64::from(c) * SCALE);
            let (one, square) = ((1_u32 << WEIGHT_BITS) as f64, spread::scaled_square(*radiance));
            // All of these are exact, including the factors of the squares. Plain arrays let the compiler use whole
            // registers.
            let mut product = [[0.0; 4]; N];
            let [mut columns, mut rows] = [[0.0; N]; 2];
            for k in 0..N {
                columns[k] = f64::from(squared(across[k])) * TAP;
                rows[k] = f64::from(squared(down[k])) * TAP;
                product[k] = [r * columns[k], g * columns[k], b * columns[k], one * columns[k]];
            }
            for down in rows {
                let to = &mut to_sums[first..first + N];
                for (to, product) in to.iter_mut().zip(&product) {
                    for (to, product) in to.iter_mut().zip(product) {
                        *to += round_small(product * down);
                    }
                }
                let (high, low) = (&mut to_high[first..first + N], &mut to_low[first..first + N]);
                for k in 0..N {
                    let square = square * (columns[k] * down);
                    // Rounded to an integer.
                    let part = (square * (1.0 / LOW) + MAGIC) - MAGIC;
                    high[k] += round_small(part);
                    low[k] += round_small(square - part * LOW);
                }
                first += width;
            }
        }
        self.band.spreads = Some(spreads);
    }
}

impl Film {
    /// Adds the sums of a band to the pixels that are on the film.
    pub fn add_band(&mut self, band: &Band) {
        debug_assert!(!self.layout().spreads || band.spreads.is_some(), "a band without spreads");
        let Some(on) = band.on(self.width(), self.height()) else { return };
        let from =
            |y: u32| (i64::from(y) - band.y) as usize * band.width + (i64::from(on.x) - band.x) as usize;
        for y in on.y..on.y + on.height {
            let sums = &band.sums[from(y)..][..on.width as usize];
            let first = y as usize * self.width() as usize + on.x as usize;
            for (to, sums) in self.pixels[first..].iter_mut().zip(sums) {
                let [r, g, b, weight] = *sums;
                to.add_radiance(0, r);
                to.add_radiance(1, g);
                to.add_radiance(2, b);
                to.add_weight(weight);
            }
            if let Some(spreads) = band.spreads.as_ref().filter(|_| self.layout().spreads) {
                spreads.add_to(from(y)..from(y) + on.width as usize, &mut self.spreads[first..]);
            }
        }
    }

    /// Counts samples made for a pixel.
    #[inline]
    pub fn add_made(&mut self, pixel: usize, made: Made) {
        self.pixels[pixel].count += u64::from(made.count);
        self.pixels[pixel].rejected += made.rejected;
    }

    /// Adds one sample of any radiance to all pixels within the filter radius, or counts it as rejected. `pixel` is the
    /// one that it was made for.
    pub fn splat(&mut self, splatter: &Splatter, pixel: usize, sample: &Sample) -> Result<(), Reject> {
        if let Err(reject) = check(sample.radiance) {
            self.pixels[pixel].rejected += 1;
            return Err(reject);
        }
        self.pixels[pixel].count += 1;
        let mut all = [[0; MOST_TAPS]; 2];
        let weights = &splatter.weights;
        let [column, row] = with_width!(weights.width(), N => {
            let mut look = |axis: usize, at: f32| {
                let (first, taps) = taps::<N>(weights.rows::<N>(), weights.shift(), at);
                all[axis][..N].copy_from_slice(&taps);
                first - splatter.origin[axis]
            };
            [look(0, sample.x), look(1, sample.y)]
        });
        let (width, height) = (i64::from(self.width()), i64::from(self.height()));
        let scaled = sample.radiance.map(|c| f64::from(c) * SCALE * (TAP * TAP));
        let square = spread::scaled_square(sample.radiance);
        for (y, down) in (row..).zip(all[1]) {
            for (x, across) in (column..).zip(all[0]) {
                let weight = i64::from(down) * i64::from(across);
                if weight == 0 || !(0..width).contains(&x) || !(0..height).contains(&y) {
                    continue;
                }
                let pixel = (y * width + x) as usize;
                let to = &mut self.pixels[pixel];
                for (channel, c) in scaled.into_iter().enumerate() {
                    // Exact: the weight has 28 bits, but no more than 28 of them and those of the float count.
                    to.add_radiance(channel, round_large(c * weight as f64));
                }
                to.add_weight(weight);
                if let Some(to) = self.spreads.get_mut(pixel) {
                    let weight = i64::from(squared(down)) * i64::from(squared(across));
                    let rgb = scaled.map(|c| round_large(c * weight as f64) as u128);
                    let squares = square * (weight as f64 * (TAP * TAP));
                    to.add(rgb, weight as u64, squares.round_ties_even() as u128);
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
