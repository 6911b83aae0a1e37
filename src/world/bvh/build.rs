//! Builds a binary tree over boxes by the surface area heuristic with binning (Wald 2007, "On fast Construction of
//! SAH-based Bounding Volume Hierarchies").

use crate::math::Bounds;
use crate::world::pages;

/// The maximum number of items in a leaf. A ray is tested against all of them at once.
pub(super) const LEAF: usize = 8;

/// The maximum number of bins along an axis.
const BINS: usize = 16;

/// The number of bins for a number of primitives.
fn bins_for(count: usize) -> usize {
    (8 + count / 4).min(BINS)
}

/// The cost of testing a leaf relative to that of a split. A split is a seventh of a node with eight children, but
/// rarely are all children of a node useful.
const LEAF_COST: f64 = 2.0;

/// The number of splits above a leaf that the heuristic may choose. Below, ranges are halved, so that the depth of a
/// tree is at most this plus the logarithm of its number of primitives.
const CHOSEN_DEPTH: u32 = 40;

/// The maximum depth of a tree; primitives are numbered in 32 bits.
pub(super) const MAX_DEPTH: usize = CHOSEN_DEPTH as usize + 32;

/// A box in the layout in which boxes are joined fastest. The fourth components are ignored.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
struct Extent {
    low: [f32; 4],
    high: [f32; 4],
}

impl Extent {
    const NOTHING: Extent = Extent { low: [f32::INFINITY; 4], high: [f32::NEG_INFINITY; 4] };

    #[inline(always)]
    fn join(&mut self, low: &[f32; 4], high: &[f32; 4]) {
        for i in 0..4 {
            self.low[i] = if low[i] < self.low[i] { low[i] } else { self.low[i] };
            self.high[i] = if high[i] > self.high[i] { high[i] } else { self.high[i] };
        }
    }

    #[inline(always)]
    fn bounds(&self) -> Bounds {
        let ([a, b, c, _], [d, e, f, _]) = (self.low, self.high);
        Bounds { low: [a, b, c], high: [d, e, f] }
    }
}

/// A primitive to sort into a tree: its box, with its kind and index in the fourth components.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item(Extent);

impl Item {
    /// A primitive by its kind and its index among those of its kind. Both are below 2³⁰, so that their bits are valid
    /// floats, which minimum and maximum preserve.
    pub(super) fn new(bounds: &Bounds, kind: u32, index: u32) -> Item {
        let ([a, b, c], [d, e, f]) = (bounds.low, bounds.high);
        let (kind, index) = (f32::from_bits(kind), f32::from_bits(index));
        Item(Extent { low: [a, b, c, kind], high: [d, e, f, index] })
    }

    /// Only primitives of one kind share a leaf.
    #[inline(always)]
    pub(super) fn kind(&self) -> u32 {
        self.0.low[3].to_bits()
    }

    #[inline(always)]
    pub(super) fn index(&self) -> u32 {
        self.0.high[3].to_bits()
    }

    #[cfg(test)]
    pub(super) fn bounds(&self) -> Bounds {
        self.0.bounds()
    }

    /// Twice the centre.
    #[inline(always)]
    fn middle(&self) -> [f32; 4] {
        let Extent { low, high } = &self.0;
        [low[0] + high[0], low[1] + high[1], low[2] + high[2], 0.0]
    }
}

/// The kind of primitives that each form a leaf of their own.
pub(super) const ALONE: u32 = 7;

/// The bounds of the primitives of one node, and of their centres.
#[derive(Clone, Copy, Debug)]
struct NodeBounds {
    boxes: Extent,
    middles: Extent,
}

impl NodeBounds {
    const NOTHING: NodeBounds = NodeBounds { boxes: Extent::NOTHING, middles: Extent::NOTHING };

    fn of(items: &[Item]) -> NodeBounds {
        let mut node_bounds = NodeBounds::NOTHING;
        for item in items {
            node_bounds.add(item);
        }
        node_bounds
    }

    #[inline(always)]
    fn add(&mut self, item: &Item) {
        self.boxes.join(&item.0.low, &item.0.high);
        let middle = item.middle();
        self.middles.join(&middle, &middle);
    }
}

/// A node of the binary tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub(super) bounds: Bounds,
    pub(super) below: Below,
}

