//! The worker's side of the protocol.

use super::super::program;
use super::super::tables::Tables;
use super::super::variant::ProgramPlan;
use super::{DispatchLimits, Prepared, Program, carry_out, device, scenes, totals};
use crate::gpu::{Device, GpuError, GpuWorker, Job};
use crate::render::{Order, Payload, Stride};
use crate::sampling::Region;
use crossbeam_channel::{bounded, unbounded};

#[test]
fn every_order_ends_with_a_completing_batch() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let mut worker = GpuWorker::new(&device, &Job { index: 3, ..prepared.job() }).unwrap();
    let batches = carry_out(
        &mut worker,
        &[(0, 1), (1, 2), (2, 6)].map(|(first, end)| Order { stride: Stride::ALL, first, end }),
    );
    let completes: Vec<_> = batches.iter().filter_map(|batch| batch.completes).collect();
    assert_eq!(completes, [1, 2, 6]);
    assert_eq!(batches.last().unwrap().completes, Some(6));
    assert!(batches.iter().all(|batch| batch.worker == 3 && batch.stride == Stride::ALL));
    assert_eq!(batches.iter().map(|batch| batch.paths).sum::<u64>(), 80 * 60 * 6);
    let rays: u64 = batches.iter().map(|batch| batch.rays).sum();
    assert!((80 * 60 * 6..=80 * 60 * 6 * 6).contains(&rays), "{rays} rays");
}

#[test]
fn a_worker_without_pixels_completes_its_orders() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::beacon([1.0; 3]), 0);
    let stride = Stride::every(2000, 1000);
    let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
    let batches = carry_out(&mut worker, &[Order { stride, first: 0, end: 4 }]);
    assert_eq!(batches.len(), 1);
    assert_eq!((batches[0].paths, batches[0].completes), (0, Some(4)));
}

#[test]
fn a_worker_stops_when_the_batch_channel_closes_and_can_restart() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
    let (orders_out, orders_in) = unbounded();
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 200 }.into()).unwrap();
    let (batches_out, batches) = bounded(1);
    drop(batches);
    // The order channel stays open: only the batch channel ends the run.
    assert_eq!(worker.run(&orders_in, &batches_out), Ok(()));
    let again = carry_out(&mut worker, &[Order { stride: Stride::ALL, first: 0, end: 2 }]);
    assert_eq!(again.iter().map(|batch| batch.paths).sum::<u64>(), 80 * 60 * 2);
}

/// A worker whose driver ends loops where `condition` is false.
fn cut_short(device: &Device, prepared: &Prepared, job: &Job<'_>, condition: &str) -> GpuWorker {
    let (tables, dispatch_limits) =
        (Tables::new(job).unwrap(), DispatchLimits { workgroups: 2, ..DispatchLimits::of(device) });
    let plan = ProgramPlan::of(device, &tables).unwrap();
    let text = program::text(&prepared.render, dispatch_limits.workgroup_size, &plan);
    let changed = text.replacen("return turns == 2u;", &format!("return {condition};"), 1);
    assert_ne!(changed, text, "the program lacks the check");
    let program = Program::from_source(device, &changed, dispatch_limits, plan).unwrap();
    GpuWorker::with_program(device, job, &tables, program).unwrap()
}

#[test]
fn interrupted_dispatches_are_repeated_in_parts() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let orders = [(0, 7), (7, 40)].map(|(first, end)| Order { stride: Stride::ALL, first, end });
    let whole = carry_out(&mut GpuWorker::new(&device, &prepared.job()).unwrap(), &orders);
    let whole = totals(&whole, 80 * 60);
    for few in [
        "dispatch.samples <= 3u",
        "dispatch.samples <= 1u && dispatch.slots <= dispatch.invocations",
        // In a part of the image.
        "dispatch.samples <= 5u || dispatch.first_slot < 700u",
    ] {
        let mut worker = cut_short(&device, &prepared, &prepared.job(), few);
        let batches = carry_out(&mut worker, &orders);
        assert!(totals(&batches, 80 * 60) == whole, "{few}");
        let completes: Vec<_> = batches.iter().filter_map(|batch| batch.completes).collect();
        assert_eq!(completes, [7, 40], "{few}");
        let job = Job { sends_samples: true, ..prepared.job() };
        let batches = carry_out(&mut cut_short(&device, &prepared, &job, few), &orders);
        let mut seen = vec![false; 80 * 60 * 40];
        for batch in batches {
            let Payload::Samples(samples) = batch.payload else { panic!("no samples") };
            for sample in samples {
                let seen = &mut seen[(sample.pixel * 40 + sample.sample) as usize];
                assert!(!*seen, "one comes twice");
                *seen = true;
            }
        }
        assert!(seen.iter().all(|&seen| seen), "{few}: one is missing");
    }
}

#[test]
fn interrupted_dispatches_are_repeated_after_the_last_order() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(16, 12), 0);
    // One dispatch, after which the channel is closed.
    let orders = [Order { stride: Stride::ALL, first: 0, end: 7 }];
    let whole = carry_out(&mut GpuWorker::new(&device, &prepared.job()).unwrap(), &orders);
    assert_eq!(whole.len(), 1);
    let mut worker = cut_short(&device, &prepared, &prepared.job(), "dispatch.samples <= 3u");
    let batches = carry_out(&mut worker, &orders);
    assert!(batches.len() > 1 && totals(&batches, 16 * 12) == totals(&whole, 16 * 12));
}

