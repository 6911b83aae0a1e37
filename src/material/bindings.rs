//! Textures in place of material parameters.
//!
//! A texture replaces numbers of a material's row. They are found by experiment: a parameter may be a texture if the
//! row contains its value or its square, and no material has to declare that. A parameter from which the row is
//! computed in another way may not be a texture.

use super::list::MaterialKind;
use super::lobes::LEAST_ALPHA;
use super::row::{NUMBERS, Numbers, Row, Site};
use crate::math::{ColumnReader, Float, Rgb, Uint};
use crate::parameter::{Family, Number, ParameterKind, Value};
use crate::texture::{NO_TEXTURE, TextureTable};

/// The numbers of a row that correspond to a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The row's colour.
    Colour,
    /// Three further numbers, starting with this one.
    Colours(usize),
    /// A further number.
    Number(usize),
    /// Two further numbers, starting with this one.
    Numbers(usize),
}

/// The position of a parameter in the row of its material, and the limits of its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSlot {
    target: Target,
    least: f32,
    most: f32,
}

/// The numbers that a texture replaces, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Target {
    slot: Slot,
    /// Whether the row has the squares of the parameter's values, which are widths of distributions and never zero.
    is_squared: bool,
}

/// A texture in place of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Binding {
    /// The row of the material.
    pub row: usize,
    /// The parameter.
    pub slot: ParameterSlot,
    /// The index of the texture in the [`TextureTable`].
    pub texture: u32,
}

/// All numbers of a row that textures may replace: its colour, then the others.
fn numbers_of(row: &Row) -> Vec<f32> {
    row.colour.into_iter().chain(row.numbers).collect()
}

impl ParameterSlot {
    /// The slot of the parameter with this name, if a texture may replace it.
    pub fn of(kind: &MaterialKind, parameter: &str) -> Option<ParameterSlot> {
        let family = kind.place()?;
        let declaration = &MaterialKind::DECLARATIONS[family];
        let index = declaration.parameters.iter().position(|known| known.name == parameter)?;
        let (limits, count) = match declaration.parameters[index].kind {
            ParameterKind::Number(limits) => (limits, 1),
            ParameterKind::Pair(limits) => (limits, 2),
            ParameterKind::Colour(limits) => (limits, 3),
            _ => return None,
        };
        let row_with = |given: &[f64]| {
            let mut values = kind.values();
            values[index] = match *given {
                [x] => Value::Number(x),
                [x, y] => Value::Pair([x, y]),
                [x, y, z] => Value::Colour([x, y, z]),
                _ => return None,
            };
            Some(MaterialKind::build(family, &values, &mut Vec::new()).ok()?.row())
        };
        // The rows of two sets of values that differ in every number.
        let tries = [0, 1].map(|set| {
            let given: Vec<f64> = (0..count).map(|i| example(limits, set * 3 + i)).collect();
            let row = row_with(&given)?;
            Some((given, row))
        });
        let [Some((given, row)), Some((other_given, other_row))] = &tries else { return None };
        if row.kind.is_chooser() || (row.kind, row.choices) != (other_row.kind, other_row.choices) {
            return None;
        }
        // Another program, such as that of a smooth surface, would not use the texture.
        if row.kind != kind.row().kind {
            return None;
        }
        let (numbers, others) = (numbers_of(row), numbers_of(other_row));
        let changed: Vec<usize> = (0..numbers.len()).filter(|&i| numbers[i] != others[i]).collect();
        let first = *changed.first()?;
        let has = |map: fn(f64) -> f64| {
            let are = |numbers: &[f32], given: &[f64]| {
                numbers[first..first + count].iter().zip(given).all(|(own, &x)| *own == map(x) as f32)
            };
            are(&numbers, given) && are(&others, other_given)
        };
        let is_squared = has(|x| x * x);
        let is_whole = changed.iter().copied().eq(first..first + count) && (is_squared || has(|x| x));
        let slot = match (first, count) {
            _ if !is_whole => return None,
            (0, 3) => Slot::Colour,
            (0..3, _) => return None,
            (_, 1) => Slot::Number(first - 3),
            (_, 2) => Slot::Numbers(first - 3),
            _ => Slot::Colours(first - 3),
        };
        let [mut least, most] = limits.range();
        // A material may limit its numbers to more than the smallest value.
        let lowest = row_with(&vec![f64::from(least); count]).filter(|lowest| lowest.kind == row.kind);
        if let Some(lowest) = lowest.filter(|_| !is_squared) {
            least = least.max(numbers_of(&lowest)[first]);
        }
        Some(ParameterSlot { target: Target { slot, is_squared }, least, most })
    }
}

