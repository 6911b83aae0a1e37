//! Deals out orders, and knows which of them each worker has.

use super::configuration::Port;
use crate::render::held::Held;
use crate::render::outcome::Unanswered;
use crate::render::schedule::{Deal, Order, Schedule};
use crate::render::stride::Stride;
use crossbeam_channel::{Sender, TrySendError};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The workers, and the order of their work.
pub(super) struct Dealer {
    pub(super) schedule: Schedule,
    /// Pixels of the region.
    pixels: u32,
    workers: Vec<Worker>,
}

/// A worker, as the accumulator knows it.
struct Worker {
    /// Closed when there is nothing left for it.
    orders: Option<Sender<Order>>,
    updates: Option<Sender<Arc<Held>>>,
    stop: Option<Sender<()>>,
    patience: Duration,
    /// Whether it is there, and the others can do without it.
    may_be_lost: bool,
    /// Orders that it has and has not completed, the oldest first.
    outstanding: VecDeque<Given>,
    /// Samples that it has made.
    made: u64,
}

/// An order that a worker has, and how many of its slots have come.
#[derive(Clone, Copy, Debug)]
struct Given {
    order: Order,
    slots: u32,
}

impl Dealer {
    pub(super) fn new(schedule: Schedule, pixels: u32, ports: Vec<Port>) -> Dealer {
        let worker = |Port { orders, updates, stop, patience, may_be_lost }| Worker {
            orders: Some(orders),
            updates,
            stop,
            patience,
            may_be_lost,
            outstanding: VecDeque::new(),
            made: 0,
        };
        Dealer { schedule, pixels, workers: ports.into_iter().map(worker).collect() }
    }

    /// Gives workers orders until each has as many as it should: two, so that it never waits for the next one, unless a
    /// deadline could be missed by it. `pace` is the time that one sample of every pixel takes, as far as that is
    /// known.
    pub(super) fn give_orders(&mut self, pace: Option<Duration>) {
        let wanted = self.schedule.ahead(pace);
        for worker in 0..self.workers.len() {
            while self.workers[worker].outstanding.len() < wanted && self.give_order(worker, pace) {}
        }
    }

    /// Gives a worker its next order; whether there was one.
    fn give_order(&mut self, index: usize, pace: Option<Duration>) -> bool {
        let Some(orders) = &self.workers[index].orders else { return false };
        match self.schedule.next(index, pace) {
            // A worker that doesn't take its order has failed, and says so elsewhere.
            Deal::Order(order) => {
                let is_taken = orders.send(order).is_ok();
                self.workers[index].outstanding.extend(is_taken.then_some(Given { order, slots: 0 }));
                is_taken
            }
            Deal::Later => false,
            // A worker may be lost yet, and what it has not completed wants another.
            Deal::Done if self.workers.iter().any(|it| it.may_be_lost) && !self.schedule.is_idle() => false,
            Deal::Done => {
                self.workers[index].orders = None;
                false
            }
        }
    }

    /// Takes note of a batch: so many samples, and the slots of the worker's oldest order that have come by now.
    pub(super) fn receive(&mut self, worker: usize, samples: u64, slots: u32) {
        let worker = &mut self.workers[worker];
        worker.made += samples;
        if let Some(given) = worker.outstanding.front_mut() {
            given.slots = given.slots.max(slots);
        }
    }

    /// Takes note that a worker has carried out its oldest order.
    pub(super) fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.schedule.complete(stride, end);
        self.workers[worker].outstanding.pop_front();
    }

    /// Whether the others can go on without a worker.
    pub(super) fn can_lose(&self, worker: usize) -> bool {
        self.workers[worker].may_be_lost
    }

    /// Takes everything from a worker that is lost: what it has not completed is dealt to the others, who hear first
    /// what pixels have, where not all have the same.
    pub(super) fn lose(&mut self, worker: usize, held: Option<Held>) {
        let lost = &mut self.workers[worker];
        (lost.orders, lost.updates, lost.may_be_lost) = (None, None, false);
        lost.outstanding.clear();
        self.schedule.lose(worker);
        if let Some(held) = held {
            self.tell(&Arc::new(held));
        }
    }

    /// Tells all workers that can hear it what pixels have, and how far each goes.
    pub(super) fn tell(&self, held: &Arc<Held>) {
        for updates in self.workers.iter().filter_map(|worker| worker.updates.as_ref()) {
            // There is room, and a worker that has ended has nothing to hear.
            let _ = updates.try_send(Arc::clone(held));
        }
    }

    /// Closes all orders: workers end when they have completed what they have.
    pub(super) fn close(&mut self) {
        self.workers.iter_mut().for_each(|worker| worker.orders = None);
    }

    /// Asks all workers to stop. Returns the shortest patience with them, and none if they cannot be asked.
    pub(super) fn ask_to_stop(&self) -> Option<Duration> {
        let asked = self.workers.iter().filter_map(|worker| Some((worker.stop.as_ref()?, worker.patience)));
        let patience = asked.map(|(stop, patience)| {
            // A worker that has ended has nothing to hear.
            let _ = stop.try_send(());
            patience
        });
        patience.min()
    }

    /// The longest patience with those that were asked to stop and have not ended.
    pub(super) fn longest_patience(&self) -> Option<Duration> {
        self.silent().map(|(_, worker)| worker.patience).max()
    }

    /// The workers that were asked to stop and have not ended, and what they hold.
    pub(super) fn unanswered(&self) -> Vec<Unanswered> {
        let rest = |given: &Given| (given.order, given.slots..given.order.stride.len(self.pixels));
        let unanswered = self.silent().map(|(index, worker)| Unanswered {
            worker: index,
            within: worker.patience,
            order: worker.outstanding.front().map(rest),
        });
        unanswered.collect()
    }

    /// Those whose request to stop lies where they have left it.
    fn silent(&self) -> impl Iterator<Item = (usize, &Worker)> {
        let is_full = |stop: &Sender<()>| matches!(stop.try_send(()), Err(TrySendError::Full(())));
        let workers = self.workers.iter().enumerate();
        workers.filter(move |(_, worker)| worker.stop.as_ref().is_some_and(is_full))
    }

    /// The samples that each worker has made.
    pub(super) fn made(&self) -> Vec<u64> {
        self.workers.iter().map(|worker| worker.made).collect()
    }
}
