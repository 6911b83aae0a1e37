//! Many paths at once: lanes that each follow one, and take up the next when it ends.

use super::observe::{Event, Observer, first, ray_event, rgb, vec3};
use super::{Finished, Paths, Sample, Settings, camera_ray};
use crate::material::Bsdf;
use crate::math::lanes::{Kernel, MAX_LANES};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3};
use crate::sampling::{PathId, Sampler};
use crate::shape::offset_origin;
use crate::world::{CompiledScene, Hit, SurfacePoint, World};

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
    fn step<F: Float, W: World, S: Sampler, O: Observer>(
        self,
        view: &View<'_, W, S>,
        state: &mut State<F, Self::Memory<F>>,
        alive: F::Mask,
        rays: &mut u64,
        observer: &mut O,
    ) -> F::Mask;
}

/// What every path looks at and none changes.
pub(super) struct View<'a, W, S> {
    pub scene: &'a CompiledScene,
    pub world: &'a W,
    pub settings: &'a Settings<S>,
}

/// Traces a block of paths.
pub(super) struct TracePaths<'a, W, S, T, O> {
    pub view: View<'a, W, S>,
    pub transport: T,
    pub paths: &'a Paths<'a>,
    pub out: &'a mut Vec<Finished>,
    pub observer: &'a mut O,
}

/// Which path each lane follows: what does not change along it.
struct Identity {
    slot: [u32; MAX_LANES],
    pixel: [u32; MAX_LANES],
    sample: [u32; MAX_LANES],
    x: [f32; MAX_LANES],
    y: [f32; MAX_LANES],
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

impl<W: World, S: Sampler, T: Transport, O: Observer> Kernel for TracePaths<'_, W, S, T, O> {
    type Output = u64;

    #[inline(always)]
    fn run<F: Float>(self) -> u64 {
        let TracePaths { view, transport, paths, out, observer } = self;
        let View { scene, settings, .. } = view;
        let none = F::Mask::splat(false);
        let zero = F::Uint::splat(0);
        let mut identity = Identity {
            slot: [0; MAX_LANES],
            pixel: [0; MAX_LANES],
            sample: [0; MAX_LANES],
            x: [0.0; MAX_LANES],
            y: [0.0; MAX_LANES],
        };
        let mut state = State::<F, T::Memory<F>> {
            id: PathId { pixel: zero, sample: zero },
            ray: Ray { o: Vec3::zero(), d: Vec3::zero() },
            depth: zero,
            beta: Rgb::black(),
            l: Rgb::black(),
            memory: T::fresh(),
        };
        let mut alive = none;
        let mut rays = 0;
        if paths.is_empty() {
            return 0;
        }
        // The next path to start, as (pixel, sample) among `paths`.
        let (mut slot, mut sample) = (0, 0);
        loop {
            // Dead lanes take up the next paths.
            let idle = !alive;
            if slot < paths.pixels.len() && idle.any() {
                let mut started = 0;
                let mut lanes = idle.bits();
                while lanes != 0 && slot < paths.pixels.len() {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    started |= 1 << lane;
                    let pixel = paths.pixels[slot];
                    identity.slot[lane] = slot as u32;
                    identity.pixel[lane] = pixel.index;
                    identity.sample[lane] = paths.first_sample + sample;
                    identity.x[lane] = pixel.x as f32 + 0.5;
                    identity.y[lane] = pixel.y as f32 + 0.5;
                    sample += 1;
                    if sample == paths.samples {
                        (slot, sample) = (slot + 1, 0);
                    }
                }
                let started = F::Mask::from_bits(started);
                state.id =
                    PathId { pixel: F::Uint::load(&identity.pixel), sample: F::Uint::load(&identity.sample) };
                let film = [F::load(&identity.x), F::load(&identity.y)];
                let (x, y, ray) = camera_ray(settings, &scene.camera, state.id, film);
                F::select(started, x, film[0]).store(&mut identity.x);
                F::select(started, y, film[1]).store(&mut identity.y);
                state.ray.o = Vec3::select(started, ray.o, state.ray.o);
                state.ray.d = Vec3::select(started, ray.d, state.ray.d);
                state.depth = F::Uint::select(started, zero, state.depth);
                state.beta = Rgb::select(started, Rgb::splat([1.0; 3]), state.beta);
                state.l = state.l.only(!started);
                state.memory = T::select::<F>(started, T::fresh(), state.memory);
                alive = alive | started;
            }
            if !alive.any() {
                return rays;
            }

            let went_on = transport.step(&view, &mut state, alive, &mut rays, observer);

            let ended = alive & !went_on;
            alive = went_on;
            if ended.any() {
                let (mut r, mut g, mut b) = ([0.0; MAX_LANES], [0.0; MAX_LANES], [0.0; MAX_LANES]);
                state.l.r.store(&mut r);
                state.l.g.store(&mut g);
                state.l.b.store(&mut b);
                let mut lanes = ended.bits();
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize & (MAX_LANES - 1);
                    lanes &= lanes - 1;
                    out.push(Finished {
                        slot: identity.slot[lane],
                        sample: Sample {
                            pixel: identity.pixel[lane],
                            sample: identity.sample[lane],
                            x: identity.x[lane],
                            y: identity.y[lane],
                            radiance: [r[lane], g[lane], b[lane]],
                        },
                    });
                }
            }
        }
    }
}

