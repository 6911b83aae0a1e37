//! Assigns orders to workers and keeps track of them.

use crate::film::{AdaptivePlan, Film};
use crate::render::assignment::Assignment;
use crate::render::channels::Port;
use crate::render::outcome::Unanswered;
use crate::render::schedule::{Dispatch, Order, Schedule};
use crate::render::stride::Stride;
use crossbeam_channel::{Sender, TrySendError};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// The workers, and the order of their work.
pub(super) struct Dispatcher {
    pub(super) schedule: Schedule,
    /// Pixels of the region.
    pixels: u32,
    /// The index of each pixel's first sample.
    first: u32,
    /// All workers by their numbers, including those that have gone.
    workers: BTreeMap<usize, Worker>,
    /// The last worker that has gone.
    last_gone: Option<usize>,
    /// Whether the film may have samples of an order before it is assigned.
    has_gaps: bool,
}

/// The accumulator's state of a worker.
struct Worker {
    /// Closed when there is no more work for it, or it has gone.
    orders: Option<Sender<Assignment>>,
    stop: Option<Sender<()>>,
    time_limit: Duration,
    may_be_lost: bool,
    is_gone: bool,
    /// The orders that it has not completed, the oldest first.
    outstanding: VecDeque<PendingOrder>,
    /// Samples that it has made.
    made: u64,
}

impl Worker {
    fn new(Port { orders, stop, time_limit, may_be_lost }: Port) -> Worker {
        Worker {
            orders: Some(orders),
            stop,
            time_limit,
            may_be_lost,
            is_gone: false,
            outstanding: VecDeque::new(),
            made: 0,
        }
    }
}

/// An order of a worker, and the number of its slots that have been received.
#[derive(Clone, Copy, Debug)]
struct PendingOrder {
    order: Order,
    slots: u32,
}

impl Dispatcher {
    /// Assigns work on a film whose pixels have samples from `first` on to these workers.
    pub(super) fn new(schedule: Schedule, film: &Film, first: u32, ports: Vec<Port>) -> Dispatcher {
        let [least, most] = film.seen_range();
        let workers = ports.into_iter().map(Worker::new).enumerate().collect();
        let pixels = film.layout().len() as u32;
        Dispatcher { schedule, pixels, first, workers, last_gone: None, has_gaps: least < most }
    }

    /// Assigns orders to workers until each has enough: two, so that it never waits for the next one, unless the second
    /// could miss a deadline. `pace` is the time for one sample of every pixel, if it is known. Each order is reduced
    /// by the samples already on the film, and by the adaptive plan, if there is one.
    pub(super) fn give_orders(&mut self, pace: Option<Duration>, film: &Film, plan: Option<&AdaptivePlan>) {
        let wanted = self.schedule.ahead(pace);
        let workers: Vec<usize> = self.workers.keys().copied().collect();
        for worker in workers {
            let has_enough =
                |dispatcher: &Dispatcher| dispatcher.workers[&worker].outstanding.len() >= wanted;
            while !has_enough(self) && self.give_order(worker, pace, film, plan) {}
        }
    }

    /// Assigns a worker its next order. Returns whether there was one.
    fn give_order(
        &mut self,
        index: usize,
        pace: Option<Duration>,
        film: &Film,
        plan: Option<&AdaptivePlan>,
    ) -> bool {
        let Some(worker) = self.workers.get_mut(&index) else { return false };
        let Some(orders) = &worker.orders else { return false };
        match self.schedule.next(index, pace) {
            Dispatch::Order(order) => {
                let assignment = match self.has_gaps || plan.is_some() {
                    true => Assignment::of(order, film, self.first, plan),
                    false => order.into(),
                };
                // A worker that does not receive its order has failed, and reports that elsewhere.
                let is_taken = orders.send(assignment).is_ok();
                worker.outstanding.extend(is_taken.then_some(PendingOrder { order, slots: 0 }));
                is_taken
            }
            Dispatch::Later => false,
            // A worker may still leave or be lost, and its unfinished work needs another.
            Dispatch::Done if !self.schedule.is_idle() => false,
            Dispatch::Done => {
                worker.orders = None;
                false
            }
        }
    }

    /// Adds a worker. One whose number is already used is rejected: its channels close.
    pub(super) fn join(&mut self, worker: usize, port: Port, speed: f64) {
        if let Entry::Vacant(place) = self.workers.entry(worker) {
            place.insert(Worker::new(port));
            self.schedule.join(worker, speed);
        }
    }

