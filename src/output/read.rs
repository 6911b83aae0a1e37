//! Reads picture files of this and other programs.

use std::fs;
use std::io::{self, Cursor, ErrorKind};
use std::path::{Path, PathBuf};

use ::exr::image::{AnyChannels, FlatSamples, Layer};
use ::exr::meta::MetaData;
use ::exr::prelude::{ReadChannels, ReadLayers, read};
use ::image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use thiserror::Error;

use super::error::OutputError;
use super::picture::Format;
use crate::film::Picture;
use crate::film::tone::srgb_to_linear;

/// A picture file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The extension is missing or unknown.
    #[error("cannot read {path:?}: its name does not end in {known}")]
    UnknownFormat {
        /// The requested file.
        path: PathBuf,
        /// The known extensions, for the message.
        known: String,
    },
    /// There is no such file.
    #[error("cannot read {path:?}: there is no such file")]
    Missing {
        /// The requested file.
        path: PathBuf,
    },
    /// The path is a folder.
    #[error("cannot read {path:?}: it is a folder")]
    IsFolder {
        /// The requested file.
        path: PathBuf,
    },
    /// Another error of the operating system.
    #[error("cannot read {path:?}: {reason}")]
    Io {
        /// The requested file.
        path: PathBuf,
        /// The error.
        reason: io::Error,
    },
    /// The contents do not match the extension, or are incomplete.
    #[error("cannot read {path:?}: it is not a complete {format} file ({message})")]
    Broken {
        /// The requested file.
        path: PathBuf,
        /// The expected format.
        format: Format,
        /// The message of the decoder.
        message: String,
    },
    /// An EXR without red, green and blue.
    #[error("cannot read {path:?}: it has no channels R, G and B at full resolution, only {channels}")]
    NoColour {
        /// The requested file.
        path: PathBuf,
        /// Its channels.
        channels: String,
    },
}

/// The maximum memory of a decoder, whatever the header says: 4 GiB.
const MOST_MEMORY: u64 = 1 << 32;

/// The maximum number of pixels per byte of a file: deflate has the highest compression ratio, 1032, and a pixel has at
/// least one bit.
const MOST_PIXELS_PER_BYTE: u64 = 8 * 1032;

/// Reads a picture in the format of the extension.
///
/// PNG is assumed to be sRGB, of any bit depth, and is linearised; transparency is ignored. HDR and EXR are
/// linear. In an EXR file, the first layer with channels R, G and B is read, or with names that end in .R, .G and .B;
/// names without a prefix take precedence. The picture is the data window.
pub fn read_picture(path: &Path) -> Result<(Format, Picture), ReadError> {
    let format = Format::of(path).map_err(|error| match error {
        OutputError::UnknownFormat { path, known, .. } => ReadError::UnknownFormat { path, known },
        other => ReadError::Io { path: path.to_path_buf(), reason: io::Error::other(other) },
    })?;
    let bytes = fs::read(path).map_err(|source| {
        let path = path.to_path_buf();
        match source.kind() {
            ErrorKind::NotFound => ReadError::Missing { path },
            ErrorKind::IsADirectory => ReadError::IsFolder { path },
            _ if path.is_dir() => ReadError::IsFolder { path },
            _ => ReadError::Io { path, reason: source },
        }
    })?;
    let broken = |message: String| ReadError::Broken { path: path.to_path_buf(), format, message };
    let picture = match format {
        Format::Png => {
            let linear = |encoded: f32| srgb_to_linear(f64::from(encoded)) as f32;
            let mut picture = decode(&bytes, ImageFormat::Png).map_err(broken)?;
            picture.rgb.iter_mut().for_each(|rgb| *rgb = rgb.map(linear));
            picture
        }
        Format::Hdr => decode(&bytes, ImageFormat::Hdr).map_err(broken)?,
        Format::Exr => decode_exr(&bytes).map_err(broken)?.map_err(|channels| {
            let channels = if channels.is_empty() { "none".to_owned() } else { channels.join(", ") };
            ReadError::NoColour { path: path.to_path_buf(), channels }
        })?,
    };
    Ok((format, picture))
}

