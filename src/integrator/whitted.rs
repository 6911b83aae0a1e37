//! Ray tracing as in the report's chapter 2.

use super::Integrator;
use super::first_hit::{FirstHit, FirstHits};
use super::holes::seen_through;
use super::interiors::{self, Around};
use super::observe::{Event, Observer, ray_event, rgb, vec3};
use super::paths::{Finished, Found, Paths, Settings, camera_ray};
use super::vertex::{State, View, meet};
use crate::camera::Camera;
use crate::material::{self, Bxdf, Local, TransportMode};
use crate::math::lanes::scalar::Wrapping;
use crate::math::lanes::{Level, dispatch};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Vec3, value};
use crate::sampling::{PathId, Pixel, Sample, Stream};
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};
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

/// A branch to follow: a ray, its throughput, its bounces so far, and its surroundings.
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
                    // It may have been given up.
                    return None;
                }
                out.finished.push(Finished { slot: slot as u32, sample });
            }
        }
        Some(rays)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        let view = View { scene: &self.scene, world: &self.world, settings: &self.settings };
        dispatch(level, FirstHits { view, paths, out });
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

    /// The radiance that a branch adds to the sample; pushes the branches that it splits into. `holes` counts those that
    /// the sample has gone through.
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
        let view = View { scene, world: &self.world, settings: &self.settings };
        let state = State { depth: Wrapping(depth), ..State::start(id, ray) };
        let around = Around { holes: Wrapping(*holes), ..around };
        let lit = Lit::new(&view, &state, around, &hit);
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
            *holes = beyond.around.holes.0;
            if beyond.passes {
                stack.push((beyond.ray, beta, depth, beyond.around));
            }
            return beta * l;
        }
        if lit.has_non_delta {
            l = l + bsdf.albedo() * Rgb::splat(scene.ambient);
            if depth < self.settings.max_depth {
                for lamp in scene.lights.lamps() {
                    let (light, chance) = lamp.choose(point.p, point.n, || stream.random());
                    let u = [stream.random(), stream.random()];
                    let asked = lit.share_of(scene, Wrapping(light), chance, u);
                    let Asked { share, shadow, end, possible } = asked;
                    if possible {
                        *rays += 1;
                        let past_triangles = scene.lights.is_past_triangles::<f32>(Wrapping(light));
                        let hidden = self.world.occluded(&shadow, end, true, past_triangles);
                        let added = if hidden { asked.through(&view, &state, &lit.around) } else { share };
                        observer
                            .event::<f32>(|| Event::Light { direction: vec3(shadow.d), added: rgb(added) });
                        l = l + added;
                    }
                }
            }
        }
        if lit.has_delta && depth < self.settings.max_depth {
            if lit.transmits && !lit.has_non_delta {
                for material::Branch { wi, weight, chance } in bsdf.branches(wo, TransportMode::Radiance) {
                    // The tree of branches doubles with each bounce: below a rounding error of white it is cut.
                    let branch = lit.spawn(scene, wi);
                    let matters = (beta * weight).max_channel() > f32::EPSILON;
                    if chance > 0.0 && matters && branch.passes {
                        stack.push((branch.ray, beta * weight, depth + 1, branch.around));
                    }
                }
            } else {
                let (u, lobe) = ([stream.random(), stream.random()], stream.random());
                let sample = bsdf.sample(wo, u, lobe, TransportMode::Radiance);
                let branch = lit.spawn(scene, sample.wi);
                // Of a surface with other lobes, too, only the delta ones are followed.
                let is_delta = sample.delta || !lit.has_non_delta;
                if is_delta && branch.passes {
                    stack.push((branch.ray, beta * sample.weight, depth + 1, branch.around));
                }
            }
        }
        beta * l
    }
}

