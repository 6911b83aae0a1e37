//! Environment pictures: their orientation and their sampling, including the part that is not sampled.
//!
//! Directions are tested at the level stated in `common::chi_square`, images at that of `common::tiles`.

use crate::common::chi_square::{Polar, compare_some};
use crate::common::scenes::{emitting, matte, narrow, quad, scene, sized, sphere, v, wide};
use crate::common::tiles::{Replicates, welch};
use crate::common::tracers::{Method, Numbers, replicates};
use crate::common::{estimate, for_each_sample};
use glam::DVec3;
use std::cell::Cell;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{self, Finished, Paths};
use stride::math::Vec3;
use stride::math::lanes::Level;
use stride::math::lanes::scalar::Wrapping;
use stride::parameter::ImageIndex;
use stride::sampling::Region;
use stride::scene::{
    ConductorParameters, EnvironmentPicture, ImageFile, Integrator, Material, MaterialKind, Scene,
};
use stride::texture::{Depth, Picture};
use stride::world::{self, AcceleratorChoice, World};

/// A scene surrounded by a picture of these radiances, by column and row from the upper left.
fn surrounded(mut scene: Scene, [width, height]: [u32; 2], texel: impl Fn(u32, u32) -> [f32; 3]) -> Scene {
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let bytes: Vec<u8> = places.flat_map(|(x, y)| texel(x, y)).flat_map(f32::to_le_bytes).collect();
    let picture = Picture::new([width, height], [3, 3], Depth::Float, &bytes);
    scene.images = vec![ImageFile::of("surroundings".into(), Arc::new(picture))];
    scene.environment_picture = Some(EnvironmentPicture::of(ImageIndex(0)));
    scene
}

/// A sky of 64 × 32 texels, darker below, with a sun of the given radiance and 4 × 3 texels in the upper left half.
fn sky(scene: Scene, sun: f32) -> Scene {
    surrounded(scene, [64, 32], |x, y| {
        let light = if (14..18).contains(&x) && (8..11).contains(&y) { sun } else { 0.0 };
        let ground = if y >= 16 { 0.2 } else { 1.0 };
        [0.4 * ground + light, 0.5 * ground + light, (0.7 + 0.3 * (x as f32 * 0.2).sin()) * ground + light]
    })
}

/// The centre of that sun.
fn towards_sun() -> DVec3 {
    let (azimuth, polar) = ((0.5 - 16.0 / 64.0) * 2.0 * PI, 9.5 / 32.0 * PI);
    v(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
}

fn asked(mut scene: Scene, integrator: Integrator) -> Scene {
    scene.render.integrator = integrator;
    scene
}

/// The radiance of a ray that leaves in a direction, and the density of sampling that direction.
fn escaped(scene: &world::CompiledScene, d: Vec3<f32>) -> ([f32; 3], f32) {
    let density = Cell::new(0.0);
    let weight = |pdf| {
        density.set(pdf);
        1.0
    };
    (scene.lights.escaped(d, weight).lane(0), density.get())
}

/// Of 16 columns, those about the centre are red, those to its left green, those to its right blue, and the others
/// white; of 8 rows, the highest are yellow and the lowest black.
fn compass(scene: Scene) -> Scene {
    surrounded(scene, [16, 8], |x, y| match (x, y) {
        (_, 0..2) => [1.0, 1.0, 0.0],
        (_, 6..) => [0.0; 3],
        (6..10, _) => [1.0, 0.0, 0.0],
        (2..6, _) => [0.0, 1.0, 0.0],
        (10..14, _) => [0.0, 0.0, 1.0],
        _ => [1.0; 3],
    })
}

const AHEAD: [f32; 3] = [1.0, 0.0, 0.0];
const LEFT: [f32; 3] = [0.0, 1.0, 0.0];
const RIGHT: [f32; 3] = [0.0, 0.0, 1.0];
const BEHIND: [f32; 3] = [1.0; 3];
const ABOVE: [f32; 3] = [1.0, 1.0, 0.0];
const BELOW: [f32; 3] = [0.0; 3];

/// The colour in the view of a camera along an axis.
fn seen(scene: &Scene, forward: DVec3) -> [f32; 3] {
    let mut scene = sized(scene.clone(), 1, 1);
    scene.render.samples = 1;
    scene.camera.forward = forward;
    scene.camera.up = if forward.z.abs() > 0.5 { DVec3::Y } else { DVec3::Z };
    let mut radiance = [0.0; 3];
    for_each_sample(&scene, |_, sample| radiance = sample);
    radiance
}

#[test]
fn each_side_has_its_documented_direction() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let turned = |rotate: f64, up: DVec3| {
        let mut scene = compass(scene(vec![], vec![]));
        let picture = scene.environment_picture.as_mut().expect("a picture");
        (picture.rotate, picture.up) = (rotate, up);
        scene
    };
    // The direction of each side, ahead, left and up, followed by the opposite ones.
    for (rotate, up, ahead, left) in [
        (0.0, z, x, y),
        (FRAC_PI_2, z, y, -x),
        (-FRAC_PI_2, z, -y, x),
        (PI, z, -x, -y),
        (0.0, y, x, -z),
        (FRAC_PI_2, y, -z, -x),
        (0.0, -z, x, -y),
        (0.0, x, -z, y),
        (0.0, DVec3::new(0.0, 1.0, -0.0), x, -z),
    ] {
        let scene = turned(rotate, up);
        let sides =
            [(ahead, AHEAD), (left, LEFT), (-left, RIGHT), (-ahead, BEHIND), (up, ABOVE), (-up, BELOW)];
        for (direction, colour) in sides {
            let found = seen(&scene, direction);
            let is_close = found.iter().zip(colour).all(|(a, b)| (a - b).abs() < 1e-3);
            assert!(is_close, "{rotate} about {up}, {direction}: {found:?}, not {colour:?}");
        }
    }
}

