//! `path`, which samples lights, agrees with `path-naive`, which finds them by chance; and `sobol` agrees with
//! `independent` numbers.
//!
//! The sides have different seeds, and are compared at the level stated in `common::blocks`.

use crate::common;
use crate::common::blocks::compare;
use crate::common::scenes::{
    checkerboard, cover, cuboid, cylinder, disk, emitting, flipped, gallery, glass, glow, matte, mirror,
    modified, plane, point_light, quad, scene, sized, smallpt, sphere, v,
};
use crate::common::{blocks::Estimate, blocks::Verdict, estimate, for_each_sample};
use stride::light::Falloff;
use stride::scene::{
    ConductorParameters, DielectricParameters, DirectionalLightParameters, Entity, Integrator, Material,
    MaterialKind, MatteParameters, Sampler, Scene, SpotLightParameters,
};

fn with(mut scene: Scene, integrator: Integrator, spp: u32, seed: u32) -> Scene {
    scene.render.integrator = integrator;
    scene.render.samples = spp;
    scene.render.seed = seed;
    scene
}

fn verdict(naive: Scene, path: Scene, spp: [u32; 2]) -> Verdict {
    let naive = estimate(&with(naive, Integrator::PathNaive, spp[0], 1));
    let path = estimate(&with(path, Integrator::Path, spp[1], 2));
    compare(&naive.blocks(), &path.blocks())
}

fn agree(scene: Scene, spp: [u32; 2]) {
    let verdict = verdict(scene.clone(), scene, spp);
    println!("{verdict}");
    assert!(verdict.agrees(), "{verdict}");
    // With more noise, everything would agree.
    assert!(verdict.rms > 0.8, "{verdict}");
}

#[test]
fn on_the_cover() {
    agree(cover(64, 48), [4096, 512]);
}

#[test]
fn in_smallpt_s_box_with_a_huge_sphere_as_light() {
    let mut scene = smallpt(64, 48);
    scene.render.max_depth = 6;
    agree(scene, [2048, 512]);
}

/// A room with every kind of light: a quad, small spheres, points, a sky, and a light seen from inside.
fn many_lights() -> Scene {
    let materials =
        vec![matte([0.7, 0.6, 0.5]), matte([0.3; 3]), checkerboard(0, 1, 2.0), glass(1.5), mirror([0.9; 3])];
    let mut entities = vec![
        plane(v(0.0, 0.0, 1.0), 0.0, 2),
        sphere(v(4.0, 1.2, 0.8), 0.8, 3),
        sphere(v(5.0, -1.0, 0.9), 0.9, 4),
        sphere(v(4.0, 0.0, 0.5), 0.5, 0),
        emitting(quad(v(3.0, -1.0, 3.0), v(0.0, 1.5, 0.0), v(1.5, 0.0, 0.0), 0), 4.0),
        // A sphere that emits inwards, which rays can only enter through its surface: dark from outside.
        flipped(emitting(sphere(v(7.0, 2.0, 1.0), 0.7, 0), 3.0)),
    ];
    for i in 0..6 {
        let x = 3.0 + f64::from(i) * 0.6;
        entities.push(emitting(sphere(v(x, 1.6 - f64::from(i) * 0.5, 0.25), 0.2, 0), 2.0 + f64::from(i)));
    }
    let mut scene = sized(scene(materials, entities), 64, 48);
    scene.camera.eye = v(0.0, 0.0, 1.5);
    scene.lights = vec![point_light(v(4.0, 2.0, 2.0), 3.0), point_light(v(6.0, -2.0, 2.5), 1.0)];
    scene.environment = [0.2, 0.25, 0.3];
    scene.render.max_depth = 5;
    scene
}

#[test]
fn with_every_kind_of_light() {
    agree(many_lights(), [2048, 512]);
}

/// Disks, cylinders and boxes: lights of each kind, one a lampshade that emits inwards, a can and a box of glass, and
/// checks.
fn shop() -> Scene {
    let materials =
        vec![matte([0.7, 0.6, 0.5]), matte([0.3; 3]), checkerboard(0, 1, 8.0), glass(1.5), mirror([0.9; 3])];
    let entities = vec![
        plane(v(0.0, 0.0, 1.0), 0.0, 0),
        // Large enough to be found often: rare hits would hide differences.
        emitting(disk(v(4.0, 0.5, 3.0), v(0.0, 0.6, -0.8), 1.2, 0), 2.0),
        emitting(cylinder(v(3.0, -2.0, 1.0), v(4.0, -1.5, 2.0), 0.3, 0), 2.0),
        emitting(cuboid(v(5.0, 2.0, 0.0), v(5.5, 2.5, 1.0), 0), 2.0),
        flipped(emitting(cylinder(v(5.5, -1.5, 0.2), v(5.5, -1.5, 1.2), 0.5, 0), 3.0)),
        cylinder(v(3.5, 1.0, 0.0), v(3.5, 1.0, 0.8), 0.5, 2),
        disk(v(3.5, 1.0, 0.8), v(0.0, 0.0, 1.0), 0.5, 2),
        cuboid(v(3.5, -0.6, 0.01), v(4.2, 0.1, 0.9), 3),
        cuboid(v(6.5, -0.5, 0.0), v(7.0, 1.5, 2.0), 4),
    ];
    let mut scene = sized(scene(materials, entities), 64, 48);
    scene.camera.eye = v(0.0, 0.0, 1.5);
    scene.environment = [0.1, 0.12, 0.15];
    scene.render.max_depth = 6;
    scene
}

