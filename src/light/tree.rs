//! The choice among lights: a tree that is descended by estimates of what each branch contributes.

mod build;
mod choice;
mod group;
mod importance;
mod node;
mod shares;

use self::build::Groups;
use self::choice::Choice;
pub use self::choice::LEAST_SHARE;
pub use self::importance::{FACING, GREATEST, NARROW, NEARNESS};
use self::importance::{Importance, Kinds};
pub use self::node::{COUNT_FROM, LEAF, LightNode};
use self::node::{Each, Node, WIDTH};
use self::shares::Shares;
use super::bounds::LightBounds;
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Device, Kernel, MAX_LANES};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Mask, Uint, Vec3, value};

/// A tree over lights (Conty Estevez and Kulla 2018) of eight children a node. The importance of a
/// node comes from the mean position and the spread of its lights, not from their box, so that it still tells sides
/// apart for a point among the lights.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// A node with everything as its only child.
    top: Node,
    /// The nodes below it; none if there is a single light.
    nodes: Vec<Node>,
    kinds: Kinds,
    /// The units of power of each light.
    shares: Shares,
    /// For each light its place in the order of the tree.
    place: Vec<u32>,
    /// And its units.
    units: Vec<u32>,
}

impl LightTree {
    /// The tree over lights with these bounds.
    pub fn new(bounds: &[LightBounds]) -> LightTree {
        LightTree::of(bounds, (0..bounds.len() as u32).collect())
    }

    /// The tree over some of the lights with these bounds.
    pub(super) fn of(bounds: &[LightBounds], lights: Vec<u32>) -> LightTree {
        let is_any = |is: fn(&LightBounds) -> bool| lights.iter().any(|&light| is(&bounds[light as usize]));
        let kinds =
            Kinds { is_directed: is_any(|b| b.cos_o > -1.0), has_meshes: is_any(|b| b.mesh.is_some()) };
        let groups = Groups::new(bounds, lights);
        let (top, nodes) = groups.nodes();
        let (mut place, mut units) = (vec![0; bounds.len()], vec![0; bounds.len()]);
        for (light, group) in groups.lights() {
            place[light as usize] = group.first;
            units[light as usize] = group.units;
        }
        LightTree { top, nodes, kinds, shares: groups.shares, place, units }
    }

