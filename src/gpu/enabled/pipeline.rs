//! The program bound to a scene's tables, and the buffers of dispatches.

use super::device::Device;
use super::heap;
use super::layout::{Dispatch, MOST_BRANCHES, SampleWords, SlotSums, WaitingBranch};
use super::pace::Task;
use super::program::Program;
use super::readback::{self, splat_words};
use super::tables::Tables;
use crate::film::Band;
use crate::gpu::{GpuError, Job};
use crate::sampling::{Region, Sample};
use crate::scene::Integrator;
use bytemuck::Pod;
use crossbeam_channel::{Receiver, bounded};
use wgpu::util::DeviceExt;

/// The maximum size of the buffer of pending branches of `whitted`, in bytes.
const BRANCH_BYTES: u64 = 64 << 20;

/// A program with its tables.
pub(super) struct Pipeline {
    program: Program,
    tables: wgpu::BindGroup,
    /// The maximum number of workgroups in a dispatch.
    workgroups: u32,
}

pub(super) fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

impl Pipeline {
    /// Binds a program to a job's scene. The program must have been compiled for the scene's plan.
    pub(super) fn new(
        device: &Device,
        job: &Job<'_>,
        tables: &Tables,
        program: Program,
    ) -> Result<Pipeline, GpuError> {
        let dispatch_limits = program.dispatch_limits;
        let mut workgroups = dispatch_limits.workgroups;
        let mut branches = 1;
        if job.render.integrator == Integrator::Whitted {
            let a_group =
                u64::from(dispatch_limits.workgroup_size * MOST_BRANCHES) * size_of::<WaitingBranch>() as u64;
            let most = BRANCH_BYTES.min(device.description().max_binding) / a_group;
            workgroups = workgroups.min(most as u32).max(1);
            // A dispatch has at most one invocation per pixel of the region, and all of the buffer is zeroed.
            let groups = job.region.len().div_ceil(dispatch_limits.workgroup_size).clamp(1, workgroups);
            branches = u64::from(groups * dispatch_limits.workgroup_size * MOST_BRANCHES);
        }
        device.checked(|device| {
            let scene = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("scene"),
                contents: bytemuck::bytes_of(&tables.scene()),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE,
            });
            let pages = heap::upload(device, &tables.sections(), program.plan.paging);
            let branches = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("branches"),
                size: branches * size_of::<WaitingBranch>() as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            });
            let buffers: Vec<_> = [&scene, &branches].into_iter().chain(&pages).collect();
            let tables = bind(device, &program.tables, &buffers);
            Pipeline { program, tables, workgroups }
        })
    }
}

/// The buffers of one dispatch in flight.
pub(super) struct DispatchBuffers {
    dispatch: wgpu::Buffer,
    sums: Output,
    samples: Output,
    splats: Output,
    group: wgpu::BindGroup,
}

/// A buffer that the device writes, with a copy that the host reads.
struct Output {
    written: wgpu::Buffer,
    read: wgpu::Buffer,
}

impl Output {
    fn new(device: &wgpu::Device, label: &str, size: u64) -> Output {
        let buffer = |usage| {
            let label = Some(label);
            device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
        };
        Output {
            written: buffer(
                wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            ),
            read: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
        }
    }

    fn copy(&self, encoder: &mut wgpu::CommandEncoder, bytes: u64) {
        encoder.copy_buffer_to_buffer(&self.written, 0, &self.read, 0, bytes);
    }

    /// Requests that the first bytes are mapped. The answer tells whether they can be read.
    fn request_map(&self, bytes: u64) -> Receiver<bool> {
        let (sender, receiver) = bounded(1);
        self.read.map_async(wgpu::MapMode::Read, ..bytes, move |mapped| {
            let _ = sender.send(mapped.is_ok());
        });
        receiver
    }

    fn read_mapped<T: Pod, R>(&self, count: u64, work: impl FnOnce(&[T]) -> R) -> Option<R> {
        let view = self.read.get_mapped_range(..count * size_of::<T>() as u64).ok()?;
        let result = work(bytemuck::cast_slice(&view));
        drop(view);
        self.read.unmap();
        Some(result)
    }
}

/// The kind of output of a dispatch.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum DispatchOutput {
    /// Sums for each slot.
    Sums,
    /// All samples.
    Samples,
    /// Sums of a band's pixels, and the samples that are too bright for them, up to this number.
    Splats(Band, u32),
}

/// The capacity of the buffers of a dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Room {
    pub(super) slots: u32,
    /// The samples of a dispatch, or those that are too bright for a band.
    pub(super) samples: u32,
    pub(super) band_pixels: u32,
}

/// A dispatch in flight.
pub(super) struct Submission {
    pub(super) task: Task,
    pub(super) output: DispatchOutput,
    pub(super) index: wgpu::SubmissionIndex,
    answers: Vec<Receiver<bool>>,
}

impl Submission {
    /// Whether the device has finished.
    pub(super) fn is_done(&self) -> bool {
        self.answers.iter().all(|answer| !answer.is_empty())
    }

    /// Whether its results can be read.
    pub(super) fn is_readable(&self) -> bool {
        self.answers.iter().all(|answer| answer.try_recv() == Ok(true))
    }
}

