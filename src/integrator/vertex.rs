//! The vertices of paths, one path per lane: the state of the path, the surface that it hits, and its next ray.

use super::interiors::{self, MOST_HOLES, Surroundings};
use super::observe::{Event, Observer, rgb, vec3};
use super::paths::Settings;
use crate::material::{Bsdf, BxdfSample, Local};
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3, value};
use crate::sampling::{PathId, VertexBlock};
use crate::world::{CompiledScene, Hit, Interaction, Uv, World};

/// The scene and the settings, shared by all paths.
pub(crate) struct TraceContext<'a> {
    pub scene: &'a CompiledScene,
    pub world: &'a World,
    pub settings: &'a Settings,
}

/// The state of each lane's path.
#[derive(Clone, Copy)]
pub(crate) struct State<F: Float> {
    pub id: PathId<F>,
    pub ray: Ray<F>,
    /// Number of bounces so far.
    pub depth: F::Uint,
    /// Throughput: the product of f·|cos θ|/pdf so far.
    pub beta: Rgb<F>,
    /// Radiance gathered so far.
    pub l: Rgb<F>,
    /// The vertex at the ray's origin.
    pub previous: PreviousVertex<F>,
}

/// The properties of the vertex at the ray's origin that MIS weights depend on.
#[derive(Clone, Copy)]
pub(crate) struct PreviousVertex<F> {
    pub p: Vec3<F>,
    pub n: Vec3<F>,
    /// Density of the direction by solid angle, in 1/sr; zero where light sampling could not have found it.
    pub pdf: F,
    /// Product of (η transmitted/η incident)² along the path. Radiance scales with it; the path's contribution to the
    /// image does not.
    pub eta_scale: F,
}

impl<F: Float> PreviousVertex<F> {
    /// The vertex of a ray that leaves the camera.
    #[inline(always)]
    pub(super) fn camera() -> PreviousVertex<F> {
        PreviousVertex { p: Vec3::zero(), n: Vec3::zero(), pdf: F::zero(), eta_scale: F::splat(1.0) }
    }
}

impl<F: Float> State<F> {
    /// A path that leaves the camera.
    #[inline(always)]
    pub(crate) fn start(id: PathId<F>, ray: Ray<F>) -> State<F> {
        let (beta, l) = (Rgb::splat([1.0; 3]), Rgb::black());
        State { id, ray, depth: F::Uint::splat(0), beta, l, previous: PreviousVertex::camera() }
    }
}

value!(State { id, ray, depth, beta, l, previous });
value!(PreviousVertex { p, n, pdf, eta_scale });

/// A vertex where a path hits a surface.
#[derive(Clone, Copy)]
pub(super) struct Vertex<F: Float> {
    /// The lanes with a hit.
    pub met: F::Mask,
    pub hit: Hit<F>,
    pub at: Interaction<F>,
    /// Radiance emitted back along the ray.
    pub emitted: Rgb<F>,
    /// The lanes that pass through a hole.
    pub holes: F::Mask,
}

value!(Vertex { met, hit, at, emitted, holes });
value!(Scattering { local, frame, wo });

/// The block of random numbers that resolve the material of the next hit.
#[inline(always)]
pub(super) fn material_block<F: Float>(state: &State<F>, around: &impl Surroundings<F>) -> F::Uint {
    VertexBlock::MATERIAL.at::<F>(state.depth + around.get().holes)
}

/// The interactions of paths with the surfaces that they hit, in the lanes of `met`, and the lanes that pass through a
/// hole instead.
#[inline(always)]
fn resolve_hit<F: Float>(
    context: &TraceContext<'_>,
    state: &State<F>,
    around: &impl Surroundings<F>,
    hit: &Hit<F>,
    met: F::Mask,
) -> (Interaction<F>, F::Mask) {
    let at = context.scene.interaction(&state.ray, hit, met, Uv::IfTextured);
    with_material(context, state, around, at, met)
}

/// These interactions with resolved materials, and the lanes whose rays pass through a hole.
#[inline(always)]
pub(super) fn with_material<F: Float>(
    context: &TraceContext<'_>,
    state: &State<F>,
    around: &impl Surroundings<F>,
    at: Interaction<F>,
    met: F::Mask,
) -> (Interaction<F>, F::Mask) {
    let (scene, none) = (context.scene, F::Mask::splat(false));
    if !scene.materials.is_walked() {
        return (at, none);
    }
    let mut numbers = [F::zero(); 2];
    if scene.materials.is_stochastic() {
        let (path, block) = (state.id, material_block(state, around));
        numbers = F::out_of_line(
            #[inline(always)]
            move || {
                let [mix, hole, ..] = context.settings.sampler.draw(path, block);
                [mix, hole]
            },
        );
    }
    let [mix, hole] = numbers;
    let (at, opacity) = scene.modified(at, state.ray.d, met, met, mix);
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
        context: &TraceContext<'_>,
        state: &State<F>,
        around: &impl Surroundings<F>,
        hit: Hit<F>,
        met: F::Mask,
        observer: &mut Observer<'_>,
    ) -> Self {
        let scene = context.scene;
        let (at, holes) = resolve_hit(context, state, around, &hit, met);
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

/// The radiance of each path, including that of the environment and of lights at infinity where its ray leaves the
/// scene. `weight` returns the MIS weight of a light at infinity from the previous vertex and the density of light
/// sampling.
#[inline(always)]
pub(super) fn escape<F: Float>(
    context: &TraceContext<'_>,
    state: &State<F>,
    escaped: F::Mask,
    weight: impl Fn(&PreviousVertex<F>, F) -> F,
    observer: &mut Observer<'_>,
) -> Rgb<F> {
    F::branch(
        escaped,
        state.l,
        #[inline(always)]
        || {
            let lights = &context.scene.lights;
            let radiance = lights.escaped(
                state.ray.d,
                #[inline(always)]
                |pdf| weight(&state.previous, pdf * lights.pmf_of_infinite(state.previous.p)),
            );
            observer.event::<F>(|| Event::Escape { radiance: rgb(radiance) });
            state.l + state.beta * radiance
        },
    )
}

/// The BSDF at a vertex, and its frame.
#[derive(Clone, Copy)]
pub(super) struct Scattering<F: Float> {
    /// The parameters of the BSDF.
    local: Local<F>,
    pub frame: Frame<F>,
    /// The direction towards the previous vertex, in the frame.
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

/// Continues paths in directions sampled from their BxDFs, with the samples' weights. Returns the lanes whose
/// throughput is now zero.
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
    // One Newton step towards unit length: rounding errors would otherwise accumulate over many bounces.
    let d = d * ((-d.dot(d) + 3.0) * 0.5);
    state.beta = state.beta * scattered.weight.only(scene.passes(at, d, scattered.wi));
    state.ray = at.scattered(d);
    state.depth = state.depth + F::Uint::splat(1);
    // A path of zero throughput ends; NaN is not zero, and continues so that it is counted.
    let beta = state.beta;
    let bits = beta.r.to_bits() | beta.g.to_bits() | beta.b.to_bits();
    let nothing = (bits & F::Uint::splat(0x7fff_ffff)).eq(F::Uint::splat(0));
    observer.event::<F>(|| Event::Scatter {
        weight: rgb(scattered.weight),
        pdf: scattered.pdf.first(),
        throughput: rgb(beta),
    });
    if observer.listens::<F>() && nothing.first() {
        observer.event::<F>(|| Event::End { reason: "the throughput is zero", radiance: rgb(state.l) });
    }
    nothing
}
