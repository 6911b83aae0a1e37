//! Meshes: no ray leaks between triangles, none hits the triangle that it leaves, and meshes look and emit like spheres
//! and quads of the same shape.
//!
//! Images are compared at the level stated in `common::blocks`.

use crate::common;
use crate::common::blocks::compare;
use crate::common::scenes::*;
use crate::common::{estimate, integrator_in};
use glam::{DAffine3, DVec3};
use rand::RngExt;
use std::sync::Arc;
use stride::integrator::Paths;
use stride::light::LightSample;
use stride::math::lanes::Level;
use stride::math::lanes::scalar::Wrapping;
use stride::math::{Frame, Ray, Vec3};
use stride::sampling::{Region, Stream};
use stride::scene::{Entity, Filter, Integrator, Mesh, Sampler, Scene, Shape, SphereParameters};
use stride::shape::{NOTHING, offset_origin};
use stride::world::{AcceleratorChoice, CompiledScene, World, compile};

/// A sphere of triangles with random radii: dents, ridges, slivers.
fn crumpled(n: u32, depth: f64, centre: DVec3, stream: &mut Stream) -> Mesh {
    let mut mesh = icosphere(DVec3::ZERO, 1.0, n, false);
    for p in &mut mesh.positions {
        let out = 1.0 + depth * (stream.random::<f64>() - 0.5);
        *p = (DVec3::from(p.map(f64::from)) * out + centre).to_array().map(|x| x as f32);
    }
    mesh
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let stream = &mut Stream::new(31, 0, 0);
    for (n, depth, centre) in [(1, 0.0, 0.0), (20, 0.02, 0.0), (60, 0.004, 3.0), (20, 0.3, 1e3)] {
        let mesh = crumpled(n, depth, DVec3::splat(centre), stream);
        let vertices = mesh.positions.clone();
        let triangles = mesh.triangles.clone();
        let (_, surfaces) =
            compile(&scene(vec![matte([0.5; 3])], vec![common::scenes::mesh(mesh, 0)]), 16, 16).unwrap();
        let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
        for i in 0..150_000 {
            let o = narrow(DVec3::splat(centre) + direction(stream) * 0.5 * stream.random::<f64>());
            let at = |corner: u32| DVec3::from(vertices[corner as usize].map(f64::from));
            let [a, b, c] = triangles[stream.random_range(0..triangles.len())];
            // To a vertex, to a point of an edge, along an axis, in a random direction.
            let d = match i % 4 {
                0 => at(a) - wide(o),
                1 => at(b).lerp(at(c), stream.random()) - wide(o),
                2 => [DVec3::X, DVec3::NEG_Y, DVec3::Z][stream.random_range(0..3)],
                _ => direction(stream),
            };
            let o = match i % 8 {
                // Along an axis exactly through a vertex.
                2 => {
                    let p = vertices[a as usize];
                    let axis = [d.x, d.y, d.z].map(|x| x != 0.0);
                    let middle = [o.x, o.y, o.z];
                    let inside = [0, 1, 2].map(|i| if axis[i] { middle[i] } else { p[i] });
                    let off: f32 = (0..3).map(|i| (inside[i] - centre as f32).powi(2)).sum();
                    if off < 0.25 { Vec3::splat(inside) } else { o }
                }
                _ => o,
            };
            let ray = Ray::new(o, narrow(d.normalize()).normalized());
            assert!(tree.intersect(&ray, true).is_some(), "{n}: {ray:?} leaves");
            assert!(tree.occluded(&ray, NOTHING, true, false), "{n}: {ray:?} leaves");
        }
    }
}

#[test]
fn a_single_missing_triangle_is_detected() {
    let stream = &mut Stream::new(32, 0, 0);
    let mut mesh = crumpled(20, 0.02, DVec3::ZERO, stream);
    mesh.triangles.pop();
    let (_, surfaces) =
        compile(&scene(vec![matte([0.5; 3])], vec![common::scenes::mesh(mesh, 0)]), 16, 16).unwrap();
    let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
    let ray = |stream: &mut Stream| Ray::new(Vec3::zero(), narrow(direction(stream)).normalized());
    let out = (0..100_000).filter(|_| !tree.intersect(&ray(stream), true).is_some()).count();
    assert!(out > 3, "{out}");
}

