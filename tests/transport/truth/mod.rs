//! Images compared with mathematics, and with an independent renderer.

mod references;

use crate::common::blocks::compare;
use crate::common::scenes::*;
use crate::common::{estimate, for_each_sample};
use glam::DVec3;
use std::f64::consts::PI;
use stride::scene::{Entity, Integrator, PlaneParameters, Scene, Shape};

/// Requires that every sample of a scene has one radiance, within a relative error.
fn every_sample_is(scene: &Scene, expected: [f64; 3], tolerance: f64) {
    for_each_sample(scene, |pixel, radiance| {
        for (got, expected) in radiance.into_iter().zip(expected) {
            let off = (f64::from(got) - expected).abs();
            assert!(off <= tolerance * expected, "pixel {pixel}: {radiance:?}, not {expected}");
        }
    });
}

/// Requires a mean over an image whose pixels all have the same expectation.
fn mean_is(scene: &Scene, expected: [f64; 3]) {
    let (mut n, mut sum, mut squares) = (0.0, [0.0; 3], [0.0; 3]);
    for_each_sample(scene, |_, radiance| {
        n += 1.0;
        for (c, x) in radiance.map(f64::from).into_iter().enumerate() {
            sum[c] += x;
            squares[c] += x * x;
        }
    });
    for c in 0..3 {
        let mean = sum[c] / n;
        let error = ((squares[c] / n - mean * mean).max(0.0) / n).sqrt();
        // Exceeded with probability 10⁻⁶.
        let bound = 4.9 * error + 2e-5 * expected[c];
        assert!((mean - expected[c]).abs() <= bound, "{mean} is not {} ± {error:e}", expected[c]);
        assert!(
            bound < 0.02 * expected[c].max(1e-3),
            "too noisy for a comparison: ± {error:e} of {}",
            expected[c]
        );
    }
}

fn both_integrators(mut scene: Scene, check: impl Fn(&Scene)) {
    for integrator in [Integrator::PathNaive, Integrator::Whitted] {
        scene.render.integrator = integrator;
        check(&scene);
    }
}

#[test]
fn inside_an_emitting_sphere_each_bounce_adds_half_of_the_last() {
    let inside = |entity: Entity| scene(vec![matte([0.5; 3])], vec![emitting(entity, 0.5)]);
    let mut furnace = inside(flipped(sphere(v(0.3, -0.2, 0.1), 2.0, 0)));
    for depth in 0..=10 {
        furnace.render.max_depth = depth;
        every_sample_is(&furnace, [1.0 - 0.5_f64.powi(depth as i32 + 1); 3], 0.0);
    }
    // The same sphere with emission on the outside is dark inside.
    every_sample_is(&inside(sphere(v(0.3, -0.2, 0.1), 2.0, 0)), [0.0; 3], 0.0);
}

/// The direction of the camera's ray through a pixel's centre, in double precision.
fn through(scene: &Scene, pixel: usize) -> DVec3 {
    let (w, h) = (f64::from(scene.film.width), f64::from(scene.film.height));
    let (x, y) = ((pixel % w as usize) as f64 + 0.5, (pixel / w as usize) as f64 + 0.5);
    let side = 2.0 * (scene.camera.vertical_fov / 2.0).tan() / h;
    let left = scene.camera.up.cross(scene.camera.forward).normalize();
    let up = scene.camera.forward.cross(left);
    (scene.camera.forward + left * (w / 2.0 - x) * side + up * (h / 2.0 - y) * side).normalize()
}

/// A floor 3 below the camera, which looks down at it.
fn floor() -> Scene {
    let mut scene = scene(vec![matte([0.8, 0.4, 0.2])], vec![plane(DVec3::Z, -3.0, 0)]);
    (scene.camera.forward, scene.camera.up) = (DVec3::NEG_Z, DVec3::X);
    scene
}

/// The point of the floor seen through a pixel's centre.
fn on_floor(scene: &Scene, pixel: usize) -> DVec3 {
    let d = through(scene, pixel);
    scene.camera.eye + d * ((-3.0 - scene.camera.eye.z) / d.z)
}

