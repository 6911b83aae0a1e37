//! Access to texels of pictures. Devices implement it themselves, because it reads bytes.

use super::columns::{COLOURED, SRGB};
use super::picture::{Depth, Picture};
use super::table::TextureTable;
use crate::math::colour::srgb_to_linear;
use crate::math::lanes::{Device, MAX_LANES};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Rgb, Uint};

/// The weighted sum of four texels of a row's picture, given by their indices from the lower left. The results of lanes
/// outside the mask are unspecified.
pub(super) struct Texels<'a>(pub(super) &'a TextureTable);

impl Device for Texels<'_> {
    const NAME: &'static str = "texels";
    type Arguments<F: Float> = (F::Uint, [F::Uint; 4], [F; 4], F::Mask);
    type Output<F: Float> = Rgb<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (row, places, weights, active): Self::Arguments<F>) -> Rgb<F> {
        let mut rows = [0; MAX_LANES];
        row.store(&mut rows);
        let mut sum = Rgb::black();
        let mut left = active.bits();
        // All lanes of a picture together: most points of a packet are on few pictures.
        while left != 0 {
            let one = rows[left.trailing_zeros() as usize % F::LANES];
            let own = row.eq(F::Uint::splat(one));
            let lanes = left & own.bits();
            left &= !lanes;
            let (picture, form) = self.0.rows.of(one as usize);
            let picture = &self.0.pictures[picture];
            let found = if is_encoded_float(form) {
                self.0.one_by_one(picture, form, lanes, &places, &weights)
            } else {
                gathered(self.0, picture, form, &places, &weights)
            };
            sum = Rgb::select(own, found, sum);
        }
        sum
    }
}

/// Whether the numbers of a format are floats that are encoded as sRGB. There is no table of their linear values.
#[inline(always)]
fn is_encoded_float(form: u32) -> bool {
    form & SRGB != 0 && form & 3 >= Depth::Half as u32
}

/// [`Texels`] of one picture, all lanes together. The bits are those of [`TextureTable::texel`]: a texel without weight
/// adds zero.
#[inline(always)]
fn gathered<F: LaneFloat>(
    table: &TextureTable,
    picture: &Picture,
    form: u32,
    places: &[F::Uint; 4],
    weights: &[F; 4],
) -> Rgb<F> {
    let words = picture.words().as_flattened();
    let mut sum = Rgb::black();
    let mut i = 0;
    while i < 4 {
        let texel = if form & COLOURED != 0 {
            let [r, g, b] = three_numbers::<F>(words, form, places[i]);
            Rgb::new(value(table, form, r), value(table, form, g), value(table, form, b))
        } else {
            let grey = value(table, form, one_number::<F>(words, form, places[i]));
            Rgb::new(grey, grey, grey)
        };
        sum = sum + texel * weights[i];
        i += 1;
    }
    sum
}

/// The bits of a picture's number, by its index.
#[inline(always)]
fn one_number<F: LaneFloat>(words: &[u32], form: u32, number: F::Uint) -> F::Uint {
    let (one, two) = (F::Uint::splat(1), F::Uint::splat(2));
    if form & 3 == Depth::Float as u32 {
        F::Uint::gather(words, number)
    } else if form & 3 == Depth::Bits8 as u32 {
        let word = F::Uint::gather(words, number.shr::<2>());
        let half = F::Uint::select((number & two).eq(two), word.shr::<16>(), word);
        F::Uint::select((number & one).eq(one), half.shr::<8>(), half) & F::Uint::splat(0xff)
    } else {
        let word = F::Uint::gather(words, number.shr::<1>());
        F::Uint::select((number & one).eq(one), word.shr::<16>(), word) & F::Uint::splat(0xffff)
    }
}

/// The bits of the three numbers of a texel, by its index.
#[inline(always)]
fn three_numbers<F: LaneFloat>(words: &[u32], form: u32, place: F::Uint) -> [F::Uint; 3] {
    let (one, two) = (F::Uint::splat(1), F::Uint::splat(2));
    let first = place * F::Uint::splat(3);
    if form & 3 != Depth::Bits8 as u32 {
        return [
            one_number::<F>(words, form, first),
            one_number::<F>(words, form, first + one),
            one_number::<F>(words, form, first + two),
        ];
    }
    // The bytes are in one word, or in two successive ones.
    let low = F::Uint::gather(words, first.shr::<2>());
    let high = F::Uint::gather(words, (first + two).shr::<2>());
    let is_odd = (first & one).eq(one);
    let even = F::Uint::select(is_odd, low.shr::<8>(), low);
    let odd = F::Uint::select(is_odd, low.shr::<24>() | high.shl::<8>(), low.shr::<16>() | high.shl::<16>());
    let bytes = F::Uint::select((first & two).eq(two), odd, even);
    let byte = F::Uint::splat(0xff);
    [bytes & byte, bytes.shr::<8>() & byte, bytes.shr::<16>() & byte]
}

