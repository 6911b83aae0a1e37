//! PNG: 8-bit RGB, marked as sRGB.

use std::io::{self, Write};

use ::png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

/// Writes 8-bit sRGB pixels, row-major from the top left.
pub fn encode(width: u32, height: u32, pixels: &[[u8; 3]], out: &mut impl Write) -> io::Result<()> {
    let mut encoder = Encoder::new(out, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    // Radiance was clamped, not compressed: colours inside the gamut are to be shown unchanged.
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header().map_err(to_io)?;
    writer.write_image_data(pixels.as_flattened()).map_err(to_io)?;
    writer.finish().map_err(to_io)
}

fn to_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::super::picture::Format;
    use super::super::picture::tests::{SIZES, bytes, speckle};
    use crate::film::{ToneMap, ViewTransform};

    fn decode(file: &[u8]) -> (::png::Info<'static>, Vec<[u8; 3]>) {
        let mut reader = ::png::Decoder::new(Cursor::new(file)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        (reader.info().clone(), pixels.chunks(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect())
    }

    #[test]
    fn the_tone_mapped_picture_is_read_back() {
        for (width, height) in SIZES {
            let mut picture = speckle(width, height);
            let (info, pixels) = decode(&bytes(Format::Png, &picture, -2.0));
            assert_eq!((info.width, info.height), (width, height));
            let tone = ToneMap::new(ViewTransform::exposed(-2.0));
            let expected = |rgb: &[[f32; 3]]| rgb.iter().map(|&rgb| tone.encode(rgb)).collect::<Vec<_>>();
            assert_eq!(pixels, expected(&picture.rgb));
            picture.rgb[0][1] += 0.3;
            assert_ne!(pixels, expected(&picture.rgb));
        }
    }

    #[test]
    fn the_file_is_marked_as_srgb_and_has_no_other_metadata() {
        let file = bytes(Format::Png, &speckle(3, 2), 0.0);
        let (info, _) = decode(&file);
        assert_eq!(info.srgb, Some(::png::SrgbRenderingIntent::RelativeColorimetric));
        let mut chunks = Vec::new();
        let mut rest = &file[8..];
        while let [a, b, c, d, tail @ ..] = rest {
            let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
            chunks.push(String::from_utf8_lossy(&tail[..4]).into_owned());
            rest = &tail[4 + length + 4..];
        }
        chunks.dedup();
        assert_eq!(chunks, ["IHDR", "sRGB", "IDAT", "IEND"]);
    }
}