#[test]
fn a_driver_that_ends_every_loop_is_an_error() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let mut worker = cut_short(&device, &prepared, &prepared.job(), "dispatch.samples < 1u");
    let (orders_out, orders_in) = unbounded();
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 20 }.into()).unwrap();
    let (batches_out, batches) = unbounded();
    let error = worker.run(&orders_in, &batches_out).unwrap_err();
    assert!(matches!(error, GpuError::CutShort { .. }), "{error}");
    assert!(error.to_string().contains("`device` cpu"), "{error}");
    assert!(batches.is_empty());
}

#[test]
fn many_samples_of_few_pixels_equal_many_short_runs() {
    // Enough for llvmpipe to end loops: 65,535 iterations.
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::crowd(4, 2), 0);
    let render = |orders: &[Order]| {
        totals(&carry_out(&mut GpuWorker::new(&device, &prepared.job()).unwrap(), orders), 8)
    };
    let at_once = render(&[Order { stride: Stride::ALL, first: 0, end: 3000 }]);
    let short: Vec<_> =
        (0..300).map(|i| Order { stride: Stride::ALL, first: i * 10, end: (i + 1) * 10 }).collect();
    assert_eq!(at_once, render(&short));
    assert!(at_once.iter().all(|total| total.count == 3000));
    // The result of a program without the check; the driver decides whether it is wrong.
    let orders = [Order { stride: Stride::ALL, first: 0, end: 3000 }];
    let blind = carry_out(&mut cut_short(&device, &prepared, &prepared.job(), "true"), &orders);
    println!("without the check the sums are the same: {}", totals(&blind, 8) == at_once);
}

#[test]
fn a_lost_device_is_an_error_and_not_a_panic() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
    device.device.destroy();
    let (orders_out, orders_in) = unbounded();
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 200 }.into()).unwrap();
    let (batches_out, _batches) = unbounded();
    let result = worker.run(&orders_in, &batches_out);
    assert!(matches!(result, Err(GpuError::Failed { .. })), "{result:?}");
}

#[test]
fn an_invalid_program_is_an_error_with_its_location() {
    let Some(device) = device() else { return };
    let (dispatch_limits, prepared) =
        (DispatchLimits::of(&device), Prepared::new(&scenes::beacon([1.0; 3]), 0));
    let plan = ProgramPlan::of(&device, &Tables::new(&prepared.job()).unwrap()).unwrap();
    let source = "@compute @workgroup_size(1) fn trace_slots() { let x: u32 = 1.5; }";
    let result = Program::from_source(&device, source, dispatch_limits, plan);
    let Err(GpuError::Failed { message, .. }) = result else { panic!("the program was accepted") };
    assert!(message.contains("1.5"), "{message}");
}

#[test]
fn a_scene_beyond_the_adapters_limits_is_rejected_with_sizes() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(8, 6), 0);
    let name = device.description().name.clone();
    let needed = (Tables::new(&prepared.job()).unwrap().words() * 16) as u64;
    // Pages of a size of which the scene takes three or four; sizes are powers of two.
    let page = needed.next_power_of_two() / 4;
    let pages = needed.div_ceil(page) as u32;
    assert!((3..=4).contains(&pages), "{needed} bytes take {pages} pages of {page}");
    let fits = |device: Device| GpuWorker::new(&device, &prepared.job()).map(|_| ());
    assert_eq!(fits(device.clone().with_limits(needed, 1)), Ok(()));
    assert_eq!(fits(device.clone().with_limits(page, pages)), Ok(()));
    let result = fits(device.with_limits(page, pages - 1));
    let error = GpuError::TooLarge {
        what: "the scene's tables",
        needed,
        adapter: name,
        limit: u64::from(pages - 1) * page,
    };
    assert_eq!(result, Err(error.clone()));
    assert!(
        error.to_string().contains(&format!("{needed} bytes")) && error.to_string().contains("`device` cpu"),
        "{error}"
    );
}

#[test]
fn very_long_paths_are_rejected() {
    let Some(device) = device() else { return };
    let mut prepared = Prepared::new(&scenes::cover(8, 6), 0);
    prepared.render.max_depth = 70_000;
    let Err(error) = GpuWorker::new(&device, &prepared.job()) else { panic!("the job was accepted") };
    assert!(error.to_string().contains("bounces"), "{error}");
}

#[test]
fn an_unknown_adapter_name_lists_the_available_ones() {
    if device().is_none() {
        return;
    }
    let error = crate::gpu::Device::open(Some("no such thing")).unwrap_err().to_string();
    let first = crate::gpu::adapters()[0].name.clone();
    assert!(error.contains("no such thing") && error.contains(&first), "{error}");
    // Any part of a name matches, in any case.
    let part = first[..3].to_uppercase();
    assert!(crate::gpu::Device::open(Some(&part)).is_ok());
}

#[test]
fn a_crop_has_the_pixels_of_the_whole_film() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let orders = [Order { stride: Stride::ALL, first: 0, end: 4 }];
    let mut whole = GpuWorker::new(&device, &prepared.job()).unwrap();
    let whole = super::totals(&carry_out(&mut whole, &orders), 80 * 60);
    let region = Region { film_width: 80, x: 13, y: 7, width: 30, height: 20 };
    let mut crop = GpuWorker::new(&device, &Job { region, ..prepared.job() }).unwrap();
    let crop = super::totals(&carry_out(&mut crop, &orders), region.len());
    for place in 0..region.len() {
        assert_eq!(crop[place as usize], whole[region.pixel(place).index as usize]);
    }
}
