//! The choice among lights: a tree that is descended by estimates of the contribution of each branch.

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
use self::importance::{Importance, Kinds, reaches};
pub use self::node::{COUNT_FROM, LEAF, LightNode};
use self::node::{Each, Node, WIDTH};
use self::shares::Shares;
use super::bounds::LightBounds;
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Device, Kernel, MAX_LANES};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Mask, Uint, Vec3, value};

/// A tree over lights (Conty Estevez and Kulla 2018) with eight children per node. The importance of a node depends on
/// the mean position and the spread of its lights instead of their box, so that it still distinguishes sides for a
/// point among the lights.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// A node whose only child is the whole tree.
    top: Node,
    /// The nodes below it; none for a single light.
    nodes: Vec<Node>,
    kinds: Kinds,
    /// The units of power of each light.
    shares: Shares,
    /// The position of each light in the order of the tree.
    place: Vec<u32>,
    /// The units of each light.
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

    /// A light's position in the order of the tree.
    pub fn place(&self, light: usize) -> u32 {
        self.place[light]
    }

    /// A light's units of power.
    pub fn units(&self, light: usize) -> u32 {
        self.units[light]
    }

    /// See [`super::LightTable::choose`].
    #[inline(always)]
    pub(super) fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, active: F::Mask) -> (F::Uint, F) {
        let LightChoice { light, pmf } = F::device(&Choose(self), (p, n, u, active));
        (light, pmf)
    }

    /// See [`super::LightTable::pmf`].
    #[inline(always)]
    pub(super) fn pmf<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, active: F::Mask) -> F {
        F::device(&Pmf(self), (p, n, light, active))
    }

    /// Whether some of its lights may illuminate a point, by their directions of emission. It may be true where none
    /// does; where it is false, the importance of all of them is zero.
    #[inline(always)]
    pub fn reaches<F: Float>(&self, p: Vec3<F>) -> F::Mask {
        if !self.kinds.is_directed {
            return F::Mask::splat(true);
        }
        F::device(&Reaches(self), p)
    }

    #[inline(always)]
    fn choose_in_lanes<F: LaneFloat>(&self, p: Vec3<F>, n: Vec3<F>, u: F, active: F::Mask) -> (F::Uint, F) {
        let End { light, pmf, u, units, first_unit } =
            self.descend::<F, true>(p, n, u, F::Uint::splat(0), active);
        if !self.kinds.has_meshes {
            return (light, pmf);
        }
        // Among distant lights, a unit of their power is sampled. Adding all bits subtracts one.
        let is_far = active & F::Uint::splat(0).lt(units);
        let unit = (units.to_float() * u).to_uint();
        let unit = F::Uint::select(unit.lt(units), unit, units + F::Uint::splat(u32::MAX));
        let (one, own) = self.shares.find::<F>(unit + first_unit, is_far);
        let share = own.to_float() / units.to_float().max(F::splat(1.0));
        (F::Uint::select(is_far, one, light), F::select(is_far, pmf * share, pmf))
    }

    #[inline(always)]
    fn pmf_in_lanes<F: LaneFloat>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, active: F::Mask) -> F {
        let place = F::Uint::gather(&self.place, light);
        let End { pmf, units, .. } = self.descend::<F, false>(p, n, F::zero(), place, active);
        if !self.kinds.has_meshes {
            return pmf;
        }
        let own = F::Uint::gather(&self.units, light).to_float();
        let is_far = F::Uint::splat(0).lt(units);
        F::select(is_far, pmf * own / units.to_float().max(F::splat(1.0)), pmf)
    }

    /// Descends until the lights are distant or a single one is left. With `DRAWS` the children are sampled with `u`;
    /// otherwise the path leads to the light at a given position. Lanes outside `active` are unspecified.
    #[inline(always)]
    fn descend<F: LaneFloat, const DRAWS: bool>(
        &self,
        p: Vec3<F>,
        n: Vec3<F>,
        u: F,
        place: F::Uint,
        active: F::Mask,
    ) -> End<F> {
        let top = &self.top;
        let mut end = End {
            light: F::Uint::splat(top.link[0] & !LEAF),
            pmf: F::splat(1.0),
            u,
            units: F::Uint::splat(top.units[0]),
            first_unit: F::Uint::splat(0),
        };
        let Some(root) = self.nodes.first() else {
            end.units = F::Uint::splat(0);
            return end;
        };
        let mut going = active;
        if self.kinds.has_meshes {
            going = going & !Importance::of(top, 0, self.kinds, p, n).is_far;
        }
        end.units = F::Uint::select(going, F::Uint::splat(0), end.units);
        let mut node = F::Uint::splat(0);
        // At the root all lanes are processed together, if that is less work than one by one.
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
            end.pmf = F::select(going, choice.share, end.pmf);
            end.u = F::select(going, choice.u, end.u);
            let ends = going & is_far & !is_leaf;
            end.units = F::Uint::select(ends, F::Uint::gather(&root.units, choice.child), end.units);
            end.first_unit =
                F::Uint::select(ends, F::Uint::gather(&root.first_unit, choice.child), end.first_unit);
            going = going & !is_far & !is_leaf;
        }
        if going.any() {
            let mut lanes = Lanes::new(going.bits(), p, n, node, place, &end);
            F::with_octets(Descent::<DRAWS> { tree: self, lanes: &mut lanes });
            end = lanes.end();
        }
        end
    }
}