#[test]
fn with_disks_cylinders_and_boxes() {
    agree(shop(), [8192, 512]);
}

/// Rough metals, rough glass, a rough sheet and rough matte under a wide sun, a light and spots.
fn rough_surfaces() -> Scene {
    let material = |kind: MaterialKind| Material { name: "rough".into(), kind, ..Material::default() };
    let metal = |roughness| {
        let (eta, k) = (Some([0.2, 0.9, 1.1]), Some([3.9, 2.4, 2.2]));
        material(ConductorParameters { metal: None, eta, k, roughness }.into())
    };
    let dielectric = |roughness, thin_walled| {
        let (reflectance, transmittance) = ([1.0; 3], [0.9; 3]);
        let (ior, absorption, priority) = (1.5, [0.0; 3], 0.0);
        let parameters = DielectricParameters {
            ior,
            roughness,
            absorption,
            priority,
            thin_walled,
            reflectance,
            transmittance,
        };
        material(parameters.into())
    };
    let materials = vec![
        material(MatteParameters { reflectance: [0.6, 0.5, 0.4], roughness: 0.9 }.into()),
        metal([0.5; 2]),
        metal([0.3, 0.7]),
        dielectric([0.5; 2], false),
        dielectric([0.5; 2], true),
        metal([0.0; 2]),
        dielectric([0.0; 2], true),
    ];
    let entities = vec![
        plane(v(0.0, 0.0, 1.0), 0.0, 0),
        sphere(v(4.0, 1.4, 0.8), 0.8, 1),
        sphere(v(5.0, -0.2, 0.9), 0.9, 2),
        sphere(v(3.6, -1.5, 0.7), 0.7, 3),
        quad(v(3.0, -0.4, 0.1), v(0.2, 0.7, 0.0), v(0.0, 0.0, 0.8), 4),
        sphere(v(6.5, 2.2, 0.8), 0.8, 5),
        quad(v(3.2, 2.4, 0.1), v(0.4, 0.6, 0.0), v(0.0, 0.0, 0.8), 6),
        emitting(quad(v(3.0, -1.0, 4.0), v(0.0, 2.5, 0.0), v(2.5, 0.0, 0.0), 0), 2.0),
    ];
    let mut scene = sized(scene(materials, entities), 64, 48);
    scene.camera.eye = v(0.0, 0.0, 1.5);
    let spot = |falloff: Falloff| SpotLightParameters {
        position: v(2.0, 3.0 - 2.0 * f64::from(falloff as u8), 3.0),
        direction: v(2.5, -1.0, -2.5),
        intensity: Some([4.0, 3.0, 2.0]),
        power: None,
        cone_angle: 40.0,
        penumbra_angle: Some(25.0),
        falloff,
    };
    let sun = DirectionalLightParameters {
        direction: v(0.4, 0.5, -1.0),
        irradiance: [0.8, 0.7, 0.6],
        angular_diameter: 50.0,
    };
    scene.lights = vec![sun.into()];
    scene
        .lights
        .extend([Falloff::Smoothstep, Falloff::Angle, Falloff::Squared].map(|falloff| spot(falloff).into()));
    scene.lights.push(DirectionalLightParameters { angular_diameter: 0.0, ..sun }.into());
    scene.environment = [0.1, 0.12, 0.15];
    scene.render.max_depth = 5;
    scene
}

#[test]
fn with_rough_surfaces_and_a_sun() {
    agree(rough_surfaces(), [4096, 512]);
}

/// Under a wide sun, with most surfaces outside the cone of the only spot.
#[test]
fn beside_the_cone_of_a_spot() {
    let mut scene = rough_surfaces();
    scene.entities.truncate(4);
    scene.lights.truncate(2);
    agree(scene, [2048, 256]);
}

/// A sheet, a box and a sphere that emit textures.
fn textured_lights() -> Scene {
    let mut scene = gallery(64, 48);
    let textured = |entity| Entity { emission_texture: Some(13), ..entity };
    scene.entities = vec![
        plane(v(0.0, 0.0, 1.0), -1.5, 6),
        // Behind, so that no block shows only the sky, which has no noise.
        plane(v(-1.0, 0.0, 0.0), -8.0, 6),
        sphere(v(4.0, 1.0, -0.7), 0.8, 6),
        textured(quad(v(3.0, -1.5, 1.5), v(0.0, 2.5, 0.0), v(2.0, 0.3, 0.4), 6)),
        flipped(textured(quad(v(6.5, -2.0, -1.2), v(0.0, 3.0, 0.0), v(0.4, 0.0, 2.0), 6))),
        textured(cuboid(v(3.0, -1.6, -1.4), v(3.8, -1.0, -0.6), 6)),
        textured(sphere(v(5.0, 2.4, -0.5), 0.6, 6)),
    ];
    scene.render.max_depth = 4;
    scene
}

