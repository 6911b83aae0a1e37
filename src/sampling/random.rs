//! Random numbers as a function of (seed, pixel, sample index, dimension).
//!
//! Nothing is remembered between draws, so a path's numbers do not depend on which thread traces it or on
//! what it traced before.

use crate::math::{Float, Uint};

/// Which path numbers are drawn for.
#[derive(Clone, Copy, Debug)]
pub struct PathId<F: Float> {
    /// The pixel's index on the full film, row-major from the top left.
    pub pixel: F::Uint,
    /// The index among the pixel's samples.
    pub sample: F::Uint,
}

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

/// Independent uniform numbers.
///
/// The four numbers of a block are the four words of one hash of (pixel, sample, block, seed), which is a
/// permutation of 128 bits: no two blocks of any two paths or seeds share all their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Independent {
    /// The seed.
    pub seed: u32,
}

impl Independent {
    /// The four numbers of a block.
    #[inline(always)]
    pub fn draw<F: Float>(&self, path: PathId<F>, block: F::Uint) -> [F; 4] {
        let [x, y, z, w] = pcg4d([path.pixel, path.sample, block, F::Uint::splat(self.seed)]);
        [x.to_unit(), y.to_unit(), z.to_unit(), w.to_unit()]
    }
}

/// A hash of four words to four words (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering",
/// `pcg4d`).
#[inline(always)]
pub fn pcg4d<U: Uint>(words: [U; 4]) -> [U; 4] {
    let (factor, step) = (U::splat(1_664_525), U::splat(1_013_904_223));
    let [mut x, mut y, mut z, mut w] = words;
    x = x * factor + step;
    y = y * factor + step;
    z = z * factor + step;
    w = w * factor + step;
    x = x + y * w;
    y = y + z * x;
    z = z + x * y;
    w = w + y * z;
    x = x ^ x.shr::<16>();
    y = y ^ y.shr::<16>();
    z = z ^ z.shr::<16>();
    w = w ^ w.shr::<16>();
    x = x + y * w;
    y = y + z * x;
    z = z + x * y;
    w = w + y * z;
    [x, y, z, w]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    fn hash(words: [u32; 4]) -> [u32; 4] {
        pcg4d(words.map(Wrapping)).map(|w| w.0)
    }

    #[test]
    fn the_hash_is_a_fixed_function() {
        // Worked out from the published definition in another language.
        assert_eq!(hash([0, 0, 0, 0]), [0x0f02f829, 0x2d568769, 0x32b0c43b, 0xd32548ea]);
        assert_eq!(hash([1, 2, 3, 4]), [0x3622cd16, 0xf11471d8, 0xe1109b3f, 0x02b94c2f]);
    }

    #[test]
    fn every_decision_has_a_block_of_its_own() {
        let number = |block: Block, depth: u32| block.at::<f32>(Wrapping(depth)).0;
        let once = [number(Block::CAMERA, 0), number(Block::TIME, 0)];
        let bounce = |depth| [number(Block::SCATTER, depth), number(Block::LIGHT, depth)];
        let last = (1 << 31) - 2;
        let each: Vec<_> = once.into_iter().chain((0..1000).chain([last]).flat_map(bounce)).collect();
        assert_eq!(each.iter().collect::<std::collections::BTreeSet<_>>().len(), each.len());
    }

    /// The largest |Z| of `tests` two-sided standard normal statistics exceeds this with probability
    /// 10⁻⁶·tests at most.
    const Z_MILLIONTH: f64 = 4.9;

    #[test]
    fn neighbouring_counters_give_independent_uniform_numbers() {
        // Means and lag correlations over each argument: a weak hash shows up along one of them.
        let n = 1 << 18;
        for axis in 0..4 {
            let draw = |i: u32| {
                let mut key = [7, 3, 1, 42];
                key[axis] = i;
                hash(key).map(|w| f64::from(w) / 4_294_967_296.0 - 0.5)
            };
            for word in 0..4 {
                let (mut sum, mut lagged) = (0.0, 0.0);
                for i in 0..n {
                    sum += draw(i)[word];
                    lagged += draw(i)[word] * draw(i + 1)[word];
                }
                let n = f64::from(n);
                let z_mean = sum / (n / 12.0).sqrt();
                let z_lag = lagged * 12.0 / n.sqrt();
                assert!(z_mean.abs() < Z_MILLIONTH, "axis {axis} word {word}: mean is off by {z_mean} σ");
                assert!(z_lag.abs() < Z_MILLIONTH, "axis {axis} word {word}: lag correlation {z_lag} σ");
            }
        }
    }
}
