//! The accumulator: sole owner of the film.

mod barriers;
mod publish;

use super::batch::{Payload, SampleBatch, Traced};
use super::faint::Faint;
use super::held::Held;
use super::outcome::NAMED_REJECTS;
use super::schedule::{Deal, Order, Schedule};
use super::stride::{Region, Stride};
use crate::film::noise::FIRST_MILESTONE;
use crate::film::{Film, Milestone, Picture, Reject, RejectCounts, Splatter, Statistics};
use crate::integrator::Sample;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TrySendError, at, never, select};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub use super::channels::{Barrier, Inbox, MOST_UPDATES, Outbox};
pub use super::outcome::{Outcome, Totals, Unanswered, WorkerFailure};

/// Snapshots come at most this often.
const FRAME: Duration = Duration::from_millis(33);

/// Pixels of a checkpoint that are sent at a time: 2 MiB.
const PIECE: u32 = 1 << 15;

/// The statistics in a snapshot are at most this old: they cost more than the picture.
const STATISTICS: Duration = Duration::from_secs(1);

/// The time between looks at the workers that have more time to answer than others.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

/// Making snapshots takes at most one part in this many of the time.
const SNAPSHOT_SHARE: u32 = 20;

/// The process that adds everything up.
pub struct Accumulator {
    film: Film,
    region: Region,
    schedule: Schedule,
    outbox: Outbox,
    /// What puts samples on a film where they count in all pixels around them.
    splatter: Option<Arc<Splatter>>,
    /// The index of each pixel's first sample.
    first: u32,
    /// Orders that each worker has and has not completed, the oldest first.
    outstanding: Vec<VecDeque<Given>>,
    /// The channels that ask workers to stop, and the time that each has for an answer.
    stops: Vec<Sender<()>>,
    patience: Vec<Duration>,
    /// When to stop, whole sample or not.
    overtime: Option<Instant>,
    gathering: Vec<Gathering>,
    owners: Option<Arc<Vec<u32>>>,
    /// A worker that may be lost, and where the others hear what pixels have then.
    spare: Option<(usize, Vec<Sender<Arc<Held>>>)>,
    made: Vec<u64>,
    /// How often the film is to be sent.
    checkpoint: Duration,
    last_checkpoint: Instant,
    /// The next place to send, of a film that is under way.
    sending: Option<u32>,
    /// The error to end at, the last milestone on the way, and where the next is.
    asked: Option<f64>,
    milestone: Option<Milestone>,
    next_milestone: Option<u32>,
    /// Where workers hear how far each pixel goes, if that is decided for each.
    planned: Option<Vec<Sender<Arc<Held>>>>,
    totals: Totals,
    rejects: Vec<(Traced, Reject)>,
    reject_counts: RejectCounts,
    faint: Faint,
    /// The channel for a warning of radiance that is too small for the film, until it is known whether it is.
    notes: Option<Sender<String>>,
    has_warned_of_faint: bool,
    started: Instant,
    last_frame: Option<Instant>,
    frame_cost: Duration,
    /// Those of the last snapshots, and when they were made.
    statistics: Option<(Instant, Arc<Statistics>)>,
    target: Option<u32>,
    /// Somebody who was to get everything has gone: there is no use in going on.
    deserted: bool,
}

/// An order that a worker has, and how many of its slots have come.
#[derive(Clone, Copy, Debug)]
struct Given {
    order: Order,
    slots: u32,
}

/// A barrier's picture, filled share by share.
struct Gathering {
    barrier: Barrier,
    missing: usize,
}

