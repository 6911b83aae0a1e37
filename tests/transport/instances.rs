//! Shared meshes: hits and images are those of separate copies.
//!
//! Images are compared at the level stated in `common::blocks`.

use crate::common::blocks::{Estimate, compare};
use crate::common::scenes::*;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use rand::RngExt;
use std::sync::Arc;
use stride::film::film_offset;
use stride::integrator::{self, Event, Paths};
use stride::math::lanes::Level;
use stride::math::{Frame, Ray};
use stride::sampling::{Region, Stream};
use stride::scene::{Entity, Filter, Mesh, Scene, Shape};
use stride::shape::{NOTHING, offset_origin};
use stride::world::{AcceleratorChoice, Size, TooLarge, World, compile, compile_sharing};

/// Sharing of every mesh with two instances, and of none.
const ALL: usize = 0;
const NONE: usize = usize::MAX;

fn placed(mesh: &Arc<Mesh>, transform: DAffine3, material: usize) -> Entity {
    entity(Shape::Mesh { mesh: Arc::clone(mesh), transform }, material)
}

fn transform(scale: DVec3, angle: f64, at: DVec3) -> DAffine3 {
    let turn = DQuat::from_axis_angle(v(0.3, -0.4, 1.0).normalize(), angle);
    DAffine3::from_scale_rotation_translation(scale, turn, at)
}

/// Pebbles of one smooth mesh, scaled, rotated and mirrored, on a floor; one of them is the lamp.
fn pebbles(nudge: f64, lamp: f64) -> Scene {
    let mut pebble = icosphere(DVec3::ZERO, 1.0, 6, true);
    for p in &mut pebble.positions {
        p[0] *= 1.0 + 0.3 * p[1];
    }
    pebble.uv = pebble.positions.iter().map(|p| [p[0], p[2]]).collect();
    let pebble = Arc::new(pebble);
    let place = |scale, angle, at, material| placed(&pebble, transform(scale, angle, at), material);
    let entities = vec![
        plane(DVec3::Z, -1.0, 0),
        place(v(1.0, 1.0, 0.6), 0.3, v(5.0, -1.5, -0.4 + nudge), 0),
        place(v(0.7, -0.9, 0.9), 2.0, v(5.0, 1.2, -0.2), 2),
        place(DVec3::splat(0.5), 1.0, v(3.5, 0.1, -0.5), 1),
        place(v(0.2, 1.2, -1.4), 4.0, v(7.0, 0.3, 0.3), 3),
        flipped(place(DVec3::splat(0.6), 5.0, v(4.2, 2.4, 0.8), 0)),
        emitting(place(v(0.6, 0.6, 0.3), 0.0, v(4.0, 0.0, 2.2), 0), lamp),
    ];
    let materials = vec![matte([0.7, 0.6, 0.5]), mirror([0.9; 3]), glass(1.5), matte([0.2, 0.3, 0.8])];
    let mut all = scene(materials, entities);
    all.materials.push(checkerboard(0, 3, 4.0));
    all.entities[4].material = 4;
    all.environment = [0.3; 3];
    all.film.filter = Filter::Box { radius: 0.5 };
    all.render.max_depth = 6;
    sized(all, 48, 36)
}

fn tracer(scene: &Scene, accelerator: AcceleratorChoice, sharing: usize) -> Box<dyn integrator::Integrator> {
    let (compiled, surfaces) = compile_sharing(scene, scene.film.width, scene.film.height, sharing).unwrap();
    let (world, offset) = (World::new(&surfaces, accelerator), film_offset(&scene.film));
    let compiled = Arc::new(compiled.with_camera_media(&world));
    integrator::build(&scene.render, offset, compiled, Arc::new(world))
}

fn samples(
    scene: &Scene,
    accelerator: AcceleratorChoice,
    sharing: usize,
    level: Level,
    samples: u32,
) -> Vec<(u32, [f32; 3])> {
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut out = Vec::new();
    tracer(scene, accelerator, sharing).trace(
        level,
        &Paths { pixels: &pixels, first_sample: 0, samples },
        &mut out,
    );
    out.sort_by_key(|f| (f.sample.pixel, f.sample.sample));
    out.into_iter().map(|f| (f.sample.pixel, f.sample.radiance)).collect()
}

fn picture(scene: &Scene, sharing: usize, seed: u32) -> Estimate {
    let mut scene = scene.clone();
    scene.render.seed = seed;
    let mut estimate = Estimate::new(scene.film.width, scene.film.height);
    for (pixel, radiance) in samples(&scene, AcceleratorChoice::Bvh, sharing, Level::available()[0], 256) {
        estimate.add(pixel as usize, radiance);
    }
    estimate
}

