//! The pool of workers: CPU threads, a GPU worker, or both.

mod measuring;
mod threads;

use super::error::SessionError;
use super::event::{Event, send_event};
use super::settings::{DeviceChoice, RenderJob, RenderSettings};
use crate::camera::Camera;
use crate::film::{Splatter, Weights, film_offset};
use crate::gpu;
use crate::integrator::{self, Integrator};
use crate::render::worker::Worker;
use crate::render::{Change, FirstHitTracer};
use crate::render::{SampleBatch, Schedule};
use crate::sampling::Region;
use crate::scene::Scene;
use crate::world::{self, World};
use crossbeam_channel::{Receiver, Sender};
use std::convert::Infallible;
use std::sync::Arc;
use threads::{PortSettings, ThreadStarter, WorkerChannels};

pub(crate) use threads::{RunningPool, Threads};

/// The device name of CPU threads alone.
pub const CPU: &str = "cpu";

/// The workers of a render. The GPU worker, if there is one, has the last number.
pub(super) struct WorkerPool {
    splatter: Option<Arc<Splatter>>,
    integrator: Option<Arc<dyn Integrator>>,
    /// Traces first hits, if the layers need them: on the CPU, whatever device renders.
    first_hit_tracer: Option<Arc<dyn Integrator>>,
    threads: usize,
    gpu: Option<Gpu>,
    /// The speed of the GPU relative to a CPU worker, if there are both.
    times: f64,
}

/// A GPU worker and the name of its device.
pub(super) struct Gpu {
    worker: Box<gpu::GpuWorker>,
    name: String,
}

impl WorkerPool {
    /// A pool of the requested devices. Closing `stop` shortens the measuring of their speeds.
    pub(super) fn new(
        settings: &RenderSettings,
        events: &Sender<Event>,
        stop: &Receiver<Infallible>,
    ) -> Result<WorkerPool, SessionError> {
        let Scene { film, render, .. } = &*settings.job.scene;
        let (compiled, surfaces) = world::compile(&settings.job.scene, film.width, film.height)?;
        let world = World::new(&surfaces, settings.devices.accelerator);
        let (compiled, world) = (Arc::new(compiled.with_camera_media(&world)), Arc::new(world));
        drop(surfaces);
        let offset = film_offset(film);
        let splatter = splatter(settings);
        let puts = splatter.clone();
        let open = |name: &Option<String>, index| {
            let device = gpu::Device::open(name.as_deref())?;
            let job = gpu::Job {
                scene: &compiled,
                world: &world,
                render,
                offset,
                region: settings.job.region,
                index,
                sends_samples: settings.outputs.wants_samples(),
                splatter: puts.as_deref(),
            };
            let worker = Box::new(gpu::GpuWorker::new(&device, &job)?);
            Ok::<_, gpu::GpuError>(Gpu { worker, name: device.description().to_string() })
        };
        let integrator =
            || integrator::build(render, offset, Arc::clone(&compiled), Arc::clone(&world)).into();
        if let DeviceChoice::Gpu(name) = &settings.devices.choice {
            let gpu = Some(open(name, 0)?);
            let first_hit_tracer = (!settings.job.layers.is_empty()).then(integrator);
            return Ok(WorkerPool {
                splatter,
                integrator: None,
                first_hit_tracer,
                threads: 0,
                gpu,
                times: 1.0,
            });
        }
        // A worker without pixels would be idle.
        let threads = settings.devices.threads.get().min(settings.job.region.len() as usize);
        let mut pool = WorkerPool::of_threads(settings, integrator(), threads);
        if let DeviceChoice::All(name) = &settings.devices.choice {
            let measured = open(name, threads).and_then(|gpu| pool.measured_with(settings, gpu, stop));
            if let Err(error) = measured {
                send_event(events, Event::CpuAlone(error.to_string()));
            }
        }
        Ok(pool)
    }

