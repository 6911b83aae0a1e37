//! The threads of workers, and their channels.

use crate::gpu;
use crate::render::accumulator::{Change, WorkerFailure};
use crate::render::schedule::GRACE;
use crate::render::{Assignment, Port, SampleBatch};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::JoinHandle;
use std::time::Duration;

/// The time that CPU workers have to answer the request to stop. They look for it all the time: this is for machines
/// with many more threads than cores.
pub(super) const ANSWERED_WITHIN: Duration = Duration::from_secs(1);

// A render on the CPU ends within two seconds of its deadline.
const _: () = assert!(ANSWERED_WITHIN.as_millis() + GRACE.as_millis() < 2000);

/// The time that a GPU worker has: a dispatch that has begun cannot be cut short, and a GPU that is software on a busy
/// machine takes seconds for one.
pub(super) const GPU_ANSWERS_WITHIN: Duration = Duration::from_secs(10);

/// How the accumulator deals with a worker.
#[derive(Clone, Copy, Debug)]
pub(super) struct PortSettings {
    /// How long it may take to answer the request to stop.
    pub(super) patience: Duration,
    /// Whether the others go on without it if it fails.
    pub(super) may_be_lost: bool,
}

impl PortSettings {
    /// Those of a thread of the CPU.
    pub(super) const CPU: PortSettings = PortSettings { patience: ANSWERED_WITHIN, may_be_lost: false };
    /// Those of a GPU that renders alone.
    pub(super) const GPU: PortSettings = PortSettings { patience: GPU_ANSWERS_WITHIN, may_be_lost: false };
}

/// A worker's ends of its channels.
pub(super) struct WorkerChannels {
    pub(super) orders: Receiver<Assignment>,
    /// A message here is the request to stop.
    pub(super) stop: Receiver<()>,
    pub(super) batches: Sender<SampleBatch>,
}

/// The two ends of a worker's channels.
fn channels(settings: PortSettings, batches: &Sender<SampleBatch>) -> (Port, WorkerChannels) {
    let (orders_out, orders) = bounded(2);
    let (stop_out, stop) = bounded(1);
    let port = Port {
        orders: orders_out,
        stop: Some(stop_out),
        patience: settings.patience,
        may_be_lost: settings.may_be_lost,
    };
    (port, WorkerChannels { orders, stop, batches: batches.clone() })
}

/// A crew whose threads run.
pub(crate) struct RunningCrew {
    /// The channels of each worker.
    pub(crate) ports: Vec<Port>,
    /// Their threads.
    pub(crate) threads: Threads,
}

/// A crew whose threads are being started, one after the other.
pub(super) struct ThreadStarter<'a> {
    batches: &'a Sender<SampleBatch>,
    changes: &'a Sender<Change>,
    ports: Vec<Port>,
    threads: Vec<(String, JoinHandle<()>)>,
}

impl<'a> ThreadStarter<'a> {
    /// A crew without threads yet, whose workers will send their batches and changes here.
    pub(super) fn new(batches: &'a Sender<SampleBatch>, changes: &'a Sender<Change>) -> ThreadStarter<'a> {
        ThreadStarter { batches, changes, ports: Vec::new(), threads: Vec::new() }
    }

    /// Starts the thread of a worker of this name. If its work fails or panics, that is its failure.
    pub(super) fn start(
        &mut self,
        name: String,
        settings: PortSettings,
        work: impl FnOnce(&WorkerChannels) -> Result<(), gpu::GpuError> + Send + 'static,
    ) {
        let index = self.ports.len();
        let (port, channels) = channels(settings, self.batches);
        self.ports.push(port);
        let (changes, worker) = (self.changes.clone(), name.clone());
        let thread = std::thread::spawn(move || {
            let message = match catch_unwind(AssertUnwindSafe(|| work(&channels))) {
                Ok(Ok(())) => return,
                Ok(Err(error)) => error.to_string(),
                Err(panic) => panic_message(&*panic),
            };
            // Nothing listens any more only if the run has ended already.
            let _ = changes.send(Change::Fails(WorkerFailure { index, worker, message }));
        });
        self.threads.push((name, thread));
    }

    pub(super) fn done(self) -> RunningCrew {
        RunningCrew { ports: self.ports, threads: Threads(self.threads) }
    }
}

/// The threads of workers. Those that do not end when they are asked to are abandoned, and never joined.
pub(crate) struct Threads(Vec<(String, JoinHandle<()>)>);

impl Threads {
    /// What the workers are called.
    pub(crate) fn names(&self) -> Vec<String> {
        self.0.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Waits for all but those that have been abandoned.
    pub(crate) fn join(self, is_abandoned: impl Fn(usize) -> bool) {
        for (worker, (_, thread)) in self.0.into_iter().enumerate() {
            if !is_abandoned(worker) {
                // It has caught its panic.
                let _ = thread.join();
            }
        }
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "it panicked without a word".to_owned())
}
