//! The vertices of paths, one path in each lane: the state of the path, the surface that it meets, and its next ray.

use super::observe::{Event, Observer, first, ray_event, rgb, vec3};
use super::paths::Settings;
use crate::material::{Bsdf, BxdfSample};
use crate::math::lanes::MAX_LANES;
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3};
use crate::sampling::PathId;
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};

/// The scene and the settings, which all paths share.
pub(super) struct View<'a> {
    pub scene: &'a CompiledScene,
    pub world: &'a World,
    pub settings: &'a Settings,
}

/// The state of each lane's path.
#[derive(Clone, Copy)]
pub(super) struct State<F: Float> {
    pub id: PathId<F>,
    pub ray: Ray<F>,
    /// Bounces so far.
    pub depth: F::Uint,
    /// Product of f·|cos θ|/pdf so far.
    pub beta: Rgb<F>,
    /// Radiance found so far.
    pub l: Rgb<F>,
    /// The vertex that the ray left.
    pub departure: Departure<F>,
}

/// The vertex that the ray left, as far as the weight of a light that it meets depends on it.
#[derive(Clone, Copy)]
pub(super) struct Departure<F> {
    pub p: Vec3<F>,
    pub n: Vec3<F>,
    /// Density of the direction by solid angle; zero where sampling lights could not have found it.
    pub pdf: F,
    /// Product of (η transmitted/η incident)² along the path: radiance scales with it, the
    /// contribution of the path to the picture does not.
    pub eta_scale: F,
}

impl<F: Float> Departure<F> {
    /// That of a ray that leaves the camera.
    #[inline(always)]
    pub(super) fn camera() -> Departure<F> {
        Departure { p: Vec3::zero(), n: Vec3::zero(), pdf: F::zero(), eta_scale: F::splat(1.0) }
    }

    /// `a` where the mask holds, `b` elsewhere.
    #[inline(always)]
    pub(super) fn select(mask: F::Mask, a: Departure<F>, b: Departure<F>) -> Departure<F> {
        Departure {
            p: Vec3::select(mask, a.p, b.p),
            n: Vec3::select(mask, a.n, b.n),
            pdf: F::select(mask, a.pdf, b.pdf),
            eta_scale: F::select(mask, a.eta_scale, b.eta_scale),
        }
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

/// Follows the ray of every path that is alive. A ray that leaves the scene sees lights at infinity; `weight` gives
/// the weight of each, from the ray's departure and the density with which the light would have been sampled. `None` if
/// no ray meets a surface.
#[inline(always)]
pub(super) fn meet<F: Float>(
    view: &View<'_>,
    state: &mut State<F>,
    alive: F::Mask,
    rays: &mut u64,
    observer: &mut Observer<'_>,
    weight: impl Fn(&Departure<F>, F) -> F,
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
            |pdf| weight(&state.departure, pdf),
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

/// The BSDF at a vertex, and its frame.
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
/// whose throughput is now zero.
#[inline(always)]
pub(super) fn go_on<F: Float>(
    state: &mut State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    scattered: &BxdfSample<F>,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let d = scattering.frame.to_world(scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight.only(at.passes(d, scattered.wi));
    state.ray = at.scattered(d);
    state.depth = state.depth + F::Uint::splat(1);
    // A path of zero throughput ends; NaN is not zero, and goes on to be counted.
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
