//! The accumulator: sole owner of the film.
//!
//! It is one process with one loop, [`Accumulator::run`]. Its parts, each with one job:
//!
//! | part | its job |
//! |---|---|
//! | `adding` | adds batches to the film |
//! | `dealing` | deals out orders, and knows which worker has which |
//! | `milestones` | decides where to end, where an error is asked for |
//! | `barriers` | gathers pictures at numbers of samples a pixel |
//! | `checkpoints` | sends the film to its file |
//! | `publishing` | sends progress and snapshots to viewers |
//! | `stopping` | ends the workers |
//!
//! A checkpoint goes out in pieces, between batches (`checkpoints`). A batch has a pixel's samples and their first hits
//! together, so that no piece has one without the other.
//!
//! Ctrl-C closes [`Inbox::stop`], which ends the loop: the workers are asked to stop, and what they have made by then is
//! in the [`Outcome`], which the session writes.
//!
//! Workers may join and leave at any time ([`Inbox::changes`]). All that they hear is orders and all that they say is
//! batches, which are plain data. What a worker holds when it goes is given to others, as far as the film lacks it.

mod adding;
mod barriers;
mod checkpoints;
mod configuration;
mod dealing;
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
use dealing::Dealer;
use milestones::Milestones;
use publishing::Publisher;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use super::channels::{Barrier, Change, Inbox, Outbox, Port};
pub use super::outcome::{Outcome, Totals, Unanswered, WorkerFailure};
pub use configuration::{Configuration, Goal};

/// The process that adds everything up.
pub struct Accumulator {
    region: Region,
    /// The index of each pixel's first sample.
    first: u32,
    adder: Adder,
    dealer: Dealer,
    milestones: Option<Milestones>,
    barriers: Barriers,
    checkpoints: Checkpoints,
    publisher: Publisher,
    /// The sink of every sample, and whether it has gone.
    samples: Option<Sender<Vec<Sample>>>,
    is_deserted: bool,
    /// When to stop, whole sample or not.
    overtime: Option<Instant>,
    totals: Totals,
    started: Instant,
    /// The workers that were lost.
    lost: Vec<WorkerFailure>,
}

/// Why the loop ends.
enum End {
    /// All is done, or the end is asked for, or a sink or viewer has gone.
    Over,
    /// The time is up, and no whole sample is near.
    Overtime,
    /// A worker failed that the others cannot do without.
    Failure(WorkerFailure),
}

impl Accumulator {
    /// An accumulator that has not begun yet.
    pub fn new(configuration: Configuration) -> Accumulator {
        let Configuration { film, region, first, schedule, workers, splatter, light, .. } = configuration;
        let Configuration { barriers, goal, checkpoint, overtime, target, mut outbox, .. } = configuration;
        let milestones = goal.map(|goal| Milestones::new(goal, &film));
        let held = (0..region.len() as usize).map(|place| film.seen(place)).sum();
        let spp = match milestones.as_ref().is_some_and(Milestones::is_planned) {
            // All have passed the milestone, those that have stopped included.
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
            dealer: Dealer::new(schedule, &film, first, workers),
            adder: Adder::new(film, region, splatter, light),
            milestones,
            samples: outbox.samples,
            is_deserted: false,
            overtime,
            totals: Totals { samples: held, before: held, spp, ..Totals::default() },
            started: Instant::now(),
            lost: Vec::new(),
        };
        accumulator.decide();
        accumulator.estimate();
        accumulator
    }

    /// The worker that owns each pixel of the picture to begin with.
    pub fn owners(&self) -> Arc<Vec<u32>> {
        Arc::clone(&self.publisher.owners)
    }

