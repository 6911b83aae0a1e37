//! A scene's materials as tables, from which lanes look up their BxDFs.

use super::bsdf::Bsdf;
use super::kind::Kind;
use crate::math::{Float, Mask, Rgb, Uint};

/// One material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// What it is.
    pub kind: Kind,
    /// Fraction reflected.
    pub reflectance: [f32; 3],
    /// Fraction transmitted (glass).
    pub transmittance: [f32; 3],
    /// Index of refraction (glass).
    pub ior: f32,
    /// Where the check is even and odd (checkerboard): rows before this one.
    pub checks: [u32; 2],
    /// Checks along u and v for each unit of uv (checkerboard).
    pub checks_per_unit: [f32; 2],
}

impl Row {
    /// A matte row, to be changed.
    pub fn matte(reflectance: [f32; 3]) -> Row {
        let (transmittance, ior) = ([0.0; 3], 1.0);
        Row { kind: Kind::Matte, reflectance, transmittance, ior, checks: [0; 2], checks_per_unit: [1.0; 2] }
    }
}

/// All materials, one column for each property.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialTable {
    kind: Vec<u32>,
    reflectance: [Vec<f32>; 3],
    transmittance: [Vec<f32>; 3],
    ior: Vec<f32>,
    even: Vec<u32>,
    odd: Vec<u32>,
    checks_u: Vec<f32>,
    checks_v: Vec<f32>,
    /// How many checkerboards lie inside one another at most.
    nesting: u32,
    has_glass: bool,
    rows: Vec<Row>,
}

impl MaterialTable {
    /// The table of these rows; a checkerboard names only rows before its own.
    pub fn new(rows: Vec<Row>) -> MaterialTable {
        let mut table = MaterialTable::default();
        let mut depth = Vec::with_capacity(rows.len());
        for row in &rows {
            table.kind.push(row.kind as u32);
            for c in 0..3 {
                table.reflectance[c].push(row.reflectance[c]);
                table.transmittance[c].push(row.transmittance[c]);
            }
            table.ior.push(row.ior);
            table.even.push(row.checks[0]);
            table.odd.push(row.checks[1]);
            table.checks_u.push(row.checks_per_unit[0]);
            table.checks_v.push(row.checks_per_unit[1]);
            table.has_glass |= row.kind == Kind::Glass;
            depth.push(match row.kind {
                Kind::Checkerboard => {
                    1 + row.checks.map(|i| depth[i as usize]).into_iter().max().unwrap_or(0)
                }
                _ => 0,
            });
        }
        table.nesting = depth.into_iter().max().unwrap_or(0);
        table.rows = rows;
        table
    }

    /// The rows that the table was made of.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Whether any material looks at uv.
    #[inline(always)]
    pub fn uses_uv(&self) -> bool {
        self.nesting > 0
    }

    /// Lanes whose material is a checkerboard, and so needs uv.
    #[inline(always)]
    pub fn is_checkerboard<F: Float>(&self, material: F::Uint) -> F::Mask {
        F::Uint::gather(&self.kind, material).eq(F::Uint::splat(Kind::Checkerboard as u32))
    }

    /// The material at uv: checkerboards choose, and a check inside a check takes the coordinates within
    /// it, scaled to 0…1.
    #[inline(always)]
    pub fn resolve<F: Float>(&self, mut material: F::Uint, mut u: F, mut v: F) -> F::Uint {
        for _ in 0..self.nesting {
            let checkered = self.is_checkerboard::<F>(material);
            if !checkered.any() {
                break;
            }
            let a = u * F::gather(&self.checks_u, material);
            let b = v * F::gather(&self.checks_v, material);
            let (row, column) = (a.floor(), b.floor());
            let half = (row + column) * 0.5;
            let is_even = half.floor().ge(half);
            let even = F::Uint::gather(&self.even, material);
            let odd = F::Uint::gather(&self.odd, material);
            material = F::Uint::select(checkered, F::Uint::select(is_even, even, odd), material);
            u = F::select(checkered, a - row, u);
            v = F::select(checkered, b - column, v);
        }
        material
    }

    /// The BxDFs of resolved materials.
    #[inline(always)]
    pub fn bsdf<F: Float>(&self, material: F::Uint) -> Bsdf<F> {
        let (transmittance, ior) = if self.has_glass {
            (Rgb::gather(&self.transmittance, material), F::gather(&self.ior, material))
        } else {
            (Rgb::black(), F::splat(1.0))
        };
        Bsdf {
            kind: F::Uint::gather(&self.kind, material),
            reflectance: Rgb::gather(&self.reflectance, material),
            transmittance,
            ior,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    fn checkers() -> MaterialTable {
        let board = |even, odd, checks_per_unit| Row {
            kind: Kind::Checkerboard,
            checks: [even, odd],
            checks_per_unit,
            ..Row::matte([0.0; 3])
        };
        MaterialTable::new(vec![
            Row::matte([0.1; 3]),
            Row { kind: Kind::Mirror, ..Row::matte([0.2; 3]) },
            board(0, 1, [10.0, 10.0]),
            board(2, 1, [1.0, 2.0]),
        ])
    }

    #[test]
    fn checks_alternate_on_both_sides_of_zero() {
        let table = checkers();
        let at = |u: f32, v: f32| table.resolve::<f32>(Wrapping(2), u, v).0;
        assert_eq!([at(0.05, 0.05), at(0.15, 0.05), at(0.15, 0.15), at(-0.05, 0.05)], [0, 1, 0, 1]);
        assert_eq!([at(-0.05, -0.05), at(-0.05, -0.15), at(1234.55, 0.05)], [0, 1, 1]);
    }

    #[test]
    fn nested_checks_see_the_coordinates_within_their_check() {
        let table = checkers();
        let at = |u: f32, v: f32| table.resolve::<f32>(Wrapping(3), u, v).0;
        // The outer check (0, 0) spans u 0…1 and v 0…½: within it v is doubled.
        assert_eq!([at(0.05, 0.02), at(0.05, 0.06), at(0.15, 0.06)], [0, 1, 0]);
        assert_eq!(at(0.05, 0.55), 1, "the outer check (0, 1) is plain mirror");
        assert_eq!(table.resolve::<f32>(Wrapping(0), 0.5, 0.5).0, 0);
    }
}
