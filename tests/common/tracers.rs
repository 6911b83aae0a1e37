//! Every path integrator with every sampler.

use super::tiles::Replicates;
use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{self, Finished, Integrator, NextEvent, Paths, Settings};
use stride::math::lanes::Level;
use stride::sampling::{Independent, Region, Sobol};
use stride::scene::Scene;
use stride::world::{self, AcceleratorChoice, World};

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
    Sobol,
}

/// All samplers with which integrators are tested.
pub const NUMBERS: [Numbers; 2] = [Numbers::Independent, Numbers::Sobol];

/// A method for a scene, with a seed.
pub fn tracer(method: Method, numbers: Numbers, scene: &Scene, seed: u32) -> Box<dyn Integrator> {
    let sampler = match numbers {
        Numbers::Independent => Independent { seed }.into(),
        Numbers::Sobol => Sobol { seed }.into(),
    };
    let (compiled, surfaces) = world::compile(scene, scene.film.width, scene.film.height).unwrap();
    let world = World::new(&surfaces, AcceleratorChoice::Simple);
    let (scene_tables, world) = (Arc::new(compiled.with_camera_media(&world)), Arc::new(world));
    let offset = film_offset(&scene.film);
    let settings = Settings { sampler, offset, max_depth: scene.render.max_depth };
    match method {
        Method::PathNaive => integrator::path_naive(scene_tables, world, settings),
        Method::Path | Method::PathWithoutRoulette => {
            let transport = NextEvent { roulette: method == Method::Path };
            integrator::path(transport, scene_tables, world, settings)
        }
    }
}

/// Passes every sample of an image to `take`, with its pixel's index.
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

/// Replicates of a scene's image, with the seeds `first_seed`, `first_seed + 1`, …
pub fn replicates(
    method: Method,
    numbers: Numbers,
    scene: &Scene,
    samples: u32,
    first_seed: u32,
) -> Replicates {
    Replicates::of([scene.film.width, scene.film.height], samples, |replicate, take| {
        let tracer = tracer(method, numbers, scene, first_seed + replicate);
        trace(tracer.as_ref(), scene, samples, |pixel, radiance| take(pixel, radiance.map(f64::from)));
    })
}
