//! Independent random numbers, as a function of (seed, pixel, sample index, dimension).
//!
//! There is no state between draws: a path's numbers do not depend on the thread that traces it or on earlier paths.

use super::block::PathId;
use crate::math::{Float, Uint, function};

/// Independent uniform numbers.
///
/// The four numbers of a block are the four words of a hash of (pixel, sample, block, seed). The hash is a permutation
/// of 128 bits, so that two different blocks, of any paths and seeds, never have the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Independent {
    /// The seed.
    pub seed: u32,
}

impl Independent {
    /// The four numbers of a block.
    #[inline(always)]
    pub fn draw<F: Float>(&self, path: PathId<F>, block: F::Uint) -> [F; 4] {
        let [x, y, z, w] = pcg4d::<F>([path.pixel, path.sample, block, F::Uint::given(&self.seed)]);
        [x.to_unit(), y.to_unit(), z.to_unit(), w.to_unit()]
    }
}

/// A hash of four words to four words (Jarzynski and Olano 2020, "Hash Functions for GPU Rendering",
/// `pcg4d`).
#[inline(always)]
pub fn pcg4d<F: Float>(words: [F::Uint; 4]) -> [F::Uint; 4] {
    function!(F, pcg4d(words), {
        let (factor, step) = (F::Uint::splat(1_664_525), F::Uint::splat(1_013_904_223));
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
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    fn hash(words: [u32; 4]) -> [u32; 4] {
        pcg4d::<f32>(words.map(Wrapping)).map(|w| w.0)
    }

    #[test]
    fn the_hash_is_a_fixed_function() {
        // Computed from the published definition in another language.
        assert_eq!(hash([0, 0, 0, 0]), [0x0f02f829, 0x2d568769, 0x32b0c43b, 0xd32548ea]);
        assert_eq!(hash([1, 2, 3, 4]), [0x3622cd16, 0xf11471d8, 0xe1109b3f, 0x02b94c2f]);
    }

    /// The largest |Z| of `tests` two-sided standard normal statistics exceeds this with probability
    /// 10⁻⁶·tests at most.
    const Z_MILLIONTH: f64 = 4.9;

    #[test]
    fn neighbouring_counters_give_independent_uniform_numbers() {
        // Means and lag correlations along each argument, which would reveal a weak hash.
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
