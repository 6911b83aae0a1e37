//! What follows light in a scene: every path integrator with every sampler.

use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{Finished, Integrator, Naive, NextEvent, PathTracer, Paths, Settings};
use stride::math::lanes::Level;
use stride::render::Region;
use stride::sampling::Independent;
use stride::scene::Scene;
use stride::world;

/// A path integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    PathNaive,
    Path,
    PathWithoutRoulette,
}

/// A sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbers {
    Independent,
}

/// All samplers that integrators are proved with.
pub const NUMBERS: [Numbers; 1] = [Numbers::Independent];

/// A method over a scene, with numbers of a seed.
pub fn tracer(method: Method, numbers: Numbers, scene: &Scene, seed: u32) -> Box<dyn Integrator> {
    let (compiled, geometry) = world::compile(scene, scene.film.width, scene.film.height);
    let (compiled, world) = (Arc::new(compiled), Arc::new(geometry));
    let sampler = match numbers {
        Numbers::Independent => Independent { seed },
    };
    let offset = film_offset(scene.film.filter);
    let settings = Settings { sampler, offset, max_depth: scene.render.max_depth };
    let next_event = |roulette| {
        let transport = NextEvent { roulette };
        PathTracer { transport, scene: compiled.clone(), world: world.clone(), settings }
    };
    match method {
        Method::PathNaive => {
            Box::new(PathTracer { transport: Naive, scene: compiled.clone(), world: world.clone(), settings })
        }
        Method::Path => Box::new(next_event(true)),
        Method::PathWithoutRoulette => Box::new(next_event(false)),
    }
}

/// Gives every sample of a picture to `take`, with its pixel's index.
pub fn trace(tracer: &dyn Integrator, scene: &Scene, samples: u32, mut take: impl FnMut(u32, [f32; 3])) {
    let region = Region::whole(scene.film.width, scene.film.height);
    let level = Level::from_environment().expect("a level that this processor has");
    let mut finished: Vec<Finished> = Vec::new();
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    for pixels in pixels.chunks((8192 / samples.max(1) as usize).max(1)) {
        finished.clear();
        tracer.trace(level, &Paths { pixels, first_sample: 0, samples }, &mut finished);
        for f in &finished {
            take(f.sample.pixel, f.sample.radiance);
        }
    }
}
