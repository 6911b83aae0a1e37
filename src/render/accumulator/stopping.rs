//! The end of the workers.
//!
//! However a render ends, workers are asked to stop by a message, which they check at each bounce. The batches that
//! they send until they end are added. A worker that has not ended within its time limit is abandoned.

use super::Accumulator;
use super::dispatching::Dispatcher;
use crate::render::batch::SampleBatch;
use crate::render::outcome::Unanswered;
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// The interval of checks for workers with a longer time limit than others.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The wait for workers to stop.
struct Wait {
    asked: Instant,
    /// The time to the next check for workers that have not stopped.
    until: Duration,
}

impl Wait {
    /// Continues to wait. Returns whether there is a worker whose time limit has not passed.
    fn keeps_waiting(&mut self, dispatcher: &Dispatcher) -> bool {
        let longest = dispatcher.longest_time_limit().unwrap_or_default();
        let keeps_waiting = longest > self.until;
        self.until = longest.min(self.until + POLL_INTERVAL);
        keeps_waiting
    }
}

impl Accumulator {
    /// Asks the workers to stop, and receives their batches until they have ended. Returns those that have not ended
    /// within their time limits.
    pub(super) fn stop_workers(&mut self, batches: &Receiver<SampleBatch>) -> Vec<Unanswered> {
        self.dispatcher.close();
        let Some(shortest) = self.dispatcher.ask_to_stop() else {
            self.drain_batches(batches);
            return Vec::new();
        };
        let mut wait = Wait { asked: Instant::now(), until: shortest };
        loop {
            match batches.recv_deadline(wait.asked + wait.until) {
                Ok(batch) => self.take(batch),
                Err(RecvTimeoutError::Disconnected) => return Vec::new(),
                // A silent worker delays the end by its own time limit at most, and one that has ended not at all. The
                // state of the channel is no criterion: a worker that never ends keeps it open.
                Err(RecvTimeoutError::Timeout) if wait.keeps_waiting(&self.dispatcher) => {}
                Err(RecvTimeoutError::Timeout) => return self.dispatcher.unanswered(),
            }
        }
    }

    /// Receives the batches that are in the channel.
    pub(super) fn drain_batches(&mut self, batches: &Receiver<SampleBatch>) {
        let arrived = batches.len();
        for batch in batches.try_iter().take(arrived) {
            self.take(batch);
        }
    }
}
