//! Assignments: orders without the samples that pixels already have.

use super::schedule::Order;
use crate::film::{AdaptivePlan, Film};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// An order and its remaining samples: all the information that a worker needs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Assignment {
    /// The order.
    pub order: Order,
    /// The remaining samples for each slot, if they differ from the order's: some pixels have more samples than others,
    /// or end earlier.
    pub rest: Option<Vec<Range<u32>>>,
}

impl From<Order> for Assignment {
    /// A complete order.
    fn from(order: Order) -> Assignment {
        Assignment { order, rest: None }
    }
}

impl Assignment {
    /// The samples of an order that a film lacks. Its pixels have their first samples, from the index `first` on. An
    /// adaptive plan limits the samples of each pixel, if there is one.
    pub fn of(order: Order, film: &Film, first: u32, plan: Option<&AdaptivePlan>) -> Assignment {
        let lacks = |slot: u32| {
            let place = order.stride.place(slot) as usize;
            let seen = u32::try_from(film.seen(place)).unwrap_or(u32::MAX);
            let lacks = first.saturating_add(seen).clamp(order.first, order.end);
            let end = plan.map_or(order.end, |plan| order.end.min(plan.ends()[place]));
            lacks..end.max(lacks)
        };
        let whole = order.first..order.end;
        let slots = order.stride.len(film.layout().len() as u32);
        let rest: Vec<Range<u32>> = (0..slots).map(lacks).collect();
        Assignment { order, rest: rest.iter().any(|rest| *rest != whole).then_some(rest) }
    }

    /// The remaining samples for a slot.
    pub fn rest(&self, slot: u32) -> Range<u32> {
        match &self.rest {
            Some(rest) => rest[slot as usize].clone(),
            None => self.order.first..self.order.end,
        }
    }

    /// The first of some slots with equal remaining samples, and these samples. If any remain, the block has at most
    /// `paths` paths, unless a single slot has more.
    pub fn block(&self, slots: Range<u32>, paths: usize) -> (Range<u32>, Range<u32>) {
        let (mut samples, mut pixels) = (0..0, 0);
        for slot in slots.clone() {
            let rest = self.rest(slot);
            if rest.is_empty() {
                continue;
            }
            let others = pixels > 0 && (rest != samples || (pixels + 1) * rest.len() > paths);
            if others {
                return (slots.start..slot, samples);
            }
            (samples, pixels) = (rest, pixels + 1);
        }
        (slots, samples)
    }

    /// The first slots in runs: consecutive slots with equal remaining samples.
    pub fn runs(&self, slots: u32) -> Vec<(Range<u32>, Range<u32>)> {
        let mut runs: Vec<(Range<u32>, Range<u32>)> = Vec::new();
        for slot in 0..slots {
            let rest = self.rest(slot);
            match runs.last_mut() {
                Some((run, samples)) if *samples == rest => run.end = slot + 1,
                _ => runs.push((slot..slot + 1, rest)),
            }
        }
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Stride;

    #[test]
    fn an_order_is_reduced_to_the_missing_samples() {
        let mut film = Film::new(3, 1).unwrap();
        let order = |first, end| Order { stride: Stride::ALL, first, end };
        assert_eq!(Assignment::of(order(10, 20), &film, 10, None), order(10, 20).into());
        for (pixel, samples) in [(0, 2), (1, 7), (2, 4)] {
            (0..samples).for_each(|_| film.add_sample(pixel, [1.0; 3]).unwrap());
        }
        // A rejected sample counts as made.
        film.add_sample(2, [-1.0; 3]).unwrap_err();
        let of = |order| Assignment::of(order, &film, 10, None);
        let rest = |first, end| [0, 1, 2].map(|slot| of(order(first, end)).rest(slot));
        assert_eq!(rest(12, 15), [12..15, 15..15, 15..15]);
        assert_eq!(rest(14, 20), [14..20, 17..20, 15..20]);
        assert_eq!(rest(17, 18), [17..18, 17..18, 17..18]);
        assert_eq!(of(order(12, 15)).runs(3), [(0..1, 12..15), (1..3, 15..15)]);
        let all = of(order(12, 18));
        assert_eq!(all.block(0..3, 100), (0..1, 12..18));
        assert_eq!(all.block(1..3, 100), (1..2, 17..18));
        // A slot without remaining samples is skipped, and a block has at most the allowed number of paths.
        let none = of(order(12, 13));
        assert_eq!(none.block(0..3, 100), (0..3, 12..13));
        assert_eq!(none.block(1..3, 100), (1..3, 0..0));
        let new = of(order(20, 30));
        assert_eq!(new, order(20, 30).into());
        assert_eq!(new.block(0..3, 20), (0..2, 20..30));
        assert_eq!(new.block(0..3, 5), (0..1, 20..30));
        let every_other = Order { stride: Stride::ALL.split(0, 2), first: 16, end: 18 };
        assert_eq!(of(every_other).runs(2), [(0..2, 16..18)]);
        assert!(of(order(16, 18)).rest.is_some() && of(order(17, 18)).rest.is_none());
    }
}
