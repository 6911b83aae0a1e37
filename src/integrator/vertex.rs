//! The vertices of paths, one path in each lane: the state of the path, the surface that it meets, and its next ray.

use super::interiors::{self, MOST_HOLES, Surroundings};
use super::observe::{Event, Observer, rgb, vec3};
use super::paths::Settings;
use crate::material::{Bsdf, BxdfSample, Local};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3, value};
use crate::sampling::{PathId, VertexBlock};
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};

/// The scene and the settings, which all paths share.
pub(crate) struct View<'a> {
    pub scene: &'a CompiledScene,
    pub world: &'a World,
    pub settings: &'a Settings,
}

/// The state of each lane's path.
#[derive(Clone, Copy)]
pub(crate) struct State<F: Float> {
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
pub(crate) struct Departure<F> {
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
}

impl<F: Float> State<F> {
    /// A path that leaves the camera.
    #[inline(always)]
    pub(crate) fn start(id: PathId<F>, ray: Ray<F>) -> State<F> {
        let (beta, l) = (Rgb::splat([1.0; 3]), Rgb::black());
        State { id, ray, depth: F::Uint::splat(0), beta, l, departure: Departure::camera() }
    }
}

value!(State { id, ray, depth, beta, l, departure });
value!(Departure { p, n, pdf, eta_scale });

/// A point where a path met a surface.
#[derive(Clone, Copy)]
pub(super) struct Vertex<F: Float> {
    /// The lanes that met one.
    pub met: F::Mask,
    pub hit: Hit<F>,
    pub at: Interaction<F>,
    /// Radiance emitted back along the ray.
    pub emitted: Rgb<F>,
    /// The lanes that go through a hole there.
    pub holes: F::Mask,
}

value!(Vertex { met, hit, at, emitted, holes });
value!(Scattering { local, frame, wo });

/// The block of the numbers that decide what a path meets next.
#[inline(always)]
pub(super) fn meeting<F: Float>(state: &State<F>, around: &impl Surroundings<F>) -> F::Uint {
    VertexBlock::MEETING.at::<F>(state.depth + around.get().holes)
}

/// The interactions of paths with the surfaces that they hit, in the lanes of `met`, and the lanes that go through a hole
/// there instead.
#[inline(always)]
pub(super) fn meet<F: Float>(
    view: &View<'_>,
    state: &State<F>,
    around: &impl Surroundings<F>,
    hit: &Hit<F>,
    met: F::Mask,
    uv: Uv,
) -> (Interaction<F>, F::Mask) {
    let (scene, none) = (view.scene, F::Mask::splat(false));
    let at = scene.interaction(&state.ray, hit, met, uv);
    if !scene.materials.is_walked() {
        return (at, none);
    }
    let mut numbers = [F::zero(); 2];
    if scene.materials.takes_chances() {
        let (path, block) = (state.id, meeting(state, around));
        numbers = F::out_of_line(
            #[inline(always)]
            move || {
                let [mix, hole, ..] = view.settings.sampler.draw(path, block);
                [mix, hole]
            },
        );
    }
    let [mix, hole] = numbers;
    let (at, opacity) = scene.modified(at, state.ray.d, met, mix);
    if !scene.materials.has_holes() {
        return (at, none);
    }
    let may = around.get().holes.lt(F::Uint::splat(MOST_HOLES));
    (at, met & opacity.le(hole) & may)
}

impl<F: Float> Vertex<F> {
    /// The vertices at the hits of paths' rays, in the lanes of `met`.
    #[inline(always)]
    pub(super) fn new(
        view: &View<'_>,
        state: &State<F>,
        around: &impl Surroundings<F>,
        hit: Hit<F>,
        met: F::Mask,
        observer: &mut Observer<'_>,
    ) -> Self {
        let scene = view.scene;
        let (at, holes) = meet(view, state, around, &hit, met, Uv::WherePatterned);
        let emitted = scene.emitted(&at);
        observer.event::<F>(|| Event::Hit {
            distance: hit.t.first(),
            point: vec3(at.point.p),
            normal: vec3(at.point.n),
            entity: scene.surfaces.entity(at.point.row.first()),
            material: at.material.first(),
            emitted: rgb(emitted),
        });
        Vertex { met, hit, at, emitted, holes }
    }
}

/// The radiance of each path, with that of the environment and of lights at infinity where its ray leaves the scene.
/// `weight` gives the weight of each light at infinity, from the ray's departure and the density with which the light
/// would have been sampled.
#[inline(always)]
pub(super) fn escape<F: Float>(
    view: &View<'_>,
    state: &State<F>,
    escaped: F::Mask,
    weight: impl Fn(&Departure<F>, F) -> F,
    observer: &mut Observer<'_>,
) -> Rgb<F> {
    F::branch(
        escaped,
        state.l,
        #[inline(always)]
        || {
            let radiance = view.scene.lights.escaped(
                state.ray.d,
                #[inline(always)]
                |pdf| weight(&state.departure, pdf),
            );
            observer.event::<F>(|| Event::Escape { radiance: rgb(radiance) });
            state.l + state.beta * radiance
        },
    )
}

/// The BSDF at a vertex, and its frame.
#[derive(Clone, Copy)]
pub(super) struct Scattering<F: Float> {
    /// What the BSDF is made of.
    local: Local<F>,
    pub frame: Frame<F>,
    /// Towards the last vertex, in the frame.
    pub wo: Vec3<F>,
}

impl<F: Float> Scattering<F> {
    #[inline(always)]
    pub(super) fn new(
        scene: &CompiledScene,
        at: &Interaction<F>,
        ray: &Ray<F>,
        around: &impl Surroundings<F>,
    ) -> Self {
        let bsdf = interiors::bsdf(scene, at, around);
        let frame = scene.scattering_frame(at, ray, &bsdf);
        Scattering { local: bsdf.local(), wo: frame.to_local(-ray.d), frame }
    }

    /// The BSDF.
    #[inline(always)]
    pub(super) fn bsdf(&self, scene: &CompiledScene) -> Bsdf<F> {
        scene.materials.bsdf_of(self.local)
    }
}

/// Sends paths on in directions drawn from their BxDFs, with the weights of the draw. Returns the lanes
/// whose throughput is now zero.
#[inline(always)]
pub(super) fn go_on<F: Float>(
    scene: &CompiledScene,
    state: &mut State<F>,
    at: &Interaction<F>,
    scattering: &Scattering<F>,
    scattered: &BxdfSample<F>,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let d = scattering.frame.to_world(scattered.wi);
    // One Newton step towards length one: rounding would otherwise add up over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight.only(scene.passes(at, d, scattered.wi));
    state.ray = at.scattered(d);
    state.depth = state.depth + F::Uint::splat(1);
    // A path of zero throughput ends; NaN is not zero, and goes on to be counted.
    let beta = state.beta;
    let bits = beta.r.to_bits() | beta.g.to_bits() | beta.b.to_bits();
    let nothing = (bits & F::Uint::splat(0x7fff_ffff)).eq(F::Uint::splat(0));
    observer.event::<F>(|| Event::Scatter {
        weight: rgb(scattered.weight),
        pdf: scattered.pdf.first(),
        throughput: rgb(beta),
    });
    if observer.listens::<F>() && nothing.first() {
        observer.event::<F>(|| Event::End {
            reason: "nothing is left of the throughput",
            radiance: rgb(state.l),
        });
    }
    nothing
}