#[test]
fn only_worthwhile_meshes_are_shared() {
    let fine = Arc::new(icosphere(DVec3::ZERO, 1.0, 41, false));
    let coarse = Arc::new(icosphere(DVec3::ZERO, 1.0, 4, false));
    let at = |x: f64| DAffine3::from_translation(v(x, 0.0, 0.0));
    let instances = |entities: Vec<Entity>| {
        let (tables, surfaces) = compile(&scene(vec![matte([0.5; 3])], entities), 16, 16).unwrap();
        let shared = &surfaces.instances;
        let triangles = &surfaces.triangles;
        assert_eq!(tables.surfaces.instances().is_some(), !shared.is_empty());
        (shared.len(), triangles.placed(), triangles.len())
    };
    let one = fine.triangles.len();
    assert_eq!(instances(vec![placed(&fine, at(0.0), 0)]), (0, one, one));
    assert_eq!(instances(vec![placed(&fine, at(0.0), 0), placed(&fine, at(5.0), 0)]), (2, 0, one));
    // A mesh with equal triangles from another file is another mesh.
    let copy = Arc::new((*fine).clone());
    assert_eq!(instances(vec![placed(&fine, at(0.0), 0), placed(&copy, at(5.0), 0)]), (0, 2 * one, 2 * one));
    let few = coarse.triangles.len();
    assert_eq!(instances(vec![placed(&coarse, at(0.0), 0), placed(&coarse, at(5.0), 0)]).0, 0);
    // Emissive meshes and those with strong shear are not shared.
    let lamp = emitting(placed(&fine, at(9.0), 0), 1.0);
    let shear = DMat3::from_cols(DVec3::X, v(1e4, 1.0, 0.0), DVec3::Z);
    let sheared = placed(&fine, DAffine3::from_mat3(shear), 0);
    let mixed = vec![
        lamp,
        placed(&fine, at(0.0), 0),
        sheared,
        placed(&coarse, at(1.0), 0),
        placed(&fine, at(5.0), 0),
    ];
    assert_eq!(instances(mixed), (2, 2 * one + few, 3 * one + few));
}

/// A leaf holds eight triangles: a mesh with fewer is a single leaf, and worthwhile only with many copies.
#[test]
fn meshes_with_a_single_leaf_are_hit() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    for triangles in [vec![[0, 1, 2]], vec![[0, 1, 2], [0, 2, 3]], vec![[0, 1, 2]; 8]] {
        let is_square = triangles.len() == 2;
        let mesh = Arc::new(Mesh { positions: corners.to_vec(), triangles, ..Mesh::default() });
        let at = |x: f64| placed(&mesh, DAffine3::from_translation(v(x, 0.0, 0.0)), 0);
        let (_, surfaces) =
            compile_sharing(&scene(vec![matte([0.5; 3])], vec![at(0.0), at(5.0)]), 16, 16, ALL).unwrap();
        assert_eq!(surfaces.instances.len(), 2);
        let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
        let met = |x: f64, y: f64| {
            let ray = Ray::new(narrow(v(x, y, 2.0)), narrow(-DVec3::Z));
            let hit = tree.intersect(&ray, true);
            hit.is_some().then_some((hit.t, hit.instance.0))
        };
        for (place, instance) in [(0.0, 1), (5.0, 2)] {
            assert_eq!(met(place + 0.75, 0.25), Some((2.0, instance)));
            assert_eq!(met(place + 0.25, 0.75), is_square.then_some((2.0, instance)));
            // Negative control: beside it.
            assert_eq!(met(place + 1.25, 0.25), None);
        }
    }
}

#[test]
fn hits_on_instances_are_those_of_copies() {
    let differences = |nudge: f64| {
        let (tables, shared) = compile_sharing(&pebbles(nudge, 3.0), 16, 16, ALL).unwrap();
        let (copied_tables, copied) = compile_sharing(&pebbles(0.0, 3.0), 16, 16, NONE).unwrap();
        assert_eq!((shared.instances.len(), copied.instances.len()), (5, 0));
        let tree = World::new(&shared, AcceleratorChoice::Bvh);
        let stream = &mut Stream::new(41, 0, 0);
        let (mut met, mut differ) = (0, 0);
        for _ in 0..40_000 {
            let o = v(5.0, 0.0, 0.5) + direction(stream) * stream.random_range(0.1..8.0);
            let target = v(5.0, 0.0, 0.0) + direction(stream) * 2.0;
            let ray = Ray::new(narrow(o), narrow((target - o).normalize()).normalized());
            let (a, b) = (tree.intersect(&ray, true), copied.intersect(&ray));
            if !a.is_some() || !b.is_some() {
                differ += u32::from(a.is_some() != b.is_some());
                continue;
            }
            let (p, q) = (tables.surfaces.point(&ray, &a), copied_tables.surfaces.point(&ray, &b));
            let [u, v] = tables.surfaces.uv(&p, a.instance, true);
            let [s, t] = copied_tables.surfaces.uv(&q, b.instance, true);
            met += u32::from(a.instance.0 > 0);
            let away = (p.p - q.p).max_abs().max((u - s).abs()).max((v - t).abs());
            let turned = (p.n - q.n).max_abs().max((p.shading - q.shading).max_abs());
            let same = tables.surfaces.entity(p.row.0) == copied_tables.surfaces.entity(q.row.0);
            differ += u32::from(!same || away > 1e-3 || turned > 1e-3);
        }
        assert!(met > 10_000, "{met}");
        differ
    };
    // At an edge, rounding decides which triangle is hit, and with it the normal unless it is smooth.
    let few = differences(0.0);
    assert!(few < 60, "{few}");
    // Negative control: one of them is higher by a hundredth.
    let many = differences(0.01);
    assert!(many > 1000, "{many}");
}

