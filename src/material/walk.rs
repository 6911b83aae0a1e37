//! The path from an entity's material to the one that scatters light at a point: through choices, back sides, opacities
//! and maps.

use super::kind::Kind;
use super::mix::Mix;
use super::row::Site;
use super::table::MaterialTable;
use crate::math::{Float, Mask, Uint, function, value};

/// The row without a map.
const NO_ROW: u32 = u32::MAX;

/// The state of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Walked<F: Float> {
    /// The row in the table; at the end of the walk, that of a leaf.
    pub material: F::Uint,
    /// The coordinates for it.
    pub uv: [F; 2],
    /// The lengths of these per length of the surface's own.
    pub scale: [F; 2],
    /// The product of the opacities on the path.
    pub opacity: F,
    /// Whether the row's own opacity has not been multiplied yet: steps from a leaf remain there.
    is_new: F::Mask,
    /// The number for the next mix, uniform in [0, 1).
    number: F,
    /// The last row with a map, or [`NO_ROW`], and the coordinates for it.
    pub(super) map: F::Uint,
    pub(super) map_uv: [F; 2],
    pub(super) map_scale: [F; 2],
}

value!(Walked { material, uv, scale, opacity, is_new, number, map, map_uv, map_scale });

impl<F: Float> Walked<F> {
    /// The lanes whose path includes a map.
    #[inline(always)]
    pub fn has_map(&self) -> F::Mask {
        self.map.lt(F::Uint::splat(NO_ROW))
    }
}

impl MaterialTable {
    /// Whether there is more than choices by uv on the path to a leaf, so that [`Self::walk`] differs from
    /// [`Self::resolve`].
    #[inline(always)]
    pub fn is_walked(&self) -> bool {
        self.is_walked
    }

    /// Whether any material has an opacity, so that paths may pass straight through surfaces.
    #[inline(always)]
    pub fn has_holes(&self) -> bool {
        self.modifiers.has_holes
    }

    /// The lanes whose material may have an opacity, by itself or where it leads to another one.
    #[inline(always)]
    pub fn may_have_holes<F: Float>(&self, material: F::Uint) -> F::Mask {
        self.modifiers.leads_to_hole::<F>(material)
    }

    /// Whether any material has a normal or bump map.
    #[inline(always)]
    pub fn has_maps(&self) -> bool {
        self.modifiers.has_maps()
    }

    /// Whether the choice of a material depends on a random number.
    #[inline(always)]
    pub fn is_stochastic(&self) -> bool {
        self.kinds.has(Kind::Mix) | self.modifiers.has_holes
    }

    /// The leaf that scatters light at a point of rows, `site`, in the coordinates of the surface. `behind` are the
    /// lanes that see the surface from the side that its normal points away from. Mixes choose by `number`, uniform in
    /// [0, 1).
    #[inline(always)]
    pub fn walk<F: Float>(&self, row: F::Uint, site: Site<F>, behind: F::Mask, number: F) -> Walked<F> {
        let one = F::splat(1.0);
        let start = Walked {
            material: row,
            uv: site.uv,
            scale: [one; 2],
            opacity: one,
            is_new: F::Mask::splat(true),
            number,
            map: F::Uint::splat(NO_ROW),
            map_uv: site.uv,
            map_scale: [one; 2],
        };
        if self.nesting == 0 {
            return self.step(start, site, behind);
        }
        // A loop, not its steps in a row: each step evaluates textures, and GPUs' compilers inline everything.
        F::repeat(
            F::Mask::splat(true),
            start,
            #[inline(always)]
            |walked| {
                let next = self.step(walked, site, behind);
                (next, next.is_new)
            },
        )
    }

    /// The effect of a row on a walk, and the next row; a leaf without a back side is the end.
    #[inline(always)]
    fn step<F: Float>(&self, walked: Walked<F>, site: Site<F>, behind: F::Mask) -> Walked<F> {
        function!(F, walk_on(walked, site, behind), {
            let own = &self.modifiers;
            let Walked { material: row, uv, scale, number, .. } = walked;
            let here = Site { uv, footprint: site.footprint * (scale[0] * scale[1]), ..site };
            let mut next = walked;
            if own.has_holes {
                let opacity = own.opacity(&self.textures, row, here);
                next.opacity = F::select(walked.is_new, walked.opacity * opacity, walked.opacity);
            }
            if own.has_maps() {
                let has = own.with_map::<F>(row);
                next.map = F::Uint::select(has, row, walked.map);
                next.map_uv = select2(has, uv, walked.map_uv);
                next.map_scale = select2(has, scale, walked.map_scale);
            }
            let kind = self.columns.kind(row);
            if self.kinds.has(Kind::Checkerboard) {
                let [a, b] = self.uv_scale::<F>(kind, row);
                (next.material, next.uv) = self.choose_by_uv(kind, row, uv);
                next.scale = [scale[0] * a, scale[1] * b];
            }
            if self.kinds.has(Kind::Mix) {
                (next.material, next.number) = F::branch(
                    kind.eq(F::Uint::splat(Kind::Mix as u32)),
                    (next.material, next.number),
                    #[inline(always)]
                    || {
                        let amount = own.amount(&self.textures, row, self.columns.number(0, row), here);
                        let (is_b, left) = Mix::pick(amount, number);
                        (
                            F::Uint::select(is_b, self.columns.choice(1, row), self.columns.choice(0, row)),
                            left,
                        )
                    },
                );
            }
            if own.has_backs {
                let (has, back) = own.back::<F>(row);
                let turns = has & behind;
                next.material = F::Uint::select(turns, back, next.material);
                next.uv = select2(turns, uv, next.uv);
                next.scale = select2(turns, scale, next.scale);
                next.number = F::select(turns, number, next.number);
            }
            next.is_new = !next.material.eq(row);
            next
        })
    }
}

