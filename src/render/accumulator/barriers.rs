//! Barriers: pictures at given numbers of samples a pixel, and the gates at which all workers wait.

use super::{Accumulator, Barrier};
use crate::film::Milestone;
use crate::render::held::Held;
use crate::render::stride::Stride;
use std::sync::Arc;

impl Accumulator {
    /// Where all wait next: at a milestone, or for a picture that can't be gathered share by share.
    pub(super) fn next_gate(&self) -> Option<u32> {
        let pictures = self.splatter.is_some().then(|| self.gathering.iter().map(|g| g.barrier.end).min());
        self.next_milestone.into_iter().chain(pictures.flatten()).min()
    }

    /// Goes on when all wait at a gate. At a milestone it is decided where to end: at a power of two of samples, from
    /// sums that are exact and hence the same however they came about.
    pub(super) fn pass_gate(&mut self) {
        let Some(gate) = self.schedule.waits_at() else { return };
        let (Some(asked), true) = (self.asked, self.next_milestone == Some(gate)) else {
            self.schedule.decide(None, self.next_gate());
            return;
        };
        let (samples, picture, last) = (gate - self.first, self.film.picture(), self.milestone.as_ref());
        let milestone = match self.planned {
            None => Milestone::new(samples, picture, last),
            Some(_) => Milestone::adaptive(samples, picture, last, asked, self.schedule.target()),
        };
        self.next_milestone = gate.checked_mul(2);
        self.schedule.decide(milestone.end(asked), self.next_gate());
        if let (Some(workers), Some(plan)) = (&self.planned, &milestone.plan) {
            let held = Arc::new(Held::planned(&self.film, self.region, Arc::clone(plan)));
            for worker in workers {
                // There is room, and a worker that has ended has nothing to hear.
                let _ = worker.try_send(Arc::clone(&held));
            }
        }
        self.milestone = Some(milestone);
        // Pixels that were sent before have less than those that follow may have: the film begins anew.
        self.sending = None;
        self.estimate();
    }

    /// Copies the pixels of a stride that has just reached `end` samples into the picture of that barrier, if there is
    /// one, and sends the picture once all strides are in it.
    pub(super) fn gather_share(&mut self, stride: Stride, end: u32) {
        let Some(index) = self.gathering.iter().position(|g| g.barrier.end == end) else { return };
        let gathering = &mut self.gathering[index];
        gathering.barrier.picture.rgb.resize(self.region.len() as usize, [0.0; 3]);
        for slot in 0..stride.len(self.region.len()) {
            let place = stride.place(slot) as usize;
            gathering.barrier.picture.rgb[place] = self.film.mean(place);
        }
        gathering.missing -= 1;
        if gathering.missing == 0 {
            let done = self.gathering.swap_remove(index);
            self.send_barrier(done.barrier);
        }
    }

    /// Sends the picture of the barrier at which all pixels are now, if there is one.
    pub(super) fn gather_whole(&mut self) {
        let end = self.schedule.completed();
        if let Some(index) = self.gathering.iter().position(|g| g.barrier.end == end) {
            self.gathering.swap_remove(index);
            self.send_barrier(Barrier { end, picture: self.film.picture() });
        }
    }

    /// Sends a finished picture to its sink, waiting until it is taken. If the sink has gone, the render ends.
    fn send_barrier(&mut self, barrier: Barrier) {
        if let Some(sink) = &self.outbox.barriers
            && sink.send(barrier).is_err()
        {
            self.outbox.barriers = None;
            self.deserted = true;
        }
    }
}
