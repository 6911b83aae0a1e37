//! Whitted ray tracing, as in the report's chapter 2.

use super::Integrator;
use super::first_hit::{FirstHit, FirstHits};
use super::holes::seen_through;
use super::interiors::{self, Around};
use super::observe::{Event, Observer, Passage, ray_event, rgb, vec3};
use super::paths::{Finished, Found, Paths, Settings, camera_ray};
use super::vertex::{State, TraceContext, with_material};
use crate::camera::Camera;
use crate::material::{self, Bxdf, Local, TransportMode};
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Level, dispatch_minor};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Vec3, value};
use crate::sampling::{PathId, Pixel, Sample, Stream};
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};
use rand::RngExt;
use std::sync::Arc;

/// Direct light on matte surfaces, perfect reflection and refraction, and an ambient term for everything else (Whitted
/// 1980; report ch. 2).
///
/// Each matte hit samples every light once, area lights at a random point. A mesh that emits is one light if it has
/// many triangles (see [`crate::light::LEAST_TRIANGLES`]), and otherwise one light per triangle. At glass both branches
/// are followed. Emitters of infinite area are visible but illuminate no surface.
///
/// All branches of a sample together pass through at most 1024 holes, because their count also distinguishes the random
/// numbers of the branches. Behind them, surfaces are opaque.
pub struct Whitted {
    /// The scene's tables.
    pub scene: Arc<CompiledScene>,
    /// The surfaces.
    pub world: Arc<World>,
    /// Film, sampler and depth.
    pub settings: Settings,
    /// The seed of the random points on lights.
    pub seed: u32,
}

/// A branch to follow: its ray, throughput, number of bounces, and surroundings.
type Branch = (Ray<f32>, Rgb<f32>, u32, Around<f32>);

impl Integrator for Whitted {
    fn trace_until(
        &self,
        _level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64> {
        let mut stack = Vec::new();
        let mut rays = 0;
        for (slot, &pixel) in paths.pixels.iter().enumerate() {
            for sample in paths.first_sample..paths.first_sample + paths.samples {
                let observer = &mut Observer::none();
                let sample = self.trace_one(pixel, sample, &mut stack, &mut rays, stop, observer);
                if stop() {
                    // Tracing may have been stopped.
                    return None;
                }
                out.finished.push(Finished { slot: slot as u32, sample });
            }
        }
        Some(rays)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        let context = TraceContext { scene: &self.scene, world: &self.world, settings: &self.settings };
        dispatch_minor(level, FirstHits { context, paths, out });
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        let (scene, world) = (Arc::new(self.scene.seen_by(camera, &self.world)), Arc::clone(&self.world));
        Box::new(Whitted { scene, world, settings: self.settings, seed: self.seed })
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        let mut events = Vec::new();
        let observer = &mut Observer::of(&mut events);
        let sample = self.trace_one(pixel, sample, &mut Vec::new(), &mut 0, &|| false, observer);
        (sample, events)
    }
}

impl Whitted {
    /// Follows one path, until `stop` returns true.
    fn trace_one(
        &self,
        pixel: Pixel,
        sample: u32,
        stack: &mut Vec<Branch>,
        rays: &mut u64,
        stop: &dyn Fn() -> bool,
        observer: &mut Observer<'_>,
    ) -> Sample {
        let id = PathId::<f32> { pixel: Wrapping(pixel.index), sample: Wrapping(sample) };
        let centre = [pixel.x as f32 + 0.5, pixel.y as f32 + 0.5];
        let (x, y, ray) = camera_ray(&self.settings, &self.scene.camera, id, centre);
        let mut stream = Stream::new(self.seed, pixel.index, sample);
        let (mut l, mut holes) = (Rgb::black(), 0);
        stack.push((ray, Rgb::splat([1.0; 3]), 0, Around::at_camera(&self.scene)));
        while let Some(branch) = stack.pop() {
            if stop() {
                break;
            }
            l = l + self.follow(id, branch, &mut holes, stack, &mut stream, rays, observer);
        }
        observer.event::<f32>(|| Event::End { reason: "no branch is left", radiance: rgb(l) });
        Sample { pixel: pixel.index, sample, x, y, radiance: [l.r, l.g, l.b] }
    }