#[test]
fn a_floor_under_a_point_light_has_the_radiance_of_the_inverse_square() {
    let position = v(1.0, 0.5, 1.5);
    let mut lit = floor();
    lit.lights = vec![point_light(position, 10.0)];
    lit.entities.push(quad(v(-9.0, 1.0, -1.0), DVec3::X * 18.0, DVec3::Y * 0.6, 0));
    // One bounce: light from the quad's underside is left out.
    lit.render.max_depth = 1;
    both_integrators(lit, |scene| {
        let (mut lit, mut shadowed) = (0, 0);
        for_each_sample(scene, |pixel, radiance| {
            let d = through(scene, pixel);
            // The quad occludes a strip of the floor from the camera.
            let at_quad = d * (-1.0 / d.z);
            if (0.9..1.7).contains(&at_quad.y) {
                return;
            }
            let p = on_floor(scene, pixel);
            let to_light = position - p;
            // The point at which the segment to the light crosses the quad's height.
            let y = p.y + to_light.y * 2.0 / to_light.z;
            if (0.99..1.01).contains(&y) || (1.59..1.61).contains(&y) {
                return;
            }
            let shadow = (1.0..1.6).contains(&y);
            let cos = to_light.normalize().z;
            let irradiance = if shadow { 0.0 } else { 10.0 * cos / to_light.length_squared() };
            for (got, rho) in radiance.into_iter().zip([0.8, 0.4, 0.2]) {
                let expected = rho / PI * irradiance;
                let off = (f64::from(got) - expected).abs();
                assert!(off <= 1e-5 * expected, "pixel {pixel}: {got}, not {expected}");
            }
            if shadow { shadowed += 1 } else { lit += 1 }
        });
        assert!(lit > 1000 && shadowed > 200, "{lit} illuminated, {shadowed} in the shadow");
    });
}

#[test]
fn several_point_lights_add_up() {
    // Whitted samples each light; a path samples one of them with a weight, which has the same mean.
    let lights = [(v(1.0, 0.5, 1.5), 10.0), (v(-2.0, 0.0, 4.0), 30.0), (v(0.0, -3.0, -1.0), 2.0)];
    let mut lit = sized(floor(), 1, 1);
    lit.camera.vertical_fov = 0.1;
    lit.render.max_depth = 1;
    lit.lights = lights.map(|(position, intensity)| point_light(position, intensity)).to_vec();
    let p = v(0.0, 0.0, -3.0);
    let irradiance: f64 = lights
        .iter()
        .map(|(at, intensity)| intensity * (*at - p).normalize().z / (*at - p).length_squared())
        .sum();
    let expected = [0.8, 0.4, 0.2].map(|rho| rho / PI * irradiance);
    lit.render.samples = 20_000;
    mean_is(&lit, expected);
    lit.render.integrator = Integrator::Whitted;
    every_sample_is(&lit, expected, 1e-5);
}

#[test]
fn a_floor_under_a_sphere_light_has_the_irradiance_of_its_cone() {
    // A sphere entirely above the horizon gives E = π·L·(r/D)²·cos θ (Howell's configuration factor B-45).
    let (centre, radius) = (v(1.5, 1.0, 0.5), 1.0);
    let mut lit = sized(floor(), 1, 1);
    lit.camera.vertical_fov = 1e-3;
    lit.render.max_depth = 1;
    lit.materials.push(matte([0.0; 3]));
    lit.entities.push(emitting(sphere(centre, radius, 1), 5.0));
    let to_light = centre - v(0.0, 0.0, -3.0);
    let irradiance = PI * 5.0 * radius * radius / to_light.length_squared() * to_light.normalize().z;
    lit.render.samples = 1_000_000;
    both_integrators(lit, |scene| mean_is(scene, [0.8, 0.4, 0.2].map(|rho| rho / PI * irradiance)));
}

#[test]
fn a_floor_under_a_square_light_has_the_irradiance_of_its_form_factor() {
    // At the zenith: four times the corner factor of a quarter (Howell C-11), E = 4·L·(a/√(1+a²))· atan(a/√(1+a²)),
    // with half the side over the distance, a.
    let mut lit = sized(floor(), 1, 1);
    lit.camera.vertical_fov = 1e-3;
    lit.render.max_depth = 1;
    // u × v points down, to the floor; the camera looks from below it.
    lit.entities.push(emitting(quad(v(-1.5, -1.5, 1.0), DVec3::Y * 3.0, DVec3::X * 3.0, 0), 2.0));
    let a: f64 = 1.5 / 4.0;
    let s = (1.0 + a * a).sqrt();
    let irradiance = 2.0 * 4.0 * (a / s) * (a / s).atan();
    lit.render.samples = 1_000_000;
    both_integrators(lit.clone(), |scene| mean_is(scene, [0.8, 0.4, 0.2].map(|rho| rho / PI * irradiance)));
    // Flipped, it illuminates the upper side.
    let light = lit.entities.pop().unwrap();
    lit.entities.push(flipped(light));
    lit.render.samples = 1000;
    both_integrators(lit, |scene| every_sample_is(scene, [0.0; 3], 0.0));
}