/// `a` where the mask is set, `b` elsewhere.
#[inline(always)]
pub(super) fn select2<F: Float>(mask: F::Mask, [a0, a1]: [F; 2], [b0, b1]: [F; 2]) -> [F; 2] {
    [F::select(mask, a0, b0), F::select(mask, a1, b1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{
        CheckerboardParameters, MaterialParameters, MatteParameters, MirrorParameters, MixParameters,
        RowModifiers,
    };
    use crate::math::Vec3;
    use crate::math::lanes::scalar::Wrapping;
    use std::sync::Arc;

    /// A matte (0), a mirror (1), a mix of them (2), a checkerboard of that and the mirror (3), and a mix of that and
    /// the matte (4).
    fn table(modifiers: [RowModifiers; 5]) -> MaterialTable {
        let rows = vec![
            MatteParameters { reflectance: [0.1; 3], roughness: 0.0 }.row(),
            MirrorParameters { reflectance: [0.2; 3] }.row(),
            MixParameters { a: 0, b: 1, amount: 0.25 }.row(),
            CheckerboardParameters { even: 2, odd: 1, checks_per_unit: [2.0, 3.0] }.row(),
            MixParameters { a: 3, b: 0, amount: 0.5 }.row(),
        ];
        MaterialTable::modified(rows, &[], &modifiers, Arc::default())
    }

    fn walk(table: &MaterialTable, row: u32, uv: [f32; 2], behind: bool, number: f32) -> Walked<f32> {
        let site = Site::new(Vec3::zero(), uv, 0.0);
        table.walk(Wrapping(row), site, behind, number)
    }

    #[test]
    fn one_number_chooses_in_all_nested_mixes() {
        let table = table([RowModifiers::default(); 5]);
        assert!(table.is_walked() && table.is_stochastic() && !table.has_holes() && !table.has_maps());
        let n = 1600;
        let mut counts = [0; 2];
        for i in 0..n {
            let found = walk(&table, 4, [0.1, 0.1], false, (i as f32 + 0.5) / n as f32);
            counts[found.material.0 as usize] += 1;
        }
        // Half chooses the matte at once, and three quarters of the other half do.
        assert_eq!(counts, [1400, 200]);
        let odd = walk(&table, 3, [0.6, 0.1], false, 0.9);
        assert_eq!((odd.material.0, odd.scale), (1, [2.0, 3.0]));
        assert!((odd.uv[0] - 0.2).abs() < 1e-6 && (odd.uv[1] - 0.3).abs() < 1e-6);
        assert_eq!(walk(&table, 1, [0.6, 0.1], false, 0.9).material.0, 1);
    }

    #[test]
    fn holes_are_known_from_all_rows_that_lead_to_them() {
        let with = |change: &dyn Fn(&mut [RowModifiers; 5])| {
            let mut modifiers = [RowModifiers::default(); 5];
            change(&mut modifiers);
            let table = table(modifiers);
            [0, 1, 2, 3, 4].map(|row| table.may_have_holes::<f32>(Wrapping(row)))
        };
        assert_eq!(with(&|_| ()), [false; 5]);
        // The matte is in both mixes, and in the checkerboard by one of them.
        assert_eq!(with(&|all| all[0].opacity = 0.5), [true, false, true, true, true]);
        assert_eq!(with(&|all| all[2].opacity = 0.5), [false, false, true, true, true]);
        assert_eq!(with(&|all| all[4].opacity_texture = 0), [false, false, false, false, true]);
        let behind = |all: &mut [RowModifiers; 5]| (all[0].opacity, all[1].back) = (0.5, Some(0));
        assert_eq!(with(&behind), [true; 5]);
    }

    #[test]
    fn back_sides_are_seen_only_from_behind() {
        let mut modifiers = [RowModifiers::default(); 5];
        (modifiers[1].back, modifiers[1].opacity) = (Some(0), 0.5);
        modifiers[3].opacity = 0.25;
        let table = table(modifiers);
        assert!(table.has_holes() && table.is_stochastic());
        let found = |row, behind| {
            let found = walk(&table, row, [0.6, 0.1], behind, 0.9);
            (found.material.0, found.opacity)
        };
        assert_eq!(found(1, false), (1, 0.5));
        assert_eq!(found(1, true), (0, 0.5));
        assert_eq!(found(3, false), (1, 0.125));
        assert_eq!(found(3, true), (0, 0.125));
        assert_eq!(found(0, true), (0, 1.0));
    }
}
