//! The worker: receives orders, submits dispatches, and sends batches.

use super::device::Device;
use super::layout::SlotSums;
use super::pace::{
    FIRST_BRIGHT, MOST_BRIGHT, MOST_SAMPLES, MOST_SLOTS, Pace, Remaining, Run, Task, next_part,
};
use super::pipeline::{DispatchBuffers, DispatchOutput, Pipeline, Room, Submission};
use super::program::{DispatchLimits, Program};
use super::readback;
use super::tables::Tables;
use super::variant::ProgramPlan;
use crate::film::{Band, Made, Reject, Splatter};
use crate::gpu::{GpuError, Job};
use crate::render::batch::NAMED_REJECTS;
use crate::render::{Assignment, FirstHitTracer, Payload, SampleBatch, Stride, Traced};
use crate::sampling::Region;
use crossbeam_channel::{Receiver, Sender, TryRecvError, never};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Dispatches in flight: one runs while the results of the other are read.
const IN_FLIGHT: usize = 2;

/// A device that does not answer for this long has failed.
const PATIENCE: Duration = Duration::from_secs(60);

/// A worker on a GPU: the counterpart of [`crate::render::worker::Worker`], under the same protocol.
pub struct GpuWorker {
    device: Device,
    pipeline: Pipeline,
    /// Buffers used in turn; while fewer than [`IN_FLIGHT`] are in flight, the next one is free.
    buffers: Vec<DispatchBuffers>,
    turn: usize,
    region: Region,
    index: usize,
    sends_samples: bool,
    /// The filter by which samples are added to bands, unless samples are returned.
    splatter: Option<Splatter>,
    /// The current and the maximum capacity for samples that are too bright for a band.
    bright: [u32; 2],
    pace: Pace,
    /// The tracer of first hits, if the film has layers.
    tracer: Option<FirstHitTracer>,
}

/// The result of a dispatch.
enum DispatchResult {
    Batch(Box<SampleBatch>),
    /// No result: the driver ended it early.
    CutShort,
    /// No result: this many bright samples exceeded the capacity.
    TooBright(u32),
}

impl GpuWorker {
    /// Uploads the scene to the device and compiles the program for it.
    ///
    /// Fails with a reason if the GPU does not support a feature of the job, if the scene is too large for the device,
    /// or if the driver rejects the program or the memory.
    pub fn new(device: &Device, job: &Job<'_>) -> Result<GpuWorker, GpuError> {
        let tables = Tables::new(job)?;
        let plan = ProgramPlan::of(device, &tables)?;
        let program = Program::new(device, job.render, DispatchLimits::of(device), plan)?;
        GpuWorker::with_program(device, job, &tables, program)
    }

    pub(super) fn with_program(
        device: &Device,
        job: &Job<'_>,
        tables: &Tables,
        program: Program,
    ) -> Result<GpuWorker, GpuError> {
        GpuWorker::with_room(device, job, tables, program, MOST_BRIGHT)
    }

    /// With a given capacity for samples of a dispatch that are too bright for a band of sums.
    pub(super) fn with_room(
        device: &Device,
        job: &Job<'_>,
        tables: &Tables,
        program: Program,
        bright: u32,
    ) -> Result<GpuWorker, GpuError> {
        let pipeline = Pipeline::new(device, job, tables, program)?;
        // The device sums no spreads.
        let sends_samples = job.sends_samples || job.splatter.is_some_and(Splatter::has_spreads);
        let splatter = job.splatter.filter(|_| !sends_samples).cloned();
        let (samples, band_pixels) = match &splatter {
            _ if sends_samples => (MOST_SAMPLES, 0),
            Some(splatter) => (bright, splatter.most_pixels(job.region.width, job.region.height)),
            None => (0, 0),
        };
        let room = Room { slots: job.region.len().min(MOST_SLOTS), samples, band_pixels };
        let buffers =
            (0..IN_FLIGHT).map(|_| pipeline.buffers(device, room)).collect::<Result<Vec<_>, _>>()?;
        Ok(GpuWorker {
            device: device.clone(),
            pipeline,
            buffers,
            turn: 0,
            region: job.region,
            index: job.index,
            sends_samples,
            pace: if splatter.is_some() { Pace::of_splats() } else { Pace::new(sends_samples) },
            splatter,
            bright: [FIRST_BRIGHT.min(bright), bright],
            tracer: None,
        })
    }

    /// Enables first hits for the samples of each batch. They are traced on the CPU, so that layers do not depend on
    /// the device.
    pub fn trace_first_hits_with(&mut self, tracer: Option<FirstHitTracer>) {
        self.tracer = tracer;
    }

