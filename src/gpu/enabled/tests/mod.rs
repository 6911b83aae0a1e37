//! The GPU against the CPU, on whatever adapter this machine has: in CI, Mesa's software renderer.

mod blocks;
mod held;
mod layouts;
mod probes;
mod protocol;
mod scenes;
mod words;

use super::device::Device;
use super::pipeline::{Pipeline, Shape};
use super::worker::GpuWorker;
use crate::film::film_offset;
use crate::gpu::{GpuError, Job};
use crate::integrator::{Naive, PathTracer, Settings};
use crate::render::{Order, Payload, Region, SampleBatch};
use crate::sampling::Independent;
use crate::scene::Scene;
use crate::world::{CompiledScene, Geometry, compile};
use crossbeam_channel::{bounded, unbounded};

/// A device, or none on a machine without one, where that is allowed.
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

/// A scene, compiled, with what a job borrows.
struct Prepared {
    scene: CompiledScene,
    geometry: Geometry,
    settings: Settings<Independent>,
    whole: Region,
}

impl Prepared {
    fn new(scene: &Scene, seed: u32) -> Prepared {
        let (width, height) = (scene.film.width, scene.film.height);
        let (compiled, geometry) = compile(scene, width, height);
        let settings = Settings {
            sampler: Independent { seed },
            offset: film_offset(scene.film.filter),
            max_depth: scene.render.max_depth,
        };
        Prepared { scene: compiled, geometry, settings, whole: Region::whole(width, height) }
    }

    /// What the GPU renders, on the CPU.
    fn on_cpu(&self) -> PathTracer<Naive, Geometry, Independent> {
        let (scene, world) = (self.scene.clone().into(), self.geometry.clone().into());
        PathTracer { transport: Naive, scene, world, settings: self.settings }
    }

    fn job(&self) -> Job<'_> {
        Job {
            scene: &self.scene,
            geometry: &self.geometry,
            settings: self.settings,
            region: self.whole,
            index: 0,
            sends_samples: false,
        }
    }
}

/// Carries out orders on a worker.
fn carry_out(worker: &mut GpuWorker, orders: &[Order]) -> Vec<SampleBatch> {
    let (orders_out, orders_in) = bounded(orders.len());
    for order in orders {
        orders_out.send(*order).unwrap();
    }
    drop(orders_out);
    let (batches_out, batches) = unbounded();
    worker.run(&orders_in, &batches_out).unwrap();
    drop(batches_out);
    batches.iter().collect()
}

/// What the film would hold of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Total {
    rgb: [i128; 3],
    squares: u128,
    count: u32,
    rejected: u32,
}

/// Adds batches of sums up, place by place of a region of so many.
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
