//! Levels of pictures, by the area that a pixel covers.

use super::super::{CheckerboardTexture, ScaleTexture};
use super::*;
use crate::parameter::Varying;

/// The value of the last of some textures at uv, if a pixel covers an area of uv.
fn seen(textures: &[TextureKind], images: &[ImageFile], uv: [f32; 2], footprint: f32) -> f32 {
    let mut compiler = Compiler::new(textures, images);
    let root = Wrapping(compiler.root(textures.len() - 1));
    let p = Vec3::<f32>::zero();
    compiler.finish().value::<f32>(root, Site::new(p, uv, footprint)).r
}

/// Sixteen columns and eight rows of stripes and spots.
fn numbers() -> Vec<f32> {
    (0..128).map(|i| if (i % 16 + i / 16) % 3 == 0 { 9.0 } else { (i % 7) as f32 }).collect()
}

/// The area of a texel.
const TEXEL: f32 = 1.0 / 128.0;

#[test]
fn levels_depend_on_the_texels_covered_by_a_pixel() {
    let images = [file(greys(16, &numbers()))];
    let with = ImageTexture { mipmap: true, ..plain() };
    // The level of 8×4 texels as a picture of its own.
    let mut half = Vec::new();
    for (y, x) in (0..4).flat_map(|y| (0..8).map(move |x| (y, x))) {
        let at = |i: usize, j: usize| numbers()[(2 * y + j) * 16 + 2 * x + i];
        half.push((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1)) / 4.0);
    }
    let halves = [file(greys(8, &half))];
    let mean = numbers().iter().sum::<f32>() / 128.0;
    for uv in [[0.3, 0.8], [0.51, 0.02], [1.7, -0.4], [0.999, 0.5]] {
        let finest = seen(&[plain().into()], &images, uv, 0.0);
        let coarser = seen(&[plain().into()], &halves, uv, 0.0);
        let at = |footprint| seen(&[with.into()], &images, uv, footprint);
        let close = |a: f32, b: f32| assert!((a - b).abs() < 2e-5, "{uv:?}: {a}, not {b}");
        for footprint in [0.0, TEXEL / 64.0, TEXEL] {
            close(at(footprint), finest);
        }
        close(at(4.0 * TEXEL), coarser);
        // Twice a texel is halfway from one to four.
        close(at(2.0 * TEXEL), (finest + coarser) / 2.0);
        for footprint in [128.0 * 128.0 * TEXEL, 1e30, f32::MAX] {
            close(at(footprint), mean);
        }
        // Without levels, or with nearest texels, the finest level is used.
        for without in [plain(), ImageTexture { filter: TexelFilter::Nearest, ..with }] {
            let nearest = ImageTexture { filter: without.filter, ..plain() };
            let expected = seen(&[nearest.into()], &images, uv, 0.0);
            assert_eq!(seen(&[without.into()], &images, uv, 64.0 * TEXEL), expected);
        }
        assert!((finest - mean).abs() > 0.1, "a negative control: the levels differ");
    }
}

#[test]
fn levels_include_transforms_of_uv() {
    let images = [file(greys(16, &numbers()))];
    let with = ImageTexture { mipmap: true, ..plain() };
    let uv = [0.3, 0.8];
    // Scaled uv cover more texels.
    let scaled = ImageTexture { uv_scale: [2.0, 0.5], uv_rotate: 90.0, ..with };
    let bare = ImageTexture { mipmap: false, ..scaled };
    let expected = seen(&[bare.into()], &images, uv, 0.0);
    assert_eq!(seen(&[scaled.into()], &images, uv, TEXEL), expected);
    let larger = ImageTexture { uv_scale: [4.0, 4.0], ..with };
    let all = numbers().iter().sum::<f32>() / 128.0;
    assert!((seen(&[larger.into()], &images, uv, 128.0 * 8.0 * TEXEL) - all).abs() < 1e-5);
    // So do those within a check; after it they have their previous values.
    let checks = CheckerboardTexture {
        even: Varying::Texture(0),
        odd: Varying::Texture(0),
        checks_per_unit: [4.0, 1.0],
    };
    let boards = [with.into(), checks.into()];
    let within = [0.3 * 4.0 - 1.0, 0.8];
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a}, not {b}");
    close(seen(&boards, &images, uv, TEXEL / 2.0), seen(&[with.into()], &images, within, 2.0 * TEXEL));
    let behind = ScaleTexture { texture: Varying::Texture(1), by: Varying::Texture(0) };
    let products = [boards[0].clone(), boards[1].clone(), behind.into()];
    let expected = seen(&boards, &images, uv, TEXEL * 2.0) * seen(&[with.into()], &images, uv, TEXEL * 2.0);
    close(seen(&products, &images, uv, TEXEL * 2.0), expected);
}

#[test]
fn a_check_of_constants_keeps_the_area_of_a_pixel() {
    let images = [file(greys(16, &numbers()))];
    let with = ImageTexture { mipmap: true, ..plain() };
    let [even, odd] = [0.25, 0.5].map(|grey| Varying::Colour([grey; 3]));
    let checks = CheckerboardTexture { even, odd, checks_per_unit: [4.0, 2.0] };
    let product = ScaleTexture { texture: Varying::Texture(1), by: Varying::Texture(0) };
    let products = [with.into(), checks.into(), product.into()];
    for (uv, grey) in [([0.3, 0.8], 0.25), ([0.1, 0.8], 0.5)] {
        for footprint in [0.0, 2.0 * TEXEL, 16.0 * TEXEL] {
            let expected = grey * seen(&[with.into()], &images, uv, footprint);
            assert_eq!(seen(&products, &images, uv, footprint), expected, "{uv:?}, {footprint}");
        }
    }
    // Negative control: eight times the area uses another level.
    let [own, larger] = [2.0, 16.0].map(|texels| seen(&[with.into()], &images, [0.3, 0.8], texels * TEXEL));
    assert!((own - larger).abs() > 0.01, "{own}, {larger}");
}

#[test]
fn tiles_have_levels_of_their_own_and_each_file_has_them_once() {
    let tile = |number, grey| Tile { number, picture: Arc::new(greys(4, &[grey, 0.0, grey, 0.0])) };
    let images =
        [ImageFile { name: "tiles".into(), is_tiled: true, tiles: vec![tile(1001, 1.0), tile(1003, 2.0)] }];
    let with = ImageTexture { mipmap: true, ..plain() };
    let at = |u| seen(&[with.into()], &images, [u, 0.5], 1e6);
    assert_eq!([at(0.5), at(2.5), at(1.5), at(3.5)], [0.5, 1.0, 0.0, 0.0]);
    let images = [file(greys(4, &[0.0; 16]))];
    let count = |textures: &[TextureKind]| {
        let mut compiler = Compiler::new(textures, &images);
        (0..textures.len()).for_each(|i| _ = compiler.root(i));
        compiler.finish().pictures().len()
    };
    let clamped = ImageTexture { wrap: [Wrap::Clamp; 2], ..with };
    assert_eq!(count(&[plain().into()]), 1);
    assert_eq!(count(&[plain().into(), with.into(), clamped.into()]), 3);
    assert_eq!(count(&[with.into(), plain().into()]), 3);
}