impl Accumulator {
    /// An accumulator of some workers' batches over a region, that gathers a picture at each of `barriers`.
    /// `target` is the number of samples a pixel that viewers are told.
    pub fn new(
        film: Film,
        region: Region,
        schedule: Schedule,
        barriers: &[u32],
        target: Option<u32>,
        outbox: Outbox,
    ) -> Accumulator {
        let (workers, shares) = (outbox.orders.len(), schedule.shares());
        let gather = |&end: &u32| {
            // There is no memory for it yet: many counts may be asked for, and few be gathered at a time.
            let picture = Picture { width: region.width, height: region.height, rgb: Vec::new() };
            Gathering { barrier: Barrier { end, picture }, missing: shares }
        };
        Accumulator {
            film,
            region,
            schedule,
            outbox,
            splatter: None,
            first: 0,
            outstanding: vec![VecDeque::new(); workers],
            stops: Vec::new(),
            patience: Vec::new(),
            overtime: None,
            gathering: barriers.iter().map(gather).collect(),
            owners: None,
            spare: None,
            made: vec![0; workers],
            checkpoint: Duration::MAX,
            last_checkpoint: Instant::now(),
            sending: None,
            asked: None,
            milestone: None,
            next_milestone: None,
            planned: None,
            totals: Totals::default(),
            rejects: Vec::new(),
            reject_counts: RejectCounts::default(),
            faint: Faint::default(),
            notes: None,
            has_warned_of_faint: false,
            started: Instant::now(),
            last_frame: None,
            frame_cost: Duration::ZERO,
            statistics: None,
            target,
            deserted: false,
        }
    }

    /// Says which worker made each pixel, for viewers that show it.
    pub fn with_owners(mut self, owners: Arc<Vec<u32>>) -> Accumulator {
        self.owners = Some(owners);
        self
    }

    /// Says that samples count in all pixels around them, and what puts them there. A pixel is at a barrier only when
    /// those around it are: all wait where a picture is to be gathered.
    pub fn with_splatter(mut self, splatter: Arc<Splatter>) -> Accumulator {
        self.splatter = Some(splatter);
        self.schedule.decide(None, self.next_gate());
        self
    }

    /// Says that the render goes on without this worker if it fails. The others hear from these channels what
    /// pixels have by then, before they get its orders.
    pub fn with_spare(mut self, worker: usize, updates: Vec<Sender<Arc<Held>>>) -> Accumulator {
        self.spare = Some((worker, updates));
        self
    }

    /// Says where workers are asked to stop, by a message that they leave there, and how long it may take them to end:
    /// then they have dropped their ends of these channels. What they send meanwhile counts.
    pub fn with_stops(mut self, workers: Vec<Sender<()>>, patience: Duration) -> Accumulator {
        self.patience = vec![patience; workers.len()];
        self.stops = workers;
        self
    }

    /// Gives one worker another time than the rest to answer the request to stop.
    pub fn with_patience(mut self, worker: usize, patience: Duration) -> Accumulator {
        self.patience[worker] = patience;
        self
    }

    /// Says when to stop even if no whole sample is done then.
    pub fn with_overtime(mut self, overtime: Option<Instant>) -> Accumulator {
        self.overtime = overtime;
        self
    }

    /// Says where to tell, once every pixel has a sample, that radiance is too small for the film.
    pub fn with_notes(mut self, notes: Sender<String>) -> Accumulator {
        self.notes = Some(notes);
        self
    }

    /// Says that samples begin at this index, and that the film has some from there on already.
    pub fn going_on(mut self, first: u32) -> Accumulator {
        let len = self.region.len() as usize;
        let held = (0..len).map(|place| self.film.seen(place)).sum();
        let least = self.film.seen_range()[0].min(u64::from(u32::MAX - first)) as u32;
        self.first = first;
        (self.totals.samples, self.totals.before, self.totals.spp) = (held, held, least);
        self
    }

    /// Says that samples are spent where the error is, once an error to end at is given. The workers hear from these
    /// channels how far each pixel goes, before the orders that it matters to; each must have room for [`MOST_UPDATES`].
    pub fn adaptively(mut self, updates: Vec<Sender<Arc<Held>>>) -> Accumulator {
        self.planned = Some(updates);
        self
    }

