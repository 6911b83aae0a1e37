//! Picture files.

use super::super::decode::decode_within;
use super::super::fault::LONGEST_SIDE;
use super::super::{
    EXTENSIONS, FilesError, MOST_BYTES, MOST_BYTES_IN_ALL, PictureError, decode, read, read_files,
};
use super::*;
use ::image::{DynamicImage, ImageFormat};
use exr::prelude::{WritableImage, f16};
use std::io::Cursor;

/// Encoded numbers of a picture of 3×2, the uppermost row first.
fn numbers(count: usize) -> Vec<u8> {
    (0..count).map(|i| (i * 37 % 251) as u8).collect()
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("encoded");
    bytes.into_inner()
}

fn rgb8() -> DynamicImage {
    DynamicImage::ImageRgb8(::image::RgbImage::from_raw(3, 2, numbers(18)).expect("a picture"))
}

fn tiff_of_16_bits() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).expect("an encoder");
    let data: Vec<u16> = numbers(18).into_iter().map(|x| u16::from(x) * 257).collect();
    encoder.write_image::<tiff::encoder::colortype::RGB16>(3, 2, &data).expect("written");
    bytes.into_inner()
}

fn exr() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let channels = exr::image::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let x = f16::from_f32((at.y() * 3 + at.x()) as f32 / 8.0);
        (x, f16::from_f32(2.0), f16::NAN)
    });
    exr::image::Image::from_channels((3, 2), channels).write().to_buffered(&mut bytes).expect("written");
    bytes.into_inner()
}

#[test]
fn pictures_keep_their_depth_and_channels() {
    let grey =
        DynamicImage::ImageLumaA8(::image::GrayAlphaImage::from_raw(3, 2, numbers(12)).expect("a picture"));
    let deep = DynamicImage::ImageRgb16(
        ::image::ImageBuffer::from_raw(3, 2, numbers(18).into_iter().map(|x| u16::from(x) * 257).collect())
            .expect("a picture"),
    );
    let light = DynamicImage::ImageRgb32F(
        ::image::ImageBuffer::from_raw(3, 2, (0..18).map(|i| i as f32 / 4.0).collect()).expect("a picture"),
    );
    for (extension, bytes, channels, depth) in [
        ("png", encoded(&rgb8(), ImageFormat::Png), 3, Depth::Bits8),
        ("png", encoded(&grey, ImageFormat::Png), 1, Depth::Bits8),
        ("png", encoded(&deep, ImageFormat::Png), 3, Depth::Bits16),
        ("tga", encoded(&rgb8(), ImageFormat::Tga), 3, Depth::Bits8),
        ("bmp", encoded(&rgb8(), ImageFormat::Bmp), 3, Depth::Bits8),
        ("webp", encoded(&rgb8(), ImageFormat::WebP), 3, Depth::Bits8),
        ("tif", tiff_of_16_bits(), 3, Depth::Bits16),
        ("hdr", encoded(&light, ImageFormat::Hdr), 3, Depth::Float),
        ("exr", exr(), 3, Depth::Half),
    ] {
        let picture = decode(extension, &bytes).unwrap_or_else(|error| panic!("{extension}: {error}"));
        assert_eq!([picture.width(), picture.height(), picture.channels()], [3, 2, channels], "{extension}");
        assert_eq!(picture.depth(), depth, "{extension}");
        // The lower left texel is the first of the second row.
        let stored = if channels == 1 { 2 } else { 3 };
        let first = numbers(18)[3 * stored];
        let expected = match (extension, depth) {
            ("hdr", _) => (9.0_f32 / 4.0).to_bits(),
            ("exr", _) => f16::from_f32(3.0 / 8.0).to_bits().into(),
            (_, Depth::Bits16) => u32::from(first) * 257,
            _ => u32::from(first),
        };
        assert_eq!(picture.number(0), expected, "{extension}");
    }
}

/// Made by ImageMagick, which decodes with libjpeg-turbo:
/// `convert -size 32x24 gradient:red-blue -quality 80 -sampling-factor 2x2 gradient.jpg` and
/// `convert gradient.jpg -depth 8 rgb:gradient.rgb`.
#[test]
fn a_jpeg_matches_another_decoder() {
    let picture = decode("jpg", include_bytes!("gradient.jpg")).expect("a picture");
    assert_eq!([picture.width(), picture.height(), picture.channels()], [32, 24, 3]);
    let expected = Picture::new([32, 24], [3, 3], Depth::Bits8, include_bytes!("gradient.rgb"));
    let off = (0..32 * 24 * 3).map(|i| picture.number(i).abs_diff(expected.number(i))).max();
    // Decoders differ in rounding, and in interpolation between the colours of neighbours.
    assert!(off <= Some(8), "{off:?}");
    // Negative control: upside down the picture differs.
    assert!(picture.number(0).abs_diff(expected.number(23 * 32 * 3)) > 200);
}

