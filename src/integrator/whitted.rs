//! Ray tracing as in the report's chapter 2.

use super::Integrator;
use super::first_hit::{FirstHit, FirstHits};
use super::observe::{Event, Observer, ray_event, rgb, vec3};
use super::paths::{Finished, Paths, Pixel, Sample, Settings, camera_ray};
use super::vertex::View;
use crate::camera::Camera;
use crate::material::{self, Bxdf, TransportMode};
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Level, dispatch};
use crate::math::{Ray, Rgb, Vec3};
use crate::sampling::{PathId, Stream};
use crate::world::{CompiledScene, Uv, World};
use rand::RngExt;
use std::sync::Arc;

/// Direct light on matte surfaces, perfect reflection and refraction followed, and an ambient term for the rest
/// (Whitted 1980; report ch. 2).
///
/// At each matte hit every lamp is sampled once, those of finite area at a random point. A mesh that emits is one lamp
/// if it has many triangles (see [`crate::light::LEAST_TRIANGLES`]), and one lamp a triangle if it has few. At glass
/// both branches are followed. Emitters of infinite area are visible but light no surface.
pub struct Whitted {
    /// The scene's tables.
    pub scene: Arc<CompiledScene>,
    /// The surfaces.
    pub world: Arc<World>,
    /// Film, sampler and depth.
    pub settings: Settings,
    /// The seed of the points on lights.
    pub seed: u32,
}

/// A branch to follow: a ray, its throughput, its bounces so far.
type Branch = (Ray<f32>, Rgb<f32>, u32);

impl Integrator for Whitted {
    fn trace_until(
        &self,
        _level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Vec<Finished>,
    ) -> Option<u64> {
        let mut stack = Vec::new();
        let mut rays = 0;
        for (slot, &pixel) in paths.pixels.iter().enumerate() {
            for sample in paths.first_sample..paths.first_sample + paths.samples {
                let observer = &mut Observer::none();
                let sample = self.trace_one(pixel, sample, &mut stack, &mut rays, stop, observer);
                if stop() {
                    // It may have been given up.
                    return None;
                }
                out.push(Finished { slot: slot as u32, sample });
            }
        }
        Some(rays)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        let view = View { scene: &self.scene, world: &self.world, settings: &self.settings };
        dispatch(level, FirstHits { view, paths, out });
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        let (scene, world) = (Arc::new(self.scene.seen_by(camera)), Arc::clone(&self.world));
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
        let mut l = Rgb::black();
        stack.push((ray, Rgb::splat([1.0; 3]), 0));
        while let Some(branch) = stack.pop() {
            if stop() {
                break;
            }
            l = l + self.follow(branch, stack, &mut stream, rays, observer);
        }
        observer.event::<f32>(|| Event::End { reason: "no branch is left", radiance: rgb(l) });
        Sample { pixel: pixel.index, sample, x, y, radiance: [l.r, l.g, l.b] }
    }

    /// The radiance that a branch adds to the sample; pushes the branches that it splits into.
    fn follow(
        &self,
        (ray, beta, depth): Branch,
        stack: &mut Vec<Branch>,
        stream: &mut Stream,
        rays: &mut u64,
        observer: &mut Observer<'_>,
    ) -> Rgb<f32> {
        let scene = &*self.scene;
        *rays += 1;
        observer.event::<f32>(|| ray_event::<f32>(Wrapping(depth), &ray));
        let hit = self.world.intersect(&ray, true);
        if !hit.is_some() {
            let radiance = scene.lights.escaped(ray.d, |_| 1.0);
            observer.event::<f32>(|| Event::Escape { radiance: rgb(radiance) });
            return beta * radiance;
        }
        let at = scene.interaction(&ray, &hit, true, Uv::WherePatterned);
        let (point, emitted) = (&at.point, scene.emitted(&at));
        observer.event::<f32>(|| Event::Hit {
            distance: hit.t,
            point: vec3(point.p),
            normal: vec3(point.n),
            entity: scene.surfaces.entity(point.row.0),
            material: at.material.0,
            emitted: rgb(emitted),
        });
        let bsdf = scene.bsdf(&at);
        let frame = at.frame();
        let wo = frame.to_local(-ray.d);
        let spawn = |wi: Vec3<f32>| at.scattered(frame.to_world(wi).normalized());
        let mut l = emitted;
        if bsdf.has_non_delta() {
            l = l + bsdf.albedo() * Rgb::splat(scene.ambient);
            if depth < self.settings.max_depth {
                for lamp in scene.lights.lamps() {
                    let (light, chance) = lamp.choose(point.p, point.n, || stream.random());
                    let u = [stream.random(), stream.random()];
                    let sample = scene.lights.sample(Wrapping(light), point.p, u);
                    let wi = frame.to_local(sample.wi);
                    let f = bsdf.eval(wo, wi, TransportMode::Radiance);
                    let share = f * sample.weight() * (wi.z.abs() / chance);
                    if share.max_channel() > 0.0 && scene.passes(&at, sample.wi, wi) {
                        let (shadow, length) = at.shadow(&sample);
                        *rays += 1;
                        let past_triangles = scene.lights.is_past_triangles::<f32>(Wrapping(light));
                        let hidden = self.world.occluded(&shadow, length, true, past_triangles);
                        let added = if hidden { Rgb::black() } else { share };
                        observer
                            .event::<f32>(|| Event::Light { direction: vec3(sample.wi), added: rgb(added) });
                        l = l + added;
                    }
                }
            }
        }
        if bsdf.has_delta() && depth < self.settings.max_depth {
            if bsdf.transmits() && !bsdf.has_non_delta() {
                for material::Branch { wi, weight, chance } in bsdf.branches(wo, TransportMode::Radiance) {
                    // The tree of branches doubles with each bounce: below a rounding error of white it is cut.
                    let branch = spawn(wi);
                    let matters = (beta * weight).max_channel() > f32::EPSILON;
                    if chance > 0.0 && matters && scene.passes(&at, branch.d, wi) {
                        stack.push((branch, beta * weight, depth + 1));
                    }
                }
            } else {
                let (u, lobe) = ([stream.random(), stream.random()], stream.random());
                let sample = bsdf.sample(wo, u, lobe, TransportMode::Radiance);
                let branch = spawn(sample.wi);
                // Of a surface with other lobes, too, only the delta ones are followed.
                let is_delta = sample.delta || !bsdf.has_non_delta();
                if is_delta && scene.passes(&at, branch.d, sample.wi) {
                    stack.push((branch, beta * sample.weight, depth + 1));
                }
            }
        }
        beta * l
    }
}
