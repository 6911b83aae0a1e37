//! Programs on a device, compared with the same code with `F = f32`.

use super::super::*;
use super::random::Random;
use super::{BY_HAND, Scene, valid};
use crate::gpu::GpuError;
use crate::gpu::enabled::device::Device;
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Float, Frame, Mask, Uint, Vec3, function, trig};
use wgpu::util::DeviceExt;

/// A function from four floats and four words to as many.
pub(super) trait Case {
    fn run<F: Float>(&self, scene: &Scene, x: [F; 4], w: [F::Uint; 4]) -> ([F; 4], [F::Uint; 4]);
}

/// A device; `None` on a machine without one, where that is allowed.
fn device() -> Option<Device> {
    match Device::open(None) {
        Ok(device) => Some(device),
        Err(GpuError::NoAdapter) if std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1") => {
            println!("skipped: no GPU adapter");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// The outputs of a function of the program for each input.
fn outputs(device: &Device, scene: &Scene, text: &str, case: &str, inputs: &[[u32; 8]]) -> Vec<[u32; 8]> {
    let source = format!(
        "{BY_HAND}
{text}
@group(0) @binding(3) var<storage, read> inputs: array<vec4u>;
@group(0) @binding(4) var<storage, read_write> outputs: array<vec4u>;
@compute @workgroup_size(64)
fn run(@builtin(global_invocation_id) id: vec3u) {{
    let at = id.x * 2u;
    if at < arrayLength(&inputs) {{
        let result = {case}(bitcast<vec4f>(inputs[at]), inputs[at + 1u]);
        outputs[at] = bitcast<vec4u>(result.first);
        outputs[at + 1u] = result.second;
    }}
}}"
    );
    let mut numbers = scene.eye.map(f32::to_bits).to_vec();
    numbers.extend([scene.near.to_bits(), scene.seed, 0, 0, 0]);
    let row = |i: usize| {
        let [x, y, z] = [0, 1, 2].map(|c: usize| scene.origin[c][i].to_bits());
        [x, y, z, scene.radius[i].to_bits(), scene.kind[i], 0, 0, 0]
    };
    let rows: Vec<u32> = (0..scene.kind.len()).flat_map(row).collect();
    let gpu = &device.device;
    let size = (inputs.len() * 32) as u64;
    let read = device.checked(|gpu| {
        let init = |contents: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE;
            gpu.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let empty = |usage| {
            gpu.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let written = empty(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let read = empty(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        let module = gpu.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let entry = |binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: binding < 4 },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = gpu.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[0, 1, 2, 3, 4].map(entry),
        });
        let pipeline_layout = gpu.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = gpu.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("run"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let buffers = [
            init(bytemuck::cast_slice(&numbers)),
            init(bytemuck::cast_slice(&rows)),
            init(bytemuck::cast_slice(&scene.offsets)),
            init(bytemuck::cast_slice(inputs)),
            written.clone(),
        ];
        let entries = (0..).zip(&buffers);
        let entries: Vec<_> = entries
            .map(|(binding, b)| wgpu::BindGroupEntry { binding, resource: b.as_entire_binding() })
            .collect();
        let group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        let mut encoder = gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&written, 0, &read, 0, size);
        device.queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
        read
    });
    let read = read.unwrap();
    gpu.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = read.get_mapped_range(..).unwrap();
    let words: &[u32] = bytemuck::cast_slice(&view);
    words.chunks_exact(8).map(|chunk| chunk.try_into().unwrap()).collect()
}

/// Words of all magnitudes; every other input consists of floats within ±8.
fn inputs(count: u32) -> Vec<[u32; 8]> {
    let word = |i: u32, j: u32| crate::sampling::independent::pcg4d::<f32>([i, j, 3, 5].map(Wrapping))[0].0;
    let input = |i: u32| {
        std::array::from_fn(|j| {
            let word = word(i, j as u32);
            if j < 4 { ((word >> 8) as f32 / 1_048_576.0 - 8.0).to_bits() } else { word }
        })
    };
    (0..count).map(input).collect()
}

fn leaked(name: String, parameters: &'static [&'static str]) -> &'static Function {
    Box::leak(Box::new(Function { name: name.leak(), parameters, module: "stride::cases" }))
}

