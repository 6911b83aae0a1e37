//! Construction of the integrator of a scene.

use super::Integrator;
use super::next_event::NextEvent;
use super::path_tracer::{PathTracer, Transport};
use super::paths::Settings;
use super::whitted::Whitted;
use crate::sampling::warp::FilmOffset;
use crate::scene;
use crate::world::{CompiledScene, World};
use std::sync::Arc;

/// The integrator that a scene names, for the compiled scene and its world.
pub fn build(
    render: &scene::RenderSettings,
    offset: FilmOffset,
    scene: Arc<CompiledScene>,
    world: Arc<World>,
) -> Box<dyn Integrator> {
    let settings = Settings::new(render, offset);
    match Transport::of(render.integrator) {
        Some(transport) => Box::new(PathTracer { transport, scene, world, settings }),
        None => Box::new(Whitted { scene, world, settings, seed: render.seed }),
    }
}

/// Whether an integrator contributes samples to pixels other than their own.
pub fn contributes(integrator: scene::Integrator) -> bool {
    match integrator {
        scene::Integrator::Path | scene::Integrator::PathNaive | scene::Integrator::Whitted => false,
    }
}

/// The integrator `path`. It is constructed here so that its kernels are compiled once, in the library, and not in
/// every program that uses it.
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
