//! Path tracing: the loop over lanes, each of which follows a path and starts the next one when it ends, and one step
//! of a path.

use super::Integrator;
use super::blocks::path::SCATTER;
use super::first_hit::{FirstHit, FirstHits};
use super::interiors::{self, Around, InMemory, Surroundings};
use super::naive::delta_light;
use super::next_event::{NextEvent, direct_light, weight_of_escaped, weight_of_met};
use super::observe::{Event, Observer, Passage, TOO_MANY_PASSED, ray_event, rgb};
use super::paths::{Finished, Found, Paths, Settings};
use super::queue::{Queue, Start};
use super::roulette::roulette;
use super::vertex::{PreviousVertex, Scattering, State, TraceContext, Vertex, escape, go_on};
use crate::camera::Camera;
use crate::material::{Bxdf, TransportMode};
use crate::math::lanes::{Kernel, Level, MAX_LANES, Value, dispatch_minor, dispatch_paths};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Mask, Ray, Rgb, Uint, function, value};
use crate::sampling::{Pixel, Sample};
use crate::scene;
use crate::world::{CompiledScene, Interaction, World};
use std::cell::Cell;
use std::sync::Arc;

/// How paths gather light. It is chosen at run time, so that the path tracer is compiled once; the branch is taken once
/// per step for all lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Transport {
    /// By next-event estimation.
    NextEvent(NextEvent),
    /// By BxDF sampling alone, except for delta lights: see `naive.rs`.
    Naive,
}

impl Transport {
    /// The transport of an integrator; `None` for one that follows no paths.
    pub(crate) fn of(integrator: scene::Integrator) -> Option<Transport> {
        match integrator {
            scene::Integrator::Path => Some(Transport::NextEvent(NextEvent::default())),
            scene::Integrator::PathNaive => Some(Transport::Naive),
            scene::Integrator::Whitted => None,
        }
    }

    /// Whether light sampling and BxDF sampling find the same lights, and need MIS weights.
    #[inline(always)]
    fn competes(self) -> bool {
        matches!(self, Transport::NextEvent(_))
    }
}

/// A path tracer.
pub(super) struct PathTracer {
    /// How paths gather light.
    pub transport: Transport,
    /// The scene's tables.
    pub scene: Arc<CompiledScene>,
    /// The surfaces.
    pub world: Arc<World>,
    /// Film, sampler and depth.
    pub settings: Settings,
}

impl PathTracer {
    fn context(&self) -> TraceContext<'_> {
        TraceContext { scene: &self.scene, world: &self.world, settings: &self.settings }
    }
}

impl Integrator for PathTracer {
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64> {
        let out = &mut out.finished;
        out.reserve(paths.len());
        let (context, transport, observer) = (self.context(), self.transport, Observer::none());
        dispatch_paths(level, TracePaths { context, transport, paths, stop, out, observer })
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        dispatch_minor(level, FirstHits { context: self.context(), paths, out });
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        let (scene, world) = (Arc::new(self.scene.seen_by(camera, &self.world)), Arc::clone(&self.world));
        Box::new(PathTracer { transport: self.transport, scene, world, settings: self.settings })
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        let paths = &Paths { pixels: &[pixel], first_sample: sample, samples: 1 };
        let (mut out, mut events) = (Vec::new(), Vec::new());
        let (context, transport, observer) = (self.context(), self.transport, Observer::of(&mut events));
        let (stop, out_all) = (&|| false, &mut out);
        // Only scalar lanes record events.
        dispatch_paths(Level::SCALAR, TracePaths { context, transport, paths, stop, out: out_all, observer });
        (out[0].sample, events)
    }
}

/// Traces a block of paths and returns the number of rays traced; `None` if `stop` ended it early.
pub(super) struct TracePaths<'a> {
    pub context: TraceContext<'a>,
    pub transport: Transport,
    pub paths: &'a Paths<'a>,
    /// Whether to stop. It is called at each bounce of a packet, as the time that paths take is not bounded otherwise.
    pub stop: &'a dyn Fn() -> bool,
    pub out: &'a mut Vec<Finished>,
    pub observer: Observer<'a>,
}

