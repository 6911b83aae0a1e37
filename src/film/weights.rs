//! The filter weights of samples in the pixels around them.
//!
//! A filter is the product of two equal one-dimensional ones. Along an axis, a sample between pixel centres has as many
//! *taps* as the filter is wide, one for each pixel that it may contribute to. The offset between the pixels is rounded
//! to a multiple of 2⁻¹⁶. Taps are looked up at multiples of 2⁻⁸ of a pixel, interpolated, and rounded to multiples of
//! 2⁻¹⁴. All of this is integer arithmetic: the same on every processor, and on a GPU.
//!
//! The absolute values of the taps of a position sum to at most one, so that a pixel's sums stay within the bounds of a
//! film of unweighted samples. Twice 14 bits and the 24 of a float do not exceed the 53 of a double, which makes the
//! product of a radiance and two taps exact.

use super::filter::profile;
use super::fixed::{TAP_BITS, round_small};
use crate::scene::{FilmMode, FilmSettings, Filter};

/// Bits of an offset between two pixels.
pub const POSITION_BITS: u32 = 16;
/// The bits of it that select a row of the table; the others interpolate to the next row.
pub const CELL_BITS: u32 = 8;
/// Rows of the table: one per cell, and the end of the last.
pub const ROWS: usize = (1 << CELL_BITS) + 1;
/// Fractional bits of the table's taps.
pub const TABLE_BITS: u32 = TAP_BITS + CELL_BITS;

/// Numbers of taps with specialised code; other filters are padded with zero taps.
const WIDTHS: [usize; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];
/// The maximum number of taps along an axis.
pub const MOST_TAPS: usize = WIDTHS[WIDTHS.len() - 1];

/// A filter's weights, as a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    /// Taps along an axis.
    width: usize,
    /// Added to a position in pixels; the integer part is then the first tap's pixel, and the fraction the offset from
    /// it.
    shift: f64,
    /// Pixels on each side of a sample's own that it may contribute to.
    reach: u32,
    /// [`ROWS`] rows of taps, in multiples of 2^−[`TABLE_BITS`].
    table: Vec<i32>,
}

impl Weights {
    /// The weights of a film of weighted samples; `None` for a film of unweighted ones.
    pub fn of(film: &FilmSettings) -> Option<Weights> {
        (film.mode() == FilmMode::Continuous).then(|| Weights::new(film.filter))
    }

    /// The weights of contributions to any pixel. A contribution's position is not limited to pixel centres: without a
    /// filter it is added to the pixel that contains it.
    pub fn of_contributions(film: &FilmSettings) -> Weights {
        Weights::new(match film.filter {
            Filter::None => Filter::Box { radius: 0.5 },
            filter => filter,
        })
    }

    /// The weights of a filter of radius ½ to 16.
    pub fn new(filter: Filter) -> Weights {
        let radius = filter.radius();
        let taps = ((2.0 * radius).ceil() as usize).clamp(1, MOST_TAPS);
        let width = WIDTHS.into_iter().find(|&width| width >= taps).unwrap_or(MOST_TAPS);
        // The distance of tap k from a position at the offset f.
        let distance = |k: usize, f: f64| k as f64 + 1.0 - radius - f;
        let row = |i: usize| {
            let f = i as f64 / (ROWS - 1) as f64;
            (0..width).map(move |k| if k < taps { profile(filter, distance(k, f)) } else { 0.0 })
        };
        let largest = (0..ROWS).map(|i| row(i).map(f64::abs).sum()).fold(0.0, f64::max);
        let scale = f64::from(1_u32 << TABLE_BITS) / largest;
        let table = (0..ROWS).flat_map(row).map(|weight| (weight * scale).round() as i32).collect();
        // Rounding may put a sample of a pixel on its far border.
        let before = (radius - 0.5).ceil();
        let after = (1.5 - radius).floor() + taps as f64 - 1.0;
        Weights { width, shift: 0.5 - radius, reach: before.max(after) as u32, table }
    }

    /// Taps along an axis, including those that are always zero.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The integral along an axis, in pixels, in multiples of 2⁻³¹: the mean over all positions of the sum of their
    /// rounded taps.
    pub fn integral(&self) -> u32 {
        const { assert!(TAP_BITS + POSITION_BITS + 1 == 31) };
        let positions = (0..1_u32 << POSITION_BITS).map(|i| i as f32 / (1_u32 << POSITION_BITS) as f32);
        let sum: i64 = with_width!(self.width, N => {
            let rows = self.rows::<N>();
            positions.flat_map(|at| taps::<N>(rows, 0.0, at).1).map(i64::from).sum()
        });
        (2 * sum).clamp(0, u32::MAX.into()) as u32
    }

    /// Pixels on each side of a sample's own that it may contribute to.
    pub fn reach(&self) -> u32 {
        self.reach
    }

    /// Added to a position in pixels; the integer part is then the first tap's pixel, and the fraction the offset from
    /// it.
    pub fn shift(&self) -> f64 {
        self.shift
    }

    /// The table: [`ROWS`] rows of [`Weights::width`] taps, in multiples of 2^−[`TABLE_BITS`].
    pub fn table(&self) -> &[i32] {
        &self.table
    }

    /// The table as rows of the type that code for this width needs.
    #[inline(always)]
    pub(super) fn rows<const N: usize>(&self) -> &[[i32; N]; ROWS] {
        let (rows, _) = self.table.as_chunks::<N>();
        rows.try_into().unwrap_or_else(|_| unreachable!("code for another width"))
    }
}

