//! Endless streams of random numbers, in each lane.

use super::block::PathId;
use super::independent::pcg4d;
use crate::math::{Float, Uint, value};

/// An endless stream of independent numbers for a decision that needs an unknown count of them, as a chain or a free
/// flight through a medium does. It is a function of (seed, pixel, sample, block): a path draws the same numbers in
/// whichever lane it is, and whatever the other lanes draw. Its period is 2³⁴ numbers.
///
/// Draw n is the hash of a key and n. The key consists of four words, a hash of the arguments of the stream.
#[derive(Clone, Copy, Debug)]
pub struct EndlessStream<F: Float> {
    /// The key, with the number of draws added to its last word.
    words: [F::Uint; 4],
}

value!(EndlessStream { words });

impl<F: Float> EndlessStream<F> {
    /// The stream of a block: see [`Sampler::endless`](super::Sampler::endless).
    #[inline(always)]
    pub(super) fn new(seed: F::Uint, path: PathId<F>, block: F::Uint) -> EndlessStream<F> {
        EndlessStream { words: pcg4d::<F>([path.pixel, path.sample, block, seed]) }
    }

    /// The next four numbers in [0, 1), for the lanes of a mask; in others nothing is drawn.
    #[inline(always)]
    pub fn draw(&mut self, lanes: F::Mask) -> [F; 4] {
        let [x, y, z, w] = pcg4d::<F>(self.words);
        let [.., count] = &mut self.words;
        *count = F::Uint::select(lanes, *count + F::Uint::splat(1), *count);
        [x.to_unit(), y.to_unit(), z.to_unit(), w.to_unit()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;
    use crate::sampling::{Independent, Sampler, Sobol};
    use std::collections::BTreeSet;

    fn stream(seed: u32, pixel: u32, sample: u32, block: u32) -> EndlessStream<f32> {
        let path = PathId::<f32> { pixel: Wrapping(pixel), sample: Wrapping(sample) };
        Sampler::from(Independent { seed }).endless(path, Wrapping(block))
    }

    #[test]
    fn a_stream_is_a_function_of_seed_pixel_sample_and_block() {
        let draw = |[seed, pixel, sample, block]: [u32; 4]| stream(seed, pixel, sample, block).draw(true);
        let keys = [[1, 2, 3, 4], [2, 2, 3, 4], [1, 3, 3, 4], [1, 2, 4, 4], [1, 2, 3, 5]];
        let draws: BTreeSet<_> = keys.map(|key| draw(key).map(f32::to_bits)).into();
        assert_eq!(draws.len(), keys.len());
        assert_eq!(draw(keys[0]), draw(keys[0]));
        // It differs from the sampler's numbers, and is the same for all samplers.
        let path = PathId::<f32> { pixel: Wrapping(2), sample: Wrapping(3) };
        assert_ne!(draw(keys[0]), Independent { seed: 1 }.draw(path, Wrapping(4)));
        assert_eq!(draw(keys[0]), Sampler::from(Sobol { seed: 1 }).endless(path, Wrapping(4)).draw(true));
    }

    #[test]
    fn a_lane_that_does_not_draw_keeps_its_position() {
        let (mut one, mut other) = (stream(1, 2, 3, 4), stream(1, 2, 3, 4));
        let passed_by = one.draw(false);
        assert_eq!(passed_by, one.draw(true));
        other.draw(true);
        let next = one.draw(true);
        assert_ne!(next, passed_by);
        assert_eq!(next, other.draw(true));
    }

    /// A standard normal variable exceeds this in magnitude with probability 10⁻⁶.
    const Z_MILLIONTH: f64 = 4.9;

    // 16 means and correlations with the next draw, and 16 correlations between streams of neighbouring blocks.
    #[test]
    fn numbers_are_uniform_and_independent_along_a_stream_and_between_streams() {
        let n = 1 << 18;
        let (mut here, mut there) = (stream(7, 1, 2, 3), stream(7, 1, 2, 4));
        let draw = |stream: &mut EndlessStream<f32>| stream.draw(true).map(|u| f64::from(u) - 0.5);
        let mut last = draw(&mut here);
        let (mut sums, mut lagged, mut crossed) = ([0.0; 4], [[0.0; 4]; 4], [[0.0; 4]; 4]);
        for _ in 0..n {
            let (next, other) = (draw(&mut here), draw(&mut there));
            for i in 0..4 {
                sums[i] += next[i];
                for j in 0..4 {
                    lagged[i][j] += last[i] * next[j];
                    crossed[i][j] += next[i] * other[j];
                }
            }
            last = next;
        }
        let n = f64::from(n);
        for i in 0..4 {
            let mean = sums[i] / (n / 12.0).sqrt();
            assert!(mean.abs() < Z_MILLIONTH, "number {i}: the mean is off by {mean} σ");
            for j in 0..4 {
                let z = [lagged, crossed].map(|sums| sums[i][j] * 12.0 / n.sqrt());
                assert!(z.iter().all(|z| z.abs() < Z_MILLIONTH), "numbers {i} and {j}: {z:?} σ");
            }
        }
        // Negative control: a stream compared with itself.
        let (mut one, mut same) = (stream(7, 1, 2, 3), stream(7, 1, 2, 3));
        let common: f64 = (0..1 << 10).map(|_| draw(&mut one)[0] * draw(&mut same)[0]).sum();
        assert!(common * 12.0 / 32.0 > Z_MILLIONTH);
    }
}
