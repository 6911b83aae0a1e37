//! The GPU compared with the CPU, on the adapter of this machine: in CI, Mesa's software renderer.

mod functions;
mod gallery;
mod layouts;
mod length;
mod lost;
mod partial_films;
mod pictures;
mod probe;
mod probes;
mod programs;
mod protocol;
mod scenes;
mod splats;
mod trees;
mod watched;
mod words;

// The statistical tests of the integration tests.
#[path = "../../../../tests/common/statistics.rs"]
#[allow(dead_code, unreachable_pub, reason = "shared helpers; each test uses some of them")]
mod statistics;
#[path = "../../../../tests/common/tiles.rs"]
#[allow(dead_code, unreachable_pub, reason = "shared helpers; each test uses some of them")]
mod tiles;

use super::device::Device;
use super::program::{DispatchLimits, Program};
use super::worker::GpuWorker;
use crate::film::{Splatter, Weights, film_offset};
use crate::gpu::{GpuError, Job};
use crate::integrator::{self, Integrator};
use crate::render::{Assignment, Payload, SampleBatch};
use crate::sampling::Region;
use crate::sampling::warp::FilmOffset;
use crate::scene::{RenderSettings, Scene};
use crate::world::{AcceleratorChoice, CompiledScene, World, compile_sharing};
use crossbeam_channel::{bounded, unbounded};
use std::sync::Arc;

/// A device; `None` on a machine without one, where that is allowed.
fn device() -> Option<Device> {
    match Device::open(None) {
        Ok(device) => Some(device),
        Err(GpuError::NoAdapter) if std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1") => {
            println!("skipped: no GPU adapter");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// A compiled scene, with the data that a job borrows.
struct Prepared {
    scene: CompiledScene,
    world: Arc<World>,
    render: RenderSettings,
    offset: FilmOffset,
    splatter: Option<Splatter>,
    whole: Region,
}

impl Prepared {
    fn new(scene: &Scene, seed: u32) -> Prepared {
        let (width, height) = (scene.film.width, scene.film.height);
        // Meshes with two copies are shared, however small.
        let (compiled, surfaces) = compile_sharing(scene, width, height, 0).unwrap();
        let world = Arc::new(World::new(&surfaces, AcceleratorChoice::Fastest));
        let compiled = compiled.with_camera_media(&world);
        let render = RenderSettings { seed, ..scene.render.clone() };
        let offset = film_offset(&scene.film);
        let splatter = Weights::of(&scene.film).map(|weights| Splatter::new(weights, [0, 0]));
        Prepared { scene: compiled, world, render, offset, splatter, whole: Region::whole(width, height) }
    }

    /// Renders the GPU's job on the CPU.
    fn on_cpu(&self) -> Box<dyn Integrator> {
        integrator::build(&self.render, self.offset, self.scene.clone().into(), Arc::clone(&self.world))
    }

    fn job(&self) -> Job<'_> {
        Job {
            scene: &self.scene,
            world: &self.world,
            render: &self.render,
            offset: self.offset,
            region: self.whole,
            index: 0,
            sends_samples: false,
            splatter: self.splatter.as_ref(),
        }
    }
}

/// Executes orders on a worker.
fn carry_out(worker: &mut GpuWorker, orders: &[impl Clone + Into<Assignment>]) -> Vec<SampleBatch> {
    let (orders_out, orders_in) = bounded(orders.len());
    for order in orders {
        orders_out.send(order.clone().into()).unwrap();
    }
    drop(orders_out);
    let (batches_out, batches) = unbounded();
    worker.run(&orders_in, &batches_out).unwrap();
    drop(batches_out);
    batches.iter().collect()
}

/// The totals of a pixel on the film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Total {
    rgb: [i128; 3],
    squares: u128,
    count: u32,
    rejected: u32,
}

/// Adds batches of sums by pixel, for a region of this many pixels.
fn totals(batches: &[SampleBatch], len: u32) -> Vec<Total> {
    let mut totals = vec![Total::default(); len as usize];
    for batch in batches {
        let Payload::Sums { first_slot, sums, bright, wide } = &batch.payload else {
            panic!("there are samples where sums were asked for")
        };
        assert!(bright.is_empty());
        for (slot, sums) in (*first_slot..).zip(sums) {
            let total = &mut totals[batch.stride.place(slot) as usize];
            for (sum, value) in total.rgb.iter_mut().zip(sums.rgb) {
                *sum += i128::from(value);
            }
            total.squares += sums.squares as u128;
            total.count += sums.count;
            total.rejected += sums.rejected;
        }
        for (slot, sums) in wide {
            let total = &mut totals[batch.stride.place(*slot) as usize];
            for (sum, value) in total.rgb.iter_mut().zip(sums.rgb) {
                *sum += value;
            }
            total.squares += sums.squares;
        }
    }
    totals
}
