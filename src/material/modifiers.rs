//! Parameters of all materials: opacity, a material for the back side, and maps of the normal.

use super::list::MaterialKind;
use super::row::{Row, Site};
use crate::math::{ColumnReader, Float, Uint, Vec3, push3};
use crate::parameter::{
    Declaration, Declared, Family, Named, Number, ParameterKind, Problem, Value, parameters,
};
use crate::texture::{NO_TEXTURE, TextureTable};

/// The limits of a fraction.
const SHARE: Number = Number::between(0.0, 1.0);

parameters! {
    /// Parameters that every material may have besides its own.
    pub struct Modifiers: "modifiers", "a material" {
        /// The fraction of light that interacts with the surface, 0 to 1, or the name of a texture, whose red channel
        /// is used. The rest passes straight through, which does not count as a bounce; shadow rays are attenuated
        /// accordingly. It applies to both sides, and does not change the surface's emission. The opacity of a
        /// checkerboard, a mix or a material with a `back` is multiplied by that of the material that it leads to.
        opacity: f64 = ParameterKind::Amount(SHARE) => "1" uncounted Value::Number(1.0),
        /// The name of the material of the back side, which the outward normal points away from.
        back: Option<usize> = ParameterKind::Material => nothing,
        /// The name of a texture of normals in tangent space: red along u, green along v, blue outwards, each mapped
        /// from 0…1 to −1…1. Its picture needs `color_space = "data"`. The map of an inner material replaces this one.
        normal_map: Option<Named> = ParameterKind::Texture => nothing,
        /// Scales x and y of the normals of `normal_map`.
        normal_scale: f64 = ParameterKind::Number(Number::between(-1e3, 1e3)) => "1" uncounted Value::Number(1.0),
        /// The name of a texture of heights, whose slopes tilt the normal; its red channel is used. Slopes are measured
        /// over a quarter of a texel of the finest picture in the texture, a thirty-second of a check or of a feature of
        /// noise, whichever is least. It is applied before `normal_map`. The map of an inner material
        /// replaces this one.
        bump_map: Option<Named> = ParameterKind::Texture => nothing,
        /// The height, outwards and in the scene's unit of length, of a value of 1 in `bump_map`.
        bump_scale: f64 = ParameterKind::Number(Number::between(-1e18, 1e18)) => "1" uncounted Value::Number(1.0),
    }
    check = check;
}

/// Scales without a map have no effect.
fn check(modifiers: Modifiers, warnings: &mut Vec<Problem>) -> Result<Modifiers, Problem> {
    let Modifiers { normal_map, normal_scale, bump_map, bump_scale, .. } = modifiers;
    let mut warn = |parameter, map: &str| {
        let message = format!("{parameter} has no effect without a {map}");
        warnings.push(Problem { parameter, message, help: Some(format!("name a texture as {map}")) });
    };
    if normal_map.is_none() && (normal_scale - 1.0).abs() > 0.0 {
        warn("normal_scale", "normal_map");
    }
    if bump_map.is_none() && (bump_scale - 1.0).abs() > 0.0 {
        warn("bump_scale", "bump_map");
    }
    Ok(modifiers)
}

/// No modifiers.
impl Default for Modifiers {
    fn default() -> Self {
        Modifiers {
            opacity: 1.0,
            back: None,
            normal_map: None,
            normal_scale: 1.0,
            bump_map: None,
            bump_scale: 1.0,
        }
    }
}

/// A family with one member, so that modifiers are read, checked and counted like parameters of materials.
impl Family for Modifiers {
    const DECLARATIONS: &'static [Declaration] = &[<Modifiers as Declared>::DECLARATION];

    fn build(_place: usize, values: &[Value], warnings: &mut Vec<Problem>) -> Result<Self, Problem> {
        Modifiers::of(values).check(warnings)
    }

    fn place(&self) -> Option<usize> {
        Some(0)
    }

    fn values(&self) -> Vec<Value> {
        Declared::values(self)
    }

    fn renumber(&mut self, new: &dyn Fn(usize) -> usize) {
        Declared::renumber(self, new);
    }
}

