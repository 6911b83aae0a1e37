//! Integrators: estimates of the radiance that arrives at the camera along its rays.
//!
//! | file | what is in it |
//! |---|---|
//! | `path_tracer` | `path` and `path-naive`: the loop over lanes, and one step of a path |
//! | `next_event` | the direct light of `path`, and the weights of multiple importance sampling |
//! | `naive` | the direct light of `path-naive`: that of delta lights |
//! | `holes` | the light that comes through holes of surfaces |
//! | `roulette` | Russian roulette |
//! | `interiors` | the dielectrics that a path is inside of |
//! | `whitted` | `whitted` |
//! | `blocks` | the random numbers of each decision of each integrator |
//! | `vertex` | the state of a path in each lane, the surfaces that it meets, and its next ray |
//! | `queue` | camera rays that wait for a free lane |
//! | `paths` | the input and output of integrators: the pixels and samples to trace, and the samples found |
//! | `first_hit` | the first hits of camera rays, for layers |
//! | `observe` | the events of one path, for `stride trace` |
//! | `build` | the integrator that a scene names |
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
pub use observe::{Event, Observer};
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
pub(crate) use vertex::{State, View};
#[cfg(feature = "gpu")]
pub(crate) use whitted::{Asked, Lit, Spawned};

use crate::camera::Camera;
use crate::math::lanes::Level;
use crate::sampling::{Pixel, Sample};

/// An integrator. It is chosen once per run; a call traces a block of paths, so that no ray costs an indirect call.
pub trait Integrator: Send + Sync {
    /// Traces paths, appends their samples in any order, and returns how many rays that took. What the samples contribute
    /// to other pixels is dropped.
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        let mut found = Found { finished: std::mem::take(out), contributions: Vec::new() };
        let rays = self.trace_until(level, paths, &|| false, &mut found).unwrap_or_default();
        *out = found.finished;
        rays
    }
    /// Traces paths, appends their samples and what these contribute to any pixel, in any order, and returns how many
    /// rays that took. Calls `stop` before each bounce of a packet. If that returns true, tracing ends at once and the
    /// result is `None`; `out` may then hold some of the samples.
    ///
    /// What a sample contributes is a function of its pixel, its index and the seed, and its expectation is the same for
    /// all pixels: whoever renders a part of the film, or more samples of some pixels, makes a part of the contributions
    /// to all of it.
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
