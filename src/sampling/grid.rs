//! Sampling of the unit square in proportion to numbers on a grid.

use crate::math::{BELOW_ONE, ColumnReader, Float, Uint};

/// The base-two logarithm of the number of cells along a side.
const BITS: u32 = 7;

/// The number of cells along a side of a grid.
pub const CELLS: usize = 1 << BITS;

/// The fraction of points that are sampled uniformly, so that there are some in features that the grid does not
/// resolve.
const UNIFORM: f64 = 0.02;

/// Grids of numbers over the unit square. The square is halved along u and v alternately, down to single cells; the
/// sampled point falls into a half in proportion to the numbers there. Points of a stratified sequence therefore remain
/// stratified (Clarberg, Jarosz, Akenine-Möller and Jensen 2005, "Wavelet Importance Sampling", §4.2, and McCool and
/// Harwood 1997, "Probability Trees").
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grids {
    /// For each grid, the fraction of the first half in each part: that of the square at 1, those of the halves of the
    /// part `i` at 2·i and 2·i + 1.
    pub(super) share: Vec<f32>,
    /// For each grid, the density in each cell, row by row from v = 0; for the smooth grid, the density at each point.
    pub(super) density: Vec<f32>,
    /// The dimensions of the smooth grid; there is at most one.
    pub(super) smooth: Smooth,
}

/// The dimensions of the smooth grid: see [`Grids::push_smooth`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Smooth {
    /// The numbers of columns and rows of points.
    pub(super) size: [u32; 2],
    /// The base-two logarithms of the smallest powers of two that are not less.
    pub(super) bits: [u32; 2],
}

impl Smooth {
    /// The number of columns of points. By reference, because recorded programs identify a number by its address.
    pub fn columns(&self) -> &u32 {
        &self.size[0]
    }

    /// The number of rows of points, likewise.
    pub fn rows(&self) -> &u32 {
        &self.size[1]
    }

    /// Its size in memory, in bytes.
    pub fn bytes(&self) -> usize {
        (2 * size_of::<f32>()) << (self.bits[0] + self.bits[1])
    }
}

impl Grids {
    /// Adds a grid of numbers, all at least zero, row by row from v = 0, and returns its start. If all are zero, it is
    /// uniform.
    ///
    /// # Panics
    ///
    /// If the number of numbers is not [`CELLS`]².
    pub fn push(&mut self, numbers: &[f32]) -> u32 {
        let cells = CELLS * CELLS;
        assert_eq!(numbers.len(), cells, "numbers of a grid");
        let total: f64 = numbers.iter().copied().map(f64::from).sum();
        let uniform = if total > 0.0 { UNIFORM } else { 1.0 };
        let density = |number: f32| {
            let relative = if total > 0.0 { f64::from(number) * cells as f64 / total } else { 0.0 };
            relative * (1.0 - uniform) + uniform
        };
        self.density.extend(numbers.iter().map(|&number| density(number) as f32));
        self.push_shares([CELLS; 2], [BITS; 2], |x, y| density(numbers[y * CELLS + x]))
    }

    /// Adds the fractions of halves, given the `mass` of each cell by its column and row, and returns their start. The
    /// square is divided into 2^bits columns and rows; those beyond `size` are empty.
    pub(super) fn push_shares(
        &mut self,
        size: [usize; 2],
        bits: [u32; 2],
        mass: impl Fn(usize, usize) -> f64,
    ) -> u32 {
        let first = self.share.len();
        let cells = 1 << (bits[0] + bits[1]);
        let mut sums = vec![0.0; 2 * cells];
        for y in 0..size[1] {
            for x in 0..size[0] {
                sums[cells + leaf([x, y], bits)] = mass(x, y);
            }
        }
        for part in (1..cells).rev() {
            sums[part] = sums[2 * part] + sums[2 * part + 1];
        }
        self.share.push(0.0);
        // No point falls into a part without mass.
        let share = |part: usize| if sums[part] > 0.0 { sums[2 * part] / sums[part] } else { 1.0 };
        self.share.extend((1..cells).map(|part| share(part) as f32));
        first as u32
    }

