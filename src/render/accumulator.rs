//! The accumulator, the only owner of the film.
//!
//! It is one process with one loop, [`Accumulator::run`]. Its parts:
//!
//! | part | purpose |
//! |---|---|
//! | `adding` | adds batches to the film |
//! | `dispatching` | assigns orders to workers and keeps track of them |
//! | `milestones` | decides where to end, for a requested error |
//! | `barriers` | gathers pictures at given samples per pixel |
//! | `checkpoints` | sends the film to its file |
//! | `publishing` | sends progress and snapshots to viewers |
//! | `stopping` | ends the workers |
//!
//! A checkpoint is sent in pieces, between batches (`checkpoints`). A batch contains the samples of a pixel together
//! with their first hits, so that no piece has one without the other.
//!
//! Ctrl-C closes [`Inbox::stop`], which ends the loop: the workers are asked to stop, and the [`Outcome`] contains all
//! their samples up to then. The session writes it.
//!
//! Workers may join and leave at any time ([`Inbox::changes`]). They receive only orders and send only batches, which
//! are plain data. The unfinished orders of a worker that leaves are assigned to others, without the samples already on
//! the film.

mod adding;
mod barriers;
mod checkpoints;
mod configuration;
mod dispatching;
mod milestones;
mod publishing;
mod stopping;

use super::batch::SampleBatch;
use super::stride::Stride;
use crate::sampling::{Region, Sample};
use adding::Adder;
use barriers::Barriers;
use checkpoints::Checkpoints;
use crossbeam_channel::{Receiver, Sender, at, never, select};
use dispatching::Dispatcher;
use milestones::Milestones;
use publishing::Publisher;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use super::channels::{Barrier, Change, Inbox, Outbox, Port};
pub use super::outcome::{Outcome, Totals, Unanswered, WorkerFailure};
pub use configuration::{Configuration, Goal};

/// The process that adds all batches.
pub struct Accumulator {
    region: Region,
    /// The index of each pixel's first sample.
    first: u32,
    adder: Adder,
    dispatcher: Dispatcher,
    milestones: Option<Milestones>,
    barriers: Barriers,
    checkpoints: Checkpoints,
    publisher: Publisher,
    /// The sink of every sample, and whether it has closed its channel.
    samples: Option<Sender<Vec<Sample>>>,
    is_disconnected: bool,
    /// The time at which to stop even without a whole sample.
    overtime: Option<Instant>,
    totals: Totals,
    started: Instant,
    /// The workers that were lost.
    lost: Vec<WorkerFailure>,
}

/// The reason why the loop ends.
enum End {
    /// All work is done, the end is requested, or a sink or viewer has closed its channel.
    Over,
    /// The time is up, and no whole sample is near.
    Overtime,
    /// A worker failed that the render needs.
    Failure(WorkerFailure),
}

impl Accumulator {
    /// An accumulator that has not started.
    pub fn new(configuration: Configuration) -> Accumulator {
        let Configuration { film, region, first, schedule, workers, splatter, light, .. } = configuration;
        let Configuration { barriers, goal, checkpoint, overtime, target, mut outbox, .. } = configuration;
        let milestones = goal.map(|goal| Milestones::new(goal, &film));
        let present_samples = (0..region.len() as usize).map(|place| film.seen(place)).sum();
        let spp = match milestones.as_ref().is_some_and(Milestones::is_planned) {
            // All pixels have passed the milestone, stopped ones included.
            true => schedule.completed().saturating_sub(first),
            false => film.seen_range()[0].min(u64::from(u32::MAX - first)) as u32,
        };
        let owners = schedule.owners(&film.layout());
        let mut accumulator = Accumulator {
            region,
            first,
            barriers: Barriers::new(&barriers, region, outbox.barriers.take()),
            checkpoints: Checkpoints::new(region.len(), checkpoint, outbox.film.take()),
            publisher: Publisher::new(&mut outbox, target, owners, region.len()),
            dispatcher: Dispatcher::new(schedule, &film, first, workers),
            adder: Adder::new(film, region, splatter, light),
            milestones,
            samples: outbox.samples,
            is_disconnected: false,
            overtime,
            totals: Totals { samples: present_samples, before: present_samples, spp, ..Totals::default() },
            started: Instant::now(),
            lost: Vec::new(),
        };
        accumulator.decide();
        accumulator.estimate();
        accumulator
    }

    /// The worker that initially owns each pixel of the picture.
    pub fn owners(&self) -> Arc<Vec<u32>> {
        Arc::clone(&self.publisher.owners)
    }

