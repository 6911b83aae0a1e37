//! The table of a scene's materials, in which lanes look up their BSDFs.

use super::bindings::{Binding, Bindings};
use super::bsdf::{Bsdf, Local};
use super::bxdf::Bxdf;
use super::kind::{Kind, Kinds, materials};
use super::media::Media;
use super::modifiers::{ModifierColumns, RowModifiers, longest_path};
use super::program::{Chooser, Leaf};
use super::row::{Columns, Row, Site};
use crate::math::lanes::scalar::Wrapping;
use crate::math::{ColumnReader, Float, Mask, Uint, Vec3, function};
use crate::texture::TextureTable;
use std::sync::Arc;

/// All materials.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialTable {
    pub(super) columns: Columns,
    /// The greatest number of steps from a row to a leaf.
    pub(super) nesting: u32,
    uses_uv: bool,
    is_anisotropic: bool,
    has_delta: bool,
    pub(super) is_walked: bool,
    /// Whether rows say by themselves that they use uv, whatever their kinds.
    has_rows_that_look: bool,
    has_surroundings: bool,
    media: Media,
    pub(super) kinds: Kinds,
    rows: Vec<Row>,
    bindings: Bindings,
    pub(super) modifiers: ModifierColumns,
    pub(super) textures: Arc<TextureTable>,
}

