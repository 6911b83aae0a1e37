//! Small programs for tests: as WGSL, on a device, and with mistakes.

mod device;
mod mistakes;
mod random;
mod texts;

use super::*;
use crate::math::lanes::Device;
use crate::math::{Float, LaneFloat, Uint, Vec3, value};

/// The part of the host's WGSL that programs use.
const BY_HAND: &str = "const NOTHING: f32 = 3.4028235e38f;

struct Numbers {
    eye: vec3f,
    near: f32,
    seed: u32,
    zero: u32,
}

struct Row {
    origin: vec3f,
    radius: f32,
    kind: u32,
}

struct Marked {
    at: vec3f,
    weight: f32,
}

@group(0) @binding(0) var<storage, read> scene: Numbers;
@group(0) @binding(1) var<storage, read> rows: array<Row>;
@group(0) @binding(2) var<storage, read> offsets: array<f32>;

fn light_at(i: u32) -> Row {
    return rows[min(i, arrayLength(&rows) - 1u)];
}

fn offset_node(i: u32) -> f32 {
    return offsets[min(i, arrayLength(&offsets) - 1u)];
}

fn float_min(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

fn float_max(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn copysign(x: f32, sign: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0x7fffffffu) | (bitcast<u32>(sign) & 0x80000000u));
}

fn doubled(marked: Marked, times: u32) -> Marked {
    return Marked(marked.at * 2.0, marked.weight * f32(times));
}
";

/// A structure that hand-written WGSL declares.
#[derive(Clone, Copy, Debug)]
struct Marked<F> {
    at: Vec3<F>,
    weight: F,
}
value!(Marked { at, weight });

/// A function that is hand-written on the device.
struct Doubled;

impl Device for Doubled {
    const NAME: &'static str = "doubled";
    type Arguments<F: Float> = (Marked<F>, F::Uint);
    type Output<F: Float> = Marked<F>;
    fn run<F: LaneFloat>(&self, (marked, times): (Marked<F>, F::Uint)) -> Marked<F> {
        Marked { at: marked.at * F::splat(2.0), weight: marked.weight * times.to_float() }
    }
}

/// Numbers and tables that programs read.
struct Scene {
    eye: [f32; 3],
    near: f32,
    seed: u32,
    origin: [Vec<f32>; 3],
    radius: Vec<f32>,
    kind: Vec<u32>,
    offsets: Vec<f32>,
}

impl Scene {
    fn new() -> Scene {
        Scene {
            eye: [1.0, 2.0, 3.0],
            near: 0.25,
            seed: 7,
            origin: [vec![1.0, 2.0, -1.0], vec![3.0, 4.0, 0.5], vec![5.0, 6.0, 2.0]],
            radius: vec![0.5, 0.75, 0.0],
            kind: vec![0, 1, 2],
            offsets: vec![0.0, 0.5, 1.0, 0.25],
        }
    }
    fn recording(&self) -> Recording<'_> {
        let mut registry = Registry::new();
        registry
            .vector(&self.eye, "scene.eye")
            .number(&self.near, "scene.near")
            .word(&self.seed, "scene.seed")
            .columns(&self.origin, "light_at", "origin")
            .column(&self.radius, "light_at", "radius")
            .words(&self.kind, "light_at", "kind")
            .array(&self.offsets, "offset_node");
        Recording::new(registry, &["Marked"]).checked()
    }
}

/// A function of the tests.
macro_rules! named {
    ($name:ident($($parameter:ident),*)) => {
        const {
            &Function {
                name: stringify!($name),
                parameters: &[$(stringify!($parameter)),*],
                module: "stride::some::place",
            }
        }
    };
}
use named;

/// The text of a program, after naga has validated it.
#[track_caller]
fn valid(recording: Recording<'_>) -> String {
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    let text = recording.finish().unwrap().text();
    let source = format!("{BY_HAND}\n{text}");
    let module = wgpu::naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}\n{text}", error.emit_to_string(&source)));
    if let Err(error) = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module) {
        panic!("{}\n{text}", error.emit_to_string(&source));
    }
    text
}
