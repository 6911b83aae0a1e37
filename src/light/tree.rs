//! Which light to ask: a tree of lights, descended by what each side contributes.

use super::bounds::{LightBounds, distance2};
use crate::math::{Float, Mask, Uint, Vec3};

/// A binary tree over lights (Conty Estevez and Kulla 2018). A node's lights are judged by the mean of their
/// places and how far they spread about it, not by the box around them: a point among them then still learns which
/// side has more of those that are near. Nodes are columns, so that each lane can stand at another one.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    centre: [Vec<f32>; 3],
    /// Mean squared distance from the centre.
    spread: Vec<f32>,
    power: Vec<f32>,
    /// Whether some light does not shine in all directions; where all do, what follows is not looked at.
    is_directed: bool,
    /// Greatest distance from the centre.
    radius: Vec<f32>,
    axis: [Vec<f32>; 3],
    cos_o: Vec<f32>,
    sin_o: Vec<f32>,
    cos_e: Vec<f32>,
    /// Index of the second child (the first comes right after its parent), or of the light with the top
    /// bit set.
    link: Vec<u32>,
    /// Whether some mesh shines; if none does, what follows is not looked at.
    has_meshes: bool,
    /// The square of the distance from the centre from which on these lights are far; infinite at leaves, and if they
    /// are not all of one mesh or too many to share units.
    far2: Vec<f32>,
    /// Power in whole units, so that the lights of a node share it without rounding.
    units: Vec<u32>,
    /// For each light the way down to it: bit i is set where step i goes to the second child.
    way: Vec<u32>,
    /// And its node.
    leaf: Vec<u32>,
}

/// The bit of a link that leads to a light.
pub const LEAF: u32 = 0x8000_0000;

/// One node of a [`LightTree`], for workers that keep the tree in another form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// Mean place of the lights, by their power.
    pub centre: [f32; 3],
    /// Mean squared distance from the centre.
    pub spread: f32,
    /// Share of the power.
    pub power: f32,
    /// Greatest distance from the centre.
    pub radius: f32,
    /// Axis of the cone of normals.
    pub axis: [f32; 3],
    /// Cosine of the cone's half angle.
    pub cos_o: f32,
    /// Cosine of the angle from a normal past which no light leaves.
    pub cos_e: f32,
    /// Square of the distance from the centre from which on power alone says which light is asked, if the lights
    /// face the point or their normals agree; infinite for lights that are not of one mesh.
    pub far2: f32,
    /// Whole units of power, for the choice among far lights.
    pub units: u32,
    /// Index of the second child (the first comes right after its parent), or of the light with [`LEAF`] set.
    pub link: u32,
}

/// How much of their spread counts as distance: the harmonic mean of |d|² over lights about a point is less than the
/// mean. Of 0.1 to 0.45 this gave the least variance over slabs, ceilings, clusters, lines and cubes of 100 to 10,000
/// lights, where any of 0.1 to 0.3 is within a tenth of it.
pub const NEARNESS: f32 = 0.2;

/// From this many radii on, triangles of one mesh are chosen by their power alone, all the way down: they share what
/// shadows them, and to look at each would cost more than it saves. (Of lamps that are apart, the picture would be
/// noisier: by half at twice the radius, with ten thousand of them.)
const FAR: f64 = 2.0;

/// If, moreover, the cosine at the lights is at least this,
pub const FACING: f32 = 0.3;

/// or their normals are within a cone whose half angle has at least this cosine: then distance and height are all
/// that tells them apart.
pub const NARROW: f32 = 0.95;

/// Units of power of the whole tree, about: no more than a uniform number of 24 bits can tell apart. Once steps down
/// the tree have used up some of its bits, what is left of it leads to fewer places, evenly spread: a light that
/// comes up less than once in 2²⁴ may not be asked from a given point, as in any tree.
const UNITS: f64 = 8_388_608.0;

/// From this depth on lights are split in halves, so that the way to each fits into a word.
fn balanced_from(lights: usize) -> u32 {
    31 - lights.next_power_of_two().trailing_zeros().min(31)
}

