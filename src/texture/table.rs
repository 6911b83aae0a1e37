//! The table of a scene's textures.

use super::columns::{Instructions, MIPMAP, PictureRows, SECOND_UV, SRGB, TILES};
use super::instruction::{END, Op};
use super::picture::{Depth, Picture};
use crate::math::{ColumnReader, colour};
use std::sync::Arc;

/// The index for no texture.
pub const NO_TEXTURE: u32 = END;

/// All used textures of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureTable {
    pub(super) instructions: Instructions,
    pub(super) rows: PictureRows,
    pub(super) pictures: Vec<Arc<Picture>>,
    /// Whether any of its images has tiles.
    pub(super) has_tiles: bool,
    /// Whether coarser levels of any of its images may be used.
    pub(super) has_mipmaps: bool,
    /// Whether any of its images uses the second set of uv.
    pub(super) has_second_uv: bool,
    /// Linear values of encoded ones, for pictures of these depths.
    pub(super) srgb_8: Vec<f32>,
    pub(super) srgb_16: Vec<f32>,
    /// The maximum number of colours on the stack.
    pub(super) depth: usize,
    /// Whether there are instructions of each kind.
    pub(super) has: Has,
}

/// The instructions that occur: the code of others is omitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Has {
    pub(super) image: bool,
    pub(super) check: bool,
    pub(super) mix: bool,
    pub(super) scale: bool,
    pub(super) noise: bool,
    pub(super) restore: bool,
}

/// Linear values of this number of codes, which are encoded as sRGB.
fn linear_values(codes: u32) -> Vec<f32> {
    let most = f64::from(codes - 1);
    (0..codes).map(|code| colour::srgb_to_linear(f64::from(code) / most) as f32).collect()
}

impl TextureTable {
    pub(super) fn new(
        instructions: Instructions,
        rows: PictureRows,
        pictures: Vec<Arc<Picture>>,
        depth: usize,
    ) -> TextureTable {
        let values = |depth: Depth, codes: u32| {
            let is_needed = rows.forms().iter().any(|&form| form & 3 == depth as u32 && form & SRGB != 0);
            if is_needed { linear_values(codes) } else { Vec::new() }
        };
        let (srgb_8, srgb_16) = (values(Depth::Bits8, 1 << 8), values(Depth::Bits16, 1 << 16));
        let has = Has {
            image: instructions.has(Op::Image),
            check: instructions.has(Op::Check),
            mix: instructions.has(Op::Mix),
            scale: instructions.has(Op::Scale),
            noise: instructions.has(Op::Noise),
            restore: instructions.has(Op::Restore),
        };
        let any = |bit: u32| instructions.flags_of(Op::Image).any(|flags| flags & bit != 0);
        let (has_tiles, has_mipmaps, has_second_uv) = (any(TILES), any(MIPMAP), any(SECOND_UV));
        TextureTable {
            instructions,
            rows,
            pictures,
            has_tiles,
            has_mipmaps,
            has_second_uv,
            srgb_8,
            srgb_16,
            depth,
            has,
        }
    }

    /// Whether values depend on [`Site::footprint`](super::Site::footprint).
    #[inline(always)]
    pub fn has_mipmaps(&self) -> bool {
        self.has_mipmaps
    }

    /// Whether values depend on [`Site::second`](super::Site::second).
    #[inline(always)]
    pub fn has_second_uv(&self) -> bool {
        self.has_second_uv
    }

    /// The pictures, in the order in which their rows count words.
    pub fn pictures(&self) -> &[Arc<Picture>] {
        &self.pictures
    }

    /// Visits the columns of the instructions.
    pub fn instruction_columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        self.instructions.columns(reader);
    }

    /// Visits the columns of the pictures.
    pub fn picture_columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        self.rows.columns(reader);
    }
}
