//! A checkerboard of two materials.

use super::kind::Kind;
use super::program::{Chooser, MaterialParameters};
use super::row::{Columns, Row, padded};
use crate::math::{Float, Uint, narrow};
use crate::parameter::limits::LENGTH;
use crate::parameter::{ParameterKind, parameters};

parameters! {
    /// Alternates two materials over the surface's uv: `even` is used where ⌊u·a⌋ + ⌊v·b⌋ is even, with a and b checks
    /// per unit.
    pub struct CheckerboardParameters: "checkerboard", "a checkerboard" {
        /// The name of the material on checks whose numbers along u and v have an even sum.
        even: usize = ParameterKind::Material,
        /// The name of the material on the other checks.
        odd: usize = ParameterKind::Material,
        // On planes the size of checks is a length.
        /// Checks per unit of uv: one number, or one along u and one along v. A plane's uv are lengths in the plane.
        checks_per_unit: [f64; 2] = ParameterKind::Pair(LENGTH) => "1",
    }
}

/// Alternates two materials over the surface's uv.
#[derive(Clone, Copy, Debug)]
pub struct Checkerboard;

impl MaterialParameters for CheckerboardParameters {
    fn row(&self) -> Row {
        Row {
            choices: [self.even, self.odd].map(|index| index as u32),
            numbers: padded(narrow(self.checks_per_unit)),
            ..Row::new(Kind::Checkerboard, [0.0; 3])
        }
    }
}

impl Chooser for Checkerboard {
    const BY_UV: bool = true;

    /// A checkerboard within a check uses coordinates within it, scaled to 0…1.
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

    #[inline(always)]
    fn uv_scale<F: Float>(columns: &Columns, row: F::Uint) -> [F; 2] {
        [columns.number(0, row), columns.number(1, row)]
    }
}
