//! Sampling of the unit square by a density that is bilinear between numbers on a grid.

use super::grid::{Grids, Smooth};
use crate::math::{BELOW_ONE, Float, Uint, function, value};

/// The maximum number of points of the smooth grid along u, and along v.
pub const MOST_POINTS: [usize; 2] = [2048, 1024];

/// A point by the smooth grid.
#[derive(Clone, Copy, Debug)]
pub struct SmoothPoint<F: Float> {
    /// Its position in the square.
    pub at: [F; 2],
    /// The density of points there, by area.
    pub density: F,
}

value!(SmoothPoint { at, density });

impl Grids {
    /// Sets the smooth grid of numbers, all at least zero, row by row from v = 0, and returns its start. If all are
    /// zero, it is uniform.
    ///
    /// Its numbers are at ((i + ½)/columns, (j + ½)/rows), like the texels of a picture, and it is periodic. It has as
    /// many cells as points, each between four of them. Cells are sampled like those of other grids; in a cell, the
    /// bilinear density is inverted along v and then along u.
    ///
    /// # Panics
    ///
    /// If the number of numbers is not `columns` × `rows`, is zero or above [`MOST_POINTS`], or if there is a smooth
    /// grid already.
    pub fn push_smooth(&mut self, [columns, rows]: [usize; 2], numbers: &[f64]) -> u32 {
        assert_eq!(self.smooth, Smooth::default(), "one smooth grid");
        assert!(columns > 0 && rows > 0 && columns <= MOST_POINTS[0] && rows <= MOST_POINTS[1]);
        assert_eq!(numbers.len(), columns * rows, "numbers of a grid");
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        let density = |x: usize, y: usize| {
            if mean > 0.0 { (numbers[y % rows * columns + x % columns] / mean) as f32 } else { 1.0 }
        };
        let bits = [columns, rows].map(|n| n.next_power_of_two().trailing_zeros());
        self.smooth = Smooth { size: [columns as u32, rows as u32], bits };
        let first = self.push_shares([columns, rows], bits, |x, y| {
            let corners = [density(x, y), density(x + 1, y), density(x, y + 1), density(x + 1, y + 1)];
            corners.into_iter().map(f64::from).sum()
        });
        self.density.extend((0..numbers.len()).map(|i| density(i % columns, i / columns)));
        // The columns of a table have equal length.
        self.density.resize(self.share.len(), 0.0);
        first
    }

    /// The dimensions of the smooth grid; zero if there is none.
    pub fn smooth(&self) -> &Smooth {
        &self.smooth
    }

    /// A point by the smooth grid, which starts at `first`, sampled with `u` in [0, 1)².
    #[inline(always)]
    pub fn sample_smooth<F: Float>(&self, first: F::Uint, u: [F; 2]) -> SmoothPoint<F> {
        function!(F, sample_smooth(first, u), {
            let [along_u, along_v] = self.descend(first, u, self.smooth.bits);
            let [bits_u, bits_v] = self.smooth.bits;
            let x = along_u.from * (1_u32 << bits_u) as f32;
            let y = along_v.from * (1_u32 << bits_v) as f32;
            let [low, high] = self.corners(first, x, y);
            let t = ramp(low[0] + low[1], high[0] + high[1], along_v.rest);
            let left = low[0] + (high[0] - low[0]) * t;
            let right = low[1] + (high[1] - low[1]) * t;
            let s = ramp(left, right, along_u.rest);
            let [columns, rows] = self.sides::<F>();
            SmoothPoint {
                at: [around((x + s + 0.5) / columns), around((y + t + 0.5) / rows)],
                density: left + (right - left) * s,
            }
        })
    }

    /// The density of points by area, at a point of the square.
    #[inline(always)]
    pub fn density_smooth<F: Float>(&self, first: F::Uint, at: [F; 2]) -> F {
        function!(F, density_smooth(first, at), {
            let [columns, rows] = self.sides::<F>();
            let (x, y) = (at[0] * columns - 0.5, at[1] * rows - 0.5);
            let (column, row) = (x.floor(), y.floor());
            let (s, t) = (x - column, y - row);
            let zero = F::zero();
            let column = F::select(column.lt(zero), column + columns, column);
            let row = F::select(row.lt(zero), row + rows, row);
            let [low, high] = self.corners(first, column, row);
            let left = low[0] + (high[0] - low[0]) * t;
            let right = low[1] + (high[1] - low[1]) * t;
            left + (right - left) * s
        })
    }

    /// Columns and rows of the smooth grid.
    #[inline(always)]
    fn sides<F: Float>(&self) -> [F; 2] {
        [F::Uint::given(&self.smooth.size[0]).to_float(), F::Uint::given(&self.smooth.size[1]).to_float()]
    }

    /// The numbers at the corners of a cell: those of lower v first, those of lower u first among them.
    #[inline(always)]
    fn corners<F: Float>(&self, first: F::Uint, column: F, row: F) -> [[F; 2]; 2] {
        let [columns, rows] = self.sides::<F>();
        let (left, right) = (column.to_uint(), following(column, columns).to_uint());
        let width = F::Uint::given(&self.smooth.size[0]);
        let (low, high) = (first + row.to_uint() * width, first + following(row, rows).to_uint() * width);
        [
            [self.number(low + left), self.number(low + right)],
            [self.number(high + left), self.number(high + right)],
        ]
    }

    #[inline(always)]
    fn number<F: Float>(&self, place: F::Uint) -> F {
        F::gather(&self.density, place)
    }
}

/// The next column or row, out of this number.
#[inline(always)]
fn following<F: Float>(one: F, of: F) -> F {
    let next = one + 1.0;
    next.only(next.lt(of))
}

