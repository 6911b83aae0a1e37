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
//! | 9e3779b0₁₆ | the camera ray's: [`Block::TIME`] |
//! | from 9e3779b1₁₆ up | decisions about the materials that paths hit: [`VertexBlock::MATERIAL`] |
//! | from 2³² − 1 down | those of a [`Stream`](super::Stream) |
//!
//! Numbers of blocks that one path draws must not differ by a multiple of a high power of two: samplers hash them, and the
//! hash carries differences upwards only. Two blocks that differ in their highest bit alone have correlated numbers.
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

/// The first number of blocks that are no integrator's: 2³² divided by the golden ratio, less one, whose low digits are
/// far from those of other blocks.
const ASIDE: u32 = 0x9e37_79b0;

/// A decision that is made once per path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block(u32);

impl Block {
    /// The position on the film (first pair) and on the lens (second pair).
    pub const CAMERA: Block = Block(0);
    /// The time at which the ray leaves the camera (first number), as a fraction of the time that the shutter is open.
    /// It is only drawn for cameras with a shutter time, of which there is none yet. A path with four decisions per
    /// vertex would need 2²⁹ vertices for another decision to reach this number.
    pub const TIME: Block = Block(ASIDE);

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
    pub const MATERIAL: VertexBlock = VertexBlock { first: ASIDE + 1, step: 1 };

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
    use crate::sampling::{Independent, Sampler, Sobol};
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

    /// The largest statistic of dependence between numbers of decisions of the same paths: χ² of 16 × 16 bins, as a standard
    /// normal number, over pixels whose indices are even or odd.
    fn dependence(sampler: Sampler, first: VertexBlock) -> f64 {
        let mut worst = 0.0_f64;
        for parity in 0..2 {
            for depth in 0..3 {
                for other in 0..6 {
                    for axis in 0..2 {
                        let mut bins = [[0_u32; 16]; 16];
                        let count = 1 << 14;
                        for i in 0..count {
                            // A run of samples in each of many pixels.
                            let (pixel, sample) = (2 * (i / 16) + parity, i % 16);
                            let path = PathId::<f32> { pixel: Wrapping(pixel), sample: Wrapping(sample) };
                            let [choice, ..] = sampler.draw(path, first.at::<f32>(Wrapping(depth)));
                            let numbers = sampler.draw(path, Wrapping(other));
                            bins[(choice * 16.0) as usize][(numbers[axis] * 16.0) as usize] += 1;
                        }
                        let expected = f64::from(count) / 256.0;
                        let squares = bins.iter().flatten().map(|&n| (f64::from(n) - expected).powi(2));
                        let chi2 = squares.sum::<f64>() / expected;
                        // 225 degrees of freedom, as both marginal distributions are stratified.
                        worst = worst.max((chi2 - 225.0) / (2.0_f64 * 225.0).sqrt());
                    }
                }
            }
        }
        worst
    }

    #[test]
    fn choices_of_materials_are_independent_of_other_decisions() {
        for sampler in [Sampler::from(Independent { seed: 3 }), Sampler::from(Sobol { seed: 3 })] {
            // 72 statistics; a normal number exceeds 6 with probability 10⁻⁹.
            let (own, far) =
                (dependence(sampler, VertexBlock::MATERIAL), VertexBlock { first: (1 << 31) + 1, step: 1 });
            assert!(own < 7.0, "{sampler:?}: {own}");
            // Negative control: numbers of blocks that differ in the highest bit alone.
            let control = dependence(sampler, far);
            assert!(control > 20.0, "{sampler:?}: {control}");
        }
    }
}