    /// The nodes, the root first and then the children of each, one after the other.
    pub fn nodes(&self) -> impl Iterator<Item = LightNode> + '_ {
        let mut next = 1;
        let first_children: Vec<u32> = (self.nodes.iter())
            .map(|node| {
                let first = next;
                next += node.count as u32;
                first | (node.count as u32 - 1) << COUNT_FROM
            })
            .collect();
        let all = std::iter::once(&self.top).chain(&self.nodes).flat_map(Node::children);
        all.map(move |node| match node.link {
            LEAF.. => node,
            inner => LightNode { link: first_children[inner as usize], ..node },
        })
    }

    /// A light's place in the order of the tree.
    pub fn place(&self, light: usize) -> u32 {
        self.place[light]
    }

    /// A light's units of power.
    pub fn units(&self, light: usize) -> u32 {
        self.units[light]
    }

    /// See [`super::LightTable::choose`].
    #[inline(always)]
    pub(super) fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        let LightChoice { light, chance } = F::device(&Choose(self), (p, n, u, asks));
        (light, chance)
    }

    /// See [`super::LightTable::chance`].
    #[inline(always)]
    pub(super) fn chance<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        F::device(&Chance(self), (p, n, light, asks))
    }

    #[inline(always)]
    fn choose_in_lanes<F: LaneFloat>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        let End { light, chance, u, units, first_unit } =
            self.descend::<F, true>(p, n, u, F::Uint::splat(0), asks);
        if !self.kinds.has_meshes {
            return (light, chance);
        }
        // Among lights that are far, a unit of their power is drawn. Adding all bits subtracts one.
        let is_far = asks & F::Uint::splat(0).lt(units);
        let unit = (units.to_float() * u).to_uint();
        let unit = F::Uint::select(unit.lt(units), unit, units + F::Uint::splat(u32::MAX));
        let (one, own) = self.shares.find::<F>(unit + first_unit, is_far);
        let share = own.to_float() / units.to_float().max(F::splat(1.0));
        (F::Uint::select(is_far, one, light), F::select(is_far, chance * share, chance))
    }

    #[inline(always)]
    fn chance_in_lanes<F: LaneFloat>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        let place = F::Uint::gather(&self.place, light);
        let End { chance, units, .. } = self.descend::<F, false>(p, n, F::zero(), place, asks);
        if !self.kinds.has_meshes {
            return chance;
        }
        let own = F::Uint::gather(&self.units, light).to_float();
        let is_far = F::Uint::splat(0).lt(units);
        F::select(is_far, chance * own / units.to_float().max(F::splat(1.0)), chance)
    }

    /// Descends until the lights are far or a single one is left: with `DRAWS` by drawing with `u`, otherwise towards
    /// the light in a given place. Lanes outside `asks` are unspecified.
    #[inline(always)]
    fn descend<F: LaneFloat, const DRAWS: bool>(
        &self,
        p: Vec3<F>,
        n: Vec3<F>,
        u: F,
        place: F::Uint,
        asks: F::Mask,
    ) -> End<F> {
        let top = &self.top;
        let mut end = End {
            light: F::Uint::splat(top.link[0] & !LEAF),
            chance: F::splat(1.0),
            u,
            units: F::Uint::splat(top.units[0]),
            first_unit: F::Uint::splat(0),
        };
        let Some(root) = self.nodes.first() else {
            end.units = F::Uint::splat(0);
            return end;
        };
        let mut going = asks;
        if self.kinds.has_meshes {
            going = going & !Importance::of(top, 0, self.kinds, p, n).is_far;
        }
        end.units = F::Uint::select(going, F::Uint::splat(0), end.units);
        let mut node = F::Uint::splat(0);
        // At the root all lanes together, if that is less work than lane by lane.
        if going.bits().count_ones() as usize * WIDTH > F::LANES * root.count / 2 {
            let mut values = [F::zero(); WIDTH];
            let mut far = [F::Mask::splat(false); WIDTH];
            for i in 0..root.count {
                let importance = Importance::of(root, i, self.kinds, p, n);
                (values[i], far[i]) = (importance.value, importance.is_far);
            }
            let choice = Choice::new::<DRAWS>(root, values, u, place);
            let mut is_far = F::Mask::splat(false);
            if self.kinds.has_meshes {
                for (i, far) in far.into_iter().enumerate() {
                    is_far = is_far | (far & choice.child.eq(F::Uint::splat(i as u32)));
                }
            }
            node = F::Uint::gather(&root.link, choice.child);
            let is_leaf = !node.lt(F::Uint::splat(LEAF));
            end.light = F::Uint::select(going, node & F::Uint::splat(!LEAF), end.light);
            end.chance = F::select(going, choice.share, end.chance);
            end.u = F::select(going, choice.u, end.u);
            let ends = going & is_far & !is_leaf;
            end.units = F::Uint::select(ends, F::Uint::gather(&root.units, choice.child), end.units);
            end.first_unit =
                F::Uint::select(ends, F::Uint::gather(&root.first_unit, choice.child), end.first_unit);
            going = going & !is_far & !is_leaf;
        }
        if going.any() {
            let mut lanes = Lanes::new(going.bits(), p, n, node, place, &end);
            F::outlined(Descent::<DRAWS> { tree: self, lanes: &mut lanes });
            end = lanes.end();
        }
        end
    }
}

/// A light that was chosen.
#[derive(Clone, Copy, Debug)]
pub struct LightChoice<F: Float> {
    /// Its index.
    pub light: F::Uint,
    /// The probability of the choice.
    pub chance: F,
}

value!(LightChoice { light, chance });

/// [`LightTree::choose`]: a descent of its own for each lane.
struct Choose<'a>(&'a LightTree);

impl Device for Choose<'_> {
    const NAME: &'static str = "choose_light";
    type Arguments<F: Float> = (Vec3<F>, Vec3<F>, F, F::Mask);
    type Output<F: Float> = LightChoice<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (p, n, u, asks): Self::Arguments<F>) -> LightChoice<F> {
        let (light, chance) = self.0.choose_in_lanes(p, n, u, asks);
        LightChoice { light, chance }
    }
}

/// [`LightTree::chance`], likewise.
struct Chance<'a>(&'a LightTree);

impl Device for Chance<'_> {
    const NAME: &'static str = "light_chance";
    type Arguments<F: Float> = (Vec3<F>, Vec3<F>, F::Uint, F::Mask);
    type Output<F: Float> = F;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (p, n, light, asks): Self::Arguments<F>) -> F {
        self.0.chance_in_lanes(p, n, light, asks)
    }
}

/// The end of a descent.
struct End<F: LaneFloat> {
    /// The light, unless the lights are far.
    light: F::Uint,
    /// The probability of the way to it.
    chance: F,
    /// The rest of the random number, uniform again.
    u: F,
    /// The units of lights that are far; zero at one light.
    units: F::Uint,
    /// The first of these units.
    first_unit: F::Uint,
}

