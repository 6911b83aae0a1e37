//! A path's numbers one after the other, for sequential code.

use super::independent::pcg4d;
use crate::math::lanes::scalar::Wrapping;
use std::convert::Infallible;

/// An endless stream of bits that is a function of (seed, pixel, sample), for `rand`'s distributions.
///
/// It draws from blocks counted down from the top, so that it shares no number with the [`Sampler`](super::Sampler) of
/// the same path. Code of lanes uses an [`EndlessStream`](super::EndlessStream).
#[derive(Clone, Debug)]
pub struct Stream {
    key: [u32; 3],
    block: u32,
    words: [u32; 4],
    used: usize,
}

impl Stream {
    /// The stream of one path.
    pub fn new(seed: u32, pixel: u32, sample: u32) -> Stream {
        Stream { key: [pixel, sample, seed], block: u32::MAX, words: [0; 4], used: 4 }
    }

    fn next_word(&mut self) -> u32 {
        if self.used == 4 {
            let [pixel, sample, seed] = self.key;
            self.words = pcg4d::<f32>([pixel, sample, self.block, seed].map(Wrapping)).map(|w| w.0);
            self.block = self.block.wrapping_sub(1);
            self.used = 0;
        }
        self.used += 1;
        self.words[self.used - 1]
    }
}

impl rand::TryRng for Stream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next_word())
    }
    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(u64::from(self.next_word()) | u64::from(self.next_word()) << 32)
    }
    fn try_fill_bytes(&mut self, into: &mut [u8]) -> Result<(), Infallible> {
        for chunk in into.chunks_mut(4) {
            chunk.copy_from_slice(&self.next_word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, RngExt};

    #[test]
    fn a_stream_is_a_function_of_its_key() {
        let draw = |seed, pixel, sample| Stream::new(seed, pixel, sample).next_u64();
        assert_eq!(draw(1, 2, 3), draw(1, 2, 3));
        assert_ne!(draw(1, 2, 3), draw(2, 2, 3));
        assert_ne!(draw(1, 2, 3), draw(1, 3, 3));
        assert_ne!(draw(1, 2, 3), draw(1, 2, 4));
    }

    #[test]
    fn rand_distributions_accept_it() {
        let mut stream = Stream::new(0, 0, 0);
        let mean = (0..10_000).map(|_| stream.random::<f64>()).sum::<f64>() / 10_000.0;
        // Five standard errors of a uniform mean.
        assert!((mean - 0.5).abs() < 5.0 / (12.0_f64 * 10_000.0).sqrt(), "mean {mean}");
    }
}