/// The pixel of a position's first tap, and its taps in multiples of 2^−[`TAP_BITS`].
#[inline(always)]
pub(super) fn taps<const N: usize>(rows: &[[i32; N]; ROWS], shift: f64, at: f32) -> (i64, [i32; N]) {
    const FRACTION: i64 = (1 << POSITION_BITS) - 1;
    const WITHIN: u32 = POSITION_BITS - CELL_BITS;
    let position = round_small((f64::from(at) + shift) * (1_u32 << POSITION_BITS) as f64);
    let between = (position & FRACTION) as usize;
    let (cell, part) = (between >> WITHIN, (between & ((1 << WITHIN) - 1)) as i32);
    let (from, to) = (&rows[cell], &rows[cell + 1]);
    let mut taps = [0; N];
    for k in 0..N {
        // The absolute values sum to 2³⁰.
        let mixed = from[k] * ((1 << WITHIN) - part) + to[k] * part;
        taps[k] = (mixed + (1 << (TABLE_BITS + WITHIN - TAP_BITS - 1))) >> (TABLE_BITS + WITHIN - TAP_BITS);
    }
    (position >> POSITION_BITS, taps)
}

/// Code specialised for a table's width: `with_width!(width, N => expression)` with `N` a constant.
macro_rules! with_width {
    ($width:expr, $n:ident => $body:expr) => {
        match $width {
            1 => {
                const $n: usize = 1;
                $body
            }
            2 => {
                const $n: usize = 2;
                $body
            }
            3 => {
                const $n: usize = 3;
                $body
            }
            4 => {
                const $n: usize = 4;
                $body
            }
            6 => {
                const $n: usize = 6;
                $body
            }
            8 => {
                const $n: usize = 8;
                $body
            }
            12 => {
                const $n: usize = 12;
                $body
            }
            16 => {
                const $n: usize = 16;
                $body
            }
            24 => {
                const $n: usize = 24;
                $body
            }
            _ => {
                const $n: usize = 32;
                $body
            }
        }
    };
}
pub(super) use with_width;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::filter::tests::WIDE;

    /// The taps of a position by definition, as (pixel, weight), up to one factor.
    fn exact(filter: Filter, at: f64) -> Vec<(i64, f64)> {
        let near = |pixel: i64| (pixel, profile(filter, pixel as f64 + 0.5 - at));
        let radius = filter.radius();
        ((at - radius).floor() as i64 - 2..=(at + radius).ceil() as i64 + 2)
            .map(near)
            .filter(|(_, weight)| *weight != 0.0)
            .collect()
    }

    fn table_taps(weights: &Weights, at: f32) -> Vec<(i64, i32)> {
        let (first, taps) = with_width!(weights.width(), N => {
            let (first, taps) = taps(weights.rows::<N>(), weights.shift(), at);
            (first, taps.to_vec())
        });
        (first..).zip(taps).collect()
    }

    #[test]
    fn taps_are_the_filter_to_a_multiple_of_2_to_the_minus_14() {
        let other = [
            Filter::Box { radius: 1.5 },
            Filter::Tent { radius: 2.0 },
            Filter::Mitchell { radius: 3.0, b: 0.0, c: 0.5 },
            Filter::Lanczos { radius: 16.0 },
        ];
        for filter in WIDE.into_iter().chain(other) {
            let weights = Weights::new(filter);
            // Except at the ends of a box, where both sides count.
            let largest = (0..4096)
                .map(|i| {
                    exact(filter, (f64::from(i) + 0.5) / 4096.0).iter().map(|(_, w)| w.abs()).sum::<f64>()
                })
                .fold(0.0, f64::max);
            let (mut worst, mut lowest) = (0.0_f64, 0);
            for i in 0..5000 {
                // Except at the ends of a box, where half a unit of position decides.
                let at = 7.0 + (i as f32 + 0.37) / 5000.0;
                let taps = table_taps(&weights, at);
                let sum: i32 = taps.iter().map(|(_, tap)| tap.abs()).sum();
                assert!(sum <= (1 << TAP_BITS) + taps.len() as i32 / 2, "{filter}: {sum} at {at}");
                let unit = f64::from(1_u32 << TAP_BITS);
                for (pixel, weight) in exact(filter, f64::from(at)) {
                    let tap = taps.iter().find(|(p, _)| *p == pixel).map_or(0, |(_, tap)| *tap);
                    worst = worst.max((f64::from(tap) - weight / largest * unit).abs());
                }
                for (pixel, tap) in taps {
                    assert!(tap == 0 || (pixel - 7).unsigned_abs() <= weights.reach().into(), "{filter}");
                    lowest = lowest.min(tap);
                }
            }
            // Half a unit from rounding, the rest from interpolation.
            assert!(worst < 0.9, "{filter}: off by {worst} units");
            assert_eq!(lowest < 0, filter.has_negative_lobes());
        }
    }

    #[test]
    fn every_position_of_a_pixel_stays_within_reach() {
        for radius in [0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 7.7, 16.0] {
            let weights = Weights::new(Filter::Tent { radius });
            // Pixel 5, from border to border.
            for i in 0..=4096 {
                for (pixel, tap) in table_taps(&weights, 5.0 + i as f32 / 4096.0) {
                    let far = (pixel - 5).unsigned_abs();
                    assert!(tap == 0 || far <= weights.reach().into(), "radius {radius}: {pixel}");
                }
            }
        }
    }

    #[test]
    fn a_box_of_whole_pixels_has_equal_weights() {
        for (radius, width) in [(0.5, 1), (1.0, 2), (1.5, 3), (2.0, 4)] {
            let weights = Weights::new(Filter::Box { radius });
            for at in [3.0, 3.2, 3.5, 3.999] {
                let taps = table_taps(&weights, at);
                assert_eq!(taps.len(), width);
                assert!(taps.iter().all(|(_, tap)| *tap == taps[0].1 && *tap > 0), "{taps:?}");
            }
        }
    }
}