#[test]
fn radiance_is_bilinear_scaled_and_periodic() {
    let texel = |x: u32, y: u32| [x as f32 + 10.0 * y as f32, 1.0, 0.5];
    let mut scene = surrounded(scene(vec![], vec![]), [8, 4], texel);
    scene.environment_picture.as_mut().expect("a picture").scale = [2.0, 3.0, 4.0];
    let (compiled, _) = world::compile(&scene, 16, 16).unwrap();
    let clamped = |y: i32| y.clamp(0, 3) as u32;
    for i in 0..400 {
        // From the upper left, in texels.
        let (x, y) = (f64::from(i % 20) / 20.0 * 8.0 + 0.13, f64::from(i / 20) / 20.0 * 4.0 + 0.07);
        let (azimuth, polar) = ((0.5 - x / 8.0) * 2.0 * PI, y / 4.0 * PI);
        let d = v(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos());
        let ([r, g, b], _) = escaped(&compiled, narrow(d));
        let (column, row) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (s, t) = (x - 0.5 - column, y - 0.5 - row);
        let at = |dx: i32, dy: i32| {
            f64::from(texel((column as i32 + dx).rem_euclid(8) as u32, clamped(row as i32 + dy))[0])
        };
        let mix = |dy: i32| at(0, dy) * (1.0 - s) + at(1, dy) * s;
        let expected = 2.0 * (mix(0) * (1.0 - t) + mix(1) * t);
        assert!((f64::from(r) - expected).abs() < 1e-3, "{x} {y}: {r}, not {expected}");
        assert!((g - 3.0).abs() < 1e-5 && (b - 2.0).abs() < 1e-5);
    }
}

/// A strong sun in a sky: within a cone around the sun, and outside it.
#[test]
fn directions_follow_their_density() {
    // `path` samples only radiance above the mean, `whitted` all of it.
    for (i, integrator) in [Integrator::Path, Integrator::Whitted].into_iter().enumerate() {
        let sky = asked(sky(scene(vec![], vec![]), 300.0), integrator);
        let (compiled, _) = world::compile(&sky, 16, 16).unwrap();
        let sample = |u: [f32; 4]| compiled.lights.sample(Wrapping(0), Vec3::zero(), [u[0], u[1]]);
        let (sun, cone) = (towards_sun(), 0.3_f64.cos());
        let polar = Polar::new(sun, DVec3::X);
        let is_near = |d: Vec3<f32>| wide(d).dot(sun) > cone;
        for near in [true, false] {
            if !near && integrator == Integrator::Path {
                // Nothing is sampled there.
                continue;
            }
            let drawn = |u: [f32; 4]| Some(sample(u).wi).filter(|&d| is_near(d) == near);
            let outcome = |pdf: &dyn Fn(Vec3<f32>) -> f32| {
                let within = |d| if is_near(d) == near { pdf(d) } else { 0.0 };
                compare_some(polar, 700 + 2 * i as u32, drawn, within)
            };
            let right = outcome(&|d| escaped(&compiled, d).1);
            assert!(right.agrees(3), "{integrator:?}, {near}: {right:?}");
            if near {
                // Negative control: a density that is off by a tenth of a texel from the radiance.
                let turn = glam::DQuat::from_rotation_z(0.1 / 64.0 * 2.0 * PI);
                let shifted = outcome(&|d| escaped(&compiled, narrow(turn * wide(d))).1);
                assert!(!shifted.agrees(1_000_000), "{integrator:?}: {shifted:?}");
            }
        }
    }
}