/// A number in [0, 1) with a density that is linear from `a` to `b`, from `u` in [0, 1). Inverts its distribution
/// function, in the form without cancellation.
#[inline(always)]
fn ramp<F: Float>(a: F, b: F, u: F) -> F {
    let (a2, b2) = (a * a, b * b);
    let root = (a2 + (b2 - a2) * u).max(F::zero()).sqrt();
    // If all numbers are zero, no point is requested.
    let sum = (a + root).max(F::splat(f32::MIN_POSITIVE));
    ((a + b) * u / sum).min(F::splat(BELOW_ONE))
}

/// The equivalent point of the periodic square.
#[inline(always)]
fn around<F: Float>(x: F) -> F {
    F::select(x.lt(F::splat(1.0)), x, x - 1.0).min(F::splat(BELOW_ONE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    /// A smooth grid that is not the first, with sizes that are not powers of two, with one large number and many
    /// zeros.
    fn example() -> (Grids, u32) {
        let mut grids = Grids::default();
        grids.push(&vec![1.0; super::super::CELLS * super::super::CELLS]);
        let number = |x: usize, y: usize| match (x, y) {
            (11, 3) => 50.0,
            (12, 3) => 20.0,
            (0..5, 4..) => 0.0,
            _ => 0.2 + (x * y) as f64 * 0.01,
        };
        let numbers: Vec<f64> = (0..19 * 6).map(|i| number(i % 19, i / 19)).collect();
        let first = grids.push_smooth([19, 6], &numbers);
        (grids, first)
    }

    #[test]
    fn the_density_is_bilinear_and_sums_to_one() {
        let (grids, first) = example();
        let density = |u: f32, v: f32| f64::from(grids.density_smooth::<f32>(Wrapping(first), [u, v]));
        let side = 19 * 6 * 4;
        let at = |i: usize| ((i as f64 + 0.5) / side as f64) as f32;
        let sum: f64 = (0..side * side).map(|i| density(at(i % side), at(i / side))).sum();
        assert!((sum / (side * side) as f64 - 1.0).abs() < 1e-4, "{sum}");
        let point = |x: f32, y: f32| density((x + 0.5) / 19.0, (y + 0.5) / 6.0);
        assert!((point(11.0, 3.0) / point(12.0, 3.0) - 2.5).abs() < 1e-4);
        let between = (point(11.0, 3.0) + point(12.0, 3.0)) / 2.0;
        assert!((point(11.5, 3.0) / between - 1.0).abs() < 1e-4);
        // Across the edges.
        let around = (point(0.0, 2.0) + point(18.0, 2.0)) / 2.0;
        for u in [0.0, 1.0] {
            assert!((density(u, 2.5 / 6.0) / around - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn points_follow_the_density_and_carry_it() {
        let (grids, first) = example();
        // Hammersley's points.
        let draws = 1_u32 << 18;
        let cells = [19 * 2, 6 * 2];
        let mut counts = vec![0.0; cells[0] * cells[1]];
        for i in 0..draws {
            let u = [i, i.reverse_bits() >> 14].map(|i| i as f32 / draws as f32);
            let SmoothPoint { at, density } = grids.sample_smooth::<f32>(Wrapping(first), u);
            assert!((0.0..1.0).contains(&at[0]) && (0.0..1.0).contains(&at[1]), "{u:?}: {at:?}");
            let own = grids.density_smooth::<f32>(Wrapping(first), at);
            assert!((own - density).abs() <= 2e-3 * density.max(1.0), "{at:?}: {own} is not {density}");
            let cell = [0, 1].map(|axis| (at[axis] * cells[axis] as f32) as usize);
            counts[cell[1] * cells[0] + cell[0]] += 1.0;
        }
        for (i, count) in counts.into_iter().enumerate() {
            let [x, y] = [i % cells[0], i / cells[0]].map(|i| i as f32);
            // A quarter of a cell is bilinear, so that its middle has its mean.
            let middle = [(x + 0.5) / cells[0] as f32, (y + 0.5) / cells[1] as f32];
            let expected = f64::from(grids.density_smooth::<f32>(Wrapping(first), middle));
            let got = count / f64::from(draws) * (cells[0] * cells[1]) as f64;
            assert!((got - expected).abs() < 0.03 * expected.max(0.3), "{middle:?}: {got}, not {expected}");
        }
    }

    /// The warp preserves strata: each elementary interval contains points in proportion to its mass.
    #[test]
    fn stratified_points_remain_stratified() {
        let mut grids = Grids::default();
        let numbers: Vec<f64> = (0..64 * 32).map(|i| if i % 64 < 16 { 3.0 } else { 1.0 }).collect();
        let first = grids.push_smooth([64, 32], &numbers);
        // Hammersley's points: one in each of the elementary intervals of 1/256.
        let halves = (0..256).filter(|&i: &u32| {
            let u = [i as f32 / 256.0, (i.reverse_bits() >> 24) as f32 / 256.0];
            let [x, _] = grids.sample_smooth::<f32>(Wrapping(first), u).at;
            (0.5..1.0).contains(&x)
        });
        // It contains a third of the mass.
        let halves = halves.count();
        assert!((84..=87).contains(&halves), "{halves}");
    }

    #[test]
    fn a_grid_of_zeros_is_uniform() {
        let mut grids = Grids::default();
        let first = grids.push_smooth([5, 3], &[0.0; 15]);
        let SmoothPoint { density, .. } = grids.sample_smooth::<f32>(Wrapping(first), [0.3, 0.8]);
        assert!((density - 1.0).abs() < 1e-6);
    }
}
