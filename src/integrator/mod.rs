//! Integrators: what follows light from the camera into the scene.

mod first_hit;
mod lanes;
mod naive;
mod next_event;
mod observe;
mod queue;
mod tracer;
mod whitted;

pub use first_hit::FirstHit;
use naive::Naive;
pub use next_event::{NextEvent, ROULETTE_AT_MOST, ROULETTE_AT_MOST_FROM, ROULETTE_FROM, ROULETTE_KEEPS};
pub use observe::{Event, Observer};
pub use whitted::Whitted;

use self::tracer::PathTracer;
use crate::camera::Camera;
use crate::math::lanes::Level;
use crate::math::{Float, Ray};
use crate::sampling::warp::FilmOffset;
use crate::sampling::{Block, Independent, PathId, Sampler, Sobol};
use crate::scene;
use crate::world::{CompiledScene, World};
use std::sync::Arc;

/// One sample: where it fell on the film and what it saw.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Sample {
    /// The pixel it was made for: its index on the full film, row-major from the top left.
    pub pixel: u32,
    /// Its index among the pixel's samples.
    pub sample: u32,
    /// Film position in pixels from the film's left edge.
    pub x: f32,
    /// Film position in pixels from the film's top edge.
    pub y: f32,
    /// Radiance in W·m⁻²·sr⁻¹, linear Rec. 709.
    pub radiance: [f32; 3],
}

/// A pixel of the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel {
    /// Index on the full film, row-major from the top left.
    pub index: u32,
    /// Column, from the left.
    pub x: u32,
    /// Row, from the top.
    pub y: u32,
}

/// Paths to trace: the same sample indices for each of some pixels.
#[derive(Clone, Copy, Debug)]
pub struct Paths<'a> {
    /// The pixels.
    pub pixels: &'a [Pixel],
    /// The first sample index.
    pub first_sample: u32,
    /// How many samples each pixel gets.
    pub samples: u32,
}

impl Paths<'_> {
    /// How many paths these are.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.pixels.len() * self.samples as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A finished path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finished {
    /// Which of the [`Paths::pixels`] it was for.
    pub slot: u32,
    /// What it found.
    pub sample: Sample,
}

/// Follows light. Chosen once per run; a call traces a block of paths, so that no indirect call falls on a ray.
pub trait Integrator: Send + Sync {
    /// Traces paths, appends their samples in any order, and returns how many rays that took.
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        self.trace_until(level, paths, &|| false, out).unwrap_or_default()
    }
    /// The same, and asks before each bounce of a packet whether to stop. If so it gives up at once and returns `None`:
    /// some of the paths may be in `out` then.
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Vec<Finished>,
    ) -> Option<u64>;
    /// Follows the camera rays of paths to what they meet first, in the order of the paths.
    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>);
    /// The same, where another camera looks at the same scene.
    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator>;
    /// Traces one path and tells what happens on it.
    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>);
}

/// What all integrators know of the film and of chance.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The source of random numbers.
    pub sampler: Sampler,
    /// How samples are spread around a pixel's centre.
    pub offset: FilmOffset,
    /// The largest number of bounces; [`scene::UNLIMITED`] with an integrator whose paths end all the same.
    pub max_depth: u32,
}

/// The integrator that a scene asks for, over the compiled scene and its world.
pub fn build(
    render: &scene::RenderSettings,
    offset: FilmOffset,
    scene: Arc<CompiledScene>,
    world: Arc<World>,
) -> Box<dyn Integrator> {
    let seed = render.seed;
    let sampler = match render.sampler {
        scene::Sampler::Independent => Independent { seed }.into(),
        scene::Sampler::Sobol => Sobol { seed }.into(),
    };
    let settings = Settings { sampler, offset, max_depth: render.max_depth };
    match render.integrator {
        scene::Integrator::Path => path(NextEvent::default(), scene, world, settings),
        scene::Integrator::PathNaive => path_naive(scene, world, settings),
        scene::Integrator::Whitted => Box::new(Whitted { scene, world, settings, seed }),
    }
}

/// The integrator `path`. It is made here so that its kernels are compiled once, in the library, and not in every
/// program that makes one.
pub fn path(
    transport: NextEvent,
    scene: Arc<CompiledScene>,
    world: Arc<World>,
    settings: Settings,
) -> Box<dyn Integrator> {
    Box::new(PathTracer { transport, scene, world, settings })
}

/// The integrator `path-naive`: see [`path`].
pub fn path_naive(scene: Arc<CompiledScene>, world: Arc<World>, settings: Settings) -> Box<dyn Integrator> {
    Box::new(PathTracer { transport: Naive, scene, world, settings })
}

/// A film position for a path, in pixels from the top left, and the camera ray through it.
#[inline(always)]
fn camera_ray<F: Float>(
    settings: &Settings,
    camera: &Camera,
    path: PathId<F>,
    centre: [F; 2],
) -> (F, F, Ray<F>) {
    let [u, v, lens_u, lens_v] =
        settings.sampler.draw(path, Block::CAMERA.at::<F>(crate::math::Uint::splat(0)));
    let x = centre[0] + settings.offset.sample(u);
    let y = centre[1] + settings.offset.sample(v);
    (x, y, camera.ray(x, y, [lens_u, lens_v]))
}
