//! Adds contributions to the light image of a film, and the light image to the picture.

use super::fixed::{TAP_BITS, round_small};
use super::light_image::LIGHT_BITS;
use super::reject::{Reject, check};
use super::splat::Splatter;
use super::sums::Film;
use super::weights::{taps, with_width};
use crate::sampling::Contribution;

/// Positions farther from the origin than this, in pixels, reach no pixel.
const FAR: f32 = (1_u32 << 30) as f32;

/// Rounds to the nearest integer, ties to even, for |x| < 2¹²⁶.
#[inline(always)]
fn round(x: f64) -> i128 {
    if x.abs() < 1e15 { round_small(x).into() } else { x.round_ties_even() as i128 }
}

impl Film {
    /// Whether the film has a light image.
    pub fn has_light_image(&self) -> bool {
        self.layout().light.is_some()
    }

    /// Adds a contribution of a sample of `pixel` to the light image, or counts it as rejected. `splatter` has the
    /// weights of the film's [`LightScale`](super::light_image::LightScale).
    ///
    /// # Panics
    /// If the film has no light image.
    pub fn contribute(
        &mut self,
        splatter: &Splatter,
        pixel: usize,
        contribution: &Contribution,
    ) -> Result<(), Reject> {
        let Contribution { x, y, radiance, .. } = *contribution;
        let place = if x.is_nan() | y.is_nan() { Err(Reject::Nowhere) } else { Ok(()) };
        if let Err(reject) = check(radiance).and(place) {
            self.light[pixel].rejected += 1;
            return Err(reject);
        }
        let weights = splatter.weights();
        let is_near = x.abs() < FAR && y.abs() < FAR;
        let reached = is_near
            && with_width!(weights.width(), N => {
                let look = |at| taps::<N>(weights.rows::<N>(), weights.shift(), at);
                let ((column, across), (row, down)) = (look(x), look(y));
                let [left, top] = splatter.origin();
                self.add_light([column - left, row - top], across, down, radiance)
            });
        self.light[pixel].outside += u64::from(!reached);
        Ok(())
    }

    /// Adds radiance to the square of pixels that begins in this column and row. Returns whether it reached a pixel.
    fn add_light<const N: usize>(
        &mut self,
        [column, row]: [i64; 2],
        across: [i32; N],
        down: [i32; N],
        radiance: [f32; 3],
    ) -> bool {
        let (width, height) = (i64::from(self.width()), i64::from(self.height()));
        let scaled = radiance.map(|c| f64::from(c) * (1_u64 << (LIGHT_BITS - 2 * TAP_BITS)) as f64);
        let mut reached = false;
        for (y, down) in (row..).zip(down).filter(|(y, _)| (0..height).contains(y)) {
            for (x, across) in (column..).zip(across).filter(|(x, _)| (0..width).contains(x)) {
                let weight = i64::from(down) * i64::from(across);
                let to = &mut self.light[(y * width + x) as usize];
                for (to, c) in to.rgb.iter_mut().zip(scaled) {
                    // Exact: the weight has 28 bits, but no more than 28 of them and those of the float count.
                    *to += round(c * weight as f64);
                }
                reached |= weight != 0;
            }
        }
        reached
    }

    /// Samples made for all pixels, rejected ones included.
    fn made(&self) -> u64 {
        self.pixels.iter().map(|pixel| pixel.seen()).sum()
    }

    /// The factor from sums of the light image to radiance; `None` without a light image or without samples.
    pub(super) fn light_unit(&self) -> Option<f64> {
        let scale = self.layout().light?;
        let made = self.made();
        (made > 0).then(|| scale.of(made))
    }

    /// The radiance of a pixel of the light image.
    pub(super) fn light(&self, pixel: usize, unit: f64) -> [f64; 3] {
        self.light[pixel].rgb.map(|sum| sum as f64 * unit)
    }

    /// The numbers of rejected contributions, and of those that reached no pixel of the film.
    pub fn lost_contributions(&self) -> [u64; 2] {
        let counts = self.light.iter().map(|pixel| [pixel.rejected, pixel.outside]);
        // The counts in a file may have any value.
        counts.fold([0; 2], |[a, b]: [u64; 2], [c, d]| [a.saturating_add(c), b.saturating_add(d)])
    }
}

#[cfg(test)]
mod tests;
