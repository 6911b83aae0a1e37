//! Identical bits from run to run, and exact sums of everything that a film accepts.

use super::super::pace::Pace;
use super::super::program;
use super::super::tables::Tables;
use super::super::variant::ProgramPlan;
use super::{Device, DispatchLimits, GpuWorker, Prepared, Program, Total, carry_out, device, scenes, totals};
use crate::film::Film;
use crate::film::PixelSums;
use crate::film::reject::{Reject, check};
use crate::gpu::Job;
use crate::render::{Order, Payload, Stride};
use crate::scene::{Integrator, Sampler};
use std::time::Duration;

fn orders(stride: Stride) -> [Order; 3] {
    [(0, 1), (1, 5), (5, 21)].map(|(first, end)| Order { stride, first, end })
}

fn render(
    device: &Device,
    job: &Job<'_>,
    dispatch_limits: DispatchLimits,
    took: Option<Duration>,
) -> (Vec<Total>, u64) {
    render_stride(device, job, dispatch_limits, took, Stride::ALL)
}

fn render_stride(
    device: &Device,
    job: &Job<'_>,
    dispatch_limits: DispatchLimits,
    took: Option<Duration>,
    stride: Stride,
) -> (Vec<Total>, u64) {
    let tables = Tables::new(job).unwrap();
    let program =
        Program::new(device, job.render, dispatch_limits, ProgramPlan::of(device, &tables).unwrap()).unwrap();
    let mut worker = GpuWorker::with_program(device, job, &tables, program).unwrap();
    if let Some(took) = took {
        // A pace from elsewhere: dispatches of another size.
        let mut pace = Pace::new(false);
        (0..20).for_each(|_| pace.learn(30_000, took));
        worker.set_pace(pace);
    }
    let batches = carry_out(&mut worker, &orders(stride));
    let rays = batches.iter().map(|batch| batch.rays).sum();
    (totals(&batches, job.region.len()), rays)
}

#[test]
fn runs_are_identical_for_any_workgroup_size_and_dispatches() {
    let Some(device) = device() else { return };
    let whitted = scenes::with(scenes::bazaar(40, 30), Integrator::Whitted, Sampler::Sobol);
    let path = scenes::with(scenes::bazaar(40, 30), Integrator::Path, Sampler::Sobol);
    for scene in [scenes::cover(80, 60), path, whitted] {
        let prepared = Prepared::new(&scene, 0);
        let job = prepared.job();
        let usual = DispatchLimits::of(&device);
        let expected = render(&device, &job, usual, None);
        assert!(expected.0.iter().all(|total| total.count + total.rejected == 21));
        assert_eq!(render(&device, &job, usual, None), expected, "from one run to the next");
        let dispatch_limits = DispatchLimits { workgroup_size: 1, ..usual };
        assert_eq!(render(&device, &job, dispatch_limits, None), expected, "workgroups of one");
        // So few invocations that each has several slots.
        let dispatch_limits = DispatchLimits { workgroup_size: 32, workgroups: 3 };
        assert_eq!(render(&device, &job, dispatch_limits, None), expected, "96 invocations");
        for took in [Duration::from_millis(1), Duration::from_secs(1)] {
            assert_eq!(render(&device, &job, usual, Some(took)), expected, "30,000 paths took {took:?}");
        }
        // Negative control: another seed makes another image.
        let other = Prepared::new(&scene, 1);
        assert_ne!(render(&device, &other.job(), usual, None), expected);
    }
}

#[test]
fn scenes_on_several_pages_are_identical() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::crowd(24, 16), 0);
    let (job, dispatch_limits) = (prepared.job(), DispatchLimits::of(&device));
    let tables = Tables::new(&job).unwrap();
    let whole = render(&device, &job, dispatch_limits, None);
    let bytes = (tables.words() * 16) as u64;
    let small = device.with_limits(bytes.div_ceil(3).next_power_of_two(), 40);
    let plan = ProgramPlan::of(&small, &tables).unwrap();
    assert!(plan.paging.pages > 1, "{bytes} bytes");
    assert_eq!(render(&small, &job, dispatch_limits, None), whole, "{} pages", plan.paging.pages);
    // Negative control: words are looked up on the wrong page.
    let text = program::text(job.render, dispatch_limits.workgroup_size, &plan);
    let wrong = text.replacen("case 1u: { return page_1", "case 1u: { return page_0", 1);
    assert_ne!(wrong, text);
    let program = Program::from_source(&small, &wrong, dispatch_limits, plan).unwrap();
    let mut worker = GpuWorker::with_program(&small, &job, &tables, program).unwrap();
    assert_ne!(totals(&carry_out(&mut worker, &orders(Stride::ALL)), job.region.len()), whole.0);
}

#[test]
fn strides_add_up_to_the_result_of_one_worker() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::cover(80, 60), 0);
    let dispatch_limits = DispatchLimits::of(&device);
    let (expected, _) = render(&device, &prepared.job(), dispatch_limits, None);
    let wide = Stride { first: 2, step: 7, run: 4 };
    for stride in [0, 1, 2].map(|first| Stride::ALL.split(first, 3)).into_iter().chain([wide]) {
        let (part, _) = render_stride(&device, &prepared.job(), dispatch_limits, None, stride);
        let mut owned = vec![false; part.len()];
        (0..stride.len(80 * 60)).for_each(|slot| owned[stride.place(slot) as usize] = true);
        for (place, total) in part.iter().enumerate() {
            assert_eq!(*total, if owned[place] { expected[place] } else { Total::default() }, "{stride:?}");
        }
    }
}

