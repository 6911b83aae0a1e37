//! Ten thousand small lamps over a floor with boxes: the efficiency of choosing lights by importance and by equal
//! probability, and that of ten lamps with the same total power.
//!
//! ```sh
//! cargo bench --bench lights                        # the table
//! cargo bench --bench lights -- --write lamps.toml  # the scene, for `stride render` and benches/lights.py
//! ```
//!
//! Efficiency is 1/(variance × seconds). The variance is half the squared difference of two renders with different seeds,
//! relative to their mean (plus 0.01 under the root), over all pixels except the worst 0.5%. Only light from surfaces
//! counts, because the choice of lights does not affect lamps that camera rays hit.

use rand::RngExt;
use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;
use stride::film::film_offset;
use stride::integrator::{self, Finished, Integrator, NextEvent, Paths, Settings};
use stride::math::lanes::Level;
use stride::render::Stride;
use stride::sampling::{Region, Sobol, Stream};
use stride::scene::{self, Scene};
use stride::world::{self, AcceleratorChoice, World};

const SAMPLES: u32 = 64;

/// The scene with a number of lamps, whose total power does not depend on the number.
fn pose(lamps: u32) -> String {
    let stream = &mut Stream::new(2018, 0, 0);
    let mut text = String::from(
        "camera = { eye = [0, -14, 7], look_at = [0, 0, 0.6], vertical_fov = 45 }\n\
         film = { width = 320, height = 240, filter = \"box\" }\n\
         render = { integrator = \"path\", max_depth = 3, samples = 64 }\n\
         [materials]\n\
         floor = { type = \"matte\", reflectance = [0.6, 0.6, 0.6] }\n\
         box = { type = \"matte\", reflectance = [0.75, 0.6, 0.45] }\n\
         lamp = { type = \"matte\", reflectance = [0, 0, 0] }\n",
    );
    let mut quad = |corner: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "[[entities]]\nshape = {{ type = \"quad\", corner = {corner:?}, u = {u:?}, v = {v:?} }}\nmaterial = \"{material}\""
        );
    };
    quad([-12.0, -12.0, 0.0], [24.0, 0.0, 0.0], [0.0, 24.0, 0.0], "floor");
    for _ in 0..40 {
        let mut any = |from: f64, to: f64| stream.random_range(from..to);
        let (x, y, side, height, turn) =
            (any(-8.0, 8.0), any(-8.0, 8.0), any(0.4, 1.2), any(0.3, 2.0), any(0.0, 1.5));
        let (a, b) = (
            [side * libm::cos(turn), side * libm::sin(turn)],
            [-side * libm::sin(turn), side * libm::cos(turn)],
        );
        let base = [[x, y], [x + a[0], y + a[1]], [x + a[0] + b[0], y + a[1] + b[1]], [x + b[0], y + b[1]]];
        for i in 0..4 {
            let ([x0, y0], [x1, y1]) = (base[i], base[(i + 1) % 4]);
            quad([x0, y0, 0.0], [x1 - x0, y1 - y0, 0.0], [0.0, 0.0, height], "box");
        }
        quad([x, y, height], [a[0], a[1], 0.0], [b[0], b[1], 0.0], "box");
    }
    let radius = 0.2 / f64::from(lamps).sqrt();
    for _ in 0..lamps {
        let mut any = |from: f64, to: f64| stream.random_range(from..to);
        let (x, y, z) = (any(-9.0, 9.0), any(-9.0, 9.0), any(0.2, 3.0));
        // A few lamps are much brighter than most.
        let power = 1000.0 * any(0.2, 1.0) / any(0.05, 1.0);
        let [r, g, b] = [any(0.3, 1.0), any(0.3, 1.0), any(0.3, 1.0)].map(|c| c * power);
        let _ = writeln!(
            text,
            "[[entities]]\nshape = {{ type = \"sphere\", center = [{x}, {y}, {z}], radius = {radius} }}\nmaterial = \"lamp\"\nemission = [{r}, {g}, {b}]"
        );
    }
    text
}

