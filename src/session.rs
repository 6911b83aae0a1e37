//! The wiring diagram: creates the channels and starts everybody.

use crate::film::Film;
use crate::integrator::Integrator;
use crate::math::lanes::Level;
use crate::render::accumulator::{Inbox, Outbox, Outcome, Stop, WorkerFailure};
use crate::render::worker::Worker;
use crate::render::{Accumulator, Region, Schedule, Stride};
use crossbeam_channel::{Receiver, bounded};
use std::time::{Duration, Instant};

/// How a render runs: everything but the scene and its integrator.
pub struct Plan {
    /// The part of the film that is rendered.
    pub region: Region,
    /// CPU workers.
    pub threads: usize,
    /// Which lanes they use.
    pub level: Level,
    /// Samples a pixel.
    pub spp: u32,
    /// Stop at the first barrier after this long.
    pub time: Option<Duration>,
    /// Sample counts to take pictures at.
    pub dump_at: Vec<u32>,
}

/// Renders.
pub fn render(plan: &Plan, integrator: &dyn Integrator, film: Film, stop: Receiver<Stop>) -> Outcome {
    let workers = plan.threads;
    let deadline = plan.time.map(|time| Instant::now() + time);
    let schedule = Schedule::new(workers, plan.spp, deadline, plan.dump_at.clone());
    std::thread::scope(|scope| {
        let (batches_out, batches) = bounded(2 * workers);
        let (failures_out, failures) = bounded(workers);
        let mut orders = Vec::new();
        for index in 0..workers {
            let (orders_out, orders_in) = bounded(2);
            orders.push(Some(orders_out));
            let batches_out = batches_out.clone();
            let failures_out = failures_out.clone();
            let worker = Worker {
                index,
                integrator,
                level: plan.level,
                region: plan.region,
                stride: Stride::ALL.split(index as u32, workers as u32),
                sends_samples: false,
            };
            scope.spawn(move || {
                let run = || worker.run(&orders_in, &batches_out);
                if let Err(panic) = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)) {
                    let message = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
                    let message = message.or_else(|| panic.downcast_ref::<String>().cloned());
                    let message = message.unwrap_or_else(|| "it panicked".to_owned());
                    let _ = failures_out.send(WorkerFailure { worker: format!("worker {index}"), message });
                }
            });
        }
        drop((batches_out, failures_out));
        let outbox = Outbox { orders, samples: None, barriers: None, snapshots: None, progress: None };
        let accumulator =
            Accumulator::new(film, plan.region, schedule, &plan.dump_at, Some(plan.spp), outbox);
        accumulator.run(&Inbox { batches, failures, stop })
    })
}