    /// The radiance that a branch adds to the sample. Pushes the branches that it splits into. `holes` counts the holes
    /// that the sample has passed.
    #[allow(
        clippy::too_many_arguments,
        reason = "they are what a sample keeps while its branches are followed"
    )]
    fn follow(
        &self,
        id: PathId<f32>,
        (ray, beta, depth, around): Branch,
        holes: &mut u32,
        stack: &mut Vec<Branch>,
        stream: &mut Stream,
        rays: &mut u64,
        observer: &mut Observer<'_>,
    ) -> Rgb<f32> {
        let scene = &*self.scene;
        *rays += 1;
        observer.event::<f32>(|| ray_event::<f32>(Wrapping(depth), &ray));
        let hit = self.world.intersect(&ray, true);
        let beta = interiors::absorbed(scene, &around, beta, hit.t);
        if !hit.is_some() {
            let radiance = scene.lights.escaped(ray.d, |_| 1.0);
            observer.event::<f32>(|| Event::Escape { radiance: rgb(radiance) });
            return beta * radiance;
        }
        let context = TraceContext { scene, world: &self.world, settings: &self.settings };
        let state = State { depth: Wrapping(depth), ..State::start(id, ray) };
        let around = Around { holes: Wrapping(*holes), ..around };
        let lit = Lit::new(&context, &state, around, &hit);
        let Lit { at, emitted, local, wo, .. } = lit;
        let bsdf = scene.materials.bsdf_of(local);
        let point = &at.point;
        observer.event::<f32>(|| Event::Hit {
            distance: hit.t,
            point: vec3(point.p),
            normal: vec3(point.n),
            entity: scene.surfaces.entity(point.row.0),
            material: at.material.0,
            emitted: rgb(emitted),
        });
        let mut l = emitted;
        if lit.is_none || lit.is_hole {
            let beyond = lit.pass_on(&ray);
            let through = if lit.is_hole { Passage::Hole } else { Passage::NoInterface };
            observer.event::<f32>(|| Event::Pass { through });
            *holes = beyond.around.holes.0;
            if beyond.passes {
                stack.push((beyond.ray, beta, depth, beyond.around));
            }
            return beta * l;
        }
        if lit.has_non_delta {
            l = l + bsdf.albedo() * Rgb::splat(scene.ambient);
            if depth < self.settings.max_depth {
                for lamp in scene.lights.emitters() {
                    let (light, pmf) = lamp.choose(point.p, point.n, || stream.random());
                    let u = [stream.random(), stream.random()];
                    let lamp_sample = lit.share_of(scene, Wrapping(light), pmf, u);
                    let LampSample { share, shadow, end, possible } = lamp_sample;
                    if possible {
                        *rays += 1;
                        let ignores_meshes = scene.lights.is_convex_emitter::<f32>(Wrapping(light));
                        let hidden = self.world.occluded(&shadow, end, true, ignores_meshes);
                        let added =
                            if hidden { lamp_sample.through(&context, &state, &lit.around) } else { share };
                        observer
                            .event::<f32>(|| Event::Light { direction: vec3(shadow.d), added: rgb(added) });
                        l = l + added;
                    }
                }
            }
        }
        if lit.has_delta && depth < self.settings.max_depth {
            if lit.transmits && !lit.has_non_delta {
                for material::Branch { wi, weight, probability } in bsdf.branches(wo, TransportMode::Radiance)
                {
                    // The number of branches doubles with each bounce, so branches below the rounding error of white
                    // are cut.
                    let branch = lit.spawn(scene, wi);
                    let matters = (beta * weight).max_channel() > f32::EPSILON;
                    if probability > 0.0 && matters && branch.passes {
                        stack.push((branch.ray, beta * weight, depth + 1, branch.around));
                    }
                }
            } else {
                let (u, lobe) = ([stream.random(), stream.random()], stream.random());
                let sample = bsdf.sample(wo, u, lobe, TransportMode::Radiance);
                let branch = lit.spawn(scene, sample.wi);
                // On surfaces with other lobes, too, only the delta lobes are followed.
                let is_delta = sample.delta || !lit.has_non_delta;
                if is_delta && branch.passes {
                    stack.push((branch.ray, beta * sample.weight, depth + 1, branch.around));
                }
            }
        }
        beta * l
    }
}

/// A hit point with the inputs of its shading.
#[derive(Clone, Copy)]
pub(crate) struct Lit<F: Float> {
    pub(crate) at: Interaction<F>,
    /// Radiance emitted back along the ray.
    emitted: Rgb<F>,
    /// The parameters of the BSDF.
    pub(crate) local: Local<F>,
    pub(crate) frame: Frame<F>,
    /// The direction back along the ray, in the frame.
    pub(crate) wo: Vec3<F>,
    has_non_delta: F::Mask,
    has_delta: F::Mask,
    transmits: F::Mask,
    /// Whether the ray passes straight through the surface: see `interiors.rs`.
    pub(crate) is_none: F::Mask,
    /// Whether the ray passes through a hole.
    pub(crate) is_hole: F::Mask,
    around: Around<F>,
}

