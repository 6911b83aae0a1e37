//! Strides: who owns which pixels (report §3.2, figure 3.1).

use crate::integrator::Pixel;

/// The part of a film that is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Pixels in a row of the full film.
    pub film_width: u32,
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// The whole of a film.
    pub fn whole(width: u32, height: u32) -> Region {
        Region { film_width: width, x: 0, y: 0, width, height }
    }

    /// How many pixels there are: fewer than 2³².
    pub fn len(&self) -> u32 {
        self.width * self.height
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The pixel at a place in the region, row-major from its top left.
    pub fn pixel(&self, place: u32) -> Pixel {
        let (x, y) = (self.x + place % self.width, self.y + place / self.width);
        Pixel { index: y * self.film_width + x, x, y }
    }

    /// The place in the region of a pixel of the film.
    pub fn place(&self, pixel: u32) -> u32 {
        let (x, y) = (pixel % self.film_width, pixel / self.film_width);
        (y - self.y) * self.width + (x - self.x)
    }
}

/// Every Nth place of a region: {first, first + step, first + 2·step, …}.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stride {
    /// The first place.
    pub first: u32,
    /// The distance between places, at least one.
    pub step: u32,
}

impl Stride {
    /// All places.
    pub const ALL: Stride = Stride { first: 0, step: 1 };

    /// Part `i` of `m`, which is again a stride: together the m parts hold each place once.
    pub fn split(self, i: u32, m: u32) -> Stride {
        Stride { first: self.first + i * self.step, step: self.step * m }
    }

    /// How many of a region's `len` places the stride holds.
    pub fn len(self, len: u32) -> u32 {
        len.saturating_sub(self.first).div_ceil(self.step)
    }

    /// Its `slot`th place.
    pub fn place(self, slot: u32) -> u32 {
        self.first + slot * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(stride: Stride, len: u32) -> Vec<u32> {
        (0..stride.len(len)).map(|slot| stride.place(slot)).collect()
    }

    #[test]
    fn parts_of_a_stride_hold_each_place_once() {
        for (len, n, m) in [(100, 1, 7), (100, 3, 4), (5, 8, 3), (1, 1, 1), (64, 16, 64)] {
            for s in 0..n {
                let stride = Stride::ALL.split(s, n);
                let mut parts: Vec<u32> = (0..m).flat_map(|i| places(stride.split(i, m), len)).collect();
                parts.sort_unstable();
                assert_eq!(parts, places(stride, len));
                assert!(parts.iter().all(|place| place % n == s));
            }
        }
    }

    #[test]
    fn a_region_numbers_its_pixels_as_the_film_does() {
        let region = Region { film_width: 100, x: 10, y: 20, width: 3, height: 2 };
        assert_eq!(region.pixel(0), Pixel { index: 2010, x: 10, y: 20 });
        assert_eq!(region.pixel(5), Pixel { index: 2112, x: 12, y: 21 });
        for place in 0..region.len() {
            assert_eq!(region.place(region.pixel(place).index), place);
        }
    }
}
