//! Decodes the device's results for the accumulator.

use super::layout::{REJECT_SHIFT, REJECTS, SampleWords, SlotSums};
use crate::film::{Band, PixelSums, Reject, WideSums};
use crate::sampling::Sample;

/// The decoded results of one slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) sums: PixelSums,
    /// Radiance and squares that do not fit into `sums`.
    pub(super) wide: Option<WideSums>,
    pub(super) rays: u64,
    /// The first rejected sample, and the reason.
    pub(super) reject: Option<(u32, Reject)>,
}

/// Decodes the words of a slot with this number of samples.
pub(super) fn slot(words: &SlotSums, samples: u32) -> Slot {
    let word = |word: u32, place: u32| u128::from(word) << (32 * place);
    let rgb: [u128; 3] =
        std::array::from_fn(|c| word(words.low[c], 0) | word(words.middle[c], 1) | word(words.high[c], 2));
    let squares = (0..).zip(words.squares).map(|(place, w)| word(w, place)).sum::<u128>();
    let rejected = words.rejected & ((1 << REJECT_SHIFT) - 1);
    let reason = words.rejected >> REJECT_SHIFT;
    let reject = REJECTS.iter().find(|(code, _)| *code == reason).map(|(_, r)| (words.first_reject, *r));
    let mut sums = PixelSums { count: samples - rejected, rejected, ..PixelSums::default() };
    let narrow = |value: u128| i64::try_from(value).ok();
    let wide = match (rgb.map(narrow), narrow(squares)) {
        ([Some(r), Some(g), Some(b)], Some(squares)) => {
            (sums.rgb, sums.squares) = ([r, g, b], squares);
            None
        }
        _ => Some(WideSums { rgb: rgb.map(|value| value as i128), squares }),
    };
    Slot { sums, wide, rays: u64::from(words.rays), reject }
}

pub(super) fn sample(words: &SampleWords) -> Sample {
    let radiance = [words.red, words.green, words.blue].map(f32::from_bits);
    Sample {
        pixel: words.pixel,
        sample: words.sample,
        x: f32::from_bits(words.x),
        y: f32::from_bits(words.y),
        radiance,
    }
}

/// The number of words of the sums of a band, including the leading counter.
pub(super) const fn splat_words(pixels: usize) -> usize {
    1 + 8 * pixels
}

/// Adds words of sums to an entire band. Returns the number of samples that were too bright for it.
pub(super) fn splats(words: &[u32], band: &mut Band) -> u32 {
    let Some((&bright, words)) = words.split_first() else { return 0 };
    let sums = band.sums_mut();
    let pixels = sums.len();
    let (low, high) = words.split_at(4 * pixels);
    for (channel, (low, high)) in low.chunks(pixels.max(1)).zip(high.chunks(pixels.max(1))).enumerate() {
        for (to, (&low, &high)) in sums.iter_mut().zip(low.iter().zip(high)) {
            to[channel] = (u64::from(low) | u64::from(high) << 32) as i64;
        }
    }
    bright
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_combined_lowest_first() {
        let words = SlotSums {
            low: [1, 2, 3],
            middle: [4, 5, 6],
            high: [0; 3],
            rays: 7,
            rejected: 2 | 3 << REJECT_SHIFT,
            first_reject: 9,
            squares: [8, 9, 0, 0],
        };
        let read = slot(&words, 10);
        assert_eq!(read.sums.rgb, [1 | 4 << 32, 2 | 5 << 32, 3 | 6 << 32]);
        assert_eq!((read.sums.squares, read.sums.count, read.sums.rejected), (8 | 9 << 32, 8, 2));
        assert_eq!((read.rays, read.wide, read.reject), (7, None, Some((9, Reject::Negative))));
    }

    #[test]
    fn sums_of_more_than_63_bits_are_wide_and_counted() {
        let words = SlotSums { high: [0, 1, 0], squares: [0, 0, 0, 1], ..SlotSums::default() };
        let read = slot(&words, 10);
        assert_eq!(read.sums, PixelSums { count: 10, ..PixelSums::default() });
        assert_eq!(read.wide, Some(WideSums { rgb: [0, 1 << 64, 0], squares: 1 << 96 }));
    }
}
