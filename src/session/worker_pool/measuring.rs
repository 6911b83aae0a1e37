//! Measures the speed of devices, so that each gets work in proportion.

use super::threads::{GPU_STOP_TIME_LIMIT, RunningPool, STOP_TIME_LIMIT};
use super::{Gpu, WorkerPool};
use crate::film::LayerSet;
use crate::gpu;
use crate::render::{Order, Port, SampleBatch, Stride};
use crate::session::settings::RenderSettings;
use crossbeam_channel::{Receiver, RecvTimeoutError, at, bounded, select};
use std::convert::Infallible;
use std::time::{Duration, Instant};

/// The time of measuring, after the first results.
const MEASURED_FOR: Duration = Duration::from_millis(300);

/// The longest time of measuring, for slow first results.
const MEASURED_AT_MOST: Duration = Duration::from_secs(2);

/// Samples per pixel in the orders for measuring: more than devices make in that time.
const MEASURED_BY: u32 = 256;

impl WorkerPool {
    /// Adds a GPU to the pool and measures the speeds of both devices, side by side, as in the render: a software GPU
    /// then gets only the share that the CPU leaves to it.
    pub(super) fn measured_with(
        &mut self,
        settings: &RenderSettings,
        gpu: Gpu,
        stop: &Receiver<Infallible>,
    ) -> Result<(), gpu::GpuError> {
        let adapter = gpu.name.clone();
        let (splatter, integrator, threads) = (self.splatter.clone(), self.integrator.clone(), self.threads);
        // Layers need only few samples of a render: speeds are measured without them.
        let mut settings = settings.clone();
        settings.job.layers = LayerSet::NONE;
        let (first_hit_tracer, gpu) = (None, Some(gpu));
        let measured = WorkerPool { splatter, integrator, first_hit_tracer, threads, gpu, times: 1.0 };
        let (batches_out, batches) = bounded(2 * (threads + 1));
        let (changes_out, changes) = bounded(threads + 1);
        let (returned_out, returned) = bounded(1);
        let RunningPool { ports, .. } =
            measured.start(&settings, &batches_out, &changes_out, Some(returned_out));
        drop((batches_out, changes_out));
        let speeds = watch(&ports, &batches, stop);
        for stop in ports.iter().filter_map(|port| port.stop.as_ref()) {
            // A worker that has failed receives nothing.
            let _ = stop.try_send(());
        }
        // Closing both channels ends all workers.
        drop((ports, batches));
        let asked = Instant::now();
        let returned = returned.recv_deadline(asked + GPU_STOP_TIME_LIMIT);
        // The channel closes with the last thread. A CPU worker that does not end is ignored: if it meets the same path
        // in the render, it is abandoned there and reported. The same holds for a failure.
        while changes.recv_deadline(asked + STOP_TIME_LIMIT).is_ok() {}
        let (gpu, end) = returned.map_err(|error| {
            let message = match error {
                RecvTimeoutError::Timeout => format!("it did not stop within {GPU_STOP_TIME_LIMIT:?}"),
                RecvTimeoutError::Disconnected => "its worker panicked".to_owned(),
            };
            gpu::GpuError::Failed { adapter, message }
        })?;
        end?;
        let cpu = speeds[..threads].iter().sum::<f64>() / threads as f64;
        self.times = if cpu > 0.0 { speeds[threads] / cpu } else { 1.0 };
        self.gpu = Some(gpu);
        Ok(())
    }
}

/// The samples per second of each worker, over a period from its first results on, or until `stop` closes.
fn watch(ports: &[Port], batches: &Receiver<SampleBatch>, stop: &Receiver<Infallible>) -> Vec<f64> {
    let workers = ports.len();
    let order = |index: usize, round: u32| Order {
        stride: Stride::ALL.split(index as u32, workers as u32),
        first: round * MEASURED_BY,
        end: (round + 1) * MEASURED_BY,
    };
    for (index, port) in ports.iter().enumerate() {
        // A worker that does not receive its order has failed, and reports that elsewhere.
        let _ = port.orders.send(order(index, 0).into());
    }
    let start = Instant::now();
    // For each worker the times of the first and the last batch, and the samples after the first.
    let mut seen: Vec<Option<(Instant, Instant, u64)>> = vec![None; workers];
    let deadline = at(start + MEASURED_AT_MOST);
    loop {
        let batch = select! {
            recv(batches) -> batch => batch,
            recv(deadline) -> _ => break,
            recv(stop) -> _ => break,
        };
        let Ok(batch) = batch else { break };
        let now = Instant::now();
        match &mut seen[batch.worker] {
            Some((_, last, paths)) => (*last, *paths) = (now, *paths + batch.paths),
            unseen => *unseen = Some((now, now, 0)),
        }
        if let Some(end) = batch.completes {
            let _ = ports[batch.worker].orders.try_send(order(batch.worker, end / MEASURED_BY).into());
        }
        let all = seen.iter().all(|seen| seen.is_some_and(|(.., paths)| paths > 0));
        if all && start.elapsed() > MEASURED_FOR {
            break;
        }
    }
    let rate = |seen: &Option<(Instant, Instant, u64)>| {
        seen.map_or(0.0, |(first, last, paths)| paths as f64 / (last - first).as_secs_f64().max(1e-6))
    };
    seen.iter().map(rate).collect()
}