impl LightTree {
    /// The tree over lights with these bounds.
    pub fn new(bounds: &[LightBounds]) -> LightTree {
        let mut tree = LightTree {
            way: vec![0; bounds.len()],
            leaf: vec![0; bounds.len()],
            is_directed: bounds.iter().any(|b| b.cos_o > -1.0),
            has_meshes: bounds.iter().any(|b| b.mesh.is_some()),
            ..LightTree::default()
        };
        // Only shares of power count, and these fit into f32 whatever the powers are.
        let greatest = bounds.iter().map(|b| b.power).fold(f64::MIN_POSITIVE, f64::max);
        let bounds: Vec<LightBounds> =
            bounds.iter().map(|b| LightBounds { power: b.power / greatest, ..*b }).collect();
        let bounds = &bounds[..];
        let mut lights: Vec<u32> = (0..bounds.len() as u32).collect();
        if !lights.is_empty() {
            let power = bounds.iter().map(|b| b.power).sum::<f64>().max(f64::MIN_POSITIVE);
            tree.build(bounds, &mut lights, UNITS / power, 0, 0);
        }
        tree
    }

    /// Builds the node of some lights, `depth` steps down on this `way`.
    fn build(
        &mut self,
        bounds: &[LightBounds],
        lights: &mut [u32],
        units_of_power: f64,
        depth: u32,
        way: u32,
    ) -> LightBounds {
        let node = self.link.len();
        if let [light] = *lights {
            let own = bounds[light as usize];
            self.push(&own, light | LEAF);
            self.way[light as usize] = way;
            self.leaf[light as usize] = node as u32;
            // What shines has a unit at least, or it would never be found.
            let units = if own.power > 0.0 { (own.power * units_of_power).round().max(1.0) } else { 0.0 };
            self.units[node] = units as u32;
            return own;
        }
        // Bounds are known when the children are; the place is taken now.
        self.push(&bounds[lights[0] as usize], 0);
        let middle = split(bounds, lights, depth < balanced_from(bounds.len()));
        let (lefts, rights) = lights.split_at_mut(middle);
        let left = self.build(bounds, lefts, units_of_power, depth + 1, way);
        let second = self.link.len();
        self.link[node] = second as u32;
        let right = self.build(bounds, rights, units_of_power, depth + 1, way | 1 << depth);
        let own = left.union(&right);
        self.set(node, &own);
        self.units[node] = self.units[node + 1] + self.units[second];
        if own.mesh.is_some() && (1..=1 << 24).contains(&self.units[node]) {
            let reach = lights.iter().map(|&light| {
                let light = &bounds[light as usize];
                distance2(light.mean, own.mean).sqrt() + light.radius()
            });
            let far = FAR * reach.fold(0.0, f64::max).min(own.radius());
            self.far2[node] = (far * far) as f32;
        }
        own
    }

    fn push(&mut self, bounds: &LightBounds, link: u32) {
        for column in self.centre.iter_mut().chain(&mut self.axis) {
            column.push(0.0);
        }
        for column in [&mut self.spread, &mut self.power, &mut self.radius] {
            column.push(0.0);
        }
        for column in [&mut self.cos_o, &mut self.sin_o, &mut self.cos_e] {
            column.push(0.0);
        }
        self.far2.push(f32::INFINITY);
        self.units.push(0);
        self.link.push(link);
        self.set(self.link.len() - 1, bounds);
    }

    fn set(&mut self, node: usize, bounds: &LightBounds) {
        for c in 0..3 {
            self.centre[c][node] = bounds.mean[c] as f32;
            self.axis[c][node] = bounds.axis[c];
        }
        self.spread[node] = bounds.spread as f32;
        self.power[node] = bounds.power as f32;
        self.radius[node] = bounds.radius() as f32;
        self.cos_o[node] = bounds.cos_o;
        self.sin_o[node] = (1.0 - bounds.cos_o * bounds.cos_o).max(0.0).sqrt();
        self.cos_e[node] = bounds.cos_e;
    }