    /// Assigns orders and adds batches until all work is done, the end is requested, or a worker fails. All batches
    /// that have arrived by then are in the film.
    pub fn run(mut self, inbox: Inbox) -> Outcome {
        self.started = Instant::now();
        self.checkpoints.start(self.started);
        let end = self.serve(&inbox);
        // The film writer ends now: no checkpoint may replace the final film.
        self.checkpoints.close();
        let unanswered = self.stop_workers(&inbox.batches);
        let is_overtime = matches!(end, End::Overtime);
        let mut failure = match end {
            End::Failure(failure) => Some(failure),
            End::Over | End::Overtime => None,
        };
        // The last worker's failure may be received after the end of its batches.
        for change in inbox.changes.try_iter() {
            match change {
                Change::Fails(it) if !self.dispatcher.is_present(it.index) => {}
                Change::Fails(it) if self.dispatcher.can_lose(it.index) => self.lost.push(it),
                Change::Fails(it) => {
                    failure.get_or_insert(it);
                }
                Change::Joins { .. } | Change::Leaves(_) => {}
            }
        }
        self.totals.elapsed = self.started.elapsed();
        self.totals.rejected = self.adder.film.rejected();
        drop(inbox);
        self.publisher.publish_end(&self.adder.film, &self.totals);
        self.outcome(failure, unanswered, is_overtime)
    }

    /// Receives batches, changes and requests to stop until the render ends.
    fn serve(&mut self, inbox: &Inbox) -> End {
        let mut changes = inbox.changes.clone();
        let time_is_up = self.overtime.map_or_else(never, at);
        self.pass_gate();
        self.give_orders();
        while !(self.is_disconnected || self.barriers.is_disconnected() || self.publisher.is_disconnected()) {
            select! {
                recv(inbox.batches) -> batch => match batch {
                    Ok(batch) => self.take(batch),
                    // All workers have ended.
                    Err(_) => return self.end_of_workers(inbox),
                },
                recv(changes) -> change => match change {
                    Ok(change) => if let Some(failure) = self.change(change, &inbox.batches) {
                        return End::Failure(failure);
                    },
                    // A closed channel is always ready.
                    Err(_) => changes = never(),
                },
                recv(inbox.stop) -> _ => break,
                recv(inbox.viewer) -> _ => break,
                recv(time_is_up) -> _ => return End::Overtime,
            }
        }
        End::Over
    }

    /// All workers have ended: because the work is done, or because they left or failed, which was received before.
    fn end_of_workers(&mut self, inbox: &Inbox) -> End {
        for change in inbox.changes.try_iter() {
            if let Some(failure) = self.change(change, &inbox.batches) {
                return End::Failure(failure);
            }
        }
        match self.dispatcher.last_departed(self.pace()) {
            None => End::Over,
            Some(index) => End::Failure(WorkerFailure {
                index,
                worker: format!("worker {index}"),
                message: "it left before the end of the render, and there is no other worker".to_owned(),
            }),
        }
    }

    /// Adds a batch, and does what is due then.
    fn take(&mut self, batch: SampleBatch) {
        if !self.dispatcher.is_present(batch.worker) {
            // Its orders belong to other workers by now.
            return;
        }
        let SampleBatch { worker, stride, payload, samples, paths, rays, completes, .. } = batch;
        let SampleBatch { contributions, first_hits, rejects, reject_counts, faint, .. } = batch;
        self.totals.rays += rays;
        self.totals.samples += paths;
        self.dispatcher.receive(worker, paths, payload.slots_end());
        let reach = self.adder.reach(&payload, &contributions);
        self.checkpoints.send_past(reach, &self.adder.film, last(&self.milestones));
        // The time that sinks take is not counted.
        let start = Instant::now();
        self.adder.count(rejects, &reject_counts, &faint);
        let samples = self.adder.add(stride, payload).unwrap_or(samples);
        self.adder.contribute(&contributions);
        // Together with their samples: a checkpoint has both or neither.
        self.adder.add_first_hits(stride, &first_hits);
        self.totals.adding += start.elapsed();
        self.forward_samples(samples);
        if let Some(end) = completes {
            self.complete(worker, stride, end);
        }
        self.checkpoints.send(&self.adder.film, last(&self.milestones));
        self.totals.elapsed = self.started.elapsed();
        self.publisher.publish(&self.adder.film, &self.totals);
    }

    /// Sends samples to their sink, and waits until they are received.
    fn forward_samples(&mut self, samples: Vec<Sample>) {
        // A worker without sums sends samples even if no sink wants them.
        if let Some(sink) = &self.samples
            && !samples.is_empty()
            && sink.send(samples).is_err()
        {
            self.samples = None;
            self.is_disconnected = true;
        }
    }