#[test]
fn rays_that_leave_a_triangle_never_hit_it() {
    let stream = &mut Stream::new(33, 0, 0);
    let (mut rays, mut met, mut with_less) = (0, 0, 0);
    for scale in [1e-4, 1.0, 1e5] {
        for place in [0.0, 1.0, 1e3] {
            // The height, and the position of its foot on the longest side: from the second smallest height they are
            // needles.
            for (flat, at) in
                [(1.0, 0.5), (0.05, 0.5), (0.02, 0.0), (0.002, 0.5), (0.002, 0.0), (1e-4, 0.0), (1e-6, 0.01)]
            {
                let a = direction(stream) * scale * place;
                let (u, w) = (direction(stream), direction(stream));
                let corners = [a, a + u * scale, a + (u * at + u.cross(w).normalize() * flat) * scale];
                let mesh = Mesh {
                    positions: corners.map(|p| p.to_array().map(|x| x as f32)).to_vec(),
                    triangles: vec![[0, 1, 2]],
                    ..Mesh::default()
                };
                let alone = scene(vec![matte([0.5; 3])], vec![common::scenes::mesh(mesh, 0)]);
                let (tables, surfaces) = compile(&alone, 16, 16).unwrap();
                let world = World::new(&surfaces, AcceleratorChoice::Simple);
                for _ in 0..3000 {
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
                    let point = tables.surfaces.point(&ray, &hit);
                    // At a grazing angle, rounded corners move a hit far.
                    let off = (wide(point.p) - target).length();
                    // Normals of needles lose precision.
                    let steep = ray.d.dot(point.n).abs() > 0.1 && flat > 1e-3;
                    assert!(!steep || off < 1e-2 * scale + 1e-5 * (far + place * scale), "{off}");
                    // No bound exceeds a hundredth of the width, unless rounded corners require it.
                    let largest = scale * (1.0 + place);
                    let error = f64::from(point.error);
                    assert!(
                        error <= 0.01 * flat * scale + 48.0 * largest / 16_777_216.0,
                        "{error} of {flat}"
                    );
                    let frame = Frame::around(point.n);
                    let cos =
                        10_f64.powf(stream.random_range(-6.0..0.0)) * [1.0, -1.0][stream.random_range(0..2)];
                    let (sin, phi) =
                        ((1.0 - cos * cos).sqrt(), stream.random_range(0.0..std::f64::consts::TAU));
                    let d = frame.to_world(narrow(v(sin * phi.cos(), sin * phi.sin(), cos))).normalized();
                    let leaves = |share: f32| {
                        let o = offset_origin(point.p, point.n, point.error * share, d);
                        !world.intersect(&Ray::new(o, d), true).is_some()
                    };
                    rays += 1;
                    met += u32::from(!leaves(1.0));
                    with_less += u32::from(!leaves(0.001));
                }
            }
        }
    }
    assert!(rays > 40_000, "{rays}");
    assert_eq!(met, 0, "of {rays} rays");
    // Negative control.
    assert!(with_less > 100, "{with_less} of {rays} with a bound that is too small");
}

/// Strips, a thousand times as long as wide, that lie `APART` above each other and emit downwards.
struct Blinds {
    tables: CompiledScene,
    world: World,
    /// Along the strips, across them, and up.
    axes: [DVec3; 3],
}

impl Blinds {
    const COUNT: usize = 10;
    const SIDES: [f64; 2] = [10.0, 0.005];
    const APART: f64 = 0.008;