    /// The nodes, the root first.
    pub fn nodes(&self) -> impl Iterator<Item = LightNode> + '_ {
        let at = |columns: &[Vec<f32>; 3], i: usize| [0, 1, 2].map(|c: usize| columns[c][i]);
        (0..self.link.len()).map(move |i| LightNode {
            centre: at(&self.centre, i),
            spread: self.spread[i],
            power: self.power[i],
            radius: self.radius[i],
            axis: at(&self.axis, i),
            cos_o: self.cos_o[i],
            cos_e: self.cos_e[i],
            far2: self.far2[i],
            units: self.units[i],
            link: self.link[i],
        })
    }

    /// The way down to a light: bit i is set where step i goes to the second child.
    pub fn way(&self, light: usize) -> u32 {
        self.way[light]
    }

    /// The index of a light's node.
    pub fn leaf(&self, light: usize) -> u32 {
        self.leaf[light]
    }

    /// What a node's lights contribute to a point `p` on a surface with normal `n` that scatters on both sides, up
    /// to a common factor and without shadows: never zero where a light can matter. And whether they are far.
    ///
    /// Of lights that spread alike in all directions, σ² in all, the mean of (n·d)² is (n·d̄)² + σ²/3 and that of
    /// |d|² is d̄² + σ²: the quotient of both is a mean of cos². Exact for one point.
    #[inline(always)]
    fn importance<F: Float>(&self, at: impl Place<F>, p: Vec3<F>, n: Vec3<F>) -> Importance<F> {
        let least = F::splat(f32::MIN_POSITIVE);
        let from_centre = p - at.vector(&self.centre);
        let spread = at.number(&self.spread);
        let distance2 = from_centre.dot(from_centre);
        let height = from_centre.dot(n);
        let cos2 = (height * height + spread * (1.0 / 3.0)) / (distance2 + spread).max(least);
        let falloff = (distance2 + spread * NEARNESS).max(least);
        let value = at.number(&self.power) * cos2.sqrt() / falloff;
        let radius = at.number(&self.radius);
        let near2 = radius * radius;
        if !self.is_directed {
            return Importance { value, is_far: F::Mask::splat(false) };
        }

        // θ_b: half the angle that the bounds fill as seen from p; π inside them.
        let inside = distance2.le(near2);
        let sin2_b = near2 / distance2.max(least);
        let cos_b = F::select(inside, F::splat(-1.0), (-sin2_b + 1.0).max(F::zero()).sqrt());
        let sin_b = sin2_b.sqrt().only(!inside);

        // θ' = max(0, θ_w − θ_o − θ_b): the least angle between p and a normal (Pharr, Jakob and Humphreys 2023,
        // §12.6.3).
        let w = from_centre * (F::splat(1.0) / distance2.max(least).sqrt());
        let cos_w = at.vector(&self.axis).dot(w);
        let sin_w = (-cos_w * cos_w + 1.0).max(F::zero()).sqrt();
        let (cos_o, sin_o) = (at.number(&self.cos_o), at.number(&self.sin_o));
        let (cos_x, sin_x) = less(cos_w, sin_w, cos_o, sin_o);
        let (cos_p, _) = less(cos_x, sin_x, cos_b, sin_b);
        let lit = cos_p.gt(at.number(&self.cos_e));
        let value = (value * cos_p).only(lit).max(F::zero());
        if !self.has_meshes {
            return Importance { value, is_far: F::Mask::splat(false) };
        }
        // θ_w + θ_o + θ_b: the greatest angle. It is below 3π/2 where θ_o and θ_w are below π/2.
        let (cos_s, sin_s) = more(cos_o, sin_o, cos_b, sin_b);
        let (cos_s, _) = more(cos_s, sin_s, cos_w, sin_w);
        let acute = cos_o.gt(F::zero()) & cos_w.gt(F::zero());
        let faces = (acute & cos_s.gt(F::splat(FACING))) | cos_o.gt(F::splat(NARROW));
        Importance { value, is_far: faces & distance2.gt(at.number(&self.far2)) }
    }

    /// See [`super::LightTable::choose`].
    #[inline(always)]
    pub(super) fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        let mut u = u;
        let (mut node, chance) = self.descend(
            p,
            n,
            asks,
            #[inline(always)]
            |going: F::Mask, share: F| {
                let goes_left = u.lt(share);
                let taken = F::select(goes_left, share, -share + 1.0);
                // What is left of u is uniform again.
                let rest = F::select(goes_left, u, u - share) / taken.max(F::splat(f32::MIN_POSITIVE));
                u = F::select(going, rest.min(F::splat(BELOW_ONE)), u);
                goes_left
            },
        );
        if !self.has_meshes {
            return (F::Uint::gather(&self.link, node) & F::Uint::splat(!LEAF), chance);
        }
        // Of lights that are far, the one that has some unit of their power. Adding the bits of !x subtracts x + 1.
        let (one, all_bits) = (F::Uint::splat(1), F::Uint::splat(u32::MAX));
        let units = F::Uint::gather(&self.units, node);
        let mut unit = (units.to_float() * u).to_uint();
        unit = F::Uint::select(unit.lt(units), unit, units + all_bits);
        let mut link = F::Uint::gather(&self.link, node);
        loop {
            let inner = asks & link.lt(F::Uint::splat(LEAF));
            if !inner.any() {
                break;
            }
            let left = node + one;
            let left_units = F::Uint::gather(&self.units, left);
            let goes_left = unit.lt(left_units);
            unit = F::Uint::select(goes_left, unit, unit + (left_units ^ all_bits) + one);
            node = F::Uint::select(inner, F::Uint::select(goes_left, left, link), node);
            link = F::Uint::gather(&self.link, node);
        }
        (link & F::Uint::splat(!LEAF), chance * self.share_of_power::<F>(node, units))
    }

    /// See [`super::LightTable::chance`].
    #[inline(always)]
    pub(super) fn chance<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        let mut way = F::Uint::gather(&self.way, light);
        let one = F::Uint::splat(1);
        let (node, chance) = self.descend(
            p,
            n,
            asks,
            #[inline(always)]
            |_, _| {
                let goes_left = !(way & one).eq(one);
                way = way.shr::<1>();
                goes_left
            },
        );
        if !self.has_meshes {
            return chance;
        }
        let units = F::Uint::gather(&self.units, node);
        chance * self.share_of_power::<F>(F::Uint::gather(&self.leaf, light), units)
    }

    /// The share that a leaf has in so many units; all of it where there are none.
    #[inline(always)]
    fn share_of_power<F: Float>(&self, leaf: F::Uint, units: F::Uint) -> F {
        let own = F::Uint::gather(&self.units, leaf).to_float();
        F::select(units.lt(F::Uint::splat(1)), F::splat(1.0), own / units.to_float().max(F::splat(1.0)))
    }

    /// Goes down until the lights are far or only one is left: at each step `goes_left` is told which lanes still
    /// go and the chance of going left, and says which do. Lanes that do not ask hold nonsense. Returns the node, and
    /// the chance of the way to it.
    #[inline(always)]
    fn descend<F: Float>(
        &self,
        p: Vec3<F>,
        n: Vec3<F>,
        asks: F::Mask,
        mut goes_left: impl FnMut(F::Mask, F) -> F::Mask,
    ) -> (F::Uint, F) {
        let mut node = F::Uint::splat(0);
        let mut chance = F::splat(1.0);
        let mut going = asks;
        if self.has_meshes {
            going = going & !self.importance(0, p, n).is_far;
        }
        while going.any() {
            let link = F::Uint::gather(&self.link, node);
            going = going & link.lt(F::Uint::splat(LEAF));
            if !going.any() {
                break;
            }
            let left = node + F::Uint::splat(1);
            // Lanes at a leaf look up the first node, in vain.
            let right = F::Uint::select(going, link, F::Uint::splat(0));
            let [a, b] = [self.importance(Each(left), p, n), self.importance(Each(right), p, n)];
            let left_share = share(a.value, b.value);
            let lefts = goes_left(going, left_share);
            let taken = F::select(lefts, left_share, -left_share + 1.0);
            chance = F::select(going, chance * taken, chance);
            node = F::Uint::select(going, F::Uint::select(lefts, left, right), node);
            going = going & !((lefts & a.is_far) | (!lefts & b.is_far));
        }
        (node, chance)
    }
}

