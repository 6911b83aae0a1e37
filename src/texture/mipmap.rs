//! Coarser levels of pictures (mipmaps).

use super::picture::{Depth, Picture};
use crate::math::colour::{linear_to_srgb, srgb_to_linear};
use std::ops::Range;

/// The levels of a picture from half its size down to a single texel. Each has half as many texels along each side as
/// the one before, rounded down. Texels are averaged by the area they cover, in linear light: numbers encoded as sRGB
/// are decoded first.
pub(super) fn coarser_levels(picture: &Picture, is_encoded: bool) -> Vec<Picture> {
    let codes = Codes::new(picture.depth(), is_encoded);
    let mut size = [picture.width(), picture.height()].map(|side| side as usize);
    let channels = picture.channels() as usize;
    let mut numbers = Vec::new();
    let mut levels = Vec::new();
    while size != [1, 1] {
        let half = size.map(|side| (side / 2).max(1));
        numbers = if levels.is_empty() {
            halved(|i| codes.decode(picture.number(i)), size, half, channels)
        } else {
            halved(|i| numbers[i], size, half, channels)
        };
        size = half;
        levels.push(level(&numbers, size, channels, picture.depth(), &codes));
    }
    levels
}

/// A picture of these numbers, the lowest row first.
fn level(
    numbers: &[f32],
    [width, height]: [usize; 2],
    channels: usize,
    depth: Depth,
    codes: &Codes,
) -> Picture {
    let mut bytes = Vec::with_capacity(numbers.len() * depth.bytes());
    // Files have the uppermost row first.
    for row in numbers.chunks_exact(width * channels).rev() {
        for &number in row {
            bytes.extend_from_slice(&codes.encode(number).to_le_bytes()[..depth.bytes()]);
        }
    }
    Picture::new([width as u32, height as u32], [channels as u32; 2], depth, &bytes)
}

/// The means of numbers over a smaller number of texels.
fn halved(
    number: impl Fn(usize) -> f32,
    [width, height]: [usize; 2],
    [half_width, half_height]: [usize; 2],
    channels: usize,
) -> Vec<f32> {
    let mut halved = Vec::with_capacity(half_width * half_height * channels);
    let columns: Vec<_> = (0..half_width).map(|x| covered(x, half_width, width)).collect();
    for y in 0..half_height {
        let (rows, of_rows) = covered(y, half_height, height);
        for (columns, of_columns) in &columns {
            for channel in 0..channels {
                let mut sum = 0.0;
                for (row, of_row) in rows.clone().zip(of_rows) {
                    for (column, of_column) in columns.clone().zip(of_columns) {
                        let number = number((row * width + column) * channels + channel);
                        sum += f64::from(number) * of_row * of_column;
                    }
                }
                halved.push(sum as f32);
            }
        }
    }
    halved
}

/// The texels, out of `many` along a side, that the texel `i` out of `few` covers, two or three, and their fractions of
/// it.
fn covered(i: usize, few: usize, many: usize) -> (Range<usize>, [f64; 3]) {
    let (from, to) = (i * many, (i + 1) * many);
    let texels = from / few..to.div_ceil(few);
    let share = |texel: usize| {
        let covered = ((texel + 1) * few).min(to).saturating_sub((texel * few).max(from));
        covered as f64 / many as f64
    };
    let first = texels.start;
    (texels, [share(first), share(first + 1), share(first + 2)])
}

/// The linear values of a picture's numbers.
struct Codes {
    depth: Depth,
    is_encoded: bool,
    /// The smallest linear value of each code but the first, if codes are encoded as sRGB.
    least: Vec<f32>,
    /// Their linear values.
    values: Vec<f32>,
}

impl Codes {
    fn new(depth: Depth, is_encoded: bool) -> Codes {
        let last = match depth {
            Depth::Bits8 if is_encoded => 255,
            Depth::Bits16 if is_encoded => 65_535,
            _ => 0,
        };
        let linear = |code: f64| srgb_to_linear(code / f64::from(last)) as f32;
        let least = (0..last).map(|code| linear(f64::from(code) + 0.5)).collect();
        let values =
            if last > 0 { (0..=last).map(|code| linear(f64::from(code))).collect() } else { Vec::new() };
        Codes { depth, is_encoded, least, values }
    }

    fn decode(&self, code: u32) -> f32 {
        if !self.values.is_empty() {
            return self.values[code as usize];
        }
        let number = match self.depth {
            Depth::Bits8 => code as f32 / 255.0,
            Depth::Bits16 => code as f32 / 65_535.0,
            Depth::Half => exr::prelude::f16::from_bits(code as u16).to_f32(),
            Depth::Float => f32::from_bits(code),
        };
        if self.is_encoded { srgb_to_linear(f64::from(number)) as f32 } else { number }
    }

