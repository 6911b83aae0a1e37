//! Construction of the tree: first a binary one, of which several levels are then merged into one.

use super::group::{Below, Group};
use super::node::{LEAF, Node, WIDTH};
use super::shares::Shares;
use crate::light::bounds::{LightBounds, distance2};

/// Beyond this many radii, triangles of one mesh are chosen by their power alone: they are shadowed by the same
/// objects, and evaluating each would cost more than it saves. (With separate lights, the image would have more noise:
/// by half at twice the radius, with ten thousand of them.)
const FAR: f64 = 2.0;

/// The approximate number of units of power in the whole tree: no more than a uniform number of 24 bits can
/// distinguish. Each step down the tree uses up some of its bits, so that the rest reaches fewer units, evenly spread.
/// As in any tree, a light of probability below 2⁻²⁴ may never be chosen from a given point.
const UNITS: f64 = 8_388_608.0;

/// A tree of groups, the root last, and its lights in order.
#[derive(Default)]
pub(super) struct Groups {
    all: Vec<Group>,
    pub(super) shares: Shares,
}

/// From this depth on, lights are split in halves, so that no path has more than 31 steps.
fn balanced_from(lights: usize) -> u32 {
    31 - lights.next_power_of_two().trailing_zeros().min(31)
}

impl Groups {
    /// The groups of some of the lights with these bounds.
    pub(super) fn new(bounds: &[LightBounds], mut lights: Vec<u32>) -> Groups {
        let mut groups = Groups::default();
        // Only fractions of the power matter, and these are in the range of f32 for all powers.
        let greatest = bounds.iter().map(|b| b.power).fold(f64::MIN_POSITIVE, f64::max);
        let bounds: Vec<LightBounds> =
            bounds.iter().map(|b| LightBounds { power: b.power / greatest, ..*b }).collect();
        if !lights.is_empty() {
            let power = lights.iter().map(|&l| bounds[l as usize].power).sum::<f64>();
            let power = power.max(f64::MIN_POSITIVE);
            groups.add(&bounds, &mut lights, UNITS / power, 0);
            groups.shares.sort();
        }
        groups
    }

    /// Adds the group of some lights, at `depth`, and returns its index.
    fn add(&mut self, bounds: &[LightBounds], lights: &mut [u32], units_of_power: f64, depth: u32) -> usize {
        let first = self.shares.len() as u32;
        let group = if let [light] = *lights {
            let own = bounds[light as usize];
            // A light with power has at least one unit, or it would never be chosen.
            let units = if own.power > 0.0 { (own.power * units_of_power).round().max(1.0) } else { 0.0 };
            let (units, below) = (units as u32, Below::Light(light));
            let first_unit = self.shares.push(light, units);
            Group { bounds: own, far2: f32::INFINITY, units, first_unit, first, lights: 1, below }
        } else {
            let middle = split(bounds, lights, depth < balanced_from(bounds.len()));
            let (lefts, rights) = lights.split_at_mut(middle);
            let left = self.add(bounds, lefts, units_of_power, depth + 1);
            let right = self.add(bounds, rights, units_of_power, depth + 1);
            let [a, b] = [&self.all[left], &self.all[right]];
            let (own, units) = (a.bounds.union(&b.bounds), a.units + b.units);
            let mut far2 = f32::INFINITY;
            if own.mesh.is_some() && (1..=1 << 24).contains(&units) {
                let reach = lights.iter().map(|&light| {
                    let light = &bounds[light as usize];
                    distance2(light.mean, own.mean).sqrt() + light.radius()
                });
                let far = FAR * reach.fold(0.0, f64::max).min(own.radius());
                far2 = (far * far) as f32;
            }
            let (first_unit, lights) = (a.first_unit, lights.len() as u32);
            Group { bounds: own, far2, units, first_unit, first, lights, below: Below::Two(left, right) }
        };
        self.all.push(group);
        self.all.len() - 1
    }

