//! Scenes by hand, and pictures of them without processes.
#![allow(dead_code, unreachable_pub, reason = "a kit of which each test program uses its own part")]

pub mod blocks;
pub mod chi_square;
pub mod scenes;
pub mod statistics;
pub mod tiles;
pub mod tracers;
pub mod watched;

use self::blocks::Estimate;
use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{self, Finished, Integrator, Paths};
use stride::math::lanes::Level;
use stride::sampling::Region;
use stride::scene::Scene;
use stride::world::{self, Finder, World};

/// The most paths that are traced at a time.
const BLOCK: u32 = 4096;

/// What follows light in a scene, as the scene asks for it.
pub fn integrator(scene: &Scene) -> Box<dyn Integrator> {
    integrator_in(scene, Finder::Fastest)
}

/// What follows light in a scene, with the world that is asked for.
pub fn integrator_in(scene: &Scene, finder: Finder) -> Box<dyn Integrator> {
    let (compiled, surfaces) = world::compile(scene, scene.film.width, scene.film.height).unwrap();
    let (world, offset) = (World::new(&surfaces, finder), film_offset(&scene.film));
    integrator::build(&scene.render, offset, Arc::new(compiled), Arc::new(world))
}

/// Gives every sample of a scene's picture to `take`, with its pixel's index.
pub fn for_each_sample(scene: &Scene, take: impl FnMut(usize, [f32; 3])) {
    for_each_sample_in(scene, Finder::Fastest, take);
}

/// The same, with the world that is asked for.
pub fn for_each_sample_in(scene: &Scene, finder: Finder, mut take: impl FnMut(usize, [f32; 3])) {
    let integrator = integrator_in(scene, finder);
    let region = Region::whole(scene.film.width, scene.film.height);
    let level = Level::from_environment().expect("a level that this processor has");
    let (mut pixels, mut finished): (Vec<_>, Vec<Finished>) = (Vec::new(), Vec::new());
    let samples = scene.render.samples;
    let places = (BLOCK / samples).max(1);
    for first in (0..region.len()).step_by(places as usize) {
        pixels.clear();
        pixels.extend((first..region.len().min(first + places)).map(|place| region.pixel(place)));
        for first_sample in (0..samples).step_by(BLOCK as usize) {
            let samples = BLOCK.min(samples - first_sample);
            finished.clear();
            integrator.trace(level, &Paths { pixels: &pixels, first_sample, samples }, &mut finished);
            for f in &finished {
                take(f.sample.pixel as usize, f.sample.radiance);
            }
        }
    }
}

/// A picture that knows its own noise.
pub fn estimate(scene: &Scene) -> Estimate {
    let mut estimate = Estimate::new(scene.film.width, scene.film.height);
    for_each_sample(scene, |pixel, radiance| estimate.add(pixel, radiance));
    estimate
}
