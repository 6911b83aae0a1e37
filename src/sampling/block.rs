//! Which random numbers each decision of a path gets.

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

/// Which decision of a path numbers are drawn for. A block holds four dimensions: two pairs, each
/// stratified by samplers that stratify.
///
/// Each decision has a block of its own, so that a path that branches differently at one bounce draws the
/// same numbers at the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block(u32);

impl Block {
    /// Where on the film (first pair) and on the lens (second pair).
    pub const CAMERA: Block = Block(0);
    /// A BxDF's direction (first pair), its lobe (third) and the path's survival (fourth), at the first
    /// hit. At hit k this is block `SCATTER + k·STRIDE`.
    pub const SCATTER: Block = Block(1);
    /// A point on a light (first pair) and which light (third), at the first hit.
    pub const LIGHT: Block = Block(2);
    /// When the ray leaves the camera (first number), as a share of the time that the shutter is open. It is drawn
    /// only for cameras whose shutter stays open for a while, of which there is none yet. A path would have to bounce
    /// 2³¹ times for another decision to come to its number.
    pub const TIME: Block = Block(u32::MAX);
    /// How many blocks each bounce has.
    pub const STRIDE: u32 = 2;

    /// The block's number at hit `depth`, counted from zero at the first.
    #[inline(always)]
    pub fn at<F: Float>(self, depth: F::Uint) -> F::Uint {
        depth * F::Uint::splat(Self::STRIDE) + F::Uint::splat(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    #[test]
    fn every_decision_has_a_block_of_its_own() {
        let number = |block: Block, depth: u32| block.at::<f32>(Wrapping(depth)).0;
        let once = [number(Block::CAMERA, 0), number(Block::TIME, 0)];
        let bounce = |depth| [number(Block::SCATTER, depth), number(Block::LIGHT, depth)];
        let last = (1 << 31) - 2;
        let each: Vec<_> = once.into_iter().chain((0..1000).chain([last]).flat_map(bounce)).collect();
        assert_eq!(each.iter().collect::<std::collections::BTreeSet<_>>().len(), each.len());
    }
}