value!(Lit { at, emitted, local, frame, wo, has_non_delta, has_delta, transmits, is_none, is_hole, around });

/// A sample of one light.
#[derive(Clone, Copy)]
pub(crate) struct LampSample<F: Float> {
    /// Radiance sent back along the ray if the light is not occluded.
    share: Rgb<F>,
    /// The shadow ray to the light.
    shadow: Ray<F>,
    /// The distance along it before which a hit occludes the light.
    end: F,
    /// Whether the sample can contribute.
    possible: F::Mask,
}

value!(LampSample { share, shadow, end, possible });

impl<F: Float> LampSample<F> {
    /// The light that arrives through holes of the surfaces between the point and the light.
    pub(crate) fn through(&self, context: &TraceContext<'_>, state: &State<F>, around: &Around<F>) -> Rgb<F> {
        if !context.scene.materials.has_holes() {
            return Rgb::black();
        }
        let (all, none) = (F::Mask::splat(true), F::Mask::splat(false));
        self.share * seen_through(context, state, around, &self.shadow, self.end, all, none)
    }
}

/// A branch.
#[derive(Clone, Copy)]
pub(crate) struct Spawned<F: Float> {
    pub(crate) ray: Ray<F>,
    /// See [`CompiledScene::passes`]; for a branch that continues straight on, whether it does.
    pub(crate) passes: F::Mask,
    pub(crate) around: Around<F>,
}

value!(Spawned { ray, passes, around });

impl<F: Float> Lit<F> {
    /// The hit point of a branch's ray, with its surroundings.
    pub(crate) fn new(context: &TraceContext<'_>, state: &State<F>, around: Around<F>, hit: &Hit<F>) -> Self {
        let (scene, ray, all) = (context.scene, &state.ray, F::Mask::splat(true));
        let at = scene.interaction_apart(ray, hit, all, Uv::IfTextured);
        let (at, is_hole) = with_material(context, state, &around, at, all);
        let (around, is_none) = interiors::at_surface(scene, around, &at, !is_hole);
        let bsdf = interiors::bsdf(scene, &at, &around);
        let frame = scene.scattering_frame(&at, ray, &bsdf);
        Lit {
            at,
            emitted: scene.emitted(&at),
            local: bsdf.local(),
            frame,
            wo: frame.to_local(-ray.d),
            has_non_delta: bsdf.has_non_delta(),
            has_delta: bsdf.has_delta(),
            transmits: bsdf.transmits(),
            is_none,
            is_hole,
            around,
        }
    }

    /// The light of a light sample, chosen with a given probability.
    pub(crate) fn share_of(&self, scene: &CompiledScene, light: F::Uint, pmf: F, u: [F; 2]) -> LampSample<F> {
        let sample = scene.lights.sample(light, self.at.point.p, u);
        let wi = self.frame.to_local(sample.wi);
        let f = scene.materials.bsdf_of(self.local).eval(self.wo, wi, TransportMode::Radiance);
        let share = f * sample.weight() * (wi.z.abs() / pmf);
        let possible = share.max_channel().gt(F::zero()) & scene.passes(&self.at, sample.wi, wi);
        let (shadow, end) = self.at.shadow(&sample);
        let share = interiors::attenuated(scene, &self.around, &self.at, sample.wi, end, share);
        LampSample { share, shadow, end, possible }
    }

    /// A branch in a direction of the frame.
    pub(crate) fn spawn(&self, scene: &CompiledScene, wi: Vec3<F>) -> Spawned<F> {
        let ray = self.at.scattered(self.frame.to_world(wi).normalized());
        let all = F::Mask::splat(true);
        let around = interiors::after_bounce(scene, self.around, &self.at, ray.d, all);
        Spawned { ray, passes: scene.passes(&self.at, ray.d, wi), around }
    }

    /// The branch that continues straight on, beyond a surface that is no interface or through a hole.
    pub(crate) fn pass_on(&self, ray: &Ray<F>) -> Spawned<F> {
        let (around, passes) = interiors::straight_on(self.around, self.is_none, self.is_hole);
        Spawned { ray: self.at.straight_on(ray), passes, around }
    }
}