impl Kernel for TracePaths<'_> {
    type Output = Option<u64>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Option<u64> {
        let TracePaths { context, transport, paths, stop, out, mut observer } = self;
        let mut queue = Queue::new(paths);
        let mut start = Start::<F>::nowhere();
        let mut state = State::start(start.id, Ray::none());
        let mut alive = F::Mask::splat(false);
        let around = Cell::new(Around::nothing());
        let around = InMemory(&around);
        let mut rays = 0;
        loop {
            // Lanes whose paths have ended start the next ones.
            let started =
                queue.take(!alive, context.settings, &context.scene.camera, &mut start, &mut state.ray);
            state.id = start.id;
            let fresh = State::start(start.id, state.ray);
            state.depth = F::Uint::select(started, fresh.depth, state.depth);
            state.beta = Rgb::select(started, fresh.beta, state.beta);
            state.l = Rgb::select(started, fresh.l, state.l);
            state.previous = PreviousVertex::blend(started, fresh.previous, state.previous);
            interiors::reset(context.scene, around, started);
            alive = alive | started;
            if !alive.any() {
                return Some(rays);
            }
            if stop() {
                return None;
            }

            let (stepped, _) = step(transport, &context, state, around, alive, &mut observer);
            rays += u64::from(alive.bits().count_ones()) + u64::from(stepped.shadows.bits().count_ones());
            state = stepped.state;
            let ended = alive & !stepped.going;
            alive = stepped.going;
            if ended.any() {
                push(ended, &start, state.l, out);
            }
        }
    }
}

/// Paths after a step.
#[derive(Clone, Copy)]
pub(crate) struct Stepped<F: Float> {
    pub state: State<F>,
    /// The lanes whose paths continue.
    pub going: F::Mask,
    /// The lanes that traced a shadow ray.
    pub shadows: F::Mask,
}

value!(Stepped { state, going, shadows });

/// [`step`] with surroundings as a value, for recorded programs.
#[cfg(feature = "gpu")]
#[inline(always)]
pub(crate) fn step_with<F: Float>(
    transport: Transport,
    context: &TraceContext<'_>,
    state: State<F>,
    around: Around<F>,
    alive: F::Mask,
) -> (Stepped<F>, Around<F>) {
    let observer = &mut Observer::none();
    if interiors::are_tracked(context.scene) {
        step(transport, context, state, around, alive, observer)
    } else {
        // The step needs no surroundings.
        let (stepped, ()) = step(transport, context, state, (), alive, observer);
        (stepped, around)
    }
}

/// One step of every living path: it hits a surface, gathers light there, and gets its next ray. For lanes, `S` is
/// always the same type, so that this is compiled once per level.
#[inline(always)]
fn step<F: Float, S: Surroundings<F>>(
    transport: Transport,
    context: &TraceContext<'_>,
    mut state: State<F>,
    around: S,
    alive: F::Mask,
    observer: &mut Observer<'_>,
) -> (Stepped<F>, S) {
    observer.event::<F>(|| ray_event(state.depth, &state.ray));
    let none = F::Mask::splat(false);
    let hit = context.world.intersect(&state.ray, alive);
    let (met, escaped) = (alive & hit.is_some(), alive & !hit.is_some());
    state.beta = interiors::absorbed(context.scene, &around, state.beta, hit.t);
    state.l = escape(
        context,
        &state,
        escaped,
        #[inline(always)]
        |previous, light_pdf| weight_of_escaped(previous, light_pdf),
        observer,
    );
    if observer.listens::<F>() && !met.first() {
        observer.event::<F>(|| Event::End { reason: "it left the scene", radiance: rgb(state.l) });
    }
    F::guard(
        met,
        (Stepped { state, going: none, shadows: none }, around),
        #[inline(always)]
        || {
            let vertex = Vertex::new(context, &state, &around, hit, met, observer);
            let (mut around, mut solid, mut is_none) = (around, met, none);
            if interiors::are_tracked(context.scene) {
                if context.scene.materials.has_holes() {
                    solid = solid & !vertex.holes;
                }
                (around, is_none) = interiors::at_surface(context.scene, around, &vertex.at, solid);
            }
            let weight =
                if transport.competes() { weight_of_met(context, &state, &vertex) } else { F::splat(1.0) };
            state.l = Rgb::select(met, state.l + state.beta * vertex.emitted * weight, state.l);
            let going = solid & !is_none & state.depth.lt(F::Uint::given(&context.settings.max_depth));
            if observer.listens::<F>() && !(going | is_none).first() && solid.first() {
                observer.event::<F>(|| Event::End { reason: "the depth limit", radiance: rgb(state.l) });
            }
            let left = F::guard(
                going,
                (Stepped { state, going, shadows: none }, around),
                #[inline(always)]
                || leave(transport, context, state, &vertex.at, going, around, observer),
            );
            pass_on(context, &state, &vertex, is_none, left, observer)
        },
    )
}

