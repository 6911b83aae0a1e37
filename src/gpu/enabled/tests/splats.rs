//! Samples that the device adds to all pixels around them: the same sums as on the CPU, to the bit.

use super::super::layout::SampleWords;
use super::super::pace::{MOST_BRIGHT, Pace, Task};
use super::super::pipeline::{DispatchOutput, Pipeline, Room};
use super::super::program;
use super::super::tables::Tables;
use super::super::variant::ProgramPlan;
use super::{Device, DispatchLimits, GpuWorker, Prepared, Program, carry_out, device, scenes};
use crate::film::sums::{MAX_COUNT, MAX_SUMMED};
use crate::film::{Band, Film, Layout, Made, Splatter, Weights};
use crate::gpu::Job;
use crate::integrator::{Finished, Paths};
use crate::math::lanes::Level;
use crate::render::{Order, Payload, SampleBatch, Stride};
use crate::sampling::{Region, Sample, Stream};
use crate::scene::{FilmMode, Filter, Integrator, Sampler, Scene};
use rand::RngExt;
use std::time::Duration;

/// All filters, with widths that fill a word of the heap and that do not, and an odd radius.
const FILTERS: [Filter; 10] = [
    Filter::Box { radius: 0.5 },
    Filter::Tent { radius: 1.0 },
    Filter::Gaussian { radius: 1.5, sigma: 0.5 },
    Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 },
    Filter::BlackmanHarris { radius: 1.5 },
    Filter::Lanczos { radius: 3.0 },
    Filter::Box { radius: 1.25 },
    Filter::Tent { radius: 0.77 },
    Filter::Mitchell { radius: 5.3, b: 0.0, c: 0.5 },
    Filter::Lanczos { radius: 16.0 },
];

pub(super) const MITCHELL: Filter = FILTERS[3];

pub(super) fn continuous(mut scene: Scene, filter: Filter) -> Scene {
    (scene.film.filter, scene.film.mode) = (filter, Some(FilmMode::Continuous));
    scene
}

/// A part of the film, so that positions are not relative to its corner.
const REGION: Region = Region { film_width: 40, x: 9, y: 5, width: 15, height: 14 };

/// Samples in all its pixels, including their borders, of every magnitude that bands accept, with exact ties.
fn samples(seed: u32) -> Vec<Sample> {
    let stream = &mut Stream::new(seed, 0, 0);
    let radiance = |stream: &mut Stream| match stream.random_range(0..8) {
        0 => 0.0,
        1 => MAX_SUMMED,
        2 => f32::from_bits(stream.random_range(0..0x0080_0000)),
        3 => (stream.random_range(0..4096_u32) as f32 + 0.5) * 2.0_f32.powi(-32),
        4 => stream.random_range(0..64_u32) as f32 * 2.0_f32.powi(stream.random_range(-40..0)),
        _ => stream.random_range(-40.0..10.0_f32).exp2() * stream.random::<f32>(),
    };
    let one = |i: u32| {
        let pixel = REGION.pixel(i % REGION.len());
        let at = |from: u32, stream: &mut Stream| match stream.random_range(0..12) {
            0 => from as f32,
            1 => from as f32 + 1.0,
            2 => from as f32 + stream.random_range(0..256_u32) as f32 / 256.0,
            _ => from as f32 + stream.random::<f32>(),
        };
        let (x, y) = (at(pixel.x, stream), at(pixel.y, stream));
        let mut radiance = [radiance(stream), radiance(stream), radiance(stream)];
        match i {
            70 => radiance[1] = f32::NAN,
            71 => radiance[2] = -1.0,
            72 => radiance[0] = -0.0,
            _ => {}
        }
        Sample { pixel: pixel.index, sample: i / REGION.len(), x, y, radiance }
    };
    (0..20 * REGION.len()).map(one).collect()
}

