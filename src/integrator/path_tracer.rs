//! Path tracing: the loop over lanes, which each follow a path and start the next when it ends, and one step of a path.

use super::Integrator;
use super::blocks::path::SCATTER;
use super::first_hit::{FirstHit, FirstHits};
use super::interiors::{self, Around, Kept, Surroundings};
use super::naive::delta_light;
use super::next_event::{NextEvent, direct_light, weight_of_escaped, weight_of_met};
use super::observe::{Event, Observer, ray_event, rgb};
use super::paths::{Finished, Found, Paths, Settings};
use super::queue::{Queue, Start};
use super::roulette::roulette;
use super::vertex::{Departure, Scattering, State, Vertex, View, escape, go_on};
use crate::camera::Camera;
use crate::material::{Bxdf, TransportMode};
use crate::math::lanes::{Kernel, Level, MAX_LANES, Value, dispatch};
use crate::math::{Float, LaneFloat, LaneMask, LaneUint, Mask, Ray, Rgb, Uint, function, value};
use crate::sampling::{Pixel, Sample};
use crate::scene;
use crate::world::{CompiledScene, Interaction, World};
use std::cell::Cell;
use std::sync::Arc;

/// How paths gather light. It is a value and not a type, so that the path tracer is compiled once; the branch is taken
/// once a step for all lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Transport {
    /// By next-event estimation.
    NextEvent(NextEvent),
    /// By directions of the BxDF alone, but for delta lights: see `naive.rs`.
    Naive,
}

impl Transport {
    /// That of an integrator; `None` for one that follows no paths.
    pub(crate) fn of(integrator: scene::Integrator) -> Option<Transport> {
        match integrator {
            scene::Integrator::Path => Some(Transport::NextEvent(NextEvent::default())),
            scene::Integrator::PathNaive => Some(Transport::Naive),
            scene::Integrator::Whitted => None,
        }
    }

    /// Whether sampling lights competes with directions of the BxDF for the same light.
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
    fn view(&self) -> View<'_> {
        View { scene: &self.scene, world: &self.world, settings: &self.settings }
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
        let (view, transport, observer) = (self.view(), self.transport, Observer::none());
        dispatch(level, TracePaths { view, transport, paths, stop, out, observer })
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        dispatch(level, FirstHits { view: self.view(), paths, out });
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        let (scene, world) = (Arc::new(self.scene.seen_by(camera, &self.world)), Arc::clone(&self.world));
        Box::new(PathTracer { transport: self.transport, scene, world, settings: self.settings })
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        let paths = &Paths { pixels: &[pixel], first_sample: sample, samples: 1 };
        let (mut out, mut events) = (Vec::new(), Vec::new());
        let (view, transport, observer) = (self.view(), self.transport, Observer::of(&mut events));
        let (stop, out_all) = (&|| false, &mut out);
        // Events are those of a single lane.
        dispatch(Level::SCALAR, TracePaths { view, transport, paths, stop, out: out_all, observer });
        (out[0].sample, events)
    }
}

/// Traces a block of paths, and returns how many rays that took; `None` if it was to stop before the end.
pub(super) struct TracePaths<'a> {
    pub view: View<'a>,
    pub transport: Transport,
    pub paths: &'a Paths<'a>,
    /// Whether to stop. It is called at each bounce of a packet, as there is no other bound on the time that paths take.
    pub stop: &'a dyn Fn() -> bool,
    pub out: &'a mut Vec<Finished>,
    pub observer: Observer<'a>,
}

