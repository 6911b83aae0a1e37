//! The worker itself: orders in, dispatches out, batches back.

use super::device::Device;
use super::layout::Plan;
use super::pace::{MOST_SAMPLES, MOST_SLOTS, Pace, Remaining, Run, Task, next_part};
use super::pipeline::{DispatchBuffers, Pipeline, Submission};
use super::program::{Program, Shape};
use super::readback;
use super::tables::Tables;
use crate::gpu::{GpuError, Job};
use crate::render::batch::NAMED_REJECTS;
use crate::render::{Held, Order, Payload, Region, SampleBatch, Stride, Traced};
use crossbeam_channel::{Receiver, Sender, TryRecvError};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Dispatches that the device has at a time: one works while the other is read.
const IN_FLIGHT: usize = 2;

/// A device that doesn't answer for so long has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// A worker on a GPU: the counterpart of [`crate::render::worker::Worker`], under the same protocol.
pub struct GpuWorker {
    device: Device,
    pipeline: Pipeline,
    /// Taken in turns, so that the next one is free while fewer than [`IN_FLIGHT`] fly.
    buffers: Vec<DispatchBuffers>,
    turn: usize,
    region: Region,
    index: usize,
    sends_samples: bool,
    pace: Pace,
    held: Option<Arc<Held>>,
}

impl GpuWorker {
    /// Puts the scene onto the device and compiles the program for it.
    ///
    /// Fails, naming the reason, when the GPU does not take something in the job, when the scene is too
    /// large for the device, or when the driver refuses the program or the memory.
    pub fn new(device: &Device, job: &Job<'_>) -> Result<GpuWorker, GpuError> {
        let tables = Tables::new(job)?;
        let plan = Plan::of(device, &tables)?;
        let program = Program::new(device, job.render, Shape::of(device), plan)?;
        GpuWorker::with_program(device, job, &tables, program)
    }

    pub(super) fn with_program(
        device: &Device,
        job: &Job<'_>,
        tables: &Tables,
        program: Program,
    ) -> Result<GpuWorker, GpuError> {
        let pipeline = Pipeline::new(device, job, tables, program)?;
        let slots = job.region.len().min(MOST_SLOTS);
        let samples = if job.sends_samples { MOST_SAMPLES } else { 0 };
        let buffers = (0..IN_FLIGHT)
            .map(|_| pipeline.buffers(device, slots, samples))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(GpuWorker {
            device: device.clone(),
            pipeline,
            buffers,
            turn: 0,
            region: job.region,
            index: job.index,
            sends_samples: job.sends_samples,
            pace: Pace::new(job.sends_samples),
            held: None,
        })
    }

    /// Says what pixels have already, where not all have the same.
    pub fn holds(&mut self, held: Option<Arc<Held>>) {
        self.held = held;
    }