    /// Records that a worker has completed an order: the pixels of the stride have all samples before `end`.
    fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.dispatcher.complete(worker, stride, end);
        let completed = self.dispatcher.schedule.completed();
        self.totals.spp = completed.saturating_sub(self.first);
        self.publisher.warn_of_faint(&self.adder.faint, self.totals.spp);
        match self.adder.reaches_others() {
            // A pixel is complete at a barrier only when its neighbours' samples are.
            true => self.barriers.gather_whole(&self.adder.film, completed),
            false => self.barriers.gather_share(&self.adder.film, stride, end),
        }
        self.pass_gate();
        self.estimate();
        self.give_orders();
    }

    /// Continues when all shares wait at a gate: a milestone, or a picture that cannot be gathered share by share.
    fn pass_gate(&mut self) {
        let Some(gate) = self.dispatcher.schedule.waits_at() else { return };
        let Some(milestones) = self.milestones.as_mut().filter(|it| it.next() == Some(gate)) else {
            self.dispatcher.schedule.decide(None, self.next_gate());
            return;
        };
        milestones.pass(gate - self.first, &self.adder.film, self.dispatcher.schedule.target());
        self.decide();
        self.checkpoints.restart();
    }

    /// Decides the end, if a milestone determines it, and the next gate.
    fn decide(&mut self) {
        let end = self.milestones.as_ref().and_then(Milestones::end);
        self.dispatcher.schedule.decide(end, self.next_gate());
    }

    /// The next gate: a milestone, or a picture that cannot be gathered share by share.
    fn next_gate(&self) -> Option<u32> {
        let picture = self.barriers.next().filter(|_| self.adder.reaches_others());
        let milestone = self.milestones.as_ref().and_then(Milestones::next);
        milestone.into_iter().chain(picture).min()
    }

    /// Records the estimated error.
    fn estimate(&mut self) {
        let spp = self.totals.spp;
        self.totals.noise = self.milestones.as_ref().and_then(|milestones| milestones.noise(spp));
    }

    /// Processes a change among the workers. Returns the failure if it ends the render.
    fn change(&mut self, change: Change, batches: &Receiver<SampleBatch>) -> Option<WorkerFailure> {
        match change {
            Change::Joins { worker, port, speed } => self.dispatcher.join(worker, port, speed),
            Change::Leaves(worker) => self.lose(worker, batches),
            Change::Fails(failure) if !self.dispatcher.is_present(failure.index) => return None,
            Change::Fails(failure) if !self.dispatcher.can_lose(failure.index) => return Some(failure),
            Change::Fails(failure) => {
                self.lose(failure.index, batches);
                self.lost.push(failure);
            }
        }
        self.publisher.owners = Arc::new(self.dispatcher.schedule.owners(&self.adder.film.layout()));
        self.give_orders();
        None
    }

    /// Continues without a worker. The batches that it has sent are valid, and are in its channel by now.
    fn lose(&mut self, worker: usize, batches: &Receiver<SampleBatch>) {
        self.drain_batches(batches);
        self.dispatcher.lose(worker);
    }

    /// Gives workers their next orders.
    fn give_orders(&mut self) {
        let plan = last(&self.milestones).and_then(|milestone| milestone.plan.clone());
        self.dispatcher.give_orders(self.pace(), &self.adder.film, plan.as_deref());
    }

    /// The time for one sample of every pixel, if it is known.
    fn pace(&self) -> Option<Duration> {
        let spp = self.totals.made() as f64 / f64::from(self.region.len());
        (spp > 0.0).then(|| self.started.elapsed().div_f64(spp))
    }

    /// The outcome of the render.
    fn outcome(
        self,
        failure: Option<WorkerFailure>,
        unanswered: Vec<Unanswered>,
        is_overtime: bool,
    ) -> Outcome {
        let Accumulator { region, adder, dispatcher, milestones, barriers, publisher, totals, lost, .. } =
            self;
        let Adder { film, rejects, reject_counts, faint, .. } = adder;
        let spp = totals.spp;
        let whole = (0..region.len() as usize).all(|place| film.seen(place) == u64::from(spp));
        Outcome {
            film,
            totals,
            milestone: milestones.and_then(Milestones::into_last),
            whole,
            failure,
            lost,
            unanswered,
            overtime: is_overtime && (!whole || spp == 0),
            made: dispatcher.made(),
            owners: publisher.owners,
            unreached: barriers.ends().collect(),
            rejects,
            reject_counts,
            faint,
            has_warned_of_faint: publisher.has_warned_of_faint,
        }
    }
}

/// The last milestone of a render with a requested error.
fn last(milestones: &Option<Milestones>) -> Option<&crate::film::Milestone> {
    milestones.as_ref().and_then(Milestones::last)
}