#[test]
fn images_of_instances_agree_with_copies() {
    let copies = picture(&pebbles(0.0, 3.0), NONE, 1);
    let shared = picture(&pebbles(0.0, 3.0), ALL, 2);
    let verdict = compare(&copies.blocks(), &shared.blocks());
    assert!(verdict.agrees(), "{verdict}");
    // Negative control: a light that is brighter by a tenth.
    let brighter = picture(&pebbles(0.0, 3.3), ALL, 2);
    let verdict = compare(&copies.blocks(), &brighter.blocks());
    assert!(!verdict.agrees(), "{verdict}");
}

#[test]
fn images_of_instances_are_identical_in_every_world_at_every_level() {
    let bits = |accelerator, level| {
        let all = samples(&sized(pebbles(0.0, 3.0), 24, 18), accelerator, ALL, level, 2);
        all.into_iter().map(|(_, radiance)| radiance.map(f32::to_bits)).collect::<Vec<_>>()
    };
    let truth = bits(AcceleratorChoice::Simple, Level::available()[0]);
    for level in Level::available() {
        assert!(bits(AcceleratorChoice::Bvh, level) == truth, "{level}");
    }
    assert!(truth.iter().any(|radiance| *radiance != truth[0]));
}

// The albedo of the matte materials.
#[test]
fn first_hits_have_the_instance_instead_of_the_mesh() {
    let scene = sized(pebbles(0.0, 3.0), 32, 24);
    let tracer = tracer(&scene, AcceleratorChoice::Bvh, ALL);
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let mut met = vec![0; scene.entities.len()];
    for level in Level::available() {
        let mut hits = Vec::new();
        tracer.first_hits(level, &Paths { pixels: &pixels, first_sample: 2, samples: 1 }, &mut hits);
        for hit in hits {
            // The first event is the camera ray, the second its hit.
            let (_, events) = tracer.explain(pixels[hit.slot as usize], 2);
            let entity = match events.get(1) {
                Some(Event::Hit { entity, .. }) => Some(*entity),
                _ => None,
            };
            assert_eq!(hit.met.then_some(hit.entity), entity, "{level}: {hit:?}");
            entity.into_iter().for_each(|entity| met[entity as usize] += 1);
        }
    }
    assert!(met.iter().filter(|&&met| met > 0).count() > 4, "{met:?}");
}

/// Two instances of a mesh, far from each other.
fn twice(mesh: Mesh, transform: DAffine3) -> Scene {
    let mesh = Arc::new(mesh);
    let away = DAffine3::from_translation(DVec3::splat(1e9)) * transform;
    scene(vec![matte([0.5; 3])], vec![placed(&mesh, transform, 0), placed(&mesh, away, 0)])
}

