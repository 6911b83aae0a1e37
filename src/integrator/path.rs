//! The report's path tracer, many paths at once.

use super::observe::{Event, Observer, Record, Silent, first, ray_event, rgb, vec3};
use super::{Finished, Integrator, Paths, Pixel, Sample, Settings, camera_ray};
use crate::material::Bxdf;
use crate::math::lanes::{Kernel, Level, MAX_LANES, dispatch};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3};
use crate::sampling::{Block, PathId, Sampler};
use crate::shape::offset_origin;
use crate::world::{CompiledScene, SurfacePoint, World};
use std::sync::Arc;

/// The path tracer of the report's §4.3: directions come from the BxDF alone, and lights are found by
/// chance. Point lights, which no path can hit, are sampled directly.
pub struct PathNaive<W, S> {
    /// The tables.
    pub scene: Arc<CompiledScene>,
    /// What rays meet.
    pub world: Arc<W>,
    /// Film, chance and depth.
    pub settings: Settings<S>,
}

impl<W: World, S: Sampler> Integrator for PathNaive<W, S> {
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        out.reserve(paths.len());
        dispatch(level, TracePaths { integrator: self, paths, out, observer: &mut Silent })
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        let paths = Paths { pixels: &[pixel], first_sample: sample, samples: 1 };
        let (mut out, mut record) = (Vec::new(), Record::default());
        let observer = &mut record;
        dispatch(Level::SCALAR, TracePaths { integrator: self, paths: &paths, out: &mut out, observer });
        (out[0].sample, record.0)
    }
}

struct TracePaths<'a, W, S, O> {
    integrator: &'a PathNaive<W, S>,
    paths: &'a Paths<'a>,
    out: &'a mut Vec<Finished>,
    observer: &'a mut O,
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
struct State<F: Float> {
    id: PathId<F>,
    ray: Ray<F>,
    /// Bounces so far.
    depth: F::Uint,
    /// Product of f·|cos θ|/pdf so far.
    beta: Rgb<F>,
    /// Radiance found so far.
    l: Rgb<F>,
}

impl<W: World, S: Sampler, O: Observer> Kernel for TracePaths<'_, W, S, O> {
    type Output = u64;

    #[inline(always)]
    fn run<F: Float>(self) -> u64 {
        let TracePaths { integrator, paths, out, observer } = self;
        let PathNaive { scene, world, settings } = integrator;
        let none = F::Mask::splat(false);
        let zero = F::Uint::splat(0);
        let mut identity = Identity {
            slot: [0; MAX_LANES],
            pixel: [0; MAX_LANES],
            sample: [0; MAX_LANES],
            x: [0.0; MAX_LANES],
            y: [0.0; MAX_LANES],
        };
        let mut state = State::<F> {
            id: PathId { pixel: zero, sample: zero },
            ray: Ray { o: Vec3::zero(), d: Vec3::zero() },
            depth: zero,
            beta: Rgb::black(),
            l: Rgb::black(),
        };
        let mut alive = none;
        let mut rays = 0;
        if paths.is_empty() {
            return 0;
        }
        // The next path to start, as (pixel, sample) among `paths`.
        let (mut slot, mut sample) = (0, 0);
        let last_depth = F::Uint::splat(settings.max_depth);
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
                alive = alive | started;
            }
            if !alive.any() {
                return rays;
            }

            rays += u64::from(alive.bits().count_ones());
            let went_on = step(scene, &**world, settings, &mut state, alive, last_depth, &mut rays, observer);

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

