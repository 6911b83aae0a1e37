//! Traversal of the tree, one ray at a time: each ray is tested against eight boxes, or the eight items of a leaf, at
//! once.
//!
//! After a bounce the rays of a packet are incoherent: traversed together, they would visit the nodes of all of them
//! with most lanes idle.

use super::build::MAX_DEPTH;
use super::node::{Child, Node, Nodes, Target, WIDTH};
use super::tree::Bvh;
use crate::math::lanes::{Kernel, MAX_LANES};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Mask, Ray, Vec3};
use crate::shape::{CustomShape, NOTHING, Shape, ShearedRay, TriangleHit};
use crate::world::{Hit, NO_INSTANCE};

/// The size of the stack of pending children: at most seven at each level.
const STACK: usize = (MAX_DEPTH * (WIDTH - 1)).next_power_of_two();

/// A child to be visited later, and the distance at which the ray enters its box.
#[derive(Clone, Copy)]
struct Pending {
    near: f32,
    child: Child,
}

/// The rays of all lanes, one column for each component. Times are left out, as nothing in a tree moves.
#[derive(Clone, Copy)]
pub(super) struct Rays {
    o: [[f32; MAX_LANES]; 3],
    d: [[f32; MAX_LANES]; 3],
    /// Bit `i` is set if lane `i` has a ray.
    active: u32,
}

#[inline(always)]
fn columns<F: LaneFloat>(v: Vec3<F>) -> [[f32; MAX_LANES]; 3] {
    [column(v.x), column(v.y), column(v.z)]
}

impl Rays {
    #[inline(always)]
    pub(super) fn new<F: LaneFloat>(ray: &Ray<F>, active: F::Mask) -> Rays {
        Rays { o: columns(ray.o), d: columns(ray.d), active: active.bits() }
    }

    /// Calls `f` for each lane that has a ray.
    #[inline(always)]
    fn for_each(&self, mut f: impl FnMut(usize, Ray<f32>)) {
        let mut lanes = self.active;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & (MAX_LANES - 1);
            lanes &= lanes - 1;
            let get = |columns: &[[f32; MAX_LANES]; 3]| {
                Vec3::new(columns[0][lane], columns[1][lane], columns[2][lane])
            };
            f(lane, Ray::new(get(&self.o), get(&self.d)));
        }
    }
}

/// One ray, copied to eight lanes, with the values that box tests use.
struct Probe<F> {
    ray: Ray<F>,
    /// The ray in the form that triangle tests use, and the order of its axes.
    sheared: (ShearedRay<F>, [usize; 3]),
    /// 1/d.
    inverse: Vec3<F>,
    /// The origin for near planes and the one for far planes, moved apart by the error bound of a hit: a fraction of
    /// the origin's largest coordinate (see [`BOUNDS_ERROR`](crate::shape::BOUNDS_ERROR)).
    near_o: Vec3<F>,
    far_o: Vec3<F>,
    /// The indices of the near planes in a node.
    near: [usize; 3],
    /// The indices of the far planes in a node.
    far: [usize; 3],
}

impl<F: LaneFloat> Probe<F> {
    #[inline(always)]
    fn new(ray: &Ray<f32>, share: f32) -> Self {
        let (o, d) = ([ray.o.x, ray.o.y, ray.o.z], [ray.d.x, ray.d.y, ray.d.z]);
        let error = ray.o.max_abs() * share;
        let splat = |v: [f32; 3]| Vec3::<F>::splat(v);
        // The sign of zero matters: its inverse is an infinity of the same sign.
        let back = d.map(|d| d.is_sign_negative());
        let moved = |i: usize, by: f32| o[i] + if back[i] { -by } else { by };
        Probe {
            ray: Ray::new(splat(o), splat(d)),
            sheared: ShearedRay::one(ray),
            inverse: splat(d.map(|d| 1.0 / d)),
            near_o: splat([0, 1, 2].map(|i| moved(i, error))),
            far_o: splat([0, 1, 2].map(|i| moved(i, -error))),
            near: [0, 1, 2].map(|i| if back[i] { i + 3 } else { i }),
            far: [0, 1, 2].map(|i| if back[i] { i } else { i + 3 }),
        }
    }

    /// The distances at which the ray enters the boxes of a node's children, and the lanes of the boxes that it enters
    /// no later than at `t_max`.
    ///
    /// For a ray in the plane of a side, 0·∞ = NaN, which `min` and `max` ignore.
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: F) -> (F, F::Mask) {
        let plane = |i: usize| F::load(&node.planes[i]);
        let near = ((plane(self.near[0]) - self.near_o.x) * self.inverse.x).max(F::zero());
        let near = ((plane(self.near[1]) - self.near_o.y) * self.inverse.y).max(near);
        let near = ((plane(self.near[2]) - self.near_o.z) * self.inverse.z).max(near);
        let far = ((plane(self.far[0]) - self.far_o.x) * self.inverse.x).min(t_max);
        let far = ((plane(self.far[1]) - self.far_o.y) * self.inverse.y).min(far);
        let far = ((plane(self.far[2]) - self.far_o.z) * self.inverse.z).min(far);
        (near, near.le(far))
    }
}

