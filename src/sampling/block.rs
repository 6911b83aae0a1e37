//! The assignment of random numbers to the decisions of a path.
//!
//! Numbers are drawn in blocks of four dimensions: two pairs, each stratified by samplers that stratify. Each decision
//! has a block of its own, so that paths with different decisions at one bounce draw the same numbers at the next.
//! Blocks are numbered:
//!
//! | numbers | use |
//! |---|---|
//! | 0 | the camera ray's: [`Block::CAMERA`] |
//! | from 1 up | the integrator's, as assigned by its [`Blocks`] |
//! | 2³¹ | the camera ray's: [`Block::TIME`] |
//! | from 2³¹ + 1 up | decisions about the materials that paths hit: [`VertexBlock::MATERIAL`] |
//! | from 2³² − 1 down | those of a [`Stream`](super::Stream) |
//!
//! A decision that needs an unknown count of numbers, as a chain or a free flight does, draws them from the
//! [`EndlessStream`](super::EndlessStream) of its block.

use crate::math::{Float, Uint, value};

/// The path for which numbers are drawn.
#[derive(Clone, Copy, Debug)]
pub struct PathId<F: Float> {
    /// The pixel's index on the full film, row-major from the top left.
    pub pixel: F::Uint,
    /// The index of the sample in its pixel.
    pub sample: F::Uint,
}

value!(PathId { pixel, sample });

/// A decision that is made once per path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block(u32);

impl Block {
    /// The position on the film (first pair) and on the lens (second pair).
    pub const CAMERA: Block = Block(0);
    /// The time at which the ray leaves the camera (first number), as a fraction of the time that the shutter is open.
    /// It is only drawn for cameras with a shutter time, of which there is none yet. A path with four decisions per
    /// vertex would need 2²⁹ vertices for another decision to reach this number.
    pub const TIME: Block = Block(1 << 31);

    /// The block's number.
    #[inline(always)]
    pub fn number<F: Float>(self) -> F::Uint {
        F::Uint::splat(self.0)
    }
}

/// A decision that is made at each vertex of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexBlock {
    first: u32,
    step: u32,
}

impl VertexBlock {
    /// The choice among mixed materials (first number), and between the surface and passing straight through it by its
    /// opacity (second). Its `depth` also counts surfaces passed through. It is only drawn in scenes with mixes or
    /// opacities, so that it does not use blocks of integrators.
    pub const MATERIAL: VertexBlock = VertexBlock { first: (1 << 31) + 1, step: 1 };

    /// The block's number at the vertex `depth`, counted from zero.
    #[inline(always)]
    pub fn at<F: Float>(self, depth: F::Uint) -> F::Uint {
        depth * F::Uint::splat(self.step) + F::Uint::splat(self.first)
    }
}

/// The number of blocks of an integrator, which it assigns to its decisions in one place: no two of them share a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    once: u32,
    each: u32,
}

impl Blocks {
    /// The number of blocks that are drawn once per path, besides the camera ray's, and of those that are drawn at each
    /// vertex.
    pub const fn new(once: u32, each: u32) -> Blocks {
        Blocks { once, each }
    }

    /// A block that is drawn once, counted from zero.
    ///
    /// # Panics
    /// Panics if there are not as many; for constant blocks, at compile time.
    pub const fn once(self, index: u32) -> Block {
        assert!(index < self.once);
        Block(1 + index)
    }

    /// A block that is drawn at each vertex, counted from zero.
    ///
    /// # Panics
    /// Panics if there are not as many; for constant blocks, at compile time.
    pub const fn each(self, index: u32) -> VertexBlock {
        assert!(index < self.each);
        VertexBlock { first: 1 + self.once + index, step: self.each }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;
    use std::collections::BTreeSet;

    #[test]
    fn every_decision_has_a_block_of_its_own() {
        for (once, each) in [(0, 2), (1, 1), (3, 0), (2, 4)] {
            let blocks = Blocks::new(once, each);
            let last = ((1 << 31) - 2 - once) / each.max(1);
            let own = (0..once).map(|i| blocks.once(i));
            let single = own.chain([Block::CAMERA, Block::TIME]).map(|block| block.number::<f32>().0);
            let material = (0..1000).map(|depth| VertexBlock::MATERIAL.at::<f32>(Wrapping(depth)).0);
            let at = |depth| (0..each).map(move |i| blocks.each(i).at::<f32>(Wrapping(depth)).0);
            let all: Vec<_> =
                single.chain(material).chain((0..1000).chain([last - 1]).flat_map(at)).collect();
            assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len(), "{once} once, {each} each");
        }
    }
}