#[test]
fn rays_that_leave_an_instance_never_hit_its_triangle_again() {
    let stream = &mut Stream::new(43, 0, 0);
    let (mut rays, mut met, mut with_less) = (0, 0, 0);
    for size in [1e-6, 1.0, 1e6] {
        for squeeze in [DVec3::ONE, v(1.0, -0.1, 3.0), v(0.02, 1.0, 1.0)] {
            for place in [0.0, 30.0, 1e3] {
                let (u, w) = (direction(stream), direction(stream));
                let a = direction(stream);
                let corners = [a, a + u, a + u * 0.5 + u.cross(w).normalize() * 0.4].map(|p| p * size);
                let mesh = Mesh {
                    positions: corners.map(|p| p.to_array().map(|x| x as f32)).to_vec(),
                    triangles: vec![[0, 1, 2]],
                    ..Mesh::default()
                };
                let scale = 10_f64.powi(stream.random_range(-4..=4));
                let placing = transform(squeeze * scale / size, 1.3, direction(stream) * place * scale);
                let (tables, surfaces) = compile_sharing(&twice(mesh, placing), 16, 16, ALL).unwrap();
                let world = World::new(&surfaces, AcceleratorChoice::Simple);
                let corners = corners.map(|p| placing.transform_point3(p));
                for _ in 0..2000 {
                    let (b, c) = (stream.random::<f64>(), stream.random::<f64>());
                    let (b, c) = if b + c > 1.0 { (1.0 - b, 1.0 - c) } else { (b, c) };
                    let target = corners[0] + (corners[1] - corners[0]) * b + (corners[2] - corners[0]) * c;
                    let far = scale * 10_f64.powf(stream.random_range(-2.0..3.0));
                    let o = narrow(target + direction(stream) * far);
                    let ray = Ray::new(o, narrow((target - wide(o)).normalize_or(DVec3::X)).normalized());
                    let hit = world.intersect(&ray, true);
                    if !hit.is_some() {
                        continue;
                    }
                    assert_eq!(hit.instance.0, 1);
                    let point = tables.surfaces.point(&ray, &hit);
                    let frame = Frame::around(point.n);
                    let sign = [1.0, -1.0][stream.random_range(0..2)];
                    let cos: f64 = 10_f64.powf(stream.random_range(-6.0..0.0)) * sign;
                    let phi = stream.random_range(0.0..std::f64::consts::TAU);
                    let sin = (1.0 - cos * cos).sqrt();
                    let d = frame.to_world(narrow(v(sin * phi.cos(), sin * phi.sin(), cos))).normalized();
                    let leaves = |share: f32| {
                        let o = offset_origin(point.p, point.n, point.error * share, d);
                        !world.intersect(&Ray::new(o, d), true).is_some()
                    };
                    rays += 1;
                    met += u32::from(!leaves(1.0));
                    with_less += u32::from(!leaves(0.001));
                    // The bound must not be a gap.
                    assert!(f64::from(point.error) < 1e-2 * scale * (1.0 + place), "{}", point.error);
                }
            }
        }
    }
    assert!(rays > 30_000, "{rays}");
    assert_eq!(met, 0, "of {rays} rays");
    // Negative control.
    assert!(with_less > 100, "{with_less} of {rays} with a bound that is too small");
}

#[test]
fn no_ray_leaves_a_closed_instance() {
    let stream = &mut Stream::new(44, 0, 0);
    let ball = icosphere(DVec3::ZERO, 1.0, 20, false);
    for (scale, at) in [(DVec3::ONE, 0.0), (v(3.0, 0.05, -1.0), 20.0), (DVec3::splat(1e-5), 1e-3)] {
        let placing = transform(scale, 0.8, DVec3::splat(at));
        let (_, surfaces) = compile_sharing(&twice(ball.clone(), placing), 16, 16, ALL).unwrap();
        let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
        for i in 0..40_000 {
            let o = placing.transform_point3(direction(stream) * 0.5);
            let vertex = ball.positions[stream.random_range(0..ball.positions.len())].map(f64::from);
            let d = match i % 2 {
                0 => placing.transform_point3(DVec3::from(vertex)) - o,
                _ => placing.transform_vector3(direction(stream)),
            };
            let ray = Ray::new(narrow(o), narrow(d.normalize()).normalized());
            assert!(tree.intersect(&ray, true).is_some(), "{ray:?} leaves");
            assert!(tree.occluded(&ray, NOTHING, true, false), "{ray:?} leaves");
        }
    }
}

#[test]
fn the_size_counts_a_shared_mesh_once() {
    let many = 1 << 15;
    let mesh = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]; many as usize],
        ..Mesh::default()
    };
    let mesh = Arc::new(mesh);
    let place = || placed(&mesh, DAffine3::IDENTITY, 0);
    let size = |meshes: Vec<Entity>| {
        let mut entities = vec![plane(DVec3::Z, -1.0, 0)];
        entities.extend(meshes);
        let Size { primitives, vertices, .. } = Size::of(&scene(vec![matte([0.5; 3])], entities));
        (primitives, vertices)
    };
    assert_eq!(size(vec![]), (1, 0));
    assert_eq!(size(vec![place()]), (1 + many, 3));
    assert_eq!(size(vec![place(), place(), place()]), (1 + 3 + many, 3));
    // Emissive meshes are not shared.
    assert_eq!(size(vec![emitting(place(), 1.0), emitting(place(), 1.0)]), (1 + 2 * many, 6));
    assert_eq!(size(vec![cuboid(DVec3::ZERO, DVec3::ONE, 0)]), (1 + 6, 0));

    // With the plane, they exceed the limit by one. Nothing is built before the scene is rejected.
    let mut entities = vec![plane(DVec3::Z, -1.0, 0)];
    entities.extend((0..many).map(|_| emitting(place(), 1.0)));
    let refused = compile(&scene(vec![matte([0.5; 3])], entities), 16, 16).err();
    assert_eq!(refused, Some(TooLarge::Primitives((1 << 30) + 1)));
}