/// A point that a ray met, and all that is asked of it.
#[derive(Clone, Copy)]
pub(crate) struct Lit<F: Float> {
    pub(crate) at: Interaction<F>,
    /// Radiance emitted back along the ray.
    emitted: Rgb<F>,
    /// What the BSDF is made of.
    pub(crate) local: Local<F>,
    pub(crate) frame: Frame<F>,
    /// The way back along the ray, in the frame.
    pub(crate) wo: Vec3<F>,
    has_non_delta: F::Mask,
    has_delta: F::Mask,
    transmits: F::Mask,
    /// Whether the surface is none: see `interiors.rs`.
    pub(crate) is_none: F::Mask,
    /// Whether the ray goes through a hole there.
    pub(crate) is_hole: F::Mask,
    around: Around<F>,
}

value!(Lit { at, emitted, local, frame, wo, has_non_delta, has_delta, transmits, is_none, is_hole, around });

/// The light of one lamp.
#[derive(Clone, Copy)]
pub(crate) struct Asked<F: Float> {
    /// Radiance that is sent back along the ray, unless something hides the lamp.
    share: Rgb<F>,
    /// The ray to the lamp.
    shadow: Ray<F>,
    /// The distance along it up to which a hit hides the lamp.
    end: F,
    /// Whether there is any.
    possible: F::Mask,
}

value!(Asked { share, shadow, end, possible });

impl<F: Float> Asked<F> {
    /// What comes through holes of the surfaces that hide the lamp.
    pub(crate) fn through(&self, view: &View<'_>, state: &State<F>, around: &Around<F>) -> Rgb<F> {
        if !view.scene.materials.has_holes() {
            return Rgb::black();
        }
        let (all, none) = (F::Mask::splat(true), F::Mask::splat(false));
        self.share * seen_through(view, state, around, &self.shadow, self.end, all, none)
    }
}

/// A branch.
#[derive(Clone, Copy)]
pub(crate) struct Spawned<F: Float> {
    pub(crate) ray: Ray<F>,
    /// See [`CompiledScene::passes`]; of a branch that goes straight on, whether it does.
    pub(crate) passes: F::Mask,
    pub(crate) around: Around<F>,
}

value!(Spawned { ray, passes, around });

impl<F: Float> Lit<F> {
    /// The point that the ray of a branch met in its surroundings.
    pub(crate) fn new(view: &View<'_>, state: &State<F>, around: Around<F>, hit: &Hit<F>) -> Self {
        let (scene, ray, all) = (view.scene, &state.ray, F::Mask::splat(true));
        let (at, is_hole) = meet(view, state, &around, hit, all, Uv::WherePatterned);
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

    /// The light that comes by way of the point from a lamp's light, which was chosen with a chance.
    pub(crate) fn share_of(&self, scene: &CompiledScene, light: F::Uint, chance: F, u: [F; 2]) -> Asked<F> {
        let sample = scene.lights.sample(light, self.at.point.p, u);
        let wi = self.frame.to_local(sample.wi);
        let f = scene.materials.bsdf_of(self.local).eval(self.wo, wi, TransportMode::Radiance);
        let share = f * sample.weight() * (wi.z.abs() / chance);
        let possible = share.max_channel().gt(F::zero()) & scene.passes(&self.at, sample.wi, wi);
        let (shadow, end) = self.at.shadow(&sample);
        let share = interiors::faded(scene, &self.around, &self.at, sample.wi, end, share);
        Asked { share, shadow, end, possible }
    }

    /// A branch in a direction of the frame.
    pub(crate) fn spawn(&self, scene: &CompiledScene, wi: Vec3<F>) -> Spawned<F> {
        let ray = self.at.scattered(self.frame.to_world(wi).normalized());
        let all = F::Mask::splat(true);
        let around = interiors::after_bounce(scene, self.around, &self.at, ray.d, all);
        Spawned { ray, passes: scene.passes(&self.at, ray.d, wi), around }
    }

    /// The branch that the ray is beyond a surface that is none, or beyond a hole.
    pub(crate) fn pass_on(&self, ray: &Ray<F>) -> Spawned<F> {
        let (around, passes) = interiors::straight_on(self.around, self.is_none, self.is_hole);
        Spawned { ray: self.at.straight_on(ray), passes, around }
    }
}