    /// Gives out work and adds up what comes back, until all is done, the end is asked for, or a worker fails. What has
    /// arrived by then is in the film.
    pub fn run(mut self, inbox: Inbox) -> Outcome {
        self.started = Instant::now();
        self.checkpoints.start(self.started);
        let end = self.serve(&inbox);
        // The file's process ends now: no checkpoint may come after what is written at the end.
        self.checkpoints.close();
        let unanswered = self.stop_workers(&inbox.batches);
        let is_overtime = matches!(end, End::Overtime);
        let mut failure = match end {
            End::Failure(failure) => Some(failure),
            End::Over | End::Overtime => None,
        };
        // The last worker's failure may lie behind the end of its batches.
        for change in inbox.changes.try_iter() {
            match change {
                Change::Fails(it) if !self.dealer.is_there(it.index) => {}
                Change::Fails(it) if self.dealer.can_lose(it.index) => self.lost.push(it),
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

    /// Receives batches, changes and requests to stop, until the render ends.
    fn serve(&mut self, inbox: &Inbox) -> End {
        let mut changes = inbox.changes.clone();
        let time_is_up = self.overtime.map_or_else(never, at);
        self.pass_gate();
        self.give_orders();
        while !(self.is_deserted || self.barriers.is_deserted() || self.publisher.is_left()) {
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

    /// All workers have ended: because all is done, or because they have left or failed, which they said before.
    fn end_of_workers(&mut self, inbox: &Inbox) -> End {
        for change in inbox.changes.try_iter() {
            if let Some(failure) = self.change(change, &inbox.batches) {
                return End::Failure(failure);
            }
        }
        match self.dealer.deserter(self.pace()) {
            None => End::Over,
            Some(index) => End::Failure(WorkerFailure {
                index,
                worker: format!("worker {index}"),
                message: "it left before all was done, and no other worker is there".to_owned(),
            }),
        }
    }

    /// Adds a batch, and does whatever is due then.
    fn take(&mut self, batch: SampleBatch) {
        if !self.dealer.is_there(batch.worker) {
            // Others have its orders by now.
            return;
        }
        let SampleBatch { worker, stride, payload, samples, paths, rays, completes, .. } = batch;
        let SampleBatch { contributions, first_hits, rejects, reject_counts, faint, .. } = batch;
        self.totals.rays += rays;
        self.totals.samples += paths;
        self.dealer.receive(worker, paths, payload.slots_end());
        let reach = self.adder.reach(&payload, &contributions);
        self.checkpoints.send_past(reach, &self.adder.film, last(&self.milestones));
        // Waiting for sinks is not adding.
        let start = Instant::now();
        self.adder.count(rejects, &reject_counts, &faint);
        let samples = self.adder.add(stride, payload).unwrap_or(samples);
        self.adder.contribute(&contributions);
        // In one go with their samples: a checkpoint has both or neither.
        self.adder.add_first_hits(stride, &first_hits);
        self.totals.adding += start.elapsed();
        self.pass_on(samples);
        if let Some(end) = completes {
            self.complete(worker, stride, end);
        }
        self.checkpoints.send(&self.adder.film, last(&self.milestones));
        self.totals.elapsed = self.started.elapsed();
        self.publisher.publish(&self.adder.film, &self.totals);
    }

    /// Sends samples to their sink, waiting until they are taken.
    fn pass_on(&mut self, samples: Vec<Sample>) {
        // Samples of a worker that has no sums to send may be wanted by no sink.
        if let Some(sink) = &self.samples
            && !samples.is_empty()
            && sink.send(samples).is_err()
        {
            self.samples = None;
            self.is_deserted = true;
        }
    }

    /// A worker has carried out an order: the pixels of the stride have all samples before `end`.
    fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.dealer.complete(worker, stride, end);
        let completed = self.dealer.schedule.completed();
        self.totals.spp = completed.saturating_sub(self.first);
        self.publisher.warn_of_faint(&self.adder.faint, self.totals.spp);
        match self.adder.reaches_others() {
            // A pixel is at a barrier only when those are whose samples count in it.
            true => self.barriers.gather_whole(&self.adder.film, completed),
            false => self.barriers.gather_share(&self.adder.film, stride, end),
        }
        self.pass_gate();
        self.estimate();
        self.give_orders();
    }

    /// Goes on when all wait at a gate: a milestone, or a picture that can't be gathered share by share.
    fn pass_gate(&mut self) {
        let Some(gate) = self.dealer.schedule.waits_at() else { return };
        let Some(milestones) = self.milestones.as_mut().filter(|it| it.next() == Some(gate)) else {
            self.dealer.schedule.decide(None, self.next_gate());
            return;
        };
        milestones.pass(gate - self.first, &self.adder.film, self.dealer.schedule.target());
        self.decide();
        self.checkpoints.begin_anew();
    }

    /// Decides where to end, as far as a milestone tells, and where all wait next.
    fn decide(&mut self) {
        let end = self.milestones.as_ref().and_then(Milestones::end);
        self.dealer.schedule.decide(end, self.next_gate());
    }

    /// Where all wait next: at a milestone, or for a picture that can't be gathered share by share.
    fn next_gate(&self) -> Option<u32> {
        let picture = self.barriers.next().filter(|_| self.adder.reaches_others());
        let milestone = self.milestones.as_ref().and_then(Milestones::next);
        milestone.into_iter().chain(picture).min()
    }

    /// Notes what the error is by estimate.
    fn estimate(&mut self) {
        let spp = self.totals.spp;
        self.totals.noise = self.milestones.as_ref().and_then(|milestones| milestones.noise(spp));
    }

    /// Takes note of a change among the workers. Returns the failure if it ends the render.
    fn change(&mut self, change: Change, batches: &Receiver<SampleBatch>) -> Option<WorkerFailure> {
        match change {
            Change::Joins { worker, port, speed } => self.dealer.join(worker, port, speed),
            Change::Leaves(worker) => self.lose(worker, batches),
            Change::Fails(failure) if !self.dealer.is_there(failure.index) => return None,
            Change::Fails(failure) if !self.dealer.can_lose(failure.index) => return Some(failure),
            Change::Fails(failure) => {
                self.lose(failure.index, batches);
                self.lost.push(failure);
            }
        }
        self.publisher.owners = Arc::new(self.dealer.schedule.owners(&self.adder.film.layout()));
        self.give_orders();
        None
    }

    /// Goes on without a worker. What it sent before is good, and lies in its channel by now.
    fn lose(&mut self, worker: usize, batches: &Receiver<SampleBatch>) {
        self.take_arrived(batches);
        self.dealer.lose(worker);
    }

    /// Gives workers all the orders that they should have.
    fn give_orders(&mut self) {
        let plan = last(&self.milestones).and_then(|milestone| milestone.plan.clone());
        self.dealer.give_orders(self.pace(), &self.adder.film, plan.as_deref());
    }

    /// The time that one sample of every pixel takes, as far as that is known.
    fn pace(&self) -> Option<Duration> {
        let spp = self.totals.made() as f64 / f64::from(self.region.len());
        (spp > 0.0).then(|| self.started.elapsed().div_f64(spp))
    }

    /// What it all came to.
    fn outcome(
        self,
        failure: Option<WorkerFailure>,
        unanswered: Vec<Unanswered>,
        is_overtime: bool,
    ) -> Outcome {
        let Accumulator { region, adder, dealer, milestones, barriers, publisher, totals, lost, .. } = self;
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
            made: dealer.made(),
            owners: publisher.owners,
            unreached: barriers.ends().collect(),
            rejects,
            reject_counts,
            faint,
            has_warned_of_faint: publisher.has_warned_of_faint,
        }
    }
}

/// The last milestone of a render that has them.
fn last(milestones: &Option<Milestones>) -> Option<&crate::film::Milestone> {
    milestones.as_ref().and_then(Milestones::last)
}
