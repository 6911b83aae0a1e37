//! The render settings.

use super::choice::Choice;
use crate::parameter::Colour;
use std::fmt;
use std::str::FromStr;

/// The problem with unlimited paths with this integrator, if it has no Russian roulette.
pub fn endless(integrator: Integrator, max_depth: u32) -> Option<&'static str> {
    (max_depth == UNLIMITED && integrator != Integrator::Path).then_some(
        "max_depth can be \"unlimited\" only with integrator \"path\": no other uses Russian roulette",
    )
}

/// The value of [`RenderSettings::max_depth`] for which only Russian roulette ends paths.
pub const UNLIMITED: u32 = u32::MAX;

/// The maximum limit of bounces other than [`UNLIMITED`].
pub const MOST_BOUNCES: u32 = 10_000;

/// The render settings.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// The integrator.
    pub integrator: Integrator,
    /// The source of random numbers.
    pub sampler: Sampler,
    /// The maximum number of bounces: with 0 only emission is visible; [`UNLIMITED`] sets no limit.
    pub max_depth: u32,
    /// Samples per pixel, at least one.
    pub samples: u32,
    /// Whether sampling is adaptive; then `samples` is the maximum per pixel.
    pub adaptive: bool,
    /// The seed of all random numbers.
    pub seed: u32,
    /// The ambient radiance of `whitted`: at every diffuse hit, it is multiplied by the reflectance and added.
    pub ambient: Colour,
}

/// The settings of an empty scene file.
impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            integrator: Integrator::default(),
            sampler: Sampler::default(),
            max_depth: 5,
            samples: 500,
            adaptive: false,
            seed: 0,
            ambient: [0.0; 3],
        }
    }
}

/// The method by which light is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Recursive ray tracing (Whitted 1980; report ch. 2).
    Whitted,
    /// The most efficient path tracer here.
    #[default]
    Path,
    /// The report's path tracer (§4.3), which finds lights by chance.
    PathNaive,
}

impl Choice for Integrator {
    const WHAT: &'static str = "integrator";
    const NAMED: &'static [(&'static str, Self)] = &[
        ("whitted", Integrator::Whitted),
        ("path", Integrator::Path),
        ("path-naive", Integrator::PathNaive),
    ];
}

impl FromStr for Integrator {
    type Err = String;

    /// The integrator with this name in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Integrator::of_name(name)
    }
}

/// The name in a scene file.
impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The source of random numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Independent random numbers: the error falls as 1/√n.
    Independent,
    /// Scrambled Sobol points: the numbers of each decision are evenly distributed over the samples of a pixel.
    #[default]
    Sobol,
}

impl Choice for Sampler {
    const WHAT: &'static str = "sampler";
    const NAMED: &'static [(&'static str, Self)] =
        &[("sobol", Sampler::Sobol), ("independent", Sampler::Independent)];
}

impl FromStr for Sampler {
    type Err = String;

    /// The sampler with this name in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Sampler::of_name(name)
    }
}

/// The name in a scene file.
impl fmt::Display for Sampler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