    /// A pool for the same scene with another camera, given the integrator of the previous pool: CPU threads need no
    /// compilation. The GPU is left out, because measuring its speed takes longer than the view is likely to last.
    pub(super) fn for_other_camera(
        settings: &RenderSettings,
        integrator: Option<&Arc<dyn Integrator>>,
        events: &Sender<Event>,
        stop: &Receiver<Infallible>,
    ) -> Result<WorkerPool, SessionError> {
        let Some(integrator) = integrator else { return WorkerPool::new(settings, events, stop) };
        let Scene { film, camera, .. } = &*settings.job.scene;
        let seen = integrator.seen_by(Camera::new(camera, film.width, film.height));
        let threads = settings.devices.threads.get().min(settings.job.region.len() as usize);
        Ok(WorkerPool::of_threads(settings, seen.into(), threads))
    }

    /// A pool of CPU threads.
    fn of_threads(settings: &RenderSettings, integrator: Arc<dyn Integrator>, threads: usize) -> WorkerPool {
        let first_hit_tracer = (!settings.job.layers.is_empty()).then(|| Arc::clone(&integrator));
        let splatter = splatter(settings);
        WorkerPool {
            splatter,
            integrator: Some(integrator),
            first_hit_tracer,
            threads,
            gpu: None,
            times: 1.0,
        }
    }

    /// A pool for a film that was begun on the devices with this description, given the integrator of the previous
    /// pool. Only their samples may be added to it. A missing or different GPU is left out if there are threads, and a
    /// GPU that was absent when the film was begun takes no part.
    pub(super) fn resuming(
        settings: &RenderSettings,
        integrator: Option<&Arc<dyn Integrator>>,
        device: &str,
        events: &Sender<Event>,
        stop: &Receiver<Infallible>,
    ) -> Result<WorkerPool, SessionError> {
        if device == CPU && integrator.is_some() {
            return WorkerPool::for_other_camera(settings, integrator, events, stop);
        }
        let pool = WorkerPool::new(settings, events, stop)?;
        let found = pool.description();
        if found == device {
            return Ok(pool);
        }
        if integrator.is_none() {
            return Err(SessionError::OtherDevice { begun: device.to_owned(), found });
        }
        // A missing GPU has already been reported.
        if pool.gpu.is_some() {
            let reason = format!("the render was begun on {device}, but the device is now {found}");
            send_event(events, Event::CpuAlone(reason));
        }
        WorkerPool::for_other_camera(settings, integrator, events, stop)
    }

    /// Adds weighted samples to pixels, if the film has them.
    pub(super) fn splatter(&self) -> Option<Arc<Splatter>> {
        self.splatter.clone()
    }

    /// The integrator of the CPU threads, if there are any.
    pub(super) fn integrator(&self) -> Option<Arc<dyn Integrator>> {
        self.integrator.clone()
    }

    /// The integrator that traces first hits, if the layers need them.
    pub(super) fn first_hit_tracer(&self) -> Option<Arc<dyn Integrator>> {
        self.first_hit_tracer.clone()
    }

    pub(super) fn workers(&self) -> usize {
        self.threads + usize::from(self.gpu.is_some())
    }

    /// The number of the GPU worker, if there is one.
    pub(super) fn gpu_worker(&self) -> Option<usize> {
        self.gpu.is_some().then_some(self.threads)
    }

    /// The worker that the render can continue without, if there is one.
    pub(super) fn dispensable(&self) -> Option<usize> {
        (self.gpu.is_some() && self.threads > 0).then_some(self.threads)
    }

    /// Assigns strides in proportion to speed, as stripes of rows for weighted samples.
    pub(super) fn distribute(&self, region: Region, schedule: Schedule) -> Schedule {
        let schedule = match self.dispensable() {
            Some(_) => schedule.with_faster(region.len(), self.times),
            None => schedule,
        };
        match self.splatter {
            Some(_) => schedule.in_stripes(region.len(), region.width),
            None => schedule,
        }
    }