/// Visits the leaves whose boxes a ray enters no later than at `t_max`, nearest children first. `leaf` returns the new
/// `t_max`, or `None` to end the traversal.
#[inline(always)]
fn visit<F: LaneFloat, const NEAREST_FIRST: bool>(
    tree: &Nodes,
    probe: &Probe<F>,
    mut t_max: f32,
    stack: &mut [Pending; STACK],
    mut leaf: impl FnMut(Target, f32) -> Option<f32>,
) {
    let mut top = 0;
    let mut child = tree.root;
    loop {
        match child.target() {
            Target::Node(index) => {
                let node = &tree.nodes[index];
                let (near, entered) = probe.enter(node, F::splat(t_max));
                let mut lanes = entered.bits();
                if lanes == 0 {
                    // Most nodes that are culled here are pending ones.
                } else {
                    let first = lanes.trailing_zeros() as usize & (WIDTH - 1);
                    lanes &= lanes - 1;
                    if lanes == 0 {
                        child = node.children[first];
                        continue;
                    }
                    let mut nears = [0.0; MAX_LANES];
                    near.store(&mut nears);
                    let second = lanes.trailing_zeros() as usize & (WIDTH - 1);
                    lanes &= lanes - 1;
                    let pending = |lane: usize| Pending { near: nears[lane], child: node.children[lane] };
                    let (mut nearest, mut next) = (pending(first), pending(second));
                    if NEAREST_FIRST && next.near < nearest.near {
                        (nearest, next) = (next, nearest);
                    }
                    tree.prefetch(nearest.child);
                    tree.prefetch(next.child);
                    let base = top;
                    stack[top & (STACK - 1)] = next;
                    top += 1;
                    while lanes != 0 {
                        let lane = lanes.trailing_zeros() as usize & (WIDTH - 1);
                        lanes &= lanes - 1;
                        let mut new = pending(lane);
                        if !NEAREST_FIRST {
                            stack[top & (STACK - 1)] = new;
                            top += 1;
                            continue;
                        }
                        if new.near < nearest.near {
                            (nearest, new) = (new, nearest);
                        }
                        // Farther children go deeper into the stack.
                        let mut at = top;
                        while at > base && stack[(at - 1) & (STACK - 1)].near < new.near {
                            stack[at & (STACK - 1)] = stack[(at - 1) & (STACK - 1)];
                            at -= 1;
                        }
                        stack[at & (STACK - 1)] = new;
                        top += 1;
                    }
                    child = nearest.child;
                    continue;
                }
            }
            target => match leaf(target, t_max) {
                Some(nearer) => t_max = nearer,
                None => return,
            },
        }
        // A box that is entered at the distance of the best hit may hold a hit with a lower row.
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            let next = stack[top & (STACK - 1)];
            if next.near <= t_max {
                child = next.child;
                break;
            }
        }
    }
}

/// A hit on a surface other than a triangle.
#[inline(always)]
fn without_weights<F: LaneFloat>(t: F) -> TriangleHit<F> {
    TriangleHit { t, weights: [F::zero(); 2] }
}

/// The hits of a ray on eight items, and their rows. `UNIT` means that the ray's direction has unit length.
#[inline(always)]
fn meetings<'a, F: LaneFloat, const UNIT: bool>(
    tree: &'a Nodes,
    target: Target,
    probe: &Probe<F>,
) -> (TriangleHit<F>, &'a [u32; WIDTH]) {
    let ray = &probe.ray;
    match target {
        Target::Triangles(index) => {
            let block = &tree.triangles[index];
            let (sheared, order) = &probe.sheared;
            let may_have_needles = index < tree.first_without_needles;
            (sheared.intersect(block.corners(*order), may_have_needles), &block.rows)
        }
        Target::Spheres(index) => {
            let block = &tree.spheres[index];
            let form = block.lanes();
            let t = if UNIT { form.intersect(ray) } else { form.intersect_any_length(ray) };
            (without_weights(t), &block.rows)
        }
        Target::Quads(index) => {
            let block = &tree.quads[index];
            (without_weights(block.lanes().intersect(ray)), &block.rows)
        }
        Target::Node(_) | Target::Lone(_) => unreachable!("no leaf"),
    }
}

