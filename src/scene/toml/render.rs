//! The keys of the render settings, and their conversion.

use super::common::RADIANCE;
use super::report::{Diagnostics, Read};
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
    "The integrator: whitted (recursive ray tracing, which samples every light at every diffuse hit; a mesh of 256 triangles or more is one light), path, or path-naive (which finds lights by chance).",
);

static SAMPLER: Key<Choice<Sampler>> = Key::default(
    "sampler",
    Choice::NEW,
    "\"sobol\"",
    "The source of random numbers: sobol (evenly distributed over a pixel's samples) or independent.",
);

static MAX_DEPTH: Key<IntegerOr> = Key::default(
    "max_depth",
    IntegerOr { integer: Integer { least: 0, most: MOST_BOUNCES }, word: "unlimited", means: UNLIMITED },
    "5",
    "The maximum number of bounces: with 0, only emission is visible; with \"unlimited\", Russian roulette ends paths (path only).",
);

static SAMPLES: Key<Integer> =
    Key::default("samples", Integer { least: 1, most: u32::MAX }, "500", "Samples per pixel.");
static ADAPTIVE: Key<Flag> = Key::default(
    "adaptive",
    Flag,
    "false",
    "Adaptive sampling: pixels stop at a target error, with at most the given number of samples.",
);
static SEED: Key<Integer> =
    Key::default("seed", Integer { least: 0, most: u32::MAX }, "0", "The seed of all random numbers.");
static AMBIENT: Key<At<Colour>> = Key::default(
    "ambient",
    At(RADIANCE),
    "[0, 0, 0]",
    "The ambient radiance of whitted: at every diffuse hit, it is multiplied by the reflectance and added.",
);

pub(super) fn render(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RenderSettings> {
    let integrator = fields.get(&INTEGRATOR, diagnostics);
    let sampler = fields.get(&SAMPLER, diagnostics);
    let max_depth = fields.get(&MAX_DEPTH, diagnostics);
    let samples = fields.get(&SAMPLES, diagnostics);
    let adaptive = fields.get(&ADAPTIVE, diagnostics);
    let seed = fields.get(&SEED, diagnostics);
    let ambient = fields.get(&AMBIENT, diagnostics);
    let (integrator, max_depth, ambient) = (integrator?, max_depth?, ambient?);
    if let Some(problem) = endless(integrator, max_depth) {
        return Err(diagnostics.error(fields.place_of(&MAX_DEPTH), problem));
    }
    if integrator != Integrator::Whitted && ambient.value != [0.0; 3] {
        let message = "ambient has no effect: only integrator \"whitted\" has an ambient term";
        diagnostics.warn(Some(ambient.at), message, "light the scene with an [environment] instead");
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