/// Whether a texture of this parameter is evaluated by itself instead of replacing a number of a lobe: a map, an
/// opacity, or the amount of a mix.
pub fn is_evaluated_directly(kind: &MaterialKind, parameter: &str) -> bool {
    let own = kind.declaration().into_iter().flat_map(|declaration| declaration.parameters);
    let common = <Modifiers as Declared>::DECLARATION.parameters;
    own.chain(common).any(|known| {
        let alone = matches!(known.kind, ParameterKind::Amount(_) | ParameterKind::Texture);
        alone && known.name == parameter
    })
}

/// The modifiers of a row, with textures by their index in the [`TextureTable`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowModifiers {
    /// The opacity, if it is not a texture.
    pub opacity: f32,
    /// The texture of the opacity, or [`NO_TEXTURE`], as for all textures here.
    pub opacity_texture: u32,
    /// The texture of a mix's amount.
    pub amount_texture: u32,
    /// The row of the back side, which precedes this one.
    pub back: Option<u32>,
    /// The texture of normals.
    pub normal_map: u32,
    /// See [`Modifiers::normal_scale`].
    pub normal_scale: f32,
    /// The texture of heights.
    pub bump_map: u32,
    /// See [`Modifiers::bump_scale`].
    pub bump_scale: f32,
    /// The distances over which slopes of heights are measured: along u and along v, and in the scene's unit of length.
    pub bump_steps: [f32; 3],
    /// Whether `normal_map` and `bump_map` depend on the second set of uv.
    pub second_uv: [bool; 2],
}

/// No modifiers.
impl Default for RowModifiers {
    fn default() -> Self {
        RowModifiers {
            opacity: 1.0,
            opacity_texture: NO_TEXTURE,
            amount_texture: NO_TEXTURE,
            back: None,
            normal_map: NO_TEXTURE,
            normal_scale: 1.0,
            bump_map: NO_TEXTURE,
            bump_scale: 1.0,
            bump_steps: [1.0; 3],
            second_uv: [false; 2],
        }
    }
}

impl RowModifiers {
    fn has_hole(&self) -> bool {
        self.opacity < 1.0 || self.opacity_texture != NO_TEXTURE
    }

    fn has_map(&self) -> bool {
        self.normal_map != NO_TEXTURE || self.bump_map != NO_TEXTURE
    }
}

/// The bit of rows with a map.
const MAP: u32 = 1;
/// The bit of rows with a material for the back side.
const BACK: u32 = 2;
/// The bit of rows with an opacity.
const HOLE: u32 = 4;
/// The bit of rows that have an opacity or lead to a row that has one.
const LEADS_TO_HOLE: u32 = 8;
/// The bit of rows whose normal map uses the second set of uv.
const SECOND_NORMALS: u32 = 16;
/// The bit of rows whose bump map does.
const SECOND_BUMPS: u32 = 32;

/// The modifiers of all rows, one column for each property.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModifierColumns {
    /// The modifiers of each row, as bits.
    modified: Vec<u32>,
    opacity: Vec<f32>,
    opacity_texture: Vec<u32>,
    amount_texture: Vec<u32>,
    back: Vec<u32>,
    normal_map: Vec<u32>,
    normal_scale: Vec<f32>,
    bump_map: Vec<u32>,
    bump_scale: Vec<f32>,
    bump_steps: [Vec<f32>; 3],
    /// Whether any row has an opacity.
    pub(super) has_holes: bool,
    /// Whether any row has a material for the back side.
    pub(super) has_backs: bool,
    /// Whether any row has a normal map.
    pub(super) has_normals: bool,
    /// Whether any row has a bump map.
    pub(super) has_bumps: bool,
    /// Whether the amount of any mix is a texture.
    pub(super) has_amounts: bool,
}