    /// Says at which estimated error to end, and the last milestone that the film has passed.
    pub fn until_noise(mut self, asked: f64, milestone: Option<Milestone>) -> Accumulator {
        let [least, most] = self.film.seen_range();
        // A milestone with more than twice its samples behind it is of no use.
        let passed = |m: &Milestone| m.plan.is_some() || u64::from(m.samples) <= least;
        self.milestone = milestone.filter(|m| passed(m) && most <= 2 * u64::from(m.samples));
        if self.milestone.as_ref().is_some_and(|milestone| milestone.plan.is_some()) {
            // All have passed it, those that have stopped included.
            self.totals.spp = self.schedule.completed().saturating_sub(self.first);
        }
        self.asked = Some(asked);
        // The first power of two that no pixel has passed.
        let next = u32::try_from(most.max(1).next_power_of_two()).unwrap_or(1 << 31);
        let gate = self.milestone.as_ref().map_or(next.max(FIRST_MILESTONE), |m| m.samples.saturating_mul(2));
        let end = self.milestone.as_ref().and_then(|milestone| milestone.end(asked));
        self.next_milestone = Some(gate);
        self.schedule.decide(end, self.next_gate());
        self.estimate();
        self
    }

    /// Says how often the film is to be sent.
    pub fn with_checkpoints(mut self, every: Duration) -> Accumulator {
        self.checkpoint = every;
        self
    }

    /// Gives out work and adds up what comes back, until all is done, somebody asks to stop, or a worker
    /// fails. What has arrived by then is in the film.
    pub fn run(mut self, inbox: Inbox) -> Outcome {
        self.started = Instant::now();
        self.last_checkpoint = self.started;
        let (mut failure, mut lost, mut overtime) = (None, None, false);
        let time_is_up = self.overtime.map_or_else(never, at);
        self.pass_gate();
        self.give_orders();
        while !self.deserted {
            select! {
                recv(inbox.batches) -> batch => match batch {
                    Ok(batch) => self.take(batch),
                    // All workers have ended.
                    Err(_) => break,
                },
                recv(inbox.failures) -> sent => if let Ok(sent) = sent {
                    if !self.can_lose(sent.index) {
                        failure = Some(sent);
                        break;
                    }
                    // What it sent before it failed is good, and lies in its channel by now.
                    self.take_arrived(&inbox.batches);
                    self.lose(sent.index);
                    lost = Some(sent);
                },
                recv(inbox.stop) -> _ => break,
                recv(inbox.viewer) -> _ => break,
                recv(time_is_up) -> _ => {
                    overtime = true;
                    break;
                }
            }
        }
        // What has arrived by now counts; closing orders and batches tells the workers to end.
        self.outbox.orders.clear();
        self.outbox.film = None;
        let unanswered = self.stop_workers(&inbox.batches);
        // The last worker's failure may lie behind the end of its batches.
        failure = failure.or_else(|| inbox.failures.try_recv().ok());
        self.totals.elapsed = self.started.elapsed();
        self.totals.rejected = self.film.rejected();
        drop(inbox);
        if let Some(progress) = self.outbox.progress.take() {
            // Somebody who has gone need not be told.
            let _ = progress.send(self.totals);
        }
        let viewers = [self.outbox.snapshots.take(), self.outbox.remote.take()];
        if viewers.iter().any(Option::is_some) {
            let last = Arc::new(self.snapshot(true));
            for viewer in viewers.iter().flatten() {
                // The viewer may have gone: then there is nobody to show the end to.
                let _ = viewer.send(Arc::clone(&last));
            }
        }
        let spp = self.totals.spp;
        let whole = (0..self.region.len() as usize).all(|place| self.film.seen(place) == u64::from(spp));
        let unreached = self.gathering.iter().map(|g| g.barrier.end).collect();
        let Accumulator { film, totals, milestone, made, owners, rejects, reject_counts, .. } = self;
        let (faint, has_warned_of_faint) = (self.faint, self.has_warned_of_faint);
        let overtime = overtime && (!whole || spp == 0);
        Outcome {
            film,
            totals,
            milestone,
            whole,
            failure,
            lost,
            unanswered,
            overtime,
            made,
            owners,
            unreached,
            rejects,
            reject_counts,
            faint,
            has_warned_of_faint,
        }
    }

