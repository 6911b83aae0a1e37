//! Scenes in code, and their images without processes.
#![allow(dead_code, unreachable_pub, reason = "a kit of which each test program uses its own part")]

pub mod blocks;
pub mod chi_square;
pub mod scenes;
pub mod shapes {
    use glam::{DAffine3, DMat3, DVec3};
    use std::sync::Arc;
    use stride::scene::*;
    include!("shapes.rs");
}
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
use stride::world::{self, AcceleratorChoice, World};

/// The maximum number of paths traced at a time.
const BLOCK: u32 = 4096;

/// The integrator of a scene.
pub fn integrator(scene: &Scene) -> Box<dyn Integrator> {
    integrator_in(scene, AcceleratorChoice::Fastest)
}

/// The integrator of a scene, with a given accelerator.
pub fn integrator_in(scene: &Scene, accelerator: AcceleratorChoice) -> Box<dyn Integrator> {
    let (compiled, surfaces) = world::compile(scene, scene.film.width, scene.film.height).unwrap();
    let (world, offset) = (World::new(&surfaces, accelerator), film_offset(&scene.film));
    let compiled = Arc::new(compiled.with_camera_media(&world));
    integrator::build(&scene.render, offset, compiled, Arc::new(world))
}

/// Passes every sample of a scene's image to `take`, with its pixel's index.
pub fn for_each_sample(scene: &Scene, take: impl FnMut(usize, [f32; 3])) {
    for_each_sample_in(scene, AcceleratorChoice::Fastest, take);
}

/// The same, with a given accelerator.
pub fn for_each_sample_in(
    scene: &Scene,
    accelerator: AcceleratorChoice,
    mut take: impl FnMut(usize, [f32; 3]),
) {
    let integrator = integrator_in(scene, accelerator);
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

/// An image with a noise estimate.
pub fn estimate(scene: &Scene) -> Estimate {
    let mut estimate = Estimate::new(scene.film.width, scene.film.height);
    for_each_sample(scene, |pixel, radiance| estimate.add(pixel, radiance));
    estimate
}