    /// Visits the columns.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Grids { share, density, smooth: _ } = self;
        reader.floats("share", share);
        reader.floats("density", density);
    }

    /// A point by the grid that starts at `first`, sampled with `u` in [0, 1)². There must be a grid.
    #[inline(always)]
    pub fn sample<F: Float>(&self, first: F::Uint, u: [F; 2]) -> [F; 2] {
        let [along_u, along_v] = self.descend(first, u, [BITS; 2]);
        [along_u.point(), along_v.point()]
    }

    /// The column and row to which `u` descends, out of 2^bits each.
    #[inline(always)]
    pub(super) fn descend<F: Float>(
        &self,
        first: F::Uint,
        [u, v]: [F; 2],
        [bits_u, bits_v]: [u32; 2],
    ) -> [Halving<F>; 2] {
        let mut part = F::Uint::splat(1);
        let (mut along_u, mut along_v) = (Halving::new(u), Halving::new(v));
        let (mut left_u, mut left_v) = (bits_u, bits_v);
        while left_u + left_v > 0 {
            if left_u >= left_v {
                part = self.halve(first, part, &mut along_u);
                left_u -= 1;
            } else {
                part = self.halve(first, part, &mut along_v);
                left_v -= 1;
            }
        }
        [along_u, along_v]
    }

    /// Continues with one half of a part.
    #[inline(always)]
    fn halve<F: Float>(&self, first: F::Uint, part: F::Uint, along: &mut Halving<F>) -> F::Uint {
        let share = F::gather(&self.share, first + part);
        let is_first = along.rest.lt(share);
        let rest = F::select(is_first, along.rest / share, (along.rest - share) / (-share + 1.0));
        along.rest = rest.min(F::splat(BELOW_ONE));
        along.size = along.size * 0.5;
        along.from = F::select(is_first, along.from, along.from + along.size);
        part.shl::<1>() + F::Uint::select(is_first, F::Uint::splat(0), F::Uint::splat(1))
    }

    /// The density of points by area, at a point of the square.
    #[inline(always)]
    pub fn density<F: Float>(&self, first: F::Uint, [u, v]: [F; 2]) -> F {
        F::gather(&self.density, first + cell::<F>(u) + cell::<F>(v).shl::<BITS>())
    }
}

/// The cell of a number in the unit interval.
#[inline(always)]
fn cell<F: Float>(x: F) -> F::Uint {
    (x * CELLS as f32).max(F::zero()).min(F::splat((CELLS - 1) as f32)).to_uint()
}

/// A part of the unit interval, and the position of a point in it.
pub(super) struct Halving<F> {
    pub(super) from: F,
    size: F,
    /// In [0, 1).
    pub(super) rest: F,
}

impl<F: Float> Halving<F> {
    #[inline(always)]
    fn new(rest: F) -> Self {
        Halving { from: F::zero(), size: F::splat(1.0), rest }
    }

    #[inline(always)]
    fn point(&self) -> F {
        (self.from + self.size * self.rest).min(F::splat(BELOW_ONE))
    }
}

