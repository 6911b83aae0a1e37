//! Many paths at once: lanes that each follow one, and take up the next when it ends.

use super::observe::{Event, Observer, first, ray_event, rgb, vec3};
use super::paths::{Finished, Paths, Sample, Settings};
use super::queue::{Queue, Start};
use crate::material::Bsdf;
use crate::math::lanes::{Kernel, MAX_LANES};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3};
use crate::sampling::PathId;
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};

/// How a path gathers light at each of its vertices.
pub(super) trait Transport: Copy {
    /// What a path remembers of its last vertex.
    type Memory<F: Float>: Copy;

    /// What a path remembers when it leaves the camera.
    fn fresh<F: Float>() -> Self::Memory<F>;

    /// `a` where the mask holds, `b` elsewhere.
    fn select<F: Float>(mask: F::Mask, a: Self::Memory<F>, b: Self::Memory<F>) -> Self::Memory<F>;

    /// Takes every living path to its next surface and, from there, into its next direction. Returns the
    /// lanes that go on.
    fn step<F: Float>(
        self,
        view: &View<'_>,
        state: &mut State<F, Self::Memory<F>>,
        alive: F::Mask,
        rays: &mut u64,
        observer: &mut Observer<'_>,
    ) -> F::Mask;
}

/// What every path looks at and none changes.
pub(super) struct View<'a> {
    pub scene: &'a CompiledScene,
    pub world: &'a World,
    pub settings: &'a Settings,
}

/// Traces a block of paths, and returns how many rays that took; `None` if it was to stop before the end.
pub(super) struct TracePaths<'a, T> {
    pub view: View<'a>,
    pub transport: T,
    pub paths: &'a Paths<'a>,
    /// Whether to stop. It is asked once for a whole packet at each of its bounces: there is no other bound on the time
    /// that paths take.
    pub stop: &'a dyn Fn() -> bool,
    pub out: &'a mut Vec<Finished>,
    pub observer: Observer<'a>,
}

/// How far each lane's path has come.
#[derive(Clone, Copy)]
pub(super) struct State<F: Float, M> {
    pub id: PathId<F>,
    pub ray: Ray<F>,
    /// Bounces so far.
    pub depth: F::Uint,
    /// Product of f·|cos θ|/pdf so far.
    pub beta: Rgb<F>,
    /// Radiance found so far.
    pub l: Rgb<F>,
    pub memory: M,
}

impl<T: Transport> Kernel for TracePaths<'_, T> {
    type Output = Option<u64>;

    #[inline(always)]
    fn run<F: Float>(self) -> Option<u64> {
        let TracePaths { view, transport, paths, stop, out, mut observer } = self;
        let mut queue = Queue::new(paths);
        let mut start = Start::<F>::nowhere();
        let mut state = State::<F, T::Memory<F>> {
            id: start.id,
            ray: Ray::none(),
            depth: F::Uint::splat(0),
            beta: Rgb::black(),
            l: Rgb::black(),
            memory: T::fresh(),
        };
        let mut alive = F::Mask::splat(false);
        let mut rays = 0;
        loop {
            // Dead lanes take up the next paths.
            let started = queue.take(!alive, view.settings, &view.scene.camera, &mut start, &mut state.ray);
            state.id = start.id;
            state.depth = F::Uint::select(started, F::Uint::splat(0), state.depth);
            state.beta = Rgb::select(started, Rgb::splat([1.0; 3]), state.beta);
            state.l = state.l.only(!started);
            state.memory = T::select::<F>(started, T::fresh(), state.memory);
            alive = alive | started;
            if !alive.any() {
                return Some(rays);
            }
            if stop() {
                return None;
            }

            let went_on = transport.step(&view, &mut state, alive, &mut rays, &mut observer);

            let ended = alive & !went_on;
            alive = went_on;
            if ended.any() {
                push(ended, &start, state.l, out);
            }
        }
    }
}

/// Appends the samples of paths that have ended.
#[inline(always)]
fn push<F: Float>(ended: F::Mask, start: &Start<F>, l: Rgb<F>, out: &mut Vec<Finished>) {
    let (mut slot, mut pixel, mut sample) = ([0; MAX_LANES], [0; MAX_LANES], [0; MAX_LANES]);
    let [mut x, mut y, mut r, mut g, mut b] = [[0.0; MAX_LANES]; 5];
    start.slot.store(&mut slot);
    start.id.pixel.store(&mut pixel);
    start.id.sample.store(&mut sample);
    start.x.store(&mut x);
    start.y.store(&mut y);
    l.r.store(&mut r);
    l.g.store(&mut g);
    l.b.store(&mut b);
    let mut lanes = ended.bits();
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (MAX_LANES - 1);
        lanes &= lanes - 1;
        let radiance = [r[lane], g[lane], b[lane]];
        let sample = Sample { pixel: pixel[lane], sample: sample[lane], x: x[lane], y: y[lane], radiance };
        out.push(Finished { slot: slot[lane], sample });
    }
}