fn decode(bytes: &[u8], format: ImageFormat) -> Result<Picture, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_MEMORY);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|error| error.to_string())?;
    let (width, height) = decoder.dimensions();
    check_size(bytes, u64::from(width), u64::from(height), 1)?;
    if decoder.total_bytes() > MOST_MEMORY {
        return Err(format!("its {width}×{height} pixels need more than 4 GiB of memory"));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|error| error.to_string())?;
    let (width, height) = (image.width(), image.height());
    let rgb = image.into_rgb32f().pixels().map(|pixel| pixel.0).collect();
    Ok(Picture { width, height, rgb })
}

/// Rejects a picture whose header describes more data than its bytes can contain, before allocating memory.
fn check_size(bytes: &[u8], width: u64, height: u64, channels: u64) -> Result<(), String> {
    let samples = width.saturating_mul(height).saturating_mul(channels);
    if samples > (bytes.len() as u64).saturating_mul(MOST_PIXELS_PER_BYTE) {
        return Err(format!(
            "its header describes {width}×{height} pixels, too many for {} bytes",
            bytes.len()
        ));
    }
    Ok(())
}

/// The picture, or the names of all channels if there is no red, green and blue.
fn decode_exr(bytes: &[u8]) -> Result<Result<Picture, Vec<String>>, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.x(), header.layer_size.y()].map(|side| side as u64);
        check_size(bytes, width, height, header.channels.list.len() as u64)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| error.to_string())?;
    let coloured = image.layer_data.iter().find_map(|layer| Some((layer, plain_colour(layer)?)));
    let coloured =
        coloured.or_else(|| image.layer_data.iter().find_map(|layer| Some((layer, prefixed_colour(layer)?))));
    let Some((layer, channels)) = coloured else {
        let channels = image.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
        return Ok(Err(channels.map(|channel| channel.name.to_string()).collect()));
    };
    let [r, g, b] = channels.map(FlatSamples::values_as_f32);
    let rgb = r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
    let side = |length: usize| u32::try_from(length).map_err(|_| "it is too large".to_owned());
    Ok(Ok(Picture { width: side(layer.size.width())?, height: side(layer.size.height())?, rgb }))
}

type FlatLayer = Layer<AnyChannels<FlatSamples>>;

/// Channels named R, G and B, case-insensitive.
fn plain_colour(layer: &FlatLayer) -> Option<[&FlatSamples; 3]> {
    colour(layer, "")
}

/// Channels with a common prefix, like those of Blender's "ViewLayer.Combined.R".
fn prefixed_colour(layer: &FlatLayer) -> Option<[&FlatSamples; 3]> {
    layer.channel_data.list.iter().find_map(|channel| {
        let name = channel.name.to_string();
        let dot = name.rfind('.')?;
        colour(layer, &name[..=dot])
    })
}

fn colour<'a>(layer: &'a FlatLayer, prefix: &str) -> Option<[&'a FlatSamples; 3]> {
    let find = |last: &str| {
        let wanted = format!("{prefix}{last}");
        let channels = &mut layer.channel_data.list.iter();
        let found = channels.find(|channel| channel.name.to_string().eq_ignore_ascii_case(&wanted))?;
        // Chroma may be stored at half resolution; red, green and blue hardly ever are.
        (found.sampling.x() == 1 && found.sampling.y() == 1).then_some(&found.sample_data)
    };
    Some([find("R")?, find("G")?, find("B")?])
}

#[cfg(test)]
mod tests {
    use ::exr::prelude::{AnyChannel, Encoding, Image, LayerAttributes, WritableImage, f16};

    use super::*;
    use crate::film::{ToneMap, ViewTransform};
    use crate::output::picture::tests::speckle;
    use crate::output::{PictureOptions, write_picture};

    fn in_folder(name: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        (folder, path)
    }

