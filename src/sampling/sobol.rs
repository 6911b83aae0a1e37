//! Numbers that are stratified over the samples of a pixel: scrambled Sobol points.
//!
//! Each pair of a block uses the first two dimensions of Sobol's sequence (Sobol' 1967), a (0, 2)-sequence in base 2.
//! Of 2ᵏ samples that start at a multiple of 2ᵏ, exactly one lies in each of the 2ᵃ × 2ᵏ⁻ᵃ equal rectangles of the unit
//! square, for every a. Nested uniform scrambling (Owen 1995) preserves that, makes every number uniform, and lets the
//! error of a smooth integrand fall as n^−³ᐟ².
//!
//! Pairs are padded (Kollig and Keller 2002): each has its own scrambles and its own order, hashed from (seed, pixel,
//! block, pair). Different pairs are therefore independent of each other, as are pixels. Scrambling uses a hash instead
//! of a stored tree as in Burley (2020, "Practical Hash-based Owen Scrambling") after Laine and Karras (2011,
//! "Stratified Sampling for Stochastic Transparency"); the hash is Vegdahl's (2021, "Building a Better LK Hash").

use super::block::PathId;
use super::independent::pcg4d;
use crate::math::{Float, Uint, function};

/// Owen-scrambled Sobol points, padded in pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sobol {
    /// The seed.
    pub seed: u32,
}

impl Sobol {
    /// The four numbers of a block.
    #[inline(always)]
    pub fn draw<F: Float>(&self, path: PathId<F>, block: F::Uint) -> [F; 4] {
        let [a, b, c, d] = pcg4d::<F>([path.pixel, F::Uint::splat(SALT), block, F::Uint::given(&self.seed)]);
        let mirrored = path.sample.reverse_bits();
        let [u, v] = scrambled_pair::<F>(mirrored, a, b);
        let [w, z] = scrambled_pair::<F>(mirrored, c, d);
        [u.to_unit(), v.to_unit(), w.to_unit(), z.to_unit()]
    }
}

/// Takes the place of [`Independent`](super::Independent)'s hash of the sample's index.
pub const SALT: u32 = 0x736f_626f;

/// A pair of the sample with this bit-reversed index, in an order and with scrambles of these two keys.
#[inline(always)]
fn scrambled_pair<F: Float>(mirrored: F::Uint, order: F::Uint, key: F::Uint) -> [F::Uint; 2] {
    function!(F, scrambled_pair(mirrored, order, key), {
        // Scrambling the bit-reversed index permutes the samples within every aligned run of 2ᵏ, which preserves the
        // runs.
        let index = scramble::<F>(mirrored, order).reverse_bits();
        // Three keys that are pairwise independent.
        [
            scramble::<F>(index, key).reverse_bits(),
            scramble::<F>(second_dimension::<F>(index), order + key).reverse_bits(),
        ]
    })
}

/// Nested uniform scrambling of the bit-reversed number: whether a bit is flipped is a hash of the key and of the bits
/// below it.
#[inline(always)]
fn scramble<F: Float>(mirrored: F::Uint, key: F::Uint) -> F::Uint {
    function!(F, scramble(mirrored, key), {
        // Sums, products with odd numbers and x ^ (x · even) only carry upwards, so that each is such a scrambling.
        let x = mirrored ^ (mirrored * F::Uint::splat(0x3d20_adea));
        let x = x + key;
        let x = x * (key.shr::<16>() | F::Uint::splat(1));
        let x = x ^ (x * F::Uint::splat(0x0552_6c56));
        x ^ (x * F::Uint::splat(0x53a2_2864))
    })
}