/// The lanes whose kind is that of a chooser by uv.
macro_rules! lanes_that_choose {
    (
        { $kind:ident }
        leaves $leaves:tt
        choosers { $($(#[$cfg:meta])* $module:ident::$Chooser:ident($parameters:ident),)* }
    ) => {{
        let mut lanes = F::Mask::splat(false);
        $(
            $(#[$cfg])*
            {
                if super::$module::$Chooser::BY_UV {
                    lanes = lanes | $kind.eq(F::Uint::splat(Kind::$Chooser as u32));
                }
            }
        )*
        lanes
    }};
}

/// The lanes whose kind is that of a leaf that uses uv.
macro_rules! leaves_that_look {
    (
        { $kind:ident }
        leaves { $($(#[$cfg:meta])* $module:ident::$Leaf:ident $(($parameters:ident))?,)* }
        choosers $choosers:tt
    ) => {{
        let mut lanes = F::Mask::splat(false);
        $(
            $(#[$cfg])*
            {
                if super::$module::$Leaf::USES_UV {
                    lanes = lanes | $kind.eq(F::Uint::splat(Kind::$Leaf as u32));
                }
            }
        )*
        lanes
    }};
}

/// Replaces the rows of choosers by uv by the rows that they choose, and uv by the uv for these.
macro_rules! choose {
    (
        { $table:ident, $kind:ident, $row:ident, $uv:ident }
        leaves $leaves:tt
        choosers { $($(#[$cfg:meta])* $module:ident::$Chooser:ident($parameters:ident),)* }
    ) => {
        $(
            $(#[$cfg])*
            {
                if super::$module::$Chooser::BY_UV {
                    let lanes = $kind.eq(F::Uint::splat(Kind::$Chooser as u32));
                    ($row, $uv) = F::branch(
                        lanes,
                        ($row, $uv),
                        #[inline(always)]
                        || {
                            let (row, uv) = ($row, $uv);
                            function!(F, concat!(stringify!($Chooser), "_choose"), (row, uv), {
                                super::$module::$Chooser::choose(&$table.columns, row, uv)
                            })
                        },
                    );
                }
            }
        )*
    };
}

/// Multiplies lengths of uv by the scale within choosers.
macro_rules! magnify {
    (
        { $table:ident, $kind:ident, $row:ident, $scale:ident }
        leaves $leaves:tt
        choosers { $($(#[$cfg:meta])* $module:ident::$Chooser:ident($parameters:ident),)* }
    ) => {
        $(
            $(#[$cfg])*
            {
                if super::$module::$Chooser::BY_UV {
                    let lanes = $kind.eq(F::Uint::splat(Kind::$Chooser as u32));
                    let [a, b] = super::$module::$Chooser::uv_scale::<F>(&$table.columns, $row);
                    $scale = [F::select(lanes, a, $scale[0]), F::select(lanes, b, $scale[1])];
                }
            }
        )*
    };
}

impl MaterialTable {
    /// The table of these rows; a chooser refers only to rows before its own.
    pub fn new(rows: Vec<Row>) -> MaterialTable {
        MaterialTable::with_textures(rows, &[], Arc::default())
    }

    /// The same with textures in place of some parameters.
    pub fn with_textures(rows: Vec<Row>, bindings: &[Binding], textures: Arc<TextureTable>) -> MaterialTable {
        let modifiers = vec![RowModifiers::default(); rows.len()];
        MaterialTable::modified(rows, bindings, &modifiers, textures)
    }

    /// The same with modifiers, one per row; the row of a back side precedes the row that refers to it.
    pub fn modified(
        rows: Vec<Row>,
        bindings: &[Binding],
        modifiers: &[RowModifiers],
        textures: Arc<TextureTable>,
    ) -> MaterialTable {
        let mut columns = Columns::default();
        rows.iter().for_each(|row| columns.push(row));
        let nesting = longest_path(&rows, modifiers);
        let kinds = rows.iter().fold(Kinds::default(), |kinds, row| kinds.with(row.kind));
        let is_anisotropic = rows.iter().any(|row| row.is_anisotropic);
        let bindings = Bindings::new(rows.len(), bindings);
        let modifiers = ModifierColumns::new(&rows, modifiers);
        let media = Media::new(&rows);
        let is_walked = kinds.has(Kind::Mix) | modifiers.has_any();
        let mut table = MaterialTable {
            columns,
            nesting,
            uses_uv: false,
            is_anisotropic,
            has_delta: false,
            is_walked,
            has_rows_that_look: is_walked | !bindings.is_empty(),
            has_surroundings: !media.is_empty() | modifiers.has_holes,
            media,
            kinds,
            rows,
            bindings,
            modifiers,
            textures,
        };
        let all = 0..table.rows.len() as u32;
        table.uses_uv = all.clone().any(|row| table.lanes_using_uv::<f32>(Wrapping(row)));
        table.has_delta = all.clone().any(|row| {
            let numbers = table.columns.numbers::<f32>(Wrapping(row));
            let site = Site::new(Vec3::zero(), [0.0; 2], 0.0);
            table.bsdf_of(Local { kind: table.columns.kind(Wrapping(row)), numbers, site }).has_delta()
        });
        table
    }

    /// The rows from which the table was made.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Visits the columns of all rows.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        self.columns.columns(reader);
        self.modifiers.columns(reader);
    }

    /// The textures in place of parameters.
    pub fn bindings(&self) -> &Bindings {
        &self.bindings
    }

    /// The textures.
    pub fn textures(&self) -> &Arc<TextureTable> {
        &self.textures
    }

    /// Whether any material uses uv.
    #[inline(always)]
    pub fn uses_uv(&self) -> bool {
        self.uses_uv
    }

    /// Whether any material scatters differently along u and v.
    #[inline(always)]
    pub fn is_anisotropic(&self) -> bool {
        self.is_anisotropic
    }

    /// The media inside dielectrics, if the scene has any.
    #[inline(always)]
    pub fn media(&self) -> Option<&Media> {
        if self.media.is_empty() { None } else { Some(&self.media) }
    }

    /// Whether paths have surroundings that change along them: whether there are media or holes.
    #[inline(always)]
    pub fn has_surroundings(&self) -> bool {
        self.has_surroundings
    }

    /// Visits the columns of media, which are empty if there are none.
    pub fn media_columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        self.media.columns(reader);
    }

    /// Whether any material has a delta lobe.
    #[inline(always)]
    pub fn has_delta(&self) -> bool {
        self.has_delta
    }

    /// The lanes whose material uses uv.
    #[inline(always)]
    pub fn lanes_using_uv<F: Float>(&self, material: F::Uint) -> F::Mask {
        let kind = self.columns.kind(material);
        let mut look = materials!(lanes_that_choose kind) | materials!(leaves_that_look kind);
        if !self.has_rows_that_look {
            return look;
        }
        if self.kinds.has(Kind::Mix) {
            look = look | kind.eq(F::Uint::splat(Kind::Mix as u32));
        }
        if self.modifiers.has_any() {
            look = look | self.modifiers.lanes::<F>(material);
        }
        if self.bindings.is_empty() { look } else { look | self.bindings.lanes::<F>(material) }
    }

    /// The material at uv, a leaf, and the uv for it: choosers are followed to a leaf. In a table that [is
    /// walked](Self::is_walked), use [`Self::walk`].
    #[inline(always)]
    pub fn resolve<F: Float>(&self, mut material: F::Uint, mut uv: [F; 2]) -> (F::Uint, [F; 2]) {
        for _ in 0..self.nesting {
            (material, uv) = self.choose_by_uv(self.columns.kind(material), material, uv);
        }
        (material, uv)
    }

    /// One step from rows of choosers by uv, of these kinds.
    #[inline(always)]
    pub(super) fn choose_by_uv<F: Float>(
        &self,
        kind: F::Uint,
        mut row: F::Uint,
        mut uv: [F; 2],
    ) -> (F::Uint, [F; 2]) {
        materials!(choose self, kind, row, uv);
        (row, uv)
    }

    /// The lengths of uv after a step per length before it.
    #[inline(always)]
    pub(super) fn uv_scale<F: Float>(&self, kind: F::Uint, row: F::Uint) -> [F; 2] {
        let mut scale = [F::splat(1.0); 2];
        materials!(magnify self, kind, row, scale);
        scale
    }

    /// The area of the uv returned by [`Self::resolve`] per area of its input.
    #[inline(always)]
    pub fn uv_area_scale<F: Float>(&self, mut material: F::Uint, mut uv: [F; 2]) -> F {
        let mut area = F::splat(1.0);
        for _ in 0..self.nesting {
            let kind = self.columns.kind(material);
            let [a, b] = self.uv_scale::<F>(kind, material);
            area = area * (a * b);
            (material, uv) = self.choose_by_uv(kind, material, uv);
        }
        area
    }

    /// The BSDFs of resolved materials at a point.
    #[inline(always)]
    pub fn bsdf<F: Float>(&self, material: F::Uint, site: Site<F>) -> Bsdf<F> {
        let (kind, mut numbers) = (self.columns.kind(material), self.columns.numbers(material));
        if !self.bindings.is_empty() {
            // Blended, as all results of `out_of_line` on the path of scenes without them: a value from two places in
            // memory would have to pass through memory.
            let own = numbers;
            numbers = F::branch(
                self.bindings.lanes::<F>(material),
                own,
                #[inline(always)]
                || self.bindings.apply(&self.textures, material, site, own),
            );
        }
        self.bsdf_of(Local { kind, numbers, site })
    }

    /// The BSDFs made of this data.
    #[inline(always)]
    pub fn bsdf_of<F: Float>(&self, local: Local<F>) -> Bsdf<F> {
        Bsdf { local, kinds: self.kinds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{
        Bxdf, CheckerboardParameters, GlassParameters, MaterialParameters, MatteParameters, MirrorParameters,
        TransportMode,
    };
    use crate::math::Vec3;

    fn checkers() -> MaterialTable {
        MaterialTable::new(vec![
            MatteParameters { reflectance: [0.1; 3], roughness: 0.0 }.row(),
            MirrorParameters { reflectance: [0.2; 3] }.row(),
            CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [10.0, 10.0] }.row(),
            CheckerboardParameters { even: 2, odd: 1, checks_per_unit: [1.0, 2.0] }.row(),
        ])
    }

    #[test]
    fn checks_alternate_on_both_sides_of_zero() {
        let table = checkers();
        assert!(table.uses_uv() && !MaterialTable::new(table.rows()[..2].to_vec()).uses_uv());
        let at = |u: f32, v: f32| table.resolve::<f32>(Wrapping(2), [u, v]).0.0;
        assert_eq!([at(0.05, 0.05), at(0.15, 0.05), at(0.15, 0.15), at(-0.05, 0.05)], [0, 1, 0, 1]);
        assert_eq!([at(-0.05, -0.05), at(-0.05, -0.15), at(1234.55, 0.05)], [0, 1, 1]);
    }

    #[test]
    fn nested_checks_use_coordinates_within_their_check() {
        let table = checkers();
        assert_eq!(
            [0, 2, 3].map(|row| table.uv_area_scale::<f32>(Wrapping(row), [0.05, 0.02])),
            [1.0, 100.0, 200.0]
        );
        let at = |u: f32, v: f32| table.resolve::<f32>(Wrapping(3), [u, v]).0.0;
        // The outer check (0, 0) spans u 0…1 and v 0…½: within it v is doubled.
        assert_eq!([at(0.05, 0.02), at(0.05, 0.06), at(0.15, 0.06)], [0, 1, 0]);
        assert_eq!(at(0.05, 0.55), 1, "the outer check (0, 1) is plain mirror");
        assert_eq!(table.resolve::<f32>(Wrapping(0), [0.5, 0.5]), (Wrapping(0), [0.5, 0.5]));
        // (1.5, 0.5) in tenths, from (0.15, 0.025) within the outer check.
        let (_, [u, v]) = table.resolve::<f32>(Wrapping(3), [0.15, 0.025]);
        assert!((u - 0.5).abs() < 1e-5 && (v - 0.5).abs() < 1e-5, "({u}, {v})");
    }

    #[test]
    fn numbers_of_some_rows_are_read_in_their_lanes() {
        let site = Site::new(Vec3::zero(), [0.0; 2], 0.0);
        let glass =
            GlassParameters { ior: 1.5, reflectance: [0.5; 3], transmittance: [0.75, 0.5, 0.25] }.row();
        let table = MaterialTable::new(vec![
            MatteParameters { reflectance: [0.1; 3], roughness: 0.0 }.row(),
            glass,
            CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [3.0, 4.0] }.row(),
        ]);
        let bsdf = table.bsdf::<f32>(Wrapping(1), site);
        let wo = Vec3::new(0.0, 0.0, 1.0);
        let refracted = bsdf.sample(wo, [0.5; 2], 0.5, TransportMode::Radiance);
        assert_eq!((refracted.eta, bsdf.albedo().lane(0)), (1.5, [0.75, 0.5, 0.25]));
        assert!(!bsdf.has_non_delta() && bsdf.transmits());
        let matte = table.bsdf::<f32>(Wrapping(0), site);
        assert_eq!(matte.albedo().lane(0), [0.1; 3]);
        assert!(matte.has_non_delta() && !matte.transmits());
    }
}
