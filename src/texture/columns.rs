//! The instructions and pictures of a scene's textures as tables, with a column for each property.

use super::instruction::{Instruction, NUMBERS, Op};
use super::picture::{Depth, Picture};
use crate::math::{ColumnReader, Float, Rgb, Uint, push3};

/// The names of the columns of numbers.
const NUMBER_NAMES: [&str; NUMBERS] =
    ["number_0", "number_1", "number_2", "number_3", "number_4", "number_5"];

/// The format bit of pictures with three channels.
pub const COLOURED: u32 = 4;
/// The format bit of pictures with numbers encoded as sRGB.
pub const SRGB: u32 = 8;

/// The flag of images that consist of tiles.
pub(super) const TILES: u32 = 1 << 5;

/// The flag of images whose coarser levels may be used.
pub(super) const MIPMAP: u32 = 1 << 6;

/// The flag of images that use the second set of uv.
pub(super) const SECOND_UV: u32 = 1 << 7;

/// Which numbers of pictures are encoded as sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoded {
    None,
    /// Those of 8 and 16 bits.
    Integers,
    All,
}

/// All instructions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Instructions {
    op: Vec<u32>,
    next: Vec<u32>,
    link: Vec<u32>,
    other: Vec<u32>,
    flags: Vec<u32>,
    colour: [Vec<f32>; 3],
    numbers: [Vec<f32>; NUMBERS],
}

impl Instructions {
    /// Appends an instruction and returns its number.
    pub(super) fn push(&mut self, instruction: &Instruction) -> u32 {
        let Instruction { op, next, link, other, flags, colour, numbers } = *instruction;
        self.op.push(op as u32);
        self.next.push(next);
        self.link.push(link);
        self.other.push(other);
        self.flags.push(flags);
        push3(&mut self.colour, colour);
        self.numbers.iter_mut().zip(numbers).for_each(|(column, x)| column.push(x));
        self.op.len() as u32 - 1
    }

    /// Whether any instruction has this operation.
    pub(super) fn has(&self, op: Op) -> bool {
        self.op.contains(&(op as u32))
    }

    /// The row of the picture of an instruction that looks one up, without tiles.
    pub(super) fn image_row(&self, at: u32) -> Option<usize> {
        let at = at as usize;
        let is_image = self.op[at] == Op::Image as u32 && self.flags[at] & TILES == 0;
        is_image.then(|| self.link[at] as usize)
    }

    /// The flags of the instructions with this operation.
    pub(super) fn flags_of(&self, op: Op) -> impl Iterator<Item = u32> {
        self.op.iter().zip(&self.flags).filter(move |(own, _)| **own == op as u32).map(|(_, flags)| *flags)
    }

    /// Visits all columns.
    pub(super) fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Instructions { op, next, link, other, flags, colour, numbers } = self;
        reader.words("op", op);
        reader.words("next", next);
        reader.words("link", link);
        reader.words("other", other);
        reader.words("flags", flags);
        reader.vectors("colour", colour);
        NUMBER_NAMES.iter().zip(numbers).for_each(|(name, column)| reader.floats(name, column));
    }

    #[inline(always)]
    pub(super) fn op<U: Uint>(&self, at: U) -> U {
        U::gather(&self.op, at)
    }

    #[inline(always)]
    pub(super) fn next<U: Uint>(&self, at: U) -> U {
        U::gather(&self.next, at)
    }

    #[inline(always)]
    pub(super) fn link<U: Uint>(&self, at: U) -> U {
        U::gather(&self.link, at)
    }

    #[inline(always)]
    pub(super) fn other<U: Uint>(&self, at: U) -> U {
        U::gather(&self.other, at)
    }

    #[inline(always)]
    pub(super) fn flags<U: Uint>(&self, at: U) -> U {
        U::gather(&self.flags, at)
    }

    #[inline(always)]
    pub(super) fn colour<F: Float>(&self, at: F::Uint) -> Rgb<F> {
        Rgb::gather(&self.colour, at)
    }

    #[inline(always)]
    pub(super) fn all_numbers<F: Float>(&self, at: F::Uint) -> [F; NUMBERS] {
        let [a, b, c, d, e, f] = &self.numbers;
        F::gather_all([a, b, c, d, e, f], at)
    }

    #[inline(always)]
    pub(super) fn number<F: Float>(&self, i: usize, at: F::Uint) -> F {
        F::gather(&self.numbers[i], at)
    }
}