    /// Sets the pace.
    #[cfg(test)]
    pub(super) fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
    }

    /// Executes orders until their channel or the batch channel closes. Fails if the device fails; batches sent before
    /// remain valid.
    pub fn run(
        &mut self,
        orders: &Receiver<Assignment>,
        batches: &Sender<SampleBatch>,
    ) -> Result<(), GpuError> {
        self.run_until(orders, &never(), batches)
    }

    /// The same, and starts no dispatch once there is a message in `stop`, which stays there. Dispatches in flight are
    /// completed and sent.
    pub fn run_until(
        &mut self,
        orders: &Receiver<Assignment>,
        stop: &Receiver<()>,
        batches: &Sender<SampleBatch>,
    ) -> Result<(), GpuError> {
        let mut in_flight: VecDeque<(Submission, Instant)> = VecDeque::with_capacity(IN_FLIGHT);
        let mut remaining: Option<Remaining> = None;
        // The next tasks: those without a result, and those in flight after them.
        let mut tasks = VecDeque::new();
        let mut closed = false;
        let mut last_landing = Instant::now();
        loop {
            if !stop.is_empty() {
                (closed, remaining) = (true, None);
                tasks.clear();
            }
            // The device runs one dispatch while the next is queued.
            while in_flight.len() < IN_FLIGHT {
                if tasks.is_empty() {
                    let reach = |place| self.reach(place);
                    tasks.extend(remaining.as_mut().and_then(|remaining| remaining.next(&self.pace, reach)));
                }
                if let Some(task) = next_part(&mut tasks, &self.pace) {
                    let buffers = &self.buffers[(self.turn + in_flight.len()) % IN_FLIGHT];
                    let submitted = Instant::now();
                    let output = self.output(&task);
                    let submission = self.pipeline.submit(&self.device, buffers, self.region, task, output);
                    in_flight.push_back((submission, submitted));
                    continue;
                }
                if closed {
                    break;
                }
                // While the device is busy, orders are received without waiting.
                let order = if in_flight.is_empty() {
                    orders.recv().map_err(|_| TryRecvError::Disconnected)
                } else {
                    orders.try_recv()
                };
                match order {
                    Ok(assignment) => {
                        let (order, to_do) = (assignment.order, self.to_do(&assignment));
                        if to_do.is_done() {
                            let mut batch = self.empty_batch(order.stride, 0);
                            batch.completes = Some(order.end);
                            if batches.send(batch).is_err() {
                                return self.wait_for_all(in_flight);
                            }
                        }
                        remaining = Some(to_do);
                    }
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => closed = true,
                }
            }
            let Some((submission, submitted)) = in_flight.pop_front() else { return Ok(()) };
            let task = submission.task;
            let result = self.finish_dispatch(submission, submitted.max(last_landing))?;
            last_landing = Instant::now();
            match result {
                DispatchResult::Batch(mut batch) => {
                    if let Some(tracer) = &self.tracer {
                        let slots = task.first_slot..task.first_slot + task.slots;
                        let samples = task.first_sample..task.first_sample + task.samples;
                        batch.first_hits = tracer.trace_first_hits(task.stride, slots, &samples);
                    }
                    if batches.send(*batch).is_err() {
                        return self.wait_for_all(in_flight);
                    }
                    continue;
                }
                DispatchResult::CutShort => {
                    if !self.pace.ask_less(&task, self.pipeline.invocations()) {
                        let adapter = self.device.description().name.clone();
                        return Err(GpuError::CutShort { adapter });
                    }
                }
                DispatchResult::TooBright(bright) => {
                    let [room, most] = &mut self.bright;
                    *room = bright.saturating_mul(2).clamp(*room, *most);
                    if bright > *most {
                        self.pace.leave_room(&task, bright, *most);
                    }
                }
            }
            let behind = in_flight.iter().map(|(submission, _)| submission.task);
            let all: Vec<_> = [task].into_iter().chain(behind).collect();
            self.wait_for_all(std::mem::take(&mut in_flight))?;
            // In order, so that an order's last task stays the last.
            all.into_iter().rev().for_each(|task| tasks.push_front(task));
        }
    }

    /// The work of an order, without the samples that slots already have.
    fn to_do(&self, assignment: &Assignment) -> Remaining {
        let order = assignment.order;
        let slots = order.stride.len(self.region.len());
        if assignment.rest.is_none() {
            return Remaining::new(order, slots);
        }
        let runs = assignment.runs(slots).into_iter();
        Remaining::of(order, runs.map(|(slots, samples)| Run { slots, samples }))
    }

    /// The maximum number of pixels of a dispatch from a pixel.
    fn reach(&self, place: u32) -> u32 {
        let most = |splatter: &Splatter| splatter.most_places_from(place, self.region.width);
        self.splatter.as_ref().map_or(u32::MAX, most)
    }

    /// The kind of output of a task.
    fn output(&self, task: &Task) -> DispatchOutput {
        match &self.splatter {
            _ if self.sends_samples => DispatchOutput::Samples,
            Some(splatter) => {
                let [first, last] = [0, task.slots - 1].map(|slot| task.stride.place(task.first_slot + slot));
                DispatchOutput::Splats(splatter.band(first, last, self.region.width), self.bright[0])
            }
            None => DispatchOutput::Sums,
        }
    }

    /// Waits for a dispatch, adjusts the pace to its duration since `start`, and makes a batch of it.
    fn finish_dispatch(
        &mut self,
        submission: Submission,
        start: Instant,
    ) -> Result<DispatchResult, GpuError> {
        // Answers arrive while the device is polled. An answer that is already here may have arrived long ago.
        let _ = self.device.device.poll(wgpu::PollType::Poll);
        let waited = !submission.is_done();
        self.wait(&submission)?;
        let took = start.elapsed();
        let paths = submission.task.paths();
        let result = self.read(submission);
        self.turn = (self.turn + 1) % IN_FLIGHT;
        match result {
            Ok(DispatchResult::Batch(_)) if waited => self.pace.learn(paths, took),
            Ok(DispatchResult::Batch(_)) => self.pace.learn_at_most(paths, took),
            // Its full duration is unknown.
            Ok(_) | Err(_) => {}
        }
        result
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

    /// Drains the buffers in flight, for another run.
    fn wait_for_all(&mut self, in_flight: VecDeque<(Submission, Instant)>) -> Result<(), GpuError> {
        for (submission, _) in in_flight {
            self.wait(&submission)?;
            // Reading the results unmaps their buffers.
            drop(self.read(submission));
            self.turn = (self.turn + 1) % IN_FLIGHT;
        }
        Ok(())
    }

    /// An empty batch for results of the slots from `first_slot`.
    fn empty_batch(&self, stride: Stride, first_slot: u32) -> SampleBatch {
        let payload = if self.sends_samples {
            Payload::Samples(Vec::new())
        } else if self.splatter.is_some() {
            Payload::Splats { first_slot, made: Vec::new(), band: Band::empty(), bright: Vec::new() }
        } else {
            Payload::sums(first_slot)
        };
        SampleBatch::empty(self.index, stride, payload)
    }

    /// Reads the results of the oldest dispatch.
    fn read(&self, submission: Submission) -> Result<DispatchResult, GpuError> {
        let unreadable = || self.device.failure("its results cannot be read");
        let (buffers, task) = (&self.buffers[self.turn], submission.task);
        let mut batch = self.empty_batch(task.stride, task.first_slot);
        (batch.paths, batch.completes) = (task.paths(), task.completes);
        let mut too_bright = None;
        match (&mut batch.payload, submission.output) {
            (Payload::Samples(samples), _) => {
                *samples = buffers
                    .samples(&task, |words| words.iter().map(readback::sample).collect())
                    .ok_or_else(unreadable)?;
            }
            (Payload::Splats { band, bright, .. }, DispatchOutput::Splats(empty, room)) => {
                *band = empty;
                match buffers.splats(band, room).ok_or_else(unreadable)? {
                    Ok(samples) => *bright = samples,
                    Err(samples) => too_bright = Some(samples),
                }
            }
            _ => {}
        }
        let whole =
            buffers.sums(&task, |words| self.read_slots(words, &task, &mut batch)).ok_or_else(unreadable)?;
        Ok(match too_bright {
            _ if !whole => DispatchResult::CutShort,
            Some(bright) => DispatchResult::TooBright(bright),
            None => DispatchResult::Batch(batch.into()),
        })
    }

    /// Adds the results of slots to a batch. Returns whether the driver let all of them run to their end.
    fn read_slots(&self, words: &[SlotSums], task: &Task, batch: &mut SampleBatch) -> bool {
        if words.iter().any(|words| words.rays == 0) {
            // An interrupted slot may hold anything.
            return false;
        }
        batch.rays = words.iter().map(|words| u64::from(words.rays)).sum();
        let (rejects, counts) = (&mut batch.rejects, &mut batch.reject_counts);
        let mut name = |slot, reject: Option<(u32, Reject)>, rejected: u32| {
            // The device returns the reason of a slot's first rejection.
            if let Some((_, why)) = reject {
                counts.add(why, u64::from(rejected));
            }
            if let Some((sample, why)) = reject
                && rejects.len() < NAMED_REJECTS
            {
                let pixel = self.region.pixel(task.stride.place(slot)).index;
                rejects.push((Traced { pixel, sample }, why));
            }
        };
        match &mut batch.payload {
            // The receiver rejects invalid samples.
            Payload::Samples(_) => {}
            Payload::Splats { made, bright, .. } => {
                made.reserve_exact(words.len());
                for (slot, words) in (task.first_slot..).zip(words) {
                    let read = readback::slot(words, task.samples);
                    made.push(Made { count: read.sums.count, rejected: read.sums.rejected });
                    name(slot, read.reject, read.sums.rejected);
                }
                // The receiver counts these.
                for sample in bright {
                    // The number of a stride's pixels before a pixel is that pixel's slot.
                    let slot = task.stride.len(self.region.place(sample.pixel));
                    made[(slot - task.first_slot) as usize].count -= 1;
                }
            }
            Payload::Sums { sums, wide, .. } => {
                sums.reserve_exact(words.len());
                for (slot, words) in (task.first_slot..).zip(words) {
                    let read = readback::slot(words, task.samples);
                    sums.push(read.sums);
                    wide.extend(read.wide.map(|sums| (slot, sums)));
                    name(slot, read.reject, read.sums.rejected);
                }
            }
        }
        true
    }
}