impl ModifierColumns {
    /// The modifiers of all rows. Rows lead only to rows before them.
    pub(super) fn new(materials: &[Row], rows: &[RowModifiers]) -> ModifierColumns {
        let mut all = ModifierColumns::default();
        for (i, (material, row)) in (0..).zip(materials.iter().zip(rows)) {
            let (map, back, hole) = (row.has_map(), row.back.is_some(), row.has_hole());
            let leads = hole || next_rows(material, row).any(|next| all.modified[next] & LEADS_TO_HOLE != 0);
            let [normals, bumps] = row.second_uv;
            let bits = [
                (map, MAP),
                (back, BACK),
                (hole, HOLE),
                (leads, LEADS_TO_HOLE),
                (normals, SECOND_NORMALS),
                (bumps, SECOND_BUMPS),
            ];
            all.modified.push(bits.into_iter().map(|(has, bit)| u32::from(has) * bit).sum());
            all.opacity.push(row.opacity);
            all.opacity_texture.push(row.opacity_texture);
            all.amount_texture.push(row.amount_texture);
            all.back.push(row.back.unwrap_or(i));
            all.normal_map.push(row.normal_map);
            all.normal_scale.push(row.normal_scale);
            all.bump_map.push(row.bump_map);
            all.bump_scale.push(row.bump_scale);
            push3(&mut all.bump_steps, row.bump_steps);
            all.has_holes |= hole;
            all.has_backs |= back;
            all.has_normals |= row.normal_map != NO_TEXTURE;
            all.has_bumps |= row.bump_map != NO_TEXTURE;
            all.has_amounts |= row.amount_texture != NO_TEXTURE;
        }
        all
    }

    /// Whether any row has modifiers.
    #[inline(always)]
    pub(super) fn has_any(&self) -> bool {
        self.has_holes | self.has_backs | self.has_maps()
    }

    /// Whether any row has a map.
    #[inline(always)]
    pub(super) fn has_maps(&self) -> bool {
        self.has_normals | self.has_bumps
    }

    /// Visits all columns.
    pub(super) fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        reader.words("modified", &self.modified);
        reader.floats("opacity", &self.opacity);
        reader.words("opacity_texture", &self.opacity_texture);
        reader.words("amount_texture", &self.amount_texture);
        reader.words("back", &self.back);
        reader.words("normal_map", &self.normal_map);
        reader.floats("normal_scale", &self.normal_scale);
        reader.words("bump_map", &self.bump_map);
        reader.floats("bump_scale", &self.bump_scale);
        reader.vectors("bump_steps", &self.bump_steps);
    }

    /// The lanes whose row has modifiers.
    #[inline(always)]
    pub(super) fn lanes<F: Float>(&self, row: F::Uint) -> F::Mask {
        F::Uint::splat(0).lt(F::Uint::gather(&self.modified, row))
    }

    #[inline(always)]
    fn with<F: Float>(&self, row: F::Uint, bit: u32) -> F::Mask {
        let bit = F::Uint::splat(bit);
        (F::Uint::gather(&self.modified, row) & bit).eq(bit)
    }

    /// The lanes whose row has an opacity or leads to a row that has one.
    #[inline(always)]
    pub(super) fn leads_to_hole<F: Float>(&self, row: F::Uint) -> F::Mask {
        self.with::<F>(row, LEADS_TO_HOLE)
    }

    /// The lanes whose row has a map.
    #[inline(always)]
    pub(super) fn with_map<F: Float>(&self, row: F::Uint) -> F::Mask {
        self.with::<F>(row, MAP)
    }

    /// The lanes whose row has a material for the back side, and these materials.
    #[inline(always)]
    pub(super) fn back<F: Float>(&self, row: F::Uint) -> (F::Mask, F::Uint) {
        (self.with::<F>(row, BACK), F::Uint::gather(&self.back, row))
    }

    /// The opacities of rows at a point.
    #[inline(always)]
    pub(super) fn opacity<F: Float>(&self, textures: &TextureTable, row: F::Uint, site: Site<F>) -> F {
        share(textures, F::Uint::gather(&self.opacity_texture, row), F::gather(&self.opacity, row), site)
    }

    /// The amounts of mixes at a point; `own` if they are not textures.
    #[inline(always)]
    pub(super) fn amount<F: Float>(&self, textures: &TextureTable, row: F::Uint, own: F, site: Site<F>) -> F {
        if !self.has_amounts {
            return own;
        }
        share(textures, F::Uint::gather(&self.amount_texture, row), own, site)
    }

    /// The textures of normals of rows, and their scales.
    #[inline(always)]
    pub(super) fn normals<F: Float>(&self, row: F::Uint) -> (F::Uint, F) {
        (F::Uint::gather(&self.normal_map, row), F::gather(&self.normal_scale, row))
    }

    /// The textures of heights of rows, and their scales.
    #[inline(always)]
    pub(super) fn bumps<F: Float>(&self, row: F::Uint) -> (F::Uint, F) {
        (F::Uint::gather(&self.bump_map, row), F::gather(&self.bump_scale, row))
    }

    /// The lanes whose normal map uses the second set of uv.
    #[inline(always)]
    pub(super) fn normals_second<F: Float>(&self, row: F::Uint) -> F::Mask {
        self.with::<F>(row, SECOND_NORMALS)
    }

    /// The lanes whose bump map does.
    #[inline(always)]
    pub(super) fn bumps_second<F: Float>(&self, row: F::Uint) -> F::Mask {
        self.with::<F>(row, SECOND_BUMPS)
    }

    /// The distances over which the slopes of the heights of rows are measured.
    #[inline(always)]
    pub(super) fn bump_steps<F: Float>(&self, row: F::Uint) -> Vec3<F> {
        Vec3::gather(&self.bump_steps, row)
    }
}

