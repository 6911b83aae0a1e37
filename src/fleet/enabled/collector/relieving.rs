//! Makes room on a server that is full, when workers wait for it.
//!
//! Results are removed when a checkpoint has them, so that it is written early. If that is not enough, the room is taken by
//! what cannot be collected: parts of results that nobody completes, and results that wait for their checks. Workers whose
//! parts are removed render their units again, which is never wrong.

use super::Collector;
use crate::fleet::FleetError;
use crate::fleet::enabled::mail::Mail;
use std::time::Duration;

impl<M: Mail> Collector<'_, M> {
    /// Makes room if workers wait for it.
    pub(super) fn relieve(&mut self, now: Duration) -> Result<(), FleetError> {
        if !self.relief.is_wanted(now) {
            return Ok(());
        }
        if !self.unsaved.is_empty() {
            return self.save(now);
        }
        if !self.relief.is_count_due(self.job.patience(), now) {
            return Ok(());
        }
        let counts = self.mail.unannounced()?;
        match self.relief.count(counts, now) {
            None => Ok(()),
            // Their digests are known here: the film of the second result is added.
            Some(places) if places.is_empty() => {
                self.checks.waiting().try_for_each(|posted| self.mail.discard(posted))
            }
            Some(places) => places.iter().try_for_each(|place| self.mail.discard_parts(place)),
        }
    }
}