#[test]
fn a_sample_has_the_density_and_the_radiance_of_its_direction() {
    let sky = sky(scene(vec![], vec![]), 300.0);
    let (compiled, _) = world::compile(&sky, 16, 16).unwrap();
    let (mut most, mut least) = (0.0_f32, f32::INFINITY);
    for i in 0..4096_u32 {
        let u = [(i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5].map(|x| x / 64.0);
        let sample = compiled.lights.sample(Wrapping(0), Vec3::zero(), u);
        let (radiance, pdf) = escaped(&compiled, sample.wi);
        assert!((sample.pdf / pdf - 1.0).abs() < 0.01, "{u:?}: {} is not {pdf}", sample.pdf);
        assert!((sample.radiance.r - radiance[0]).abs() < 0.01 * radiance[0], "{u:?}");
        let weight = sample.weight().max_channel();
        (most, least) = (most.max(weight), least.min(weight));
    }
    // Nearly proportional: at the edge of the sun, the subtracted mean matters.
    assert!(most / least < 3.0, "{least} to {most}");
}

fn conductor(roughness: f64) -> Material {
    let (eta, k) = (Some([0.2, 0.9, 1.1]), Some([3.9, 2.4, 2.1]));
    let metal = ConductorParameters { metal: None, eta, k, roughness: [roughness; 2] };
    Material { name: "metal".into(), kind: MaterialKind::Conductor(metal), ..matte([0.0; 3]) }
}

/// Matte and metal balls on a matte floor, and a light.
fn balls() -> Scene {
    let materials = vec![matte([0.6, 0.5, 0.4]), conductor(0.5), conductor(0.0), matte([0.0; 3])];
    let entities = vec![
        quad(v(-1.0, -6.0, -1.0), v(14.0, 0.0, 0.0), v(0.0, 12.0, 0.0), 0),
        sphere(v(4.0, 1.1, -0.2), 0.8, 0),
        sphere(v(4.0, -0.7, -0.2), 0.8, 1),
        sphere(v(5.5, 0.2, 0.6), 0.6, 2),
        emitting(quad(v(2.5, -3.0, 2.5), v(0.0, 1.0, 0.0), v(1.0, 0.0, 0.0), 3), 6.0),
    ];
    let mut scene = sized(scene(materials, entities), 48, 32);
    scene.render.max_depth = 4;
    scene
}

#[test]
fn path_agrees_with_path_naive() {
    let lit = sky(balls(), 40.0);
    let naive = replicates(Method::PathNaive, Numbers::Independent, &lit, 160, 100);
    for (numbers, seed) in [(Numbers::Independent, 200), (Numbers::Sobol, 300)] {
        let path = replicates(Method::Path, numbers, &lit, 24, seed);
        let verdict = welch(&naive, &path);
        println!("{numbers:?}: {verdict}");
        assert!(verdict.agrees(2), "{numbers:?}: {verdict}");
    }
    // Negative control: a map that is rotated by two texels.
    let mut turned = lit.clone();
    turned.environment_picture.as_mut().expect("a picture").rotate += PI / 16.0;
    let path = replicates(Method::Path, Numbers::Sobol, &turned, 24, 400);
    assert!(!welch(&naive, &path).agrees(1_000_000));
}

/// Replicates by `whitted` of a scene that is compiled for an integrator.
fn whitted(scene: &Scene, compiled_for: Integrator, samples: u32, seed: u32) -> Replicates {
    let size = [scene.film.width, scene.film.height];
    let (compiled, surfaces) = world::compile(&asked(scene.clone(), compiled_for), size[0], size[1]).unwrap();
    let (compiled, world) = (Arc::new(compiled), Arc::new(World::new(&surfaces, AcceleratorChoice::Simple)));
    let pixels: Vec<_> =
        (0..size[0] * size[1]).map(|place| Region::whole(size[0], size[1]).pixel(place)).collect();
    Replicates::of(size, samples, |replicate, take| {
        let mut render = asked(scene.clone(), Integrator::Whitted).render;
        render.seed = seed + replicate;
        let (compiled, world) = (Arc::clone(&compiled), Arc::clone(&world));
        let whitted = integrator::build(&render, film_offset(&scene.film), compiled, world);
        let mut finished: Vec<Finished> = Vec::new();
        whitted.trace(Level::SCALAR, &Paths { pixels: &pixels, first_sample: 0, samples }, &mut finished);
        finished.iter().for_each(|f| take(f.sample.pixel, f.sample.radiance.map(f64::from)));
    })
}

/// `whitted` finds lights only by sampling, so it must sample everything. With matte materials it agrees with paths of
/// one bounce.
#[test]
fn whitted_samples_the_whole_map() {
    let mut lit = sky(sized(balls(), 32, 16), 40.0);
    lit.materials = vec![matte([0.6, 0.5, 0.4]); 4];
    lit.render.max_depth = 1;
    let path = replicates(Method::PathNaive, Numbers::Independent, &lit, 256, 500);
    let right = welch(&path, &whitted(&lit, Integrator::Whitted, 48, 600));
    println!("{right}");
    assert!(right.agrees(1), "{right}");
    // Negative control: if it samples only radiance above the mean, the sky is lost.
    assert!(!welch(&path, &whitted(&lit, Integrator::Path, 48, 700)).agrees(1_000_000));
}

#[test]
fn white_furnaces_are_invisible() {
    let (materials, entities) = (vec![matte([1.0; 3])], vec![sphere(v(3.0, 0.0, 0.0), 1.5, 0)]);
    for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
        let mut furnace =
            surrounded(sized(scene(materials.clone(), entities.clone()), 16, 16), [12, 6], |_, _| [2.0; 3]);
        furnace.render.samples = 256;
        let mean = estimate(&asked(furnace, integrator)).mean();
        for channel in mean {
            assert!((channel / 2.0 - 1.0).abs() < 0.01, "{integrator:?}: {channel}");
        }
    }
}

