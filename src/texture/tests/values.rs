//! The values of textures.

use super::super::{
    CheckerboardTexture, ConstantTexture, MixTexture, NoiseTexture, STACK, ScaleTexture, TextureTable,
    TooDeep, costs,
};
use super::*;
use crate::math::colour::srgb_to_linear;
use crate::math::lanes::{Kernel, Level, MAX_LANES, dispatch};
use crate::math::{LaneFloat, LaneUint, Rgb};
use crate::parameter::Varying;
use crate::sampling::Stream;
use rand::RngExt;

/// The texel at an integer position, inside or outside the picture.
fn texel_at(numbers: &[f32], [width, height]: [i64; 2], [x, y]: [i64; 2], [u, v]: [Wrap; 2]) -> f64 {
    let inside = |i: i64, n: i64, wrap: Wrap| match wrap {
        Wrap::Repeat => Some(i.rem_euclid(n)),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            Some(i.min(2 * n - 1 - i))
        }
        Wrap::Clamp => Some(i.clamp(0, n - 1)),
        Wrap::Black => (0..n).contains(&i).then_some(i),
    };
    match (inside(x, width, u), inside(y, height, v)) {
        // The first row of numbers is the uppermost.
        (Some(x), Some(y)) => f64::from(numbers[((height - 1 - y) * width + x) as usize]),
        _ => 0.0,
    }
}

#[test]
fn texels_are_interpolated_and_repeated_by_the_formula() {
    let numbers = [0.1, 0.9, 0.3, 0.7, 0.2, 0.6, 0.5, 0.8, 0.4, 1.0, 0.0, 0.55];
    let size = [4, 3];
    let images = [file(greys(4, &numbers))];
    let mut stream = Stream::new(16, 1, 0);
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp, Wrap::Black];
    for (wrap_u, wrap_v) in wraps.iter().flat_map(|&u| wraps.iter().map(move |&v| (u, v))) {
        let wrap = [wrap_u, wrap_v];
        for filter in [TexelFilter::Nearest, TexelFilter::Linear] {
            let texture = [ImageTexture { wrap, filter, ..plain() }.into()];
            let places: Vec<[f32; 2]> =
                (0..300).map(|_| [(); 2].map(|()| stream.random_range(-2.5..3.5_f32))).collect();
            let at: Vec<_> = places.iter().map(|&uv| (uv, [0.0; 3])).collect();
            for (uv, found) in places.iter().zip(values(&texture, &images, &at)) {
                let [x, y] = [0, 1].map(|i| f64::from(uv[i]) * size[i] as f64);
                let expected = if filter == TexelFilter::Nearest {
                    texel_at(&numbers, size, [x.floor() as i64, y.floor() as i64], wrap)
                } else {
                    let [x, y] = [x - 0.5, y - 0.5];
                    let [fx, fy] = [x - x.floor(), y - y.floor()];
                    let corner = |i: i64, j: i64| {
                        texel_at(&numbers, size, [x.floor() as i64 + i, y.floor() as i64 + j], wrap)
                    };
                    (corner(0, 0) * (1.0 - fx) + corner(1, 0) * fx) * (1.0 - fy)
                        + (corner(0, 1) * (1.0 - fx) + corner(1, 1) * fx) * fy
                };
                for channel in found {
                    let off = (f64::from(channel) - expected).abs();
                    assert!(off < 1e-5, "{wrap:?} {filter:?} {uv:?}: {channel}, not {expected}");
                }
            }
        }
    }
}

/// Evaluates textures, one per lane, at uv.
struct LookUp<'a> {
    table: &'a TextureTable,
    textures: [u32; MAX_LANES],
    uv: [[f32; MAX_LANES]; 2],
}

impl Kernel for LookUp<'_> {
    type Output = Vec<[u32; 3]>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Vec<[u32; 3]> {
        let uv = [F::load(&self.uv[0]), F::load(&self.uv[1])];
        let site = Site::new(Vec3::zero(), uv, F::zero());
        let Rgb { r, g, b } = self.table.value::<F>(F::Uint::load(&self.textures), site);
        let mut channels = [[0.0; MAX_LANES]; 3];
        r.store(&mut channels[0]);
        g.store(&mut channels[1]);
        b.store(&mut channels[2]);
        (0..F::LANES).map(|lane| channels.map(|channel| channel[lane].to_bits())).collect()
    }
}