    /// Asks the workers to stop, and takes what they send until they have ended. Returns those that have not, after a
    /// while.
    fn stop_workers(&mut self, batches: &Receiver<SampleBatch>) -> Vec<Unanswered> {
        for worker in &self.stops {
            // A worker that has ended has nothing to hear.
            let _ = worker.try_send(());
        }
        if self.stops.is_empty() {
            self.take_arrived(batches);
            return Vec::new();
        }
        let asked = Instant::now();
        let mut waited = self.patience.iter().copied().min().unwrap_or_default();
        loop {
            match batches.recv_deadline(asked + waited) {
                Ok(batch) => self.take(batch),
                Err(RecvTimeoutError::Disconnected) => return Vec::new(),
                // A worker that is silent holds up the end no longer than its own time, and one that has ended not at
                // all: beside a worker that never ends, the channel does not tell.
                Err(RecvTimeoutError::Timeout) => {
                    let longest = self.silent().map(|worker| self.patience[worker]).max().unwrap_or_default();
                    if longest <= waited {
                        break;
                    }
                    waited = longest.min(waited + LOOK_AGAIN);
                }
            }
        }
        let unanswered = self.silent().map(|worker| Unanswered {
            worker,
            within: self.patience[worker],
            order: self.outstanding[worker]
                .front()
                .map(|&Given { order, slots }| (order, slots..order.stride.len(self.region.len()))),
        });
        unanswered.collect()
    }

    /// The workers that were asked to stop and have not ended: the request lies where they have left it.
    fn silent(&self) -> impl Iterator<Item = usize> {
        let stops = self.stops.iter().enumerate();
        let silent = stops.filter(|(_, stop)| matches!(stop.try_send(()), Err(TrySendError::Full(()))));
        silent.map(|(worker, _)| worker)
    }

    fn take_arrived(&mut self, batches: &Receiver<SampleBatch>) {
        let arrived = batches.len();
        for batch in batches.try_iter().take(arrived) {
            self.take(batch);
        }
    }

    fn can_lose(&self, worker: usize) -> bool {
        self.spare.as_ref().is_some_and(|(spare, _)| *spare == worker)
    }

    /// Goes on without a worker.
    fn lose(&mut self, worker: usize) {
        self.outbox.orders[worker] = None;
        self.outstanding[worker].clear();
        self.schedule.lose(worker);
        let held = Held::of(&self.film, self.region, self.first).map(Arc::new);
        if let (Some(held), Some((_, updates))) = (held, self.spare.take()) {
            for other in updates {
                // A worker that has ended has nothing to hear.
                let _ = other.send(Arc::clone(&held));
            }
        }
        if self.owners.is_some() {
            self.owners = Some(Arc::new(self.schedule.owners(&self.film.layout())));
        }
        self.give_orders();
    }

    /// Gives workers orders until each has as many as it should: two, so that nobody waits for the post,
    /// unless a deadline could be missed by it.
    fn give_orders(&mut self) {
        let pace = self.pace();
        let wanted = self.schedule.ahead(pace);
        for worker in 0..self.outstanding.len() {
            while self.outstanding[worker].len() < wanted && self.give_order(worker, pace) {}
        }
    }

    /// The time that one sample of every pixel takes, as far as that is known.
    fn pace(&self) -> Option<Duration> {
        let spp = self.totals.made() as f64 / f64::from(self.region.len());
        (spp > 0.0).then(|| self.started.elapsed().div_f64(spp))
    }

    /// Gives a worker its next order; whether there was one.
    fn give_order(&mut self, worker: usize, pace: Option<Duration>) -> bool {
        let Some(slot) = self.outbox.orders.get_mut(worker) else { return false };
        let Some(orders) = slot else { return false };
        match self.schedule.next(worker, pace) {
            // A worker that doesn't take its order has failed, and says so elsewhere.
            Deal::Order(order) => {
                let is_taken = orders.send(order).is_ok();
                self.outstanding[worker].extend(is_taken.then_some(Given { order, slots: 0 }));
                is_taken
            }
            Deal::Later => false,
            // Somebody may be lost yet, and what it has not completed wants a worker.
            Deal::Done if self.spare.is_some() && !self.schedule.is_idle() => false,
            Deal::Done => {
                *slot = None;
                false
            }
        }
    }

