//! The media inside dielectrics.
//!
//! A scene has media if one of its dielectrics absorbs or has a priority. Then all solid dielectrics bound media,
//! including smooth glass, which does not absorb and has the priority 0. Otherwise there are none, and paths do not
//! track their media.

use super::row::{IOR, Medium, Row};
use crate::math::exp::exp_minus;
use crate::math::{ColumnReader, Float, Rgb, Uint, function};
use std::collections::HashMap;

/// The maximum number of media in a scene: paths store their numbers in 16 bits. Zero is no medium.
pub const MOST_MEDIA: usize = 0xffff;

/// The maximum number of nested dielectrics that paths track.
pub const MOST_INTERIORS: usize = 4;

/// All media, and the one that each material bounds: one column for each property. Media are numbered from one; zero is
/// the surrounding medium, which neither refracts nor absorbs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Media {
    /// By rows of materials, with one more at the end: the medium inside, zero for none.
    medium: Vec<u32>,
    /// By media: one more than [`Medium::priority`], zero for the surrounding medium.
    priority: Vec<u32>,
    /// By media.
    index: Vec<f32>,
    /// By media.
    absorption: [Vec<f32>; 3],
    count: usize,
    nests: bool,
}

impl Media {
    /// The media of some materials. Equal media are merged.
    pub fn new(rows: &[Row]) -> Media {
        let inside = || rows.iter().filter_map(|row| row.medium);
        let nests = inside().any(|medium| medium.priority > 0);
        if !nests && inside().all(|medium| medium.absorption == [0.0; 3]) {
            return Media::default();
        }
        let len = rows.len() + 1;
        let mut media = Media {
            medium: vec![0; len],
            priority: vec![0; len],
            index: vec![1.0; len],
            absorption: [(); 3].map(|()| vec![0.0; len]),
            count: 0,
            nests,
        };
        let mut known = HashMap::new();
        for (row, own) in rows.iter().enumerate() {
            let Some(Medium { priority, absorption }) = own.medium else { continue };
            let index = own.numbers[IOR];
            let key = (priority, index.to_bits(), absorption.map(f32::to_bits));
            let next = known.len() + 1;
            let number = *known.entry(key).or_insert(next);
            media.medium[row] = number as u32;
            media.priority[number] = priority + 1;
            media.index[number] = index;
            media.absorption.iter_mut().zip(absorption).for_each(|(column, sigma)| column[number] = sigma);
        }
        media.count = known.len();
        media
    }

    /// Nested media, the effective one first, as paths store them: [`MOST_INTERIORS`], two per word with the first in
    /// the lower 16 bits, followed by zeros. Further ones are dropped.
    pub fn packed(mut media: impl Iterator<Item = u32>) -> [u32; 2] {
        let mut next = || media.next().unwrap_or(0);
        [(); MOST_INTERIORS / 2].map(|()| next() | (next() << 16))
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.medium.is_empty()
    }

    /// The number of media.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether any has a priority. Then indices of refraction are those of media, and an interface has the ratio of the
    /// index inside to that of the surrounding medium. Otherwise an interface has the index in the scene, whatever
    /// surrounds it.
    #[inline(always)]
    pub fn nests(&self) -> bool {
        self.nests
    }

