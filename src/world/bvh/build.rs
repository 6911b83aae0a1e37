//! From boxes to a binary tree: the surface area heuristic over bins (Wald 2007, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies").

use crate::math::Bounds;

/// The most things in a leaf, which a ray tests all at once.
pub(super) const LEAF: usize = 8;

/// Bins along an axis.
const BINS: usize = 16;

/// What asking a leaf costs over what passing a split costs. A split is a seventh of a node with eight
/// children, but a node's children are rarely all of use.
const LEAF_COST: f64 = 2.0;

/// Splits above a leaf that the heuristic may choose; below, ranges are halved, so that no tree is deeper than
/// this and the logarithm of its things.
const CHOSEN_DEPTH: u32 = 40;

/// The deepest that a tree can be: things are numbered in 32 bits.
pub(super) const MAX_DEPTH: usize = CHOSEN_DEPTH as usize + 32;

/// A thing to sort into a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    /// Only things of one kind share a leaf.
    pub(super) kind: u32,
    /// Index among the things of its kind.
    pub(super) index: u32,
}

impl Item {
    /// Twice the middle.
    #[inline]
    fn middle(&self, axis: usize) -> f32 {
        self.bounds.low[axis] + self.bounds.high[axis]
    }
}

/// A node of the binary tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub(super) bounds: Bounds,
    pub(super) below: Below,
}

/// What a node holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Below {
    /// Two nodes, of which the first follows.
    Two { second: u32 },
    /// Some of the things, as sorted.
    Leaf { first: u32, count: u32 },
}

/// Sorts the things and returns the tree over them, its root first. The same things in the same order give
/// the same tree. There is at least one thing, and all have finite bounds.
///
/// Up to so many threads work at it, which does not show in the tree.
pub(super) fn build(items: &mut [Item], threads: usize) -> Vec<Split> {
    let mut splits = Vec::new();
    grow(items, 0, 0, &mut splits, threads);
    splits
}

/// The fewest things that are worth a thread.
const THREAD_PAYS_FROM: usize = 1 << 13;

fn grow(items: &mut [Item], first: u32, depth: u32, splits: &mut Vec<Split>, threads: usize) {
    let bounds = items.iter().fold(Bounds::NOTHING, |bounds, item| bounds.with(&item.bounds));
    let at = splits.len();
    let count = items.len() as u32;
    splits.push(Split { bounds, below: Below::Leaf { first, count } });
    let Some(middle) = divide(items, &bounds, depth) else { return };
    let (low, high) = items.split_at_mut(middle);
    let second = first + middle as u32;
    if threads < 2 || low.len().min(high.len()) < THREAD_PAYS_FROM {
        grow(low, first, depth + 1, splits, threads);
        splits[at].below = Below::Two { second: splits.len() as u32 };
        grow(high, second, depth + 1, splits, threads);
        return;
    }
    // As many for each side as it has things.
    let share = low.len() as f64 / (low.len() + high.len()) as f64;
    let for_low = ((threads as f64 * share).round() as usize).clamp(1, threads - 1);
    let above = std::thread::scope(|scope| {
        let work = scope.spawn(|| {
            let mut above = Vec::new();
            grow(high, second, depth + 1, &mut above, threads - for_low);
            above
        });
        grow(low, first, depth + 1, splits, for_low);
        work.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    let base = splits.len() as u32;
    splits[at].below = Below::Two { second: base };
    splits.extend(above.into_iter().map(|split| Split {
        below: match split.below {
            Below::Two { second } => Below::Two { second: base + second },
            leaf => leaf,
        },
        ..split
    }));
}

/// How many rounds it takes to test so many things.
fn rounds(count: usize) -> f64 {
    count.div_ceil(LEAF) as f64
}

/// Sorts things into two sides and returns where the second begins; `None` if they are a leaf.
fn divide(items: &mut [Item], bounds: &Bounds, depth: u32) -> Option<usize> {
    let may_be_leaf = items.len() <= LEAF && items.iter().all(|item| item.kind == items[0].kind);
    if items.len() == 1 {
        return None;
    }
    let area = bounds.half_area();
    let best = if depth < CHOSEN_DEPTH { cheapest(items) } else { None };
    if may_be_leaf {
        let worth_it = best.is_some_and(|best| area + LEAF_COST * best.cost < LEAF_COST * area);
        if !worth_it {
            return None;
        }
    }
    let Some(best) = best else {
        // All in one place, or too deep: kinds part first, so that leaves can be.
        items.sort_unstable_by_key(|item| (item.kind, item.index));
        let border = items.partition_point(|item| item.kind == items[0].kind);
        return Some(if border < items.len() { border } else { items.len() / 2 });
    };
    let middle = partition(items, |item| best.axis.bin(item) < best.bin);
    debug_assert!(middle > 0 && middle < items.len());
    Some(middle)
}

/// Moves the things that belong to the low side to the front.
fn partition(items: &mut [Item], is_low: impl Fn(&Item) -> bool) -> usize {
    let (mut low, mut high) = (0, items.len());
    while low < high {
        if is_low(&items[low]) {
            low += 1;
        } else {
            high -= 1;
            items.swap(low, high);
        }
    }
    low
}

/// An axis cut into bins of one width.
#[derive(Clone, Copy, Debug)]
struct Axis {
    axis: usize,
    from: f32,
    per_unit: f32,
}

impl Axis {
    #[inline]
    fn bin(&self, item: &Item) -> usize {
        (((item.middle(self.axis) - self.from) * self.per_unit) as usize).min(BINS - 1)
    }
}

/// A way to divide.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    axis: Axis,
    /// Bins below this one are the low side.
    bin: usize,
    /// Half areas times rounds, both sides.
    cost: f64,
}

/// The division between bins that costs least; `None` if all the things have one middle.
fn cheapest(items: &[Item]) -> Option<Candidate> {
    let mut from = [f32::INFINITY; 3];
    let mut to = [f32::NEG_INFINITY; 3];
    for item in items {
        for axis in 0..3 {
            from[axis] = from[axis].min(item.middle(axis));
            to[axis] = to[axis].max(item.middle(axis));
        }
    }
    let mut best: Option<Candidate> = None;
    for axis in 0..3 {
        let per_unit = BINS as f32 / (to[axis] - from[axis]);
        // So thin that its inverse is not finite is as good as flat.
        if !(to[axis] > from[axis] && per_unit.is_finite()) {
            continue;
        }
        let axis = Axis { axis, from: from[axis], per_unit };
        let mut bins = [(Bounds::NOTHING, 0_usize); BINS];
        for item in items {
            let (bounds, count) = &mut bins[axis.bin(item)];
            *bounds = bounds.with(&item.bounds);
            *count += 1;
        }
        // What the high sides cost, from above.
        let mut high_cost = [f64::INFINITY; BINS];
        let (mut bounds, mut count) = (Bounds::NOTHING, 0);
        for bin in (1..BINS).rev() {
            bounds = bounds.with(&bins[bin].0);
            count += bins[bin].1;
            if count > 0 {
                high_cost[bin] = bounds.half_area() * rounds(count);
            }
        }
        let (mut bounds, mut count) = (Bounds::NOTHING, 0);
        for bin in 1..BINS {
            bounds = bounds.with(&bins[bin - 1].0);
            count += bins[bin - 1].1;
            let cost = bounds.half_area() * rounds(count) + high_cost[bin];
            let is_best = best.is_none_or(|best| cost < best.cost);
            if count > 0 && cost.is_finite() && is_best {
                best = Some(Candidate { axis, bin, cost });
            }
        }
    }
    best
}