/// The bytes of the decoder's scalar path. Its SIMD paths are disabled in `Cargo.toml`; these, or another version,
/// would change the pictures of existing films.
#[test]
fn a_jpeg_gives_the_same_bytes_on_every_processor() {
    let picture = decode("jpg", include_bytes!("gradient.jpg")).expect("a picture");
    let hash = |picture: &Picture| {
        let numbers = (0..32 * 24 * 3).map(|i| picture.number(i));
        numbers
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, x| (hash ^ u64::from(x)).wrapping_mul(0x0100_0000_01b3))
    };
    assert_eq!(hash(&picture), 13_292_122_530_178_424_645);
    let other = Picture::new([32, 24], [3, 3], Depth::Bits8, include_bytes!("gradient.rgb"));
    assert_ne!(hash(&other), hash(&picture), "a negative control: the other decoder rounds differently");
}

#[test]
fn incomplete_files_are_refused() {
    for (extension, bytes) in [
        ("png", encoded(&rgb8(), ImageFormat::Png)),
        ("tga", encoded(&rgb8(), ImageFormat::Tga)),
        ("bmp", encoded(&rgb8(), ImageFormat::Bmp)),
        ("webp", encoded(&rgb8(), ImageFormat::WebP)),
        ("tif", tiff_of_16_bits()),
        ("exr", exr()),
        ("jpg", include_bytes!("gradient.jpg").to_vec()),
    ] {
        for length in [0, 5, bytes.len() / 2] {
            assert!(decode(extension, &bytes[..length]).is_err(), "{length} bytes of a {extension}");
        }
        let mut noise = bytes.clone();
        noise.iter_mut().take(12).for_each(|byte| *byte ^= 0x5a);
        assert!(decode(extension, &noise).is_err(), "{extension}");
    }
}

/// A PNG of one row with a modified header.
fn png_with_header(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = encoded(&rgb8(), ImageFormat::Png);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let crc = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    bytes
}

/// The checksum of PNG.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |mut crc, byte| {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        }
        crc
    })
}

#[test]
fn wrong_sizes_in_headers_allocate_no_memory() {
    assert!(decode("png", &png_with_header(3, 2)).is_ok(), "a header that is not wrong");
    assert!(matches!(decode("png", &png_with_header(70_000, 2)), Err(PictureError::TooLarge(70_000, 2))));
    assert!(matches!(decode("png", &png_with_header(30_000, 30_000)), Err(PictureError::TooLarge(..))));
    assert!(matches!(decode("png", &png_with_header(10_000, 10_000)), Err(PictureError::TooFewBytes(..))));
    assert!(matches!(decode("png", &png_with_header(300, 200)), Err(PictureError::Broken("PNG", _))));
    let mut bmp = encoded(&rgb8(), ImageFormat::Bmp);
    bmp[18..22].copy_from_slice(&60_000_i32.to_le_bytes());
    bmp[22..26].copy_from_slice(&60_000_i32.to_le_bytes());
    let error = decode("bmp", &bmp);
    assert!(matches!(error, Err(PictureError::TooLarge(60_000, 60_000))), "{error:?}");
    let mut tga = encoded(&rgb8(), ImageFormat::Tga);
    tga[12..16].copy_from_slice(&[0xff; 4]);
    let error = decode("tga", &tga);
    assert!(matches!(error, Err(PictureError::TooLarge(65_535, 65_535))), "{error:?}");
}

#[test]
fn other_files_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    std::fs::write(folder.path().join("notes.txt"), "no picture").expect("written");
    let error = |name: &str| read(&folder.path().join(name), MOST_BYTES).expect_err(name);
    assert!(matches!(error("nothing.png"), PictureError::Missing));
    assert!(matches!(error("folder.png"), PictureError::IsFolder));
    assert!(matches!(error("notes.txt"), PictureError::UnknownFormat));
    let told = PictureError::UnknownFormat.to_string();
    assert!(EXTENSIONS.iter().all(|extension| told.contains(extension)), "{told}");
}