/// The contents of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Below {
    /// Two nodes. The first one follows this node.
    Two { second: u32 },
    /// A range of the sorted primitives.
    Leaf { first: u32, count: u32 },
}

/// Sorts the primitives and returns the tree over them, root first. There must be at least one primitive, and all
/// bounds must be finite. The tree depends only on the primitives and their order.
///
/// Up to `threads` threads build it, without an effect on the tree.
pub(super) fn build(items: &mut [Item], threads: usize) -> Vec<Split> {
    let mut splits = pages::with_capacity(items.len() / 2 + 1);
    let node_bounds = NodeBounds::of(items);
    // More parts than threads, so that the scheduler balances uneven splits.
    let shares = if threads < 2 { 1 } else { 4 * threads };
    grow(items, &node_bounds, 0, 0, &mut splits, shares);
    splits
}

/// The minimum number of primitives per thread.
const THREAD_PAYS_FROM: usize = 1 << 13;

/// Runs `work` on parts of a slice in parallel, each with the index of its first value.
pub(super) fn in_parts<T: Send>(all: &mut [T], threads: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    if threads < 2 || all.len() < THREAD_PAYS_FROM {
        return work(0, all);
    }
    let size = all.len().div_ceil(threads);
    std::thread::scope(|scope| {
        for (i, part) in all.chunks_mut(size).enumerate() {
            let work = &work;
            scope.spawn(move || work(i * size, part));
        }
    });
}

