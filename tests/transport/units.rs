//! Lengths may be in any unit: a scaled scene, with the intensity of its lights scaled by the square, gives the
//! same picture from the same random numbers.

use crate::common;
use crate::common::scenes::*;
use crate::common::shapes::{bounded_samples, placed};
use glam::{DAffine3, DVec3};
use std::path::Path;
use std::process::Command;
use stride::film::compare::{FlipKind, compare};
use stride::output::read_picture;
use stride::scene::{
    CheckerboardParameters, Integrator, Light, MaterialKind, PlaneParameters, PointLightParameters, Scene,
    Shape, SpotLightParameters,
};
use stride::world::AcceleratorChoice;

/// The scene in another unit, `s` of which are one old unit. Its checkerboards are on planes.
fn scaled(scene: &Scene, s: f64) -> Scene {
    let mut scene = scene.clone();
    let camera = &mut scene.camera;
    camera.eye *= s;
    for length in
        [&mut camera.focal_length, &mut camera.near, &mut camera.aperture_radius, &mut camera.focus_distance]
    {
        *length *= s;
    }
    for entity in &mut scene.entities {
        let [shape] = &placed(&entity.shape, &DAffine3::from_scale(DVec3::splat(s))).0[..] else {
            panic!("{:?} becomes several shapes", entity.shape)
        };
        entity.shape = shape.clone();
    }
    for light in &mut scene.lights {
        let (position, intensity) = match light {
            Light::Point(PointLightParameters { position, intensity, .. }) => (position, intensity),
            Light::Spot(SpotLightParameters { position, intensity, .. }) => (position, intensity),
            Light::Directional(_) => continue,
            _ => panic!("a light of unknown lengths"),
        };
        *position *= s;
        *intensity = intensity.map(|intensity| intensity.map(|c| c * s * s));
    }
    for material in &mut scene.materials {
        if let MaterialKind::Checkerboard(CheckerboardParameters { checks_per_unit, .. }) = &mut material.kind
        {
            *checks_per_unit = checks_per_unit.map(|checks| checks / s);
        }
    }
    scene
}

/// A room with every shape, material and light, through a thin lens.
fn everything() -> Scene {
    let materials =
        vec![matte([0.7, 0.6, 0.5]), mirror([0.8; 3]), glass(1.5), checkerboard(0, 1, 1.5), matte([0.8; 3])];
    let ball = icosphere(v(6.0, 2.6, -1.2), 0.8, 3, true);
    let lamp = icosphere(v(5.0, -2.9, 1.4), 0.3, 2, false);
    let mut entities = vec![
        plane(DVec3::Z, -2.0, 3),
        flipped(cuboid(v(-3.0, -5.0, -3.0), v(11.0, 5.0, 4.0), 4)),
        sphere(v(7.0, 0.5, -1.0), 1.0, 2),
        sphere(v(9.0, -2.0, -1.0), 1.0, 1),
        cylinder(v(4.5, -1.5, -2.0), v(4.5, -1.5, -0.5), 0.5, 0),
        disk(v(4.5, -1.5, -0.5), DVec3::Z, 0.5, 1),
        mesh(ball, 0),
        emitting(mesh(lamp, 0), 3.0),
        emitting(quad(v(5.0, -1.0, 3.9), v(0.0, 2.0, 0.0), v(2.0, 0.0, 0.0), 0), 4.0),
        emitting(sphere(v(9.0, 3.0, 3.0), 0.4, 0), 5.0),
        emitting(disk(v(2.0, 4.5, 2.0), v(0.0, -0.8, -0.6), 0.4, 0), 5.0),
        emitting(cylinder(v(8.0, -4.0, 3.0), v(10.0, -4.0, 3.0), 0.1, 0), 5.0),
    ];
    // And one of every kind, on the wall.
    let samples = bounded_samples(v(10.0, 0.0, 1.5), 0.5).into_iter().enumerate();
    let apart = |(i, (_, shape))| {
        entity(placed(&shape, &DAffine3::from_translation(v(0.0, i as f64 - 3.0, 0.0))).0.remove(0), 0)
    };
    entities.extend(samples.map(apart));
    let mut scene = sized(scene(materials, entities), 24, 18);
    scene.lights = vec![point_light(v(3.0, 1.0, 3.0), 12.0), point_light(v(6.0, 3.0, 2.0), 6.0)];
    scene.camera.aperture_radius = 0.05;
    scene.camera.focus_distance = 7.0;
    scene.camera.near = 0.125;
    scene.environment = [0.1, 0.2, 0.3];
    scene
}

