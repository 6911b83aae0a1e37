//! Strides: the division of pixels among workers (report §3.2, figure 3.1).

use crate::film::Rectangle;
use crate::integrator::Pixel;
use serde::{Deserialize, Serialize};

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

    /// The region with so many pixels more on each side, as far as the film has them, and where in that it lies.
    pub fn with_margin(self, margin: u32, film_height: u32) -> (Region, Rectangle) {
        let wider = |from: u32, len: u32, side: u32| {
            let first = from.saturating_sub(margin);
            (first, side.min(from + len + margin) - first)
        };
        let (x, width) = wider(self.x, self.width, self.film_width);
        let (y, height) = wider(self.y, self.height, film_height);
        let inner = Rectangle { x: self.x - x, y: self.y - y, width: self.width, height: self.height };
        (Region { film_width: self.film_width, x, y, width, height }, inner)
    }

    /// Whether all of another region is in it.
    pub fn holds(&self, other: Region) -> bool {
        let within = |from: u32, len: u32, inner: u32, inner_len: u32| {
            from <= inner && inner + inner_len <= from + len
        };
        within(self.x, self.width, other.x, other.width) && within(self.y, self.height, other.y, other.height)
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

/// Every Nth place of a region, {first, first + step, first + 2·step, …}; or every Nth run of so many places, for a
/// worker that is as fast as many others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stride {
    /// The first place.
    pub first: u32,
    /// The distance between places, or from the first of one run to the first of the next: at least one.
    pub step: u32,
    /// Places in a run: at most as many as a step, and one for a plain stride. A stride whose runs are empty holds
    /// nothing.
    pub run: u32,
}

impl Stride {
    /// All places.
    pub const ALL: Stride = Stride::every(1, 0);

    /// The places first, first + step, first + 2·step, …
    pub const fn every(step: u32, first: u32) -> Stride {
        Stride { first, step, run: 1 }
    }

    /// Part `i` of `m`, which is again a stride: together the m parts hold each place once. Runs are cut into m.
    pub fn split(self, i: u32, m: u32) -> Stride {
        if self.run == 1 {
            return Stride { first: self.first + i * self.step, step: self.step * m, run: 1 };
        }
        let cut = |i: u32| (u64::from(self.run) * u64::from(i) / u64::from(m)) as u32;
        Stride { first: self.first + cut(i), step: self.step, run: cut(i + 1) - cut(i) }
    }

    /// How many of a region's `len` places the stride holds.
    pub fn len(self, len: u32) -> u32 {
        let reach = len.saturating_sub(self.first);
        reach / self.step * self.run + (reach % self.step).min(self.run)
    }

    /// Its `slot`th place.
    pub fn place(self, slot: u32) -> u32 {
        match self.run {
            1 => self.first + slot * self.step,
            run => self.first + slot / run * self.step + slot % run,
        }
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
    fn runs_and_parts_of_them_hold_each_place_once() {
        for (len, step, cuts) in
            [(1000, 10, vec![0, 7, 10]), (1000, 17, vec![0, 1, 2, 17]), (5, 9, vec![0, 4, 9])]
        {
            let wide = cuts.windows(2).map(|cut| Stride { first: cut[0], step, run: cut[1] - cut[0] });
            for m in [1, 3, 8] {
                let parts = wide.clone().flat_map(|stride| (0..m).map(move |i| stride.split(i, m)));
                let mut all: Vec<u32> = parts.flat_map(|part| places(part, len)).collect();
                all.sort_unstable();
                assert_eq!(all, (0..len).collect::<Vec<_>>());
            }
        }
        assert_eq!(places(Stride { first: 2, step: 10, run: 3 }, 24), [2, 3, 4, 12, 13, 14, 22, 23]);
    }

    #[test]
    fn a_margin_ends_with_the_film() {
        let region = Region { film_width: 100, x: 10, y: 1, width: 85, height: 40 };
        let (wider, inner) = region.with_margin(3, 42);
        assert_eq!(wider, Region { film_width: 100, x: 7, y: 0, width: 91, height: 42 });
        assert_eq!(inner, Rectangle { x: 3, y: 1, width: 85, height: 40 });
        assert_eq!(region.with_margin(0, 42).0, region);
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