/// The descents of some lanes, a column for each number.
struct Lanes {
    /// Bit `i` is set if lane `i` has not reached the end.
    going: u32,
    p: [[f32; MAX_LANES]; 3],
    n: [[f32; MAX_LANES]; 3],
    node: [u32; MAX_LANES],
    place: [u32; MAX_LANES],
    light: [u32; MAX_LANES],
    chance: [f32; MAX_LANES],
    u: [f32; MAX_LANES],
    units: [u32; MAX_LANES],
    first_unit: [u32; MAX_LANES],
}

#[inline(always)]
fn floats<F: LaneFloat>(x: F) -> [f32; MAX_LANES] {
    let mut column = [0.0; MAX_LANES];
    x.store(&mut column);
    column
}

#[inline(always)]
fn words<U: LaneUint>(x: U) -> [u32; MAX_LANES] {
    let mut column = [0; MAX_LANES];
    x.store(&mut column);
    column
}

impl Lanes {
    #[inline(always)]
    fn new<F: LaneFloat>(
        going: u32,
        p: Vec3<F>,
        n: Vec3<F>,
        node: F::Uint,
        place: F::Uint,
        end: &End<F>,
    ) -> Lanes {
        Lanes {
            going,
            p: [p.x, p.y, p.z].map(floats),
            n: [n.x, n.y, n.z].map(floats),
            node: words(node),
            place: words(place),
            light: words(end.light),
            chance: floats(end.chance),
            u: floats(end.u),
            units: words(end.units),
            first_unit: words(end.first_unit),
        }
    }

    #[inline(always)]
    fn end<F: LaneFloat>(&self) -> End<F> {
        End {
            light: F::Uint::load(&self.light),
            chance: F::load(&self.chance),
            u: F::load(&self.u),
            units: F::Uint::load(&self.units),
            first_unit: F::Uint::load(&self.first_unit),
        }
    }
}

/// Descends with one lane after the other, over eight children at a time: where lanes are at different nodes, gathering
/// their children costs more than evaluating them.
struct Descent<'a, const DRAWS: bool> {
    tree: &'a LightTree,
    lanes: &'a mut Lanes,
}

