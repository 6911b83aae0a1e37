//! Loss of a device while the CPU renders beside it.

use super::{GpuWorker, Prepared, device, scenes, splats};
use crate::film::{Film, LayerSet, Layout};
use crate::gpu::Job;
use crate::math::lanes::Level;
use crate::render::accumulator::{Inbox, Outbox, Outcome, Totals, WorkerFailure};
use crate::render::worker::Worker;
use crate::render::{Accumulator, Change, Configuration, Port, Schedule};
use crossbeam_channel::{bounded, never};
use std::sync::Arc;

const SPP: u32 = 300;

/// Renders with a CPU worker and a GPU worker with equal shares. The device is lost after a number of samples.
fn render(prepared: &Prepared, lost_after: u64) -> Option<Outcome> {
    let device = device()?;
    let region = prepared.whole;
    let integrator = prepared.on_cpu();
    let mut gpu = GpuWorker::new(&device, &Job { index: 1, ..prepared.job() }).unwrap();
    let outcome = std::thread::scope(|scope| {
        let (batches_out, batches) = bounded(4);
        let (changes_out, changes) = bounded(2);
        let (cpu_orders_out, cpu_orders) = bounded(2);
        let (gpu_orders_out, gpu_orders) = bounded(2);
        let (progress_out, progress) = bounded::<Totals>(1);
        scope.spawn({
            let (batches_out, integrator) = (batches_out.clone(), &*integrator);
            move || {
                let level = Level::from_environment().unwrap();
                let worker = Worker {
                    index: 0,
                    integrator,
                    level,
                    region,
                    sends_samples: false,
                    splatter: prepared.splatter.as_ref(),
                    layers: LayerSet::NONE,
                };
                worker.run(&cpu_orders, &batches_out);
            }
        });
        scope.spawn(move || {
            if let Err(error) = gpu.run(&gpu_orders, &batches_out) {
                let (worker, message) = ("the GPU".to_owned(), error.to_string());
                let failure = WorkerFailure { index: 1, worker, message };
                changes_out.send(Change::Fails(failure)).unwrap();
            }
        });
        scope.spawn(move || {
            for totals in progress {
                if totals.samples > lost_after {
                    device.device.destroy();
                }
            }
        });
        let mut schedule = Schedule::new(2, region.len(), SPP, None, vec![]).with_faster(region.len(), 1.0);
        if prepared.splatter.is_some() {
            schedule = schedule.in_stripes(region.len(), region.width);
        }
        let weighted = prepared.splatter.is_some();
        let layout = Layout { weighted, ..Layout::plain(region.width, region.height) };
        let film = Film::with_layout(layout).unwrap();
        let ports = vec![Port::new(cpu_orders_out), Port { may_be_lost: true, ..Port::new(gpu_orders_out) }];
        let configuration = Configuration {
            splatter: prepared.splatter.clone().map(Arc::new),
            outbox: Outbox { progress: Some(progress_out), ..Outbox::default() },
            ..Configuration::new(film, region, schedule, ports)
        };
        Accumulator::new(configuration).run(Inbox { batches, changes, stop: never(), viewer: never() })
    });
    Some(outcome)
}

// The weights of a sample depend only on its position, which is the same on both sides. With only part of a sample's
// weights, the sums would differ from those of an uninterrupted render.
#[test]
fn a_continuous_film_holds_whole_samples_only() {
    let prepared = Prepared::new(&splats::continuous(scenes::cover(80, 60), splats::MITCHELL), 0);
    let all = u64::from(80 * 60 * SPP);
    let mut expected = None;
    for lost_after in [u64::MAX, 0, all / 10, all / 3] {
        let Some(outcome) = render(&prepared, lost_after) else { return };
        assert!(outcome.failure.is_none() && outcome.whole);
        assert!(lost_after > 0 || !outcome.lost.is_empty());
        let weights = splats::weights(&outcome.film);
        assert!(*expected.get_or_insert_with(|| weights.clone()) == weights, "lost after {lost_after}");
        assert_eq!(outcome.made.iter().sum::<u64>(), all);
    }
}

#[test]
fn the_cpu_finishes_the_work_of_a_lost_device() {
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let all = u64::from(80 * 60 * SPP);
    for lost_after in [0, all / 10, all / 3] {
        let Some(outcome) = render(&prepared, lost_after) else { return };
        assert!(outcome.failure.is_none() && outcome.whole);
        assert_eq!((outcome.totals.samples, outcome.totals.spp), (all, SPP));
        assert!((0..80 * 60).all(|place| outcome.film.seen(place) == u64::from(SPP)), "none twice");
        // With others the device may have finished before it was lost.
        assert!(lost_after > 0 || !outcome.lost.is_empty());
        assert_eq!(outcome.made.iter().sum::<u64>(), all);
    }
    let Some(outcome) = render(&prepared, u64::MAX) else { return };
    assert!(outcome.lost.is_empty() && outcome.whole && outcome.made[1] > 0);
}