#[test]
fn returned_samples_are_those_that_are_summed() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::bazaar(40, 30), 0);
    let dispatch_limits = DispatchLimits::of(&device);
    let (expected, rays) = render(&device, &prepared.job(), dispatch_limits, None);
    let mut worker = GpuWorker::new(&device, &Job { sends_samples: true, ..prepared.job() }).unwrap();
    let batches = carry_out(&mut worker, &orders(Stride::ALL));
    assert_eq!(batches.iter().map(|batch| batch.rays).sum::<u64>(), rays);
    let mut sums = vec![PixelSums::default(); expected.len()];
    let mut seen = Vec::new();
    for batch in batches {
        let Payload::Samples(samples) = batch.payload else { panic!("there are no samples") };
        assert_eq!(samples.len() as u64, batch.paths);
        for sample in samples {
            assert_eq!(check(sample.radiance), Ok(()));
            let pixel = prepared.whole.pixel(sample.pixel);
            // The box filter extends to the pixel's edges.
            let offset = [sample.x - pixel.x as f32 - 0.5, sample.y - pixel.y as f32 - 0.5];
            assert!(offset.iter().all(|d| d.abs() <= 0.5), "{sample:?} is not in its pixel");
            sums[sample.pixel as usize].add(sample.radiance);
            seen.push((sample.pixel, sample.sample));
        }
    }
    seen.sort_unstable();
    let each: Vec<_> = (0..expected.len() as u32).flat_map(|p| (0..21).map(move |s| (p, s))).collect();
    assert_eq!(seen, each, "each sample once");
    for (sum, total) in sums.iter().zip(&expected) {
        assert_eq!(sum.rgb.map(i128::from), total.rgb, "rounded as on the CPU");
        // Squares are rounded to single precision before they are added.
        let (ours, theirs) = (sum.squares as f64, total.squares as f64);
        assert!((ours - theirs).abs() <= 1e-6 * ours + 64.0, "{ours} is not {theirs}");
    }
}

#[test]
fn bright_samples_do_not_overflow() {
    let Some(device) = device() else { return };
    // From values within 64 bits, and beyond, to the brightest that a film accepts.
    for emission in [[1000.0, 0.5, 3e-9], [5000.25, 1e6, 0.1], [1_073_741_824.0, 1e9, 1024.1]] {
        let prepared = Prepared::new(&scenes::beacon(emission), 0);
        let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
        let orders = [
            Order { stride: Stride::ALL, first: 0, end: 256 },
            Order { stride: Stride::ALL, first: 256, end: 300 },
        ];
        let batches = carry_out(&mut worker, &orders);
        let mut ours = Film::new(1, 1).unwrap();
        for _ in 0..300 {
            ours.add_sample(0, emission.map(|x| x as f32)).unwrap();
        }
        let centre = (8 * 16 + 8) as usize;
        let mut theirs = Film::new(16, 16).unwrap();
        let mut squares = 0.0;
        for batch in &batches {
            let Payload::Sums { first_slot, sums, wide, .. } = &batch.payload else { panic!("no sums") };
            for (slot, sums) in (*first_slot as usize..).zip(sums) {
                theirs.add_sums(slot, sums);
                squares += if slot == centre { sums.squares as f64 } else { 0.0 };
            }
            for (slot, sums) in wide {
                theirs.add_wide(*slot as usize, sums);
                squares += if *slot as usize == centre { sums.squares as f64 } else { 0.0 };
            }
        }
        assert_eq!(theirs.mean(centre), ours.mean(0), "{emission:?}");
        assert_eq!((theirs.count(centre), theirs.rejected()), (300, 0));
        let expected: f64 = emission.iter().map(|&x| f64::from(x as f32).powi(2)).sum::<f64>() * 300.0;
        let squares = squares / 4_294_967_296.0;
        assert!((squares / expected - 1.0).abs() < 1e-6, "{emission:?}: {squares} is not {expected}");
    }
}

#[test]
fn invalid_samples_are_counted_with_their_reason() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::beacon([1.0, 2e9, 1.0]), 0);
    let mut worker = GpuWorker::new(&device, &prepared.job()).unwrap();
    let batches = carry_out(&mut worker, &[Order { stride: Stride::ALL, first: 7, end: 12 }]);
    let totals = totals(&batches, 256);
    let centre = totals[8 * 16 + 8];
    assert_eq!(centre, Total { rejected: 5, ..Total::default() });
    assert_eq!(totals[0], Total { count: 5, ..Total::default() }, "the corner sees nothing");
    let named: Vec<_> = batches.iter().flat_map(|batch| batch.rejects.clone()).collect();
    assert!(!named.is_empty());
    for (traced, why) in named {
        assert!(why == Reject::TooBright && totals[traced.pixel as usize].rejected > 0);
        assert_eq!(traced.sample, 7);
    }
}

#[cfg(feature = "broken-material")]
#[test]
fn samples_of_a_broken_material_are_rejected_as_on_the_cpu() {
    use crate::integrator::Paths;
    use crate::math::lanes::Level;
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&scenes::broken(40, 30), 0);
    let (theirs, _) = render(&device, &prepared.job(), DispatchLimits::of(&device), None);
    let integrator = prepared.on_cpu();
    let pixels: Vec<_> = (0..40 * 30).map(|place| prepared.whole.pixel(place)).collect();
    let mut out = Vec::new();
    integrator.trace(Level::PORTABLE, &Paths { pixels: &pixels, first_sample: 0, samples: 21 }, &mut out);
    let ours = out.iter().filter(|f| check(f.sample.radiance).is_err()).count();
    let theirs: u32 = theirs.iter().map(|total| total.rejected).sum();
    assert!(ours > 1000);
    // Rounding errors may let a few paths miss the floor.
    assert!(ours.abs_diff(theirs as usize) <= 25, "the CPU rejects {ours}, the GPU {theirs}");
}
