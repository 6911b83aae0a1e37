//! Strides: the division of pixels among workers (report §3.2, figure 3.1).

use serde::{Deserialize, Serialize};

/// Every Nth place of a region, {first, first + step, first + 2·step, …}; or every Nth run of consecutive places, for a
/// worker that is several times as fast as the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stride {
    /// The first place.
    pub first: u32,
    /// The distance between places, or between the starts of runs: at least one.
    pub step: u32,
    /// Places in a run, at most a step; one for a plain stride. With empty runs the stride is empty.
    pub run: u32,
}

impl Stride {
    /// All places.
    pub const ALL: Stride = Stride::every(1, 0);

    /// The places first, first + step, first + 2·step, …
    pub const fn every(step: u32, first: u32) -> Stride {
        Stride { first, step, run: 1 }
    }

    /// Part `i` of `m`, which is again a stride: the m parts contain each place exactly once. Runs are divided into m
    /// parts.
    pub fn split(self, i: u32, m: u32) -> Stride {
        if self.run == 1 {
            return Stride { first: self.first + i * self.step, step: self.step * m, run: 1 };
        }
        let cut = |i: u32| (u64::from(self.run) * u64::from(i) / u64::from(m)) as u32;
        Stride { first: self.first + cut(i), step: self.step, run: cut(i + 1) - cut(i) }
    }

    /// The number of a region's `len` places in the stride.
    pub fn len(self, len: u32) -> u32 {
        let reach = len.saturating_sub(self.first);
        reach / self.step * self.run + (reach % self.step).min(self.run)
    }

    /// The place of a slot.
    pub fn place(self, slot: u32) -> u32 {
        match self.run {
            1 => self.first + slot * self.step,
            run => self.first + slot / run * self.step + slot % run,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(stride: Stride, len: u32) -> Vec<u32> {
        (0..stride.len(len)).map(|slot| stride.place(slot)).collect()
    }

    #[test]
    fn parts_of_a_stride_contain_each_place_once() {
        for (len, n, m) in [(100, 1, 7), (100, 3, 4), (5, 8, 3), (1, 1, 1), (64, 16, 64)] {
            for s in 0..n {
                let stride = Stride::ALL.split(s, n);
                let mut parts: Vec<u32> = (0..m).flat_map(|i| places(stride.split(i, m), len)).collect();
                parts.sort_unstable();
                assert_eq!(parts, places(stride, len));
                assert!(parts.iter().all(|place| place % n == s));
            }
        }
    }

    #[test]
    fn runs_and_parts_of_them_contain_each_place_once() {
        for (len, step, cuts) in
            [(1000, 10, vec![0, 7, 10]), (1000, 17, vec![0, 1, 2, 17]), (5, 9, vec![0, 4, 9])]
        {
            let wide = cuts.windows(2).map(|cut| Stride { first: cut[0], step, run: cut[1] - cut[0] });
            for m in [1, 3, 8] {
                let parts = wide.clone().flat_map(|stride| (0..m).map(move |i| stride.split(i, m)));
                let mut all: Vec<u32> = parts.flat_map(|part| places(part, len)).collect();
                all.sort_unstable();
                assert_eq!(all, (0..len).collect::<Vec<_>>());
            }
        }
        assert_eq!(places(Stride { first: 2, step: 10, run: 3 }, 24), [2, 3, 4, 12, 13, 14, 22, 23]);
    }
}
