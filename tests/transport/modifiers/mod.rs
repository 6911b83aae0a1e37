//! Mixes of materials, holes, back sides, and normal and height maps, compared with mathematics.

mod heights;
mod second_uv;

use crate::common;
use crate::common::for_each_sample;
use crate::common::scenes::{emitting, flipped, matte, mirror, plane, point_light, quad, scene, sphere, v};
use glam::{DAffine3, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use stride::integrator::{Event, Passage, Paths};
use stride::math::lanes::Level;
use stride::parameter::Varying;
use stride::sampling::{Pixel, Region};
use stride::scene::{
    ConstantTexture, DirectionalLightParameters, Entity, Integrator, Material, Mesh, MixParameters,
    Modifiers, Named, Sampler, Scene, Shape, Texture, TextureKind, Textured,
};

const INTEGRATORS: [Integrator; 3] = [Integrator::Path, Integrator::PathNaive, Integrator::Whitted];
const SAMPLERS: [Sampler; 2] = [Sampler::Independent, Sampler::Sobol];

/// The mean of an image's red channel, and its standard error if samples are independent.
fn mean(scene: &Scene) -> (f64, f64) {
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for_each_sample(scene, |_, [r, _, _]| {
        let r = f64::from(r);
        (n, sum, squares) = (n + 1.0, sum + r, squares + r * r);
    });
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
}

/// Requires a mean from every integrator and sampler.
fn shows(scene: &Scene, integrators: &[Integrator], expected: f64) {
    for &integrator in integrators {
        for sampler in SAMPLERS {
            let mut scene = scene.clone();
            (scene.render.integrator, scene.render.sampler) = (integrator, sampler);
            let (mean, error) = mean(&scene);
            let off = (mean - expected).abs();
            // Evenly distributed samples have less noise than this.
            assert!(
                off <= 5.0 * error + 1e-5 * expected,
                "{integrator:?}, {sampler:?}: {mean} ± {error}, not {expected}"
            );
            assert!(5.0 * error < 0.05 * expected + 1e-9, "{integrator:?}: the noise is too large: {error}");
        }
    }
}

/// The material, with modifiers.
fn with(material: Material, modifiers: Modifiers) -> Material {
    Material { modifiers, ..material }
}

fn hole(opacity: f64) -> Modifiers {
    Modifiers { opacity, ..Modifiers::default() }
}

/// The material with the first texture as a parameter.
fn textured(material: Material, parameter: &'static str) -> Material {
    let mut modifiers = material.modifiers;
    match parameter {
        "normal_map" => modifiers.normal_map = Some(Named),
        "bump_map" => modifiers.bump_map = Some(Named),
        _ => {}
    }
    Material { textures: vec![Textured { parameter, texture: 0 }], modifiers, ..material }
}

/// The scene with one texture, of one colour.
fn with_colour(scene: Scene, colour: [f64; 3]) -> Scene {
    let kind: TextureKind = ConstantTexture { value: Varying::Colour(colour) }.into();
    Scene { textures: vec![Texture { name: "colour".into(), kind }], ..scene }
}

fn mix(a: usize, b: usize, amount: f64) -> Material {
    Material { name: "mix".into(), kind: MixParameters { a, b, amount }.into(), ..Material::default() }
}

/// A wall across the view, of the last material, in a white sky: its radiance is its reflectance.
fn wall(materials: Vec<Material>) -> Scene {
    let last = materials.len() - 1;
    let mut scene = scene(materials, vec![plane(v(-1.0, 0.0, 0.0), -3.0, last)]);
    scene.environment = [1.0; 3];
    (scene.render.max_depth, scene.render.samples) = (1, 64);
    scene
}

#[test]
fn a_mix_has_the_weighted_mean() {
    const PATHS: [Integrator; 2] = [Integrator::Path, Integrator::PathNaive];
    let (dark, light) = (matte([0.2; 3]), matte([0.8; 3]));
    for amount in [0.0, 0.3, 1.0] {
        let scene = wall(vec![dark.clone(), light.clone(), mix(0, 1, amount)]);
        shows(&scene, &PATHS, 0.2 + 0.6 * amount);
    }
    // Of a matte and a mirror, and nested.
    let nested = wall(vec![dark.clone(), mirror([0.9; 3]), mix(0, 1, 0.4), mix(2, 0, 0.5)]);
    shows(&nested, &PATHS, 0.5 * (0.6 * 0.2 + 0.4 * 0.9) + 0.5 * 0.2);
    let by_texture = textured(mix(0, 1, 0.9), "amount");
    let by_texture = with_colour(wall(vec![dark.clone(), light.clone(), by_texture]), [0.25, 1.0, 1.0]);
    shows(&by_texture, &PATHS, 0.2 + 0.6 * 0.25);
    // Negative control.
    let (off, error) = mean(&wall(vec![dark, light, mix(0, 1, 0.35)]));
    assert!((off - 0.38).abs() > 5.0 * error, "{off} ± {error}");
}

#[test]
fn mixes_choose_by_one_evenly_distributed_number() {
    // Black and white in equal shares: the error is ½/n, while independent numbers have ½/√n.
    let mut scene = wall(vec![matte([0.0; 3]), matte([1.0; 3]), mix(0, 1, 0.5)]);
    (scene.render.samples, scene.render.integrator) = (64, Integrator::Path);
    let worst = |scene: &Scene| {
        let mut sums = vec![0.0_f64; 256];
        for_each_sample(scene, |pixel, [r, _, _]| sums[pixel] += f64::from(r));
        sums.into_iter().map(|sum| (sum - 32.0).abs()).fold(0.0, f64::max)
    };
    scene.render.sampler = Sampler::Sobol;
    assert!(worst(&scene) < 1.0 + 1e-3, "{}", worst(&scene));
    scene.render.sampler = Sampler::Independent;
    assert!(worst(&scene) > 4.0);
}

/// Sheets of the first material across the view, in front of a light of radiance 2.
fn sheets(opacity: f64, count: usize) -> Scene {
    let sheet = |x| quad(v(x, -9.0, -9.0), DVec3::Y * 18.0, DVec3::Z * 18.0, 0);
    let mut entities: Vec<_> = (0..count).map(|i| sheet(1.0 + 0.002 * i as f64)).collect();
    entities.push(emitting(flipped(quad(v(5.0, -9.0, -9.0), DVec3::Y * 18.0, DVec3::Z * 18.0, 1)), 2.0));
    let mut scene = scene(vec![with(matte([0.0; 3]), hole(opacity)), matte([0.0; 3])], entities);
    (scene.render.max_depth, scene.render.samples) = (0, 256);
    scene
}

#[test]
fn paths_continue_straight_through_holes() {
    shows(&sheets(0.5, 1), &INTEGRATORS, 1.0);
    shows(&sheets(0.3, 1), &INTEGRATORS, 1.4);
    // Each sheet chooses independently, and none is a bounce: none is allowed here.
    shows(&sheets(0.5, 2), &INTEGRATORS, 0.5);
    shows(&sheets(0.0, 3), &INTEGRATORS, 2.0);
    shows(&sheets(1.0, 1), &INTEGRATORS, 0.0);
    let mut by_texture = with_colour(sheets(1.0, 1), [0.25, 1.0, 1.0]);
    by_texture.materials[0] = textured(by_texture.materials[0].clone(), "opacity");
    shows(&by_texture, &INTEGRATORS, 1.5);
    // Negative control.
    let (off, error) = mean(&sheets(0.54, 1));
    assert!((off - 1.0).abs() > 5.0 * error, "{off} ± {error}");
}

#[test]
fn traces_record_holes() {
    for integrator in INTEGRATORS {
        // (opacity, sheets that are passed, entity that is hit last)
        for (opacity, passed, last) in [(0.0, 3, 3), (1.0, 0, 0)] {
            let mut scene = sheets(opacity, 3);
            scene.render.integrator = integrator;
            let (_, events) = common::integrator(&scene).explain(Pixel { index: 0, x: 0, y: 0 }, 0);
            let of_holes = events.iter().filter(|event| **event == Event::Pass { through: Passage::Hole });
            assert_eq!(of_holes.count(), passed, "{integrator:?}: {events:?}");
            let hits = events.iter().filter_map(|event| match event {
                Event::Hit { entity, .. } => Some(*entity),
                _ => None,
            });
            let hits: Vec<u32> = hits.collect();
            assert_eq!((hits.len(), hits.last()), (passed + 1, Some(&last)), "{integrator:?}: {events:?}");
        }
    }
}

#[test]
fn behind_a_thousand_sheets_paths_end() {
    for integrator in INTEGRATORS {
        for (count, expected) in [(1000, 2.0), (1030, 0.0)] {
            let mut scene = sheets(0.0, count);
            (scene.render.samples, scene.render.integrator) = (1, integrator);
            (scene.film.width, scene.film.height) = (2, 2);
            assert_eq!(mean(&scene).0, expected, "{integrator:?}, {count} sheets");
        }
    }
}

/// A matte floor under an area or point light, with sheets in between, outside the view of the camera.
fn shaded(opacity: f64, sheets: usize, lamp: bool) -> Scene {
    let sheet = |z| quad(v(-20.0, -20.0, z), DVec3::X * 40.0, DVec3::Y * 40.0, 0);
    let mut entities: Vec<_> = (0..sheets).map(|i| sheet(0.5 + 0.1 * i as f64)).collect();
    entities.push(plane(DVec3::Z, -1.0, 1));
    if lamp {
        entities.push(emitting(flipped(quad(v(1.0, -2.0, 2.0), DVec3::X * 4.0, DVec3::Y * 4.0, 2)), 3.0));
    }
    let materials = vec![with(matte([0.0; 3]), hole(opacity)), matte([0.6; 3]), matte([0.0; 3])];
    let mut scene = scene(materials, entities);
    if !lamp {
        scene.lights = vec![point_light(v(2.0, 0.3, 2.0), 5.0)];
    }
    // It sees only the floor.
    (scene.camera.forward, scene.camera.up) = (v(0.6, 0.0, -0.8), v(0.8, 0.0, 0.6));
    scene.camera.vertical_fov = 0.4;
    (scene.render.max_depth, scene.render.samples) = (1, 16);
    scene
}

#[test]
fn shadow_rays_are_attenuated_by_opacity() {
    for integrator in INTEGRATORS {
        let samples = |opacity, sheets| {
            let mut scene = shaded(opacity, sheets, false);
            scene.render.integrator = integrator;
            let mut all = Vec::new();
            for_each_sample(&scene, |pixel, [r, _, _]| all.push((pixel, r)));
            all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            all
        };
        let open = samples(1.0, 0);
        for (opacity, sheets, share) in [(0.5, 1, 0.5), (0.25, 3, 0.421875), (1.0, 1, 0.0), (0.0, 2, 1.0)] {
            for ((_, dim), (_, full)) in samples(opacity, sheets).into_iter().zip(&open) {
                assert!(
                    *full > 0.0 && (dim - full * share).abs() <= 1e-5 * full,
                    "{integrator:?}: {dim} of {full}"
                );
            }
        }
    }
}

#[test]
fn sampled_lights_and_lights_found_by_chance_are_attenuated_equally() {
    let mut results = Vec::new();
    for (opacity, sheets) in [(0.5, 2), (1.0, 0)] {
        for (integrator, samples) in [(Integrator::Path, 256), (Integrator::PathNaive, 2048)] {
            let mut scene = shaded(opacity, sheets, true);
            (scene.render.integrator, scene.render.samples) = (integrator, samples);
            results.push(mean(&scene));
        }
    }
    let [path, naive, open, naive_open] = results[..] else { unreachable!() };
    let agree = |(a, ea): (f64, f64), (b, eb): (f64, f64)| (a - b).abs() <= 5.0 * (ea * ea + eb * eb).sqrt();
    assert!(agree(path, naive) && agree(open, naive_open), "{results:?}");
    assert!(agree(path, (open.0 * 0.25, open.1)) && naive.1 < 0.01 * naive.0, "{results:?}");
}

#[test]
fn emission_does_not_depend_on_opacity() {
    let mut lamp = sheets(1.0, 0);
    lamp.materials[1] = with(matte([0.0; 3]), hole(0.5));
    // Behind it is another one, half of which is visible.
    lamp.entities.push(emitting(flipped(quad(v(6.0, -9.0, -9.0), DVec3::Y * 18.0, DVec3::Z * 18.0, 0)), 1.0));
    shows(&lamp, &INTEGRATORS, 2.5);
}

/// The bits of all samples of an image.
fn bits(scene: &Scene) -> Vec<(usize, [u32; 3])> {
    let mut all = Vec::new();
    for_each_sample(scene, |pixel, radiance| all.push((pixel, radiance.map(f32::to_bits))));
    all.sort_unstable();
    all
}

#[test]
fn the_back_side_has_the_other_material() {
    let back = Modifiers { back: Some(0), ..Modifiers::default() };
    let ball = |materials: Vec<Material>, material, flip_normal| {
        let mut scene =
            scene(materials, vec![Entity { flip_normal, ..sphere(v(4.0, 0.0, 0.0), 1.5, material) }]);
        scene.lights = vec![point_light(v(1.0, 2.0, 2.0), 5.0)];
        scene.environment = [0.5; 3];
        (scene.render.integrator, scene.render.max_depth) = (Integrator::Path, 3);
        bits(&scene)
    };
    let (red, green) = (matte([0.8, 0.1, 0.1]), matte([0.1, 0.8, 0.1]));
    let both = || vec![red.clone(), with(green.clone(), back)];
    for flipped in [false, true] {
        let plain = |material: &Material| ball(vec![material.clone()], 0, flipped);
        let (seen, unseen) = if flipped { (&red, &green) } else { (&green, &red) };
        let found = ball(both(), 1, flipped);
        assert_eq!(found, plain(seen));
        assert_ne!(found, plain(unseen));
    }
}

/// A matte surface under a sun, seen from the origin along +x; the radiance for a normal.
fn sunlit(entity: Entity, material: Material) -> Scene {
    let mut scene = scene(vec![material], vec![entity]);
    let sun = DirectionalLightParameters { direction: -TO_SUN, irradiance: [PI; 3], angular_diameter: 0.0 };
    scene.lights = vec![sun.into()];
    scene.camera.vertical_fov = 0.2;
    (scene.render.max_depth, scene.render.samples) = (1, 1);
    scene
}

/// Towards the sun.
const TO_SUN: DVec3 = DVec3::new(-0.6, 0.48, 0.64);

/// Requires a normal, by the light that it receives.
fn has_normal(scene: &Scene, normal: DVec3, tolerance: f64) {
    let expected = 0.5 * normal.normalize().dot(TO_SUN).abs();
    for integrator in INTEGRATORS {
        let mut scene = scene.clone();
        scene.render.integrator = integrator;
        for_each_sample(&scene, |_, [r, _, _]| {
            assert!((f64::from(r) - expected).abs() <= tolerance, "{integrator:?}: {r}, not {expected}");
        });
    }
}

/// Normals in the encoding of the texture.
fn encoded(normal: DVec3) -> [f64; 3] {
    normal.normalize().to_array().map(|x| (x + 1.0) / 2.0)
}

/// A triangle across the view, with these uv at its corners.
fn triangle(uv: [[f32; 2]; 3]) -> Entity {
    let mesh = Mesh {
        positions: vec![[3.0, 9.0, -9.0], [3.0, -9.0, -9.0], [3.0, 0.0, 18.0]],
        uv: uv.to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    Entity { shape: Shape::Mesh { mesh: Arc::new(mesh), transform: DAffine3::IDENTITY }, ..Entity::default() }
}

/// Surfaces across the view, with their directions along u, along v and outwards.
fn flats() -> Vec<(&'static str, Entity, [DVec3; 3])> {
    let (y, z) = (DVec3::Y, DVec3::Z);
    let towards = -DVec3::X;
    let sheet = quad(v(3.0, 9.0, -9.0), -y * 18.0, z * 18.0, 0);
    let turned = quad(v(3.0, 9.0, -9.0), z * 18.0, -y * 18.0, 0);
    vec![
        ("quad", sheet.clone(), [-y, z, towards]),
        ("flipped quad", flipped(sheet), [-y, z, -towards]),
        ("quad from behind", turned, [z, -y, -towards]),
        ("mesh", triangle([[0.0, 0.0], [1.0, 0.0], [0.5, 1.5]]), [-y, z, towards]),
        ("mirrored mesh", triangle([[1.0, 0.0], [0.0, 0.0], [0.5, 1.5]]), [y, z, towards]),
        ("turned mesh", triangle([[0.0, 0.0], [0.0, 1.0], [1.5, 0.5]]), [z, -y, towards]),
    ]
}

#[test]
fn a_map_tilts_normals_along_u_and_v() {
    let mapped = || textured(matte([0.5; 3]), "normal_map");
    for (name, entity, [u, v, n]) in flats() {
        println!("{name}");
        let plain = with_colour(sunlit(entity.clone(), mapped()), [0.5, 0.5, 1.0]);
        has_normal(&plain, n, 1e-5);
        for tilt in [DVec3::new(0.3, 0.0, 1.0), DVec3::new(0.0, 0.3, 1.0), DVec3::new(-0.2, 0.25, 1.0)] {
            let world = u * tilt.x + v * tilt.y + n * tilt.z;
            let scene = with_colour(sunlit(entity.clone(), mapped()), encoded(tilt));
            has_normal(&scene, world, 2e-5);
            // Scaled, as in glTF: x and y of the decoded normal.
            let mut scaled = mapped();
            scaled.modifiers.normal_scale = 0.5;
            let read = tilt.normalize();
            let world = u * (read.x * 0.5) + v * (read.y * 0.5) + n * read.z;
            has_normal(&with_colour(sunlit(entity.clone(), scaled), encoded(tilt)), world, 2e-5);
        }
    }
}

#[test]
fn a_flat_map_has_no_effect() {
    // On all sides of a ball, for all integrators, and for a mirror as well.
    for material in [matte([0.7, 0.6, 0.5]), mirror([0.9; 3])] {
        for integrator in INTEGRATORS {
            let picture = |mapped| {
                let material =
                    if mapped { textured(material.clone(), "normal_map") } else { material.clone() };
                let mut scene = scene(
                    vec![material, matte([0.5; 3])],
                    vec![sphere(v(3.0, 0.0, 0.0), 1.5, 0), plane(DVec3::Z, -1.5, 1)],
                );
                scene.environment = [0.3, 0.5, 0.7];
                scene.lights = vec![point_light(v(0.0, 2.0, 2.0), 9.0)];
                (scene.render.integrator, scene.render.max_depth) = (integrator, 3);
                mean(&with_colour(scene, [0.5, 0.5, 1.0])).0
            };
            let (with, without) = (picture(true), picture(false));
            assert!((with / without - 1.0).abs() < 2e-4, "{integrator:?}: {with}, not {without}");
        }
    }
}

#[test]
fn maps_neither_leak_nor_darken() {
    let tilts = [[0.95, 0.5, 0.6], [0.1, 0.3, 0.7], [0.5, 0.99, 0.51]];
    for tilt in tilts {
        // Seen at grazing angles, up to the horizon.
        let floor = |material: Material| {
            let mut scene = with_colour(scene(vec![material], vec![plane(DVec3::Z, -0.2, 0)]), tilt);
            scene.environment = [1.0; 3];
            (scene.camera.vertical_fov, scene.render.max_depth, scene.render.samples) = (0.5, 8, 256);
            scene.render.sampler = Sampler::Sobol;
            scene.camera.forward = v(0.96, 0.0, -0.28);
            scene.camera.up = v(0.28, 0.0, 0.96);
            scene.render.integrator = Integrator::Path;
            scene
        };
        let mut pixels = vec![0.0_f64; 256];
        for_each_sample(&floor(textured(matte([1.0; 3]), "normal_map")), |pixel, [r, _, _]| {
            pixels[pixel] += f64::from(r) / 256.0;
        });
        let (least, most) = pixels.iter().fold((9.0_f64, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
        assert!(least > 0.3 && most < 1.0 + 1e-4, "{tilt:?}: {least} to {most}");
        // A mirror reflects everything, for any normal of the map.
        let (silver, _) = mean(&floor(textured(mirror([1.0; 3]), "normal_map")));
        assert!((silver - 1.0).abs() < 1e-5, "{tilt:?}: {silver}");
        // Light below the floor remains there.
        for integrator in INTEGRATORS {
            let mut lit = floor(textured(matte([1.0; 3]), "normal_map"));
            lit.environment = [0.0; 3];
            lit.lights = vec![point_light(v(1.0, 0.0, -0.5), 9.0)];
            lit.render.integrator = integrator;
            assert_eq!(mean(&lit).0, 0.0, "{integrator:?}");
        }
    }
}

#[test]
fn first_hits_are_those_of_samples() {
    let mut scene = sheets(0.5, 1);
    scene.materials[0].kind = matte([0.25; 3]).kind;
    scene.materials[1].kind = matte([0.75; 3]).kind;
    scene.materials.extend([matte([0.5; 3]), mix(1, 2, 0.5)]);
    scene.entities[1].material = 3;
    let integrator = common::integrator(&scene);
    let region = Region::whole(16, 16);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut hits = Vec::new();
    integrator.first_hits(
        Level::available()[0],
        &Paths { pixels: &pixels, first_sample: 0, samples: 64 },
        &mut hits,
    );
    let count = |albedo: f32, entity| {
        hits.iter().filter(|hit| hit.albedo == [albedo; 3] && hit.entity == entity).count()
    };
    let n = 16 * 16 * 64;
    assert_eq!(hits.len(), n);
    let shares = [(count(0.25, 0), 0.5), (count(0.75, 1), 0.25)]
        .map(|(count, share)| (count as f64 / n as f64, share));
    for (found, share) in shares {
        assert!((found - share).abs() < 0.02, "{shares:?}");
    }
    // For a mix, the material is the entity's own; surfaces behind a hole have their own depth.
    assert!(hits.iter().all(|hit| hit.met && [0, 3].contains(&hit.material)));
    assert!(hits.iter().all(|hit| (hit.depth - if hit.entity == 0 { 1.0 } else { 5.0 }).abs() < 1e-4));
    // A map changes the visible normals.
    let tilted =
        with_colour(sunlit(flats().remove(0).1, textured(matte([0.5; 3]), "normal_map")), [0.8, 0.5, 0.9]);
    let mut hits = Vec::new();
    let paths = Paths { pixels: &pixels[..1], first_sample: 0, samples: 1 };
    common::integrator(&tilted).first_hits(Level::available()[0], &paths, &mut hits);
    let normal = hits[0].normal.map(f64::from);
    let expected = (-DVec3::Y * 0.6 - DVec3::X * 0.8).normalize();
    assert!((DVec3::from_array(normal) - expected).length() < 1e-5, "{normal:?}");
}
