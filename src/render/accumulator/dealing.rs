//! Deals out orders, and knows which of them each worker has.

use crate::film::{Film, Plan};
use crate::render::assignment::Assignment;
use crate::render::channels::Port;
use crate::render::outcome::Unanswered;
use crate::render::schedule::{Deal, Order, Schedule};
use crate::render::stride::Stride;
use crossbeam_channel::{Sender, TrySendError};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// The workers, and the order of their work.
pub(super) struct Dealer {
    pub(super) schedule: Schedule,
    /// Pixels of the region.
    pixels: u32,
    /// The index of each pixel's first sample.
    first: u32,
    /// All workers by their numbers, also those that are gone.
    workers: BTreeMap<usize, Worker>,
    /// The last of those that are gone.
    last_gone: Option<usize>,
    /// Whether the film may have samples of an order before it is given.
    has_gaps: bool,
}

/// A worker, as the accumulator knows it.
struct Worker {
    /// Closed when there is nothing left for it, or it is gone.
    orders: Option<Sender<Assignment>>,
    stop: Option<Sender<()>>,
    patience: Duration,
    may_be_lost: bool,
    is_gone: bool,
    /// Orders that it has and has not completed, the oldest first.
    outstanding: VecDeque<Given>,
    /// Samples that it has made.
    made: u64,
}

impl Worker {
    fn new(Port { orders, stop, patience, may_be_lost }: Port) -> Worker {
        Worker {
            orders: Some(orders),
            stop,
            patience,
            may_be_lost,
            is_gone: false,
            outstanding: VecDeque::new(),
            made: 0,
        }
    }
}

/// An order that a worker has, and how many of its slots have come.
#[derive(Clone, Copy, Debug)]
struct Given {
    order: Order,
    slots: u32,
}

impl Dealer {
    /// Deals to these workers the order of work over a film, whose pixels have samples from `first` on.
    pub(super) fn new(schedule: Schedule, film: &Film, first: u32, ports: Vec<Port>) -> Dealer {
        let [least, most] = film.seen_range();
        let workers = ports.into_iter().map(Worker::new).enumerate().collect();
        let pixels = film.layout().len() as u32;
        Dealer { schedule, pixels, first, workers, last_gone: None, has_gaps: least < most }
    }

    /// Gives workers orders until each has as many as it should: two, so that it never waits for the next one, unless a
    /// deadline could be missed by it. `pace` is the time that one sample of every pixel takes, as far as that is
    /// known. What is left of an order depends on the film, and on a plan of how far each pixel goes, if there is one.
    pub(super) fn give_orders(&mut self, pace: Option<Duration>, film: &Film, plan: Option<&Plan>) {
        let wanted = self.schedule.ahead(pace);
        let workers: Vec<usize> = self.workers.keys().copied().collect();
        for worker in workers {
            let has_enough = |dealer: &Dealer| dealer.workers[&worker].outstanding.len() >= wanted;
            while !has_enough(self) && self.give_order(worker, pace, film, plan) {}
        }
    }

    /// Gives a worker its next order; whether there was one.
    fn give_order(&mut self, index: usize, pace: Option<Duration>, film: &Film, plan: Option<&Plan>) -> bool {
        let Some(worker) = self.workers.get_mut(&index) else { return false };
        let Some(orders) = &worker.orders else { return false };
        match self.schedule.next(index, pace) {
            Deal::Order(order) => {
                let assignment = match self.has_gaps || plan.is_some() {
                    true => Assignment::of(order, film, self.first, plan),
                    false => order.into(),
                };
                // A worker that doesn't take its order has failed, and says so elsewhere.
                let is_taken = orders.send(assignment).is_ok();
                worker.outstanding.extend(is_taken.then_some(Given { order, slots: 0 }));
                is_taken
            }
            Deal::Later => false,
            // A worker may leave or be lost yet, and what it has not completed wants another.
            Deal::Done if !self.schedule.is_idle() => false,
            Deal::Done => {
                worker.orders = None;
                false
            }
        }
    }

    /// Takes a worker on. One whose number is known already is refused: its channels close.
    pub(super) fn join(&mut self, worker: usize, port: Port, speed: f64) {
        if let Entry::Vacant(place) = self.workers.entry(worker) {
            place.insert(Worker::new(port));
            self.schedule.join(worker, speed);
        }
    }

    /// Whether a worker is there: what others send is not taken.
    pub(super) fn is_there(&self, worker: usize) -> bool {
        self.workers.get(&worker).is_some_and(|worker| !worker.is_gone)
    }

    /// Takes note of a batch: so many samples, and the slots of the worker's oldest order that have come by now.
    pub(super) fn receive(&mut self, worker: usize, samples: u64, slots: u32) {
        let Some(worker) = self.workers.get_mut(&worker) else { return };
        worker.made += samples;
        if let Some(given) = worker.outstanding.front_mut() {
            given.slots = given.slots.max(slots);
        }
    }

    /// Takes note that a worker has carried out its oldest order.
    pub(super) fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.schedule.complete(stride, end);
        if let Some(worker) = self.workers.get_mut(&worker) {
            worker.outstanding.pop_front();
        }
    }

    /// Whether others can go on without a worker.
    pub(super) fn can_lose(&self, worker: usize) -> bool {
        let others = self.workers.iter().filter(|(other, _)| **other != worker);
        self.workers.get(&worker).is_some_and(|worker| worker.may_be_lost)
            && others.into_iter().any(|(_, other)| !other.is_gone)
    }

    /// The worker that left last, if work is left and no worker for it.
    pub(super) fn deserter(&self, pace: Option<Duration>) -> Option<usize> {
        let is_there = self.workers.values().any(|worker| !worker.is_gone);
        self.last_gone.filter(|_| !is_there && !self.schedule.is_done(pace))
    }

    /// Takes everything from a worker that is gone: what it has not completed is dealt to others.
    pub(super) fn lose(&mut self, worker: usize) {
        let Some(gone) = self.workers.get_mut(&worker) else { return };
        (gone.orders, gone.is_gone) = (None, true);
        self.last_gone = Some(worker);
        // It may be there all the same, and is not waited for in the end.
        if let Some(stop) = gone.stop.take() {
            let _ = stop.try_send(());
        }
        // Of the first of them the film may have a part.
        self.has_gaps |= !gone.outstanding.is_empty();
        gone.outstanding.clear();
        self.schedule.lose(worker);
    }

    /// Closes all orders: workers end when they have completed what they have.
    pub(super) fn close(&mut self) {
        self.workers.values_mut().for_each(|worker| worker.orders = None);
    }

    /// Asks all workers to stop. Returns the shortest patience with them, and none if they cannot be asked.
    pub(super) fn ask_to_stop(&self) -> Option<Duration> {
        let asked = self.workers.values().filter_map(|worker| Some((worker.stop.as_ref()?, worker.patience)));
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

    /// Workers that have not read their request to stop.
    fn silent(&self) -> impl Iterator<Item = (usize, &Worker)> {
        let is_full = |stop: &Sender<()>| matches!(stop.try_send(()), Err(TrySendError::Full(())));
        let workers = self.workers.iter().map(|(&index, worker)| (index, worker));
        workers.filter(move |(_, worker)| worker.stop.as_ref().is_some_and(is_full))
    }

    /// The samples that each worker has made, by their numbers.
    pub(super) fn made(&self) -> Vec<u64> {
        let end = self.workers.keys().next_back().map_or(0, |last| last + 1);
        (0..end).map(|worker| self.workers.get(&worker).map_or(0, |worker| worker.made)).collect()
    }
}