/// A program that adds samples of the buffer to the film instead of tracing.
const GIVEN: &str = "@compute @workgroup_size(WORKGROUP_SIZE)
fn trace_slots(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= dispatch.slots {
        return;
    }
    let given = samples[id.x];
    var slot_sums = SlotSums();
    let at = bitcast<vec2f>(vec2u(given.x, given.y));
    let radiance = bitcast<vec3f>(vec3u(given.red, given.green, given.blue));
    add_splats(&slot_sums, PathId(given.pixel, given.sample), at, radiance);
    slot_sums.rays = 1u;
    // Every binding is named, so that none is missing.
    if scene.seed + heap_word(0u).x + arrayLength(&branches) != 0u {
        sums[id.x] = slot_sums;
    }
}
";

/// The device's sums of given samples, and the number of rejected ones, with a replacement in the program.
fn on_gpu(device: &Device, filter: Filter, samples: &[Sample], change: [&str; 2]) -> (Band, u32) {
    let prepared = Prepared::new(&continuous(scenes::cover(40, 30), filter), 1);
    let splatter = Splatter::new(Weights::new(filter), [REGION.x, REGION.y]);
    let job = Job { region: REGION, splatter: Some(&splatter), ..prepared.job() };
    let (tables, dispatch_limits) = (Tables::new(&job).unwrap(), DispatchLimits::of(device));
    let plan = ProgramPlan::of(device, &tables).unwrap();
    let text = program::text(job.render, dispatch_limits.workgroup_size, &plan);
    let library = text.strip_suffix(program::MAIN).unwrap();
    let changed = library.replacen(change[0], change[1], 1);
    assert!(change[0].is_empty() || changed != library, "{change:?} changes nothing");
    let program = Program::from_source(device, &(changed + GIVEN), dispatch_limits, plan).unwrap();
    let pipeline = Pipeline::new(device, &job, &tables, program).unwrap();
    let band = splatter.band(0, REGION.len() - 1, REGION.width);
    let slots = samples.len() as u32;
    let room = Room { slots, samples: slots, band_pixels: band.pixels() as u32 };
    let buffers = pipeline.buffers(device, room).unwrap();
    let words: Vec<_> = samples
        .iter()
        .map(|&Sample { pixel, sample, x, y, radiance }| {
            let [red, green, blue] = radiance.map(f32::to_bits);
            SampleWords { pixel, sample, x: x.to_bits(), y: y.to_bits(), red, green, blue }
        })
        .collect();
    buffers.write_samples(device, &words);
    let task =
        Task { stride: Stride::ALL, first_slot: 0, slots, first_sample: 0, samples: 1, completes: None };
    let submission = pipeline.submit(device, &buffers, REGION, task, DispatchOutput::Splats(band, slots));
    device.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    assert!(submission.is_readable());
    let DispatchOutput::Splats(mut band, room) = submission.output else { panic!("no band") };
    assert_eq!(buffers.splats(&mut band, room), Some(Ok(Vec::new())), "none is too bright");
    let rejected = |words: &[super::super::layout::SlotSums]| words.iter().filter(|w| w.rejected > 0).count();
    (band, buffers.sums(&task, rejected).unwrap() as u32)
}

fn on_cpu(filter: Filter, samples: &[Sample]) -> (Band, u32) {
    let splatter = Splatter::new(Weights::new(filter), [REGION.x, REGION.y]);
    let finished: Vec<_> = samples.iter().map(|&sample| Finished { slot: 0, sample }).collect();
    let mut band = splatter.band(0, REGION.len() - 1, REGION.width);
    let unusual = splatter.add(Level::SCALAR, &finished, &mut band, &mut [Made::default()]);
    (band, unusual.len() as u32)
}

const UNCHANGED: [&str; 2] = ["", ""];

#[test]
fn given_samples_give_the_same_sums_as_on_the_cpu() {
    let Some(device) = device() else { return };
    for (seed, filter) in (0..).zip(FILTERS) {
        let samples = samples(seed);
        assert!(samples.len() as u32 / REGION.len() < MAX_COUNT);
        let expected = on_cpu(filter, &samples);
        assert_eq!(expected.1, 2, "two are none that a film takes");
        assert!(on_gpu(&device, filter, &samples, UNCHANGED) == expected, "{filter}");
        // In another order.
        let reversed: Vec<_> = samples.iter().rev().copied().collect();
        assert!(on_gpu(&device, filter, &reversed, UNCHANGED) == expected, "{filter}, the last first");
        // Negative control: one sample less.
        assert!(on_gpu(&device, filter, &samples[1..], UNCHANGED) != expected, "{filter}");
    }
}