const SUMS_BYTES: u64 = size_of::<SlotSums>() as u64;
const SAMPLE_BYTES: u64 = size_of::<SampleWords>() as u64;

fn splat_bytes(pixels: usize) -> u64 {
    (splat_words(pixels) * size_of::<u32>()) as u64
}

impl Pipeline {
    /// The maximum number of invocations of a dispatch.
    pub(super) fn invocations(&self) -> u32 {
        self.workgroups.saturating_mul(self.program.dispatch_limits.workgroup_size)
    }

    /// Buffers for dispatches of some capacity.
    pub(super) fn buffers(&self, device: &Device, room: Room) -> Result<DispatchBuffers, GpuError> {
        device.checked(|device| {
            let dispatch = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("dispatch"),
                size: size_of::<Dispatch>() as u64,
                usage: wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let sums = Output::new(device, "sums", u64::from(room.slots.max(1)) * SUMS_BYTES);
            let samples = Output::new(device, "samples", u64::from(room.samples.max(1)) * SAMPLE_BYTES);
            let splats = Output::new(device, "splats", splat_bytes(room.band_pixels.max(1) as usize));
            let buffers = [&dispatch, &sums.written, &samples.written, &splats.written];
            let group = bind(device, &self.program.tasks, &buffers);
            DispatchBuffers { dispatch, sums, samples, splats, group }
        })
    }

    /// Submits a task.
    pub(super) fn submit(
        &self,
        device: &Device,
        buffers: &DispatchBuffers,
        region: Region,
        task: Task,
        output: DispatchOutput,
    ) -> Submission {
        let workgroup_size = self.program.dispatch_limits.workgroup_size;
        let groups = task.slots.div_ceil(workgroup_size).min(self.workgroups);
        let mut outputs = vec![(&buffers.sums, u64::from(task.slots) * SUMS_BYTES)];
        let mut dispatch = Dispatch {
            stride_first: task.stride.first,
            stride_step: task.stride.step,
            stride_run: task.stride.run,
            first_slot: task.first_slot,
            slots: task.slots,
            invocations: groups * workgroup_size,
            first_sample: task.first_sample,
            samples: task.samples,
            sends_samples: u32::from(output == DispatchOutput::Samples),
            ..Dispatch::default()
        };
        match &output {
            DispatchOutput::Sums => {}
            DispatchOutput::Samples => outputs.push((&buffers.samples, task.paths() * SAMPLE_BYTES)),
            DispatchOutput::Splats(band, bright) => {
                // Positions are relative to the entire film.
                let [left, top] = band.corner();
                dispatch.band_left = (i64::from(region.x) + left) as i32;
                dispatch.band_top = (i64::from(region.y) + top) as i32;
                dispatch.band_width = band.width() as u32;
                dispatch.band_pixels = band.pixels() as u32;
                dispatch.most_bright = *bright;
                outputs.push((&buffers.splats, splat_bytes(band.pixels())));
                outputs.push((&buffers.samples, u64::from(*bright) * SAMPLE_BYTES));
            }
        }
        device.queue.write_buffer(&buffers.dispatch, 0, bytemuck::bytes_of(&dispatch));
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // Slots without an invocation must not hold old data.
        encoder.clear_buffer(&buffers.sums.written, 0, Some(u64::from(task.slots) * SUMS_BYTES));
        if let DispatchOutput::Splats(band, _) = &output {
            encoder.clear_buffer(&buffers.splats.written, 0, Some(splat_bytes(band.pixels())));
        }
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.program.pipeline);
            pass.set_bind_group(0, &self.tables, &[]);
            pass.set_bind_group(1, &buffers.group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        for (output, bytes) in &outputs {
            output.copy(&mut encoder, *bytes);
        }
        let index = device.queue.submit([encoder.finish()]);
        let answers = outputs.iter().map(|(output, bytes)| output.request_map(*bytes)).collect();
        Submission { task, output, index, answers }
    }
}

impl DispatchBuffers {
    /// Passes the sums of a finished task to `work`, once.
    pub(super) fn sums<R>(&self, task: &Task, work: impl FnOnce(&[SlotSums]) -> R) -> Option<R> {
        self.sums.read_mapped(u64::from(task.slots), work)
    }

    /// Passes the samples of a finished task to `work`, once.
    pub(super) fn samples<R>(&self, task: &Task, work: impl FnOnce(&[SampleWords]) -> R) -> Option<R> {
        self.samples.read_mapped(task.paths(), work)
    }

    /// Adds the sums of a finished task to its band, and returns the number of samples that were too bright for it,
    /// with these samples if all of them fitted.
    pub(super) fn splats(&self, band: &mut Band, room: u32) -> Option<Result<Vec<Sample>, u32>> {
        let words = splat_words(band.pixels()) as u64;
        let bright = self.splats.read_mapped(words, |words| readback::splats(words, band))?;
        self.samples.read_mapped(room.into(), |words: &[SampleWords]| match words.get(..bright as usize) {
            Some(words) => Ok(words.iter().map(readback::sample).collect()),
            None => Err(bright),
        })
    }

    /// Writes samples to the buffer from which a dispatch reads them.
    #[cfg(test)]
    pub(super) fn write_samples(&self, device: &Device, samples: &[SampleWords]) {
        device.queue.write_buffer(&self.samples.written, 0, bytemuck::cast_slice(samples));
    }
}