/// The first hits of the rays of all lanes: see [`crate::world::Hit`].
pub(super) struct Found {
    pub(super) t: [f32; MAX_LANES],
    pub(super) surface: [u32; MAX_LANES],
    pub(super) instance: [u32; MAX_LANES],
    pub(super) weights: [[f32; MAX_LANES]; 2],
}

impl Found {
    pub(super) const NOTHING: Found = Found {
        t: [NOTHING; MAX_LANES],
        surface: [u32::MAX; MAX_LANES],
        instance: [NO_INSTANCE; MAX_LANES],
        weights: [[0.0; MAX_LANES]; 2],
    };
}

/// The first hit of one ray so far.
#[derive(Clone, Copy)]
struct Nearest {
    t: f32,
    surface: u32,
    instance: u32,
    weights: [f32; 2],
}

impl Nearest {
    /// Tests a custom shape of an instance.
    #[inline(always)]
    fn test_custom(&mut self, (shape, surface): &(CustomShape, u32), ray: &Ray<f32>, instance: u32) {
        let t = shape.intersect(ray);
        let lower = (instance, *surface) < (self.instance, self.surface);
        if t < self.t || (t == self.t && t < NOTHING && lower) {
            *self = Nearest { t, surface: *surface, instance, weights: [0.0; 2] };
        }
    }

    /// Tests a leaf in the tree of an instance.
    #[inline(always)]
    fn test_leaf<F: LaneFloat, const UNIT: bool>(
        &mut self,
        tree: &Nodes,
        target: Target,
        probe: &Probe<F>,
        instance: u32,
    ) {
        let (TriangleHit { t, weights }, surfaces) = meetings::<F, UNIT>(tree, target, probe);
        let mut near = (t.lt(F::splat(NOTHING)) & t.le(F::splat(self.t))).bits();
        if near == 0 {
            return;
        }
        let mut each = [0.0; MAX_LANES];
        t.store(&mut each);
        while near != 0 {
            let i = near.trailing_zeros() as usize & (WIDTH - 1);
            near &= near - 1;
            // Ties go to the lower instance and then to the lower surface, so that the order of visits does not matter.
            let lower = (instance, surfaces[i]) < (self.instance, self.surface);
            if each[i] < self.t || (each[i] == self.t && lower) {
                let weights = [weights[0].lane(i), weights[1].lane(i)];
                *self = Nearest { t: each[i], surface: surfaces[i], instance, weights };
            }
        }
    }
}

/// The first hits of some rays.
pub(super) struct Closest<'a> {
    pub(super) world: &'a Bvh,
    pub(super) tree: &'a Nodes,
    pub(super) rays: Rays,
    /// The maximum distances of hits.
    pub(super) t_max: [f32; MAX_LANES],
}

// Closures, too, must be inlined into code that is compiled for the level; otherwise they run without its instructions.
impl Kernel for Closest<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Found {
        let Closest { world, tree, rays, t_max } = self;
        let nothing = Pending { near: 0.0, child: tree.root };
        let mut stack = [nothing; STACK];
        // Clearing a stack takes longer than many traversals, and most scenes need no second stack.
        let mut inner_stack = (!world.instances.is_empty()).then_some([nothing; STACK]);
        let mut found = Found::NOTHING;
        rays.for_each(
            #[inline(always)]
            |lane, ray| {
                let probe = Probe::<F::Octet>::new(&ray, world.share);
                let limit = t_max[lane];
                let (surface, instance) = (u32::MAX, NO_INSTANCE);
                let mut nearest = Nearest { t: limit, surface, instance, weights: [0.0; 2] };
                visit::<_, true>(
                    tree,
                    &probe,
                    limit,
                    &mut stack,
                    #[inline(always)]
                    |target, t_max| {
                        let (Target::Lone(instance), Some(inner_stack)) = (target, &mut inner_stack) else {
                            nearest.test_leaf::<_, true>(tree, target, &probe, NO_INSTANCE);
                            return Some(nearest.t);
                        };
                        let mesh = &world.meshes[world.instances.mesh[instance] as usize];
                        let ray = world.instances.place(instance).ray(&ray);
                        let probe = Probe::<F::Octet>::new(&ray, world.share_within);
                        visit::<_, true>(
                            mesh,
                            &probe,
                            t_max,
                            inner_stack,
                            #[inline(always)]
                            |target, _| {
                                let number = instance as u32 + 1;
                                match target {
                                    Target::Lone(i) => nearest.test_custom(&mesh.custom[i], &ray, number),
                                    target => nearest.test_leaf::<_, false>(mesh, target, &probe, number),
                                }
                                Some(nearest.t)
                            },
                        );
                        Some(nearest.t)
                    },
                );
                if nearest.surface == u32::MAX {
                    return;
                }
                found.t[lane] = nearest.t;
                found.surface[lane] = nearest.surface;
                found.instance[lane] = nearest.instance;
                found.weights[0][lane] = nearest.weights[0];
                found.weights[1][lane] = nearest.weights[1];
            },
        );
        found
    }
}