/// A point where a path met a surface.
pub(super) struct Vertex<F: Float> {
    /// The lanes that met one.
    pub met: F::Mask,
    pub hit: Hit<F>,
    pub point: SurfacePoint<F>,
    /// Radiance emitted back along the ray.
    pub emitted: Rgb<F>,
    /// cos θ between the outward normal and the way back.
    pub cos_o: F,
    /// Row in the material table, checkerboards resolved.
    pub material: F::Uint,
}

/// Follows every living path's ray. What leaves the scene sees the environment; `None` if that is all.
#[inline(always)]
pub(super) fn meet<F: Float, W: World, S: Sampler, M, O: Observer>(
    view: &View<'_, W, S>,
    state: &mut State<F, M>,
    alive: F::Mask,
    rays: &mut u64,
    observer: &mut O,
) -> Option<Vertex<F>> {
    let scene = view.scene;
    *rays += u64::from(alive.bits().count_ones());
    if O::LISTENS {
        let mut depth = [0; MAX_LANES];
        state.depth.store(&mut depth);
        observer.event(|| ray_event(depth[0], &state.ray));
    }
    let hit = view.world.intersect(&state.ray);
    let met = alive & hit.is_some();
    let escaped = alive & !hit.is_some();
    if escaped.any() {
        let environment = Rgb::splat(scene.environment);
        state.l = Rgb::select(escaped, state.l + state.beta * environment, state.l);
        observer.event(|| Event::Escape { radiance: scene.environment });
    }
    if !met.any() {
        observer.event(|| Event::End { reason: "it left the scene", radiance: rgb(state.l) });
        return None;
    }

    let point = scene.surfaces.point(&state.ray, &hit);
    let cos_o = -state.ray.d.dot(point.n);
    let emitted = scene.surfaces.emission::<F>(point.surface).only(cos_o.gt(F::zero()));
    let mut material = scene.surfaces.material::<F>(point.surface);
    if scene.materials.uses_uv() && (met & scene.materials.is_checkerboard::<F>(material)).any() {
        let (u, v) = scene.surfaces.uv(&point);
        material = scene.materials.resolve(material, u, v);
    }
    if O::LISTENS {
        let (mut row, mut resolved) = ([0; MAX_LANES], [0; MAX_LANES]);
        point.surface.store(&mut row);
        material.store(&mut resolved);
        observer.event(|| Event::Hit {
            distance: hit.t.lane(0),
            point: vec3(point.p),
            normal: vec3(point.n),
            entity: scene.surfaces.rows()[row[0] as usize].1.entity,
            material: resolved[0],
            emitted: rgb(emitted),
        });
    }
    Some(Vertex { met, hit, point, emitted, cos_o, material })
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
    pub(super) fn new(scene: &CompiledScene, vertex: &Vertex<F>, ray: &Ray<F>) -> Self {
        let frame = Frame::around(vertex.point.n);
        Scattering { bsdf: scene.materials.bsdf(vertex.material), wo: frame.to_local(-ray.d), frame }
    }
}

/// Sends paths on in directions drawn from their BxDFs, with the weights of the draw. Returns the lanes
/// whose throughput is nothing now.
#[inline(always)]
pub(super) fn go_on<F: Float, M, O: Observer>(
    state: &mut State<F, M>,
    point: &SurfacePoint<F>,
    frame: &Frame<F>,
    scattered: &crate::material::BxdfSample<F>,
    observer: &mut O,
) -> F::Mask {
    let d = frame.to_world(scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight;
    state.ray = Ray { o: offset_origin(point.p, point.n, point.error, d), d };
    state.depth = state.depth + F::Uint::splat(1);
    // A throughput of nothing finds nothing; NaN is no such thing, and goes on to be counted.
    let beta = state.beta;
    let nothing = beta.r.abs().max(beta.g.abs()).max(beta.b.abs()).le(F::zero());
    observer.event(|| Event::Scatter {
        weight: rgb(scattered.weight),
        pdf: scattered.pdf.lane(0),
        throughput: rgb(beta),
    });
    if O::LISTENS && first(nothing) {
        observer.event(|| Event::End { reason: "nothing is left of the throughput", radiance: rgb(state.l) });
    }
    nothing
}