#[test]
fn with_lights_that_are_textures() {
    agree(textured_lights(), [2048, 512]);
}

#[test]
fn with_textured_lights_of_all_shapes_and_a_second_set_of_uv() {
    agree(glow(64, 48), [1536, 1024]);
}

#[test]
fn among_textured_surfaces() {
    agree(gallery(64, 48), [2048, 512]);
}

#[test]
fn among_mixes_opacities_and_maps() {
    agree(modified(64, 48), [768, 192]);
}

#[test]
fn inside_a_light() {
    // A closed sphere that emits inwards, around a matte ball.
    let materials = vec![matte([0.5; 3]), matte([0.8, 0.4, 0.2])];
    let around = flipped(emitting(sphere(v(0.0, 0.0, 0.0), 5.0, 0), 0.5));
    let mut scene = sized(scene(materials, vec![around, sphere(v(2.5, 0.0, 0.0), 1.0, 1)]), 32, 24);
    scene.render.max_depth = 8;
    agree(scene, [256, 256]);
}

#[test]
fn under_a_sun_too_large_and_bright_for_single_precision() {
    // Its power alone is above the largest float.
    let materials = vec![matte([0.5; 3])];
    let sun = emitting(sphere(v(1e15, 0.0, 8e14), 5e14, 0), 1e9);
    let lamp = emitting(sphere(v(3.0, 0.5, 0.5), 0.3, 0), 5.0);
    let entities = vec![sun, lamp, plane(v(0.0, 0.0, 1.0), -1.0, 0), sphere(v(4.0, -1.0, 0.0), 1.0, 0)];
    let mut scene = sized(scene(materials, entities), 32, 24);
    scene.render.max_depth = 3;
    agree(scene, [256, 256]);
}

#[test]
fn a_lamp_two_percent_brighter_is_detected() {
    let mut brighter = many_lights();
    for entity in &mut brighter.entities {
        entity.emission = entity.emission.map(|e| e * 1.02);
    }
    for light in &mut brighter.lights {
        let stride::scene::Light::Point(point) = light else { panic!("a light of another kind") };
        point.intensity = point.intensity.map(|rgb| rgb.map(|e| e * 1.02));
    }
    brighter.environment = brighter.environment.map(|e| e * 1.02);
    let verdict = verdict(many_lights(), brighter, [4096, 1024]);
    assert!(!verdict.agrees(), "{verdict}");
}

/// An image by `sobol` with a noise estimate: from images with different seeds. The spread of the samples of a single
/// image is not its error.
fn replicated(mut scene: Scene, replicates: u32, spp: u32) -> Estimate {
    let (width, height) = (scene.film.width, scene.film.height);
    scene.render.sampler = Sampler::Sobol;
    scene.render.samples = spp;
    let mut estimate = Estimate::new(width, height);
    for seed in 0..replicates {
        scene.render.seed = 1000 + seed;
        let mut sums = vec![[0.0; 3]; (width * height) as usize];
        for_each_sample(&scene, |pixel, radiance| {
            sums[pixel].iter_mut().zip(radiance).for_each(|(sum, x)| *sum += f64::from(x));
        });
        for (pixel, sum) in sums.iter().enumerate() {
            estimate.add(pixel, sum.map(|sum| (sum / f64::from(spp)) as f32));
        }
    }
    estimate
}

#[test]
fn sobol_agrees_with_independent_numbers_with_less_noise() {
    let (replicates, spp) = (32, 64);
    for (name, scene) in [("cover", cover(64, 48)), ("many lights", many_lights())] {
        for integrator in [Integrator::PathNaive, Integrator::Path] {
            let scene = with(scene.clone(), integrator, replicates * spp, 1);
            let independent = estimate(&scene).blocks();
            let sobol = replicated(scene, replicates, spp).blocks();
            let verdict = compare(&independent, &sobol);
            let total = |blocks: &common::blocks::Blocks| blocks.variance.iter().flatten().sum::<f64>();
            let ratio = total(&sobol) / total(&independent);
            println!("{name}, {integrator:?}: {verdict}; variance {ratio:.3} of that of independent numbers");
            assert!(verdict.agrees(), "{name}, {integrator:?}: {verdict}");
            assert!(ratio < 0.85, "{name}, {integrator:?}: {ratio}");
        }
    }
    // Negative control.
    let mut brighter = many_lights();
    brighter.entities.iter_mut().for_each(|entity| entity.emission = entity.emission.map(|e| e * 1.02));
    let brighter = replicated(with(brighter, Integrator::Path, 1, 1), replicates, spp);
    let independent = estimate(&with(many_lights(), Integrator::Path, replicates * spp, 1));
    assert!(!compare(&independent.blocks(), &brighter.blocks()).agrees());
}