/// The lanes whose rays hit something before a distance: bit `i` is lane `i`.
pub(super) struct Any<'a> {
    pub(super) world: &'a Bvh,
    pub(super) tree: &'a Nodes,
    pub(super) rays: Rays,
    pub(super) t_max: [f32; MAX_LANES],
    /// Bit `i` is set if lane `i` ignores meshes.
    pub(super) ignores_meshes: u32,
}

impl Kernel for Any<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> u32 {
        let Any { world, tree, rays, t_max, ignores_meshes } = self;
        let nothing = Pending { near: 0.0, child: tree.root };
        let mut stack = [nothing; STACK];
        // Clearing a stack takes longer than many traversals, and most scenes need no second stack.
        let mut inner_stack = (!world.instances.is_empty()).then_some([nothing; STACK]);
        let mut met = 0;
        rays.for_each(
            #[inline(always)]
            |lane, ray| {
                let probe = Probe::<F::Octet>::new(&ray, world.share);
                let limit = t_max[lane];
                let mut meets = false;
                let ignores_meshes = ignores_meshes >> lane & 1 != 0;
                visit::<_, false>(
                    tree,
                    &probe,
                    limit,
                    &mut stack,
                    #[inline(always)]
                    |target, limit| {
                        if ignores_meshes && matches!(target, Target::Triangles(_) | Target::Lone(_)) {
                            return Some(limit);
                        }
                        if let (Target::Lone(instance), Some(inner_stack)) = (target, &mut inner_stack) {
                            let mesh = &world.meshes[world.instances.mesh[instance] as usize];
                            let ray = world.instances.place(instance).ray(&ray);
                            let probe = Probe::<F::Octet>::new(&ray, world.share_within);
                            visit::<_, false>(
                                mesh,
                                &probe,
                                limit,
                                inner_stack,
                                #[inline(always)]
                                |target, limit| {
                                    meets = match target {
                                        Target::Lone(custom) => mesh.custom[custom].0.intersect(&ray) < limit,
                                        target => {
                                            let t = meetings::<_, false>(mesh, target, &probe).0.t;
                                            t.lt(F::Octet::splat(limit)).any()
                                        }
                                    };
                                    (!meets).then_some(limit)
                                },
                            );
                        } else {
                            let t = meetings::<_, true>(tree, target, &probe).0.t;
                            meets = t.lt(F::Octet::splat(limit)).any();
                        }
                        (!meets).then_some(limit)
                    },
                );
                met |= u32::from(meets) << lane;
            },
        );
        met
    }
}

/// A component for each lane.
#[inline(always)]
fn column<F: LaneFloat>(x: F) -> [f32; MAX_LANES] {
    let mut column = [0.0; MAX_LANES];
    x.store(&mut column);
    column
}

impl Bvh {
    /// The first hit of each ray at a distance of at most `t_max`; otherwise a farther hit or none. The hits of lanes
    /// outside `active` are unspecified.
    #[inline(always)]
    pub fn intersect_within<F: LaneFloat>(&self, ray: &Ray<F>, t_max: F, active: F::Mask) -> Hit<F> {
        let Some(tree) = &self.tree else { return Hit::none() };
        let active = active & tree.reached(ray, t_max, self.share);
        if !active.any() {
            return Hit::none();
        }
        let rays = Rays::new(ray, active);
        let found = F::with_octets(Closest { world: self, tree, rays, t_max: column(t_max) });
        Hit {
            t: F::load(&found.t),
            surface: F::Uint::load(&found.surface),
            instance: F::Uint::load(&found.instance),
            weights: [F::load(&found.weights[0]), F::load(&found.weights[1])],
        }
    }

    /// The lanes whose rays hit anything: see [`World::occluded`](crate::world::World::occluded).
    #[inline(always)]
    pub fn occluded<F: LaneFloat>(
        &self,
        ray: &Ray<F>,
        limit: F,
        active: F::Mask,
        ignores_meshes: F::Mask,
    ) -> F::Mask {
        let Some(tree) = &self.tree else { return F::Mask::splat(false) };
        let active = if self.is_of_meshes { active & !ignores_meshes } else { active };
        if !active.any() {
            return active;
        }
        let active = active & tree.reached(ray, limit, self.share);
        if !active.any() {
            return active;
        }
        let rays = Rays::new(ray, active);
        let ignores_meshes = ignores_meshes.bits();
        let any = Any { world: self, tree, rays, t_max: column(limit), ignores_meshes };
        F::Mask::from_bits(F::with_octets(any))
    }
}
