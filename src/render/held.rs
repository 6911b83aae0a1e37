//! The samples that pixels have from an earlier run, and the number that each is to reach.

use super::schedule::Order;
use super::stride::Region;
use crate::film::{Film, Plan};
use std::ops::Range;
use std::sync::Arc;

/// The samples that each pixel of a region lacks, where they differ: in a film that was left in the middle of an
/// order, or where not all pixels go as far.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// The first one, for each place.
    lacks: Vec<u32>,
    most: u32,
    /// One past the last one, where not all go as far as their orders.
    ends: Option<Arc<Plan>>,
}

impl Held {
    /// What a film's pixels have of samples from `first` on, each of them its first ones; none where all
    /// have the same number.
    pub fn of(film: &Film, region: Region, first: u32) -> Option<Held> {
        let [least, most] = film.seen_range();
        let lacks = |seen: u64| first.saturating_add(u32::try_from(seen).unwrap_or(u32::MAX));
        (least < most).then(|| Held {
            lacks: (0..region.len() as usize).map(|place| lacks(film.seen(place))).collect(),
            most: lacks(most),
            ends: None,
        })
    }

    /// What a film's pixels have of samples from 0 on, of which a plan says how far each goes.
    pub fn planned(film: &Film, region: Region, plan: Arc<Plan>) -> Held {
        let lacks = |place| u32::try_from(film.seen(place)).unwrap_or(u32::MAX);
        let most = u32::try_from(film.seen_range()[1]).unwrap_or(u32::MAX);
        Held { lacks: (0..region.len() as usize).map(lacks).collect(), most, ends: Some(plan) }
    }

    /// What is left of an order for the pixel at a place.
    pub fn rest(&self, place: u32, order: Order) -> Range<u32> {
        let first = self.lacks[place as usize].clamp(order.first, order.end);
        let end = self.ends.as_ref().map_or(order.end, |plan| order.end.min(plan.ends()[place as usize]));
        first..end.max(first)
    }

    /// The first of some slots of an order, as many as lack the same samples or none, and these samples. Those that
    /// lack some make no more than `paths` paths, unless one alone does.
    pub fn block(&self, order: Order, slots: Range<u32>, paths: usize) -> (Range<u32>, Range<u32>) {
        let (mut samples, mut pixels) = (0..0, 0);
        for slot in slots.clone() {
            let rest = self.rest(order.stride.place(slot), order);
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

    /// An order over the first slots of its stride as runs: slots, one after the other, that lack the same.
    pub fn runs(&self, order: Order, slots: u32) -> Vec<(Range<u32>, Range<u32>)> {
        let mut runs: Vec<(Range<u32>, Range<u32>)> = Vec::new();
        for slot in 0..slots {
            let rest = self.rest(order.stride.place(slot), order);
            match runs.last_mut() {
                Some((run, samples)) if *samples == rest => run.end = slot + 1,
                _ => runs.push((slot..slot + 1, rest)),
            }
        }
        runs
    }

    /// Whether an order's samples are new to all pixels.
    pub fn is_behind(&self, order: Order) -> bool {
        self.most <= order.first && self.ends.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Stride;

    #[test]
    fn an_order_is_cut_down_to_what_a_pixel_lacks() {
        let region = Region::whole(3, 1);
        let mut film = Film::new(3, 1).unwrap();
        assert_eq!(Held::of(&film, region, 10), None);
        for (pixel, samples) in [(0, 2), (1, 7), (2, 4)] {
            (0..samples).for_each(|_| film.add_sample(pixel, [1.0; 3]).unwrap());
        }
        // One that was left out was made all the same.
        film.add_sample(2, [-1.0; 3]).unwrap_err();
        let held = Held::of(&film, region, 10).unwrap();
        let rest =
            |first, end| [0, 1, 2].map(|place| held.rest(place, Order { stride: Stride::ALL, first, end }));
        assert_eq!(rest(12, 15), [12..15, 15..15, 15..15]);
        assert_eq!(rest(14, 20), [14..20, 17..20, 15..20]);
        assert_eq!(rest(17, 18), [17..18, 17..18, 17..18]);
        let runs = held.runs(Order { stride: Stride::ALL, first: 12, end: 15 }, 3);
        assert_eq!(runs, [(0..1, 12..15), (1..3, 15..15)]);
        let all = Order { stride: Stride::ALL, first: 12, end: 18 };
        assert_eq!(held.block(all, 0..3, 100), (0..1, 12..18));
        assert_eq!(held.block(all, 1..3, 100), (1..2, 17..18));
        // Who lacks nothing is passed by, and a block has as many paths as it may.
        let none = Order { end: 13, ..all };
        assert_eq!(held.block(none, 0..3, 100), (0..3, 12..13));
        assert_eq!(held.block(none, 1..3, 100), (1..3, 0..0));
        let behind = Order { first: 20, end: 30, ..all };
        assert_eq!(held.block(behind, 0..3, 20), (0..2, 20..30));
        assert_eq!(held.block(behind, 0..3, 5), (0..1, 20..30));
        let every_other = Order { stride: Stride::ALL.split(0, 2), first: 16, end: 18 };
        assert_eq!(held.runs(every_other, 2), [(0..2, 16..18)]);
        assert!(
            held.is_behind(Order { stride: Stride::ALL, first: 17, end: 18 })
                && !held.is_behind(Order { stride: Stride::ALL, first: 16, end: 18 })
        );
    }
}
