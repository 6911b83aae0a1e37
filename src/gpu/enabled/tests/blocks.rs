//! The same picture as the CPU's, by statistics: different seeds on the two sides.
//!
//! Each side renders 32 independent replicates. For each block of 8 × 8 pixels and each channel, and for the
//! whole picture's channels, Welch's t compares the replicates' means. The largest |t| among the blocks is
//! held against the two-sided 1 − 10⁻⁴ bound for as many tests (Šidák), with the fewest degrees of freedom
//! that Welch's formula can give, 31: a sound comparison is refused at most once in 10,000 runs, and as the
//! seeds are fixed, not at all from one run to the next on one device.

use super::{Device, GpuWorker, Pipeline, Prepared, Shape, carry_out, device, scenes};
use crate::gpu::enabled::pipeline::{MAIN, library};
use crate::integrator::{Integrator, Paths};
use crate::math::lanes::Level;
use crate::render::{Order, Payload, Stride};
use crate::scene::Scene;

const REPLICATES: u32 = 32;

/// The side of a block in pixels.
const BLOCK: u32 = 8;

/// Student's t with 31 degrees of freedom exceeds this with probability 1 − (1 − 10⁻⁴)^(1/240): 80 blocks of
/// three channels.
const BLOCK_BOUND: f64 = 6.38;

/// The same for three tests.
const PICTURE_BOUND: f64 = 4.85;

const WIDTH: u32 = 80;
const HEIGHT: u32 = 64;
const BLOCKS: usize = ((WIDTH / BLOCK) * (HEIGHT / BLOCK)) as usize;

/// Sums of radiance for each block of one replicate.
type Replicate = [[f64; 3]; BLOCKS];

fn block(pixel: u32) -> usize {
    ((pixel / WIDTH / BLOCK) * (WIDTH / BLOCK) + pixel % WIDTH / BLOCK) as usize
}

fn on_cpu(prepared: &Prepared, spp: u32) -> Vec<Replicate> {
    let integrator = prepared.on_cpu();
    let level = Level::from_environment().unwrap();
    let pixels: Vec<_> = (0..WIDTH * HEIGHT).map(|place| prepared.whole.pixel(place)).collect();
    let replicate = |i: u32| {
        let mut sums = [[0.0; 3]; BLOCKS];
        let mut out = Vec::new();
        integrator.trace(level, &Paths { pixels: &pixels, first_sample: i * spp, samples: spp }, &mut out);
        for finished in out {
            let sum = &mut sums[block(finished.sample.pixel)];
            (0..3).for_each(|c| sum[c] += f64::from(finished.sample.radiance[c]));
        }
        sums
    };
    (0..REPLICATES).map(replicate).collect()
}

fn on_gpu(device: &Device, prepared: &Prepared, spp: u32, source: &str) -> Vec<Replicate> {
    let job = prepared.job();
    let pipeline = Pipeline::from_source(device, &job, Shape::of(device), source).unwrap();
    let mut worker = GpuWorker::with_pipeline(device, &job, pipeline).unwrap();
    let orders: Vec<_> =
        (0..REPLICATES).map(|i| Order { stride: Stride::ALL, first: i * spp, end: (i + 1) * spp }).collect();
    let mut replicates = vec![[[0.0; 3]; BLOCKS]];
    for batch in carry_out(&mut worker, &orders) {
        let Payload::Sums { first_slot, sums, .. } = batch.payload else { panic!("no sums") };
        let replicate = replicates.last_mut().unwrap();
        for (slot, sums) in (first_slot..).zip(sums) {
            let sum = &mut replicate[block(slot)];
            (0..3).for_each(|c| sum[c] += sums.rgb[c] as f64 / 4_294_967_296.0);
        }
        if batch.completes.is_some() {
            replicates.push([[0.0; 3]; BLOCKS]);
        }
    }
    replicates.pop();
    replicates
}

/// Welch's t of two sets of replicates; zero where neither varies and both agree.
fn welch(a: &[f64], b: &[f64]) -> f64 {
    let moments = |x: &[f64]| {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        (mean, x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
    };
    let ((mean_a, var_a), (mean_b, var_b)) = (moments(a), moments(b));
    if mean_a == mean_b { 0.0 } else { (mean_a - mean_b) / (var_a + var_b).sqrt() }
}

/// The largest |t| among blocks, and among the picture's channels.
fn compare(a: &[Replicate], b: &[Replicate]) -> (f64, f64) {
    assert_eq!((a.len(), b.len()), (REPLICATES as usize, REPLICATES as usize));
    let (mut blocks, mut picture) = (0.0_f64, 0.0_f64);
    for channel in 0..3 {
        let one = |i: usize| move |r: &Replicate| r[i][channel];
        for i in 0..BLOCKS {
            let [a, b] = [a, b].map(|side| side.iter().map(one(i)).collect::<Vec<_>>());
            blocks = blocks.max(welch(&a, &b).abs());
        }
        let all = |r: &Replicate| r.iter().map(|rgb| rgb[channel]).sum();
        let [a, b] = [a, b].map(|side| side.iter().map(all).collect::<Vec<_>>());
        picture = picture.max(welch(&a, &b).abs());
    }
    (blocks, picture)
}

fn agrees((blocks, picture): (f64, f64)) -> bool {
    blocks < BLOCK_BOUND && picture < PICTURE_BOUND
}

/// Holds a scene's picture against the CPU's, and that of the program with `right` replaced by `wrong`.
fn holds_against_the_cpu(scene: &Scene, spp: u32, right: &str, wrong: &str) {
    let Some(device) = device() else { return };
    let ours = on_cpu(&Prepared::new(scene, 1), spp);
    let prepared = Prepared::new(scene, 2);
    let program = library(64) + MAIN;
    let theirs = on_gpu(&device, &prepared, spp, &program);
    let found = compare(&ours, &theirs);
    assert!(agrees(found), "largest |t|: {found:?}");
    let changed = program.replacen(right, wrong, 1);
    assert_ne!(changed, program, "the control changes nothing");
    let found = compare(&ours, &on_gpu(&device, &prepared, spp, &changed));
    assert!(!agrees(found), "the control went unnoticed; largest |t|: {found:?}");
}

#[test]
fn the_cover_is_the_same_picture() {
    let scene = scenes::cover(WIDTH, HEIGHT);
    holds_against_the_cpu(
        &scene,
        8,
        "copysign(up.z, wo.z)), material.reflectance)",
        "copysign(up.z, wo.z)), material.reflectance * 0.95)",
    );
}

#[test]
fn lens_environment_glass_and_point_lights_make_the_same_picture() {
    let scene = scenes::bazaar(WIDTH, HEIGHT);
    holds_against_the_cpu(&scene, 8, "material.reflectance * FRAC_1_PI", "material.reflectance * 0.3");
}

#[test]
fn large_spheres_make_the_same_picture() {
    let scene = scenes::large_spheres(WIDTH, HEIGHT);
    // An offset of nothing lets rays meet the wall that they leave.
    holds_against_the_cpu(&scene, 8, "copysign(error, dot(n, d))", "copysign(error * 0.0, dot(n, d))");
}