/// The bits of a texture that is one repeated image: the sum of four texels by weights, computed for one point.
fn by_texels(table: &TextureTable, texture: u32, uv: [f32; 2]) -> [u32; 3] {
    let (size, texel) = table.image_texels(texture);
    let along = |axis: usize| {
        let (x, count) = (uv[axis], size[axis] as i64);
        let place = (x - x.floor()) * size[axis] as f32 - 0.5;
        let share = place - place.floor();
        let first = place.floor() as i64;
        [(first, 1.0 - share), (first + 1, share)].map(|(i, weight)| (i.rem_euclid(count) as usize, weight))
    };
    let mut sum = [0.0_f32; 3];
    for (row, of_row) in along(1) {
        for (column, of_column) in along(0) {
            let texel = texel(column, row);
            sum = [0, 1, 2].map(|i| sum[i] + texel[i] * (of_column * of_row));
        }
    }
    sum.map(f32::to_bits)
}

/// Lanes look up pictures of one format after the other, floats that are encoded as sRGB lane by lane.
#[test]
fn lanes_find_the_texels_of_every_format() {
    let mut stream = Stream::new(17, 1, 0);
    let depths = [Depth::Bits8, Depth::Bits16, Depth::Half, Depth::Float];
    let formats = depths.into_iter().flat_map(|d| [(d, 1), (d, 3)]);
    for ((depth, channels), space) in formats.flat_map(|f| [(f, ColorSpace::Data), (f, ColorSpace::Srgb)]) {
        let mut number = || match depth {
            Depth::Bits8 => vec![stream.random::<u8>()],
            Depth::Bits16 => stream.random::<u16>().to_le_bytes().to_vec(),
            // Finite halves, including subnormal ones.
            Depth::Half => (stream.random::<u16>() & 0xbfff).to_le_bytes().to_vec(),
            Depth::Float => stream.random_range(-1.0..5.0_f32).to_le_bytes().to_vec(),
        };
        let bytes: Vec<u8> = (0..7 * 5 * channels).flat_map(|_| number()).collect();
        let picture = file(Picture::new([7, 5], [channels; 2], depth, &bytes));
        let images = [picture, file(greys(2, &[0.5, 2.0]))];
        let own = ImageTexture { color_space: space, ..plain() };
        let textures: [TextureKind; 2] = [own.into(), ImageTexture { file: ImageIndex(1), ..plain() }.into()];
        let mut compiler = Compiler::new(&textures, &images);
        let both = [compiler.root(0), compiler.root(1)];
        let table = &compiler.finish();
        let mut apart = 0;
        for level in Level::available() {
            for _ in 0..50 {
                let uv = [(); 2].map(|()| [(); MAX_LANES].map(|()| stream.random_range(-1.5..2.5_f32)));
                let textures = [(); MAX_LANES].map(|()| both[usize::from(stream.random_bool(0.3))]);
                for (lane, found) in dispatch(level, LookUp { table, textures, uv }).into_iter().enumerate() {
                    let at = [uv[0][lane], uv[1][lane]];
                    let expected = by_texels(table, textures[lane], at);
                    assert_eq!(found, expected, "{level}, {depth:?}, {channels}, {space:?}, {lane}");
                    apart += u32::from(found != by_texels(table, both[0], at));
                }
            }
        }
        // Negative control: the texels of the other picture.
        assert!(apart > 100, "{apart}");
    }
}

#[test]
fn the_lower_left_corner_of_a_picture_is_at_zero() {
    let images = [file(greys(2, &[1.0, 2.0, 3.0, 4.0]))];
    let texture = [plain().into()];
    let at = |u, v| value(&texture, &images, [u, v])[0];
    assert_eq!([at(0.25, 0.25), at(0.75, 0.25), at(0.25, 0.75), at(0.75, 0.75)], [3.0, 4.0, 1.0, 2.0]);
    assert_eq!(at(0.5, 0.5), 2.5);
}