/// A floor under a radiance of 1 + cos θ reflects 5/3 of its reflectance.
#[test]
fn a_floor_receives_the_irradiance_of_the_picture() {
    let floor = vec![quad(v(-500.0, -500.0, 0.0), v(1000.0, 0.0, 0.0), v(0.0, 1000.0, 0.0), 0)];
    let height = 64;
    for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
        let mut lit = surrounded(scene(vec![matte([0.6; 3])], floor.clone()), [4, height], |_, y| {
            [(1.0 + ((f64::from(y) + 0.5) / f64::from(height) * PI).cos()) as f32; 3]
        });
        lit.camera.eye = v(0.0, 0.0, 5.0);
        (lit.camera.forward, lit.camera.up) = (-DVec3::Z, DVec3::X);
        lit.render.samples = 2048;
        let mean = estimate(&asked(lit, integrator)).mean();
        for channel in mean {
            assert!((channel - 1.0).abs() < 0.006, "{integrator:?}: {channel}");
        }
    }
}

#[test]
fn invalid_radiance_is_replaced() {
    let odd = surrounded(scene(vec![], vec![]), [4, 2], |x, y| match (x, y) {
        (0, _) => [-1.0, f32::NAN, f32::INFINITY],
        _ => [1.0; 3],
    });
    let (compiled, _) = world::compile(&odd, 16, 16).unwrap();
    // The centre of the first column is behind and to the left.
    let azimuth = (0.5 - 0.125) * 2.0 * PI;
    let (radiance, pdf) = escaped(&compiled, narrow(v(azimuth.cos(), azimuth.sin(), 0.0)));
    // The rounding of the direction mixes in a small part of the next column.
    assert!(radiance[0] == 0.0 && radiance[1] < 1e-4, "{radiance:?}");
    assert_eq!(radiance[2], (1_u32 << 30) as f32);
    assert!(pdf.is_finite() && pdf > 0.0);
    // A black picture is no light.
    let dark = surrounded(scene(vec![], vec![]), [4, 2], |_, _| [-1.0; 3]);
    let (compiled, _) = world::compile(&dark, 16, 16).unwrap();
    assert!(compiled.lights.is_empty());
}

/// A picture may be larger than its sampling grid.
#[test]
fn large_maps_are_sampled_by_coarser_grids() {
    let large =
        surrounded(scene(vec![], vec![]), [2500, 4], |x, y| [if x == 1234 && y == 1 { 1e4 } else { 0.1 }; 3]);
    let (compiled, _) = world::compile(&asked(large, Integrator::Whitted), 16, 16).unwrap();
    let smooth = compiled.lights.grids().smooth();
    assert_eq!((*smooth.columns(), *smooth.rows()), (2048, 4));
    let mut sum = 0.0;
    let draws = 20_000_u32;
    for i in 0..draws {
        let u = [(i as f32 + 0.5) / draws as f32, (i.reverse_bits() >> 8) as f32 / 16_777_216.0];
        sum += f64::from(compiled.lights.sample(Wrapping(0), Vec3::zero(), u).weight().r);
    }
    // The texel's solid angle times its radiance, and that of the rest, with bilinear interpolation, so that texels
    // represent areas.
    let polar = |y: f64| y / 4.0 * PI;
    let rows: f64 = (0..2000)
        .map(|i| {
            let y = (f64::from(i) + 0.5) / 1000.0 + 0.5;
            let share = 1.0 - (y - 1.5).abs();
            share * polar(y).sin() * PI / 4.0 / 1000.0
        })
        .sum();
    let expected = 0.1 * 4.0 * PI + (1e4 - 0.1) * rows * 2.0 * PI / 2500.0;
    let mean = sum / f64::from(draws);
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean}, not {expected}");
}
