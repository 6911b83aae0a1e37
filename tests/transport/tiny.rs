//! Meshes of unusual sizes look the same.

use crate::common::integrator_in;
use crate::common::scenes::*;
use glam::{DAffine3, DVec3};
use std::sync::Arc;
use stride::integrator::Paths;
use stride::math::lanes::Level;
use stride::sampling::Region;
use stride::scene::{Entity, Integrator, Mesh, Scene, Shape};
use stride::world::AcceleratorChoice;

/// A grid of matte triangles under a white sky, with a small light of triangles and a point light, seen from above. All
/// lengths are multiplied, either in the file or by the transform.
fn grid(scale: f64, by_transform: bool, smooth: bool) -> Scene {
    let (of_file, of_place) = if by_transform { (1.0, scale) } else { (scale, 1.0) };
    let mut ground = Mesh::default();
    for (i, j) in (0..5).flat_map(|i| (0..5).map(move |j| (i, j))) {
        let height = [0.0, 0.3, -0.2][(i * 3 + j * 7) % 3];
        let p = [j as f64 - 2.0, i as f64 - 2.0, height].map(|x| (x * of_file) as f32);
        ground.positions.push(p);
        if smooth {
            ground.normals.push([0.1 * height as f32, 0.0, 1.0]);
        }
        if i < 4 && j < 4 {
            let corner = (5 * i + j) as u32;
            ground.triangles.push([corner, corner + 1, corner + 6]);
            ground.triangles.push([corner, corner + 6, corner + 5]);
        }
    }
    let lamp = Mesh {
        positions: [[-0.5, -0.5, 2.0], [0.0, 0.5, 2.0], [0.5, -0.5, 2.0]]
            .map(|p| p.map(|x| x * of_file as f32))
            .into(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let placed = |form: Mesh| {
        let shape =
            Shape::Mesh { mesh: Arc::new(form), transform: DAffine3::from_scale(DVec3::splat(of_place)) };
        Entity { shape, ..mesh(Mesh::default(), 0) }
    };
    let lamp = Entity { emission: [3.0; 3], ..placed(lamp) };
    let mut scene = scene(vec![matte([0.5; 3])], vec![placed(ground), lamp]);
    scene.environment = [1.0; 3];
    scene.lights = vec![point_light(v(1.5, -1.0, 2.5) * scale, 2.0 * scale * scale)];
    scene.camera.eye = v(0.0, -8.0, 4.0) * scale;
    scene.camera.forward = v(0.0, 8.0, -4.0).normalize();
    scene
}

#[test]
fn tiny_and_huge_meshes_look_like_meshes_of_usual_size() {
    for smooth in [false, true] {
        for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
            let radiance = |scale: f64, by_transform: bool, accelerator: AcceleratorChoice| {
                let mut scene = grid(scale, by_transform, smooth);
                scene.render.integrator = integrator;
                let region = Region::whole(scene.film.width, scene.film.height);
                let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
                let mut out = Vec::new();
                let paths = Paths { pixels: &pixels, first_sample: 0, samples: 4 };
                integrator_in(&scene, accelerator).trace(Level::available()[0], &paths, &mut out);
                out.sort_by_key(|f| (f.sample.pixel, f.sample.sample));
                out.into_iter().map(|f| f.sample.radiance[0]).collect::<Vec<_>>()
            };
            let usual = radiance(1.0, false, AcceleratorChoice::Simple);
            assert!(usual.iter().any(|&x| x != 1.0 && x > 0.0));
            for (scale, by_transform) in [
                (1e-12, true),
                (1e-12, false),
                (1e-9, true),
                (1e-6, false),
                (1e6, true),
                (1e13, false),
                (1e17, true),
            ] {
                let scaled = radiance(scale, by_transform, AcceleratorChoice::Bvh);
                // A rounding can take a path past an edge: then it goes another way.
                let same = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-3 * a.abs();
                let others = usual.iter().zip(&scaled).filter(|&pair| !same(pair)).count();
                assert!(
                    50 * others <= usual.len(),
                    "{others} of {} paths differ: {integrator:?}, {scale}, {by_transform}, {smooth}",
                    usual.len()
                );
            }
        }
    }
}