/// The lanes that have a texture.
#[inline(always)]
pub(super) fn is_texture<F: Float>(texture: F::Uint) -> F::Mask {
    texture.lt(F::Uint::splat(NO_TEXTURE))
}

/// The red channel of textures, limited to 0…1; `own` without a texture.
#[inline(always)]
fn share<F: Float>(textures: &TextureTable, texture: F::Uint, own: F, site: Site<F>) -> F {
    F::branch(
        is_texture::<F>(texture),
        own,
        #[inline(always)]
        || textures.value(texture, site).r.max(F::zero()).min(F::splat(1.0)),
    )
}

/// The rows to which a row leads: those among which it chooses, and that of its back side.
fn next_rows<'a>(row: &'a Row, own: &'a RowModifiers) -> impl Iterator<Item = usize> + 'a {
    let choices = if row.kind.is_chooser() { &row.choices[..] } else { &[] };
    choices.iter().chain(&own.back).map(|&next| next as usize)
}

/// The greatest number of steps from a row to a leaf, through choosers and materials of back sides. All of them precede
/// the rows that lead to them.
pub(super) fn longest_path(rows: &[Row], modifiers: &[RowModifiers]) -> u32 {
    let mut steps: Vec<u32> = Vec::with_capacity(rows.len());
    for (row, own) in rows.iter().zip(modifiers) {
        let longest = next_rows(row, own).map(|next| 1 + steps[next]).max();
        steps.push(longest.unwrap_or(0));
    }
    steps.into_iter().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_without_maps_are_reported() {
        let told = |modifiers: Modifiers| {
            let mut warnings = Vec::new();
            assert_eq!(modifiers.check(&mut warnings), Ok(modifiers));
            warnings.into_iter().map(|warning| warning.parameter).collect::<Vec<_>>()
        };
        let none = Modifiers::default();
        assert_eq!(told(none), [""; 0]);
        assert_eq!(told(Modifiers { normal_scale: 0.5, ..none }), ["normal_scale"]);
        assert_eq!(told(Modifiers { normal_scale: 0.5, normal_map: Some(Named), ..none }), [""; 0]);
        let both = Modifiers { bump_scale: 0.5, normal_scale: 2.0, bump_map: Some(Named), ..none };
        assert_eq!(told(both), ["normal_scale"]);
    }

    #[test]
    fn a_default_is_what_an_absent_key_means() {
        for (value, parameter) in Declared::values(&Modifiers::default())
            .into_iter()
            .zip(<Modifiers as Declared>::DECLARATION.parameters)
        {
            assert_eq!(value, parameter.uncounted.unwrap_or(Value::Absent), "{}", parameter.name);
        }
    }
}
