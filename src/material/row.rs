//! A material in the representation of the table and of lanes.

use super::kind::Kind;
use crate::math::{ColumnReader, Float, Rgb, Uint, value};
pub use crate::texture::Site;

/// The number of further numbers of a row: as many as the material with the most needs.
pub const NUMBERS: usize = 8;

/// The number of rows among which one row chooses.
pub const CHOICES: usize = 2;

/// The names of the columns of numbers.
const NUMBER_NAMES: [&str; NUMBERS] =
    ["number_0", "number_1", "number_2", "number_3", "number_4", "number_5", "number_6", "number_7"];

/// The names of the columns of choices.
const CHOICE_NAMES: [&str; CHOICES] = ["choice_0", "choice_1"];

/// The index of a dielectric's index of refraction among the numbers of its row.
pub(super) const IOR: usize = 3;

/// The number of the first further numbers of metals that are indices of refraction and extinction coefficients.
pub(super) const METAL_INDICES: usize = 6;

/// The medium inside a dielectric, except for its index of refraction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Where media overlap, the one with the highest priority is effective.
    pub priority: u32,
    /// The absorption coefficient σ per unit of length.
    pub absorption: [f32; 3],
}

/// One material: its program, and the program's parameters. A parameter may be a texture if its value, or the square of
/// it, is stored unchanged: numbers that depend on it in other ways are computed at the hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The program.
    pub kind: Kind,
    /// The colour that most materials have. If it is black, lobes that are not delta lobes must be black.
    pub colour: [f32; 3],
    /// Further parameters of the program, in its own order, followed by zeros.
    pub numbers: [f32; NUMBERS],
    /// The rows among which a chooser chooses, all of which precede this one.
    pub choices: [u32; CHOICES],
    /// Whether it scatters differently along u and v, so that frames have to follow uv.
    pub is_anisotropic: bool,
    /// The medium inside a solid dielectric.
    pub medium: Option<Medium>,
}

impl Row {
    /// A row with only a colour.
    pub(super) fn new(kind: Kind, colour: [f32; 3]) -> Row {
        Row {
            kind,
            colour,
            numbers: [0.0; NUMBERS],
            choices: [0; CHOICES],
            is_anisotropic: false,
            medium: None,
        }
    }
}

/// The numbers of a program, extended to those of a row.
pub(super) fn padded<const N: usize>(numbers: [f32; N]) -> [f32; NUMBERS] {
    let mut all = [0.0; NUMBERS];
    all[..N].copy_from_slice(&numbers);
    all
}

/// The numbers of each lane's row, from which programs make lobes.
#[derive(Clone, Copy, Debug)]
pub struct Numbers<F> {
    /// [`Row::colour`].
    pub colour: Rgb<F>,
    /// [`Row::numbers`].
    pub further: [F; NUMBERS],
}

value!(Numbers { colour, further });

/// All rows, one column for each property.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    kind: Vec<u32>,
    colour: [Vec<f32>; 3],
    numbers: [Vec<f32>; NUMBERS],
    choices: [Vec<u32>; CHOICES],
    /// Only columns before this one have values other than zero in any leaf.
    used: usize,
}

impl Columns {
    pub(super) fn push(&mut self, row: &Row) {
        self.kind.push(row.kind as u32);
        self.colour.iter_mut().zip(row.colour).for_each(|(column, x)| column.push(x));
        self.numbers.iter_mut().zip(row.numbers).for_each(|(column, x)| column.push(x));
        self.choices.iter_mut().zip(row.choices).for_each(|(column, x)| column.push(x));
        if !row.kind.is_chooser() {
            let used = row.numbers.iter().rposition(|&x| x != 0.0).map_or(0, |last| last + 1);
            self.used = self.used.max(used);
        }
    }

    /// Visits all columns, including those of numbers that no row uses.
    pub(super) fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Columns { kind, colour, numbers, choices, used: _ } = self;
        reader.words("kind", kind);
        reader.vectors("colour", colour);
        NUMBER_NAMES.iter().zip(numbers).for_each(|(name, column)| reader.floats(name, column));
        CHOICE_NAMES.iter().zip(choices).for_each(|(name, column)| reader.words(name, column));
    }

    /// The kinds of rows, as numbers.
    #[inline(always)]
    pub(super) fn kind<U: Uint>(&self, row: U) -> U {
        U::gather(&self.kind, row)
    }

    /// One of the rows among which choosers choose.
    #[inline(always)]
    pub(super) fn choice<U: Uint>(&self, i: usize, row: U) -> U {
        U::gather(&self.choices[i], row)
    }

    /// One of the numbers of rows.
    #[inline(always)]
    pub(super) fn number<F: Float>(&self, i: usize, row: F::Uint) -> F {
        F::gather(&self.numbers[i], row)
    }

    /// All numbers from which leaves make lobes.
    #[inline(always)]
    pub(super) fn numbers<F: Float>(&self, row: F::Uint) -> Numbers<F> {
        // Most scenes use only colours. `used` is the same at every hit, so that the branches are predicted. The arrays
        // are listed one by one, because a loop over them would keep them in memory.
        let mut first = [F::zero(); NUMBERS / 2];
        if self.used > 0 {
            let [a, b, c, d, ..] = &self.numbers;
            first = F::gather_all([a, b, c, d], row);
        }
        let mut last = [F::zero(); NUMBERS / 2];
        if self.used > NUMBERS / 2 {
            let [.., a, b, c, d] = &self.numbers;
            last = F::gather_all([a, b, c, d], row);
        }
        let ([a, b, c, d], [e, f, g, h]) = (first, last);
        let further = [a, b, c, d, e, f, g, h];
        Numbers { colour: Rgb::gather(&self.colour, row), further }
    }
}
