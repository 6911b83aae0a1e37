//! Radiance HDR: three 8-bit mantissas with a common exponent.
//!
//! Pixels are rounded here, and the file is written by the `image` crate. The crate truncates mantissas, which darkens
//! the picture by 0.2% in nearly all readers, wraps tiny values to huge ones, and computes the exponent with the
//! system's logarithm. Values that RGBE can represent exactly pass through it unchanged. Scan lines that are too long
//! for run-length encoding are also written here: the crate treats a length of 32768 pixels as one that fits into 15
//! bits.

use std::io::{self, Write};

use image::codecs::hdr::HdrEncoder;
use image::{ImageError, Rgb};

use crate::film::Picture;

/// Pixels whose brightest channel is below this are black: 2⁻¹¹⁸, near the end of the exponent's range.
const DARKEST: f32 = f32::from_bits((127 - 118) << 23);
/// The largest value in RGBE: 255/256 · 2¹²⁷.
const BRIGHTEST: f32 = f32::from_bits((253 << 23) | (0xfe << 15));

/// The longest scan line that can be run-length encoded: its length is stored in 15 bits.
const LONGEST_RUN_LENGTH_LINE: u32 = (1 << 15) - 1;

/// Writes a picture's radiance, rounded to the nearest 256th of the power of two above the brightest channel.
pub fn encode(picture: &Picture, out: &mut impl Write) -> io::Result<()> {
    let colours = picture.rgb.iter().map(|&rgb| nearest_rgbe(rgb));
    if picture.width > LONGEST_RUN_LENGTH_LINE {
        let Picture { width, height, .. } = picture;
        // The header of the crate, so that files of long lines have the same one.
        write!(out, "#?RADIANCE\n# Rust HDR encoder\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n")?;
        // The largest mantissa is at least 128, so that no pixel resembles the marker of a run.
        return colours.map(rgbe).try_for_each(|pixel| out.write_all(&pixel));
    }
    let pixels: Vec<_> = colours.map(Rgb).collect();
    HdrEncoder::new(out).encode(&pixels, picture.width as usize, picture.height as usize).map_err(to_io)
}

/// The mantissas and the exponent of a colour from [`nearest_rgbe`].
fn rgbe(rgb: [f32; 3]) -> [u8; 4] {
    let largest = rgb.into_iter().fold(0.0, f32::max);
    if largest == 0.0 {
        return [0; 4];
    }
    let exponent = largest.to_bits() >> 23;
    let step = f32::from_bits(exponent << 23) / 128.0;
    let [r, g, b] = rgb.map(|value| (value / step) as u8);
    // In floats 127 stands for 2⁰, here 129 for values from 2⁰ on.
    [r, g, b, (exponent + 2) as u8]
}

/// The nearest colour that RGBE can represent.
fn nearest_rgbe(rgb: [f32; 3]) -> [f32; 3] {
    let rgb = rgb.map(|value| value.clamp(0.0, BRIGHTEST));
    let largest = rgb.into_iter().fold(0.0, f32::max);
    if largest < DARKEST {
        return [0.0; 3];
    }
    // The largest power of two that does not exceed the brightest channel; 128 steps below it, 128 above.
    let mut power = f32::from_bits(largest.to_bits() & 0x7f80_0000);
    if (largest / power * 128.0).round() == 256.0 {
        // The brightest channel rounds up to the next power of two, whose steps are twice as wide.
        power *= 2.0;
    }
    let step = power / 128.0;
    rgb.map(|value| (value / step).round() * step)
}