#[test]
fn uv_are_scaled_then_rotated_then_translated() {
    let images = [file(greys(2, &[1.0, 2.0, 3.0, 4.0]))];
    let with = |uv_scale, uv_rotate, uv_offset| ImageTexture { uv_scale, uv_rotate, uv_offset, ..plain() };
    for (texture, uv) in [
        (with([4.0, 0.5], 0.0, [0.0; 2]), [0.25 / 4.0, 1.5]),
        (with([1.0; 2], 0.0, [0.5, 0.25]), [-0.25, 0.5]),
        // A quarter counter-clockwise takes (x, y) to (−y, x).
        (with([1.0; 2], 90.0, [0.0; 2]), [0.75, -0.25]),
        (with([2.0, 1.0], -90.0, [1.0, 0.0]), [-0.75 / 2.0, -0.75]),
        (with([1.0; 2], 360.0, [0.0; 2]), [0.25, 0.75]),
    ] {
        assert_eq!(value(&[texture.into()], &images, uv)[0], 1.0, "{texture:?}");
    }
    // By any angle, up to rounding.
    let texture = with([1.0; 2], 30.0, [0.0; 2]);
    let (sin, cos) = (0.5, 0.75_f32.sqrt());
    let uv = [0.25 * cos + 0.75 * sin, -0.25 * sin + 0.75 * cos];
    assert!((value(&[texture.into()], &images, uv)[0] - 1.0).abs() < 1e-5);
}

#[test]
fn numbers_of_files_follow_the_colour_space() {
    let bytes = [10, 128, 250];
    let of = |depth: Depth, bytes: &[u8]| file(Picture::new([1, 1], [3, 3], depth, bytes));
    let eight = of(Depth::Bits8, &bytes);
    let sixteen = of(Depth::Bits16, &[0x34, 0x12, 0xff, 0x7f, 0xf0, 0xff]);
    // 0.25, 0.5 and 1 as halves, and as floats.
    let half = of(Depth::Half, &[0x00, 0x34, 0x00, 0x38, 0x00, 0x3c]);
    let float = of(Depth::Float, &[0.25_f32, 0.5, 1.0].map(f32::to_le_bytes).concat());
    let codes =
        [bytes.map(|x| f64::from(x) / 255.0), [0x1234, 0x7fff, 0xfff0].map(|x| f64::from(x) / 65_535.0)];
    let seen = |image: &ImageFile, color_space| {
        let texture = ImageTexture { color_space, filter: TexelFilter::Nearest, ..plain() };
        value(&[texture.into()], std::slice::from_ref(image), [0.3, 0.6])
    };
    for (image, codes) in [(&eight, codes[0]), (&sixteen, codes[1])] {
        let linear = codes.map(|x| srgb_to_linear(x) as f32);
        assert_eq!(seen(image, ColorSpace::Auto), linear);
        assert_eq!(seen(image, ColorSpace::Srgb), linear);
        let codes = codes.map(|x| x as f32);
        for space in [ColorSpace::Linear, ColorSpace::Data] {
            seen(image, space).iter().zip(codes).for_each(|(x, code)| assert!((x - code).abs() < 1e-7));
        }
    }
    for image in [&half, &float] {
        for space in [ColorSpace::Auto, ColorSpace::Linear, ColorSpace::Data] {
            assert_eq!(seen(image, space), [0.25, 0.5, 1.0]);
        }
        assert_eq!(seen(image, ColorSpace::Srgb), [0.25, 0.5, 1.0].map(|x| srgb_to_linear(x) as f32));
    }
}

#[test]
fn infinities_and_nan_become_finite() {
    let numbers = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -2.0];
    let images = [file(greys(4, &numbers))];
    let texture = [ImageTexture { filter: TexelFilter::Nearest, ..plain() }.into()];
    let found = [0.1, 0.3, 0.6, 0.9].map(|u| value(&texture, &images, [u, 0.5])[0]);
    assert_eq!(found, [0.0, f32::MAX, f32::MIN, -2.0]);
}

const GREY: fn(f64) -> Varying = |x| Varying::Colour([x; 3]);