    /// The lights in order.
    pub(super) fn lights(&self) -> impl Iterator<Item = (u32, &Group)> {
        self.all.iter().filter_map(|group| match group.below {
            Below::Light(light) => Some((light, group)),
            Below::Two(..) => None,
        })
    }

    /// A node whose only child is the whole tree, and the nodes below it.
    pub(super) fn nodes(&self) -> (Node, Vec<Node>) {
        let (mut top, mut nodes) = (Node::default(), Vec::new());
        if let Some(all) = self.all.last() {
            top.push(all, self.link(all, &mut nodes));
        }
        (top, nodes)
    }

    /// The link to a group: to a light, or to a node, which is added with its whole subtree. A node replaces its
    /// children by their children, starting with the most dissimilar ones, until it has eight.
    fn link(&self, group: &Group, nodes: &mut Vec<Node>) -> u32 {
        let (a, b) = match group.below {
            Below::Light(light) => return light | LEAF,
            Below::Two(a, b) => (a, b),
        };
        let mut children = vec![&self.all[a], &self.all[b]];
        while children.len() < WIDTH {
            let open = children.iter().enumerate().filter_map(|(i, child)| match child.below {
                Below::Light(_) => None,
                Below::Two(a, b) => Some((i, child, [a, b])),
            });
            let key = |group: &Group| (group.bounds.cost(), group.lights);
            let most = open.max_by(|(_, a, _), (_, b, _)| {
                let (a, b) = (key(a), key(b));
                a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
            });
            let Some((i, _, [a, b])) = most else { break };
            children.splice(i..=i, [&self.all[a], &self.all[b]]);
        }
        let index = nodes.len();
        nodes.push(Node::default());
        for child in children {
            let link = self.link(child, nodes);
            nodes[index].push(child, link);
        }
        index as u32
    }
}

/// The split of lights: sorts them along the best axis and returns the number of those on the left.
fn split(bounds: &[LightBounds], lights: &mut [u32], by_cost: bool) -> usize {
    const BUCKETS: usize = 12;
    let half = lights.len() / 2;
    let place = |light: u32, axis: usize| bounds[light as usize].mean[axis];
    let extent = |axis: usize| {
        let places = lights.iter().map(|&l| place(l, axis));
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
    };
    let extents = [0, 1, 2].map(extent);
    let widest =
        (0..3).max_by(|&a, &b| (extents[a].1 - extents[a].0).total_cmp(&(extents[b].1 - extents[b].0)));
    let mut best: Option<(f64, usize, usize)> = None;
    if by_cost {
        for (axis, &(lo, hi)) in extents.iter().enumerate() {
            if hi <= lo {
                continue;
            }
            let mut sums: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
            for &light in lights.iter() {
                let sum = &mut sums[bucket_of(place(light, axis), lo, hi, BUCKETS)];
                let own = bounds[light as usize];
                *sum = Some(sum.map_or(own, |sum| sum.union(&own)));
            }
            let total = |sums: &[Option<LightBounds>]| {
                sums.iter().flatten().copied().reduce(|a, b| a.union(&b)).map_or(0.0, |b| b.cost())
            };
            for at in 1..BUCKETS {
                let cost = total(&sums[..at]) + total(&sums[at..]);
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, at));
                }
            }
        }
    }
    if let Some((_, axis, at)) = best {
        let (lo, hi) = extents[axis];
        let left = |&l: &u32| bucket_of(place(l, axis), lo, hi, BUCKETS) < at;
        lights.sort_by_key(|l| !left(l));
        let middle = lights.iter().filter(|l| left(l)).count();
        if (1..lights.len()).contains(&middle) {
            return middle;
        }
    }
    let axis = widest.unwrap_or(0);
    lights.sort_by(|&a, &b| place(a, axis).total_cmp(&place(b, axis)));
    half
}

fn bucket_of(place: f64, lo: f64, hi: f64, buckets: usize) -> usize {
    (((place - lo) / (hi - lo) * buckets as f64) as usize).min(buckets - 1)
}