    fn new(of_triangles: bool, stream: &mut Stream) -> Blinds {
        let n = direction(stream);
        let frame = Frame::around(narrow(n));
        let (s, t) = (wide(frame.s), wide(frame.t));
        let turn = stream.random_range(0.0..std::f64::consts::TAU);
        let (along, across) = (s * turn.cos() + t * turn.sin(), t * turn.cos() - s * turn.sin());
        let (u, w) = (across * Blinds::SIDES[1], along * Blinds::SIDES[0]);
        let strip = |i: usize| {
            let corner = n * Blinds::APART * i as f64 - (u + w) * 0.5;
            emitting(if of_triangles { mesh(halves(corner, u, w), 0) } else { quad(corner, u, w, 0) }, 1.0)
        };
        let all = scene(vec![matte([0.5; 3])], (0..Blinds::COUNT).map(strip).collect());
        let (tables, surfaces) = compile(&all, 16, 16).unwrap();
        Blinds { tables, world: World::new(&surfaces, AcceleratorChoice::Bvh), axes: [along, across, n] }
    }

    /// A point in coordinates along the strips, across and up, or a direction.
    fn own(&self, p: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| p.dot(axis)))
    }

    fn place(&self, own: DVec3) -> DVec3 {
        self.axes[0] * own.x + self.axes[1] * own.y + self.axes[2] * own.z
    }

    /// Whether a strip occludes a point of another strip from a point below; `None` where rounding errors decide.
    fn hides(&self, from: DVec3, to: DVec3, strip: usize) -> Option<bool> {
        let mut hidden = false;
        for below in 0..strip {
            let height = Blinds::APART * below as f64;
            let at = from.lerp(to, (height - from.z) / (to.z - from.z));
            let [x, y] = [at.x.abs() - 0.5 * Blinds::SIDES[0], at.y.abs() - 0.5 * Blinds::SIDES[1]];
            if x.max(y).abs() < 2e-4 {
                return None;
            }
            hidden |= x.max(y) < 0.0;
        }
        Some(hidden)
    }
}

#[test]
fn no_shadow_ray_passes_the_next_needle() {
    let stream = &mut Stream::new(36, 0, 0);
    for of_triangles in [false, true] {
        let (mut answers, mut wrong, mut wrong_beyond) = ([0; 2], 0, 0);
        for _ in 0..20 {
            let blinds = Blinds::new(of_triangles, stream);
            for _ in 0..3000 {
                // Almost below, so that only some strips occlude others.
                let mut from = direction(stream) * v(8.0, 0.5, 0.0);
                from.z = -stream.random_range(0.1..2.0);
                let p = narrow(blinds.place(from));
                let lights = blinds.tables.lights.len();
                let light = stream.random_range(0..lights);
                let u = [stream.random(), stream.random()];
                let sample = blinds.tables.lights.sample(Wrapping(light as u32), p, u);
                assert!(sample.pdf > 0.0);
                let strip = light * Blinds::COUNT / lights;
                let mut to = blinds.own(wide(sample.target));
                to.z = Blinds::APART * strip as f64;
                let Some(hidden) = blinds.hides(blinds.own(wide(p)), to, strip) else { continue };
                answers[usize::from(hidden)] += 1;
                let sees = |sample: LightSample<f32>| {
                    let (shadow, length) = sample.shadow_ray(p);
                    !blinds.world.occluded(&shadow, length, true, false)
                };
                wrong += u32::from(sees(sample) == hidden);
                // Negative control: with a former, too large bound.
                let beyond = wide(sample.target) - blinds.axes[2] * 0.0095;
                wrong_beyond += u32::from(sees(LightSample { target: narrow(beyond), ..sample }) == hidden);
            }
        }
        assert!(answers.iter().all(|&n| n > 5000), "{answers:?}");
        assert!(wrong == 0 && wrong_beyond > 1000, "{of_triangles}: {wrong}, {wrong_beyond} of {answers:?}");
    }
}