#[test]
fn mistakes_in_every_step_of_splatting_are_detected() {
    let Some(device) = device() else { return };
    let samples = samples(7);
    for (filter, right, wrong) in [
        (MITCHELL, "half_low = sample.half_low + odd;", "half_low = sample.half_low + 1u;"),
        (MITCHELL, "select(0u, 1u, before + low < low)", "0u"),
        (MITCHELL, "if weight < 0 {", "if weight < -268435456 {"),
        (MITCHELL, "let faint = shift > vec3u(53u);", "let faint = shift > vec3u(40u);"),
        (MITCHELL, "let far = sample.shift > vec3u(31u);", "let far = sample.shift > vec3u(33u);"),
        (MITCHELL, "+ upper * (size & 0xffffu)", ""),
        // Ties between two positions, which exist only where a tap's position is a multiple of 2^−CHANCE_BITS.
        (FILTERS[1], "scene.tap_ties != 0u", "scene.tap_ties == 0u"),
        (
            FILTERS[5],
            "let to_row = bitcast<vec4i>(heap_word(taps.row + TAP_WORDS + word));",
            "let to_row = from_row;",
        ),
        // Neighbours in a pixel that add concurrently.
        (
            MITCHELL,
            "let before = atomicAdd(&splats.words[word], low);",
            "let before = atomicLoad(&splats.words[word]); atomicStore(&splats.words[word], before + low);",
        ),
    ] {
        let expected = on_cpu(filter, &samples);
        assert!(on_gpu(&device, filter, &samples, [right, wrong]) != expected, "{filter}: {wrong:?}");
    }
}

/// The film that the batches of a region make.
fn film(region: Region, filter: Filter, batches: &[SampleBatch]) -> Film {
    let splatter = Splatter::new(Weights::new(filter), [region.x, region.y]);
    let layout = Layout { weighted: true, ..Layout::plain(region.width, region.height) };
    let mut film = Film::with_layout(layout).unwrap();
    let add = |film: &mut Film, samples: &[Sample]| {
        for sample in samples {
            // Samples that the film rejects are counted.
            let _ = film.splat(&splatter, region.place(sample.pixel) as usize, sample);
        }
    };
    for batch in batches {
        match &batch.payload {
            Payload::Samples(samples) => add(&mut film, samples),
            Payload::Splats { first_slot, made, band, bright } => {
                film.add_band(band);
                for (slot, &made) in (*first_slot..).zip(made) {
                    film.add_made(batch.stride.place(slot) as usize, made);
                }
                add(&mut film, bright);
            }
            Payload::Sums { .. } => panic!("a pixel's own sums on a film of splats"),
        }
    }
    film
}

/// The sums of weights: equal for all sources of samples, as all have the same positions.
pub(super) fn weights(film: &Film) -> Vec<[u8; 16]> {
    let pixels = film.layout().len() as usize;
    film.bytes(0..pixels).chunks_exact(64).map(|words| words[24..40].try_into().unwrap()).collect()
}

const ORDERS: [[u32; 2]; 3] = [[0, 1], [1, 5], [5, 21]];

fn orders(stride: Stride) -> [Order; 3] {
    ORDERS.map(|[first, end]| Order { stride, first, end })
}

/// Variations of a worker.
struct Way<'a> {
    dispatch_limits: DispatchLimits,
    pace: Option<Pace>,
    bright: u32,
    change: [&'a str; 2],
}