/// The pictures that instructions look up. A picture has one row for each interpretation of its numbers, and one for
/// each of its positions among tiles.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PictureRows {
    width: Vec<u32>,
    height: Vec<u32>,
    /// The number of words of sixteen bytes before it, if all pictures are stored one after the other.
    first: Vec<u32>,
    /// Its [`Depth`], [`COLOURED`] and [`SRGB`].
    form: Vec<u32>,
    /// The index of the picture.
    picture: Vec<u32>,
    /// The number of its coarser levels and the row of the first of them; the others follow.
    levels: Vec<u32>,
    coarser: Vec<u32>,
    /// The number of words of the pictures that have rows.
    words: u32,
}

impl PictureRows {
    /// Adds a row for the picture with this index. Indices increase from zero.
    pub(super) fn push(&mut self, number: u32, picture: &Picture, encoded: Encoded) {
        let known = self.picture.iter().position(|known| *known == number);
        let first = known.map_or(self.words, |row| self.first[row]);
        if known.is_none() {
            // Larger sizes are rejected by the heap.
            self.words = self.words.saturating_add(picture.words().len() as u32);
        }
        let coloured = if picture.channels() == 3 { COLOURED } else { 0 };
        let is_encoded = match encoded {
            Encoded::None => false,
            Encoded::Integers => matches!(picture.depth(), Depth::Bits8 | Depth::Bits16),
            Encoded::All => true,
        };
        self.width.push(picture.width());
        self.height.push(picture.height());
        self.first.push(first);
        self.form.push(picture.depth() as u32 | coloured | if is_encoded { SRGB } else { 0 });
        self.picture.push(number);
        self.levels.push(0);
        self.coarser.push(0);
    }

    /// Marks the last rows as the coarser levels of a picture.
    pub(super) fn set_levels(&mut self, row: u32, levels: usize) {
        self.levels[row as usize] = levels as u32;
        self.coarser[row as usize] = (self.len() - levels) as u32;
    }

    /// Whether the numbers of a row are encoded as sRGB.
    pub(super) fn is_encoded(&self, row: u32) -> bool {
        self.form[row as usize] & SRGB != 0
    }

    pub(super) fn len(&self) -> usize {
        self.picture.len()
    }

    /// The index and the format of a row's picture.
    #[inline(always)]
    pub(super) fn of(&self, row: usize) -> (usize, u32) {
        (self.picture[row] as usize, self.form[row])
    }

    pub(super) fn forms(&self) -> &[u32] {
        &self.form
    }

    /// Visits the columns.
    pub(super) fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let PictureRows { width, height, first, form, picture: _, levels, coarser, words: _ } = self;
        reader.words("width", width);
        reader.words("height", height);
        reader.words("first", first);
        reader.words("form", form);
        reader.words("levels", levels);
        reader.words("coarser", coarser);
    }

    /// Columns of texels, and rows of them.
    #[inline(always)]
    pub(super) fn size<U: Uint>(&self, row: U) -> [U; 2] {
        [U::gather(&self.width, row), U::gather(&self.height, row)]
    }

    /// The number of coarser levels.
    #[inline(always)]
    pub(super) fn levels<U: Uint>(&self, row: U) -> U {
        U::gather(&self.levels, row)
    }

    /// The row of the first coarser level, if there is one.
    #[inline(always)]
    pub(super) fn coarser<U: Uint>(&self, row: U) -> U {
        U::gather(&self.coarser, row)
    }
}