/// A material with placeholder values for the parameters that are textures, so that its program uses them: a surface
/// with a texture for its roughness is never a smooth one, whatever number is given beside the texture.
pub fn with_placeholders<'p>(
    kind: &MaterialKind,
    textured: impl Iterator<Item = &'p str> + Clone,
) -> MaterialKind {
    let Some(family) = kind.place() else { return kind.clone() };
    let mut values = kind.values();
    for (value, parameter) in values.iter_mut().zip(MaterialKind::DECLARATIONS[family].parameters) {
        if textured.clone().any(|name| name == parameter.name) {
            *value = parameter.kind.stand_in().unwrap_or(*value);
        }
    }
    MaterialKind::build(family, &values, &mut Vec::new()).unwrap_or_else(|_| kind.clone())
}

/// A value within the limits, different for each number. No formula maps one to another.
fn example(limits: Number, i: usize) -> f64 {
    let share = [0.3719, 0.6173, 0.4481, 0.8317, 0.2087, 0.7331][i];
    let [least, most] = limits.range().map(f64::from);
    let value = least.max(-1.0) + (most.min(1.0) - least.max(-1.0)) * share;
    // Limits may be above 1 altogether.
    if value >= least && value <= most { value } else { least + (most - least) * share }
}

/// The textures of all rows: for each row, as many as there are targets for which some row has a texture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bindings {
    targets: Vec<Target>,
    texture: Vec<u32>,
    least: Vec<f32>,
    most: Vec<f32>,
}

impl Bindings {
    /// The bindings of a table with this number of rows.
    pub fn new(rows: usize, bindings: &[Binding]) -> Bindings {
        let mut all = Bindings::default();
        for binding in bindings {
            if !all.targets.contains(&binding.slot.target) {
                all.targets.push(binding.slot.target);
            }
        }
        let count = all.targets.len();
        all.texture = vec![NO_TEXTURE; rows * count];
        all.least = vec![0.0; rows * count];
        all.most = vec![0.0; rows * count];
        for Binding { row, slot: ParameterSlot { target, least, most }, texture } in bindings {
            for (i, _) in all.targets.iter().enumerate().filter(|(_, own)| *own == target) {
                let at = row * count + i;
                (all.texture[at], all.least[at], all.most[at]) = (*texture, *least, *most);
            }
        }
        all
    }

    /// Whether there are any.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.targets.is_empty()
    }

    /// Visits the columns.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Bindings { targets: _, texture, least, most } = self;
        reader.words("texture", texture);
        reader.floats("least", least);
        reader.floats("most", most);
    }

    /// The index of a row's binding.
    #[inline(always)]
    fn at<U: Uint>(&self, row: U, i: usize) -> U {
        row * U::splat(self.targets.len() as u32) + U::splat(i as u32)
    }

    /// The lanes whose rows have a texture.
    #[inline(always)]
    pub(super) fn lanes<F: Float>(&self, row: F::Uint) -> F::Mask {
        let mut lanes = <F::Mask as crate::math::Mask>::splat(false);
        let mut i = 0;
        while i < self.targets.len() {
            lanes = lanes | self.is_texture::<F>(F::Uint::gather(&self.texture, self.at(row, i)));
            i += 1;
        }
        lanes
    }

    #[inline(always)]
    fn is_texture<F: Float>(&self, texture: F::Uint) -> F::Mask {
        texture.lt(F::Uint::splat(NO_TEXTURE))
    }

    /// Replaces numbers of rows by the values of textures, within the limits of their parameters.
    #[inline(always)]
    pub(super) fn apply<F: Float>(
        &self,
        textures: &TextureTable,
        row: F::Uint,
        site: Site<F>,
        numbers: Numbers<F>,
    ) -> Numbers<F> {
        // The positions of numbers are known only at run time, so that all of them must be in memory.
        F::out_of_line(
            #[inline(always)]
            move || self.applied(textures, row, site, numbers),
        )
    }

    /// See [`Self::apply`].
    #[inline(always)]
    fn applied<F: Float>(
        &self,
        textures: &TextureTable,
        row: F::Uint,
        site: Site<F>,
        mut numbers: Numbers<F>,
    ) -> Numbers<F> {
        let mut i = 0;
        while i < self.targets.len() {
            let at = self.at(row, i);
            let texture = F::Uint::gather(&self.texture, at);
            let has = self.is_texture::<F>(texture);
            let value = F::guard(
                has,
                Rgb::black(),
                #[inline(always)]
                || {
                    let [r, g, b] = textures.value(texture, site).channels();
                    let (least, most) = (F::gather(&self.least, at), F::gather(&self.most, at));
                    Rgb::new(r.max(least).min(most), g.max(least).min(most), b.max(least).min(most))
                },
            );
            let value = if self.targets[i].is_squared { squared(value) } else { value };
            match self.targets[i].slot {
                Slot::Colour => numbers.colour = Rgb::select(has, value, numbers.colour),
                Slot::Colours(first) => {
                    put(&mut numbers, first, has, value.r);
                    put(&mut numbers, first + 1, has, value.g);
                    put(&mut numbers, first + 2, has, value.b);
                }
                Slot::Number(first) => put(&mut numbers, first, has, value.r),
                Slot::Numbers(first) => {
                    put(&mut numbers, first, has, value.r);
                    put(&mut numbers, first + 1, has, value.r);
                }
            }
            i += 1;
        }
        numbers
    }
}

