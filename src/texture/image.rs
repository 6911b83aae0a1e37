//! The image texture.

use super::columns::{Encoded, Instructions, MIPMAP, PictureRows, SECOND_UV, TILES};
use super::fetch::Texels;
use super::files::ImageFile;
use super::instruction::{Instruction, Op};
use super::picture::Picture;
use super::program::{Builder, Cost, TextureParameters};
use super::site::SecondUv;
use super::slope_step::SlopeStep;
use super::table::TextureTable;
use crate::math::{Float, Mask, Rgb, Uint, function};
use crate::parameter::limits::COORDINATE;
use crate::parameter::{ImageIndex, Number, ParameterKind, parameters, words};

words! {
    /// The interpretation of a picture's numbers.
    pub enum ColorSpace {
        /// sRGB for files of 8 or 16 bits, linear for floats.
        Auto = "auto",
        /// Encoded as sRGB.
        Srgb = "srgb",
        /// Linear Rec. 709.
        Linear = "linear",
        /// Not colours, but roughness, masks or normals.
        Data = "data",
    }
}

words! {
    /// The values outside a picture.
    pub enum Wrap {
        /// The picture is repeated.
        Repeat = "repeat",
        /// The picture is repeated, mirrored every second time.
        Mirror = "mirror",
        /// The nearest texel at the edge.
        Clamp = "clamp",
        /// Black.
        Black = "black",
    }
}

words! {
    /// The interpolation between the centres of texels.
    pub enum TexelFilter {
        /// The nearest texel.
        Nearest = "nearest",
        /// Bilinear interpolation of four texels.
        Linear = "linear",
    }
}

parameters! {
    /// A picture. Its lower left corner is at (0, 0), and the centres of its texels are at (i + ½)/n.
    pub struct ImageTexture: "image", "an image" {
        /// A .png, .jpg, .tga, .bmp, .tif, .webp, .hdr or .exr file of at most 65536 texels a side and 1 GiB, relative
        /// to this one; `<UDIM>` in its name stands for 1001, 1002 and so on, ten tiles per unit of v. Transparency is
        /// ignored. A file used by several textures is read once.
        file: ImageIndex = ParameterKind::Image,
        /// The interpretation of the numbers in the file: sRGB, linear Rec. 709, or data such as roughness, masks and
        /// normals; "auto" means sRGB for 8 and 16 bits, and linear for floats.
        color_space: ColorSpace = ParameterKind::Word(ColorSpace::WORDS) => "\"auto\"",
        /// The values outside the picture: one word, or one along u and one along v. Tiles are clamped, and all outside
        /// them is black.
        wrap: [Wrap; 2] = ParameterKind::Words(Wrap::WORDS) => "\"repeat\"",
        /// Whether to use the nearest texel or bilinear interpolation of four.
        filter: TexelFilter = ParameterKind::Word(TexelFilter::WORDS) => "\"linear\"",
        /// Whether to use coarser levels if a pixel covers many texels, with interpolation between two levels. The
        /// level depends only on the point and the camera. "nearest" always uses the finest level.
        mipmap: bool = ParameterKind::Flag => "true",
        /// The scale of uv, applied first, before rotation and translation: one number, or one along u and one along v.
        uv_scale: [f64; 2] = ParameterKind::Pair(COORDINATE) => "1",
        /// The translation of uv, applied last.
        uv_offset: [f64; 2] = ParameterKind::Pair(COORDINATE) => "0",
        /// The rotation of uv about (0, 0) in degrees, counter-clockwise.
        uv_rotate: f64 = ParameterKind::Number(Number::between(-1e6, 1e6)) => "0",
        /// The set of uv: 0, or 1 for the second set of meshes, such as glTF's TEXCOORD_1. Checkerboards do not change
        /// the second set.
        uv_set: f64 = ParameterKind::Integer(0, 1) => "0",
    }
}

/// The distance over which slopes are measured, in texels. It is short, so that slopes are those of bilinear interpolation
/// except where it bends, and long enough for the rounding of uv on large and often repeated pictures.
const SLOPE_STEP: f64 = 0.25;

/// The bit at which the modes of wrapping along v begin.
const WRAP_V: u32 = 2;
/// The bit of pictures with nearest texels.
const NEAREST: u32 = 1 << 4;

