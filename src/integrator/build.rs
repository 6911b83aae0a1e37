//! From a scene's settings to its integrator.

use super::Integrator;
use super::next_event::NextEvent;
use super::path_tracer::{PathTracer, Transport};
use super::paths::Settings;
use super::whitted::Whitted;
use crate::sampling::warp::FilmOffset;
use crate::sampling::{Independent, Sobol};
use crate::scene;
use crate::world::{CompiledScene, World};
use std::sync::Arc;

/// The integrator that a scene names, over the compiled scene and its world.
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
    next_event: NextEvent,
    scene: Arc<CompiledScene>,
    world: Arc<World>,
    settings: Settings,
) -> Box<dyn Integrator> {
    let transport = Transport::NextEvent(next_event);
    Box::new(PathTracer { transport, scene, world, settings })
}

/// The integrator `path-naive`: see [`path`].
pub fn path_naive(scene: Arc<CompiledScene>, world: Arc<World>, settings: Settings) -> Box<dyn Integrator> {
    Box::new(PathTracer { transport: Transport::Naive, scene, world, settings })
}
