//! How light is followed.

use super::choice::Choice;
use crate::parameter::Colour;
use std::fmt;
use std::str::FromStr;

/// What is wrong with following paths to any depth with this integrator, if it has no roulette to end them.
pub fn endless(integrator: Integrator, max_depth: u32) -> Option<&'static str> {
    (max_depth == UNLIMITED && integrator != Integrator::Path).then_some(
        "max_depth can be \"unlimited\" only with integrator \"path\": no other plays Russian roulette",
    )
}

/// As [`RenderSettings::max_depth`]: only Russian roulette ends paths.
pub const UNLIMITED: u32 = u32::MAX;

/// The largest limit of bounces beside [`UNLIMITED`].
pub const MOST_BOUNCES: u32 = 10_000;

/// How light is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// The integrator.
    pub integrator: Integrator,
    /// Where its random numbers come from.
    pub sampler: Sampler,
    /// The largest number of bounces: 0 sees emitters only, [`UNLIMITED`] sees all.
    pub max_depth: u32,
    /// Samples a pixel, at least one.
    pub samples: u32,
    /// Whether samples are spent where the error is: then `samples` is the most that a pixel gets.
    pub adaptive: bool,
    /// The seed of all randomness.
    pub seed: u32,
    /// The ambient term of `whitted`: radiance added at every diffuse hit, times its reflectance.
    pub ambient: Colour,
}

/// What an empty scene file gives.
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

/// How light is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Recursive ray tracing (Whitted 1980; report ch. 2).
    Whitted,
    /// The best unidirectional path tracer there is here.
    #[default]
    Path,
    /// The report's path tracer (§4.3): lights are found by chance.
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

    /// The integrator of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Integrator::of_name(name)
    }
}

/// The name, as in a scene file.
impl fmt::Display for Integrator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Where random numbers come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Every number by itself: the error falls as 1/√n.
    Independent,
    /// Scrambled Sobol points: each decision's numbers are spread evenly over the samples of a pixel.
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

    /// The sampler of this name, as in a scene file.
    fn from_str(name: &str) -> Result<Self, String> {
        Sampler::of_name(name)
    }
}

/// The name, as in a scene file.
impl fmt::Display for Sampler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
