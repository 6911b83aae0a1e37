//! Two materials by turns.

use super::kind::Kind;
use super::program::Chooser;
use super::row::{Columns, NUMBERS, Row, narrow};
use crate::math::{Float, Uint};

/// Alternates two materials over the surface's uv.
#[derive(Clone, Copy, Debug)]
pub struct Checkerboard;

impl Checkerboard {
    /// The row of a board with the row `even` where ⌊u·a⌋ + ⌊v·b⌋ is even, and `odd` elsewhere, of a and b checks along
    /// u and v for each unit of uv.
    pub fn row(even: usize, odd: usize, checks_per_unit: [f64; 2]) -> Row {
        let [a, b] = narrow(checks_per_unit);
        Row {
            choices: [even as u32, odd as u32],
            numbers: [a, b, 0.0, 0.0, 0.0],
            ..Row::new(Kind::Checkerboard, [0.0; 3])
        }
    }

    /// The checks for each unit of u and v among the numbers of a row.
    pub fn unpack([a, b, ..]: [f32; NUMBERS]) -> [f32; 2] {
        [a, b]
    }
}

impl Chooser for Checkerboard {
    /// A check inside a check takes the coordinates within it, scaled to 0…1.
    #[inline(always)]
    fn choose<F: Float>(columns: &Columns, row: F::Uint, [u, v]: [F; 2]) -> (F::Uint, [F; 2]) {
        let a = u * columns.number::<F>(0, row);
        let b = v * columns.number::<F>(1, row);
        let (line, column) = (a.floor(), b.floor());
        let half = (line + column) * 0.5;
        let is_even = half.floor().ge(half);
        let chosen = F::Uint::select(is_even, columns.choice(0, row), columns.choice(1, row));
        (chosen, [a - line, b - column])
    }
}