/// The differences of a device's results from the CPU's: the first difference of each case.
fn differences<C: Case>(device: &Device, record: &[C], run: &[C]) -> Vec<String> {
    let scene = Scene::new();
    let mut differences = Vec::new();
    for (i, (record, run)) in record.iter().zip(run).enumerate() {
        let mut recording = scene.recording();
        recording.function(leaked("run_case".to_owned(), &["x", "w"]), |(x, w)| {
            record.run::<RecordedFloat>(&scene, x, w)
        });
        let text = valid(recording);
        let inputs = inputs(256);
        for (input, out) in inputs.iter().zip(outputs(device, &scene, &text, "run_case", &inputs)) {
            let [x, w] = [0, 4].map(|from| std::array::from_fn::<u32, 4, _>(|i| input[from + i]));
            let (x, w) = run.run::<f32>(&scene, x.map(f32::from_bits), w.map(Wrapping));
            let floats: [f32; 4] = std::array::from_fn(|i| f32::from_bits(out[i]));
            let is_close = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-6 * b.abs().max(1.0);
            if !floats.iter().zip(&x).all(is_close) || out[4..] != w.map(|w| w.0) {
                differences.push(format!("case {i}: {floats:?} {:?}, not {x:?} {w:?}\n{text}", &out[4..]));
                break;
            }
        }
    }
    differences
}

#[test]
fn random_programs_agree_with_lanes() {
    let Some(device) = device() else { return };
    let functions = [leaked("first".to_owned(), &PARAMETERS), leaked("second".to_owned(), &PARAMETERS)];
    let cases: Vec<_> = (0..300).map(|seed| Random { seed, functions }).collect();
    let found = differences(&device, &cases, &cases);
    assert!(found.is_empty(), "{} programs differ; {}", found.len(), found[0]);
    // Negative control: programs other than those that ran differ.
    let others: Vec<_> = (1000..1004).map(|seed| Random { seed, functions }).collect();
    assert_eq!(differences(&device, &cases[..4], &others).len(), 4);
}

const PARAMETERS: [&str; 5] = ["x", "words", "marked", "mask", "rest"];

/// Typical code of paths: frames, angles, loops, structures and calls, with rounding.
struct Rounded;

impl Case for Rounded {
    fn run<F: Float>(&self, scene: &Scene, x: [F; 4], w: [F::Uint; 4]) -> ([F; 4], [F::Uint; 4]) {
        let direction = Vec3::new(x[0], x[1], x[2] + 9.0).normalized();
        let frame = Frame::around(direction);
        let (sin, cos) = trig::sin_cos_turns(w[0].to_unit());
        let local = frame.to_local(Vec3::new(sin, cos, F::splat(0.5)) + Vec3::given(&scene.eye));
        let turns = trig::angle_turns(local.y, local.x);
        let index = w[1] & F::Uint::splat(3);
        let node = F::gather(&scene.offsets, index);
        let size = function!(F, size(local, node), {
            F::fork(local.z.lt(F::zero()), || local.length() * 0.5, || local.max_abs() + node)
        });
        let root = F::repeat(Mask::splat(true), (F::Uint::splat(0), size), |(i, y)| {
            let i = i + F::Uint::splat(1);
            ((i, (y + size / y) * 0.5), i.lt(index))
        });
        (
            [turns * 0.125, root.1, size.copysign(local.x), (local.z * 0.125).floor()],
            [root.0, w[0], w[1], index],
        )
    }
}

#[test]
fn typical_programs_agree_with_lanes() {
    let Some(device) = device() else { return };
    let found = differences(&device, &[Rounded], &[Rounded]);
    assert!(found.is_empty(), "{}", found[0]);
}