/// Where in its columns a node is: the same for all lanes, or another for each.
trait Place<F: Float>: Copy {
    fn number(self, column: &[f32]) -> F;
    #[inline(always)]
    fn vector(self, columns: &[Vec<f32>; 3]) -> Vec3<F> {
        Vec3::new(self.number(&columns[0]), self.number(&columns[1]), self.number(&columns[2]))
    }
}

impl<F: Float> Place<F> for usize {
    #[inline(always)]
    fn number(self, column: &[f32]) -> F {
        F::splat(column[self])
    }
}

#[derive(Clone, Copy)]
struct Each<F: Float>(F::Uint);

impl<F: Float> Place<F> for Each<F> {
    #[inline(always)]
    fn number(self, column: &[f32]) -> F {
        F::gather(column, self.0)
    }
}

/// What a node's lights are to a point.
struct Importance<F: Float> {
    value: F,
    /// Whether the lights are so far that how they share it hardly depends on the point.
    is_far: F::Mask,
}

/// The chance of the first of two: its share of importance, or half where both have none. Where both have some,
/// neither share rounds to nothing, however weak one is beside the other: `u` has steps of 2⁻²⁴, and a child needs
/// one at least to be found.
#[inline(always)]
fn share<F: Float>(a: F, b: F) -> F {
    let sum = a + b;
    let zero = F::zero();
    let share = F::select(sum.gt(zero), a / sum.max(F::splat(f32::MIN_POSITIVE)), F::splat(0.5));
    let between = share.max(F::splat(1.0 - BELOW_ONE)).min(F::splat(BELOW_ONE));
    F::select(a.gt(zero) & b.gt(zero), between, share)
}

/// The largest f32 below one.
pub const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Cosine and sine of max(0, a − b), from those of a and b in [0, π].
#[inline(always)]
fn less<F: Float>(cos_a: F, sin_a: F, cos_b: F, sin_b: F) -> (F, F) {
    let none = cos_a.gt(cos_b);
    let cos = cos_a * cos_b + sin_a * sin_b;
    let sin = sin_a * cos_b - cos_a * sin_b;
    (F::select(none, F::splat(1.0), cos), sin.only(!none))
}