    /// Goes on at another pace.
    #[cfg(test)]
    pub(super) fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
    }

    /// Carries out orders until their channel closes or nobody wants the batches any more. Fails when the
    /// device does; the batches sent until then are good.
    pub fn run(&mut self, orders: &Receiver<Order>, batches: &Sender<SampleBatch>) -> Result<(), GpuError> {
        let mut in_flight: VecDeque<(Submission, Instant)> = VecDeque::with_capacity(IN_FLIGHT);
        let mut remaining: Option<Remaining> = None;
        // Tasks that the driver ended too soon, and those that were in flight behind them.
        let mut again = VecDeque::new();
        let mut closed = false;
        let mut last_landing = Instant::now();
        loop {
            // The device works at one dispatch while the next waits in its queue.
            while in_flight.len() < IN_FLIGHT {
                let task = next_part(&mut again, &self.pace);
                let task =
                    task.or_else(|| remaining.as_mut().and_then(|remaining| remaining.next(&self.pace)));
                if let Some(task) = task {
                    let buffers = &self.buffers[(self.turn + in_flight.len()) % IN_FLIGHT];
                    let submitted = Instant::now();
                    let submission = self.pipeline.submit(&self.device, buffers, task, self.sends_samples);
                    in_flight.push_back((submission, submitted));
                    continue;
                }
                if closed {
                    break;
                }
                // While the device works, an order is welcome but not waited for.
                let order = if in_flight.is_empty() {
                    orders.recv().map_err(|_| TryRecvError::Disconnected)
                } else {
                    orders.try_recv()
                };
                match order {
                    Ok(order) => {
                        let to_do = self.to_do(order);
                        if to_do.is_done() {
                            let mut batch = self.empty_batch(order.stride, 0);
                            batch.completes = Some(order.end);
                            if batches.send(batch).is_err() {
                                return self.wait_for_all(&in_flight);
                            }
                        }
                        remaining = Some(to_do);
                    }
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => closed = true,
                }
            }
            let Some((submission, submitted)) = in_flight.pop_front() else { return Ok(()) };
            let landed = self.land(&submission, submitted.max(last_landing))?;
            last_landing = Instant::now();
            let Some(batch) = landed else {
                if !self.pace.ask_less(&submission.task, self.pipeline.invocations()) {
                    let adapter = self.device.description().name.clone();
                    return Err(GpuError::CutShort { adapter });
                }
                self.wait_for_all(&in_flight)?;
                let behind = in_flight.drain(..).map(|(submission, _)| submission.task);
                let all: Vec<_> = [submission.task].into_iter().chain(behind).collect();
                // In their order: an order's last task stays the last one.
                all.into_iter().rev().for_each(|task| again.push_front(task));
                continue;
            };
            if batches.send(batch).is_err() {
                return self.wait_for_all(&in_flight);
            }
        }
    }

    /// What an order asks of the slots, as far as they don't have it.
    fn to_do(&self, order: Order) -> Remaining {
        let slots = order.stride.len(self.region.len());
        match &self.held {
            Some(held) if !held.is_behind(order) => {
                let runs = held.runs(order, slots);
                Remaining::of(order, runs.into_iter().map(|(slots, samples)| Run { slots, samples }))
            }
            _ => Remaining::new(order, slots),
        }
    }

    /// Waits for a dispatch, learns from the time that it took since `start`, and makes a batch of it; none if the
    /// driver ended it too soon.
    fn land(&mut self, submission: &Submission, start: Instant) -> Result<Option<SampleBatch>, GpuError> {
        // Answers come while the device is asked. One that is here already may have been here for long.
        let _ = self.device.device.poll(wgpu::PollType::Poll);
        let waited = !submission.is_done();
        self.wait(submission)?;
        let took = start.elapsed();
        let landed = self.read(&submission.task);
        self.turn = (self.turn + 1) % IN_FLIGHT;
        match landed {
            // How long it would have taken is not known.
            Ok(None) | Err(_) => {}
            Ok(Some(_)) if waited => self.pace.learn(submission.task.paths(), took),
            Ok(Some(_)) => self.pace.learn_at_most(submission.task.paths(), took),
        }
        landed
    }

    fn wait(&self, submission: &Submission) -> Result<(), GpuError> {
        let submission_index = Some(submission.index.clone());
        let wait = wgpu::PollType::Wait { submission_index, timeout: Some(PATIENCE) };
        if let Err(error) = self.device.device.poll(wait) {
            return Err(self.device.failure(&error.to_string()));
        }
        self.device.check()?;
        if submission.is_readable() { Ok(()) } else { Err(self.device.failure("the device was lost")) }
    }

    /// Leaves the buffers as they were found, for another run.
    fn wait_for_all(&mut self, in_flight: &VecDeque<(Submission, Instant)>) -> Result<(), GpuError> {
        for (submission, _) in in_flight {
            self.wait(submission)?;
            // Looking at results gives their buffers back.
            drop(self.read(&submission.task));
            self.turn = (self.turn + 1) % IN_FLIGHT;
        }
        Ok(())
    }

    /// A batch of what the program leaves behind: samples, or sums from a slot on.
    fn empty_batch(&self, stride: Stride, first_slot: u32) -> SampleBatch {
        let samples = self.sends_samples.then(|| Payload::Samples(Vec::new()));
        SampleBatch::empty(self.index, stride, samples.unwrap_or_else(|| Payload::sums(first_slot)))
    }

    /// What the dispatch whose turn it is has brought; none if the driver ended it too soon, and nothing of it counts.
    fn read(&self, task: &Task) -> Result<Option<SampleBatch>, GpuError> {
        let unreadable = || self.device.failure("its results cannot be read");
        let buffers = &self.buffers[self.turn];
        let mut batch = self.empty_batch(task.stride, task.first_slot);
        batch.paths = task.paths();
        batch.completes = task.completes;
        let mut whole = true;
        match &mut batch.payload {
            Payload::Samples(samples) => {
                *samples = buffers
                    .samples(task, |words| words.iter().map(readback::sample).collect())
                    .ok_or_else(unreadable)?;
                batch.rays = buffers
                    .sums(task, |words| {
                        whole = words.iter().all(|words| words.rays > 0);
                        words.iter().map(|words| u64::from(words.rays)).sum()
                    })
                    .ok_or_else(unreadable)?;
            }
            // Nobody makes such a batch here.
            Payload::Splats { .. } => {}
            Payload::Sums { sums, wide, .. } => {
                let rejects = &mut batch.rejects;
                batch.rays = buffers
                    .sums(task, |words| {
                        whole = words.iter().all(|words| words.rays > 0);
                        sums.reserve_exact(words.len());
                        let mut rays = 0;
                        for (slot, words) in (task.first_slot..).zip(words) {
                            let read = readback::slot(words, task.samples);
                            sums.push(read.sums);
                            wide.extend(read.wide.map(|sums| (slot, sums)));
                            rays += read.rays;
                            if let Some((sample, why)) = read.reject
                                && rejects.len() < NAMED_REJECTS
                            {
                                let pixel = self.region.pixel(task.stride.place(slot)).index;
                                rejects.push((Traced { pixel, sample }, why));
                            }
                        }
                        rays
                    })
                    .ok_or_else(unreadable)?;
            }
        }
        Ok(whole.then_some(batch))
    }
}