#[test]
fn textures_within_a_check_use_coordinates_within_it() {
    let textures: Vec<TextureKind> = vec![
        plain().into(),
        CheckerboardTexture { even: Varying::Texture(0), odd: GREY(9.0), checks_per_unit: [4.0, 2.0] }.into(),
        CheckerboardTexture { even: Varying::Texture(1), odd: GREY(8.0), checks_per_unit: [1.0; 2] }.into(),
    ];
    let images = [file(greys(2, &[1.0, 2.0, 3.0, 4.0]))];
    // The check (0, 0) of the outer board contains 4×2 checks, and each even one of these the whole picture.
    for (uv, expected) in [
        ([0.25 / 4.0, 0.25 / 2.0], 3.0),
        ([0.75 / 4.0, 0.75 / 2.0], 2.0),
        ([1.25 / 4.0, 1.75 / 2.0], 1.0),
        ([1.25 / 4.0, 0.25 / 2.0], 9.0),
        ([1.5, 0.1], 8.0),
        ([-0.9375, -0.875], 3.0),
    ] {
        assert_eq!(value(&textures, &images, uv)[0], expected, "{uv:?}");
    }
}

#[test]
fn textures_after_a_check_use_the_previous_uv() {
    let textures: Vec<TextureKind> = vec![
        plain().into(),
        CheckerboardTexture {
            even: Varying::Texture(0),
            odd: Varying::Texture(0),
            checks_per_unit: [2.0; 2],
        }
        .into(),
        ScaleTexture { texture: Varying::Texture(1), by: Varying::Texture(0) }.into(),
        MixTexture { a: Varying::Texture(2), b: Varying::Texture(0), amount: GREY(0.25) }.into(),
        ConstantTexture { value: Varying::Texture(3) }.into(),
    ];
    let images = [file(greys(2, &[1.0, 2.0, 3.0, 4.0]))];
    let mut stream = Stream::new(16, 2, 0);
    let filter = TexelFilter::Nearest;
    let nearest = [ImageTexture { filter, ..plain() }.into()];
    let mut textures = textures;
    textures[0] = ImageTexture { filter, ..plain() }.into();
    for _ in 0..200 {
        let uv = [(); 2].map(|()| stream.random_range(-3.0..3.0_f32));
        let own = value(&nearest, &images, uv)[0];
        let within = value(&nearest, &images, uv.map(|x| x * 2.0 - (x * 2.0).floor()))[0];
        let expected = within * own * 0.75 + own * 0.25;
        assert!((value(&textures, &images, uv)[0] - expected).abs() < 1e-5, "{uv:?}");
    }
}

#[test]
fn amounts_above_one_count_as_one() {
    let mix = |amount| MixTexture { a: GREY(2.0), b: GREY(3.0), amount };
    let textures: Vec<TextureKind> = vec![
        ConstantTexture { value: Varying::Colour([5.0, 0.0, 0.0]) }.into(),
        mix(Varying::Texture(0)).into(),
    ];
    assert_eq!(value(&textures, &[], [0.0; 2]), [3.0; 3]);
    assert_eq!(value(&[mix(GREY(0.5)).into()], &[], [0.0; 2]), [2.5; 3]);
}

#[test]
fn noise_is_smooth_and_between_its_two_colours() {
    let noise = |octaves, scale| NoiseTexture { a: GREY(0.0), b: GREY(1.0), scale, octaves, roughness: 0.5 };
    let mut stream = Stream::new(16, 3, 0);
    let mut at = Vec::new();
    for _ in 0..20_000 {
        at.push(([0.0; 2], [(); 3].map(|()| stream.random_range(-40.0..40.0_f32))));
    }
    for octaves in [1.0, 5.0] {
        let found: Vec<f32> =
            values(&[noise(octaves, 1.0).into()], &[], &at).iter().map(|rgb| rgb[0]).collect();
        let mean = found.iter().sum::<f32>() / found.len() as f32;
        let variance = found.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / found.len() as f32;
        assert!(found.iter().all(|x| (0.0..=1.0).contains(x)));
        assert!((mean - 0.5).abs() < 0.01 && variance > 0.003, "{mean} {variance}");
    }
    // One octave is a half at the corners of cells, and varies in small steps.
    let corner = values(&[noise(1.0, 0.5).into()], &[], &[([0.0; 2], [-6.0, 4.0, 8.0])]);
    assert_eq!(corner, [[0.5; 3]]);
    let line: Vec<_> = (0..4000).map(|i| ([0.0; 2], [-2.0 + i as f32 * 1e-3, 0.3, 0.7])).collect();
    let found = values(&[noise(1.0, 1.0).into()], &[], &line);
    assert!(found.windows(2).all(|pair| (pair[0][0] - pair[1][0]).abs() < 4e-3));
}