#[test]
fn no_ray_starts_beyond_the_next_needle() {
    let stream = &mut Stream::new(37, 0, 0);
    for of_triangles in [false, true] {
        for _ in 0..20 {
            let blinds = Blinds::new(of_triangles, stream);
            for _ in 0..1000 {
                let strip = stream.random_range(0..Blinds::COUNT - 1);
                let height = Blinds::APART * strip as f64;
                let on = v(stream.random_range(-4.9..4.9), stream.random_range(-0.002..0.002), height);
                let down = Ray::new(
                    narrow(blinds.place(on + DVec3::Z * 0.5 * Blinds::APART)),
                    narrow(-blinds.axes[2]).normalized(),
                );
                let hit = blinds.world.intersect(&down, true);
                let point = blinds.tables.surfaces.point(&down, &hit);
                let slope = v(stream.random_range(-3.0..3.0), stream.random_range(-0.02..0.02), 1.0);
                let d = narrow(blinds.place(slope.normalize())).normalized();
                let next = |error: f32| {
                    let o = offset_origin(point.p, point.n, error, d);
                    let hit = blinds.world.intersect(&Ray::new(o, d), true);
                    let end = wide(o) + wide(d) * f64::from(hit.t);
                    (blinds.own(end).z - height) / Blinds::APART
                };
                assert!((next(point.error) - 1.0).abs() < 0.01, "{on}: {}", next(point.error));
                // Negative control: with a former, too large bound.
                let beyond = next(0.0095);
                assert!(beyond.is_nan() || (beyond - 1.0).abs() >= 0.01, "{on}: {beyond}");
            }
        }
    }
}

fn lit(entities: Vec<Entity>) -> Scene {
    let mut lit = scene(vec![matte([0.7, 0.6, 0.5]), mirror([0.9; 3]), glass(1.5)], entities);
    lit.environment = [0.3; 3];
    // Rays only through pixel centres would hit edges that a rounding error moves.
    lit.film.filter = Filter::Box { radius: 0.5 };
    lit.render.max_depth = 6;
    lit.render.samples = 64;
    sized(lit, 48, 36)
}

fn with(mut scene: Scene, integrator: Integrator, spp: u32, seed: u32) -> Scene {
    scene.render.integrator = integrator;
    scene.render.samples = spp;
    scene.render.seed = seed;
    scene
}

