//! Whitted ray tracing samples every light, and a mesh is one: images agree with `path`, and the work is bounded.
//!
//! Images are compared at the level stated in `common::blocks`.

use crate::common::blocks::compare;
use crate::common::scenes::*;
use crate::common::{estimate, integrator};
use glam::DVec3;
use stride::integrator::Paths;
use stride::light::LEAST_TRIANGLES;
use stride::math::lanes::Level;
use stride::sampling::Region;
use stride::scene::{Entity, Integrator, Mesh, Scene};

/// A ball of 20·n² triangles.
fn ball(centre: DVec3, n: u32, radiance: f64) -> Entity {
    emitting(mesh(icosphere(centre, 0.7, n, false), 1), radiance)
}

/// A floor, lamps over it, a ball that occludes some of the light, and a point light.
fn floor(lamps: Vec<Entity>, integrator: Integrator) -> Scene {
    let mut entities = vec![plane(DVec3::Z, -1.0, 0), sphere(v(4.5, -1.0, -0.5), 0.4, 0)];
    entities.extend(lamps);
    let mut floor = sized(scene(vec![matte([0.8, 0.6, 0.4]), matte([0.0; 3])], entities), 32, 24);
    floor.lights = vec![point_light(v(2.0, 1.0, 2.0), 0.5)];
    floor.render.integrator = integrator;
    floor.render.max_depth = 1;
    floor.render.samples = 400;
    floor
}

#[test]
fn a_mesh_as_one_light_agrees_with_its_triangles() {
    // One lamp near, one far, and one of few triangles, whose lights lie between theirs.
    let lamps = |radiance: f64| {
        let few = emitting(mesh(icosphere(v(5.0, 2.0, 0.5), 0.3, 1, false), 1), 6.0);
        vec![ball(v(4.0, 0.5, 0.2), 4, radiance), few, ball(v(9.0, -4.0, 6.0), 6, 20.0)]
    };
    let mut asked = floor(lamps(3.0), Integrator::Path);
    asked.render.seed = 1;
    let asked = estimate(&asked);
    let as_one = estimate(&floor(lamps(3.0), Integrator::Whitted));
    let verdict = compare(&asked.blocks(), &as_one.blocks());
    println!("{verdict}");
    assert!(verdict.agrees(), "{verdict}");
    // Negative control: one of the lights brighter by a twentieth.
    let brighter = estimate(&floor(lamps(3.15), Integrator::Whitted));
    let verdict = compare(&asked.blocks(), &brighter.blocks());
    assert!(!verdict.agrees(), "{verdict}");
}

/// Rays per sample at one sample per pixel; at the end of such a path, `path` would sample one light.
fn rays(lamps: Vec<Entity>) -> f64 {
    let floor = floor(lamps, Integrator::Whitted);
    let region = Region::whole(floor.film.width, floor.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let paths = Paths { pixels: &pixels, first_sample: 0, samples: 1 };
    let rays = integrator(&floor).trace(Level::SCALAR, &paths, &mut Vec::new());
    rays as f64 / pixels.len() as f64
}

#[test]
fn the_work_does_not_grow_with_a_lights_triangles() {
    let at = v(4.0, 0.5, 1.5);
    for n in [4, 16, 64] {
        assert!(20 * (n * n) as usize >= LEAST_TRIANGLES);
        // From the camera and, where it hits the floor, to the point light and to the lamp.
        let rays = rays(vec![ball(at, n, 1.0)]);
        assert!((1.5..=3.0).contains(&rays), "{rays} rays per sample, {} triangles", 20 * n * n);
    }
    // Two lights, two rays.
    let two = rays(vec![ball(at, 16, 1.0), ball(at + DVec3::X * 3.0, 16, 1.0)]);
    assert!((1.5..=4.0).contains(&two), "{two}");
    // Negative control: the same triangles in parts, each of which has too few to be one light.
    let whole = icosphere(at, 0.7, 16, false);
    let parts = whole
        .triangles
        .chunks(LEAST_TRIANGLES - 1)
        .map(|triangles| emitting(mesh(Mesh { triangles: triangles.to_vec(), ..whole.clone() }, 1), 1.0));
    let rays = rays(parts.collect());
    assert!(rays > 300.0, "{rays}");
}
