//! The integrators whose paths run in lanes.

use super::Integrator;
use super::first_hit::{FirstHit, FirstHits};
use super::lanes::{TracePaths, Transport, View};
use super::observe::{Event, Observer};
use super::paths::{Finished, Paths, Pixel, Sample, Settings};
use crate::camera::Camera;
use crate::math::lanes::{Level, dispatch};
use crate::world::{CompiledScene, World};
use std::sync::Arc;

/// A path tracer: [`Naive`](super::naive::Naive) or [`NextEvent`](super::NextEvent) transport through a world.
pub(super) struct PathTracer<T> {
    /// How paths gather light.
    pub transport: T,
    /// The tables.
    pub scene: Arc<CompiledScene>,
    /// What rays meet.
    pub world: Arc<World>,
    /// Film, sampler and depth.
    pub settings: Settings,
}

impl<T> PathTracer<T> {
    fn view(&self) -> View<'_> {
        View { scene: &self.scene, world: &self.world, settings: &self.settings }
    }
}

impl<T: Transport + Send + Sync + 'static> Integrator for PathTracer<T> {
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Vec<Finished>,
    ) -> Option<u64> {
        out.reserve(paths.len());
        let (view, transport, observer) = (self.view(), self.transport, Observer::none());
        dispatch(level, TracePaths { view, transport, paths, stop, out, observer })
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        dispatch(level, FirstHits { view: self.view(), paths, out });
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        let (scene, world) = (Arc::new(self.scene.seen_by(camera)), Arc::clone(&self.world));
        Box::new(PathTracer { transport: self.transport, scene, world, settings: self.settings })
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        let paths = &Paths { pixels: &[pixel], first_sample: sample, samples: 1 };
        let (mut out, mut events) = (Vec::new(), Vec::new());
        let (view, transport, observer) = (self.view(), self.transport, Observer::of(&mut events));
        let (stop, out_all) = (&|| false, &mut out);
        // Events are those of a single lane.
        dispatch(Level::SCALAR, TracePaths { view, transport, paths, stop, out: out_all, observer });
        (out[0].sample, events)
    }
}