/// The radiance of every sample.
fn samples(scene: &Scene, accelerator: AcceleratorChoice) -> Vec<[f32; 3]> {
    let samples = scene.render.samples;
    let mut seen = vec![[0.0; 3]; (scene.film.width * scene.film.height * samples) as usize];
    let mut count = vec![0; (scene.film.width * scene.film.height) as usize];
    common::for_each_sample_in(scene, accelerator, |pixel, radiance| {
        seen[pixel * samples as usize + count[pixel]] = radiance;
        count[pixel] += 1;
    });
    // They come in any order.
    seen.chunks_mut(samples as usize)
        .for_each(|pixel| pixel.sort_by(|a, b| a.partial_cmp(b).expect("numbers")));
    seen
}

// Powers of two change no digit: any constant length in the code becomes visible.
#[test]
fn units_that_are_powers_of_two_apart_give_the_same_bits() {
    let scenes = [
        ("everything", everything()),
        ("cover", cover(24, 18)),
        ("smallpt", smallpt(16, 12)),
        ("bazaar", bazaar(16, 12)),
    ];
    for (name, scene) in scenes {
        for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
            for accelerator in [AcceleratorChoice::Simple, AcceleratorChoice::Bvh] {
                let mut scene = scene.clone();
                (scene.render.integrator, scene.render.samples) = (integrator, 4);
                let expected = samples(&scene, accelerator);
                assert!(expected.iter().flatten().any(|&c| c > 0.0), "{name} is black");
                for power in [-20, -10, 10, 20] {
                    let found = samples(&scaled(&scene, libm::exp2(f64::from(power))), accelerator);
                    let differ = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
                    assert_eq!(
                        differ,
                        0,
                        "{name} by 2^{power}, {integrator}, {accelerator:?}: of {}",
                        found.len()
                    );
                }
                // Negative control: a light of unscaled intensity differs.
                if !scene.lights.is_empty() {
                    let mut other = scaled(&scene, 1024.0);
                    other.lights.clone_from(&scaled(&scene, 1023.0).lights);
                    assert_ne!(samples(&other, accelerator), expected, "{name}");
                }
            }
        }
    }
}

fn mean(samples: &[[f32; 3]]) -> f64 {
    samples.as_flattened().iter().map(|&c| f64::from(c)).sum::<f64>() / samples.len() as f64
}

#[test]
fn units_of_a_thousand_give_the_same_picture_within_rounding() {
    for (name, scene) in [("everything", everything()), ("cover", cover(24, 18))] {
        for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
            let mut scene = scene.clone();
            (scene.render.integrator, scene.render.samples) = (integrator, 16);
            let expected = samples(&scene, AcceleratorChoice::Bvh);
            // Among the samples that are not black in both pictures.
            let close = |found: &[[f32; 3]]| {
                let lit = found.iter().zip(&expected).filter(|(a, b)| a.iter().chain(*b).any(|&c| c > 0.0));
                let close = |(a, b): &(&[f32; 3], &[f32; 3])| {
                    a.iter().zip(*b).all(|(a, b)| (a - b).abs() <= 1e-3 * b.abs().max(1e-3))
                };
                lit.clone().filter(close).count() as f64 / lit.count() as f64
            };
            for scale in [1e-3, 1e3, 1e6] {
                // Rounding moves a few paths across an edge.
                let found = samples(&scaled(&scene, scale), AcceleratorChoice::Bvh);
                let (share, ratio) = (close(&found), mean(&found) / mean(&expected));
                println!("{name}, {integrator}, times {scale}: {share} of the samples, {ratio} of the mean");
                assert!(share > 0.9, "{name}, {integrator}, times {scale}: {share}");
                assert!((ratio - 1.0).abs() < 0.02, "{name}, {integrator}, times {scale}: {ratio}");
            }
            // Negative control.
            let mut other = scaled(&scene, 1e3);
            other.camera.eye.y += 50.0;
            assert!(close(&samples(&other, AcceleratorChoice::Bvh)) < 0.9, "{name}, {integrator}");
        }
    }
}

