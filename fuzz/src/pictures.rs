//! Valid pictures of the kinds that other programs write.

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, WritableImage, f16,
};
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;

const WIDTH: u32 = 11;
const HEIGHT: u32 = 5;

/// Pixels with and without runs.
fn value(i: usize) -> f32 {
    if i.is_multiple_of(3) { 0.5 } else { (i * i % 17) as f32 / 4.0 }
}

pub fn png() -> Vec<Vec<u8>> {
    let grey =
        DynamicImage::from(image::GrayImage::from_fn(WIDTH, HEIGHT, |x, y| image::Luma([(x * y) as u8])));
    let coloured =
        image::RgbaImage::from_fn(WIDTH, HEIGHT, |x, y| image::Rgba([x as u8, y as u8, 7, (x * y) as u8]));
    let coloured = DynamicImage::from(coloured);
    let deep = [grey.to_luma16().into(), coloured.to_rgba16().into()];
    let mut files: Vec<Vec<u8>> = [grey, coloured.to_rgb8().into(), coloured]
        .into_iter()
        .chain(deep)
        .map(|picture: DynamicImage| {
            let mut file = Cursor::new(Vec::new());
            picture.write_to(&mut file, ImageFormat::Png).expect("a picture in memory");
            file.into_inner()
        })
        .collect();
    for (depth, per_byte) in [(png::BitDepth::One, 8), (png::BitDepth::Four, 2), (png::BitDepth::Eight, 1)] {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, WIDTH, HEIGHT);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(depth);
        encoder.set_palette(vec![0, 0, 0, 255, 0, 128]);
        encoder.set_trns(vec![255, 0]);
        let mut writer = encoder.write_header().expect("a header in memory");
        let row = (WIDTH as usize).div_ceil(per_byte);
        writer.write_image_data(&vec![0; row * HEIGHT as usize]).expect("rows in memory");
        writer.finish().expect("an end in memory");
        files.push(file);
    }
    files
}

pub fn hdr() -> Vec<Vec<u8>> {
    let head = |more: &str, order: &str| format!("#?RADIANCE\n{more}FORMAT=32-bit_rle_rgbe\n\n{order}\n");
    let pixels: Vec<[u8; 4]> =
        (0..(WIDTH * HEIGHT) as usize).map(|i| [value(i) as u8 * 16, (i % 3) as u8 * 80, 128, 129]).collect();
    let plain = format!("-Y {HEIGHT} +X {WIDTH}");
    let flat = [head("", &plain).as_bytes(), pixels.as_flattened()].concat();
    // Runs, for each component separately.
    let mut runs =
        head("EXPOSURE=0.5\nPRIMARIES=0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n", &plain).into_bytes();
    for row in pixels.chunks(WIDTH as usize) {
        runs.extend([2, 2, (WIDTH >> 8) as u8, WIDTH as u8]);
        for channel in 0..4 {
            runs.extend([128 + 5, row[0][channel], WIDTH as u8 - 5]);
            runs.extend(row[5..].iter().map(|pixel| pixel[channel]));
        }
    }
    // The old encoding: a pixel of ones repeats the previous one.
    let mut old = head("", "-Y 1 +X 11").into_bytes();
    old.extend([10, 20, 30, 128, 1, 1, 1, 10]);
    let turned = [head("", &format!("+X {WIDTH} -Y {HEIGHT}")).as_bytes(), pixels.as_flattened()].concat();
    vec![flat, runs, old, turned]
}

pub fn exr() -> Vec<Vec<u8>> {
    let kinds = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ];
    let tiles = Blocks::Tiles(exr::prelude::Vec2(4, 4));
    let mut files = Vec::new();
    for (i, compression) in kinds.into_iter().enumerate() {
        for blocks in [Blocks::ScanLines, tiles] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let length = (WIDTH * HEIGHT) as usize;
            let half = || FlatSamples::F16((0..length).map(|i| f16::from_f32(value(i))).collect());
            let single = || FlatSamples::F32((0..length).map(value).collect());
            let channel = |name: &str| AnyChannel::new(name, if i % 2 == 0 { half() } else { single() });
            let list = ["A", "B", "G", "R"].into_iter().map(channel);
            let list =
                list.chain([AnyChannel::new("id", FlatSamples::U32((0..length as u32).collect()))]).collect();
            let size = (WIDTH as usize, HEIGHT as usize);
            let layer = Layer::new(size, LayerAttributes::named("a"), encoding, AnyChannels::sort(list));
            let mut file = Cursor::new(Vec::new());
            Image::from_layer(layer)
                .write()
                .non_parallel()
                .to_buffered(&mut file)
                .expect("a picture in memory");
            files.push(file.into_inner());
        }
    }
    files
}