impl<const DRAWS: bool> Kernel for Descent<'_, DRAWS> {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let Descent { tree: LightTree { nodes, kinds, .. }, lanes } = self;
        let mut going = lanes.going;
        while going != 0 {
            let lane = going.trailing_zeros() as usize & (MAX_LANES - 1);
            going &= going - 1;
            // An array's own `map` would not be inlined, and run without the level's instructions.
            let at = |v: &[[f32; MAX_LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
            let p = Vec3::<F::Octet>::splat(at(&lanes.p));
            let n = Vec3::<F::Octet>::splat(at(&lanes.n));
            let (mut u, mut chance, mut link) = (lanes.u[lane], lanes.chance[lane], lanes.node[lane]);
            let place = Wrapping(lanes.place[lane]);
            let (mut units, mut first_unit) = (0, 0);
            while link < LEAF {
                let node = &nodes[link as usize];
                let importance = Importance::of(node, Each, *kinds, p, n);
                let mut values = [0.0; WIDTH];
                importance.value.store(&mut values);
                let choice = Choice::<f32>::new::<DRAWS>(node, values, u, place);
                let child = choice.child.0 as usize & (WIDTH - 1);
                chance *= choice.share;
                u = choice.u;
                link = node.link[child];
                if importance.is_far.bits() >> child & 1 != 0 && link < LEAF {
                    (units, first_unit) = (node.units[child], node.first_unit[child]);
                    break;
                }
            }
            lanes.light[lane] = link & !LEAF;
            (lanes.u[lane], lanes.chance[lane]) = (u, chance);
            (lanes.units[lane], lanes.first_unit[lane]) = (units, first_unit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Light, PointLight, flat};
    use crate::math::lanes::{Level, dispatch};
    use crate::sampling::Stream;
    use rand::RngExt;

    fn point(position: [f32; 3], intensity: [f32; 3]) -> LightBounds {
        PointLight { position, intensity }.bounds().unwrap()
    }

    fn scattered(count: u32) -> Vec<LightBounds> {
        let unit =
            |i: u32, k: u32| crate::math::Uint::to_unit(Wrapping((i * 3 + k).wrapping_mul(2_654_435_769)));
        (0..count).map(|i| point([0, 1, 2].map(|k| 10.0 * unit(i, k)), [1.0 + unit(i, 7); 3])).collect()
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
        let far = point([100.0, 0.0, 0.0], [1.0; 3]);
        let near = point([1.0, 0.0, 0.0], [1.0; 3]);
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
            let own = flat::bounds(&corners, [0.0, 0.0, 1.0], 1.0, [(1 << i) as f32; 3]);
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

    /// Choices from some places, by lanes that ask all together and by each alone.
    struct Choices<'a> {
        tree: &'a LightTree,
        /// p, n and u of each.
        places: &'a [[f32; 7]],
        alone: bool,
    }

    impl Kernel for Choices<'_> {
        type Output = Vec<[u32; 3]>;

        #[inline(always)]
        fn run<F: LaneFloat>(self) -> Self::Output {
            let mut all = Vec::new();
            for from in (0..512).step_by(F::LANES) {
                let column = |k: usize| {
                    let mut column = [0.0; MAX_LANES];
                    (0..F::LANES).for_each(|lane| column[lane] = self.places[from + lane][k]);
                    F::load(&column)
                };
                let p = Vec3::new(column(0), column(1), column(2));
                let n = Vec3::new(column(3), column(4), column(5)).normalized();
                let u = column(6);
                let asked = if self.alone { 0..F::LANES } else { 0..1 };
                for lane in asked {
                    let lanes = if self.alone { lane..lane + 1 } else { 0..F::LANES };
                    let asks = F::Mask::from_bits(lanes.clone().map(|lane| 1 << lane).sum());
                    let (light, chance) = self.tree.choose(p, n, u, asks);
                    let again = self.tree.chance(p, n, light, asks);
                    let [light, chance, again] = [light, chance.to_bits(), again.to_bits()].map(words);
                    all.extend(lanes.map(|lane| [light[lane], chance[lane], again[lane]]));
                }
            }
            all
        }
    }

    #[test]
    fn lanes_choose_alike_alone_and_together_at_every_level() {
        let stream = &mut Stream::new(45, 0, 0);
        let places: Vec<[f32; 7]> = (0..512)
            .map(|_| {
                let mut unit = || stream.random::<f32>();
                [2.7 + 6.6 * unit(), 2.7 + 6.6 * unit(), 1.0 + 2.0 * unit(), unit(), unit(), unit(), unit()]
            })
            .collect();
        let places = &places[..];
        // A ring of triangles, of which some places are near and others far.
        let ring: Vec<_> = (0..60)
            .map(|i| {
                let at = |turn: f32, r: f32| [6.0 + r * turn.cos(), 6.0 + r * turn.sin(), 2.0 + 0.01 * turn];
                let turn = i as f32 / 10.0;
                let corners = [at(turn, 1.0), at(turn, 1.3), at(turn + 0.1, 1.2)];
                let own = flat::bounds(&corners, [0.0, 0.0, -1.0], 0.1 + 0.01 * i as f32, [1.0; 3]);
                LightBounds { mesh: Some(3), ..own }
            })
            .collect();
        for bounds in
            [scattered(2), scattered(8), scattered(500), ring.clone(), [ring, scattered(70)].concat()]
        {
            let tree = LightTree::new(&bounds);
            let tree = &tree;
            if bounds.len() == 60 {
                // Of most packets some lanes are far from all, and most are not.
                let is_near = |place: &&[f32; 7]| {
                    let [p, n] = [0, 3].map(|i| Vec3::<f32>::splat([place[i], place[i + 1], place[i + 2]]));
                    !Importance::of(&tree.top, 0, tree.kinds, p, n).is_far
                };
                let near = places.iter().filter(is_near).count();
                assert!((260..420).contains(&near), "{near} near places");
            }
            let truth = dispatch(Level::SCALAR, Choices { tree, places, alone: false });
            let lights = truth.iter().map(|choice| choice[0]).collect::<std::collections::HashSet<_>>();
            assert!(lights.len() > bounds.len() / 5);
            for level in Level::available() {
                for alone in [false, true] {
                    assert!(dispatch(level, Choices { tree, places, alone }) == truth, "{level}, {alone}");
                }
            }
        }
    }

    #[test]
    fn ten_thousand_lights_in_one_place_still_make_a_tree() {
        let tree = LightTree::new(&vec![point([1.0; 3], [1.0; 3]); 10_000]);
        let p = Vec3::<f32>::zero();
        let sum: f64 = (0..10_000).map(|l| f64::from(tree.chance(p, p, Wrapping(l), true))).sum();
        assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    }
}