    /// Visits the columns.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Media { medium, priority, index, absorption, count: _, nests: _ } = self;
        reader.words("medium", medium);
        reader.words("priority", priority);
        reader.floats("ior", index);
        reader.vectors("absorption", absorption);
    }

    /// The media inside materials; zero for none.
    #[inline(always)]
    pub fn medium<U: Uint>(&self, material: U) -> U {
        U::gather(&self.medium, material)
    }

    /// Greater for higher priorities, zero for the surrounding medium.
    #[inline(always)]
    pub fn priority<U: Uint>(&self, medium: U) -> U {
        U::gather(&self.priority, medium)
    }

    /// The indices of refraction of media.
    #[inline(always)]
    pub fn index<F: Float>(&self, medium: F::Uint) -> F {
        F::gather(&self.index, medium)
    }

    /// The fraction of light that passes through a length `t` of media, which may be infinite: exp(−σt), the
    /// Beer–Lambert law.
    #[inline(always)]
    pub fn transmittance<F: Float>(&self, medium: F::Uint, t: F) -> Rgb<F> {
        function!(F, transmittance(medium, t), {
            // A medium without absorption does not absorb at infinity either.
            let t = t.min(F::splat(f32::MAX));
            let depth = Rgb::gather(&self.absorption, medium) * t;
            Rgb::new(exp_minus(depth.r), exp_minus(depth.g), exp_minus(depth.b))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{DielectricParameters, GlassParameters, MaterialParameters, MatteParameters};
    use crate::math::lanes::scalar::Wrapping;

    fn dielectric(absorption: [f64; 3], priority: f64) -> DielectricParameters {
        DielectricParameters {
            ior: 1.25,
            roughness: [0.0; 2],
            absorption,
            thin_walled: false,
            priority,
            reflectance: [1.0; 3],
            transmittance: [1.0; 3],
        }
    }

    #[test]
    fn media_exist_only_with_absorption_or_priorities() {
        let glass = GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: [1.0; 3] }.row();
        let clear = dielectric([0.0; 3], 0.0).row();
        assert!(Media::new(&[glass, clear]).is_empty());
        for (absorption, priority) in [([0.0, 1.0, 0.0], 0.0), ([0.0; 3], 1.0)] {
            let media = Media::new(&[glass, dielectric(absorption, priority).row(), clear]);
            assert_eq!((media.is_empty(), media.count(), media.nests()), (false, 3, priority > 0.0));
        }
        // A sheet has no inside.
        let sheet = DielectricParameters { thin_walled: true, ..dielectric([1.0; 3], 1.0) };
        assert!(Media::new(&[sheet.row()]).is_empty());
    }

    #[test]
    fn equal_media_are_merged() {
        let matte = MatteParameters { reflectance: [0.5; 3], roughness: 0.0 }.row();
        let water = dielectric([0.0, 0.5, 1.0], 2.0);
        let frosted = DielectricParameters { roughness: [0.5; 2], ..water };
        let other = DielectricParameters { priority: 3.0, ..water };
        let media = Media::new(&[water.row(), matte, frosted.row(), other.row()]);
        let medium = |row| media.medium(Wrapping(row)).0;
        assert_eq!([0, 1, 2, 3].map(medium), [1, 0, 1, 2]);
        let priority = |medium| media.priority(Wrapping(medium)).0;
        assert_eq!([0, 1, 2].map(priority), [0, 3, 4]);
        assert_eq!([0, 1].map(|medium| media.index::<f32>(Wrapping(medium))), [1.0, 1.25]);
    }

    #[test]
    fn media_are_packed_two_to_a_word() {
        let packed = |media: &[u32]| Media::packed(media.iter().copied());
        assert_eq!([packed(&[]), packed(&[5])], [[0, 0], [5, 0]]);
        assert_eq!(packed(&[1, 2, 3, 0xffff, 5]), [0x2_0001, 0xffff_0003]);
    }

    #[test]
    fn transmittance_follows_the_beer_lambert_law() {
        let media = Media::new(&[dielectric([0.0, 0.5, 1.0], 0.0).row()]);
        let [r, g, b] = media.transmittance::<f32>(Wrapping(1), 2.0).lane(0);
        assert!(r == 1.0 && (g - 0.367_879_4).abs() < 1e-6 && (b - 0.135_335_3).abs() < 1e-6, "{g} {b}");
        let far = |medium| media.transmittance::<f32>(Wrapping(medium), f32::INFINITY).lane(0);
        assert_eq!([far(0), far(1)], [[1.0; 3], [1.0, 0.0, 0.0]]);
    }
}
