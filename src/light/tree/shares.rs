//! Lights in the order of their tree, each with whole units of power, and the search for the light with a given unit.

use crate::math::{LaneFloat, LaneMask, Uint};

/// Lights and the units of each. The bucket of a unit gives the range of lights to search; few buckets contain more
/// than two.
#[derive(Clone, Debug, Default)]
pub(super) struct Shares {
    /// The lights, in the order of the tree's leaves.
    lights: Vec<u32>,
    /// The first unit of each light, followed by the number of units.
    first: Vec<u32>,
    /// For each bucket, the last light that begins at or before the start of the bucket; followed by the last light.
    guide: Vec<u32>,
    /// The number of buckets per 2⁸ units.
    buckets: f32,
}

/// Buckets have at least 2 to this power units, so that f32 can distinguish all buckets.
const LEAST_BITS: u32 = 8;

impl Shares {
    /// The number of lights.
    pub(super) fn len(&self) -> usize {
        self.lights.len()
    }

    /// Adds a light and returns its first unit.
    pub(super) fn push(&mut self, light: u32, units: u32) -> u32 {
        if self.first.is_empty() {
            self.first.push(0);
        }
        let first = self.first[self.lights.len()];
        self.lights.push(light);
        self.first.push(first + units);
        first
    }

    /// Distributes the units to about two buckets per light, once all lights have been added.
    pub(super) fn sort(&mut self) {
        let (Some(&units), lights) = (self.first.last(), self.lights.len()) else { return };
        let mut bits = LEAST_BITS;
        while (units >> bits) as usize > 2 * lights {
            bits += 1;
        }
        let mut last = 0;
        self.guide = (0..=units >> bits)
            .map(|bucket| {
                while last + 1 < lights && self.first[last + 1] <= bucket << bits {
                    last += 1;
                }
                last as u32
            })
            .chain([lights as u32 - 1])
            .collect();
        self.buckets = 1.0 / (1_u32 << (bits - LEAST_BITS)) as f32;
    }

    /// The light that has a unit, and its number of units. Lanes outside the mask are unspecified.
    #[inline(always)]
    pub(super) fn find<F: LaneFloat>(&self, unit: F::Uint, active: F::Mask) -> (F::Uint, F::Uint) {
        let (one, all_bits) = (F::Uint::splat(1), F::Uint::splat(u32::MAX));
        let bucket = (unit.shr::<LEAST_BITS>().to_float() * self.buckets).to_uint();
        let mut low = F::Uint::gather(&self.guide, bucket);
        let mut high = F::Uint::gather(&self.guide, bucket + one);
        // The last light that begins at or before the unit.
        loop {
            let open = active & low.lt(high);
            if !open.any() {
                break;
            }
            let middle = (low + high + one).shr::<1>();
            let begins_behind = unit.lt(F::Uint::gather(&self.first, middle));
            low = F::Uint::select(open & !begins_behind, middle, low);
            high = F::Uint::select(open & begins_behind, middle + all_bits, high);
        }
        let (first, next) = (F::Uint::gather(&self.first, low), F::Uint::gather(&self.first, low + one));
        // Adding the bits of !x subtracts x + 1.
        (F::Uint::gather(&self.lights, low), next + (first ^ all_bits) + one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    #[test]
    fn every_unit_belongs_to_its_light() {
        let even = vec![1000; 144];
        let steep: Vec<u32> = (0..20).map(|i| 1 << i).collect();
        let mut sparse = vec![0; 300];
        (sparse[7], sparse[8], sparse[250]) = (1, 70_000, 3);
        let crowded: Vec<u32> = [vec![1; 5000], vec![3_000_000], vec![1; 5000]].concat();
        let huge = vec![1 << 20; 40];
        for units in [even, steep, sparse, crowded, huge, vec![5], vec![0]] {
            let mut shares = Shares::default();
            for (light, &units) in units.iter().enumerate() {
                shares.push(light as u32 + 100, units);
            }
            shares.sort();
            let mut first = 0;
            for (light, &units) in units.iter().enumerate().filter(|(_, units)| **units > 0) {
                for unit in [first, first + units / 3, first + units - 1] {
                    let found = shares.find::<f32>(Wrapping(unit), true);
                    assert_eq!((found.0.0, found.1.0), (light as u32 + 100, units), "unit {unit}");
                }
                first += units;
            }
        }
    }
}