fn grow(
    items: &mut [Item],
    node_bounds: &NodeBounds,
    first: u32,
    depth: u32,
    splits: &mut Vec<Split>,
    threads: usize,
) {
    let at = splits.len();
    let count = items.len() as u32;
    splits.push(Split { bounds: node_bounds.boxes.bounds(), below: Below::Leaf { first, count } });
    let Some(Sides { middle, node_bounds: [around_low, around_high] }) = divide(items, node_bounds, depth)
    else {
        return;
    };
    let (low, high) = items.split_at_mut(middle);
    let second = first + middle as u32;
    if threads < 2 || low.len().min(high.len()) < THREAD_PAYS_FROM {
        grow(low, &around_low, first, depth + 1, splits, threads);
        splits[at].below = Below::Two { second: splits.len() as u32 };
        grow(high, &around_high, second, depth + 1, splits, threads);
        return;
    }
    // Threads are divided in proportion to the primitives.
    let share = low.len() as f64 / (low.len() + high.len()) as f64;
    let for_low = ((threads as f64 * share).round() as usize).clamp(1, threads - 1);
    let above = std::thread::scope(|scope| {
        let work = scope.spawn(|| {
            let mut above = pages::with_capacity(high.len() / 2 + 1);
            grow(high, &around_high, second, depth + 1, &mut above, threads - for_low);
            above
        });
        grow(low, &around_low, first, depth + 1, splits, for_low);
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

/// The number of tests, of up to [`LEAF`] items each, for so many primitives.
fn rounds(count: u32) -> f64 {
    f64::from(count.div_ceil(LEAF as u32))
}

/// The two sides of a division of a node's primitives.
struct Sides {
    /// The first index of the second side.
    middle: usize,
    node_bounds: [NodeBounds; 2],
}

/// Divides primitives into two sides; `None` if they form a leaf.
fn divide(items: &mut [Item], node_bounds: &NodeBounds, depth: u32) -> Option<Sides> {
    if items.len() == 1 {
        return None;
    }
    let kind = items[0].kind();
    let may_be_leaf = items.len() <= LEAF && kind != ALONE && items.iter().all(|item| item.kind() == kind);
    let best = if depth < CHOSEN_DEPTH { cheapest(items, &node_bounds.middles) } else { None };
    if may_be_leaf {
        let area = node_bounds.boxes.bounds().half_area();
        let worth_it = best.is_some_and(|best| area + LEAF_COST * best.cost < LEAF_COST * area);
        if !worth_it {
            return None;
        }
    }
    let Some(best) = best else {
        // All centres coincide, or the tree is too deep. Kinds are separated first, because leaves hold one kind.
        items.sort_unstable_by_key(|item| (item.kind(), item.index()));
        let border = items.partition_point(|item| item.kind() == items[0].kind());
        let middle = if border < items.len() { border } else { items.len() / 2 };
        let node_bounds = [NodeBounds::of(&items[..middle]), NodeBounds::of(&items[middle..])];
        return Some(Sides { middle, node_bounds });
    };
    let sides = partition(items, &best);
    debug_assert!(sides.middle > 0 && sides.middle < items.len());
    Some(sides)
}

/// Moves the primitives of the low side to the front.
fn partition(items: &mut [Item], split: &Candidate) -> Sides {
    let mut node_bounds = [NodeBounds::NOTHING; 2];
    let (mut low, mut high) = (0, items.len());
    let is_low = |item: &Item| split.bins.bins(item)[split.axis] < split.bin;
    while low < high {
        if is_low(&items[low]) {
            node_bounds[0].add(&items[low]);
            low += 1;
            continue;
        }
        node_bounds[1].add(&items[low]);
        high -= 1;
        while low < high && !is_low(&items[high]) {
            node_bounds[1].add(&items[high]);
            high -= 1;
        }
        if low < high {
            items.swap(low, high);
            node_bounds[0].add(&items[low]);
            low += 1;
        }
    }
    Sides { middle: low, node_bounds }
}

/// The division of the axes into bins of equal width.
#[derive(Clone, Copy, Debug)]
struct Bins {
    count: usize,
    from: [f32; 4],
    /// The inverse width; zero for an axis along which all centres coincide, or lie so close that the inverse is not
    /// finite.
    per_unit: [f32; 4],
}

impl Bins {
    fn new(count: usize, middles: &Extent) -> Bins {
        let ([x, y, z, _], [high_x, high_y, high_z, _]) = (middles.low, middles.high);
        let per_unit = |low: f32, high: f32| {
            let inverse = (count - 1) as f32 / (high - low);
            if inverse.is_finite() { inverse } else { 0.0 }
        };
        let per_unit = [per_unit(x, high_x), per_unit(y, high_y), per_unit(z, high_z), 0.0];
        Bins { count, from: [x, y, z, 0.0], per_unit }
    }

    /// The bin of a primitive along each axis: the nearest integer, taken from the lowest bits of a sum with 2²³.
    #[inline(always)]
    fn bins(&self, item: &Item) -> [usize; 4] {
        let middle = item.middle();
        let mut bins = [0; 4];
        for axis in 0..4 {
            let at = (middle[axis] - self.from[axis]) * self.per_unit[axis] + 8_388_608.0;
            bins[axis] = at.to_bits() & (BINS - 1) as u32;
        }
        bins.map(|bin| bin as usize)
    }
}

/// A possible division.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    bins: Bins,
    axis: usize,
    /// Bins below this one form the low side.
    bin: usize,
    /// Sum over both sides of half the area times the number of tests.
    cost: f64,
}

/// The division between bins with the lowest cost; `None` if all centres coincide.
fn cheapest(items: &[Item], middles: &Extent) -> Option<Candidate> {
    let bins = Bins::new(bins_for(items.len()), middles);
    let mut extents = [[Extent::NOTHING; BINS]; 3];
    let mut counts = [[0_u32; BINS]; 3];
    for item in items {
        let at = bins.bins(item);
        for axis in 0..3 {
            extents[axis][at[axis]].join(&item.0.low, &item.0.high);
            counts[axis][at[axis]] += 1;
        }
    }
    let mut best: Option<Candidate> = None;
    for axis in 0..3 {
        if bins.per_unit[axis] == 0.0 {
            continue;
        }
        let (extents, counts) = (&extents[axis], &counts[axis]);
        // The costs of the high sides, from the last bin down.
        let mut high_cost = [f64::INFINITY; BINS];
        let (mut extent, mut count) = (Extent::NOTHING, 0);
        for bin in (1..bins.count).rev() {
            extent.join(&extents[bin].low, &extents[bin].high);
            count += counts[bin];
            if count > 0 {
                high_cost[bin] = extent.bounds().half_area() * rounds(count);
            }
        }
        let (mut extent, mut count) = (Extent::NOTHING, 0);
        for bin in 1..bins.count {
            extent.join(&extents[bin - 1].low, &extents[bin - 1].high);
            count += counts[bin - 1];
            let cost = extent.bounds().half_area() * rounds(count) + high_cost[bin];
            let is_best = best.is_none_or(|best| cost < best.cost);
            if count > 0 && cost.is_finite() && is_best {
                best = Some(Candidate { bins, axis, bin, cost });
            }
        }
    }
    best
}
