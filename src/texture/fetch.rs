//! Access to texels of pictures. Devices implement it themselves, because it reads bytes.

use super::columns::{COLOURED, SRGB};
use super::picture::{Depth, Picture};
use super::table::{Floats, TextureTable};
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
        if self.0.has_floats {
            let lanes = active.bits();
            // Without active lanes, any index will do.
            let one = rows[lanes.trailing_zeros() as usize % F::LANES];
            let (picture, form) = self.0.rows.of(one as usize);
            if let Some(form) = Floats::of(form)
                && (active & row.eq(F::Uint::splat(one))).bits() == lanes
            {
                return gathered(&self.0.pictures[picture], form, places, weights);
            }
        }
        let (mut at, mut share) = ([[0; MAX_LANES]; 4], [[0.0; MAX_LANES]; 4]);
        let mut i = 0;
        while i < 4 {
            places[i].store(&mut at[i]);
            weights[i].store(&mut share[i]);
            i += 1;
        }
        let mut sums = [[0.0; MAX_LANES]; 3];
        self.0.sum_texels(active.bits(), &rows, &at, &share, &mut sums);
        let [r, g, b] = &sums;
        Rgb::new(F::load(r), F::load(g), F::load(b))
    }
}

/// [`Texels`] of one picture of floats, all lanes together. The bits are the same: a texel without weight adds zero.
#[inline(always)]
fn gathered<F: LaneFloat>(picture: &Picture, form: Floats, places: [F::Uint; 4], weights: [F; 4]) -> Rgb<F> {
    let words = picture.words().as_flattened();
    let mut sum = Rgb::black();
    let mut i = 0;
    while i < 4 {
        let texel = if form.is_coloured {
            let first = places[i] * F::Uint::splat(3);
            let [second, third] = [first + F::Uint::splat(1), first + F::Uint::splat(2)];
            Rgb::new(
                float::<F>(words, form.is_half, first),
                float::<F>(words, form.is_half, second),
                float::<F>(words, form.is_half, third),
            )
        } else {
            let grey = float::<F>(words, form.is_half, places[i]);
            Rgb::new(grey, grey, grey)
        };
        sum = sum + texel * weights[i];
        i += 1;
    }
    sum
}

/// A float of a picture, by its index.
#[inline(always)]
fn float<F: LaneFloat>(words: &[u32], is_half: bool, number: F::Uint) -> F {
    if !is_half {
        return F::from_bits(F::Uint::gather(words, number));
    }
    let word = F::Uint::gather(words, number.shr::<1>());
    let is_upper = (number & F::Uint::splat(1)).eq(F::Uint::splat(1));
    let bits = F::Uint::select(is_upper, word.shr::<16>(), word & F::Uint::splat(0xffff));
    let magnitude = bits & F::Uint::splat(0x7fff);
    // The exponent bias is 15 there and 127 here. Without an exponent, the unit is 2⁻²⁴.
    let normal = magnitude.shl::<13>() + F::Uint::splat(112 << 23);
    let small = (magnitude.to_float() * (1.0 / 16_777_216.0)).to_bits();
    let value = F::Uint::select(magnitude.lt(F::Uint::splat(0x400)), small, normal);
    F::from_bits(value | (bits & F::Uint::splat(0x8000)).shl::<16>())
}

impl TextureTable {
    /// [`Texels`], one lane after the other. It does not depend on the instructions of a level.
    #[inline(never)]
    fn sum_texels(
        &self,
        active: u32,
        rows: &[u32; MAX_LANES],
        places: &[[u32; MAX_LANES]; 4],
        weights: &[[f32; MAX_LANES]; 4],
        sums: &mut [[f32; MAX_LANES]; 3],
    ) {
        let mut lanes = active;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let (picture, form) = self.rows.of(rows[lane] as usize);
            let picture = &self.pictures[picture];
            let mut sum = [0.0; 3];
            for (places, weights) in places.iter().zip(weights) {
                let weight = weights[lane];
                // For nearest texels and at edges, most weights are zero.
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