fn tracer(scene: &Scene, seed: u32, evenly: bool, max_depth: u32) -> Box<dyn Integrator> {
    let (mut compiled, surfaces) =
        world::compile(scene, scene.film.width, scene.film.height).expect("a scene that can be numbered");
    if evenly {
        compiled.lights.build_uniform_tree();
    }
    let settings = Settings { sampler: Sobol { seed }.into(), offset: film_offset(&scene.film), max_depth };
    let (scene, world) = (Arc::new(compiled), Arc::new(World::new(&surfaces, AcceleratorChoice::Bvh)));
    integrator::path(NextEvent::default(), scene, world, settings)
}

/// The picture, and its render time in seconds on all cores.
fn render(scene: &Scene, tracer: &dyn Integrator) -> (Vec<[f64; 3]>, f64) {
    let region = Region::whole(scene.film.width, scene.film.height);
    let level = Level::available()[0];
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get() as u32);
    let mut picture = vec![[0.0; 3]; region.len() as usize];
    let start = Instant::now();
    std::thread::scope(|scope| {
        let parts: Vec<_> = (0..threads)
            .map(|thread| {
                scope.spawn(move || {
                    let stride = Stride::ALL.split(thread, threads);
                    let places: Vec<u32> =
                        (0..stride.len(region.len())).map(|slot| stride.place(slot)).collect();
                    let mut all: Vec<Finished> = Vec::new();
                    for places in places.chunks(64) {
                        let pixels: Vec<_> = places.iter().map(|&place| region.pixel(place)).collect();
                        let paths = Paths { pixels: &pixels, first_sample: 0, samples: SAMPLES };
                        tracer.trace(level, &paths, &mut all);
                    }
                    all
                })
            })
            .collect();
        for part in parts {
            for finished in part.join().expect("a part of the picture") {
                let sample = finished.sample;
                for (sum, value) in picture[sample.pixel as usize].iter_mut().zip(sample.radiance) {
                    *sum += f64::from(value) / f64::from(SAMPLES);
                }
            }
        }
    });
    (picture, start.elapsed().as_secs_f64())
}

/// The light from surfaces, and the render time of the picture in seconds. Emission that camera rays hit directly is
/// subtracted, which the same camera rays determine.
fn render_lit(scene: &Scene, seed: u32, evenly: bool) -> (Vec<[f64; 3]>, f64) {
    let (mut picture, seconds) = render(scene, &*tracer(scene, seed, evenly, scene.render.max_depth));
    let (lamps, _) = render(scene, &*tracer(scene, seed, evenly, 0));
    for (all, seen) in picture.iter_mut().zip(lamps) {
        *all = [0, 1, 2].map(|c| all[c] - seen[c]);
    }
    (picture, seconds)
}

/// The relative variance of a sample, from two pictures, without the worst 0.5% of pixels.
fn variance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let mut errors: Vec<f64> = a
        .iter()
        .zip(b)
        .map(|(a, b)| {
            let channel = |c: usize| {
                let mean = (a[c] + b[c]) / 2.0;
                (a[c] - b[c]) * (a[c] - b[c]) / 2.0 / (mean * mean + 0.01)
            };
            (channel(0) + channel(1) + channel(2)) / 3.0
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.truncate(errors.len() * 995 / 1000);
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|word| word == "--write") {
        let path = arguments.get(at + 1).expect("--write FILE");
        std::fs::write(path, pose(10_000)).expect("a file that can be written");
        return;
    }
    println!("{:>7} lamps  {:<9} {:>8} {:>12} {:>11}", "", "chosen", "seconds", "variance", "efficiency");
    for lamps in [10, 10_000] {
        let scene = scene::parse(&pose(lamps), "lamps.toml".as_ref()).expect("a scene").scene;
        for (name, evenly) in [("by tree", false), ("any", true)] {
            let runs: Vec<_> = [11, 22].map(|seed| render_lit(&scene, seed, evenly)).into();
            let seconds = (runs[0].1 + runs[1].1) / 2.0;
            let variance = variance(&runs[0].0, &runs[1].0);
            let efficiency = 1.0 / (variance * seconds);
            println!("{lamps:>7} lamps  {name:<9} {seconds:>8.2} {variance:>12.5} {efficiency:>11.2}");
        }
    }
}
