//! Parts of films.

use super::sample::Pixel;

/// A rectangle of a film's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl Rectangle {
    /// The indices of its pixels on a film with this number of pixels per row, row by row.
    pub fn places(self, film_width: u32) -> impl Iterator<Item = usize> + Clone {
        let row = move |y: u32| {
            let first = y as usize * film_width as usize + self.x as usize;
            first..first + self.width as usize
        };
        (self.y..self.y + self.height).flat_map(row)
    }

    /// Whether it lies within this number of columns and rows and is not empty.
    pub fn fits(self, width: u32, height: u32) -> bool {
        let fits =
            |from: u32, len: u32, side: u32| len > 0 && from.checked_add(len).is_some_and(|end| end <= side);
        fits(self.x, self.width, width) && fits(self.y, self.height, height)
    }
}

/// The part of a film that is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// The number of pixels in a row of the full film.
    pub film_width: u32,
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl Region {
    /// The whole film.
    pub fn whole(width: u32, height: u32) -> Region {
        Region { film_width: width, x: 0, y: 0, width, height }
    }

    /// The region with a margin of this number of pixels on each side, within the film, and the position of the region
    /// in the result.
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

    /// Whether it contains another region.
    pub fn contains(&self, other: Region) -> bool {
        let within = |from: u32, len: u32, inner: u32, inner_len: u32| {
            from <= inner && inner + inner_len <= from + len
        };
        within(self.x, self.width, other.x, other.width) && within(self.y, self.height, other.y, other.height)
    }

    /// The number of pixels, below 2³².
    pub fn len(&self) -> u32 {
        self.width * self.height
    }

    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The pixel at an index in the region, row-major from its top left.
    pub fn pixel(&self, place: u32) -> Pixel {
        let (x, y) = (self.x + place % self.width, self.y + place / self.width);
        Pixel { index: y * self.film_width + x, x, y }
    }

    /// The index in the region of a pixel of the film.
    pub fn place(&self, pixel: u32) -> u32 {
        let (x, y) = (pixel % self.film_width, pixel / self.film_width);
        (y - self.y) * self.width + (x - self.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_ends_at_the_edge_of_the_film() {
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