#[test]
fn a_mirror_shows_its_reflection_times_its_reflectance() {
    // Opposite the camera a mirror; behind the camera a glowing wall.
    let entities = vec![plane(DVec3::NEG_X, -5.0, 0), emitting(plane(DVec3::X, -2.0, 1), 3.0)];
    let mut room = scene(vec![mirror([0.9, 0.6, 0.3]), matte([0.0; 3])], entities);
    room.render.max_depth = 1;
    both_integrators(room.clone(), |scene| every_sample_is(scene, [2.7, 1.8, 0.9], 1e-6));
    room.render.max_depth = 0;
    both_integrators(room, |scene| every_sample_is(scene, [0.0; 3], 0.0));
}

/// The Fresnel reflectance of unpolarised light, from sines and tangents.
fn fresnel(cos_i: f64, eta: f64) -> f64 {
    let i = cos_i.acos();
    let t = (i.sin() / eta).asin();
    let s = ((i - t).sin() / (i + t).sin()).powi(2);
    let p = ((i - t).tan() / (i + t).tan()).powi(2);
    (s + p) / 2.0
}

#[test]
fn glass_splits_light_by_fresnel() {
    // An interface across the view. Before it the sky is 1; behind it stands a wall that glows with 4: each
    // pixel sees R·1 + (1 − R)/η²·4.
    let mut window = scene(
        vec![glass(1.5), matte([0.0; 3])],
        vec![plane(DVec3::NEG_X, -5.0, 0), emitting(plane(DVec3::NEG_X, -9.0, 1), 4.0)],
    );
    window.environment = [1.0; 3];
    window.render.max_depth = 1;
    window.camera.vertical_fov = 2.8;
    let expected = |scene: &Scene, pixel: usize| {
        let r = fresnel(through(scene, pixel).x, 1.5);
        r + (1.0 - r) / 2.25 * 4.0
    };
    window.render.integrator = Integrator::Whitted;
    for_each_sample(&window, |pixel, radiance| {
        let expected = expected(&window, pixel);
        assert!((f64::from(radiance[0]) / expected - 1.0).abs() < 1e-5, "{radiance:?}, not {expected}");
    });
    window.render.integrator = Integrator::PathNaive;
    let one = sized(window, 1, 1);
    for tilt in [0.1, 0.9, 1.3, 1.5_f64] {
        let mut one = one.clone();
        one.camera.forward = v(tilt.cos(), tilt.sin(), 0.0);
        one.render.samples = 400_000;
        mean_is(&one, [expected(&one, 0); 3]);
    }
}

#[test]
fn a_glass_sphere_in_a_white_furnace_is_invisible() {
    let mut furnace = scene(vec![glass(1.5)], vec![sphere(v(3.0, 0.2, -0.1), 2.0, 0)]);
    furnace.environment = [1.0; 3];
    furnace.render.max_depth = 60;
    furnace.render.samples = 256;
    // For every path, the loss on entry equals the gain on exit.
    every_sample_is(&furnace, [1.0; 3], 1e-5);
    // From inside, too, except for the refraction on exit, which multiplies radiance by η².
    furnace.camera.eye = v(3.0, 0.0, 0.0);
    every_sample_is(&furnace, [2.25; 3], 1e-5);
    furnace.render.integrator = Integrator::Whitted;
    furnace.render.max_depth = 40;
    furnace.render.samples = 1;
    furnace.camera.eye = DVec3::ZERO;
    every_sample_is(&furnace, [1.0; 3], 1e-4);
}

#[test]
fn an_empty_scene_is_its_environment_at_every_depth() {
    let mut sky = scene(vec![], vec![]);
    sky.environment = [0.25, 0.5, 2.0];
    for depth in [0, 1, 5] {
        sky.render.max_depth = depth;
        both_integrators(sky.clone(), |scene| every_sample_is(scene, [0.25, 0.5, 2.0], 0.0));
    }
}

