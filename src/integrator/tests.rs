//! Lights at infinity: estimates of integrators, compared with formulas.

use super::{Paths, build};
use crate::light::test_sky::Sky;
use crate::light::{Distant, LightTable};
use crate::math::lanes::Level;
use crate::sampling::Pixel;
use crate::sampling::warp::FilmOffset;
use crate::scene;
use crate::world::{AcceleratorChoice, World, compile};
use std::path::Path;
use std::sync::Arc;

/// The mean radiance and its standard error at the origin of a floor, seen at an angle. A lamp that subtends a
/// sixteenth of the floor's hemisphere hangs above it; further lights are added.
fn seen(integrator: &str, material: &str, lamp: f32, add: impl FnOnce(&mut LightTable)) -> (f64, f64) {
    let text = format!(
        r#"
        [film]
        width = 1
        height = 1
        [camera]
        eye = [3, 0, 2]
        look_at = [0, 0, 0]
        vertical_fov = 0.01
        [render]
        integrator = "{integrator}"
        [materials.floor]
        {material}
        [materials.black]
        type = "matte"
        reflectance = [0, 0, 0]
        [[entities]]
        name = "floor"
        shape = {{ type = "plane", normal = [0, 0, 1], distance = 0 }}
        material = "floor"
        [[entities]]
        name = "lamp"
        shape = {{ type = "sphere", center = [0, 0, 4], radius = 1 }}
        material = "black"
        emission = [{lamp}, {lamp}, {lamp}]
        "#
    );
    let scene = scene::parse(&text, Path::new("test.toml")).unwrap().scene;
    let (mut tables, surfaces) = compile(&scene, 1, 1).unwrap();
    add(&mut tables.lights);
    tables.lights.build_tree();
    let world = World::new(&surfaces, AcceleratorChoice::Simple);
    let integrator = build(&scene.render, FilmOffset::Centre, Arc::new(tables), Arc::new(world));
    let (mut out, samples) = (Vec::new(), 20_000);
    let pixels = &[Pixel { index: 0, x: 0, y: 0 }];
    integrator.trace(Level::SCALAR, &Paths { pixels, first_sample: 0, samples }, &mut out);
    let values: Vec<f64> = out.iter().map(|path| f64::from(path.sample.radiance[1])).collect();
    let mean = values.iter().sum::<f64>() / f64::from(samples);
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / f64::from(samples - 1);
    (mean, (variance / f64::from(samples)).sqrt())
}

const MATTE: &str = "type = \"matte\"\nreflectance = [0.5, 0.5, 0.5]";
const MIRROR: &str = "type = \"mirror\"\nreflectance = [0.5, 0.5, 0.5]";
const SKY: Sky = Sky { radiance: [2.0; 3] };
const SUN: Distant = Distant { towards: [0.0, 0.6, 0.8], irradiance: [3.0; 3] };

#[track_caller]
fn agrees((mean, error): (f64, f64), expected: f64) {
    assert!((mean - expected).abs() <= 4.5 * error + 1e-5, "{mean} ± {error} is not {expected}");
    // Otherwise the test could not tell it from half or twice the light from infinity.
    assert!(error < 0.03 * expected, "{mean} ± {error}");
}

#[test]
fn a_sampled_sky_lights_a_floor_as_the_environment_does() {
    for integrator in ["path", "path-naive", "whitted"] {
        // The lamp occludes a sixteenth of the sky, weighted by cosine.
        agrees(seen(integrator, MATTE, 0.0, |lights| _ = lights.push(SKY)), 0.5 * 2.0 * 15.0 / 16.0);
        let lit = 0.5 * (2.0 * 15.0 / 16.0 + 10.0 / 16.0);
        agrees(seen(integrator, MATTE, 10.0, |lights| _ = lights.push(SKY)), lit);
        // In a mirror, only the escaping ray finds the sky.
        agrees(seen(integrator, MIRROR, 0.0, |lights| _ = lights.push(SKY)), 0.5 * 2.0);
    }
    // Two skies add their radiances.
    let two = |lights: &mut LightTable| {
        lights.push(SKY);
        lights.push(Sky { radiance: [1.0; 3] });
    };
    agrees(seen("path", MATTE, 0.0, two), 0.5 * 3.0 * 15.0 / 16.0);
}

#[test]
fn a_sun_lights_a_floor_by_its_cosine() {
    let expected = 0.5 / std::f64::consts::PI * 3.0 * 0.8;
    for integrator in ["path", "path-naive", "whitted"] {
        agrees(seen(integrator, MATTE, 0.0, |lights| _ = lights.push(SUN)), expected);
        // No ray hits the sun.
        let (mean, _) = seen(integrator, MIRROR, 0.0, |lights| _ = lights.push(SUN));
        assert_eq!(mean, 0.0);
        // An occluder blocks all of it at any distance.
        let behind = Distant { towards: [0.0, 0.0, 1.0], ..SUN };
        let (mean, _) = seen(integrator, MATTE, 0.0, |lights| _ = lights.push(behind));
        assert_eq!(mean, 0.0);
    }
}