/// A point where a path met a surface.
pub(super) struct Vertex<F: Float> {
    /// The lanes that met one.
    pub met: F::Mask,
    pub hit: Hit<F>,
    pub at: Interaction<F>,
    /// Radiance emitted back along the ray.
    pub emitted: Rgb<F>,
}

/// Follows every living path's ray. What leaves the scene sees lights at infinity, with the weight that a path's memory
/// gives to the density with which they would have been sampled; `None` if that is all.
#[inline(always)]
pub(super) fn meet<F: Float, M>(
    view: &View<'_>,
    state: &mut State<F, M>,
    alive: F::Mask,
    rays: &mut u64,
    observer: &mut Observer<'_>,
    weight: impl Fn(&M, F) -> F,
) -> Option<Vertex<F>> {
    let scene = view.scene;
    *rays += u64::from(alive.bits().count_ones());
    if observer.listens::<F>() {
        let mut depth = [0; MAX_LANES];
        state.depth.store(&mut depth);
        observer.event::<F>(|| ray_event(depth[0], &state.ray));
    }
    let hit = view.world.intersect(&state.ray, alive);
    let met = alive & hit.is_some();
    let escaped = alive & !hit.is_some();
    if escaped.any() {
        let radiance = scene.lights.escaped(
            state.ray.d,
            #[inline(always)]
            |pdf| weight(&state.memory, pdf),
        );
        state.l = Rgb::select(escaped, state.l + state.beta * radiance, state.l);
        observer.event::<F>(|| Event::Escape { radiance: rgb(radiance) });
    }
    if !met.any() {
        observer.event::<F>(|| Event::End { reason: "it left the scene", radiance: rgb(state.l) });
        return None;
    }

    let at = scene.interaction(&state.ray, &hit, met, Uv::WherePatterned);
    let emitted = scene.emitted(&at);
    if observer.listens::<F>() {
        let (mut row, mut resolved) = ([0; MAX_LANES], [0; MAX_LANES]);
        at.point.row.store(&mut row);
        at.material.store(&mut resolved);
        observer.event::<F>(|| Event::Hit {
            distance: hit.t.lane(0),
            point: vec3(at.point.p),
            normal: vec3(at.point.n),
            entity: scene.surfaces.entity(row[0]),
            material: resolved[0],
            emitted: rgb(emitted),
        });
    }
    Some(Vertex { met, hit, at, emitted })
}

/// How light scatters at a vertex.
pub(super) struct Scattering<F: Float> {
    pub bsdf: Bsdf<F>,
    pub frame: Frame<F>,
    /// Towards the last vertex, in the frame.
    pub wo: Vec3<F>,
}

impl<F: Float> Scattering<F> {
    #[inline(always)]
    pub(super) fn new(scene: &CompiledScene, at: &Interaction<F>, ray: &Ray<F>) -> Self {
        let frame = at.frame();
        Scattering { bsdf: scene.bsdf(at), wo: frame.to_local(-ray.d), frame }
    }
}

/// Sends paths on in directions drawn from their BxDFs, with the weights of the draw. Returns the lanes
/// whose throughput is nothing now.
#[inline(always)]
pub(super) fn go_on<F: Float, M>(
    state: &mut State<F, M>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    scattered: &crate::material::BxdfSample<F>,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let d = scattering.frame.to_world(scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight.only(at.passes(d, scattered.wi));
    state.ray = at.scattered(d);
    state.depth = state.depth + F::Uint::splat(1);
    // A throughput of nothing finds nothing; NaN is no such thing, and goes on to be counted.
    let beta = state.beta;
    let nothing = beta.r.abs().max(beta.g.abs()).max(beta.b.abs()).le(F::zero());
    observer.event::<F>(|| Event::Scatter {
        weight: rgb(scattered.weight),
        pdf: scattered.pdf.lane(0),
        throughput: rgb(beta),
    });
    if observer.listens::<F>() && first(nothing) {
        observer.event::<F>(|| Event::End {
            reason: "nothing is left of the throughput",
            radiance: rgb(state.l),
        });
    }
    nothing
}