/// The value of a picture's number, from its bits.
#[inline(always)]
fn value<F: LaneFloat>(table: &TextureTable, form: u32, bits: F::Uint) -> F {
    let is_srgb = form & SRGB != 0;
    if form & 3 == Depth::Bits8 as u32 {
        if is_srgb { F::gather(&table.srgb_8, bits) } else { bits.to_float() / 255.0 }
    } else if form & 3 == Depth::Bits16 as u32 {
        if is_srgb { F::gather(&table.srgb_16, bits) } else { bits.to_float() / 65_535.0 }
    } else if form & 3 == Depth::Half as u32 {
        let magnitude = bits & F::Uint::splat(0x7fff);
        // The exponent bias is 15 there and 127 here. Without an exponent, the unit is 2⁻²⁴.
        let normal = magnitude.shl::<13>() + F::Uint::splat(112 << 23);
        let small = (magnitude.to_float() * (1.0 / 16_777_216.0)).to_bits();
        let value = F::Uint::select(magnitude.lt(F::Uint::splat(0x400)), small, normal);
        F::from_bits(value | (bits & F::Uint::splat(0x8000)).shl::<16>())
    } else {
        F::from_bits(bits)
    }
}

impl TextureTable {
    /// [`Texels`] of one picture, one lane after the other.
    #[inline(always)]
    fn one_by_one<F: LaneFloat>(
        &self,
        picture: &Picture,
        form: u32,
        lanes: u32,
        places: &[F::Uint; 4],
        weights: &[F; 4],
    ) -> Rgb<F> {
        let (mut at, mut share) = ([[0; MAX_LANES]; 4], [[0.0; MAX_LANES]; 4]);
        let mut i = 0;
        while i < 4 {
            places[i].store(&mut at[i]);
            weights[i].store(&mut share[i]);
            i += 1;
        }
        let mut sums = [[0.0; MAX_LANES]; 3];
        self.sum_texels(picture, form, lanes, &at, &share, &mut sums);
        let [r, g, b] = &sums;
        Rgb::new(F::load(r), F::load(g), F::load(b))
    }

    /// The sums of [`Self::one_by_one`]. It does not depend on the instructions of a level.
    #[inline(never)]
    fn sum_texels(
        &self,
        picture: &Picture,
        form: u32,
        mut lanes: u32,
        places: &[[u32; MAX_LANES]; 4],
        weights: &[[f32; MAX_LANES]; 4],
        sums: &mut [[f32; MAX_LANES]; 3],
    ) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let mut sum = [0.0; 3];
            for (places, weights) in places.iter().zip(weights) {
                let weight = weights[lane];
                // At edges, most weights are zero.
                if weight != 0.0 {
                    let texel = self.texel(picture, form, places[lane] as usize);
                    sum = [0, 1, 2].map(|i| sum[i] + texel[i] * weight);
                }
            }
            for (sums, sum) in sums.iter_mut().zip(sum) {
                sums[lane] = sum;
            }
        }
    }

    /// The picture of a texture that is a single image without tiles: its columns and rows, and the value of the texel
    /// at a column and a row, the lowest row first.
    ///
    /// # Panics
    ///
    /// If the texture is not such an image.
    pub fn image_texels(&self, texture: u32) -> ([usize; 2], impl Fn(usize, usize) -> [f32; 3] + '_) {
        let row = self.instructions.image_row(texture);
        let (picture, form) =
            self.rows.of(row.unwrap_or_else(|| panic!("texture {texture} is not an image")));
        let picture = &self.pictures[picture];
        let size = [picture.width() as usize, picture.height() as usize];
        (size, move |column, row| self.texel(picture, form, row * size[0] + column))
    }

    fn texel(&self, picture: &Picture, form: u32, place: usize) -> [f32; 3] {
        // Wrapping keeps indices within the picture; an error there should give a wrong colour instead of a panic.
        let place = place.min(picture.texels() - 1);
        let is_srgb = form & SRGB != 0;
        let value = |i: usize| {
            let number = picture.number(i);
            let float = match picture.depth() {
                Depth::Bits8 if is_srgb => return self.srgb_8[number as usize],
                Depth::Bits8 => return number as f32 / 255.0,
                Depth::Bits16 if is_srgb => return self.srgb_16[number as usize],
                Depth::Bits16 => return number as f32 / 65_535.0,
                Depth::Half => exr::prelude::f16::from_bits(number as u16).to_f32(),
                Depth::Float => f32::from_bits(number),
            };
            if is_srgb { srgb_to_linear(f64::from(float)) as f32 } else { float }
        };
        if form & COLOURED != 0 {
            [3 * place, 3 * place + 1, 3 * place + 2].map(value)
        } else {
            [value(place); 3]
        }
    }
}