/// The squares of values.
#[inline(always)]
fn squared<F: Float>(value: Rgb<F>) -> Rgb<F> {
    let least = F::splat(LEAST_ALPHA);
    let Rgb { r, g, b } = value * value;
    Rgb::new(r.max(least), g.max(least), b.max(least))
}

/// Replaces one of the further numbers in the lanes of a mask.
#[inline(always)]
fn put<F: Float>(numbers: &mut Numbers<F>, i: usize, has: F::Mask, value: F) {
    debug_assert!(i < NUMBERS);
    numbers.further[i] = F::select(has, value, numbers.further[i]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{
        CheckerboardParameters, ConductorParameters, DielectricParameters, GlassParameters, MatteParameters,
        MirrorParameters,
    };
    use crate::math::Vec3;
    use crate::math::lanes::scalar::Wrapping;
    use crate::parameter::{Varying, Word};
    use crate::texture::{Compiler, ConstantTexture};

    #[test]
    fn parameters_are_found_in_rows() {
        let slot =
            |kind: MaterialKind, parameter| ParameterSlot::of(&kind, parameter).map(|slot| slot.target.slot);
        let reflectance = [0.5; 3];
        assert_eq!(
            slot(MatteParameters { reflectance, roughness: 0.0 }.into(), "reflectance"),
            Some(Slot::Colour)
        );
        assert_eq!(slot(MirrorParameters { reflectance }.into(), "reflectance"), Some(Slot::Colour));
        assert_eq!(slot(MirrorParameters { reflectance }.into(), "colour"), None);
        let glass = GlassParameters { ior: 1.5, reflectance, transmittance: reflectance };
        assert_eq!(slot(glass.into(), "reflectance"), Some(Slot::Colour));
        assert_eq!(slot(glass.into(), "transmittance"), Some(Slot::Colours(0)));
        assert_eq!(slot(glass.into(), "ior"), Some(Slot::Number(3)));
        let matte = MatteParameters { reflectance, roughness: 1.0 };
        assert_eq!(slot(matte.into(), "roughness"), Some(Slot::Number(0)));
        let (eta, k) = (Some([1.5; 3]), Some([1.5; 3]));
        let metal = ConductorParameters { metal: None, eta, k, roughness: [1.0; 2] };
        for (parameter, place) in
            [("eta", Slot::Colours(0)), ("k", Slot::Colours(3)), ("roughness", Slot::Numbers(6))]
        {
            assert_eq!(slot(metal.into(), parameter), Some(place), "{parameter}");
        }
        let smooth = ConductorParameters { roughness: [0.0; 2], ..metal };
        assert_eq!(slot(smooth.into(), "eta"), Some(Slot::Colours(0)));
        let named = ConductorParameters { metal: Some(Word(0)), eta: None, k: None, roughness: [1.0; 2] };
        assert_eq!(slot(named.into(), "roughness"), Some(Slot::Numbers(6)));
        let frosted = DielectricParameters {
            ior: 1.5,
            roughness: [1.0; 2],
            absorption: [0.5; 3],
            priority: 1.0,
            thin_walled: false,
            reflectance,
            transmittance: reflectance,
        };
        assert_eq!(slot(frosted.into(), "absorption"), None);
        assert_eq!(slot(frosted.into(), "priority"), None);
        let frosted = DielectricParameters { absorption: [0.0; 3], priority: 0.0, ..frosted };
        for (parameter, place) in [
            ("ior", Slot::Number(3)),
            ("roughness", Slot::Numbers(4)),
            ("reflectance", Slot::Colour),
            ("transmittance", Slot::Colours(0)),
        ] {
            let sheet = DielectricParameters { thin_walled: true, ..frosted };
            assert_eq!(slot(frosted.into(), parameter), Some(place), "{parameter}");
            assert_eq!(slot(sheet.into(), parameter), Some(place), "{parameter} of a sheet");
        }
        // Paths sample no light at black colours.
        let tint = ParameterSlot::of(&frosted.into(), "reflectance").map(|slot| slot.least);
        assert!(tint > Some(0.0), "{tint:?}");
        let board = CheckerboardParameters { even: 0, odd: 0, checks_per_unit: [1.0; 2] };
        assert_eq!(slot(board.into(), "checks_per_unit"), None);
        assert_eq!(slot(board.into(), "even"), None);
    }

    #[test]
    fn a_texture_is_used_whatever_number_is_beside_it() {
        let (eta, k) = (Some([1.5; 3]), Some([1.5; 3]));
        let reflectance = [0.5; 3];
        for smooth in [
            MaterialKind::from(MatteParameters { reflectance, roughness: 0.0 }),
            ConductorParameters { metal: None, eta, k, roughness: [0.0; 2] }.into(),
        ] {
            assert_eq!(ParameterSlot::of(&smooth, "roughness"), None, "{smooth:?} is smooth");
            let rough = with_placeholders(&smooth, ["roughness"].into_iter());
            assert!(ParameterSlot::of(&rough, "roughness").is_some(), "{rough:?}");
            assert!(
                ParameterSlot::of(&rough, "reflectance").is_some()
                    || ParameterSlot::of(&rough, "eta").is_some()
            );
            assert_eq!(with_placeholders(&smooth, [].into_iter()), smooth);
        }
    }

    #[test]
    fn values_are_replaced_within_limits() {
        let colour = [2.0, 0.25, 0.5];
        let textures = [ConstantTexture { value: Varying::Colour(colour) }.into()];
        let mut compiler = Compiler::new(&textures, &[]);
        let texture = compiler.root(0);
        let glass: MaterialKind =
            GlassParameters { ior: 1.0, reflectance: [0.1; 3], transmittance: [0.1; 3] }.into();
        let binding = |parameter| Binding {
            row: 1,
            slot: ParameterSlot::of(&glass, parameter).expect("a slot"),
            texture,
        };
        let bindings = Bindings::new(2, &[binding("transmittance"), binding("ior")]);
        let textures = compiler.finish();
        let site = Site::new(Vec3::zero(), [0.0_f32; 2], 0.0);
        let own = Numbers { colour: Rgb::splat([0.1; 3]), further: [0.125; NUMBERS] };
        let apply = |row| bindings.apply(&textures, Wrapping(row), site, own);
        assert_eq!(apply(0).further, own.further);
        let found = apply(1);
        assert_eq!(found.colour, own.colour);
        // The ior uses the red channel; reflected fractions are at most one.
        assert_eq!(found.further[..5], [1.0, 0.25, 0.5, 2.0, 0.125]);
    }

    #[test]
    fn squares_replace_the_squares_in_rows() {
        let textures = [ConstantTexture { value: Varying::Colour([0.5, 0.25, 0.0]) }.into()];
        let mut compiler = Compiler::new(&textures, &[]);
        let texture = compiler.root(0);
        let parameter =
            |slot, most| ParameterSlot { target: Target { slot, is_squared: true }, least: 0.0, most };
        let binding = |slot, most| Binding { row: 0, slot: parameter(slot, most), texture };
        let all = [binding(Slot::Colour, 1.0), binding(Slot::Numbers(6), 0.3), binding(Slot::Number(0), 0.0)];
        let bindings = Bindings::new(1, &all);
        let site = Site::new(Vec3::zero(), [0.0_f32; 2], 0.0);
        let own = Numbers { colour: Rgb::black(), further: [0.125; NUMBERS] };
        let found = bindings.apply(&compiler.finish(), Wrapping(0), site, own);
        assert_eq!(found.colour, Rgb::splat([0.25, 0.0625, LEAST_ALPHA]));
        let square = 0.3_f32 * 0.3;
        assert_eq!(found.further, [LEAST_ALPHA, 0.125, 0.125, 0.125, 0.125, 0.125, square, square]);
    }
}