impl Way<'_> {
    fn usual(device: &Device) -> Way<'static> {
        Way {
            dispatch_limits: DispatchLimits::of(device),
            pace: None,
            bright: MOST_BRIGHT,
            change: UNCHANGED,
        }
    }

    fn carry_out(&self, device: &Device, job: &Job<'_>, orders: &[Order]) -> Vec<SampleBatch> {
        let tables = Tables::new(job).unwrap();
        let plan = ProgramPlan::of(device, &tables).unwrap();
        let text = program::text(job.render, self.dispatch_limits.workgroup_size, &plan);
        let changed = text.replacen(self.change[0], self.change[1], 1);
        assert!(self.change[0].is_empty() || changed != text, "{:?} changes nothing", self.change);
        let program = Program::from_source(device, &changed, self.dispatch_limits, plan).unwrap();
        let mut worker = GpuWorker::with_room(device, job, &tables, program, self.bright).unwrap();
        if let Some(pace) = self.pace {
            worker.set_pace(pace);
        }
        carry_out(&mut worker, orders)
    }
}

/// The film of a job's samples, added by the host.
fn film_of_samples(device: &Device, job: &Job<'_>, filter: Filter, orders: &[Order]) -> Film {
    let job = Job { sends_samples: true, ..*job };
    let batches = Way::usual(device).carry_out(device, &job, orders);
    assert!(batches.iter().all(|batch| matches!(batch.payload, Payload::Samples(_))));
    film(job.region, filter, &batches)
}

#[test]
fn the_film_does_not_depend_on_the_dispatches() {
    let Some(device) = device() else { return };
    let usual = || Way::usual(&device);
    for (scene, filter, integrator) in [
        (scenes::cover(80, 60), MITCHELL, Integrator::PathNaive),
        (scenes::bazaar(40, 30), FILTERS[5], Integrator::Whitted),
        (scenes::crowd(24, 16), FILTERS[7], Integrator::Path),
    ] {
        let scene = continuous(scenes::with(scene, integrator, Sampler::Sobol), filter);
        let prepared = Prepared::new(&scene, 0);
        let (job, all) = (prepared.job(), orders(Stride::ALL));
        let expected = film_of_samples(&device, &job, filter, &all);
        let holds = |way: Way<'_>, what: &str| {
            let batches = way.carry_out(&device, &job, &all);
            assert!(film(job.region, filter, &batches) == expected, "{filter}: {what}");
            let completes: Vec<_> = batches.iter().filter_map(|batch| batch.completes).collect();
            assert_eq!(completes, [1, 5, 21], "{filter}: {what}");
            let paths: u64 = batches.iter().map(|batch| batch.paths).sum();
            assert_eq!(paths, 21 * u64::from(job.region.len()), "{filter}: {what}");
        };
        holds(usual(), "as usual");
        holds(usual(), "once more");
        let dispatch_limits = DispatchLimits::of(&device);
        holds(
            Way { dispatch_limits: DispatchLimits { workgroup_size: 1, ..dispatch_limits }, ..usual() },
            "workgroups of one",
        );
        holds(
            Way { dispatch_limits: DispatchLimits { workgroup_size: 32, workgroups: 3 }, ..usual() },
            "96 invocations",
        );
        for took in [Duration::from_millis(1), Duration::from_secs(1)] {
            let mut pace = Pace::new(false);
            (0..20).for_each(|_| pace.learn(30_000, took));
            holds(Way { pace: Some(pace), ..usual() }, "at another pace");
        }
        // A driver that ends loops.
        for few in ["dispatch.samples <= 3u", "dispatch.samples <= 5u || dispatch.first_slot < 100u"] {
            let change = ["return turns == 2u;", &format!("return turns == 2u && ({few});")];
            let dispatch_limits = DispatchLimits { workgroups: 2, ..dispatch_limits };
            holds(Way { dispatch_limits, change, ..usual() }, few);
        }
        // In strides, whose films add up: one row in three, a few pixels, runs that begin and end anywhere.
        let [wide, thin] =
            [Stride { first: 0, step: 120, run: 70 }, Stride { first: 70, step: 120, run: 50 }];
        let parts = [Stride::every(3, 0), Stride::every(3, 1), Stride::every(3, 2)];
        for parts in [&parts[..], &[wide, thin]] {
            let batches = parts.iter().flat_map(|&part| usual().carry_out(&device, &job, &orders(part)));
            assert!(
                film(job.region, filter, &batches.collect::<Vec<_>>()) == expected,
                "{filter}: {parts:?}"
            );
        }
        // Negative control: another seed makes another film, with other weights.
        let other = Prepared::new(&scene, 1);
        let other = film(job.region, filter, &usual().carry_out(&device, &other.job(), &all));
        assert!(other != expected && weights(&other) != weights(&expected));
        // The CPU's samples have the same positions.
        let pixels: Vec<_> = (0..job.region.len()).map(|place| job.region.pixel(place)).collect();
        let mut traced = Vec::new();
        let paths = Paths { pixels: &pixels, first_sample: 0, samples: 21 };
        prepared.on_cpu().trace(Level::PORTABLE, &paths, &mut traced);
        let samples = Payload::Samples(traced.iter().map(|finished| finished.sample).collect());
        let ours = film(job.region, filter, &[SampleBatch::empty(0, Stride::ALL, samples)]);
        assert!(weights(&ours) == weights(&expected), "{filter}");
    }
}