    pub(super) fn description(&self) -> String {
        match (&self.gpu, self.threads) {
            (None, _) => CPU.to_owned(),
            (Some(gpu), 0) => format!("gpu: {}", gpu.name),
            (Some(gpu), _) => format!("all: cpu and {}", gpu.name),
        }
    }

    /// The name of each device, and the numbers of its workers.
    pub(super) fn devices(&self) -> Vec<(String, std::ops::Range<usize>)> {
        let cpu = (self.threads > 0).then(|| (CPU.to_owned(), 0..self.threads));
        let gpu = self.gpu.as_ref().map(|gpu| (gpu.name.clone(), self.threads..self.threads + 1));
        cpu.into_iter().chain(gpu).collect()
    }

    /// Executes orders on a CPU thread until their channel closes.
    fn work(&self, settings: &RenderSettings, index: usize, channels: &WorkerChannels) {
        let Some(integrator) = self.integrator.as_deref() else { return };
        let (level, region, sends_samples) =
            (settings.devices.level, settings.job.region, settings.outputs.wants_samples());
        let (splatter, layers) = (self.splatter.as_deref(), settings.job.layers);
        let worker = Worker { index, integrator, level, region, sends_samples, splatter, layers };
        worker.run_until(&channels.orders, &channels.stop, &channels.batches);
    }

    /// Starts a thread for each worker and returns the channels. If `returned` is given, the GPU and its result are
    /// sent there when its worker ends.
    pub(super) fn start(
        mut self,
        settings: &RenderSettings,
        batches: &Sender<SampleBatch>,
        changes: &Sender<Change>,
        returned: Option<Sender<(Gpu, Result<(), gpu::GpuError>)>>,
    ) -> RunningPool {
        let mut starter = ThreadStarter::new(batches, changes);
        let (threads, gpu) = (self.threads, self.gpu.take());
        let (pool, settings) = (Arc::new(self), Arc::new(settings.clone()));
        for index in 0..threads {
            let (pool, settings) = (Arc::clone(&pool), Arc::clone(&settings));
            starter.start(format!("worker {index}"), PortSettings::CPU, move |channels| {
                pool.work(&settings, index, channels);
                Ok(())
            });
        }
        if let Some(mut gpu) = gpu {
            let first_hit_tracer = pool.first_hit_tracer().map(|integrator| FirstHitTracer {
                integrator,
                level: settings.devices.level,
                layers: settings.job.layers,
                region: settings.job.region,
                // Beside CPU threads it has one core's worth of time.
                threads: if threads > 0 { 1 } else { settings.devices.threads.get() },
            });
            gpu.worker.trace_first_hits_with(first_hit_tracer);
            let port = PortSettings { may_be_lost: threads > 0, ..PortSettings::GPU };
            starter.start(format!("the GPU worker ({})", gpu.name), port, move |channels| {
                let end = gpu.worker.run_until(&channels.orders, &channels.stop, &channels.batches);
                let Some(returned) = returned else { return end };
                // The receiver is gone if the GPU took too long.
                let _ = returned.send((gpu, end));
                Ok(())
            });
        }
        starter.done()
    }
}

/// Adds contributions to the film's light image, if it has one.
pub(super) fn light(settings: &RenderSettings) -> Option<Arc<Splatter>> {
    let RenderJob { scene, region, .. } = &settings.job;
    let weights = || Weights::of_contributions(&scene.film);
    let light = settings.job.layout().light;
    light.map(|_| Arc::new(Splatter::new(weights(), [region.x, region.y])))
}

/// Adds weighted samples to pixels, if the film has them.
fn splatter(settings: &RenderSettings) -> Option<Arc<Splatter>> {
    let weights = Weights::of(&settings.job.scene.film)?;
    let splatter = Splatter::new(weights, [settings.job.region.x, settings.job.region.y]);
    Some(Arc::new(splatter.with_spreads(settings.job.layout().spreads)))
}

#[cfg(test)]
mod tests;