#[test]
fn depth_counts_bounces_including_segments_to_lights() {
    // Seen directly, in a mirror, and in a mirror's mirror, through a corner of two mirrors.
    let lamp = || emitting(quad(v(-2.0, -20.0, -20.0), DVec3::Y * 40.0, DVec3::Z * 40.0, 1), 1.0);
    let materials = || vec![mirror([1.0; 3]), matte([0.5; 3])];
    let straight = scene(materials(), vec![flipped(emitting(plane(DVec3::X, 4.0, 1), 1.0))]);
    let once = scene(materials(), vec![plane(DVec3::X, 4.0, 0), lamp()]);
    let mut twice = scene(materials(), vec![]);
    twice.entities = vec![
        plane(v(-1.0, 1.0, 0.0).normalize(), -3.0, 0),
        plane(v(-1.0, -1.0, 0.0).normalize(), -3.0, 0),
        lamp(),
    ];
    twice.camera.vertical_fov = 0.3;
    // An illuminated wall, and the same in a mirror behind the camera.
    let mut lit = scene(materials(), vec![plane(DVec3::NEG_X, -4.0, 1)]);
    lit.lights = vec![point_light(v(1.0, 0.0, 0.0), 1.0)];
    let mut mirrored = scene(materials(), vec![plane(DVec3::NEG_X, -4.0, 0), plane(DVec3::X, -4.0, 1)]);
    mirrored.lights = vec![point_light(v(-1.0, 0.0, 0.0), 1.0)];
    for (scene, bounces) in [(straight, 0), (once, 1), (twice, 2), (lit, 1), (mirrored, 2)] {
        for depth in 0..4 {
            let mut scene = scene.clone();
            scene.render.max_depth = depth;
            both_integrators(scene, |scene| {
                let (mut dark, mut bright) = (0, 0);
                for_each_sample(scene, |_, radiance| if radiance[0] > 0.0 { bright += 1 } else { dark += 1 });
                let expected = depth >= bounces;
                let name = scene.render.integrator;
                assert!(bright == 0 || expected, "{name:?}: light after {bounces} bounces at depth {depth}");
                assert!(dark == 0 || !expected, "{name:?}: no light of {bounces} bounces at depth {depth}");
            });
        }
    }
}

#[test]
fn surfaces_emit_on_their_outward_side_only() {
    let square = |u: DVec3, w: DVec3| quad(v(4.0, -9.0, -9.0), u * 18.0, w * 18.0, 0);
    let cases = [
        // −x points to the camera.
        (plane(DVec3::NEG_X, -4.0, 0), true),
        (plane(DVec3::X, 4.0, 0), false),
        (square(DVec3::Z, DVec3::Y), true),
        (square(DVec3::Y, DVec3::Z), false),
        (sphere(v(4.0, 0.0, 0.0), 3.999, 0), true),
        (sphere(v(4.0, 0.0, 0.0), 5.0, 0), false),
    ];
    for (entity, outward) in cases {
        for (entity, lit) in [(entity.clone(), outward), (flipped(entity), !outward)] {
            let mut scene = scene(vec![matte([0.5; 3])], vec![emitting(entity.clone(), 1.0)]);
            scene.render.max_depth = 0;
            scene.camera.vertical_fov = 1.0;
            let expected = if lit { [1.0; 3] } else { [0.0; 3] };
            both_integrators(scene, |scene| every_sample_is(scene, expected, 0.0));
        }
    }
}

#[test]
fn whitted_adds_the_ambient_term_times_the_reflectance() {
    let mut dim = floor();
    dim.render.integrator = Integrator::Whitted;
    dim.render.ambient = [0.1, 0.2, 0.4];
    for depth in [0, 3] {
        dim.render.max_depth = depth;
        every_sample_is(&dim, [0.08, 0.08, 0.08], 1e-6);
    }
}

#[test]
fn the_smallpt_box_is_the_same_box_of_planes() {
    let mut bent = smallpt(64, 48);
    bent.render.samples = 400;
    // Emission 1: with 12, infrequent bright paths would make blocks too small to be normal.
    bent.entities[8].emission = [1.0; 3];
    let mut flat = bent.clone();
    flat.render.seed = 1;
    let walls = [
        (DVec3::X, 1.0),
        (DVec3::NEG_X, -99.0),
        (DVec3::Z, 0.0),
        (DVec3::NEG_Z, -170.0),
        (DVec3::Y, 0.0),
        (DVec3::NEG_Y, -81.6),
    ];
    for (entity, (normal, distance)) in flat.entities.iter_mut().zip(walls) {
        entity.shape = Shape::Plane(PlaneParameters { normal, distance });
        entity.flip_normal = false;
    }
    let verdict = compare(&estimate(&bent).blocks(), &estimate(&flat).blocks());
    assert!(verdict.agrees(), "{verdict}");
}
