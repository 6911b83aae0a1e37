//! Those who render: CPU workers, a GPU worker, or both.

use super::error::SessionError;
use super::settings::{DeviceChoice, Settings, View};
use crate::camera::Camera;
use crate::film::{Splatter, Weights, film_offset};
use crate::gpu;
use crate::integrator::{self, Integrator};
use crate::render::accumulator::{MOST_UPDATES, WorkerFailure};
use crate::render::schedule::GRACE;
use crate::render::worker::Worker;
use crate::render::{Held, Order, Region, SampleBatch, Schedule, Stride};
use crate::scene::Scene;
use crate::world::{self, TooLarge, World};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, at, bounded, select};
use std::convert::Infallible;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long devices are measured before strides are dealt to them.
const MEASURED_FOR: Duration = Duration::from_millis(300);

/// And at most, where the first results are long in coming.
const MEASURED_AT_MOST: Duration = Duration::from_secs(2);

/// Samples of an order by which devices are measured: more than they make in that time.
const MEASURED_BY: u32 = 256;

/// The time that CPU workers have to answer the request to stop. They look for it all the time: this is for machines
/// with many more threads than cores.
pub(super) const ANSWERED_WITHIN: Duration = Duration::from_secs(1);

// A render on the CPU ends within two seconds of its deadline.
const _: () = assert!(ANSWERED_WITHIN.as_millis() + GRACE.as_millis() < 2000);

/// The time that a GPU worker has: a dispatch that has begun cannot be cut short, and a GPU that is software on a busy
/// machine takes seconds for one.
pub(super) const GPU_ANSWERS_WITHIN: Duration = Duration::from_secs(10);

/// What threads alone are called.
const CPU: &str = "cpu";

/// Those who render. The GPU worker, if there is one, has the last number.
pub(super) struct Crew {
    splatter: Option<Arc<Splatter>>,
    integrator: Option<Arc<dyn Integrator>>,
    threads: usize,
    gpu: Option<Gpu>,
    /// The GPU's speed in those of a CPU worker, where there are both.
    times: f64,
}

/// A worker on a GPU, and the name of the GPU.
pub(super) struct Gpu {
    worker: Box<gpu::GpuWorker>,
    name: String,
}

/// The work of a worker's thread.
type Work = Box<dyn FnOnce(&Mailbox) -> Result<(), gpu::GpuError> + Send>;

/// A crew whose threads run.
pub(super) struct RunningCrew {
    /// Work for each worker.
    pub orders: Vec<Option<Sender<Order>>>,
    /// The channels that tell CPU workers what pixels have when the GPU is lost, and how far each goes.
    pub updates: Vec<Sender<Arc<Held>>>,
    /// The channels that ask workers to stop.
    pub stops: Vec<Sender<()>>,
    /// Their threads.
    pub threads: Threads,
}

/// The threads of workers, which belong to nobody: one that does not end when it is asked to must not hold up anything.
pub(super) struct Threads(Vec<(String, JoinHandle<()>)>);

