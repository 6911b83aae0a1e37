//! The integrators whose paths run in lanes.

use super::first_hit::{FirstHit, FirstHits};
use super::lanes::{TracePaths, Transport, View};
use super::observe::{Event, Record, Silent};
use super::{Finished, Integrator, Paths, Pixel, Sample, Settings};
use crate::camera::Camera;
use crate::math::lanes::{Kernel, Level, dispatch};
use crate::sampling::Sampler;
use crate::world::{CompiledScene, World};
use std::sync::Arc;

/// A path tracer: [`Naive`](super::Naive) or [`NextEvent`](super::NextEvent) transport through a world.
#[allow(private_bounds, reason = "the two transports are all there are")]
pub struct PathTracer<T, W, S> {
    /// How paths gather light.
    pub transport: T,
    /// The tables.
    pub scene: Arc<CompiledScene>,
    /// What rays meet.
    pub world: Arc<W>,
    /// Film, chance and depth.
    pub settings: Settings<S>,
}

impl<T, W, S> PathTracer<T, W, S> {
    fn view(&self) -> View<'_, W, S> {
        View { scene: &self.scene, world: &self.world, settings: &self.settings }
    }
}

impl<T: Transport + Send + Sync + 'static, W: World + 'static, S: Sampler + 'static> Integrator
    for PathTracer<T, W, S>
{
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        out.reserve(paths.len());
        let transport = self.transport;
        dispatch(level, TracePaths { view: self.view(), transport, paths, out, observer: &mut Silent })
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
        let (mut out, mut record) = (Vec::new(), Record::default());
        let (transport, observer) = (self.transport, &mut record);
        // Not by way of `dispatch`: a path that is looked at has one lane, at no other level.
        TracePaths { view: self.view(), transport, paths, out: &mut out, observer }.run::<f32>();
        (out[0].sample, record.0)
    }
}