/// Takes every living path to its next surface and, from there, into its next direction. Returns the lanes
/// that go on.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "inlined into its only caller: the inside of its loop")]
fn step<F: Float, W: World, S: Sampler, O: Observer>(
    scene: &CompiledScene,
    world: &W,
    settings: &Settings<S>,
    state: &mut State<F>,
    alive: F::Mask,
    last_depth: F::Uint,
    rays: &mut u64,
    observer: &mut O,
) -> F::Mask {
    if O::LISTENS {
        let mut depth = [0; MAX_LANES];
        state.depth.store(&mut depth);
        observer.event(|| ray_event(depth[0], &state.ray));
    }
    let hit = world.intersect(&state.ray);
    let met = alive & hit.is_some();
    let escaped = alive & !hit.is_some();
    if escaped.any() {
        let environment = Rgb::splat(scene.environment);
        state.l = Rgb::select(escaped, state.l + state.beta * environment, state.l);
        if O::LISTENS {
            observer.event(|| Event::Escape { radiance: scene.environment });
        }
    }
    if !met.any() {
        if O::LISTENS {
            observer.event(|| Event::End { reason: "it left the scene", radiance: rgb(state.l) });
        }
        return met;
    }

    let point = scene.surfaces.point(&state.ray, &hit);
    let wo = -state.ray.d;
    let outward = wo.dot(point.n).gt(F::zero());
    let emitted = scene.surfaces.emission::<F>(point.surface).only(outward);
    state.l = Rgb::select(met, state.l + state.beta * emitted, state.l);

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
    let mut going = met & state.depth.lt(last_depth);
    if !going.any() {
        if O::LISTENS {
            observer.event(|| Event::End { reason: "the depth limit", radiance: rgb(state.l) });
        }
        return going;
    }

    let bsdf = scene.materials.bsdf::<F>(material);
    let frame = Frame::around(point.n);
    let wo = frame.to_local(wo);
    if !scene.point_lights.is_empty() {
        *rays += u64::from(going.bits().count_ones());
        let direct = point_light(scene, world, settings, state, &point, &frame, &bsdf, wo);
        state.l = Rgb::select(going, state.l + state.beta * direct, state.l);
        if O::LISTENS {
            observer.event(|| Event::Light { direction: [0.0; 3], added: rgb(direct) });
        }
    }

    let [u, v, lobe, _] = settings.sampler.draw(state.id, Block::SCATTER.at::<F>(state.depth));
    let scattered = bsdf.sample(wo, [u, v], lobe);
    let d = frame.to_world(scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight;
    state.ray = Ray { o: offset_origin(point.p, point.n, point.error, d), d };
    state.depth = state.depth + F::Uint::splat(1);
    // A throughput of nothing finds nothing; NaN is no such thing, and goes on to be counted.
    let beta = state.beta;
    let nothing = beta.r.abs().max(beta.g.abs()).max(beta.b.abs()).le(F::zero());
    if O::LISTENS {
        observer.event(|| Event::Scatter {
            weight: rgb(scattered.weight),
            pdf: scattered.pdf.lane(0),
            throughput: rgb(beta),
        });
        if first(nothing) {
            observer
                .event(|| Event::End { reason: "nothing is left of the throughput", radiance: rgb(state.l) });
        }
    }
    going = going & !nothing;
    going
}

/// Radiance that one point light sends along `wo` (in the frame) by way of a point.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "a part of `step` with a name")]
fn point_light<F: Float, W: World, S: Sampler>(
    scene: &CompiledScene,
    world: &W,
    settings: &Settings<S>,
    state: &State<F>,
    point: &SurfacePoint<F>,
    frame: &Frame<F>,
    bsdf: &crate::material::Bsdf<F>,
    wo: Vec3<F>,
) -> Rgb<F> {
    let [_, _, choice, _] = settings.sampler.draw(state.id, Block::LIGHT.at::<F>(state.depth));
    let light = scene.point_lights.sample_one(point.p, choice);
    let wi = frame.to_local(light.wi);
    let (shadow, length) = light.shadow_ray(offset_origin(point.p, point.n, point.error, light.wi));
    let visible = !world.occluded(&shadow, length);
    (bsdf.eval(wo, wi) * light.weight * wi.z.abs()).only(visible)
}
