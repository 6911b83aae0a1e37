//! Integrators: estimates of the radiance that arrives at the camera along its rays.
//!
//! | file | contents |
//! |---|---|
//! | `path_tracer` | `path` and `path-naive`: the loop over lanes, and one step of a path |
//! | `next_event` | the direct light of `path`, and the weights of multiple importance sampling |
//! | `naive` | the direct light of `path-naive`: that of delta lights |
//! | `holes` | the transmittance of shadow rays through holes |
//! | `roulette` | Russian roulette |
//! | `interiors` | the dielectrics that contain a path |
//! | `whitted` | the integrator `whitted` |
//! | `blocks` | the blocks of random numbers that each decision uses |
//! | `vertex` | the state of a path in each lane, its vertices, and its next ray |
//! | `queue` | camera rays that are computed ahead for free lanes |
//! | `paths` | the input and output of integrators: the pixels and samples to trace, and the samples found |
//! | `first_hit` | the first hits of camera rays, for layers |
//! | `observe` | the events of one path, for `stride trace` |
//! | `build` | construction of the integrator that a scene names |
//!
//! An [`Integrator`] traces [`Paths`]; [`build()`] makes one for a scene.

pub mod blocks;
mod build;
mod first_hit;
mod holes;
mod interiors;
mod naive;
mod next_event;
mod observe;
mod path_tracer;
mod paths;
mod queue;
mod roulette;
#[cfg(test)]
mod tests;
mod vertex;
mod whitted;

pub use build::{build, contributes, path, path_naive};
pub use first_hit::FirstHit;
pub use next_event::NextEvent;
pub use observe::{Event, Observer, Passage};
pub use paths::{Finished, Found, Paths, Settings};
pub use roulette::{ROULETTE_AT_MOST, ROULETTE_AT_MOST_FROM, ROULETTE_FROM, ROULETTE_KEEPS};
pub use whitted::Whitted;

#[cfg(feature = "gpu")]
pub(crate) use interiors::{Around, absorbed};
#[cfg(feature = "gpu")]
pub(crate) use path_tracer::{Stepped, Transport, step_with};
#[cfg(feature = "gpu")]
pub(crate) use paths::camera_ray;
#[cfg(feature = "gpu")]
pub(crate) use vertex::{State, TraceContext};
#[cfg(feature = "gpu")]
pub(crate) use whitted::{LampSample, Lit, Spawned};

use crate::camera::Camera;
use crate::math::lanes::Level;
use crate::sampling::{Pixel, Sample};

/// An integrator. It is chosen once per run; a call traces a block of paths, so that no ray costs an indirect call.
pub trait Integrator: Send + Sync {
    /// Traces paths, appends their samples in any order, and returns the number of rays traced. Contributions to other
    /// pixels are dropped.
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        let mut found = Found { finished: std::mem::take(out), contributions: Vec::new() };
        let rays = self.trace_until(level, paths, &|| false, &mut found).unwrap_or_default();
        *out = found.finished;
        rays
    }
    /// Traces paths, appends their samples and their contributions to any pixel in any order, and returns the number of
    /// rays traced. Calls `stop` before each bounce of a packet. If that returns true, tracing ends at once and the
    /// result is `None`; `out` may then hold some of the samples.
    ///
    /// The contributions of a sample depend only on its pixel, its index and the seed, and their expectation is the
    /// same for all pixels. Every part of a film, and every range of samples, therefore yields a share of the
    /// contributions to the entire film.
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64>;
    /// Finds the first hits of the paths' camera rays, in the order of the paths.
    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>);
    /// The same integrator over the same scene, with another camera.
    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator>;
    /// Traces one path. Returns its sample and the events along it.
    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>);
}
