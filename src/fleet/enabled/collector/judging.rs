//! Decides about results that are checked, and bars workers whose results are wrong.

use super::{Collector, MOST_BARRED};
use crate::fleet::FleetError;
use crate::fleet::enabled::checks::check_of;
use crate::fleet::enabled::mail::Mail;
use crate::fleet::enabled::unit::Posted;
use std::time::Duration;

impl<M: Mail> Collector<'_, M> {
    /// Decides between two results by rendering the unit here.
    pub(super) fn judge(&mut self, both: &[Posted; 2]) -> Result<(), FleetError> {
        let [a, b] = both;
        let range = a.unit.range();
        let what = format!(
            "workers {} and {} disagree on the samples {}..{}",
            a.worker, b.worker, range.start, range.end
        );
        let Some(digest) = (self.judge)(&a.unit)? else {
            return Err(FleetError::Job(format!(
                "{what}, and this machine cannot render them to decide: render the job without one of the two"
            )));
        };
        let (right, wrong): (Vec<&Posted>, Vec<&Posted>) =
            both.iter().partition(|posted| posted.digest == digest);
        for wrong in wrong {
            self.notes.push(format!("warning: {what}; the result of {} is wrong", wrong.worker));
            self.bar(wrong)?;
        }
        match right.first() {
            Some(right) => self.add((*right).clone(), false),
            None => self.issue_again(&range),
        }
    }

    /// Refuses further results of a worker.
    pub(super) fn bar(&mut self, posted: &Posted) -> Result<(), FleetError> {
        let worker = &posted.worker;
        if self.job.barred.contains(worker) {
            return self.mail.discard(posted);
        }
        self.change(|job| {
            if !job.barred.contains(worker) && job.barred.len() < MOST_BARRED {
                job.barred.push(worker.clone());
            }
        })?;
        self.mail.discard(posted)?;
        let unchecked = self.workers.get(worker).map_or(0, |seen| seen.unchecked);
        let earlier = match unchecked {
            0 => "none of its results is in the film".to_owned(),
            units => format!(
                "{units} of its units are in the film without a check: to be sure, render the job again without it"
            ),
        };
        self.notes.push(format!("warning: worker {worker} takes no further part in the job; {earlier}"));
        Ok(())
    }

    /// Decides about a unit whose check no other worker takes, when nothing else is left to do.
    pub(super) fn check_alone(&mut self, now: Duration) -> Result<(), FleetError> {
        let missing = self.job.plan.missing(self.gathering.held()).count();
        if self.checks.len() < missing {
            return Ok(());
        }
        let patience = self.job.patience() * 2;
        let Some(posted) = now.checked_sub(patience).and_then(|before| self.checks.take_older(before)) else {
            return Ok(());
        };
        let range = posted.unit.range();
        // It would count as a unit for which there is hope.
        self.mail.withdraw(&check_of(&posted))?;
        match (self.judge)(&posted.unit)? {
            Some(digest) if digest == posted.digest => self.add(posted, false),
            Some(_) => {
                let worker = &posted.worker;
                self.notes.push(format!(
                    "warning: worker {worker} and this machine disagree on the samples {}..{}; the result of {worker} is wrong",
                    range.start, range.end
                ));
                self.bar(&posted)?;
                self.issue_again(&range)
            }
            None => {
                self.notes.push(format!(
                    "warning: no second worker checks the samples {}..{}: they are added without a check",
                    range.start, range.end
                ));
                self.add(posted, true)
            }
        }
    }
}
