//! Function by function: the WGSL against the CPU's scalar code, over thousands of inputs.

mod lights;

use super::super::heap;
use super::super::layout::{Branch, LightNode, Scene, Surface};
use super::super::program::library;
use super::super::tables::{LightColumns, Tables, Weights, light_rows, light_tables, material_rows, surface};
use super::super::tree::Tree;
use super::super::variant::{Plan, Variant};
use super::{Device, device};
use crate::film::reject::check;
use crate::film::{MAX_RADIANCE, PixelSums};
use crate::light::{AreaLight, LightTable, PointLight, Triangle};
use crate::material::{
    Bxdf, CheckerboardParameters, Dielectric, GlassParameters, MaterialParameters, MaterialTable,
    MatteParameters, TransportMode,
};
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Frame, Ray, Rgb, Vec3, trig};
use crate::sampling::independent::pcg4d;
use crate::sampling::{Block, Independent, PathId, Sobol, Stream, warp};
use crate::scene::{FilmMode, Filter, Integrator, Sampler};
use crate::shape::{self, Cylinder, Disk, Plane, Quad, Shape, Sphere, offset_origin};
use crate::world::SurfaceTable;
use glam::DVec3;
use rand::RngExt;
use wgpu::util::DeviceExt;

/// Runs a few lines of WGSL on the device for each input. They read words with `word(i)`, floats with
/// `float(i)` and three floats with `float3(i)`, and write words with `put(i, …)`.
pub(super) fn probe<const IN: usize, const OUT: usize>(
    device: &Device,
    lines: &str,
    inputs: &[[u32; IN]],
    tables: &Tables,
) -> Vec<[u32; OUT]> {
    let plan = Plan::of(device, tables).unwrap();
    let source = format!(
        "{}
@group(2) @binding(0) var<storage, read> inputs: array<u32>;
@group(2) @binding(1) var<storage, read_write> outputs: array<u32>;
var<private> at: u32;
fn word(i: u32) -> u32 {{ return inputs[at * {IN}u + i]; }}
fn float(i: u32) -> f32 {{ return bitcast<f32>(word(i)); }}
fn float3(i: u32) -> vec3f {{ return vec3f(float(i), float(i + 1u), float(i + 2u)); }}
fn put(i: u32, value: u32) {{ outputs[at * {OUT}u + i] = value; }}
fn put_float(i: u32, value: f32) {{ put(i, bitcast<u32>(value)); }}
fn put_float3(i: u32, v: vec3f) {{ put_float(i, v.x); put_float(i + 1u, v.y); put_float(i + 2u, v.z); }}
@compute @workgroup_size(WORKGROUP_SIZE)
fn probe(@builtin(global_invocation_id) id: vec3u) {{
    at = id.x;
    if at < {count}u {{
        // Every table is named, so that the layout has them all.
        let all = scene.seed + heap_word(0u).x + arrayLength(&branches);
        if all == 0u {{ return; }}
        {lines}
    }}
}}",
        library(Variant { integrator: Integrator::Path, sampler: Sampler::Sobol, workgroup_size: 64, plan }),
        count = inputs.len(),
    );
    let gpu = &device.device;
    let run = device.checked(|gpu| {
        let init = |contents: &[u8], usage| {
            gpu.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let storage = wgpu::BufferUsages::STORAGE;
        let size = (inputs.len() * OUT * 4) as u64;
        let empty = |usage| {
            gpu.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let scene = init(bytemuck::bytes_of(&tables.scene()), wgpu::BufferUsages::UNIFORM);
        let branches = init(bytemuck::bytes_of(&Branch::default()), storage);
        let mut buffers = vec![scene, branches];
        buffers.extend(heap::upload(gpu, &tables.sections(), plan.paging));
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
            pass.dispatch_workgroups(inputs.len().div_ceil(64) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&written, 0, &read, 0, size);
        device.queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
        read
    });
    let read = run.unwrap();
    gpu.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = read.get_mapped_range(..).unwrap();
    let words: &[u32] = bytemuck::cast_slice(&view);
    words.chunks_exact(OUT).map(|chunk| chunk.try_into().unwrap()).collect()
}

/// A scene of nothing: a surface and a node of lights, which no probe reads unless it has its own.
fn nothing() -> Tables {
    Tables {
        scene: Scene { seed: 7, ..Scene::default() },
        surfaces: vec![Surface::default()],
        materials: Vec::new(),
        lights: Vec::new(),
        light_nodes: vec![LightNode::default()],
        tree: Tree::default(),
        weights: Weights::default(),
    }
}

fn simple<const IN: usize, const OUT: usize>(
    device: &Device,
    lines: &str,
    inputs: &[[u32; IN]],
) -> Vec<[u32; OUT]> {
    probe(device, lines, inputs, &nothing())
}

/// Words that look random and are the same in every run.
fn words<const N: usize>(count: u32) -> Vec<[u32; N]> {
    let word = |i: u32, j: usize| pcg4d::<f32>([i, j as u32, 11, 5].map(Wrapping))[0].0;
    (0..count).map(|i| std::array::from_fn(|j| word(i, j))).collect()
}

pub(super) fn units<const N: usize>(count: u32) -> Vec<[f32; N]> {
    words(count).into_iter().map(|w: [u32; N]| w.map(|w| (w >> 8) as f32 / 16_777_216.0)).collect()
}

pub(super) fn bits<const N: usize>(floats: &[[f32; N]]) -> Vec<[u32; N]> {
    floats.iter().map(|f| f.map(f32::to_bits)).collect()
}

#[track_caller]
pub(super) fn close(got: u32, expected: f32, bound: f32, at: &dyn std::fmt::Debug) {
    let got = f32::from_bits(got);
    assert!((got - expected).abs() <= bound, "{got} is not {expected} at {at:?}");
}

/// Within so many units in the last place of one: WGSL's roots and quotients may be off by a few.
pub(super) const ULP: f32 = f32::EPSILON / 2.0;

fn vec3([x, y, z]: [f32; 3]) -> Vec3<f32> {
    Vec3::new(x, y, z)
}

/// Points within ±4, normals, and four numbers.
fn places() -> Vec<[f32; 9]> {
    let place = |u: [f32; 7]| {
        let [x, y, z] = [u[0], u[1], u[2]].map(|u| u * 8.0 - 4.0);
        let n = warp::uniform_sphere([u[3], u[4]]);
        [x, y, z, n.x, n.y, n.z, u[5], u[6], u[3]]
    };
    units::<7>(20_000).into_iter().map(place).collect()
}

#[test]
fn random_numbers_have_the_same_bits() {
    let Some(device) = device() else { return };
    let inputs = words::<4>(20_000);
    let lines = "let v = pcg4d(vec4u(word(0u), word(1u), word(2u), word(3u)));
        put(0u, v.x); put(1u, v.y); put(2u, v.z); put(3u, v.w);
        let id = PathId(word(0u), word(1u));
        let u = draw_independent(id, block_at(BLOCK_LIGHT, 3u));
        put_float(4u, u.x); put_float(5u, u.y); put_float(6u, u.z); put_float(7u, u.w);
        let s = draw(id, block_at(BLOCK_SCATTER, word(2u) & 255u));
        put_float(8u, s.x); put_float(9u, s.y); put_float(10u, s.z); put_float(11u, s.w);
        var stream = fresh_stream();
        for (var i = 12u; i < 22u; i++) { put_float(i, next_random(&stream, id)); }";
    for (input, output) in inputs.iter().zip(simple::<4, 22>(&device, lines, &inputs)) {
        assert_eq!(output[..4], pcg4d::<f32>(input.map(Wrapping)).map(|w| w.0));
        let path = PathId::<f32> { pixel: Wrapping(input[0]), sample: Wrapping(input[1]) };
        let block = Block::LIGHT.at::<f32>(Wrapping(3));
        let expected: [f32; 4] = Independent { seed: 7 }.draw(path, block);
        assert_eq!(output[4..8], expected.map(f32::to_bits));
        let block = Block::SCATTER.at::<f32>(Wrapping(input[2] & 255));
        let expected: [f32; 4] = Sobol { seed: 7 }.draw(path, block);
        assert_eq!(output[8..12], expected.map(f32::to_bits));
        let mut stream = Stream::new(7, input[0], input[1]);
        let expected: [f32; 10] = std::array::from_fn(|_| stream.random());
        assert_eq!(output[12..], expected.map(f32::to_bits));
    }
}

#[test]
fn angles_and_warps_agree() {
    let Some(device) = device() else { return };
    let mut inputs = units::<2>(20_000);
    inputs.extend([[0.0, 0.0], [1.0, 1.0], [0.25, 0.5], [0.5, 0.75], [1.0 - ULP, 1.0 - ULP]]);
    let lines = "let u = vec2f(float(0u), float(1u));
        let sc = sin_cos_turns(u.y); put_float(0u, sc.x); put_float(1u, sc.y);
        put_float(2u, tent(u.x));
        let d = disk(u); put_float(3u, d.x); put_float(4u, d.y);
        put_float3(5u, cosine_hemisphere(u));
        let s = u * 2.0 - 1.0; put_float(8u, angle_turns(s.y, s.x));
        put_float3(9u, uniform_sphere(u)); put_float(12u, cosine_hemisphere_pdf(s.x));";
    for (u, out) in inputs.iter().zip(simple::<2, 13>(&device, lines, &bits(&inputs))) {
        let (sin, cos) = trig::sin_cos_turns(u[1]);
        close(out[0], sin, 4.0 * ULP, u);
        close(out[1], cos, 4.0 * ULP, u);
        close(out[2], warp::tent(u[0]), 6.0 * ULP, u);
        let (x, y) = warp::disk(*u);
        close(out[3], x, 8.0 * ULP, u);
        close(out[4], y, 8.0 * ULP, u);
        let w = warp::cosine_hemisphere(*u);
        (0..3).for_each(|i| close(out[5 + i], [w.x, w.y, w.z][i], 8.0 * ULP, u));
        let [x, y] = u.map(|u| u * 2.0 - 1.0);
        close(out[8], trig::angle_turns(y, x), 4.0 * ULP, u);
        let w = warp::uniform_sphere(*u);
        (0..3).for_each(|i| close(out[9 + i], [w.x, w.y, w.z][i], 8.0 * ULP, u));
        close(out[12], warp::cosine_hemisphere_pdf(x), 2.0 * ULP, u);
    }
}

#[test]
fn frames_and_offsets_agree() {
    let Some(device) = device() else { return };
    let mut inputs: Vec<[f32; 6]> = units::<6>(10_000)
        .into_iter()
        .map(|u| {
            let n = warp::uniform_sphere([u[0], u[1]]);
            let d = warp::uniform_sphere([u[2], u[3]]);
            [n.x, n.y, n.z, d.x, d.y, d.z]
        })
        .collect();
    inputs.extend([[0.0, 0.0, 1.0, 0.6, 0.0, 0.8], [0.0, 0.0, -1.0, 0.6, 0.0, 0.8]]);
    inputs.push([0.0, -0.0, -0.0, 1.0, 0.0, 0.0]);
    inputs.last_mut().unwrap()[0] = 1.0;
    let lines = "let frame = frame_around(float3(0u));
        put_float3(0u, frame.s); put_float3(3u, frame.t);
        put_float3(6u, to_world(frame, float3(3u))); put_float3(9u, to_local(frame, float3(3u)));
        put_float3(12u, offset_origin(vec3f(1.0, -2.0, 3.0), float3(0u), 0.25, float3(3u)));";
    for (input, out) in inputs.iter().zip(simple::<6, 15>(&device, lines, &bits(&inputs))) {
        let [nx, ny, nz, dx, dy, dz] = *input;
        let (n, d) = (Vec3::new(nx, ny, nz), Vec3::new(dx, dy, dz));
        let frame = Frame::around(n);
        let moved = offset_origin(Vec3::new(1.0, -2.0, 3.0), n, 0.25, d);
        let expected = [frame.s, frame.t, frame.to_world(d), frame.to_local(d), moved];
        for (i, v) in expected.iter().enumerate() {
            // Near the pole of the frame, 1/(1 + n_z) magnifies a rounding of n_z; none comes closer here
            // than a thousandth.
            let bound = if i == 4 { 8.0 * ULP } else { 24.0 * ULP };
            // Where d lies in the surface to rounding, either side will do.
            if i < 4 || n.dot(d).abs() > 1e-6 {
                [v.x, v.y, v.z].iter().zip(&out[3 * i..]).for_each(|(e, o)| close(*o, *e, bound, input));
            }
        }
    }
}

#[test]
fn shapes_are_met_where_the_cpu_meets_them() {
    let Some(device) = device() else { return };
    let plane = Plane { normal: [0.48, -0.6, 0.64], distance: -1.5 };
    let sphere = Sphere::new(glam::DVec3::new(0.5, -1.0, 2.0), 1.75);
    let quad = Quad::new(DVec3::new(-1.0, -2.0, 1.0), DVec3::new(4.0, 0.5, 0.0), DVec3::new(0.0, 1.0, 3.0));
    let disk = Disk::new(DVec3::new(0.5, 0.2, -1.0), DVec3::new(0.36, 0.48, 0.8), 2.5);
    let cylinder = Cylinder::new(DVec3::new(-2.0, 1.0, -1.0), DVec3::new(1.0, 2.5, 1.0), 1.2);
    let mut table = SurfaceTable::default();
    let look = crate::world::Look {
        material: 0,
        emission: [0.0; 3],
        flip_normal: true,
        entity: 0,
        light: crate::light::NO_LIGHT,
    };
    let common = [plane.surface(), sphere.surface(), quad.surface()];
    let common = common.map(|surface| table.push(surface, look));
    let rare = [disk.into(), cylinder.into()].map(|shape| table.push_rare(shape, look));
    let rows: Vec<_> = common.into_iter().chain(rare).map(|row| surface(&table, row).unwrap()).collect();
    let mut inputs = Vec::new();
    for u in units::<5>(20_000) {
        let o = [u[0], u[1], u[2]].map(|u| u * 8.0 - 4.0);
        let d = warp::uniform_sphere([u[3], u[4]]);
        inputs.push([o[0], o[1], o[2], d.x, d.y, d.z]);
    }
    let lines = "let ray = Ray(float3(0u), float3(3u));
        var t = array<f32, 5>(plane_intersect(surface_at(0u), ray), sphere_intersect(surface_at(1u), ray),
            quad_intersect(surface_at(2u), ray), rare_intersect(surface_at(3u), ray),
            rare_intersect(surface_at(4u), ray));
        for (var i = 0u; i < 5u; i++) {
            put_float(i, t[i]);
            if t[i] < NOTHING {
                let point = surface_point(ray, Hit(t[i], i, i, NO_INSTANCE));
                put_float3(5u + 9u * i, point.p); put_float3(8u + 9u * i, point.n);
                put_float(11u + 9u * i, point.error);
                let uv = surface_uv(point); put_float(12u + 9u * i, uv.x); put_float(13u + 9u * i, uv.y);
            }
        }";
    let scene = Scene { rare_end: 5, ..nothing().scene };
    let tables = Tables { surfaces: rows, scene, ..nothing() };
    let outputs = probe::<6, 50>(&device, lines, &bits(&inputs), &tables);
    let (mut met, mut doubtful) = ([0; 5], 0);
    for (input, out) in inputs.iter().zip(outputs) {
        let [ox, oy, oz, dx, dy, dz] = *input;
        let ray = Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
        let expected = [
            plane.intersect(&ray),
            sphere.intersect(&ray),
            quad.intersect(&ray),
            disk.intersect(&ray),
            cylinder.intersect(&ray),
        ];
        for i in 0..5 {
            let got = f32::from_bits(out[i]);
            if (expected[i] < shape::NOTHING) != (got < f32::MAX) {
                doubtful += 1;
                continue;
            }
            if expected[i] == shape::NOTHING {
                continue;
            }
            met[i] += 1;
            // The condition of the problem: how a rounding along the surface shows along the ray.
            let hit = crate::world::Hit {
                t: expected[i],
                surface: Wrapping(i as u32),
                ..crate::world::Hit::none()
            };
            let point = table.point(&ray, &hit);
            let steep = 1.0 / point.n.dot(ray.d).abs().max(1e-4);
            let size = 8.0 + expected[i];
            close(out[i], expected[i], 16.0 * ULP * size * steep, input);
            let [u, v] = table.uv(&point, true);
            let (p, n) = (point.p, point.n);
            let moved = 32.0 * ULP * size * steep;
            let at = 5 + 9 * i;
            [p.x, p.y, p.z].iter().zip(&out[at..]).for_each(|(e, o)| close(*o, *e, moved, input));
            [n.x, n.y, n.z].iter().zip(&out[at + 3..]).for_each(|(e, o)| close(*o, *e, moved, input));
            // The share of round surfaces and cylinders is larger on purpose.
            let [is_flat, is_sphere, is_disk, is_cylinder] =
                [[0, 2], [1; 2], [3; 2], [4; 2]].map(|of| of.contains(&i));
            let own_error = table.rows()[i].0.error;
            let error = point.error + if is_sphere || is_cylinder { own_error } else { 0.0 };
            close(out[at + 6], error, 0.01 * error, input);
            // φ turns fast near the sphere's poles and a disk's middle, and jumps where it comes round.
            let is_fast = (is_sphere && n.z.abs() >= 0.99) || (is_disk && v < 0.05);
            let jumps = !is_flat && (u - 0.5).abs() > 0.49;
            if !is_fast && !jumps {
                close(out[at + 7], u, 8.0 * moved, input);
                close(out[at + 8], v, 4.0 * moved, input);
            }
        }
    }
    assert!(met.iter().all(|&n| n > 500), "too few hits: {met:?}");
    assert!(doubtful <= 8, "{doubtful} hits are seen by one side only");
}

#[test]
fn checkerboards_choose_the_same_materials() {
    let Some(device) = device() else { return };
    let rows = vec![
        MatteParameters { reflectance: [0.1; 3] }.row(),
        MatteParameters { reflectance: [0.2; 3] }.row(),
        CheckerboardParameters { even: 0, odd: 1, checks_per_unit: [8.0, 4.0] }.row(),
        CheckerboardParameters { even: 2, odd: 1, checks_per_unit: [1.0, 2.0] }.row(),
        CheckerboardParameters { even: 3, odd: 2, checks_per_unit: [0.5, 0.25] }.row(),
    ];
    let table = MaterialTable::new(rows);
    let materials = material_rows(&table).packed();
    // Powers of two: no product is rounded, so that none may differ.
    let inputs: Vec<[f32; 2]> = units::<2>(20_000).into_iter().map(|u| u.map(|u| u * 16.0 - 8.0)).collect();
    let lines =
        "for (var row = 0u; row < 5u; row++) { put(row, resolve(row, vec2f(float(0u), float(1u)))); }";
    let outputs = probe::<2, 5>(&device, lines, &bits(&inputs), &Tables { materials, ..nothing() });
    for (uv, out) in inputs.iter().zip(outputs) {
        let expected = [0, 1, 2, 3, 4].map(|row| table.resolve::<f32>(Wrapping(row), *uv).0.0);
        assert_eq!(out, expected, "at {uv:?}");
    }
}

#[test]
fn glass_parts_light_as_on_the_cpu() {
    let Some(device) = device() else { return };
    let (reflectance, transmittance) = ([1.0, 0.9, 0.8], [0.5, 0.6, 0.7]);
    let row =
        GlassParameters { ior: 1.5, reflectance: [1.0, 0.9, 0.8], transmittance: [0.5, 0.6, 0.7] }.row();
    let glass = Dielectric {
        ior: 1.5_f32,
        reflectance: Rgb::splat(reflectance),
        transmittance: Rgb::splat(transmittance),
    };
    let inputs: Vec<[f32; 4]> = units::<3>(20_000)
        .into_iter()
        .map(|u| {
            let wo = warp::uniform_sphere([u[0], u[1]]);
            [wo.x, wo.y, wo.z, u[2]]
        })
        .collect();
    let lines = "let s = bsdf_sample(material_at(0u), float3(0u), vec2f(0.5), float(3u));
        put_float3(0u, s.wi); put_float3(3u, s.weight);
        put_float(6u, s.pdf); put(7u, u32(s.delta));
        put_float(8u, bsdf_eta2_scale(material_at(0u), float3(0u), true));
        let ways = dielectric_branches(material_at(0u), float3(0u));
        put_float(9u, ways.fresnel); put_float(10u, ways.transmitted);";
    let materials = material_rows(&MaterialTable::new(vec![row])).packed();
    let tables = Tables { materials, ..nothing() };
    let outputs = probe::<4, 11>(&device, lines, &bits(&inputs), &tables);
    let mut doubtful = 0;
    for (input, out) in inputs.iter().zip(outputs) {
        let wo = vec3([input[0], input[1], input[2]]);
        let expected = glass.sample(wo, [0.5; 2], input[3], TransportMode::Radiance);
        if (f32::from_bits(out[2]) > 0.0) != (expected.wi.z > 0.0) {
            doubtful += 1;
            continue;
        }
        let wi = expected.wi;
        // Near the critical angle the cosine of refraction is a root of what is left after cancellation.
        let bound = 16.0 * ULP / wi.z.abs().max(1e-3);
        [wi.x, wi.y, wi.z].iter().zip(&out).for_each(|(e, o)| close(*o, *e, bound, input));
        let w = expected.weight;
        [w.r, w.g, w.b].iter().zip(&out[3..]).for_each(|(e, o)| close(*o, *e, 1e-5, input));
        close(out[6], expected.pdf, 1e-5, input);
        assert_eq!(out[7], 1);
        let eta = if wo.z >= 0.0 { 1.5 } else { 1.0 / 1.5 };
        close(out[8], eta * eta, 1e-6, input);
        let [reflected, refracted] = glass.branches(wo, TransportMode::Radiance);
        close(out[9], reflected.chance, 1e-5, input);
        close(out[9], reflected.weight.r / reflectance[0], 1e-5, input);
        close(out[10], refracted.weight.r / transmittance[0], 1e-5, input);
    }
    assert!(doubtful <= 3, "{doubtful} samples take different branches");
}

#[test]
fn matte_scatters_as_on_the_cpu() {
    let Some(device) = device() else { return };
    let row = MatteParameters { reflectance: [0.75, 0.5, 0.25] }.row();
    let matte = crate::material::Lambertian { reflectance: Rgb::<f32>::splat(row.colour) };
    let lines = "let s = bsdf_sample(material_at(0u), float3(0u), vec2f(float(6u), float(7u)), 0.5);
        put_float3(0u, s.wi); put_float3(3u, s.weight); put_float(6u, s.pdf); put(7u, u32(s.delta));
        put_float3(8u, bsdf_eval(material_at(0u), float3(0u), float3(3u)));
        put_float(11u, bsdf_pdf(material_at(0u), float3(0u), float3(3u)));
        put_float(12u, power_heuristic(float(6u), float(7u)));";
    // The first three are a direction here.
    let inputs: Vec<_> = places()
        .into_iter()
        .map(|[x, y, z, nx, ny, nz, u, v, w]| {
            let d = vec3([x, y, z]).normalized();
            [d.x, d.y, d.z, nx, ny, nz, u, v, w]
        })
        .collect();
    let materials = material_rows(&MaterialTable::new(vec![row])).packed();
    let tables = Tables { materials, ..nothing() };
    for (input, out) in inputs.iter().zip(probe::<9, 13>(&device, lines, &bits(&inputs), &tables)) {
        let [x, y, z, nx, ny, nz, u, v, _] = *input;
        let (wo, wi) = (vec3([x, y, z]), vec3([nx, ny, nz]));
        let s = matte.sample(wo, [u, v], 0.5, TransportMode::Radiance);
        [s.wi.x, s.wi.y, s.wi.z].iter().zip(&out).for_each(|(e, o)| close(*o, *e, 8.0 * ULP, input));
        assert_eq!(out[3..6], row.colour.map(f32::to_bits));
        close(out[6], s.pdf, 4.0 * ULP, input);
        assert_eq!(out[7], 0);
        let f = matte.eval(wo, wi, TransportMode::Radiance);
        [f.r, f.g, f.b].iter().zip(&out[8..]).for_each(|(e, o)| close(*o, *e, 2.0 * ULP, input));
        close(out[11], matte.pdf(wo, wi), 2.0 * ULP, input);
        let ratio = f64::from(v) / f64::from(u);
        close(out[12], (1.0 / (ratio * ratio + 1.0)) as f32, 16.0 * ULP, input);
    }
}

#[test]
fn cameras_send_the_same_rays() {
    let Some(device) = device() else { return };
    for filter in [Filter::Tent { radius: 1.0 }, Filter::Gaussian { radius: 1.5, sigma: 0.5 }] {
        let mut scene = super::scenes::bazaar(80, 60);
        (scene.film.filter, scene.film.mode) = (filter, Some(FilmMode::Importance));
        let prepared = super::Prepared::new(&scene, 7);
        let tables = Tables::new(&prepared.job()).unwrap();
        let lines = "let ray = camera_ray(vec2f(float(0u), float(1u)), vec2f(float(2u), float(3u)));
        put_float3(0u, ray.o); put_float3(3u, ray.d);
        put_float(6u, film_offset(float(2u)));";
        let inputs: Vec<_> =
            units::<4>(20_000).into_iter().map(|u| [u[0] * 80.0, u[1] * 60.0, u[2], u[3]]).collect();
        for (input, out) in inputs.iter().zip(probe::<4, 7>(&device, lines, &bits(&inputs), &tables)) {
            let [x, y, u, v] = *input;
            let ray = prepared.scene.camera.ray(x, y, [u, v]);
            [ray.o.x, ray.o.y, ray.o.z].iter().zip(&out).for_each(|(e, o)| close(*o, *e, 16.0 * ULP, input));
            [ray.d.x, ray.d.y, ray.d.z]
                .iter()
                .zip(&out[3..])
                .for_each(|(e, o)| close(*o, *e, 8.0 * ULP, input));
            // A square root picks a place among 64, each of which is a tenth of a pixel or so.
            let bound = if matches!(filter, Filter::Tent { .. }) { 2.0 * ULP } else { 256.0 * ULP };
            close(out[6], prepared.offset.sample(u), bound, input);
        }
    }
}

#[test]
fn radiance_is_rounded_to_the_same_integers() {
    let Some(device) = device() else { return };
    // Floats of every exponent from far below the quantum to the brightest, ties included.
    let mut inputs: Vec<[u32; 3]> =
        words::<3>(20_000).into_iter().map(|w| w.map(|w| w % (MAX_RADIANCE.to_bits() + 1))).collect();
    for power in -40..28 {
        let x = 2.0_f32.powi(power);
        inputs.push([x, x * 1.5, x * 2.5].map(f32::to_bits));
    }
    inputs.push([MAX_RADIANCE, 0.0, -0.0].map(f32::to_bits));
    inputs.push([1, 0x007f_ffff, 0x0080_0000]);
    let lines = "var sums = SlotSums();
        add_sample(&sums, 5u, float3(0u));
        put(0u, sums.low.x); put(1u, sums.low.y); put(2u, sums.low.z);
        put(3u, sums.middle.x); put(4u, sums.middle.y); put(5u, sums.middle.z);
        put(6u, sums.squares.x); put(7u, sums.squares.y); put(8u, sums.squares.z);
        add_sample(&sums, 6u, float3(0u));
        put(9u, sums.low.x); put(10u, sums.middle.x); put(11u, sums.squares.y); put(12u, sums.rejected);";
    for (input, out) in inputs.iter().zip(simple::<3, 13>(&device, lines, &inputs)) {
        let radiance = input.map(f32::from_bits);
        let rgb = radiance.map(|c| (f64::from(c) * 4_294_967_296.0).round_ties_even() as u64);
        let got: [u64; 3] = std::array::from_fn(|c| u64::from(out[c]) | u64::from(out[3 + c]) << 32);
        assert_eq!(got, rgb, "{radiance:?}");
        if crate::film::sums::fits(radiance) {
            let mut sums = PixelSums::default();
            sums.add(radiance);
            assert_eq!(sums.rgb.map(|sum| sum as u64), rgb);
        }
        let square =
            f64::from(out[6]) + f64::from(out[7]) * 2.0_f64.powi(32) + f64::from(out[8]) * 2.0_f64.powi(64);
        let expected = radiance.iter().map(|&c| f64::from(c).powi(2)).sum::<f64>() * 4_294_967_296.0;
        assert!((square - expected).abs() <= 4e-7 * expected + 0.51, "{square} is not {expected}");
        let twice = u64::from(out[9]) | u64::from(out[10]) << 32;
        assert_eq!((twice, out[12]), (rgb[0] << 1, 0));
    }
}

#[test]
fn what_is_no_radiance_is_told_by_its_bits() {
    let Some(device) = device() else { return };
    let odd = [
        f32::NAN,
        -f32::NAN,
        f32::from_bits(0x7f80_0001),
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::MAX,
        MAX_RADIANCE * (1.0 + f32::EPSILON),
        -1.0,
        -f32::from_bits(1),
        -0.0,
        1.0,
        MAX_RADIANCE,
    ];
    let mut inputs = Vec::new();
    for x in odd {
        inputs.extend(odd.map(|y| [x, y, 0.5]));
        inputs.extend(odd.map(|y| [0.5, y, x]));
    }
    let codes = super::super::layout::REJECTS;
    for (input, out) in
        inputs.iter().zip(simple::<3, 1>(&device, "put(0u, check(float3(0u)));", &bits(&inputs)))
    {
        let reject = codes.iter().find(|(code, _)| *code == out[0]).map(|(_, reject)| *reject);
        assert_eq!(reject, check(*input).err(), "{input:?}");
    }
}