#[test]
fn a_crop_is_the_film_of_its_own_samples() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&continuous(scenes::cover(80, 60), MITCHELL), 0);
    let region = Region { film_width: 80, x: 13, y: 7, width: 30, height: 20 };
    let splatter = Splatter::new(Weights::new(MITCHELL), [region.x, region.y]);
    let job = Job { region, splatter: Some(&splatter), ..prepared.job() };
    let expected = film_of_samples(&device, &job, MITCHELL, &orders(Stride::ALL));
    let batches = Way::usual(&device).carry_out(&device, &job, &orders(Stride::ALL));
    assert!(film(region, MITCHELL, &batches) == expected);
    assert!(batches.iter().all(|batch| matches!(batch.payload, Payload::Splats { .. })));
}

#[test]
fn samples_too_bright_for_a_band_are_returned_and_invalid_ones_counted() {
    let Some(device) = device() else { return };
    let all = [Order { stride: Stride::ALL, first: 0, end: 40 }];
    let limit = f64::from(MAX_SUMMED);
    for (emission, brights) in [
        ([limit, 0.5, 3e-9], false),
        ([f64::from(MAX_SUMMED.next_up()), 0.0, 0.1], true),
        ([1_073_741_824.0, 1e9, 1024.1], true),
        // The film rejects such values.
        ([2e9, 1.0, 1.0], false),
    ] {
        let prepared = Prepared::new(&continuous(scenes::beacon(emission), MITCHELL), 0);
        let job = prepared.job();
        let expected = film_of_samples(&device, &job, MITCHELL, &all);
        // The full capacity, of which less is used at first; a small one; and a tiny one, with which most dispatches
        // overflow and are repeated in parts.
        for room in [MOST_BRIGHT, 64, 7] {
            let batches = Way { bright: room, ..Way::usual(&device) }.carry_out(&device, &job, &all);
            assert!(film(job.region, MITCHELL, &batches) == expected, "{emission:?}, room for {room}");
            let bright = |batch: &SampleBatch| match &batch.payload {
                Payload::Splats { bright, .. } => bright.len() as u32,
                _ => 0,
            };
            assert!(batches.iter().all(|batch| bright(batch) <= room));
            let sent: u32 = batches.iter().map(bright).sum();
            assert!(if brights { sent > 2000 } else { sent == 0 }, "{emission:?}: {sent}");
        }
        let taken = emission[0] <= 1_073_741_824.0;
        assert_eq!(expected.rejected() == 0, taken);
    }
}

#[cfg(feature = "broken-material")]
#[test]
fn samples_of_a_broken_material_are_rejected_with_their_position() {
    let Some(device) = device() else { return };
    let prepared = Prepared::new(&continuous(scenes::broken(40, 30), MITCHELL), 0);
    let job = prepared.job();
    let expected = film_of_samples(&device, &job, MITCHELL, &orders(Stride::ALL));
    assert!(expected.rejected() > 1000);
    let batches = Way::usual(&device).carry_out(&device, &job, &orders(Stride::ALL));
    assert!(film(job.region, MITCHELL, &batches) == expected);
    assert!(batches.iter().any(|batch| !batch.rejects.is_empty()));
}