#[test]
fn tiles_are_side_by_side() {
    let tile = |number, grey| Tile { number, picture: Arc::new(greys(1, &[grey])) };
    let images = [ImageFile {
        name: "tiles".into(),
        is_tiled: true,
        tiles: vec![tile(1001, 1.0), tile(1003, 2.0), tile(1012, 3.0)],
    }];
    let texture = [plain().into()];
    let at = |u, v| value(&texture, &images, [u, v])[0];
    assert_eq!([at(0.5, 0.5), at(2.01, 0.99), at(1.5, 1.5)], [1.0, 2.0, 3.0]);
    // Between tiles, outside them, and at positions that would be the first of the next row.
    assert_eq!([at(1.5, 0.5), at(-0.5, 0.5), at(0.5, 2.5), at(10.5, 0.5), at(0.5, -0.5)], [0.0; 5]);
}

#[test]
fn too_complex_textures_are_refused() {
    // The amount of each mix is the mix before it.
    let mut textures: Vec<TextureKind> = vec![plain().into()];
    for i in 0..3 {
        textures.push(MixTexture { a: GREY(0.0), b: GREY(1.0), amount: Varying::Texture(i) }.into());
    }
    let found = costs(&textures);
    let depths: Vec<_> = found.iter().map(|cost| cost.map(|cost| cost.depth)).collect();
    assert_eq!(depths, [Ok(1), Ok(3), Ok(5), Err(TooDeep::Stack(7))]);
    assert_eq!(STACK, 6);
    // Layers of six textures of one to six colours, each made of several of the layer before.
    let mut textures: Vec<TextureKind> = vec![plain().into(); STACK];
    for before in (0..16).map(|layer| layer * STACK) {
        let of = |depth: usize| Varying::Texture(before + depth - 1);
        textures.push(ConstantTexture { value: of(1) }.into());
        textures.push(ScaleTexture { texture: of(2), by: of(1) }.into());
        textures.extend((3..=STACK).map(|i| MixTexture { a: of(i), b: of(i - 1), amount: of(i - 2) }.into()));
    }
    let found = costs(&textures);
    assert_eq!(found.last(), Some(&Err(TooDeep::Instructions)));
    assert_eq!(found[5 * STACK + 2].map(|cost| cost.depth), Ok(3));
    // Unlimited depth on the left.
    let mut textures: Vec<TextureKind> = vec![plain().into()];
    for i in 0..16 {
        textures.push(ScaleTexture { texture: Varying::Texture(i), by: GREY(1.0) }.into());
    }
    assert!(costs(&textures).iter().all(Result::is_ok));
    let images = [file(greys(1, &[0.5]))];
    assert_eq!(value(&textures, &images, [0.2, 0.3]), [0.5; 3]);
}

/// Only the first set of uv is scaled within a check.
#[test]
fn slope_steps_are_those_of_each_set_of_uv() {
    let images = [file(greys(16, &[0.0; 256]))];
    let step = |uv_set: f64| {
        let picture = ImageTexture { uv_set, ..plain() };
        let check =
            CheckerboardTexture { even: Varying::Texture(0), odd: GREY(1.0), checks_per_unit: [4.0, 2.0] };
        let step = Compiler::new(&[picture.into(), check.into()], &images).slope_step(1);
        (step.uv, step.second_uv)
    };
    // A quarter of a texel, and a thirty-second of a check.
    let (texel, check) = (1.0 / 64.0, 1.0 / 32.0);
    assert_eq!(step(0.0), ([texel / 4.0, texel / 2.0], [f64::INFINITY; 2]));
    assert_eq!(step(1.0), ([check / 4.0, check / 2.0], [texel; 2]));
}
