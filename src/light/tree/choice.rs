//! The choice among the children of a node.

use super::node::{Node, WIDTH};
use crate::math::{BELOW_ONE, LaneFloat, LaneMask, Uint};

/// The smallest value of a child above zero, relative to the greatest value of the children. Larger ones are not lost
/// in a sum of eight values or in a random number of 24 bits.
pub const LEAST_SHARE: f32 = 1.0 / 524_288.0;

/// A choice among a node's children.
pub(super) struct Choice<F: LaneFloat> {
    pub(super) child: F::Uint,
    /// Its probability.
    pub(super) share: F,
    /// The rest of the random number, again uniform.
    pub(super) u: F,
}

impl<F: LaneFloat> Choice<F> {
    /// Chooses a child with probabilities in proportion to these values, or with equal ones if all are zero.
    ///
    /// With `DRAWS` the child is sampled with `u`; otherwise it is the one that contains the light at a given position
    /// in the order of the tree.
    #[inline(always)]
    pub(super) fn new<const DRAWS: bool>(node: &Node, values: [F; WIDTH], u: F, light: F::Uint) -> Self {
        // The ends of the children's intervals; the first interval begins at zero.
        let [a, b, c, d, e, f, g, h] = values;
        let most = a.max(b).max(c.max(d)).max(e.max(f).max(g.max(h)));
        let least = most * LEAST_SHARE;
        let mut end = F::zero();
        let mut ends = values;
        for value in &mut ends[..node.count] {
            end = end + value.max(least).only(value.gt(F::zero()));
            *value = end;
        }
        let is_lit = end.gt(F::zero());
        if (!is_lit).any() {
            for (i, end) in ends.iter_mut().enumerate() {
                *end = F::select(is_lit, *end, F::splat(i as f32 + 1.0));
            }
        }
        let end = ends[node.count - 1];
        // Always below the end, even if the product is rounded up to it. Adding all bits subtracts one.
        let last = F::from_bits(end.to_bits() + F::Uint::splat(u32::MAX));
        let at = (u * end).min(last);
        let (mut child, mut from, mut to) = (F::Uint::splat(0), F::zero(), ends[0]);
        for i in 1..node.count {
            let is_past = if DRAWS { ends[i - 1].le(at) } else { !light.lt(F::Uint::splat(node.first[i])) };
            child = F::Uint::select(is_past, F::Uint::splat(i as u32), child);
            from = F::select(is_past, ends[i - 1], from);
            to = F::select(is_past, ends[i], to);
        }
        let rest = (at - from) / (to - from).max(F::splat(f32::MIN_POSITIVE));
        Choice { child, share: (to - from) / end, u: rest.min(F::splat(BELOW_ONE)) }
    }
}