    #[test]
    fn written_pictures_are_read_back() {
        let picture = speckle(17, 5);
        for (name, tolerance) in [("a.exr", 0.0), ("a.HDR", 1.0 / 256.0)] {
            let (_folder, path) = in_folder(name);
            write_picture(&path, &picture, &PictureOptions::default()).unwrap();
            let (_, read) = read_picture(&path).unwrap();
            assert_eq!((read.width, read.height), (17, 5));
            for (read, written) in read.rgb.iter().zip(&picture.rgb) {
                let largest = written.iter().copied().fold(0.0, f32::max);
                for channel in 0..3 {
                    assert!((read[channel] - written[channel]).abs() <= tolerance * largest, "{name}");
                }
            }
        }
    }

    #[test]
    fn hdr_lines_of_any_length_are_read() {
        for width in [32767, 32768, 32769] {
            let picture = speckle(width, 1);
            let (_folder, path) = in_folder("a.hdr");
            write_picture(&path, &picture, &PictureOptions::default()).unwrap();
            let (_, read) = read_picture(&path).unwrap();
            assert_eq!((read.width, read.height), (width, 1));
            for (read, written) in read.rgb.iter().zip(&picture.rgb) {
                let largest = written.iter().copied().fold(0.0, f32::max);
                for channel in 0..3 {
                    assert!((read[channel] - written[channel]).abs() <= largest / 256.0, "{width} pixels");
                }
            }
        }
    }

    #[test]
    fn a_png_is_linearised() {
        let picture = speckle(9, 7);
        let (_folder, path) = in_folder("a.png");
        write_picture(
            &path,
            &picture,
            &PictureOptions { view: ViewTransform::exposed(-1.0), ..PictureOptions::default() },
        )
        .unwrap();
        let (format, read) = read_picture(&path).unwrap();
        assert_eq!(format, Format::Png);
        let (shown, again) =
            (ToneMap::new(ViewTransform::exposed(-1.0)), ToneMap::new(ViewTransform::default()));
        for (read, written) in read.rgb.iter().zip(&picture.rgb) {
            assert_eq!(again.encode(*read), shown.encode(*written));
        }
        // Half the linear value of white in sRGB: (188/255 + 0.055)/1.055 to the power of 2.4.
        assert!((srgb_to_linear(188.0 / 255.0) - 0.502_886).abs() < 1e-6);
    }

    #[test]
    fn pngs_of_other_depths_and_colours_are_read_too() {
        let (folder, grey) = in_folder("grey.png");
        image::GrayImage::from_pixel(3, 2, image::Luma([255])).save(&grey).unwrap();
        assert_eq!(read_picture(&grey).unwrap().1.rgb, [[1.0; 3]; 6]);
        let deep = folder.path().join("deep.png");
        let pixel = image::Rgba([65_535u16, 0, 32_768, 9]);
        image::ImageBuffer::from_pixel(1, 1, pixel).save(&deep).unwrap();
        let [r, g, b] = read_picture(&deep).unwrap().1.rgb[0];
        assert_eq!((r, g), (1.0, 0.0));
        assert!((f64::from(b) - srgb_to_linear(32_768.0 / 65_535.0)).abs() < 1e-6);
    }

    fn layer(names: &[&str], sample: impl Fn(usize) -> FlatSamples) -> FlatLayer {
        let channel = |(i, name): (usize, &&str)| AnyChannel::new(*name, sample(i));
        let list = names.iter().enumerate().map(channel).collect();
        let encoding = Encoding::SMALL_LOSSLESS;
        Layer::new((1, 1), LayerAttributes::default(), encoding, AnyChannels::sort(list))
    }

    fn read_layer(names: &[&str], sample: impl Fn(usize) -> FlatSamples) -> Result<[f32; 3], ReadError> {
        let (_folder, path) = in_folder("a.exr");
        let file = fs::File::create(&path).unwrap();
        Image::from_layer(layer(names, sample)).write().to_buffered(io::BufWriter::new(file)).unwrap();
        read_picture(&path).map(|(_, picture)| picture.rgb[0])
    }

