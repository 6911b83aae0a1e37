//! Compilation of a scene's textures to programs.

use super::files::ImageFile;
use super::instruction::END;
use super::list::TextureKind;
use super::program::{Builder, Cost, MOST_INSTRUCTIONS, STACK};
use super::slope_step::SlopeStep;
use super::table::TextureTable;
use crate::parameter::Family;
use thiserror::Error;

/// A texture that is too complex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TooDeep {
    /// It needs too many values at a time.
    #[error("textures are nested too deeply: it needs {0} values at a time, at most {STACK} are possible")]
    Stack(usize),
    /// Its program is too long.
    #[error("it consists of more than {MOST_INSTRUCTIONS} textures, counting each use of a texture")]
    Instructions,
}

/// The cost of each of some textures, or the limit that it exceeds. Each refers only to textures before it.
pub fn costs(textures: &[TextureKind]) -> Vec<Result<Cost, TooDeep>> {
    let mut known = Vec::with_capacity(textures.len());
    let checked = |cost: &Cost| {
        if cost.depth > STACK {
            Err(TooDeep::Stack(cost.depth))
        } else if cost.instructions > MOST_INSTRUCTIONS {
            Err(TooDeep::Instructions)
        } else {
            Ok(*cost)
        }
    };
    for texture in textures {
        known.push(texture.program().cost(&known));
    }
    known.iter().map(checked).collect()
}

/// Whether each of some textures depends on the second set of uv. Each refers only to textures before it.
pub fn uses_of_second_uv(textures: &[TextureKind]) -> Vec<bool> {
    let mut known: Vec<bool> = Vec::with_capacity(textures.len());
    for texture in textures {
        let uses = texture.program().uses_second_uv() || texture.textures().any(|named| known[named]);
        known.push(uses);
    }
    known
}

/// Compiles the used textures of a scene.
pub struct Compiler<'a> {
    builder: Builder<'a>,
    roots: Vec<Option<u32>>,
    slope_steps: Vec<SlopeStep>,
}

impl<'a> Compiler<'a> {
    /// A compiler of some textures, of which none has been compiled. Each refers only to those before it, and none
    /// exceeds a limit.
    pub fn new(textures: &'a [TextureKind], images: &'a [ImageFile]) -> Compiler<'a> {
        let mut known = Vec::with_capacity(textures.len());
        let mut slope_steps: Vec<SlopeStep> = Vec::with_capacity(textures.len());
        for texture in textures {
            known.push(texture.program().cost(&known));
            let named = texture.textures().map(|named| slope_steps[named]);
            slope_steps
                .push(texture.program().slope_step(named.fold(SlopeStep::NONE, SlopeStep::min), images));
        }
        let builder = Builder {
            textures: textures.iter().map(TextureKind::program).collect(),
            costs: known,
            images,
            instructions: Default::default(),
            rows: Default::default(),
            pictures: Vec::new(),
            rows_of: vec![[None; 3]; images.len()],
        };
        Compiler { builder, roots: vec![None; textures.len()], slope_steps }
    }

    /// The distance over which the slope of a texture is measured.
    pub fn slope_step(&self, texture: usize) -> SlopeStep {
        self.slope_steps[texture]
    }

    /// The number of a texture for [`TextureTable::value`].
    pub fn root(&mut self, texture: usize) -> u32 {
        *self.roots[texture]
            .get_or_insert_with(|| self.builder.textures[texture].emit(&mut self.builder, END))
    }

    /// The table of the compiled textures.
    pub fn finish(self) -> TextureTable {
        let Builder { costs, instructions, rows, pictures, .. } = self.builder;
        let used = self.roots.iter().zip(&costs).filter(|(root, _)| root.is_some());
        let depth = used.map(|(_, cost)| cost.depth).max().unwrap_or(0);
        TextureTable::new(instructions, rows, pictures, depth)
    }
}
