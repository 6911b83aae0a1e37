//! Decoding of picture files at their own depth.

use super::access;
use super::decode_exr::decode_exr;
use super::fault::{EXTENSIONS, LONGEST_SIDE, MOST_BYTES, PictureError, check_header, check_size};
use super::picture::{Depth, Picture};
use ::image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::fs::{self, File};
use std::io::{self, Cursor, ErrorKind, Read as _};
use std::path::Path;
use tiff::decoder::DecodingResult;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Reads a picture file, whose format is given by its extension, into at most `room` bytes.
pub fn read(path: &Path, room: u64) -> Result<Picture, PictureError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let extension = extension.to_ascii_lowercase();
    if !EXTENSIONS.contains(&extension.as_str()) {
        return Err(PictureError::UnknownFormat);
    }
    let failed = |error: io::Error| match error.kind() {
        ErrorKind::NotFound => PictureError::Missing,
        _ => PictureError::Io(error),
    };
    access::opening(path).map_err(failed)?;
    if fs::metadata(path).map_err(failed)?.is_dir() {
        return Err(PictureError::IsFolder);
    }
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes)).map_err(failed)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(PictureError::FileTooLarge);
    }
    decode_within(&extension, &bytes, room)
}

/// Decodes the bytes of a file with this extension, in lower case.
///
/// Transparency is ignored, palettes are looked up, and depths below eight bits become eight.
pub fn decode(extension: &str, bytes: &[u8]) -> Result<Picture, PictureError> {
    decode_within(extension, bytes, MOST_BYTES)
}

/// The same with a limit of `room` bytes. Larger pictures are refused before memory is allocated.
pub(super) fn decode_within(extension: &str, bytes: &[u8], room: u64) -> Result<Picture, PictureError> {
    match extension {
        "png" => by_image(bytes, room, ImageFormat::Png, "PNG", true),
        "tga" => by_image(bytes, room, ImageFormat::Tga, "TGA", false),
        "bmp" => by_image(bytes, room, ImageFormat::Bmp, "BMP", false),
        "webp" => by_image(bytes, room, ImageFormat::WebP, "WebP", false),
        "hdr" => by_image(bytes, room, ImageFormat::Hdr, "Radiance HDR", false),
        "jpg" | "jpeg" => decode_jpeg(bytes, room),
        "tif" | "tiff" => decode_tiff(bytes, room),
        "exr" => decode_exr(bytes, room),
        _ => Err(PictureError::UnknownFormat),
    }
}

fn by_image(
    bytes: &[u8],
    room: u64,
    format: ImageFormat,
    name: &'static str,
    is_deflated: bool,
) -> Result<Picture, PictureError> {
    let broken = |error: ::image::ImageError| PictureError::Broken(name, error.to_string());
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(2 * MOST_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let colour = decoder.color_type();
    check_size(width.into(), height.into(), colour.bytes_per_pixel().into(), room)?;
    if is_deflated {
        check_header(width.into(), height.into(), bytes)?;
    }
    let stored = u32::from(colour.channel_count());
    let depth = match colour {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Depth::Bits8,
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Depth::Bits16,
        ColorType::Rgb32F | ColorType::Rgba32F => Depth::Float,
        other => {
            return Err(PictureError::Unsupported(format!("textures do not support pictures of {other:?}")));
        }
    };
    let mut own = vec![0; decoder.total_bytes() as usize];
    decoder.read_image(&mut own).map_err(broken)?;
    into_little_endian(&mut own, depth);
    Ok(Picture::new([width, height], [if stored < 3 { 1 } else { 3 }, stored], depth, &own))
}

/// Numbers are in this machine's byte order.
fn into_little_endian(bytes: &mut [u8], depth: Depth) {
    if cfg!(target_endian = "big") {
        bytes.chunks_exact_mut(depth.bytes()).for_each(<[u8]>::reverse);
    }
}

/// The crate is built without its SIMD paths, so that all processors compute the same bytes.
fn decode_jpeg(bytes: &[u8], room: u64) -> Result<Picture, PictureError> {
    let broken = |error: &dyn std::fmt::Debug| PictureError::Broken("JPEG", format!("{error:?}"));
    let side = LONGEST_SIDE as usize;
    let options = DecoderOptions::default().set_max_width(side).set_max_height(side).set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|error| broken(&error))?;
    let (width, height) = decoder.dimensions().ok_or_else(|| broken(&"no size"))?;
    let is_grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let channels = if is_grey { 1 } else { 3 };
    check_size(width as u64, height as u64, channels.into(), room)?;
    let out = if is_grey { ColorSpace::Luma } else { ColorSpace::RGB };
    decoder.set_options(options.jpeg_set_out_colorspace(out));
    let own = decoder.decode().map_err(|error| broken(&error))?;
    if own.len() != width * height * channels as usize {
        return Err(broken(&"texels are missing"));
    }
    Ok(Picture::new([width as u32, height as u32], [channels; 2], Depth::Bits8, &own))
}

fn decode_tiff(bytes: &[u8], room: u64) -> Result<Picture, PictureError> {
    let broken = |error: tiff::TiffError| match error {
        tiff::TiffError::UnsupportedError(error) => PictureError::Unsupported(error.to_string()),
        error => PictureError::Broken("TIFF", error.to_string()),
    };
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = MOST_BYTES as usize;
    limits.intermediate_buffer_size = MOST_BYTES as usize;
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(bytes)).map_err(broken)?.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(broken)?;
    let colour = decoder.colortype().map_err(broken)?;
    let stored = match colour {
        tiff::ColorType::Gray(_) => 1,
        tiff::ColorType::GrayA(_) => 2,
        tiff::ColorType::RGB(_) => 3,
        tiff::ColorType::RGBA(_) => 4,
        other => return Err(PictureError::Unsupported(format!("textures do not support TIFF of {other:?}"))),
    };
    let texel = u64::from(stored) * u64::from(colour.bit_depth()).div_ceil(8);
    check_size(width.into(), height.into(), texel, room)?;
    check_header(width.into(), height.into(), bytes)?;
    let (depth, own) = match decoder.read_image().map_err(broken)? {
        DecodingResult::U8(own) if colour.bit_depth() == 8 => (Depth::Bits8, own),
        DecodingResult::U16(own) if colour.bit_depth() == 16 => {
            (Depth::Bits16, own.into_iter().flat_map(u16::to_le_bytes).collect())
        }
        DecodingResult::F16(own) => {
            (Depth::Half, own.into_iter().flat_map(|x| x.to_bits().to_le_bytes()).collect())
        }
        DecodingResult::F32(own) => (Depth::Float, own.into_iter().flat_map(f32::to_le_bytes).collect()),
        _ => {
            let message = "textures support TIFF of 8 or 16 bits or of floats";
            return Err(PictureError::Unsupported(message.to_owned()));
        }
    };
    if own.len() as u64 != u64::from(width) * u64::from(height) * u64::from(stored) * depth.bytes() as u64 {
        return Err(PictureError::Unsupported(
            "textures do not support TIFF with separate planes for the channels".to_owned(),
        ));
    }
    Ok(Picture::new([width, height], [if stored < 3 { 1 } else { 3 }, stored], depth, &own))
}