impl Threads {
    /// What the workers are called.
    pub(super) fn names(&self) -> Vec<String> {
        self.0.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Waits for all but those that have been abandoned.
    pub(super) fn join(self, is_abandoned: impl Fn(usize) -> bool) {
        for (worker, (_, thread)) in self.0.into_iter().enumerate() {
            if !is_abandoned(worker) {
                // It has caught its panic.
                let _ = thread.join();
            }
        }
    }
}

impl Crew {
    /// A crew with the devices that are asked for. The end of `stop` cuts the measuring of devices short.
    pub(super) fn new(settings: &Settings, stop: &Receiver<Infallible>) -> Result<Crew, SessionError> {
        let Scene { film, render, .. } = &*settings.scene;
        let (compiled, surfaces) = world::compile(&settings.scene, film.width, film.height)?;
        let (compiled, world) = (Arc::new(compiled), Arc::new(World::new(&surfaces, settings.finder)));
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
                region: settings.region,
                index,
                sends_samples: settings.samples.is_some(),
                splatter: puts.as_deref(),
            };
            let worker = Box::new(gpu::GpuWorker::new(&device, &job)?);
            Ok::<_, gpu::GpuError>(Gpu { worker, name: device.description().to_string() })
        };
        if let DeviceChoice::Gpu(name) = &settings.device {
            let gpu = Some(open(name, 0)?);
            return Ok(Crew { splatter, integrator: None, threads: 0, gpu, times: 1.0 });
        }
        // A worker without a pixel would have nothing to do.
        let threads = settings.threads.get().min(settings.region.len() as usize);
        let integrator: Arc<dyn Integrator> =
            integrator::build(render, offset, Arc::clone(&compiled), Arc::clone(&world)).into();
        let mut crew = Crew { splatter, integrator: Some(integrator), threads, gpu: None, times: 1.0 };
        if let DeviceChoice::All(name) = &settings.device {
            let measured = open(name, threads).and_then(|gpu| crew.measured_with(settings, gpu, stop));
            if let Err(error) = measured
                && settings.view != View::Quiet
            {
                // Standard error may be closed: this is a courtesy.
                let _ = writeln!(std::io::stderr(), "warning: {error}; the CPU renders alone");
            }
        }
        Ok(crew)
    }

    /// A crew for the scene of a crew before, whose integrator this was, with another camera: nothing is compiled
    /// anew where threads render. Beside a GPU they do it alone then: to measure it takes longer than to look.
    pub(super) fn again(
        settings: &Settings,
        integrator: Option<&Arc<dyn Integrator>>,
        stop: &Receiver<Infallible>,
    ) -> Result<Crew, SessionError> {
        let Some(integrator) = integrator else { return Crew::new(settings, stop) };
        let Scene { film, camera, .. } = &*settings.scene;
        let seen = integrator.seen_by(Camera::new(camera, film.width, film.height));
        let threads = settings.threads.get().min(settings.region.len() as usize);
        let splatter = splatter(settings);
        Ok(Crew { splatter, integrator: Some(seen.into()), threads, gpu: None, times: 1.0 })
    }

    /// A crew for a film that was begun on the devices of this description, by a crew whose integrator this was. Only
    /// their samples may go into it. Threads do without a GPU that is not there any more, or is another now; and where
    /// there was none when the film was begun, none that has come since takes part.
    pub(super) fn of_film(
        settings: &Settings,
        integrator: Option<&Arc<dyn Integrator>>,
        device: &str,
        stop: &Receiver<Infallible>,
    ) -> Result<Crew, SessionError> {
        if device == CPU && integrator.is_some() {
            return Crew::again(settings, integrator, stop);
        }
        let crew = Crew::new(settings, stop)?;
        let found = crew.description();
        if found == device {
            return Ok(crew);
        }
        if integrator.is_none() {
            return Err(SessionError::OtherDevice { begun: device.to_owned(), found });
        }
        // Of a GPU that is gone it has been told already.
        if crew.gpu.is_some() && settings.view != View::Quiet {
            let _ = writeln!(
                std::io::stderr(),
                "warning: the render was begun on {device}, and now there is {found}; the CPU renders alone"
            );
        }
        Crew::again(settings, integrator, stop)
    }

    /// What spreads samples over pixels, if the film wants that.
    pub(super) fn splatter(&self) -> Option<Arc<Splatter>> {
        self.splatter.clone()
    }

    /// What the threads trace with, if there are any.
    pub(super) fn integrator(&self) -> Option<Arc<dyn Integrator>> {
        self.integrator.clone()
    }

    /// Takes a GPU on, once both devices have shown how fast they are. They work side by side for it, as they will:
    /// a GPU that is the CPU in disguise gets no more than it has.
    fn measured_with(
        &mut self,
        settings: &Settings,
        gpu: Gpu,
        stop: &Receiver<Infallible>,
    ) -> Result<(), gpu::GpuError> {
        let adapter = gpu.name.clone();
        let (splatter, integrator, threads) = (self.splatter.clone(), self.integrator.clone(), self.threads);
        let measured = Crew { splatter, integrator, threads, gpu: Some(gpu), times: 1.0 };
        let (batches_out, batches) = bounded(2 * (threads + 1));
        let (failures_out, failures) = bounded(threads + 1);
        let (returned_out, returned) = bounded(1);
        let RunningCrew { orders, stops, .. } =
            measured.start(settings, None, &batches_out, &failures_out, Some(returned_out));
        drop((batches_out, failures_out));
        let orders: Vec<_> = orders.into_iter().flatten().collect();
        let speeds = watch(&orders, &batches, stop);
        for stop in stops {
            // One that has failed has nothing to hear.
            let _ = stop.try_send(());
        }
        // Closing both ends ends them all.
        drop((orders, batches));
        let asked = Instant::now();
        let returned = returned.recv_deadline(asked + GPU_ANSWERS_WITHIN);
        // The channel closes with the last thread. A CPU worker that does not end is left alone: if it meets the same
        // path in the render, it is abandoned there, with its order. So is a failure left to the render.
        while failures.recv_deadline(asked + ANSWERED_WITHIN).is_ok() {}
        let (gpu, end) = returned.map_err(|error| {
            let message = match error {
                RecvTimeoutError::Timeout => format!("it does not stop within {GPU_ANSWERS_WITHIN:?}"),
                RecvTimeoutError::Disconnected => "its worker panicked".to_owned(),
            };
            gpu::GpuError::Failed { adapter, message }
        })?;
        end?;
        let cpu = speeds[..threads].iter().sum::<f64>() / threads as f64;
        self.times = if cpu > 0.0 { speeds[threads] / cpu } else { 1.0 };
        self.gpu = Some(gpu);
        Ok(())
    }

    /// Who looks at first hits for the layers, if any are wanted that need it: the CPU, whoever renders.
    pub(super) fn layer_integrator(
        &self,
        settings: &Settings,
    ) -> Result<Option<Arc<dyn Integrator>>, TooLarge> {
        match &self.integrator {
            Some(integrator) if wants_first_hits(settings) => Ok(Some(Arc::clone(integrator))),
            _ => layer_integrator(settings),
        }
    }

    pub(super) fn workers(&self) -> usize {
        self.threads + usize::from(self.gpu.is_some())
    }

    /// The number of the worker on a GPU, if there is one.
    pub(super) fn gpu_worker(&self) -> Option<usize> {
        self.gpu.is_some().then_some(self.threads)
    }

    /// The worker that the others can do without.
    pub(super) fn spare(&self) -> Option<usize> {
        (self.gpu.is_some() && self.threads > 0).then_some(self.threads)
    }

    /// Deals strides in proportion to speed, of stripes where samples count in all pixels around them.
    pub(super) fn deal(&self, region: Region, schedule: Schedule) -> Schedule {
        let schedule = match self.spare() {
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

    /// What each device is called, and which workers are its.
    pub(super) fn devices(&self) -> Vec<(String, std::ops::Range<usize>)> {
        let cpu = (self.threads > 0).then(|| (CPU.to_owned(), 0..self.threads));
        let gpu = self.gpu.as_ref().map(|gpu| (gpu.name.clone(), self.threads..self.threads + 1));
        cpu.into_iter().chain(gpu).collect()
    }

    /// A CPU worker's life.
    fn work(
        &self,
        settings: &Settings,
        index: usize,
        held: Option<&Held>,
        updates: &Receiver<Arc<Held>>,
        mail: &Mailbox,
    ) {
        let Some(integrator) = self.integrator.as_deref() else { return };
        let (level, region, sends_samples) = (settings.level, settings.region, settings.samples.is_some());
        let splatter = self.splatter.as_deref();
        let worker = Worker { index, integrator, level, region, sends_samples, splatter, held };
        worker.run_until(&mail.orders, updates, &mail.stop, &mail.batches);
    }

    /// Starts a thread for each worker and returns the channels for their orders. A GPU comes back through `returned`
    /// when its worker ends, with what became of it, if that is given.
    pub(super) fn start(
        mut self,
        settings: &Settings,
        held: Option<Arc<Held>>,
        batches: &Sender<SampleBatch>,
        failures: &Sender<WorkerFailure>,
        returned: Option<Sender<(Gpu, Result<(), gpu::GpuError>)>>,
    ) -> RunningCrew {
        let (mut orders, mut stops, mut all_updates) = (Vec::new(), Vec::new(), Vec::new());
        let mut hired = Vec::new();
        let mut hire = |index: usize, name: String, work: Work| {
            let (orders_out, stops_out, mailbox) = post(batches);
            orders.push(Some(orders_out));
            stops.push(stops_out);
            let (failures, called) = (failures.clone(), name.clone());
            let thread = std::thread::spawn(move || {
                let problem = match catch_unwind(AssertUnwindSafe(|| work(&mailbox))) {
                    Ok(Ok(())) => return,
                    Ok(Err(error)) => error.to_string(),
                    Err(panic) => panic_message(&*panic),
                };
                // Nobody listens any more only if the run has ended already.
                let _ = failures.send(WorkerFailure { index, worker: name, message: problem });
            });
            hired.push((called, thread));
        };
        let (threads, gpu) = (self.threads, self.gpu.take());
        let (crew, settings) = (Arc::new(self), Arc::new(settings.clone()));
        for index in 0..threads {
            let (crew, settings, held) = (Arc::clone(&crew), Arc::clone(&settings), held.clone());
            let (updates_out, updates) = bounded(MOST_UPDATES);
            all_updates.push(updates_out);
            let work = move |mail: &Mailbox| {
                crew.work(&settings, index, held.as_deref(), &updates, mail);
                Ok(())
            };
            hire(index, format!("worker {index}"), Box::new(work));
        }
        if let Some(mut gpu) = gpu {
            gpu.worker.holds(held);
            let name = format!("the GPU worker ({})", gpu.name);
            let work = move |mail: &Mailbox| {
                let end = gpu.worker.run_until(&mail.orders, &mail.stop, &mail.batches);
                let Some(returned) = returned else { return end };
                // Whoever has waited too long does without it.
                let _ = returned.send((gpu, end));
                Ok(())
            };
            hire(threads, name, Box::new(work));
        }
        RunningCrew { orders, updates: all_updates, stops, threads: Threads(hired) }
    }
}

/// Whether any layers are wanted for which first hits are looked at.
fn wants_first_hits(settings: &Settings) -> bool {
    !settings.layers.iter().all(|layer| layer.is_of_film())
}

/// One that is built for it, if any layers are wanted that need it.
pub(super) fn layer_integrator(settings: &Settings) -> Result<Option<Arc<dyn Integrator>>, TooLarge> {
    if !wants_first_hits(settings) {
        return Ok(None);
    }
    let Scene { film, render, .. } = &*settings.scene;
    let (compiled, surfaces) = world::compile(&settings.scene, film.width, film.height)?;
    let world = Arc::new(World::new(&surfaces, settings.finder));
    Ok(Some(integrator::build(render, film_offset(film), Arc::new(compiled), world).into()))
}

/// What spreads samples over pixels, if the film wants that.
fn splatter(settings: &Settings) -> Option<Arc<Splatter>> {
    let weights = Weights::of(&settings.scene.film)?;
    let splatter = Splatter::new(weights, [settings.region.x, settings.region.y]);
    Some(Arc::new(splatter.with_spreads(settings.layout().spreads)))
}

/// Samples a second of each worker, over some time from its first results on, or until `stop` closes.
fn watch(orders: &[Sender<Order>], batches: &Receiver<SampleBatch>, stop: &Receiver<Infallible>) -> Vec<f64> {
    let workers = orders.len();
    let order = |index: usize, round: u32| Order {
        stride: Stride::ALL.split(index as u32, workers as u32),
        first: round * MEASURED_BY,
        end: (round + 1) * MEASURED_BY,
    };
    for (index, orders) in orders.iter().enumerate() {
        // A worker that does not take its order has failed, and says so elsewhere.
        let _ = orders.send(order(index, 0));
    }
    let start = Instant::now();
    // When each sent something first and last, and how many samples came after the first.
    let mut seen: Vec<Option<(Instant, Instant, u64)>> = vec![None; workers];
    let deadline = at(start + MEASURED_AT_MOST);
    loop {
        let batch = select! {
            recv(batches) -> batch => batch,
            recv(deadline) -> _ => break,
            recv(stop) -> _ => break,
        };
        let Ok(batch) = batch else { break };
        let now = Instant::now();
        match &mut seen[batch.worker] {
            Some((_, last, paths)) => (*last, *paths) = (now, *paths + batch.paths),
            unseen => *unseen = Some((now, now, 0)),
        }
        if let Some(end) = batch.completes {
            let _ = orders[batch.worker].try_send(order(batch.worker, end / MEASURED_BY));
        }
        let all = seen.iter().all(|seen| seen.is_some_and(|(.., paths)| paths > 0));
        if all && start.elapsed() > MEASURED_FOR {
            break;
        }
    }
    let rate = |seen: &Option<(Instant, Instant, u64)>| {
        seen.map_or(0.0, |(first, last, paths)| paths as f64 / (last - first).as_secs_f64().max(1e-6))
    };
    seen.iter().map(rate).collect()
}

/// Where to send a worker its orders and the request to stop, and its mailbox.
fn post(batches: &Sender<SampleBatch>) -> (Sender<Order>, Sender<()>, Mailbox) {
    let (orders_out, orders) = bounded(2);
    let (stops_out, stop) = bounded(1);
    (orders_out, stops_out, Mailbox { orders, stop, batches: batches.clone() })
}

/// A worker's ends of its channels.
struct Mailbox {
    orders: Receiver<Order>,
    /// A message here is the request to stop.
    stop: Receiver<()>,
    batches: Sender<SampleBatch>,
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "it panicked without a word".to_owned())
}

#[cfg(test)]
mod tests;
