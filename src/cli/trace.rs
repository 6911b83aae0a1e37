//! `stride trace`: one path, bounce by bounce.

use super::arguments::SceneArguments;
use super::failure::{Failure, usage};
use super::print::print;
use crate::film::{film_offset, reject};
use crate::integrator::{self, Event, Passage};
use crate::sampling::Pixel;
use crate::scene::Scene;
use crate::world::{self, AcceleratorChoice, World};
use std::fmt::Write;
use std::sync::Arc;

#[derive(Debug, clap::Args)]
pub(super) struct TraceArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Column and row of the pixel, from the film's top left; or its index alone
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y", value_parser = pixel)]
    pixel: PixelArgument,
    /// Index among the pixel's samples
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 0)]
    sample: u32,
}

#[derive(Clone, Copy, Debug)]
enum PixelArgument {
    Coordinates(u32, u32),
    Index(u32),
}

fn pixel(text: &str) -> Result<PixelArgument, String> {
    let error = || "a pixel is X,Y, like 320,240, or its index on the film".to_owned();
    let number = |text: &str| text.trim().parse().map_err(|_| error());
    match text.split_once(',') {
        Some((x, y)) => Ok(PixelArgument::Coordinates(number(x)?, number(y)?)),
        None => Ok(PixelArgument::Index(number(text)?)),
    }
}

pub(super) fn run(arguments: &TraceArguments) -> Result<(), Failure> {
    let scene = arguments.scene.load(true)?;
    let (width, height) = (scene.film.width, scene.film.height);
    let (x, y) = match arguments.pixel {
        PixelArgument::Coordinates(x, y) => (x, y),
        PixelArgument::Index(index) => (index % width, index / width),
    };
    if x >= width || y >= height {
        return Err(usage(format!("pixel {x},{y} is not on the film, which has {width}×{height} pixels")));
    }
    let (compiled, surfaces) = world::compile(&scene, width, height)?;
    let (world, offset) = (World::new(&surfaces, AcceleratorChoice::Fastest), film_offset(&scene.film));
    let compiled = Arc::new(compiled.with_camera_media(&world));
    let integrator = integrator::build(&scene.render, offset, compiled, Arc::new(world));
    let (sample, events) = integrator.explain(Pixel { index: y * width + x, x, y }, arguments.sample);
    let mut text = format!(
        "pixel {x},{y} (index {}) sample {}: film position {} {}\n",
        sample.pixel, sample.sample, sample.x, sample.y
    );
    for event in &events {
        describe(event, &scene, &mut text);
    }
    if let Err(reject) = reject::check(sample.radiance) {
        let _ = writeln!(text, "a film rejects this sample: {reject}");
    }
    Ok(print(&text)?)
}

fn describe(event: &Event, scene: &Scene, text: &mut String) {
    let v = |v: &[f32; 3]| format!("({} {} {})", v[0], v[1], v[2]);
    // Writing to a String cannot fail.
    let _ = match event {
        Event::Ray { depth, origin, direction } => {
            writeln!(text, "bounce {depth}: from {} along {}", v(origin), v(direction))
        }
        Event::Hit { distance, point, normal, entity, material, emitted } => {
            let name = &scene.entities[*entity as usize].name;
            let made_of = &scene.materials[*material as usize].name;
            let (point, normal, emitted) = (v(point), v(normal), v(emitted));
            writeln!(
                text,
                "  hits \"{name}\" of \"{made_of}\" at distance {distance}: {point}, normal {normal}, emitted {emitted}"
            )
        }
        Event::Pass { through } => {
            let reason = match through {
                Passage::Hole => "by its opacity",
                Passage::NoInterface => "the medium is the same on both sides",
            };
            writeln!(text, "  passes straight through: {reason}")
        }
        Event::Escape { radiance } => writeln!(text, "  leaves the scene, with radiance {}", v(radiance)),
        Event::Light { direction, added } => {
            writeln!(text, "  light from {} adds {}, times the throughput", v(direction), v(added))
        }
        Event::Scatter { weight, pdf, throughput } => {
            writeln!(text, "  scatters with weight {} (pdf {pdf}): throughput {}", v(weight), v(throughput))
        }
        Event::Survive { chance, throughput } => {
            writeln!(text, "  survives Russian roulette (probability {chance}): throughput {}", v(throughput))
        }
        Event::End { reason, radiance } => writeln!(text, "ends: {reason}; radiance {}", v(radiance)),
    };
}
