//! The threads of workers and their channels.

use crate::gpu;
use crate::render::accumulator::{Change, WorkerFailure};
use crate::render::schedule::GRACE;
use crate::render::{Assignment, Port, SampleBatch};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread::JoinHandle;
use std::time::Duration;

/// The time limit for CPU workers after the request to stop. They check for it all the time: the limit is for machines
/// with many more threads than cores.
pub(super) const STOP_TIME_LIMIT: Duration = Duration::from_secs(1);

// A CPU render ends within two seconds of its deadline.
const _: () = assert!(STOP_TIME_LIMIT.as_millis() + GRACE.as_millis() < 2000);

/// The time limit for a GPU worker: a dispatch cannot be interrupted, and takes seconds on a software GPU on a busy
/// machine.
pub(super) const GPU_STOP_TIME_LIMIT: Duration = Duration::from_secs(10);

/// The accumulator's settings for a worker.
#[derive(Clone, Copy, Debug)]
pub(super) struct PortSettings {
    /// The time limit after the request to stop.
    pub(super) time_limit: Duration,
    /// Whether the render continues without it if it fails.
    pub(super) may_be_lost: bool,
}

impl PortSettings {
    /// Settings for a CPU thread.
    pub(super) const CPU: PortSettings = PortSettings { time_limit: STOP_TIME_LIMIT, may_be_lost: false };
    /// Settings for a GPU that renders alone.
    pub(super) const GPU: PortSettings = PortSettings { time_limit: GPU_STOP_TIME_LIMIT, may_be_lost: false };
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
        time_limit: settings.time_limit,
        may_be_lost: settings.may_be_lost,
    };
    (port, WorkerChannels { orders, stop, batches: batches.clone() })
}

/// A pool whose threads run.
pub(crate) struct RunningPool {
    /// The accumulator's ends of the channels of each worker.
    pub(crate) ports: Vec<Port>,
    /// The threads of the workers.
    pub(crate) threads: Threads,
}

/// A pool whose threads are being started.
pub(super) struct ThreadStarter<'a> {
    batches: &'a Sender<SampleBatch>,
    changes: &'a Sender<Change>,
    ports: Vec<Port>,
    threads: Vec<(String, JoinHandle<()>)>,
}

impl<'a> ThreadStarter<'a> {
    /// An empty pool whose workers will send their batches and changes to these channels.
    pub(super) fn new(batches: &'a Sender<SampleBatch>, changes: &'a Sender<Change>) -> ThreadStarter<'a> {
        ThreadStarter { batches, changes, ports: Vec::new(), threads: Vec::new() }
    }

    /// Starts the thread of a worker with this name. An error or panic in `work` is sent as the worker's failure.
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
            // The receiver is gone only if the run has ended already.
            let _ = changes.send(Change::Fails(WorkerFailure { index, worker, message }));
        });
        self.threads.push((name, thread));
    }

    pub(super) fn done(self) -> RunningPool {
        RunningPool { ports: self.ports, threads: Threads(self.threads) }
    }
}

/// The threads of workers. Those that do not end on request are abandoned and never joined.
pub(crate) struct Threads(Vec<(String, JoinHandle<()>)>);

impl Threads {
    /// The names of the workers.
    pub(crate) fn names(&self) -> Vec<String> {
        self.0.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Waits for all threads except for abandoned ones.
    pub(crate) fn join(self, is_abandoned: impl Fn(usize) -> bool) {
        for (worker, (_, thread)) in self.0.into_iter().enumerate() {
            if !is_abandoned(worker) {
                // The thread catches its own panics.
                let _ = thread.join();
            }
        }
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "it panicked without a message".to_owned())
}