    /// Whether a worker is present: batches of others are ignored.
    pub(super) fn is_present(&self, worker: usize) -> bool {
        self.workers.get(&worker).is_some_and(|worker| !worker.is_gone)
    }

    /// Records a batch: its number of samples, and the slots of the worker's oldest order received so far.
    pub(super) fn receive(&mut self, worker: usize, samples: u64, slots: u32) {
        let Some(worker) = self.workers.get_mut(&worker) else { return };
        worker.made += samples;
        if let Some(given) = worker.outstanding.front_mut() {
            given.slots = given.slots.max(slots);
        }
    }

    /// Records that a worker has completed its oldest order.
    pub(super) fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.schedule.complete(stride, end);
        if let Some(worker) = self.workers.get_mut(&worker) {
            worker.outstanding.pop_front();
        }
    }

    /// Whether the render can continue without a worker.
    pub(super) fn can_lose(&self, worker: usize) -> bool {
        let others = self.workers.iter().filter(|(other, _)| **other != worker);
        self.workers.get(&worker).is_some_and(|worker| worker.may_be_lost)
            && others.into_iter().any(|(_, other)| !other.is_gone)
    }

    /// The worker that left last, if work remains and there is no worker for it.
    pub(super) fn last_departed(&self, pace: Option<Duration>) -> Option<usize> {
        let is_present = self.workers.values().any(|worker| !worker.is_gone);
        self.last_gone.filter(|_| !is_present && !self.schedule.is_done(pace))
    }

    /// Removes a worker and assigns its unfinished orders to others.
    pub(super) fn lose(&mut self, worker: usize) {
        let Some(gone) = self.workers.get_mut(&worker) else { return };
        (gone.orders, gone.is_gone) = (None, true);
        self.last_gone = Some(worker);
        // It may still run, but the end does not wait for it.
        if let Some(stop) = gone.stop.take() {
            let _ = stop.try_send(());
        }
        // The film may have a part of the first of them.
        self.has_gaps |= !gone.outstanding.is_empty();
        gone.outstanding.clear();
        self.schedule.lose(worker);
    }

    /// Closes all order channels: workers end when they have completed their orders.
    pub(super) fn close(&mut self) {
        self.workers.values_mut().for_each(|worker| worker.orders = None);
    }

    /// Asks all workers to stop. Returns their shortest time limit; `None` if none of them can be asked.
    pub(super) fn ask_to_stop(&self) -> Option<Duration> {
        let asked =
            self.workers.values().filter_map(|worker| Some((worker.stop.as_ref()?, worker.time_limit)));
        let time_limit = asked.map(|(stop, time_limit)| {
            // A worker that has ended receives nothing.
            let _ = stop.try_send(());
            time_limit
        });
        time_limit.min()
    }

    /// The longest time limit of the workers that were asked to stop and have not ended.
    pub(super) fn longest_time_limit(&self) -> Option<Duration> {
        self.silent().map(|(_, worker)| worker.time_limit).max()
    }

    /// The workers that were asked to stop and have not ended, and their orders.
    pub(super) fn unanswered(&self) -> Vec<Unanswered> {
        let rest = |given: &PendingOrder| (given.order, given.slots..given.order.stride.len(self.pixels));
        let unanswered = self.silent().map(|(index, worker)| Unanswered {
            worker: index,
            within: worker.time_limit,
            order: worker.outstanding.front().map(rest),
        });
        unanswered.collect()
    }

    /// Workers that have not ended after the request to stop.
    fn silent(&self) -> impl Iterator<Item = (usize, &Worker)> {
        let is_full = |stop: &Sender<()>| matches!(stop.try_send(()), Err(TrySendError::Full(())));
        let workers = self.workers.iter().map(|(&index, worker)| (index, worker));
        workers.filter(move |(_, worker)| worker.stop.as_ref().is_some_and(is_full))
    }

    /// The samples made by each worker, indexed by worker number.
    pub(super) fn made(&self) -> Vec<u64> {
        let end = self.workers.keys().next_back().map_or(0, |last| last + 1);
        (0..end).map(|worker| self.workers.get(&worker).map_or(0, |worker| worker.made)).collect()
    }
}
