//! Textures as programs.

use super::columns::{Encoded, Instructions, PictureRows};
use super::files::ImageFile;
use super::instruction::{Instruction, Op};
use super::mipmap::coarser_levels;
use super::picture::Picture;
use super::slope_step::SlopeStep;
use crate::parameter::{ImageIndex, Varying};
use std::sync::Arc;

/// The maximum number of colours on the stack while a program runs.
pub const STACK: usize = 6;

/// The maximum number of instructions of a texture. A texture is repeated for each of its uses.
pub const MOST_INSTRUCTIONS: u64 = 4096;

/// The cost of evaluating a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// The number of instructions of its program.
    pub instructions: u64,
    /// The number of colours on the stack.
    pub depth: usize,
    /// Whether it depends on uv.
    pub uses_uv: bool,
}

impl Cost {
    /// The cost of a value, given those of the textures before it.
    pub(super) fn of(value: &Varying, known: &[Cost]) -> Cost {
        match value {
            Varying::Colour(_) => Cost { instructions: 1, depth: 1, uses_uv: false },
            Varying::Texture(index) => known[*index],
        }
    }

    /// The cost of an instruction after the programs of its operands.
    pub(super) fn after(operands: &[&Varying], known: &[Cost]) -> Cost {
        let mut cost = Cost { instructions: 1, depth: 1, uses_uv: false };
        for (waiting, operand) in operands.iter().enumerate() {
            let operand = Cost::of(operand, known);
            cost.instructions = cost.instructions.saturating_add(operand.instructions);
            cost.depth = cost.depth.max(waiting + operand.depth);
            cost.uses_uv |= operand.uses_uv;
        }
        cost
    }
}

/// The parameters of a texture, as a scene describes it.
pub(crate) trait TextureParameters {
    /// Its cost, given those of the textures before it.
    fn cost(&self, known: &[Cost]) -> Cost;

    /// Adds its program, which pushes a colour on the stack and continues with the instruction `next`. Returns the
    /// first of its instructions.
    fn emit(&self, builder: &mut Builder<'_>, next: u32) -> u32;

    /// The distance over which its slope is measured, given the shortest one of the textures that it names.
    fn slope_step(&self, named: SlopeStep, images: &[ImageFile]) -> SlopeStep {
        let _ = images;
        named
    }

    /// Whether it looks up the second set of uv, apart from the textures that it names.
    fn uses_second_uv(&self) -> bool {
        false
    }
}

/// Programs under construction. An instruction precedes those that lead to it.
pub(crate) struct Builder<'a> {
    pub(super) textures: Vec<&'a dyn TextureParameters>,
    pub(super) costs: Vec<Cost>,
    pub(super) images: &'a [ImageFile],
    pub(super) instructions: Instructions,
    pub(super) rows: PictureRows,
    pub(super) pictures: Vec<Arc<Picture>>,
    /// The rows of each image file that has some, for each [`Encoded`], and whether these have coarser levels.
    pub(super) rows_of: Vec<[Option<(u32, bool)>; 3]>,
}

impl<'a> Builder<'a> {
    pub(super) fn push(&mut self, instruction: Instruction) -> u32 {
        self.instructions.push(&instruction)
    }

    /// Adds the program of a value.
    pub(super) fn value(&mut self, value: &Varying, next: u32) -> u32 {
        match value {
            Varying::Colour(colour) => {
                let colour = colour.map(|x| x as f32);
                self.push(Instruction { colour, ..Instruction::new(Op::Constant, next) })
            }
            Varying::Texture(index) => self.textures[*index].emit(self, next),
        }
    }

    /// Adds the programs of an instruction's operands before it: the last one is on top of the stack.
    pub(super) fn operands(&mut self, operands: &[&Varying], instruction: Instruction) -> u32 {
        let last = self.push(instruction);
        operands.iter().rev().fold(last, |next, operand| self.value(operand, next))
    }

    /// Whether a value depends on uv.
    pub(super) fn uses_uv(&self, value: &Varying) -> bool {
        Cost::of(value, &self.costs).uses_uv
    }

    /// An image file.
    pub(super) fn image(&self, image: ImageIndex) -> &'a ImageFile {
        &self.images[image.0]
    }

    /// The first of an image's rows in the table of pictures. Tiles have ten rows per unit of v, black for missing
    /// ones. With `levels`, pictures also have rows for coarser levels.
    pub(super) fn picture_rows(&mut self, image: ImageIndex, encoded: Encoded, levels: bool) -> u32 {
        let known = self.rows_of[image.0][encoded as usize];
        let first = known.map_or_else(|| self.finest_rows(image, encoded), |(first, _)| first);
        let has_levels = known.is_some_and(|(_, has_levels)| has_levels);
        if levels && !has_levels {
            self.coarser_rows(image, first);
        }
        self.rows_of[image.0][encoded as usize] = Some((first, levels || has_levels));
        first
    }

    /// The rows of the pictures of a file.
    fn finest_rows(&mut self, image: ImageIndex, encoded: Encoded) -> u32 {
        let file = &self.images[image.0];
        let first = self.rows.len() as u32;
        for place in 0..file.places() {
            let picture = file.picture(place);
            let index = match self.pictures.iter().position(|known| Arc::ptr_eq(known, picture)) {
                Some(index) => index,
                None => {
                    self.pictures.push(Arc::clone(picture));
                    self.pictures.len() - 1
                }
            };
            self.rows.push(index as u32, picture, encoded);
        }
        first
    }

    /// Adds the coarser levels of a file's pictures, whose rows are known. A missing tile has none.
    fn coarser_rows(&mut self, image: ImageIndex, first: u32) {
        let file = &self.images[image.0];
        for (place, row) in (0..file.places()).zip(first..) {
            let is_encoded = self.rows.is_encoded(row);
            let levels = coarser_levels(file.picture(place), is_encoded);
            let count = levels.len();
            for level in levels {
                let encoded = if is_encoded { Encoded::All } else { Encoded::None };
                self.rows.push(self.pictures.len() as u32, &level, encoded);
                self.pictures.push(Arc::new(level));
            }
            self.rows.set_levels(row, count);
        }
    }
}