    #[test]
    fn red_green_and_blue_are_found_in_any_order_type_and_layer() {
        let half = |i: usize| FlatSamples::F16(vec![f16::from_f32(i as f32)]);
        let single = |i: usize| FlatSamples::F32(vec![i as f32]);
        assert_eq!(read_layer(&["A", "B", "G", "R"], half).unwrap(), [3.0, 2.0, 1.0]);
        assert_eq!(read_layer(&["r", "g", "b"], single).unwrap(), [0.0, 1.0, 2.0]);
        let blender = ["View.Depth.Z", "View.Noisy.R", "View.Noisy.G", "View.Noisy.B"];
        assert_eq!(read_layer(&blender, single).unwrap(), [1.0, 2.0, 3.0]);
        // Names without a prefix take precedence, whatever the alphabetical order.
        assert_eq!(read_layer(&["AA.R", "AA.G", "AA.B", "R", "G", "B"], single).unwrap(), [3.0, 4.0, 5.0]);
    }

    #[test]
    fn the_channels_of_an_exr_without_colour_are_listed() {
        let single = |i: usize| FlatSamples::F32(vec![i as f32]);
        let error = read_layer(&["Y", "Z", "a.R", "b.G", "c.B"], single).unwrap_err();
        assert!(error.to_string().ends_with("only Y, Z, a.R, b.G, c.B"), "{error}");
    }

    /// A small file whose header describes a picture of 60,000 × 60,000 pixels.
    fn vast(name: &str) -> Vec<u8> {
        let (_folder, path) = in_folder(name);
        write_picture(&path, &speckle(4, 3), &PictureOptions::default()).unwrap();
        let mut bytes = fs::read(&path).unwrap();
        match Format::of(&path).unwrap() {
            Format::Png => {
                bytes[16..24].copy_from_slice(&[60_000_u32.to_be_bytes(); 2].concat());
                // Over the chunk's name and contents.
                let step = |rest: u32, _| if rest & 1 == 1 { 0xedb8_8320 ^ rest >> 1 } else { rest >> 1 };
                let sum = |rest: u32, byte: &u8| (0..8).fold(rest ^ u32::from(*byte), step);
                let sum = !bytes[12..29].iter().fold(u32::MAX, sum);
                bytes[29..33].copy_from_slice(&sum.to_be_bytes());
            }
            Format::Hdr => {
                let at = bytes.windows(9).position(|these| these == b"-Y 3 +X 4").unwrap();
                bytes.splice(at..at + 9, *b"-Y 60000 +X 60000");
            }
            Format::Exr => {
                for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
                    let at = bytes.windows(window.len()).position(|these| these == window).unwrap();
                    let corner = at + window.len() + 4 + 8;
                    bytes[corner..corner + 8].copy_from_slice(&[59_999_u32.to_le_bytes(); 2].concat());
                }
            }
        }
        bytes
    }

    #[test]
    fn a_header_that_describes_more_than_the_file_can_contain_is_refused() {
        for name in ["a.png", "a.hdr", "a.exr"] {
            let (_folder, path) = in_folder(name);
            fs::write(&path, vast(name)).unwrap();
            let error = read_picture(&path).unwrap_err().to_string();
            assert!(error.contains("describes 60000×60000 pixels, too many for"), "{name}: {error}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |path: &Path| read_picture(path).unwrap_err();
        for name in ["a.png", "a.exr", "a.hdr"] {
            let path = folder.path().join(name);
            assert!(matches!(refused(&path), ReadError::Missing { .. }), "{name}");
            for garbage in [&b""[..], b"garbage", &[0xff; 4096]] {
                fs::write(&path, garbage).unwrap();
                assert!(matches!(refused(&path), ReadError::Broken { .. }), "{name}");
            }
            // A truncated file.
            write_picture(&path, &speckle(40, 30), &PictureOptions::default()).unwrap();
            let whole = fs::read(&path).unwrap();
            for length in [8, whole.len() / 2] {
                fs::write(&path, &whole[..length]).unwrap();
                assert!(matches!(refused(&path), ReadError::Broken { .. }), "{name} cut to {length}");
            }
            fs::remove_file(&path).unwrap();
            fs::create_dir(&path).unwrap();
            assert!(matches!(refused(&path), ReadError::IsFolder { .. }), "{name}");
        }
        for name in ["a.jpg", "a", "png"] {
            let error = refused(&folder.path().join(name)).to_string();
            assert!(error.contains("does not end in .png, .exr or .hdr"), "{error}");
        }
    }
}
