//! Integrators: what follows light from the camera into the scene.

mod build;
mod first_hit;
mod lanes;
mod naive;
mod next_event;
mod observe;
mod path_tracer;
mod paths;
mod queue;
mod roulette;
#[cfg(test)]
mod tests;
mod whitted;

pub use build::{build, path, path_naive};
pub use first_hit::FirstHit;
pub use next_event::NextEvent;
pub use observe::{Event, Observer};
pub use paths::{Finished, Paths, Pixel, Sample, Settings};
pub use roulette::{ROULETTE_AT_MOST, ROULETTE_AT_MOST_FROM, ROULETTE_FROM, ROULETTE_KEEPS};
pub use whitted::Whitted;

use crate::camera::Camera;
use crate::math::lanes::Level;

/// Follows light. Chosen once per run; a call traces a block of paths, so that no indirect call falls on a ray.
pub trait Integrator: Send + Sync {
    /// Traces paths, appends their samples in any order, and returns how many rays that took.
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        self.trace_until(level, paths, &|| false, out).unwrap_or_default()
    }
    /// The same, and asks before each bounce of a packet whether to stop. If so it gives up at once and returns `None`:
    /// some of the paths may be in `out` then.
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Vec<Finished>,
    ) -> Option<u64>;
    /// Follows the camera rays of paths to what they meet first, in the order of the paths.
    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>);
    /// The same, where another camera looks at the same scene.
    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator>;
    /// Traces one path and tells what happens on it.
    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>);
}
