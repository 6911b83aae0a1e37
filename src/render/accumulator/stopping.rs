//! The end of the workers.
//!
//! However a render ends, workers are asked to stop by a message, which they look for at each bounce, and what they send
//! until they have ended counts. One that has not ended when its patience is over is abandoned.

use super::Accumulator;
use super::dealing::Dealer;
use crate::render::batch::SampleBatch;
use crate::render::outcome::Unanswered;
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// The time between looks at the workers that have more time to answer than others.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// The wait for answers to the request to stop.
struct Wait {
    asked: Instant,
    /// How long to wait before the next look at those who have not answered.
    until: Duration,
}

impl Wait {
    /// Waits on; whether there is a worker left that has more time.
    fn goes_on(&mut self, dealer: &Dealer) -> bool {
        let longest = dealer.longest_patience().unwrap_or_default();
        let goes_on = longest > self.until;
        self.until = longest.min(self.until + LOOK_AGAIN);
        goes_on
    }
}

impl Accumulator {
    /// Asks the workers to stop, and takes what they send until they have ended. Returns those that have not, after a
    /// while.
    pub(super) fn stop_workers(&mut self, batches: &Receiver<SampleBatch>) -> Vec<Unanswered> {
        self.dealer.close();
        let Some(shortest) = self.dealer.ask_to_stop() else {
            self.take_arrived(batches);
            return Vec::new();
        };
        let mut wait = Wait { asked: Instant::now(), until: shortest };
        loop {
            match batches.recv_deadline(wait.asked + wait.until) {
                Ok(batch) => self.take(batch),
                Err(RecvTimeoutError::Disconnected) => return Vec::new(),
                // A worker that is silent holds up the end no longer than its own time, and one that has ended not at
                // all: beside a worker that never ends, the channel does not tell.
                Err(RecvTimeoutError::Timeout) if wait.goes_on(&self.dealer) => {}
                Err(RecvTimeoutError::Timeout) => return self.dealer.unanswered(),
            }
        }
    }

    /// Takes the batches that lie in their channel by now.
    pub(super) fn take_arrived(&mut self, batches: &Receiver<SampleBatch>) {
        let arrived = batches.len();
        for batch in batches.try_iter().take(arrived) {
            self.take(batch);
        }
    }
}