fn to_io(error: ImageError) -> io::Error {
    match error {
        ImageError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use image::ImageDecoder;
    use image::codecs::hdr::HdrDecoder;

    use super::*;
    use crate::output::picture::Format;
    use crate::output::picture::tests::{SIZES, bytes, speckle};

    fn decode(file: &[u8]) -> Picture {
        let decoder = HdrDecoder::new(Cursor::new(file)).unwrap();
        let (width, height) = decoder.dimensions();
        let mut raw = vec![0; decoder.total_bytes() as usize];
        decoder.read_image(&mut raw).unwrap();
        let floats: Vec<f32> = raw.chunks(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])).collect();
        Picture { width, height, rgb: floats.chunks(3).map(|c| [c[0], c[1], c[2]]).collect() }
    }

    fn one(rgb: [f32; 3]) -> [f32; 3] {
        decode(&bytes(Format::Hdr, &Picture { width: 1, height: 1, rgb: vec![rgb] }, 0.0)).rgb[0]
    }

    #[test]
    fn the_nearest_representable_colour_is_read_back() {
        for (width, height) in SIZES {
            let picture = speckle(width, height);
            let read = decode(&bytes(Format::Hdr, &picture, 0.0));
            assert_eq!((read.width, read.height), (width, height));
            let close = |a: &Picture, b: &Picture| {
                a.rgb.iter().zip(&b.rgb).all(|(a, b)| {
                    let largest = a.iter().copied().fold(0.0, f32::max);
                    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= largest / 256.0)
                })
            };
            assert!(close(&picture, &read), "{width}×{height}");
            let mut changed = read.clone();
            changed.rgb[0] = changed.rgb[0].map(|c| c * 1.02 + 0.1);
            assert!(!close(&picture, &changed));
        }
    }

    /// A line of 32768 pixels is too long for the marker of run-length encoding.
    #[test]
    fn lines_of_any_length_are_read_back() {
        for (width, has_runs) in [(7, false), (8, true), (32767, true), (32768, false), (32769, false)] {
            // A run of one colour, then different ones.
            let mut picture = speckle(width, 1);
            picture.rgb[..width as usize / 2].fill([0.5, 0.25, 0.125]);
            let file = bytes(Format::Hdr, &picture, 0.0);
            let read = decode(&file);
            assert_eq!((read.width, read.height), (width, 1));
            let expected: Vec<_> = picture.rgb.iter().map(|&rgb| nearest_rgbe(rgb)).collect();
            assert!(read.rgb == expected, "{width} pixels");
            let header =
                format!("#?RADIANCE\n# Rust HDR encoder\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X {width}\n");
            let pixels = file.strip_prefix(header.as_bytes()).unwrap();
            assert_eq!(pixels[..2] == [2, 2] && pixels[2] < 128, has_runs, "{width} pixels");
            assert!(has_runs || pixels.len() == 4 * width as usize);
            // Several lines, each of which starts with a marker.
            let picture = speckle(width, 3);
            let expected: Vec<_> = picture.rgb.iter().map(|&rgb| nearest_rgbe(rgb)).collect();
            assert!(decode(&bytes(Format::Hdr, &picture, 0.0)).rgb == expected, "3 lines of {width} pixels");
        }
    }

    #[test]
    fn long_lines_have_the_pixels_of_short_ones() {
        for rgb in [[0.0; 3], [DARKEST, 0.0, 0.0], [BRIGHTEST, 1e30, 0.0], [0.999, 0.3, 0.0], [1.0, 2.0, 3.0]]
        {
            let exact = nearest_rgbe(rgb);
            let file = bytes(Format::Hdr, &Picture { width: 1, height: 1, rgb: vec![rgb] }, 0.0);
            assert_eq!(rgbe(exact), file[file.len() - 4..], "{rgb:?}");
        }
    }

    #[test]
    fn rounding_neither_darkens_nor_brightens() {
        let picture = speckle(200, 200);
        let read = decode(&bytes(Format::Hdr, &picture, 0.0));
        let mean = |p: &Picture| p.rgb.iter().flatten().map(|&c| f64::from(c)).sum::<f64>();
        let ratio = mean(&read) / mean(&picture);
        // Truncation would give 0.998.
        assert!((ratio - 1.0).abs() < 2e-4, "{ratio}");
    }

    #[test]
    fn the_ends_of_the_range_neither_wrap_nor_vanish() {
        assert_eq!(one([1e-40, 0.0, 0.0]), [0.0; 3]);
        assert_eq!(one([DARKEST, 0.0, 0.0]), [DARKEST, 0.0, 0.0]);
        assert_eq!(one([BRIGHTEST, 0.0, 0.0]), [BRIGHTEST, 0.0, 0.0]);
        assert_eq!(one([f32::MAX, 1.0, 0.0]), [BRIGHTEST, 0.0, 0.0]);
        // A carry: the nearest 256th to 0.999 is 1, where the steps are twice as wide.
        assert_eq!(one([0.999, 0.3, 0.0]), [1.0, 0.296_875, 0.0]);
        assert_eq!(one([255.0 / 256.0, 1.0 / 256.0, 0.0]), [255.0 / 256.0, 1.0 / 256.0, 0.0]);
    }
}