    /// The nearest code.
    fn encode(&self, number: f32) -> u32 {
        if !self.values.is_empty() {
            return self.least.partition_point(|&least| least <= number) as u32;
        }
        let number = if self.is_encoded { linear_to_srgb(f64::from(number)) as f32 } else { number };
        match self.depth {
            Depth::Bits8 => (number * 255.0 + 0.5) as u32,
            Depth::Bits16 => (number * 65_535.0 + 0.5) as u32,
            Depth::Half => exr::prelude::f16::from_f32(number).to_bits().into(),
            Depth::Float => number.to_bits(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The means of all numbers of each channel, in linear light.
    fn means(picture: &Picture, is_encoded: bool) -> [f64; 3] {
        let codes = Codes::new(picture.depth(), is_encoded);
        let channels = picture.channels() as usize;
        let mut sums = [0.0; 3];
        for i in 0..picture.texels() * channels {
            sums[i % channels] += f64::from(codes.decode(picture.number(i)));
        }
        sums.map(|sum| sum / picture.texels() as f64)
    }

    fn picture(size: [u32; 2], channels: u32, depth: Depth) -> Picture {
        let count = size[0] * size[1] * channels;
        let bytes = |i: u32| match depth {
            Depth::Bits8 => vec![(i * 37 % 251) as u8],
            Depth::Bits16 => ((i * 7919 % 65_521) as u16).to_le_bytes().to_vec(),
            Depth::Half => (0x3000 + (i * 97 % 0xc00) as u16).to_le_bytes().to_vec(),
            Depth::Float => ((i * 31 % 17) as f32).to_le_bytes().to_vec(),
        };
        Picture::new(size, [channels; 2], depth, &(0..count).flat_map(bytes).collect::<Vec<_>>())
    }

    #[test]
    fn levels_halve_down_to_one_texel_and_preserve_the_mean() {
        for (size, sizes) in [
            ([8, 8], vec![[4, 4], [2, 2], [1, 1]]),
            ([7, 3], vec![[3, 1], [1, 1]]),
            ([1, 5], vec![[1, 2], [1, 1]]),
            ([1, 1], vec![]),
        ] {
            for (depth, room) in
                [(Depth::Bits8, 8e-3), (Depth::Bits16, 4e-5), (Depth::Half, 1e-3), (Depth::Float, 1e-5)]
            {
                for (channels, is_encoded) in [(1, false), (3, false), (3, true)] {
                    // Encoded floats are at most one.
                    if is_encoded && depth == Depth::Float {
                        continue;
                    }
                    let whole = picture(size, channels, depth);
                    let levels = coarser_levels(&whole, is_encoded);
                    let found: Vec<_> = levels.iter().map(|level| [level.width(), level.height()]).collect();
                    assert_eq!(found, sizes);
                    for level in &levels {
                        assert_eq!((level.channels(), level.depth()), (channels, depth));
                        for (ours, all) in means(level, is_encoded).iter().zip(means(&whole, is_encoded)) {
                            assert!(
                                (ours - all).abs() <= room * all.max(1.0),
                                "{depth:?}: {ours}, not {all}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn encoding_gives_the_nearest_code() {
        for (depth, is_encoded, last) in [
            (Depth::Bits8, true, 255),
            (Depth::Bits8, false, 255),
            (Depth::Bits16, true, 65_535),
            (Depth::Bits16, false, 65_535),
        ] {
            let codes = Codes::new(depth, is_encoded);
            for code in 0..=last {
                assert_eq!(codes.encode(codes.decode(code)), code, "{depth:?} {is_encoded}");
            }
        }
        // Half the light of white does not have half its code.
        assert_eq!(Codes::new(Depth::Bits8, true).encode(0.5), 188);
    }

    #[test]
    fn texels_are_averaged_by_area() {
        // A texel of three is two thirds of one of two, and so on.
        let third = 1.0 / 3.0;
        let (texels, [a, b, _]) = covered(0, 2, 3);
        assert_eq!((texels, a, b), (0..2, 2.0 * third, third));
        let (texels, shares) = covered(1, 3, 7);
        assert_eq!(texels, 2..5);
        assert!(shares.iter().zip([2.0 / 7.0, 3.0 / 7.0, 2.0 / 7.0]).all(|(a, b)| (a - b).abs() < 1e-12));
        assert_eq!(covered(3, 8, 16).0, 6..8);
    }
}
