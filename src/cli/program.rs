//! `stride info --wgsl`: the program that a GPU runs for a scene.

use super::failure::Failure;
use super::reading::ReadingArguments;
use crate::film::{Splatter, Weights, film_offset};
use crate::gpu;
use crate::sampling::Region;
use crate::world::{AcceleratorChoice, World, compile};
use std::path::Path;

/// The WGSL for a scene with its own integrator, filter and sampler.
pub(super) fn of_scene(path: &Path, reading: &ReadingArguments) -> Result<String, Failure> {
    let scene = reading.load(path, false)?.scene;
    let (width, height) = (scene.film.width, scene.film.height);
    let (compiled, surfaces) = compile(&scene, width, height)?;
    let world = World::new(&surfaces, AcceleratorChoice::Fastest);
    let compiled = compiled.with_camera_media(&world);
    let splatter = Weights::of(&scene.film).map(|weights| Splatter::new(weights, [0, 0]));
    let job = gpu::Job {
        scene: &compiled,
        world: &world,
        render: &scene.render,
        offset: film_offset(&scene.film),
        region: Region::whole(width, height),
        index: 0,
        sends_samples: false,
        splatter: splatter.as_ref(),
    };
    Ok(gpu::wgsl(&job)?)
}