/// Continues paths straight through holes, and through surfaces that are no interfaces in the lanes of `is_none`.
/// `left` holds the other paths after their bounce.
#[inline(always)]
fn pass_on<F: Float, S: Surroundings<F>>(
    context: &TraceContext<'_>,
    met: &State<F>,
    vertex: &Vertex<F>,
    is_none: F::Mask,
    (left, around): (Stepped<F>, S),
    observer: &mut Observer<'_>,
) -> (Stepped<F>, S) {
    if !interiors::are_tracked(context.scene) {
        return (left, around);
    }
    let mut holes = F::Mask::splat(false);
    if context.scene.materials.has_holes() {
        holes = vertex.holes;
    }
    let (around, goes) = interiors::straight_on(around, is_none, holes);
    if observer.listens::<F>() && (is_none | holes).first() {
        let through = if holes.first() { Passage::Hole } else { Passage::NoInterface };
        observer.event::<F>(|| Event::Pass { through });
        if !goes.first() {
            observer.event::<F>(|| Event::End { reason: TOO_MANY_PASSED, radiance: rgb(met.l) });
        }
    }
    // Shadow rays pass through holes but end at surfaces that are no interfaces, so none could reach the emission
    // behind these.
    let previous = PreviousVertex { pdf: met.previous.pdf.only(!is_none), ..met.previous };
    let beyond = State { ray: vertex.at.straight_on(&met.ray), previous, ..*met };
    // Blended here and not out of line, so that the state need not go through memory in other scenes.
    let state = State::blend(is_none | holes, beyond, left.state);
    (Stepped { state, going: left.going | goes, shadows: left.shadows }, around)
}

/// The second half of a step: the direct light at an interaction, and the next ray.
#[inline(always)]
fn leave<F: Float, S: Surroundings<F>>(
    transport: Transport,
    context: &TraceContext<'_>,
    state: State<F>,
    at: &Interaction<F>,
    going: F::Mask,
    around: S,
    observer: &mut Observer<'_>,
) -> (Stepped<F>, S) {
    let at = *at;
    function!(F, leave_vertex(state, at, going, around), {
        let (mut state, mut going) = (state, going);
        let lights = &context.scene.lights;
        let scattering = Scattering::new(context.scene, &at, &state.ray, &around);
        let bsdf = scattering.bsdf(context.scene);
        let smooth = going & bsdf.has_non_delta();
        let (active, has_lights) = match transport {
            // Emissive surfaces are often black.
            Transport::NextEvent(_) => (smooth & !bsdf.is_black(), !lights.is_empty()),
            Transport::Naive => (smooth, !lights.delta_lights().is_empty()),
        };
        let mut shadows = F::Mask::splat(false);
        if has_lights {
            (state.l, shadows) = F::branch(
                active,
                (state.l, shadows),
                #[inline(always)]
                || {
                    let direct = match transport {
                        Transport::NextEvent(_) => {
                            direct_light(context, &state, &at, &scattering, active, around, observer)
                        }
                        Transport::Naive => {
                            delta_light(context, &state, &at, &scattering, active, around, observer)
                        }
                    };
                    (state.l + state.beta * direct.added, direct.traced)
                },
            );
        }

        let [u, v, lobe, survival] = context.settings.sampler.draw(state.id, SCATTER.at::<F>(state.depth));
        let scattered = bsdf.sample(scattering.wo, [u, v], lobe, TransportMode::Radiance);
        going = going & !go_on(context.scene, &mut state, &at, &scattering, &scattered, observer);
        let around = interiors::after_bounce(context.scene, around, &at, state.ray.d, going);

        let pdf = if transport.competes() { scattered.pdf.only(!scattered.delta) } else { F::zero() };
        let eta_scale = state.previous.eta_scale * (scattered.eta * scattered.eta);
        state.previous = PreviousVertex { p: at.point.p, n: at.point.n, pdf, eta_scale };
        if let Transport::NextEvent(NextEvent { roulette: true }) = transport {
            going = roulette(&mut state, going, survival, observer);
        }
        (Stepped { state, going, shadows }, around)
    })
}

/// Appends the samples of paths that have ended.
#[inline(always)]
fn push<F: LaneFloat>(ended: F::Mask, start: &Start<F>, l: Rgb<F>, out: &mut Vec<Finished>) {
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