fn stride(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("stride");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

/// A room of two and a half metres with a point light, in a unit of which `unit` are one metre.
fn room(unit: f64, intensity: f64) -> String {
    let at = |p: [f64; 3]| format!("{:?}", p.map(|x| x * unit));
    format!(
        "camera = {{ eye = {}, look_at = {}, vertical_fov = 50 }}
film = {{ width = 40, height = 30 }}
lights = [{{ type = \"point\", position = {}, intensity = [{intensity:?}, {intensity:?}, {intensity:?}] }}]
entities = [
    {{ shape = {{ type = \"box\", min = {}, max = {} }}, material = \"w\", flip_normal = true }},
    {{ shape = {{ type = \"sphere\", center = {}, radius = {:?} }}, material = \"w\" }},
]
materials.w = {{ type = \"matte\", reflectance = [0.7, 0.7, 0.7] }}\n",
        at([0.0, -3.0, 1.5]),
        at([0.0, 0.0, 1.0]),
        at([0.5, -1.0, 1.6]),
        at([-2.0, -4.0, 0.0]),
        at([2.0, 2.0, 2.5]),
        at([0.0, 0.0, 0.5]),
        0.5 * unit
    )
}

/// Renders to an error; returns the samples per pixel that it took, and the output.
fn to_error(folder: &Path, name: &str, text: &str, more: &[&str]) -> (f64, String) {
    std::fs::write(folder.join("a.toml"), text).expect("a scene");
    let picture = format!("{name}.exr");
    let common = ["render", "a.toml", "--headless", "-o", &picture, "--stats", "s.json"];
    let said = stride(folder, &[&common, more].concat());
    let stats = std::fs::read(folder.join("s.json")).expect("figures");
    let stats: serde_json::Value = serde_json::from_slice(&stats).expect("JSON");
    (stats["spp"].as_f64().expect("a number"), said)
}

#[test]
fn an_error_needs_the_same_samples_in_every_unit() {
    let dir = tempfile::tempdir().expect("a folder");
    let goal = |error| ["--noise", error, "--spp", "4096", "-q"];
    for more in [&[][..], &["--adaptive"], &["--film-mode", "continuous"]] {
        let more = [&goal("0.05"), more].concat();
        let (expected, _) = to_error(dir.path(), "m", &room(1.0, 1.0), &more);
        assert!((17.0..4096.0).contains(&expected), "{expected}");
        let (_, metres) = read_picture(&dir.path().join("m.exr")).expect("a picture");
        // Millimetres and kilometres with lamps of equal radiance, and millimetres with one of a millionth.
        for (unit, intensity, gain) in [(1e3, 1e6, 1.0), (1e-3, 1e-6, 1.0), (1e3, 1.0, 1e6)] {
            let (spp, _) = to_error(dir.path(), "other", &room(unit, intensity), &more);
            assert!(
                (spp / expected - 1.0).abs() < 0.01,
                "{unit} to the metre, {more:?}: {spp}, not {expected}"
            );
            let (_, mut other) = read_picture(&dir.path().join("other.exr")).expect("a picture");
            other.rgb.iter_mut().flatten().for_each(|c| *c *= gain);
            if spp == expected {
                let found = compare(&other, &metres, FlipKind::Hdr).expect("comparable");
                assert!(found.noise < 0.005, "{unit} to the metre, {more:?}: {}", found.noise);
            }
        }
    }
    // Negative control: another error needs another number.
    let few = to_error(dir.path(), "a", &room(1.0, 1.0), &goal("0.05")).0;
    assert!(to_error(dir.path(), "a", &room(1.0, 1.0), &goal("0.03")).0 > 2.0 * few);
}

#[test]
fn the_true_error_in_millimetres_matches_the_requested_one() {
    let dir = tempfile::tempdir().expect("a folder");
    let text = room(1e3, 1.0);
    to_error(dir.path(), "reference", &text, &["--spp", "4096", "--seed", "9", "-q"]);
    let (spp, _) = to_error(dir.path(), "a", &text, &["--noise", "0.04", "--spp", "4096", "-q"]);
    let read = |name: &str| read_picture(&dir.path().join(name)).expect("a picture").1;
    let found = compare(&read("a.exr"), &read("reference.exr"), FlipKind::Hdr).expect("comparable");
    assert!((0.8..1.2).contains(&(found.noise / 0.04)), "{} after {spp} samples", found.noise);
    // The absolute figure shows no error.
    assert!(found.relative_mse.sqrt() < 1e-4, "{}", found.relative_mse);
}

#[test]
fn radiance_outside_the_range_of_a_film_causes_one_warning_with_a_remedy() {
    let dir = tempfile::tempdir().expect("a folder");
    let warns = |text: &str, more: &[&str]| {
        let said = to_error(dir.path(), "a", text, &[&["--spp", "4"], more].concat()).1;
        let lines: Vec<_> = said.lines().filter(|line| line.contains("ultiply all emissions")).collect();
        assert!(lines.len() <= 1, "{said}");
        lines.first().map(|line| (*line).to_owned())
    };
    let dark = room(1e6, 1.0);
    let told = warns(&dark, &[]).expect("a warning");
    let stops: u32 = told
        .split_once("by 2^")
        .and_then(|(_, rest)| rest.split_once(' '))
        .expect("a power")
        .0
        .parse()
        .expect("a number");
    let counted: Vec<u32> = told.split(' ').filter_map(|word| word.parse().ok()).collect();
    // Most of 1200 first samples are not black, and all of those are too dark.
    assert!(counted[0] == counted[1] && (600..=1200).contains(&counted[0]), "{told}");
    // The same for any number of threads, and with --quiet.
    assert_eq!(warns(&dark, &["--threads", "3", "-q"]), Some(told.clone()));
    assert!(warns(&dark, &["--film-mode", "continuous"]).is_some());
    // A render that begins later does not count first samples: the pixels of its film decide.
    assert!(warns(&room(1e5, 10.0), &[]).is_some());
    let dim = room(1e4, 1.0);
    std::fs::write(dir.path().join("a.toml"), &dim).expect("a scene");
    let said = stride(dir.path(), &["render", "a.toml", "--headless", "-o", "a.exr", "--range", "4..8"]);
    assert!(said.contains("pixels that are not black are below"), "{said}");
    // The remedy works.
    let remedied = room(1e6, libm::exp2(f64::from(stops)));
    assert_eq!(warns(&remedied, &[]), None);
    // Negative controls: the room in metres and in millimetres, one without a light, and one whose light reaches
    // nothing.
    assert_eq!(warns(&room(1.0, 1.0), &[]), None);
    assert_eq!(warns(&room(1e3, 1.0), &[]), None);
    assert_eq!(warns(&room(1.0, 0.0), &[]), None);
    assert_eq!(warns(&room(1.0, 1.0), &["--max-depth", "0"]), None);
    // At the other end of the range samples are rejected, and the remedy is the opposite.
    let (_, said) = to_error(dir.path(), "a", &room(1e-3, 1e5), &["--spp", "4"]);
    assert!(said.contains("samples were rejected") && said.contains("Divide all emissions"), "{said}");
    // The warning appears with --quiet, too.
    let (_, said) = to_error(dir.path(), "a", &room(1e-3, 1e5), &["--spp", "4", "-q"]);
    assert!(said.starts_with("warning: ") && said.contains("Divide all emissions"), "{said}");
}

#[test]
fn the_distance_of_a_plane_is_a_length_for_any_normal() {
    let text = |normal: &str, distance: &str| {
        format!(
            "camera = {{ eye = [0, -3, 2], look_at = [0, 0, 0] }}
film = {{ width = 16, height = 12 }}
environment = {{ radiance = [1, 1, 1] }}
entities = [{{ shape = {{ type = \"plane\", normal = {normal}, distance = {distance} }}, material = \"w\" }}]
materials.w = {{ type = \"matte\", reflectance = [0.5, 0.6, 0.7] }}\n"
        )
    };
    let load = |normal: &str, distance: &str| {
        let loaded = stride::scene::parse(&text(normal, distance), "a.toml".as_ref());
        let loaded = loaded.unwrap_or_else(|errors| panic!("{errors}"));
        let warnings: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
        let digits = stride::scene::Fingerprint::of(&loaded.scene, &loaded.sources).digits();
        (loaded.scene.entities[0].shape.clone(), digits, warnings)
    };
    for (one, other, distance, warned) in [
        ("[0, 0, 1]", "[0, 0, 2]", "0.5", [0, 1]),
        ("[0, 0, 1]", "[0, 0, 1e-9]", "-1", [0, 1]),
        ("[0, 0.6, 0.8]", "[0, 1.2, 1.6]", "0.25", [0, 1]),
        ("[0, 0.6, 0.8]", "[0, 1.2, 1.6]", "0", [0, 0]),
        ("[1, 2, 3]", "[3, 6, 9]", "2", [1, 1]),
    ] {
        let (one, other) = (load(one, distance), load(other, distance));
        // The same plane to the bit, with the same fingerprint.
        assert_eq!((&one.0, &one.1), (&other.0, &other.1));
        assert_eq!([one.2.len(), other.2.len()], warned, "{:?} {:?}", one.2, other.2);
    }
    let (shape, _, warnings) = load("[0, 0, 2]", "3");
    assert_eq!(shape, Shape::Plane(PlaneParameters { normal: DVec3::Z, distance: 3.0 }));
    let told = "a.toml:4:72: the normal's length is 2, but distance is measured along the unit normal; to mean X·normal = distance with this normal, divide both by 2";
    assert_eq!(warnings, [told]);
    // Normals with three digits have length one.
    assert_eq!(load("[0.577, 0.577, 0.577]", "1").2, Vec::<String>::new());
    assert_eq!(load("[0.707, 0, 0.707]", "1").2, Vec::<String>::new());
    assert_eq!(load("[0.7, 0, 0.7]", "1").2.len(), 1);
}