    fn take(&mut self, batch: SampleBatch) {
        let start = Instant::now();
        let SampleBatch { worker, stride, payload, samples, paths, rays, completes, .. } = batch;
        let SampleBatch { rejects, reject_counts, faint, .. } = batch;
        self.totals.rays += rays;
        self.faint.merge(&faint);
        self.reject_counts.merge(&reject_counts);
        self.totals.samples += paths;
        self.made[worker] += paths;
        for reject in rejects {
            self.remember(reject);
        }
        let slots = payload.slots_end();
        if let Some(given) = self.outstanding[worker].front_mut() {
            given.slots = given.slots.max(slots);
        }
        let samples = match payload {
            Payload::Samples(samples) => {
                if self.splatter.is_some() {
                    // They may count anywhere.
                    self.send_film_past(|_| false);
                }
                for &sample in &samples {
                    self.add(sample);
                }
                samples
            }
            Payload::Sums { first_slot, sums, bright, wide } => {
                for (slot, sums) in (first_slot..).zip(&sums) {
                    self.film.add_sums(stride.place(slot) as usize, sums);
                }
                for sample in bright {
                    self.add(sample);
                }
                for (slot, sums) in &wide {
                    self.film.add_wide(stride.place(*slot) as usize, sums);
                }
                samples
            }
            Payload::Splats { first_slot, made, band, bright } => {
                let [width, height] = [self.region.width, self.region.height];
                let places = band.places(width, height);
                self.send_film_past(|next| places.is_none_or(|[first, last]| next <= first || last < next));
                self.film.add_band(&band);
                for (slot, &made) in (first_slot..).zip(&made) {
                    self.film.add_made(stride.place(slot) as usize, made);
                }
                for sample in bright {
                    self.add(sample);
                }
                samples
            }
        };
        // Waiting for the sink is not adding.
        self.totals.adding += start.elapsed();
        self.pass_on(samples);
        if let Some(end) = completes {
            self.complete(worker, stride, end);
        }
        self.send_film();
        self.report();
    }

    fn add(&mut self, sample: Sample) {
        let place = self.region.place(sample.pixel) as usize;
        let added = match &self.splatter {
            Some(splatter) => self.film.splat(splatter, place, &sample),
            None => self.film.add_sample(place, sample.radiance),
        };
        if let Err(reject) = added {
            self.reject_counts.add(reject, 1);
            self.remember((Traced { pixel: sample.pixel, sample: sample.sample }, reject));
        }
    }

    fn remember(&mut self, reject: (Traced, Reject)) {
        if self.rejects.len() < NAMED_REJECTS {
            self.rejects.push(reject);
        }
    }

    fn pass_on(&mut self, samples: Vec<Sample>) {
        // Samples of a worker that has no sums to send may be of no interest to anybody else.
        if let Some(sink) = &self.outbox.samples
            && !samples.is_empty()
            && sink.send(samples).is_err()
        {
            self.outbox.samples = None;
            self.deserted = true;
        }
    }

    fn complete(&mut self, worker: usize, stride: Stride, end: u32) {
        self.schedule.complete(stride, end);
        self.totals.spp = self.schedule.completed().saturating_sub(self.first);
        self.warn_of_faint();
        if self.splatter.is_some() {
            self.gather_whole();
        } else {
            self.gather_share(stride, end);
        }
        self.outstanding[worker].pop_front();
        self.pass_gate();
        self.estimate();
        self.give_orders();
    }

    /// Warns of radiance that is too small for the film, as soon as every pixel has a sample.
    fn warn_of_faint(&mut self) {
        if self.totals.spp == 0 {
            return;
        }
        if let Some(notes) = self.notes.take()
            && self.faint.is_majority()
        {
            // What cannot be told now is told at the end.
            self.has_warned_of_faint = notes.try_send(format!("warning: {}", self.faint)).is_ok();
        }
    }

    /// Notes what the error is by estimate.
    fn estimate(&mut self) {
        let Some(asked) = self.asked else { return };
        let error = self.milestone.as_ref().and_then(|milestone| milestone.error_at(self.totals.spp));
        self.totals.noise = error.map(|error| [error, asked]);
    }
}