/// The index of a cell among the smallest halves: the bits of both coordinates interleaved in the order of
/// [`Grids::descend`].
fn leaf([x, y]: [usize; 2], [mut left_u, mut left_v]: [u32; 2]) -> usize {
    let mut leaf = 0;
    while left_u + left_v > 0 {
        let bit = if left_u >= left_v {
            left_u -= 1;
            x >> left_u & 1
        } else {
            left_v -= 1;
            y >> left_v & 1
        };
        leaf = leaf << 1 | bit;
    }
    leaf
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    /// A grid that is not the first, with a large number in one corner and zeros in another.
    fn example() -> (Grids, u32, Vec<f32>) {
        let mut grids = Grids::default();
        grids.push(&vec![0.0; CELLS * CELLS]);
        let number = |x: usize, y: usize| {
            if x < CELLS / 4 && y >= CELLS / 2 { 0.0 } else { 1.0 + x as f32 * 0.1 + (y * y) as f32 * 0.01 }
        };
        let numbers: Vec<f32> = (0..CELLS * CELLS).map(|i| number(i % CELLS, i / CELLS)).collect();
        let first = grids.push(&numbers);
        (grids, first, numbers)
    }

    #[test]
    fn cells_get_points_in_proportion_to_their_numbers() {
        let (grids, first, numbers) = example();
        let total: f64 = numbers.iter().copied().map(f64::from).sum();
        // Each cell contains the expected number of points, evenly spread.
        let side = 1024;
        let mut counts = vec![0.0; CELLS * CELLS];
        for i in 0..side * side {
            let u = [i % side, i / side].map(|i| (i as f32 + 0.5) / side as f32);
            let [x, y] = grids.sample::<f32>(Wrapping(first), u);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "{u:?}: {x} {y}");
            let cell = [x, y].map(|x| (x * CELLS as f32) as usize);
            counts[cell[1] * CELLS + cell[0]] += 1.0;
        }
        // By blocks of 8×8 cells.
        let mut worst = 0.0_f64;
        for block in 0..(CELLS / 8) * (CELLS / 8) {
            let (bx, by) = (block % (CELLS / 8) * 8, block / (CELLS / 8) * 8);
            let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
                (0..64).map(|i| of((by + i / 8) * CELLS + bx + i % 8)).sum()
            };
            let got = sum(&|i| counts[i]) / f64::from(side * side);
            let expected =
                sum(&|i| f64::from(numbers[i])) / total * 0.98 + 0.02 * 64.0 / (CELLS * CELLS) as f64;
            // Where few points are expected, those of a regular grid are too few for a comparison.
            let blocks = ((CELLS / 8) * (CELLS / 8)) as f64;
            worst = worst.max((got - expected).abs() / expected.max(0.3 / blocks));
        }
        assert!(worst < 0.08, "{worst}");
    }

    #[test]
    fn densities_match_the_points_and_sum_to_one() {
        let (grids, first, numbers) = example();
        let at = |x: usize, y: usize| {
            let point = [x, y].map(|i| (i as f32 + 0.5) / CELLS as f32);
            f64::from(grids.density::<f32>(Wrapping(first), point))
        };
        let cells = || (0..CELLS * CELLS).map(|i| (i % CELLS, i / CELLS));
        let sum: f64 = cells().map(|(x, y)| at(x, y)).sum::<f64>() / (CELLS * CELLS) as f64;
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        assert!(cells().all(|(x, y)| at(x, y) >= 0.0199));
        let total: f64 = numbers.iter().copied().map(f64::from).sum();
        let expected = f64::from(numbers[5 * CELLS + 90]) / total * (CELLS * CELLS) as f64 * 0.98 + 0.02;
        assert!((at(90, 5) - expected).abs() < 1e-5);
        // The area of the image of a small square is its area divided by the density there.
        for u in [[0.1, 0.2], [0.7, 0.3], [0.45, 0.9], [0.999, 0.001]] {
            let step = 1e-4;
            let go = |u: [f32; 2]| grids.sample::<f32>(Wrapping(first), u);
            let [p, q] = [go(u), go([u[0] + step, u[1] + step])];
            let area = (q[0] - p[0]) * (q[1] - p[1]);
            let same_cell = (0..2).all(|i| (p[i] * CELLS as f32).floor() == (q[i] * CELLS as f32).floor());
            let density = grids.density::<f32>(Wrapping(first), p);
            assert!(
                !same_cell || (area * density / (step * step) - 1.0).abs() < 0.05,
                "{u:?}: {area} {density}"
            );
        }
        // The density is uniform if all numbers are zero.
        assert_eq!(grids.density::<f32>(Wrapping(0), [0.3, 0.8]), 1.0);
        let [x, y] = grids.sample::<f32>(Wrapping(0), [0.3, 0.8]);
        assert!((x - 0.3).abs() < 1e-5 && (y - 0.8).abs() < 1e-5);
    }
}