impl Kernel for TracePaths<'_> {
    type Output = Option<u64>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Option<u64> {
        let TracePaths { view, transport, paths, stop, out, mut observer } = self;
        let mut queue = Queue::new(paths);
        let mut start = Start::<F>::nowhere();
        let mut state = State::start(start.id, Ray::none());
        let mut alive = F::Mask::splat(false);
        let around = Cell::new(Around::nothing());
        let around = Kept(&around);
        let mut rays = 0;
        loop {
            // Lanes whose paths have ended start the next ones.
            let started = queue.take(!alive, view.settings, &view.scene.camera, &mut start, &mut state.ray);
            state.id = start.id;
            let fresh = State::start(start.id, state.ray);
            state.depth = F::Uint::select(started, fresh.depth, state.depth);
            state.beta = Rgb::select(started, fresh.beta, state.beta);
            state.l = Rgb::select(started, fresh.l, state.l);
            state.departure = Departure::blend(started, fresh.departure, state.departure);
            interiors::started(view.scene, around, started);
            alive = alive | started;
            if !alive.any() {
                return Some(rays);
            }
            if stop() {
                return None;
            }

            let (stepped, _) = step(transport, &view, state, around, alive, &mut observer);
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
    /// The lanes that go on.
    pub going: F::Mask,
    /// The lanes that traced a shadow ray.
    pub shadows: F::Mask,
}

value!(Stepped { state, going, shadows });

/// [`step`] with the surroundings of paths as a value, for recorded programs.
#[cfg(feature = "gpu")]
#[inline(always)]
pub(crate) fn step_with<F: Float>(
    transport: Transport,
    view: &View<'_>,
    state: State<F>,
    around: Around<F>,
    alive: F::Mask,
) -> (Stepped<F>, Around<F>) {
    let observer = &mut Observer::none();
    if interiors::are_kept(view.scene) {
        step(transport, view, state, around, alive, observer)
    } else {
        // Nothing of it is needed within.
        let (stepped, ()) = step(transport, view, state, (), alive, observer);
        (stepped, around)
    }
}

/// One step of every path that is alive: it meets a surface, gathers light there, and gets its next ray. Lanes have
/// surroundings of one type alone, so that this is compiled once for each level.
#[inline(always)]
fn step<F: Float, S: Surroundings<F>>(
    transport: Transport,
    view: &View<'_>,
    mut state: State<F>,
    around: S,
    alive: F::Mask,
    observer: &mut Observer<'_>,
) -> (Stepped<F>, S) {
    observer.event::<F>(|| ray_event(state.depth, &state.ray));
    let none = F::Mask::splat(false);
    let hit = view.world.intersect(&state.ray, alive);
    let (met, escaped) = (alive & hit.is_some(), alive & !hit.is_some());
    state.beta = interiors::absorbed(view.scene, &around, state.beta, hit.t);
    state.l = escape(
        view,
        &state,
        escaped,
        #[inline(always)]
        |departure, asked| weight_of_escaped(departure, asked),
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
            let vertex = Vertex::new(view, &state, &around, hit, met, observer);
            let mut solid = met;
            if view.scene.materials.has_holes() {
                solid = solid & !vertex.holes;
            }
            let (around, is_none) = interiors::at_surface(view.scene, around, &vertex.at, solid);
            let weight =
                if transport.competes() { weight_of_met(view, &state, &vertex) } else { F::splat(1.0) };
            state.l = Rgb::select(met, state.l + state.beta * vertex.emitted * weight, state.l);
            let going = solid & !is_none & state.depth.lt(F::Uint::given(&view.settings.max_depth));
            if observer.listens::<F>() && !(going | is_none).first() && solid.first() {
                observer.event::<F>(|| Event::End { reason: "the depth limit", radiance: rgb(state.l) });
            }
            let left = F::guard(
                going,
                (Stepped { state, going, shadows: none }, around),
                #[inline(always)]
                || leave(transport, view, state, &vertex.at, going, around, observer),
            );
            pass_on(view, &state, &vertex, is_none, left)
        },
    )
}

/// Takes paths straight on through holes, and where the surface that they met is none, in the lanes of `is_none`. The
/// others have left it.
#[inline(always)]
fn pass_on<F: Float, S: Surroundings<F>>(
    view: &View<'_>,
    met: &State<F>,
    vertex: &Vertex<F>,
    is_none: F::Mask,
    (left, around): (Stepped<F>, S),
) -> (Stepped<F>, S) {
    if !interiors::are_kept(view.scene) {
        return (left, around);
    }
    let mut holes = F::Mask::splat(false);
    if view.scene.materials.has_holes() {
        holes = vertex.holes;
    }
    let (around, goes) = interiors::straight_on(around, is_none, holes);
    // Rays to lights go through holes, but end at surfaces that are none: no such ray could have found what lies behind.
    let departure = Departure { pdf: met.departure.pdf.only(!is_none), ..met.departure };
    let beyond = State { ray: vertex.at.straight_on(&met.ray), departure, ..*met };
    // Blended here and not out of line: without any of this the state need not go through memory.
    let state = State::blend(is_none | holes, beyond, left.state);
    (Stepped { state, going: left.going | goes, shadows: left.shadows }, around)
}

/// The second half of a step: the direct light at an interaction, and the next ray.
#[inline(always)]
fn leave<F: Float, S: Surroundings<F>>(
    transport: Transport,
    view: &View<'_>,
    state: State<F>,
    at: &Interaction<F>,
    going: F::Mask,
    around: S,
    observer: &mut Observer<'_>,
) -> (Stepped<F>, S) {
    let at = *at;
    function!(F, leave_vertex(state, at, going, around), {
        let (mut state, mut going) = (state, going);
        let lights = &view.scene.lights;
        let scattering = Scattering::new(view.scene, &at, &state.ray, &around);
        let bsdf = scattering.bsdf(view.scene);
        let smooth = going & bsdf.has_non_delta();
        let (asks, has_lights) = match transport {
            // Surfaces that emit are often black.
            Transport::NextEvent(_) => (smooth & !bsdf.is_black(), !lights.is_empty()),
            Transport::Naive => (smooth, !lights.delta_lights().is_empty()),
        };
        let mut shadows = F::Mask::splat(false);
        if has_lights {
            (state.l, shadows) = F::branch(
                asks,
                (state.l, shadows),
                #[inline(always)]
                || {
                    let direct = match transport {
                        Transport::NextEvent(_) => {
                            direct_light(view, &state, &at, &scattering, asks, around, observer)
                        }
                        Transport::Naive => {
                            delta_light(view, &state, &at, &scattering, asks, around, observer)
                        }
                    };
                    (state.l + state.beta * direct.added, direct.traced)
                },
            );
        }

        let [u, v, lobe, survival] = view.settings.sampler.draw(state.id, SCATTER.at::<F>(state.depth));
        let scattered = bsdf.sample(scattering.wo, [u, v], lobe, TransportMode::Radiance);
        going = going & !go_on(view.scene, &mut state, &at, &scattering, &scattered, observer);
        let around = interiors::after_bounce(view.scene, around, &at, state.ray.d, going);

        let pdf = if transport.competes() { scattered.pdf.only(!scattered.delta) } else { F::zero() };
        let eta_scale = state.departure.eta_scale * (scattered.eta * scattered.eta);
        state.departure = Departure { p: at.point.p, n: at.point.n, pdf, eta_scale };
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
