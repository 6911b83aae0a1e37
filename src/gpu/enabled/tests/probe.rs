//! Runs a few lines of WGSL on a device, for many inputs at once.

use super::super::heap;
use super::super::layout::WaitingBranch;
use super::super::program::library;
use super::super::tables::Tables;
use super::super::variant::{ProgramPlan, ProgramVariant};
use super::Device;
use crate::scene::Integrator;
use wgpu::util::DeviceExt;

/// The library for some tables.
pub(super) fn library_for(device: &Device, tables: &Tables, integrator: Integrator) -> String {
    let plan = ProgramPlan::of(device, tables).unwrap();
    // The recorded functions define the random numbers.
    library(&ProgramVariant { integrator, workgroup_size: 64, plan })
}

/// Runs a few lines of WGSL on the device for each input. They read words with `word(i)`, floats with `float(i)` and
/// three floats with `float3(i)`, and write words with `put(i, …)`. The tables are those of a path tracer.
pub(super) fn probe<const IN: usize, const OUT: usize>(
    device: &Device,
    lines: &str,
    inputs: &[[u32; IN]],
    tables: &Tables,
) -> Vec<[u32; OUT]> {
    let library = library_for(device, tables, Integrator::Path);
    let words = run(device, &library, lines, [IN, OUT], inputs.as_flattened(), tables);
    words.chunks_exact(OUT).map(|chunk| chunk.try_into().unwrap()).collect()
}

/// The same with a given library, for inputs and outputs of given numbers of words.
pub(super) fn run(
    device: &Device,
    library: &str,
    lines: &str,
    [words_in, words_out]: [usize; 2],
    inputs: &[u32],
    tables: &Tables,
) -> Vec<u32> {
    let count = inputs.len() / words_in;
    let source = format!(
        "{library}
@group(2) @binding(0) var<storage, read> inputs: array<u32>;
@group(2) @binding(1) var<storage, read_write> outputs: array<u32>;
var<private> at: u32;
fn word(i: u32) -> u32 {{ return inputs[at * {words_in}u + i]; }}
fn float(i: u32) -> f32 {{ return bitcast<f32>(word(i)); }}
fn float3(i: u32) -> vec3f {{ return vec3f(float(i), float(i + 1u), float(i + 2u)); }}
fn put(i: u32, value: u32) {{ outputs[at * {words_out}u + i] = value; }}
fn put_float(i: u32, value: f32) {{ put(i, bitcast<u32>(value)); }}
fn put_float3(i: u32, v: vec3f) {{ put_float(i, v.x); put_float(i + 1u, v.y); put_float(i + 2u, v.z); }}
@compute @workgroup_size(WORKGROUP_SIZE)
fn probe(@builtin(global_invocation_id) id: vec3u) {{
    at = id.x;
    if at < {count}u {{
        // Every buffer is named, so that the layout contains all of them.
        let all = scene.seed + heap_word(0u).x + arrayLength(&branches) + arrayLength(&inputs);
        if all == 0u {{ return; }}
        {lines}
    }}
}}"
    );
    let gpu = &device.device;
    let run = device.checked(|gpu| {
        let init = |contents: &[u8], usage| {
            gpu.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let storage = wgpu::BufferUsages::STORAGE;
        let size = (count * words_out * 4) as u64;
        let empty = |usage| {
            gpu.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let scene = init(bytemuck::bytes_of(&tables.scene()), wgpu::BufferUsages::UNIFORM | storage);
        let branches = init(bytemuck::bytes_of(&WaitingBranch::default()), storage);
        let mut buffers = vec![scene, branches];
        buffers.extend(heap::upload(
            gpu,
            &tables.sections(),
            ProgramPlan::of(device, tables).unwrap().paging,
        ));
        let written = empty(storage | wgpu::BufferUsages::COPY_SRC);
        let read = empty(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let io = [init(bytemuck::cast_slice(inputs), storage), written.clone()];
        let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: Some("probe"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let group = |index, buffers: &[wgpu::Buffer]| {
            let entries: Vec<_> = (0..)
                .zip(buffers)
                .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
                .collect();
            gpu.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(index),
                entries: &entries,
            })
        };
        let mut encoder = gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group(0, &buffers), &[]);
            pass.set_bind_group(2, &group(2, &io), &[]);
            pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&written, 0, &read, 0, size);
        device.queue.submit([encoder.finish()]);
        // If it fails, `checked` has the reason.
        read.map_async(wgpu::MapMode::Read, .., |_| ());
        read
    });
    let read = run.unwrap();
    gpu.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = read.get_mapped_range(..).unwrap();
    bytemuck::cast_slice(&view).to_vec()
}
