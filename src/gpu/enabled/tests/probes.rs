//! The hand-written functions, compared with the CPU's scalar code for thousands of inputs. Recorded functions are in
//! `functions`.

mod lights;

use super::super::layout::Scene;
use super::super::tables::{LightColumns, SurfaceColumns, Tables, light_rows, light_tables, surface_rows};
use super::probe::{library_for, probe, run};
use super::{Device, Prepared, device, scenes};
use crate::film::reject::check;
use crate::film::{MAX_RADIANCE, PixelSums};
use crate::light::{AreaLight, Falloff, LightTable, PointLight, Ramp, SpotLight, Triangle};
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Ray, Vec3};
use crate::sampling::independent::pcg4d;
use crate::sampling::{Stream, warp};
use crate::scene::{Integrator, Sampler};
use crate::shape::samples::{bounded_samples, unbounded_samples};
use crate::shape::{self, Piece, Shape};
use crate::world::SurfaceTable;
use glam::DVec3;
use rand::RngExt;

/// Tables of a minimal scene, for probes that read no table or have their own.
fn nothing() -> Tables {
    Tables::new(&Prepared::new(&scenes::beacon([1.0; 3]), 7).job()).unwrap()
}

fn simple<const IN: usize, const OUT: usize>(
    device: &Device,
    lines: &str,
    inputs: &[[u32; IN]],
) -> Vec<[u32; OUT]> {
    probe(device, lines, inputs, &nothing())
}

/// Pseudorandom words, the same in every run.
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

/// Within some ulp of one: WGSL's roots and quotients may be off by a few ulp.
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
fn streams_are_identical() {
    let Some(device) = device() else { return };
    let scene = scenes::with(scenes::beacon([1.0; 3]), Integrator::Whitted, Sampler::Sobol);
    let tables = Tables::new(&Prepared::new(&scene, 7).job()).unwrap();
    let inputs = words::<2>(20_000);
    let lines = "let id = PathId(word(0u), word(1u));
        var stream = start(id, vec2f(0.5), 0u).stream;
        for (var i = 0u; i < 10u; i++) { put_float(i, next_random(&stream, id)); }";
    let library = library_for(&device, &tables, Integrator::Whitted);
    let outputs = run(&device, &library, lines, [2, 10], inputs.as_flattened(), &tables);
    for (input, output) in inputs.iter().zip(outputs.chunks_exact(10)) {
        let mut stream = Stream::new(7, input[0], input[1]);
        let expected: [f32; 10] = std::array::from_fn(|_| stream.random());
        assert_eq!(output, expected.map(f32::to_bits));
    }
}

#[test]
fn hits_on_shapes_agree() {
    /// The most distances that the probe puts out.
    const MOST: usize = 16;
    let Some(device) = device() else { return };
    // A sample of every kind that is not made of triangles; of a box, the first side.
    let bounded = bounded_samples(DVec3::new(0.5, 0.2, -0.5), 2.5);
    let all = unbounded_samples().into_iter().chain(bounded);
    let pieces: Vec<Piece> = all.filter_map(|(_, shape)| shape.pieces().first().copied()).collect();
    assert!((6..=MOST).contains(&pieces.len()), "{} kinds", pieces.len());
    let mut table = SurfaceTable::default();
    let attributes = crate::world::SurfaceAttributes {
        emission_texture: crate::texture::NO_TEXTURE,
        material: 0,
        emission: [0.0; 3],
        flip_normal: true,
        entity: 0,
        light: crate::light::NO_LIGHT,
    };
    let kind_of = |piece: &Piece| match piece {
        Piece::Plane(_) => "PLANES",
        Piece::Sphere(_) => "SPHERES",
        Piece::Quad(_) => "QUADS",
        Piece::Custom(_) => "CUSTOM",
    };
    let distance_to = |piece: &Piece, ray: &Ray<f32>| match piece {
        Piece::Plane(plane) => plane.intersect(ray),
        Piece::Sphere(sphere) => sphere.intersect(ray),
        Piece::Quad(quad) => quad.intersect(ray),
        Piece::Custom(custom) => custom.intersect(ray),
    };
    pieces.iter().for_each(|piece| {
        table.push(piece.surface(), attributes);
    });
    let surfaces = surface_rows(&table, &SurfaceColumns::new(&table).unwrap()).packed();
    let mut inputs = Vec::new();
    for u in units::<5>(20_000) {
        let o = [u[0], u[1], u[2]].map(|u| u * 8.0 - 4.0);
        let d = warp::uniform_sphere([u[3], u[4]]);
        inputs.push([o[0], o[1], o[2], d.x, d.y, d.z]);
    }
    let count = pieces.len();
    let kinds: Vec<_> = pieces.iter().map(kind_of).collect();
    let lines = format!(
        "let ray = Ray(float3(0u), float3(3u), 0.0);
        let kinds = array<u32, {count}>({});
        for (var i = 0u; i < {count}u; i++) {{ put_float(i, surface_intersect(kinds[i], surface_at(i), ray)); }}",
        kinds.join(", ")
    );
    let scene = Scene { custom_end: count as u32, ..nothing().scene };
    let tables = Tables { surfaces, scene, ..nothing() };
    let outputs = probe::<6, MOST>(&device, &lines, &bits(&inputs), &tables);
    let (mut met, mut doubtful) = (vec![0; count], 0);
    for (input, out) in inputs.iter().zip(outputs) {
        let [ox, oy, oz, dx, dy, dz] = *input;
        let ray = Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
        let expected: Vec<f32> = pieces.iter().map(|piece| distance_to(piece, &ray)).collect();
        for i in 0..count {
            let got = f32::from_bits(out[i]);
            if (expected[i] < shape::NOTHING) != (got < f32::MAX) {
                doubtful += 1;
                continue;
            }
            if expected[i] == shape::NOTHING {
                continue;
            }
            met[i] += 1;
            // The condition number of the problem: the effect of a rounding along the surface on the distance.
            let hit = crate::world::Hit {
                t: expected[i],
                surface: Wrapping(i as u32),
                ..crate::world::Hit::none()
            };
            let point = table.point(&ray, &hit);
            let steep = 1.0 / point.n.dot(ray.d).abs().max(1e-4);
            let size = 8.0 + expected[i];
            close(out[i], expected[i], 16.0 * ULP * size * steep, input);
        }
    }
    assert!(met.iter().all(|&n| n > 500), "too few hits: {met:?}");
    assert!(doubtful <= 8, "{doubtful} hits are seen by one side only");
}

#[test]
fn radiance_is_rounded_identically() {
    let Some(device) = device() else { return };
    // Floats of every exponent from far below the quantum to the largest, including ties.
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
fn invalid_radiance_is_detected_by_its_bits() {
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