impl TextureParameters for ImageTexture {
    fn cost(&self, _known: &[Cost]) -> Cost {
        Cost { instructions: 1, depth: 1, uses_uv: true }
    }

    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32 {
        let file = builder.image(self.file);
        let is_tiled = file.is_tiled;
        let rows = (file.places() / 10) as u32;
        let encoded = match self.color_space {
            ColorSpace::Auto => Encoded::Integers,
            ColorSpace::Srgb => Encoded::All,
            ColorSpace::Linear | ColorSpace::Data => Encoded::None,
        };
        let wrap = if is_tiled { [Wrap::Clamp; 2] } else { self.wrap };
        let [wrap_u, wrap_v] = wrap.map(|wrap| wrap as u32);
        let nearest = if self.filter == TexelFilter::Nearest { NEAREST } else { 0 };
        let tiles = if is_tiled { TILES } else { 0 };
        let second_uv = if self.uses_second_uv() { SECOND_UV } else { 0 };
        let [[a, b], [c, d]] = self.turned();
        let [ou, ov] = self.uv_offset;
        let numbers = [a, b, ou, c, d, ov].map(|x| x as f32);
        let has_levels = self.mipmap && self.filter == TexelFilter::Linear;
        let link = builder.picture_rows(self.file, encoded, has_levels);
        let levels = if has_levels { MIPMAP } else { 0 };
        builder.push(Instruction {
            link,
            other: if is_tiled { rows } else { 0 },
            flags: wrap_u | wrap_v << WRAP_V | nearest | tiles | levels | second_uv,
            numbers,
            ..Instruction::new(Op::Image, next)
        })
    }

    fn slope_step(&self, _named: SlopeStep, images: &[ImageFile]) -> SlopeStep {
        let tiles = &images[self.file.0].tiles;
        let most = |side: fn(&Picture) -> u32| {
            f64::from(tiles.iter().map(|tile| side(&tile.picture)).max().unwrap_or(1))
        };
        let (width, height) = (most(Picture::width), most(Picture::height));
        let [u, v] = self.turned();
        let uv = [0, 1].map(|i| SLOPE_STEP / libm::hypot(u[i] * width, v[i] * height));
        if self.uses_second_uv() {
            return SlopeStep { second_uv: uv, ..SlopeStep::NONE };
        }
        SlopeStep { uv, ..SlopeStep::NONE }
    }

    fn uses_second_uv(&self) -> bool {
        self.uv_set > 0.0
    }
}

impl ImageTexture {
    /// The scale and the rotation of uv, as a matrix by rows.
    fn turned(&self) -> [[f64; 2]; 2] {
        let turn = self.uv_rotate.to_radians();
        // Rotations by quarters of a turn are exact.
        let (sin, cos) = match (self.uv_rotate / 90.0).rem_euclid(4.0) {
            0.0 => (0.0, 1.0),
            1.0 => (1.0, 0.0),
            2.0 => (0.0, -1.0),
            3.0 => (-1.0, 0.0),
            _ => (libm::sin(turn), libm::cos(turn)),
        };
        let [su, sv] = self.uv_scale;
        [[cos * su, -sin * sv], [sin * su, cos * sv]]
    }
}

/// The colour at uv, in the lanes of `active`, if a pixel covers the area `footprint` of uv. Pictures of the second set of
/// uv have those of `second`.
#[inline(always)]
pub(super) fn look_up<F: Float>(
    table: &TextureTable,
    at: F::Uint,
    [mut u, mut v]: [F; 2],
    mut footprint: F,
    second: &SecondUv<F>,
    active: F::Mask,
) -> Rgb<F> {
    let (all, rows): (&Instructions, &PictureRows) = (&table.instructions, &table.rows);
    if table.has_second_uv {
        let bit = F::Uint::splat(SECOND_UV);
        let is_second = (all.flags(at) & bit).eq(bit);
        (u, v) = (F::select(is_second, second.uv[0], u), F::select(is_second, second.uv[1], v));
        footprint = F::select(is_second, second.footprint, footprint);
    }
    let number = all.all_numbers::<F>(at);
    let mut s = u * number[0] + v * number[1] + number[2];
    let mut t = u * number[3] + v * number[4] + number[5];
    let flags = all.flags(at);
    let (mut row, mut is_tile) = (all.link(at), F::splat(1.0));
    if table.has_tiles {
        let bit = F::Uint::splat(TILES);
        (row, is_tile, s, t) = F::branch(
            (flags & bit).eq(bit),
            (row, is_tile, s, t),
            #[inline(always)]
            || {
                let (column, line) = (s.floor(), t.floor());
                let below = column.lt(F::splat(10.0)) & line.lt(all.other(at).to_float());
                let known = column.ge(F::zero()) & line.ge(F::zero()) & below;
                let place = column.only(known).to_uint() + line.only(known).to_uint() * F::Uint::splat(10);
                (row + place, F::splat(1.0).only(known), s - column, t - line)
            },
        );
    }
    if !table.has_mipmaps {
        return texels(table, row, flags, [s, t], is_tile, active);
    }
    let levels = F::branch(
        active & (flags & F::Uint::splat(MIPMAP)).eq(F::Uint::splat(MIPMAP)),
        (row, row, F::zero()),
        #[inline(always)]
        || {
            let [width, height] = rows.size(row);
            let turned = number[0] * number[4] - number[1] * number[3];
            let covered = (footprint * turned).abs() * width.to_float() * height.to_float();
            // The square root of the number of texels is their number along a side.
            let level = (log2(covered) * 0.5).max(F::zero()).min(rows.levels(row).to_float());
            let (finer, coarser) = (level.floor(), rows.coarser(row));
            let share = level - finer;
            let before = finer.max(F::splat(1.0)) - 1.0;
            let is_finest = finer.lt(F::splat(1.0));
            let last = rows.levels(row).to_float() - 1.0;
            let first = F::Uint::select(is_finest, row, coarser + before.to_uint());
            (first, coarser + finer.min(last).max(F::zero()).to_uint(), share)
        },
    );
    let (finer, coarser, share) = levels;
    let sharp = texels(table, finer, flags, [s, t], is_tile, active);
    let mixes = active & share.gt(F::zero());
    F::branch(
        mixes,
        sharp,
        #[inline(always)]
        || sharp * (F::splat(1.0) - share) + texels(table, coarser, flags, [s, t], is_tile, mixes) * share,
    )
}

