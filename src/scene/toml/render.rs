//! The keys of the render settings, and what is made of them.

use super::common::RADIANCE;
use super::report::{Read, Reports};
use super::table::{At, Fields, Key, Table};
use super::value::{Choice, Colour, Flag, Integer, IntegerOr};
use crate::scene::description::{Integrator, MOST_BOUNCES, RenderSettings, Sampler, UNLIMITED, endless};

pub(super) static RENDER_TABLE: Table = Table::new(
    "the render settings",
    &[&INTEGRATOR, &SAMPLER, &MAX_DEPTH, &SAMPLES, &ADAPTIVE, &SEED, &AMBIENT],
);

static INTEGRATOR: Key<Choice<Integrator>> = Key::default(
    "integrator",
    Choice::NEW,
    "\"path\"",
    "How light is followed: whitted (recursive ray tracing, which asks every lamp at every diffuse hit; a mesh of \
     256 triangles or more is one lamp), path, or path-naive (lights are found by chance).",
);

static SAMPLER: Key<Choice<Sampler>> = Key::default(
    "sampler",
    Choice::NEW,
    "\"sobol\"",
    "Where random numbers come from: sobol (spread evenly over a pixel's samples) or independent.",
);

static MAX_DEPTH: Key<IntegerOr> = Key::default(
    "max_depth",
    IntegerOr { integer: Integer { least: 0, most: MOST_BOUNCES }, word: "unlimited", means: UNLIMITED },
    "5",
    "The largest number of bounces: 0 sees emitters only; \"unlimited\" leaves it to Russian roulette (path).",
);

static SAMPLES: Key<Integer> =
    Key::default("samples", Integer { least: 1, most: u32::MAX }, "500", "Samples for each pixel.");
static ADAPTIVE: Key<Flag> = Key::default(
    "adaptive",
    Flag,
    "false",
    "Spends samples where the error is: pixels stop by themselves, with as many samples as there are at most.",
);
static SEED: Key<Integer> =
    Key::default("seed", Integer { least: 0, most: u32::MAX }, "0", "The seed of all randomness.");
static AMBIENT: Key<At<Colour>> = Key::default(
    "ambient",
    At(RADIANCE),
    "[0, 0, 0]",
    "Whitted only: radiance added at every diffuse hit, times its reflectance.",
);

pub(super) fn render(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RenderSettings> {
    let integrator = fields.get(&INTEGRATOR, reports);
    let sampler = fields.get(&SAMPLER, reports);
    let max_depth = fields.get(&MAX_DEPTH, reports);
    let samples = fields.get(&SAMPLES, reports);
    let adaptive = fields.get(&ADAPTIVE, reports);
    let seed = fields.get(&SEED, reports);
    let ambient = fields.get(&AMBIENT, reports);
    let (integrator, max_depth, ambient) = (integrator?, max_depth?, ambient?);
    if let Some(problem) = endless(integrator, max_depth) {
        return Err(reports.error(fields.place_of(&MAX_DEPTH), problem));
    }
    if integrator != Integrator::Whitted && ambient.value != [0.0; 3] {
        let message = "ambient has no effect: only integrator \"whitted\" has an ambient term";
        reports.warn(Some(ambient.at), message, "light the scene with an [environment] instead");
    }
    Ok(RenderSettings {
        integrator,
        sampler: sampler?,
        max_depth,
        samples: samples?,
        adaptive: adaptive?,
        seed: seed?,
        ambient: ambient.value,
    })
}