/// A chosen light.
#[derive(Clone, Copy, Debug)]
pub struct LightChoice<F: Float> {
    /// Its index.
    pub light: F::Uint,
    /// The pmf of the choice.
    pub pmf: F,
}

value!(LightChoice { light, pmf });

/// [`LightTree::choose`], with a descent for each lane.
struct Choose<'a>(&'a LightTree);

impl Device for Choose<'_> {
    const NAME: &'static str = "choose_light";
    type Arguments<F: Float> = (Vec3<F>, Vec3<F>, F, F::Mask);
    type Output<F: Float> = LightChoice<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (p, n, u, active): Self::Arguments<F>) -> LightChoice<F> {
        let (light, pmf) = self.0.choose_in_lanes(p, n, u, active);
        LightChoice { light, pmf }
    }
}

/// [`LightTree::pmf`], likewise.
struct Pmf<'a>(&'a LightTree);

impl Device for Pmf<'_> {
    const NAME: &'static str = "light_pmf";
    type Arguments<F: Float> = (Vec3<F>, Vec3<F>, F::Uint, F::Mask);
    type Output<F: Float> = F;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (p, n, light, active): Self::Arguments<F>) -> F {
        self.0.pmf_in_lanes(p, n, light, active)
    }
}

/// [`LightTree::reaches`], by the first lights or groups of lights.
struct Reaches<'a>(&'a LightTree);

impl Device for Reaches<'_> {
    const NAME: &'static str = "lights_reach";
    type Arguments<F: Float> = Vec3<F>;
    type Output<F: Float> = F::Mask;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, p: Vec3<F>) -> F::Mask {
        let root = self.0.nodes.first().unwrap_or(&self.0.top);
        let mut lit = F::Mask::splat(false);
        for i in 0..root.count {
            lit = lit | reaches(root, i, p);
            if !(!lit).any() {
                break;
            }
        }
        lit
    }
}

/// The end of a descent.
struct End<F: LaneFloat> {
    /// The light, unless the lights are distant.
    light: F::Uint,
    /// The probability of the path to it.
    pmf: F,
    /// The rest of the random number, again uniform.
    u: F,
    /// The units of distant lights; zero for a single light.
    units: F::Uint,
    /// The first of these units.
    first_unit: F::Uint,
}

/// The descents of some lanes, one column per number.
struct Lanes {
    /// Bit `i` is set if the descent of lane `i` continues.
    going: u32,
    p: [[f32; MAX_LANES]; 3],
    n: [[f32; MAX_LANES]; 3],
    node: [u32; MAX_LANES],
    place: [u32; MAX_LANES],
    light: [u32; MAX_LANES],
    pmf: [f32; MAX_LANES],
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
            p: [floats(p.x), floats(p.y), floats(p.z)],
            n: [floats(n.x), floats(n.y), floats(n.z)],
            node: words(node),
            place: words(place),
            light: words(end.light),
            pmf: floats(end.pmf),
            u: floats(end.u),
            units: words(end.units),
            first_unit: words(end.first_unit),
        }
    }

    #[inline(always)]
    fn end<F: LaneFloat>(&self) -> End<F> {
        End {
            light: F::Uint::load(&self.light),
            pmf: F::load(&self.pmf),
            u: F::load(&self.u),
            units: F::Uint::load(&self.units),
            first_unit: F::Uint::load(&self.first_unit),
        }
    }
}

/// Descends with one lane after the other, evaluating eight children at a time. If lanes are at different nodes,
/// gathering their children costs more than evaluating them.
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
            // An array's own `map` would not be inlined, and would run without the level's instructions.
            let at = |v: &[[f32; MAX_LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
            let p = Vec3::<F::Octet>::splat(at(&lanes.p));
            let n = Vec3::<F::Octet>::splat(at(&lanes.n));
            let (mut u, mut pmf, mut link) = (lanes.u[lane], lanes.pmf[lane], lanes.node[lane]);
            let place = Wrapping(lanes.place[lane]);
            let (mut units, mut first_unit) = (0, 0);
            while link < LEAF {
                let node = &nodes[link as usize];
                let importance = Importance::of(node, Each, *kinds, p, n);
                let mut values = [0.0; WIDTH];
                importance.value.store(&mut values);
                let choice = Choice::<f32>::new::<DRAWS>(node, values, u, place);
                let child = choice.child.0 as usize & (WIDTH - 1);
                pmf *= choice.share;
                u = choice.u;
                link = node.link[child];
                if importance.is_far.bits() >> child & 1 != 0 && link < LEAF {
                    (units, first_unit) = (node.units[child], node.first_unit[child]);
                    break;
                }
            }
            lanes.light[lane] = link & !LEAF;
            (lanes.u[lane], lanes.pmf[lane]) = (u, pmf);
            (lanes.units[lane], lanes.first_unit[lane]) = (units, first_unit);
        }
    }
}

#[cfg(test)]
mod tests;