/// The colour at uv of instructions that look up a single image, without tiles or transformed uv, at the finest level.
#[inline(always)]
pub(super) fn texels_at<F: Float>(table: &TextureTable, at: F::Uint, uv: [F; 2]) -> Rgb<F> {
    let all = &table.instructions;
    texels(table, all.link(at), all.flags(at), uv, F::splat(1.0), F::Mask::splat(true))
}

/// The logarithm to base two: exact at powers of two and linear between them, with an error of at most 0.09 below. For
/// finite numbers above zero; a large negative number for zero.
#[inline(always)]
fn log2<F: Float>(x: F) -> F {
    x.to_bits().to_float() * (1.0 / 8_388_608.0) - 127.0
}

/// The colour of a picture at coordinates relative to its sides, times `is_tile`, in the lanes of `active`. It is one
/// function for both levels of a mipmap, and for programs with and without a stack.
#[inline(always)]
fn texels<F: Float>(
    table: &TextureTable,
    row: F::Uint,
    flags: F::Uint,
    at: [F; 2],
    is_tile: F,
    active: F::Mask,
) -> Rgb<F> {
    F::out_of_line(
        #[inline(always)]
        move || texels_of(table, row, flags, at, is_tile, active),
    )
}

/// See [`texels`].
#[inline(always)]
fn texels_of<F: Float>(
    table: &TextureTable,
    row: F::Uint,
    flags: F::Uint,
    [s, t]: [F; 2],
    is_tile: F,
    active: F::Mask,
) -> Rgb<F> {
    let [width, height] = table.rows.size(row);
    let bit = F::Uint::splat(NEAREST);
    let nearest = (flags & bit).eq(bit);
    let three = F::Uint::splat(3);
    let ([left, right], [of_left, of_right]) = neighbours(s, width.to_float(), flags & three, nearest);
    let ([low, high], [of_low, of_high]) =
        neighbours(t, height.to_float(), flags.shr::<WRAP_V>() & three, nearest);
    let (left, right) = (left.to_uint(), right.to_uint());
    let (low, high) = (low.to_uint() * width, high.to_uint() * width);
    let places = [low + left, low + right, high + left, high + right];
    let (of_low, of_high) = (of_low * is_tile, of_high * is_tile);
    let weights = [of_left * of_low, of_right * of_low, of_left * of_high, of_right * of_high];
    F::device(&Texels(table), (row, places, weights, active))
}

/// The two texels along an axis whose centres are on either side of a coordinate, and their weights. Texels are counted
/// from zero; a weight is zero for a texel that is not used.
#[inline(always)]
fn neighbours<F: Float>(x: F, size: F, wrap: F::Uint, nearest: F::Mask) -> ([F; 2], [F; 2]) {
    function!(F, texel_neighbours(x, size, wrap, nearest), {
        let (zero, one) = (F::zero(), F::splat(1.0));
        let is_repeat = wrap.eq(F::Uint::splat(Wrap::Repeat as u32));
        let is_mirror = wrap.eq(F::Uint::splat(Wrap::Mirror as u32));
        let is_black = wrap.eq(F::Uint::splat(Wrap::Black as u32));
        let half = x * 0.5;
        let there_and_back = (half - half.floor()) * 2.0;
        let mirrored = there_and_back.min(F::splat(2.0) - there_and_back);
        // Far outside the edge all coordinates are equivalent.
        let clamped = x.max(F::splat(-1.0)).min(F::splat(2.0));
        let clamped = F::select(is_black, clamped, clamped.max(zero).min(one));
        let within = F::select(is_repeat, x - x.floor(), F::select(is_mirror, mirrored, clamped));
        let texel = within * size;
        let texel = F::select(nearest, texel, texel - 0.5);
        let first = texel.floor();
        let share = F::select(nearest, zero, texel - first);
        let second = first + 1.0;
        let last = size - 1.0;
        // A coordinate just below a whole number may be rounded to it.
        let around = F::select(second.le(last), second, zero);
        let before = F::select(first.lt(zero), last, first.min(last));
        let counts_first = !is_black | (first.ge(zero) & first.le(last));
        let counts_second = !is_black | (second.ge(zero) & second.le(last));
        let first = F::select(is_repeat, before, first.max(zero).min(last));
        let second = F::select(is_repeat, around, second.max(zero).min(last));
        ([first, second], [(one - share).only(counts_first), share.only(counts_second)])
    })
}