/// A quad as two triangles.
fn halves(corner: DVec3, u: DVec3, w: DVec3) -> Mesh {
    Mesh {
        positions: [corner, corner + u, corner + u + w, corner + w]
            .map(|p| p.to_array().map(|x| x as f32))
            .to_vec(),
        uv: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A room whose walls, light and box are quads, or the same as triangles.
fn room(of_triangles: bool, lamp: f64) -> Scene {
    let sheet = |corner: DVec3, u: DVec3, w: DVec3, material: usize| match of_triangles {
        true => mesh(halves(corner, u, w), material),
        false => quad(corner, u, w, material),
    };
    let entities = vec![
        sheet(v(0.0, -3.0, -2.0), v(0.0, 6.0, 0.0), v(8.0, 0.0, 0.0), 3),
        sheet(v(8.0, -3.0, -2.0), v(0.0, 0.0, 5.0), v(0.0, 6.0, 0.0), 0),
        sheet(v(4.0, -1.0, -2.0), v(1.0, 1.0, 0.0), v(0.0, 0.0, 2.0), 1),
        emitting(sheet(v(3.0, -1.0, 2.5), v(0.0, 1.5, 0.0), v(1.5, 0.3, 0.0), 0), lamp),
        sphere(v(5.0, 1.5, -1.0), 1.0, 2),
    ];
    let mut room = lit(entities);
    room.materials.push(checkerboard(0, 1, 3.0));
    room
}

#[test]
fn quads_of_triangles_look_like_quads() {
    let of_quads = estimate(&with(room(false, 5.0), Integrator::Path, 512, 1));
    for integrator in [Integrator::Path, Integrator::PathNaive] {
        let spp = if integrator == Integrator::Path { 512 } else { 1024 };
        let of_triangles = estimate(&with(room(true, 5.0), integrator, spp, 2));
        let verdict = compare(&of_quads.blocks(), &of_triangles.blocks());
        assert!(verdict.agrees(), "{integrator:?}: {verdict}");
    }
    // Negative control: a light that is brighter by a twentieth.
    let brighter = estimate(&with(room(true, 5.25), Integrator::Path, 512, 2));
    let verdict = compare(&of_quads.blocks(), &brighter.blocks());
    assert!(!verdict.agrees(), "{verdict}");
}

/// A matte, a glass and an emissive ball over a floor.
fn balls(ball: impl Fn(DVec3, f64) -> Shape) -> Scene {
    let floor = plane(DVec3::Z, -1.0, 0);
    let balls = vec![
        floor,
        entity(ball(v(5.0, -1.5, 0.0), 1.0), 0),
        entity(ball(v(5.0, 1.5, 0.0), 1.0), 2),
        emitting(entity(ball(v(4.0, 0.0, 2.0), 0.5), 0), 4.0),
    ];
    lit(balls)
}

#[test]
fn fine_meshes_with_normals_look_like_spheres() {
    let round = balls(|center, radius| Shape::Sphere(SphereParameters { center, radius }));
    let mesh = |smooth: bool, n: u32| {
        balls(move |centre, radius| Shape::Mesh {
            mesh: Arc::new(icosphere(centre, radius, n, smooth)),
            transform: DAffine3::IDENTITY,
        })
    };
    let truth = estimate(&with(round, Integrator::Path, 256, 1));
    let seen = estimate(&with(mesh(true, 48), Integrator::Path, 256, 2));
    let verdict = compare(&truth.blocks(), &seen.blocks());
    assert!(verdict.agrees(), "{verdict}");
    // Negative control: coarse ones without normals have facets.
    let coarse = estimate(&with(mesh(false, 1), Integrator::Path, 256, 2));
    let verdict = compare(&truth.blocks(), &coarse.blocks());
    assert!(!verdict.agrees(), "{verdict}");
}

#[test]
fn smooth_meshes_do_not_leak() {
    // A coarse smooth ball around the camera, in a bright world: only leaks are visible.
    for integrator in [Integrator::Path, Integrator::PathNaive, Integrator::Whitted] {
        for material in 0..2 {
            let ball = mesh(icosphere(v(0.3, 0.2, 0.1), 2.0, 2, true), material);
            let lamp = emitting(sphere(v(9.0, 0.0, 0.0), 3.0, 0), 100.0);
            let mut dark = with(lit(vec![ball, lamp]), integrator, 16, 3);
            dark.environment = [100.0; 3];
            common::for_each_sample(&dark, |pixel, radiance| assert_eq!(radiance, [0.0; 3], "pixel {pixel}"));
        }
    }
}

#[test]
fn transforms_apply_to_meshes_and_mirrors_keep_the_outward_side() {
    let matrix = DAffine3::from_translation(v(5.0, 0.0, 0.0)) * DAffine3::from_scale(v(1.0, 1.0, -2.0));
    let ball = icosphere(DVec3::ZERO, 1.0, 6, true);
    let placed = entity(Shape::Mesh { mesh: Arc::new(ball), transform: matrix }, 0);
    let (tables, surfaces) = compile(&scene(vec![matte([0.5; 3])], vec![placed]), 16, 16).unwrap();
    let world = World::new(&surfaces, AcceleratorChoice::Simple);
    for (o, d, t) in [
        (DVec3::ZERO, DVec3::X, 4.0),
        (v(5.0, 0.0, 9.0), DVec3::NEG_Z, 7.0),
        (v(5.0, -9.0, 0.0), DVec3::Y, 8.0),
    ] {
        let ray = Ray::new(narrow(o), narrow(d));
        let hit = world.intersect(&ray, true);
        assert!((f64::from(hit.t) - t).abs() < 0.05, "{} is not {t}", hit.t);
        let point = tables.surfaces.point(&ray, &hit);
        assert!(point.n.dot(ray.d) < -0.9 && point.shading.dot(ray.d) < -0.9, "{point:?}");
        assert_eq!(tables.surfaces.entity(point.row.0), 0);
    }
}

/// An emissive panel of many triangles over a floor: some of them are near a point and others far.
fn panel() -> Scene {
    let mut panel = Mesh::default();
    for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
        panel.positions.push([4.0 + 0.125 * j as f32, 0.125 * i as f32 - 0.5, 0.0]);
        if i < 8 && j < 8 {
            let corner = 9 * i + j;
            panel.triangles.push([corner, corner + 9, corner + 1]);
            panel.triangles.push([corner + 1, corner + 9, corner + 10]);
        }
    }
    lit(vec![plane(DVec3::Z, -1.0, 0), emitting(mesh(panel, 0), 4.0)])
}

#[test]
fn images_of_meshes_are_identical_in_every_world_at_every_level() {
    let balls = balls(|centre, radius| Shape::Mesh {
        mesh: Arc::new(icosphere(centre, radius, 4, true)),
        transform: DAffine3::IDENTITY,
    });
    for scene in [balls, panel()] {
        same_in_every_world_at_every_level(scene);
    }
}

fn same_in_every_world_at_every_level(mut scene: Scene) {
    scene.render.sampler = Sampler::Sobol;
    let samples = |accelerator: AcceleratorChoice, level: Level| {
        let region = Region::whole(scene.film.width, scene.film.height);
        let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
        let mut out = Vec::new();
        let paths = Paths { pixels: &pixels, first_sample: 0, samples: 2 };
        integrator_in(&scene, accelerator).trace(level, &paths, &mut out);
        out.sort_by_key(|f| (f.sample.pixel, f.sample.sample));
        out.into_iter().map(|f| f.sample.radiance.map(f32::to_bits)).collect::<Vec<_>>()
    };
    let truth = samples(AcceleratorChoice::Simple, Level::available()[0]);
    for level in Level::available() {
        assert!(samples(AcceleratorChoice::Bvh, level) == truth, "{level}");
    }
    assert!(truth.iter().any(|radiance| *radiance != truth[0]));
}

#[test]
fn a_convex_emitter_does_not_occlude_itself() {
    let ball = || icosphere(v(0.3, 0.2, 0.1), 2.0, 4, false);
    let mut dented = ball();
    dented.positions[0] = dented.positions[0].map(|x| x * 0.3);
    let lamp = |form: Mesh| Entity { emission: [1.0; 3], ..mesh(form, 0) };
    let other = mesh(icosphere(v(9.0, 0.0, 0.0), 1.0, 1, false), 0);
    let stream = &mut Stream::new(35, 0, 0);
    // Whether it is classified as convex, and how many of its samples it really occludes.
    let mut tried = |entities: Vec<Entity>| {
        let (tables, surfaces) = compile(&scene(vec![matte([0.5; 3])], entities), 16, 16).unwrap();
        let world = World::new(&surfaces, AcceleratorChoice::Simple);
        let (mut said, mut asked, mut hidden) = (true, 0, 0);
        for _ in 0..50_000 {
            let p = narrow(direction(stream) * stream.random_range(2.2..20.0) + v(0.3, 0.2, 0.1));
            let n = narrow(direction(stream));
            let (light, _) = tables.lights.choose(p, n, stream.random(), true);
            let sample = tables.lights.sample(light, p, [stream.random(), stream.random()]);
            let (shadow, length) = sample.shadow_ray(p);
            said = said && tables.lights.is_convex_emitter::<f32>(light);
            if sample.pdf > 0.0 {
                asked += 1;
                hidden += u32::from(world.occluded(&shadow, length, true, false));
                assert!(!said || !world.occluded(&shadow, length, true, said));
            }
        }
        assert!(asked > 10_000, "{asked}");
        (said, hidden)
    };
    assert_eq!(tried(vec![lamp(ball())]), (true, 0));
    let (said, hidden) = tried(vec![lamp(dented)]);
    assert!(!said && hidden > 100, "{hidden}");
    // It is convex, but something else may occlude it.
    assert!(!tried(vec![lamp(ball()), other]).0);
    assert!(!tried(vec![lamp(ball()), lamp(ball())]).0);
}

#[test]
fn a_sampled_panel_agrees_with_chance() {
    let seen = estimate(&with(panel(), Integrator::Path, 256, 2));
    let found = estimate(&with(panel(), Integrator::PathNaive, 1024, 3));
    let verdict = compare(&found.blocks(), &seen.blocks());
    assert!(verdict.agrees(), "{verdict}");
}