#[test]
fn tiles_are_found_by_their_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str| {
        std::fs::write(folder.path().join(name), encoded(&rgb8(), ImageFormat::Png)).expect("written");
    };
    for name in ["wall.1001.png", "wall.1013.png", "wall.2001.png", "wall.png"] {
        write(name);
    }
    let mut room = MOST_BYTES_IN_ALL;
    let image = read_files(folder.path(), "wall.<UDIM>.png", &mut room).expect("tiles");
    let numbers: Vec<_> = image.tiles.iter().map(|tile| tile.number).collect();
    assert!(image.is_tiled && numbers == [1001, 1013] && image.places() == 20);
    let none = read_files(folder.path(), "roof.<UDIM>.png", &mut room);
    assert!(matches!(none, Err(FilesError::NoTile { .. })));
    let one = read_files(folder.path(), "wall.png", &mut room).expect("a picture");
    assert!(!one.is_tiled && one.tiles.len() == 1);
}

#[test]
fn wrong_numbers_of_tiles_are_reported() {
    let of = |is_tiled, numbers: &[u32]| {
        let tile = |&number| Tile { number, picture: Arc::new(Picture::black()) };
        ImageFile { name: "wall".into(), is_tiled, tiles: numbers.iter().map(tile).collect() }.objection()
    };
    for (is_tiled, numbers) in [(false, &[1001][..]), (true, &[1001]), (true, &[1999, 1001, 1013])] {
        assert_eq!(of(is_tiled, numbers), None, "{numbers:?}");
    }
    for (is_tiled, numbers, told) in [
        (true, &[][..], "an image has no tiles"),
        (true, &[1001, 1000], "the number of a tile must be from 1001 to 1999, not 1000"),
        (true, &[u32::MAX], "the number of a tile must be from 1001 to 1999, not 4294967295"),
        (true, &[1013, 1001, 1013], "an image has two tiles with the number 1013"),
        (false, &[], "an image without tiles has one picture, with the number 1001"),
        (false, &[1002], "an image without tiles has one picture, with the number 1001"),
        (false, &[1001, 1002], "an image without tiles has one picture, with the number 1001"),
    ] {
        assert_eq!(of(is_tiled, numbers).as_deref(), Some(told), "{numbers:?}");
    }
}

#[test]
fn pictures_above_the_memory_limit_are_refused_by_their_headers() {
    for (extension, bytes, taken) in [
        ("png", encoded(&rgb8(), ImageFormat::Png), 18),
        ("tga", encoded(&rgb8(), ImageFormat::Tga), 18),
        ("bmp", encoded(&rgb8(), ImageFormat::Bmp), 18),
        ("webp", encoded(&rgb8(), ImageFormat::WebP), 18),
        ("tif", tiff_of_16_bits(), 36),
        ("exr", exr(), 36),
        ("jpg", include_bytes!("gradient.jpg").to_vec(), 32 * 24 * 3),
    ] {
        assert!(decode_within(extension, &bytes, taken).is_ok(), "{extension}");
        let error = decode_within(extension, &bytes, taken - 1);
        assert!(matches!(error, Err(PictureError::TooMuchInAll(..))), "{extension}: {error:?}");
    }
    let told = PictureError::TooMuchInAll(3, 2).to_string();
    assert_eq!(told, "with this picture of 3×2 texels the pictures of the scene take more than 8 GiB in all");
}

#[test]
fn tiles_share_the_memory_limit() {
    let folder = tempfile::tempdir().expect("a folder");
    for number in [1001, 1002, 1003] {
        let path = folder.path().join(format!("wall.{number}.png"));
        std::fs::write(path, encoded(&rgb8(), ImageFormat::Png)).expect("written");
    }
    let own = decode("png", &encoded(&rgb8(), ImageFormat::Png)).expect("a picture").bytes() as u64;
    let mut room = 3 * own;
    assert!(read_files(folder.path(), "wall.<UDIM>.png", &mut room).is_ok());
    assert_eq!(room, 0);
    let mut room = 2 * own + 17;
    let error = read_files(folder.path(), "wall.<UDIM>.png", &mut room).expect_err("too much");
    let FilesError::Picture { path, error: PictureError::TooMuchInAll(3, 2) } = &error else {
        panic!("{error}")
    };
    assert!(path.ends_with("wall.1003.png"), "{error}");
}

#[test]
fn the_description_of_an_image_states_its_limits() {
    use crate::parameter::Family as _;
    let declaration = TextureKind::from(plain()).declaration().expect("a declaration");
    let file = declaration.parameters.iter().find(|parameter| parameter.name == "file").expect("a file");
    let limits = format!("at most {LONGEST_SIDE} texels a side and {} GiB", MOST_BYTES >> 30);
    assert!(file.about.contains(&limits), "{}: no {limits}", file.about);
}