/// Cosine and sine of a + b, from those of a and b in [0, π].
#[inline(always)]
fn more<F: Float>(cos_a: F, sin_a: F, cos_b: F, sin_b: F) -> (F, F) {
    (cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b)
}

/// Where to split lights: sorts them along the best axis and returns how many go left.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::scalar::Wrapping;

    fn scattered(count: u32) -> Vec<LightBounds> {
        let unit =
            |i: u32, k: u32| crate::math::Uint::to_unit(Wrapping((i * 3 + k).wrapping_mul(2_654_435_769)));
        (0..count)
            .map(|i| LightBounds::point([0, 1, 2].map(|k| 10.0 * unit(i, k)), [1.0 + unit(i, 7); 3]))
            .collect()
    }

    #[test]
    fn chances_of_all_lights_add_up_to_one_and_match_the_choice() {
        for count in [1, 2, 3, 17, 500] {
            let tree = LightTree::new(&scattered(count));
            let p = Vec3::splat([4.0_f32, 5.0, 3.0]);
            let n = Vec3::splat([0.0_f32, 0.6, 0.8]);
            let sum: f64 = (0..count).map(|l| f64::from(tree.chance(p, n, Wrapping(l), true))).sum();
            assert!((sum - 1.0).abs() < 1e-4, "{count} lights: {sum}");
            let mut seen = vec![0_u32; count as usize];
            let draws = 20_000;
            for i in 0..draws {
                let (light, chance) = tree.choose(p, n, (i as f32 + 0.5) / draws as f32, true);
                let again = tree.chance(p, n, light, true);
                assert!((chance - again).abs() <= 1e-5 * chance, "{chance} is not {again}");
                seen[light.0 as usize] += 1;
            }
            for (light, &times) in seen.iter().enumerate() {
                let expected = f64::from(tree.chance(p, n, Wrapping(light as u32), true)) * f64::from(draws);
                assert!(
                    (f64::from(times) - expected).abs() <= 2.0 + 1e-3 * expected,
                    "light {light}: {times} of {expected}"
                );
            }
        }
    }

    #[test]
    fn near_and_strong_lights_are_preferred() {
        let far = LightBounds::point([100.0, 0.0, 0.0], [1.0; 3]);
        let near = LightBounds::point([1.0, 0.0, 0.0], [1.0; 3]);
        let tree = LightTree::new(&[far, near]);
        let (p, n) = (Vec3::<f32>::zero(), Vec3::splat([1.0_f32, 0.0, 0.0]));
        assert!(tree.chance(p, n, Wrapping(1), true) > 0.99);
    }

    #[test]
    fn a_mesh_that_is_far_is_shared_by_power_and_a_near_one_is_not() {
        // A strip of squares, each of twice the power of the one before it, that shine towards +z.
        let square = |i: u32, mesh: Option<u32>| {
            let corners =
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| [x + i as f32, y, 0.0]);
            let own = LightBounds::flat(&corners, [0.0, 0.0, 1.0], 1.0, [(1 << i) as f32; 3]);
            LightBounds { mesh, ..own }
        };
        let strip = |mesh: Option<u32>| LightTree::new(&(0..8).map(|i| square(i, mesh)).collect::<Vec<_>>());
        let off = |tree: &LightTree, z: f32| {
            let (p, n) = (Vec3::<f32>::splat([0.0, 0.0, z]), Vec3::<f32>::splat([0.0, 0.0, -1.0]));
            let chance = |i: u32| f64::from(tree.chance(p, n, Wrapping(i), true));
            (0..8).map(|i| (chance(i) * 255.0 / f64::from(1 << i) - 1.0).abs()).fold(0.0, f64::max)
        };
        let mesh = strip(Some(0));
        assert!(off(&mesh, 30.0) < 1e-4, "{}", off(&mesh, 30.0));
        assert!(off(&mesh, 1.0) > 0.5);
        // Nor are lamps that only happen to stand side by side.
        assert!(off(&strip(None), 30.0) > 0.02);
    }

    #[test]
    fn ten_thousand_lights_in_one_place_still_make_a_tree() {
        let tree = LightTree::new(&vec![LightBounds::point([1.0; 3], [1.0; 3]); 10_000]);
        let p = Vec3::<f32>::zero();
        let sum: f64 = (0..10_000).map(|l| f64::from(tree.chance(p, p, Wrapping(l), true))).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