/// The second dimension of Sobol's sequence, bit-reversed: the index times Pascal's triangle mod 2. (The first,
/// bit-reversed, is the index itself: van der Corput's sequence.)
///
/// Bit j is the sum of those bits k of the index for which C(k, j) is odd: by Lucas's theorem, those for which k has
/// all the binary digits of j. Such a sum over supersets is computed digit by digit, in five steps instead of
/// thirty-two (as in Ahmed 2024, "An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant, and Compact").
#[inline(always)]
fn second_dimension<F: Float>(index: F::Uint) -> F::Uint {
    function!(F, second_dimension(index), {
        let x = index ^ (index.shr::<1>() & F::Uint::splat(0x5555_5555));
        let x = x ^ (x.shr::<2>() & F::Uint::splat(0x3333_3333));
        let x = x ^ (x.shr::<4>() & F::Uint::splat(0x0f0f_0f0f));
        let x = x ^ (x.shr::<8>() & F::Uint::splat(0x00ff_00ff));
        x ^ x.shr::<16>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;
    use crate::sampling::{Blocks, Independent, Sampler};

    fn draw(sampler: impl Into<Sampler>, pixel: u32, block: u32, sample: u32) -> [f32; 4] {
        sampler
            .into()
            .draw(PathId::<f32> { pixel: Wrapping(pixel), sample: Wrapping(sample) }, Wrapping(block))
    }

    /// Whether each of the 2ᵃ × 2ᵏ⁻ᵃ rectangles contains one of these 2ᵏ points, for every a.
    fn is_stratified(points: &[[f32; 2]]) -> bool {
        let k = points.len().ilog2();
        (0..=k).all(|a| {
            let (columns, rows) = (1_usize << a, 1_usize << (k - a));
            let mut seen = vec![false; points.len()];
            points.iter().all(|&[u, v]| {
                let (column, row) = ((u * columns as f32) as usize, (v * rows as f32) as usize);
                !std::mem::replace(&mut seen[row * columns + column], true)
            })
        })
    }

    /// Whether every aligned run of up to 2¹² samples of a sequence is stratified, near these samples.
    fn runs_are_stratified(points: impl Fn(u32) -> [f32; 2]) -> bool {
        [0, 1 << 12, 5 << 12, 0xffff_f000].into_iter().all(|first| {
            let points: Vec<_> = (0..1 << 12).map(|i| points(first + i)).collect();
            (0..=12).all(|k| points.chunks(1 << k).all(is_stratified))
        })
    }

    #[test]
    fn every_pair_of_every_aligned_run_is_stratified() {
        for (seed, pixel, block) in [
            (0, 0, 0),
            (0, 0, 1),
            (0, 1, 0),
            (7, 640 * 480 - 1, 2),
            (u32::MAX, 77_777, 9),
            (1, u32::MAX, 20_000),
        ] {
            let sampler = Sobol { seed };
            for pair in 0..2 {
                let point = |sample| {
                    let numbers = draw(sampler, pixel, block, sample);
                    [numbers[2 * pair], numbers[2 * pair + 1]]
                };
                assert!(runs_are_stratified(point), "seed {seed} pixel {pixel} block {block} pair {pair}");
            }
        }
        // Negative controls: unstratified numbers; two numbers from different pairs; a pair whose dimensions differ
        // only by scrambling; and a pair whose matrix lacks one entry.
        assert!(!runs_are_stratified(|i| {
            let [u, v, ..] = draw(Independent { seed: 0 }, 0, 0, i);
            [u, v]
        }));
        assert!(!runs_are_stratified(|i| {
            let [_, v, w, _] = draw(Sobol { seed: 0 }, 0, 0, i);
            [v, w]
        }));
        let unit = |x: u32, key| scramble::<f32>(Wrapping(x), Wrapping(key)).reverse_bits().to_unit();
        assert!(runs_are_stratified(|i| [unit(i, 5), unit(second_dimension::<f32>(Wrapping(i)).0, 9)]));
        assert!(!runs_are_stratified(|i| [unit(i, 5), unit(i, 9)]));
        assert!(!runs_are_stratified(|i| {
            [unit(i, 5), unit(second_dimension::<f32>(Wrapping(i)).0 ^ (i >> 7 & 1) << 5, 9)]
        }));
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        // The direction numbers of the primitive polynomial x + 1: v₁ = 1, vₖ = vₖ₋₁ ⊕ vₖ₋₁/2.
        let mut directions = vec![0x8000_0000_u32];
        for k in 1..32 {
            directions.push(directions[k - 1] ^ directions[k - 1] >> 1);
        }
        for i in 0..100_000_u32 {
            let index = i.wrapping_mul(0x9e37_79b9);
            let bits = (0..32).filter(|bit| index >> bit & 1 != 0);
            let expected = bits.fold(0, |sum, bit| sum ^ directions[bit]);
            assert_eq!(second_dimension::<f32>(Wrapping(index)).reverse_bits().0, expected);
        }
    }

    #[test]
    fn numbers_are_below_one_and_the_first_are_distinct() {
        let sampler = Sobol { seed: 3 };
        for dimension in 0..4 {
            let mut all: Vec<f32> = (0..1 << 16).map(|i| draw(sampler, 5, 2, i)[dimension]).collect();
            assert!(all.iter().all(|u| (0.0..1.0).contains(u)));
            all.sort_unstable_by(f32::total_cmp);
            assert!(all.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    /// A standard normal variable exceeds this in magnitude with probability 10⁻⁶.
    const Z_MILLIONTH: f64 = 4.9;

    type Function = fn(f32) -> f64;

    /// The correlation of two dimensions: the sum over a pixel's first 16 samples of f(u)·f(v), over 20,000 pixels.
    /// Returns the difference of its mean from zero and of its mean square from `square`, in standard errors.
    fn correlation(pair: impl Fn(u32, u32) -> [f32; 2], f: Function, square: f64) -> [f64; 2] {
        let n = 20_000;
        let (mut sum, mut squares, mut fourths) = (0.0, 0.0, 0.0);
        for place in 0..n {
            let common: f64 = (0..16).map(|sample| pair(place, sample).map(f)).map(|[a, b]| a * b).sum();
            sum += common;
            squares += common.powi(2);
            fourths += common.powi(4);
        }
        let n = f64::from(n);
        let error = ((fourths / n - (squares / n).powi(2)) / n).sqrt();
        // A difference without any variance counts as infinitely many standard errors.
        [sum / squares.sqrt(), (squares / n - square) / error]
    }

    /// −1 in the lower half of every 2ᵏ-th part of the unit interval, 1 in the upper (Rademacher's functions).
    fn sign<const K: u32>(u: f32) -> f64 {
        if ((u * (2 << K) as f32) as u32).is_multiple_of(2) { -1.0 } else { 1.0 }
    }

    // Each of 135 statistics is beyond the bound with probability 10⁻⁶: a correct sampler fails with probability
    // 1.4·10⁻⁴.
    #[test]
    fn pairs_blocks_pixels_and_seeds_are_uncorrelated() {
        let sampler = Sobol { seed: 11 };
        let check = |what: &str, pair: &dyn Fn(u32, u32) -> [f32; 2]| {
            let line: Function = |u| f64::from(u) - 0.5;
            let functions: [(&str, Function); 4] =
                [("halves", sign::<0>), ("quarters", sign::<1>), ("eighths", sign::<2>), ("line", line)];
            for (name, f) in functions {
                let [z, _] = correlation(pair, f, 0.0);
                assert!(z.abs() < Z_MILLIONTH, "{what}, {name}: {z} σ");
            }
            // Samples 2i and 2i + 1 lie in different halves of both dimensions and have the same product. In
            // independent orders, the eight products of a pixel are independent signs: twice their sum has the mean
            // square 4·8.
            let [_, z] = correlation(pair, sign::<0>, 32.0);
            assert!(z.abs() < Z_MILLIONTH, "{what}, squares: {z} σ");
        };
        for (i, j) in [(0, 2), (0, 3), (1, 2), (1, 3)] {
            check("the pairs of a block", &|pixel, sample| {
                let numbers = draw(sampler, pixel, 1, sample);
                [numbers[i], numbers[j]]
            });
        }
        for (i, j) in [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (2, 3)] {
            let both = |a: [f32; 4], b: [f32; 4]| [a[i], b[j]];
            check("neighbouring blocks", &|pixel, sample| {
                both(draw(sampler, pixel, 1, sample), draw(sampler, pixel, 2, sample))
            });
            check("neighbouring pixels", &|place, sample| {
                both(draw(sampler, 2 * place, 1, sample), draw(sampler, 2 * place + 1, 1, sample))
            });
            check("neighbouring seeds", &|pixel, sample| {
                both(draw(Sobol { seed: 0 }, pixel, 1, sample), draw(Sobol { seed: 1 }, pixel, 1, sample))
            });
        }
        // Negative controls: pairs in the same order are correlated; a pair and itself are equal.
        let in_step = |place: u32, sample: u32| {
            let [a, b, ..] = pcg4d::<f32>([place, 0, 0, 0].map(Wrapping));
            [a, b].map(|key| scramble::<f32>(Wrapping(sample), key).reverse_bits().to_unit())
        };
        assert!(correlation(in_step, sign::<0>, 32.0)[1].abs() > 2.0 * Z_MILLIONTH);
        let same = |pixel, sample| [draw(sampler, pixel, 1, sample)[0]; 2];
        assert!(correlation(same, sign::<1>, 0.0)[0].abs() > 2.0 * Z_MILLIONTH);
    }

    #[test]
    fn each_number_is_uniform_over_pixels() {
        // One sample of many pixels: a χ² test in 64 bins; the bound is the 1 − 10⁻⁶ quantile of χ² with 63
        // degrees of freedom.
        for sample in [0, 1, 2, 1000, u32::MAX] {
            for dimension in 0..4 {
                let mut bins = [0_u32; 64];
                for pixel in 0..64_000 {
                    let u =
                        draw(Sobol { seed: 2 }, pixel, Blocks::new(2, 0).once(1).number::<f32>().0, sample)
                            [dimension];
                    bins[(u * 64.0) as usize] += 1;
                }
                let chi2: f64 = bins.iter().map(|&n| (f64::from(n) - 1000.0).powi(2) / 1000.0).sum();
                assert!(chi2 < 128.6, "sample {sample} dimension {dimension}: χ² {chi2}");
            }
        }
    }

    /// The slope, over 16 to 4096 samples, of the RMS error of the integral of a smooth function over many pixels.
    fn slope(sampler: impl Into<Sampler>) -> f64 {
        let sampler = sampler.into();
        let f = |u: f64, v: f64| (u * 2.0 + v).exp();
        let truth = (2.0_f64.exp() - 1.0) / 2.0 * (1.0_f64.exp() - 1.0);
        let error = |n: u32| -> f64 {
            let squares = (0..64).map(|pixel| {
                let sum: f64 =
                    (0..n).map(|i| draw(sampler, pixel, 0, i)).map(|[u, v, ..]| f(u.into(), v.into())).sum();
                (sum / f64::from(n) - truth).powi(2)
            });
            f64::sqrt(squares.sum::<f64>() / 64.0)
        };
        (error(4096) / error(16)).log2() / 8.0
    }

    #[test]
    fn the_error_of_a_smooth_integral_falls_faster_than_that_of_independent_numbers() {
        // The theoretical slopes are −3/2, up to a logarithm, and −1/2. The RMS over 64 pixels is known to 9%, and
        // ratios to 17%, or 0.03 of slope, of which a little over a tenth is three standard errors.
        let (even, uneven) = (slope(Sobol { seed: 0 }), slope(Independent { seed: 0 }));
        println!("slopes {even:.3} and {uneven:.3}");
        assert!(even < -1.2, "{even}");
        assert!((uneven + 0.5).abs() < 0.12, "{uneven}");
    }
}
