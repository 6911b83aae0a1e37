//! Which random numbers each decision of a path gets.
//!
//! Numbers are drawn in blocks of four dimensions: two pairs, each stratified by samplers that stratify. Each decision
//! has a block of its own, so that a path that branches differently at one bounce draws the same numbers at the next.
//! Blocks are numbered:
//!
//! | numbers | whose |
//! |---|---|
//! | 0 | the camera ray's: [`Block::CAMERA`] |
//! | 1 and on | the integrator's, as its [`Blocks`] allot them |
//! | 2³¹ | the camera ray's: [`Block::TIME`] |
//! | from 2³¹ + 1 up | those of what paths meet: [`VertexBlock::MEETING`] |
//! | from 2³² − 1 down | those of a [`Stream`](super::Stream) |
//!
//! A decision that takes an unknown count of numbers, as a chain or a free flight does, draws them from the
//! [`EndlessStream`](super::EndlessStream) of its block.

use crate::math::{Float, Uint, value};

/// Which path numbers are drawn for.
#[derive(Clone, Copy, Debug)]
pub struct PathId<F: Float> {
    /// The pixel's index on the full film, row-major from the top left.
    pub pixel: F::Uint,
    /// The index among the pixel's samples.
    pub sample: F::Uint,
}

value!(PathId { pixel, sample });

/// A decision that is made once on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block(u32);

impl Block {
    /// Where on the film (first pair) and on the lens (second pair).
    pub const CAMERA: Block = Block(0);
    /// When the ray leaves the camera (first number), as a share of the time that the shutter is open. It is drawn
    /// only for cameras whose shutter stays open for a while, of which there is none yet. A path of four decisions at
    /// each vertex would have to have 2²⁹ vertices for another decision to come to its number.
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
    /// Which of mixed materials a path meets (first number), and whether it meets the surface or goes through a hole
    /// (second). The `depth` of it counts surfaces gone through besides. It is drawn in scenes alone that have mixes or
    /// holes, so that it does not come among the blocks of integrators.
    pub const MEETING: VertexBlock = VertexBlock { first: (1 << 31) + 1, step: 1 };

    /// The block's number at the vertex `depth`, counted from zero at the first.
    #[inline(always)]
    pub fn at<F: Float>(self, depth: F::Uint) -> F::Uint {
        depth * F::Uint::splat(self.step) + F::Uint::splat(self.first)
    }
}

/// How many blocks an integrator has, which it allots to its decisions in one place: no two of them share a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    once: u32,
    each: u32,
}

impl Blocks {
    /// So many that are drawn once a path, beside the camera ray's, and so many that are drawn at each vertex.
    pub const fn new(once: u32, each: u32) -> Blocks {
        Blocks { once, each }
    }

    /// One of those that are drawn once, counted from zero.
    ///
    /// # Panics
    /// Panics if there are not so many; while the program is compiled, where blocks are constants.
    pub const fn once(self, index: u32) -> Block {
        assert!(index < self.once);
        Block(1 + index)
    }

    /// One of those that are drawn at each vertex, counted from zero.
    ///
    /// # Panics
    /// Panics if there are not so many; while the program is compiled, where blocks are constants.
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
            let meeting = (0..1000).map(|depth| VertexBlock::MEETING.at::<f32>(Wrapping(depth)).0);
            let at = |depth| (0..each).map(move |i| blocks.each(i).at::<f32>(Wrapping(depth)).0);
            let all: Vec<_> = single.chain(meeting).chain((0..1000).chain([last - 1]).flat_map(at)).collect();
            assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len(), "{once} once, {each} each");
        }
    }
}
