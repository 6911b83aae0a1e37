//! Hits in the device's tree, compared with the CPU's.

use super::super::layout::{Instance, TreeNode};
use super::super::tables::Tables;
use super::super::tree;
use super::gallery::groups;
use super::probe::probe;
use super::probes::{ULP, bits};
use super::{Device, Prepared, device, scenes};
use crate::math::{Bounds, Ray, Vec3};
use crate::sampling::{Stream, warp};
use crate::scene::{Mesh, Scene};
use crate::shape::NOTHING;
use crate::world::{FIRST_TRIANGLE, Hit, NO_INSTANCE};
use glam::{DAffine3, DVec3};
use rand::RngExt;
use std::sync::Arc;

fn direction(stream: &mut Stream) -> DVec3 {
    let d = warp::uniform_sphere([stream.random::<f32>(), stream.random::<f32>()]);
    DVec3::new(f64::from(d.x), f64::from(d.y), f64::from(d.z))
}

/// Spheres, quads, slivers and balls of triangles whose sizes differ by up to 10³, some of them twice.
fn jumble(scale: f64, place: DVec3, stream: &mut Stream) -> Scene {
    let mut entities =
        vec![scenes::plane([0.0, 0.6, 0.8], place.dot(DVec3::new(0.0, 0.6, 0.8)) - 2.0 * scale, 0)];
    let mut mesh = Mesh::default();
    for i in 0..120 {
        let size = scale * 10_f64.powf(stream.random_range(-3.0..-0.3));
        let centre = place + direction(stream) * scale * stream.random::<f64>();
        let (u, v) = (direction(stream) * size, direction(stream) * size * [1.0, 0.05][i % 2]);
        let twice = if i % 5 == 0 { 2 } else { 1 };
        for _ in 0..twice {
            match i % 3 {
                0 => entities.push(scenes::sphere(centre.to_array(), size * 0.5, 0)),
                1 => entities.push(scenes::quad(centre.to_array(), u.to_array(), v.to_array(), 0)),
                _ => {
                    let base = mesh.positions.len() as u32;
                    mesh.positions.extend([centre, centre + u, centre + v].map(|p| p.as_vec3().to_array()));
                    mesh.triangles.push([base, base + 1, base + 2]);
                }
            }
        }
    }
    entities.push(scenes::placed(mesh, DAffine3::IDENTITY, 0));
    for (n, smooth) in [(4, true), (7, false)] {
        let to = DAffine3::from_translation(place + direction(stream) * scale * 0.7)
            * DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0) * scale * 0.3);
        entities.push(scenes::placed(scenes::ball(n, 0.2, smooth, n == 7), to, 0));
    }
    scenes::scene(16, 16, vec![scenes::matte([0.5; 3])], entities)
}

/// Rays from in and around a sphere to points of it, some along an axis, with limits for each.
fn rays(scale: f64, place: DVec3, count: usize, stream: &mut Stream) -> Vec<[f32; 7]> {
    let ray = |i: usize| {
        let target = place + direction(stream) * scale * stream.random::<f64>();
        let o = place + direction(stream) * scale * [0.5, 1.5, 100.0][i % 3];
        let d = match i % 7 {
            0 => [DVec3::X, DVec3::NEG_Y, DVec3::Z][i % 3],
            _ => (target - o).normalize(),
        };
        let o = if i.is_multiple_of(7) { target - d * scale * 2.0 } else { o };
        let ([ox, oy, oz], [dx, dy, dz]) = (o.as_vec3().to_array(), d.as_vec3().normalize().to_array());
        [ox, oy, oz, dx, dy, dz, (scale * stream.random_range(0.1..4.0_f64)) as f32]
    };
    (0..count).map(ray).collect()
}

const LINES: &str = "let ray = Ray(float3(0u), float3(3u), 0.0);
    let hit = intersect(ray, true);
    put_float(0u, hit.t); put(1u, first_hit(ray).number); put(2u, u32(occluded(ray, float(6u), true, false)));
    if hit.t < NOTHING {
        let point = surface_point(ray, hit);
        put_float3(3u, point.p); put_float3(6u, point.n); put_float3(9u, point.shading);
        put_float(12u, point.error); put(13u, surface_at(point.row).row);
        put_float(14u, hit.weights.x); put_float(15u, hit.weights.y);
    }
    put(16u, hit.instance);";

/// Copies of one mesh whose sizes differ by up to 10², scaled, rotated and mirrored, one of them twice at one place,
/// between spheres.
fn copies(scale: f64, place: DVec3, stream: &mut Stream) -> Scene {
    let mesh = Arc::new(scenes::ball(5, 0.2, true, true));
    let mut entities =
        vec![scenes::plane([0.0, 0.6, 0.8], place.dot(DVec3::new(0.0, 0.6, 0.8)) - 2.0 * scale, 0)];
    for i in 0..12 {
        let size = scale * if i == 0 { 0.5 } else { 10_f64.powf(stream.random_range(-2.0..-0.2)) };
        let at = place + direction(stream) * scale * stream.random::<f64>();
        let sides = [[1.0, 1.0, 1.0], [1.0, -0.3, 2.0], [-0.7, -1.0, -0.1]][i % 3];
        let to = scenes::turned(sides.map(|side| side * size), stream.random_range(0.0..6.0), at);
        for _ in 0..if i == 0 { 2 } else { 1 } {
            entities.push(scenes::copy_of(&mesh, to, 0));
        }
        let centre = place + direction(stream) * scale * stream.random::<f64>();
        entities.push(scenes::sphere(centre.to_array(), size * 0.5, 0));
    }
    scenes::scene(16, 16, vec![scenes::matte([0.5; 3])], entities)
}

/// Statistics of rays.
#[derive(Debug, Default)]
struct Seen {
    hits: usize,
    triangles: usize,
    /// Hits on shared geometry.
    shared: usize,
    /// Rays with different hits on the two sides.
    differ: usize,
    /// Limits before which only one side has a hit.
    limits: usize,
    /// Points or their attributes that differ from the CPU's.
    points: usize,
}

/// Compares the device's hits with the CPU's.
fn compare(device: &Device, scene: &Scene, tables: &Tables, rays: &[[f32; 7]]) -> Seen {
    let prepared = Prepared::new(scene, 0);
    let surfaces = &prepared.scene.surfaces;
    let world = &prepared.world;
    let mut seen = Seen::default();
    for (input, out) in rays.iter().zip(probe::<7, 17>(device, LINES, &bits(rays), tables)) {
        let [ox, oy, oz, dx, dy, dz, limit] = *input;
        let ray = Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz));
        let hit: Hit<f32> = world.intersect(&ray, true);
        let t = f32::from_bits(out[0]);
        let size = ray.o.max_abs() + hit.t.min(1e30);
        seen.limits += usize::from((hit.t - limit).abs() > 1e-4 * size && (out[2] == 1) != (hit.t < limit));
        let other = out[1] != hit.surface.0 || out[16] != hit.instance.0;
        if (t < f32::MAX) != (hit.t < NOTHING) || (t < f32::MAX && other) {
            seen.differ += 1;
            continue;
        }
        if hit.t == NOTHING {
            continue;
        }
        seen.hits += 1;
        seen.triangles += usize::from(hit.surface.0 >= FIRST_TRIANGLE);
        seen.shared += usize::from(hit.instance.0 != NO_INSTANCE);
        let point = surfaces.point(&ray, &hit);
        let steep = 1.0 / point.n.dot(ray.d).abs().max(1e-3);
        let near = |at: usize, v: Vec3<f32>, bound: f32| {
            let w =
                Vec3::new(f32::from_bits(out[at]), f32::from_bits(out[at + 1]), f32::from_bits(out[at + 2]));
            (v - w).max_abs() <= bound
        };
        let close = |at: usize, x: f32, bound: f32| (f32::from_bits(out[at]) - x).abs() <= bound;
        // The effect of a rounding of the coordinates on the distance, and on barycentric weights of small surfaces.
        let moved = 64.0 * ULP * size * steep;
        // Shared geometry has the additional error of transforming rays and points.
        let moved = if hit.instance.0 == NO_INSTANCE { moved } else { moved + point.error * steep };
        let turned = moved / point.error.max(ULP) * 1e-5 + 1e-4;
        let good = close(0, hit.t, moved)
            && near(3, point.p, moved)
            && near(6, point.n, turned)
            && near(9, point.shading, turned)
            && close(12, point.error, point.error)
            && out[13] == point.row.0
            && close(14, hit.weights[0], 1e-2)
            && close(15, hit.weights[1], 1e-2);
        seen.points += usize::from(!good);
    }
    seen
}

#[test]
fn trees_find_the_same_hits() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(51, 0, 0);
    for (scale, place) in [
        (1.0, DVec3::ZERO),
        (1.0, DVec3::new(30.0, -5.0, 2.0)),
        (1e4, DVec3::X),
        (1e-3, DVec3::ZERO),
        (1e13, DVec3::ZERO),
        (1e17, DVec3::ZERO),
    ] {
        let scene = jumble(scale, place, stream);
        let rays = rays(scale, place, 20_000, stream);
        let prepared = Prepared::new(&scene, 0);
        let mut tables = Tables::new(&prepared.job()).unwrap();
        let seen = compare(&device, &scene, &tables, &rays);
        println!("{scale} at {place}: {seen:?}");
        assert!(seen.hits > 10_000 && seen.triangles > 2_000, "{seen:?}");
        // At an edge within rounding, either answer is correct. No more than one ray in a thousand comes so close.
        assert!(seen.differ <= 20 && seen.limits <= 20 && seen.points <= 20, "{seen:?}");
        // Negative control: some boxes are empty.
        if scale != 1.0 {
            continue;
        }
        for node in tables.tree.nodes.iter_mut().step_by(10) {
            *node = TreeNode { high_x: [0; 2], ..*node };
        }
        let seen = compare(&device, &scene, &tables, &rays);
        assert!(seen.differ > 100, "empty boxes are not detected: {seen:?}");
    }
}

#[test]
fn hits_on_instances_agree() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(55, 0, 0);
    for (scale, place) in
        [(1.0, DVec3::ZERO), (1.0, DVec3::new(30.0, -5.0, 2.0)), (1e4, DVec3::X), (1e-3, DVec3::ZERO)]
    {
        let scene = copies(scale, place, stream);
        let rays = rays(scale, place, 20_000, stream);
        let prepared = Prepared::new(&scene, 0);
        let mut tables = Tables::new(&prepared.job()).unwrap();
        assert_eq!(tables.tree.places.len(), 13);
        let seen = compare(&device, &scene, &tables, &rays);
        println!("{scale} at {place}: {seen:?}");
        assert!(seen.shared > 3_000, "{seen:?}");
        assert!(seen.differ <= 20 && seen.limits <= 20 && seen.points <= 20, "{seen:?}");
        if scale != 1.0 {
            continue;
        }
        // Negative controls: hits are looked up in another instance.
        tables.tree.places.reverse();
        let elsewhere = compare(&device, &scene, &tables, &rays);
        assert!(elsewhere.points > 1000, "another instance is not detected: {elsewhere:?}");
        tables.tree.places.reverse();
        // Two instances coincide: numbers decide.
        let instances = tables.tree.triangles.iter_mut();
        let first = instances.map(bytemuck::cast_mut::<_, Instance>).find(|row| row.number == 1);
        first.expect("the first instance").number = 3;
        let higher = compare(&device, &scene, &tables, &rays);
        assert!(higher.differ > 20, "a higher number is not detected: {higher:?}");
    }
}

#[test]
fn hits_on_groups_agree() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(57, 0, 0);
    let scene = groups(16, 16);
    let rays = rays(2.5, DVec3::X * 5.0, 20_000, stream);
    let prepared = Prepared::new(&scene, 0);
    let mut tables = Tables::new(&prepared.job()).unwrap();
    assert!(tables.tree.has_groups && tables.tree.places.len() == 5);
    let seen = compare(&device, &scene, &tables, &rays);
    println!("{seen:?}");
    assert!(seen.shared > 2_000 && seen.triangles < seen.shared, "{seen:?}");
    assert!(seen.differ <= 40 && seen.limits <= 40 && seen.points <= 60, "{seen:?}");
    // Negative control: hits are looked up in another instance.
    tables.tree.places.reverse();
    let elsewhere = compare(&device, &scene, &tables, &rays);
    assert!(elsewhere.points > 500, "another instance is not detected: {elsewhere:?}");
}

#[test]
fn no_ray_leaves_a_closed_instance() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(56, 0, 0);
    for (n, at) in [(3, DVec3::ZERO), (12, DVec3::splat(3.0)), (30, DVec3::new(100.0, -300.0, 200.0))] {
        let (mut mesh, rays) = from_inside(n, DVec3::ZERO, 40_000, stream);
        let to = scenes::turned([0.7, -1.3, 1.1], 0.8, at);
        let narrow = |v: DVec3| v.as_vec3().to_array();
        let rays: Vec<_> = rays
            .iter()
            .map(|&[ox, oy, oz, dx, dy, dz, limit]| {
                let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
                let [ox, oy, oz] = narrow(to.transform_point3(wide([ox, oy, oz])));
                let [dx, dy, dz] = narrow(to.transform_vector3(wide([dx, dy, dz])).normalize());
                [ox, oy, oz, dx, dy, dz, limit]
            })
            .collect();
        let escaped = |mesh: Mesh| {
            let mesh = Arc::new(mesh);
            let far = scenes::turned([1.0; 3], 0.0, DVec3::splat(1e4));
            let entities = vec![scenes::copy_of(&mesh, to, 0), scenes::copy_of(&mesh, far, 0)];
            let scene = scenes::scene(16, 16, vec![scenes::matte([0.5; 3])], entities);
            let tables = Tables::new(&Prepared::new(&scene, 0).job()).unwrap();
            assert_eq!(tables.tree.places.len(), 2);
            let out = probe::<7, 17>(&device, LINES, &bits(&rays), &tables);
            out.iter().filter(|out| out[16] != 1 || out[2] == 0).count()
        };
        assert_eq!(escaped(mesh.clone()), 0, "{n} at {at}");
        // Negative control: one triangle is missing.
        mesh.triangles.pop();
        assert!(escaped(mesh) > 0, "{n}: nothing leaves by a hole");
    }
}

#[test]
fn among_equal_distances_the_lower_number_wins() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(52, 0, 0);
    let scene = jumble(1.0, DVec3::ZERO, stream);
    let rays = rays(1.0, DVec3::ZERO, 20_000, stream);
    let prepared = Prepared::new(&scene, 0);
    let mut tables = Tables::new(&prepared.job()).unwrap();
    assert!(compare(&device, &scene, &tables, &rays).differ <= 20);
    // Negative control: among triangles the higher number wins.
    let most = tables.tree.triangles.iter().map(|triangle| triangle.number).max().unwrap();
    for triangle in &mut tables.tree.triangles {
        triangle.number = most - (triangle.number & !FIRST_TRIANGLE);
    }
    let world = &prepared.world;
    let mut ties = 0;
    let out = probe::<7, 17>(&device, LINES, &bits(&rays), &tables);
    for (ray, out) in rays.iter().zip(out) {
        let ray = Ray::new(Vec3::new(ray[0], ray[1], ray[2]), Vec3::new(ray[3], ray[4], ray[5]));
        let hit: Hit<f32> = world.intersect(&ray, true);
        let both = hit.surface.0 >= FIRST_TRIANGLE && out[1] >= FIRST_TRIANGLE;
        ties += usize::from(both && most - out[1] != hit.surface.0 & !FIRST_TRIANGLE);
    }
    assert!(ties > 50, "only {ties} ties are decided otherwise");
}

/// A ball with irregular vertex positions, and rays from inside it: to its vertices, to points of its edges, along axes
/// through vertices, and in random directions.
fn from_inside(n: u32, place: DVec3, count: usize, stream: &mut Stream) -> (Mesh, Vec<[f32; 7]>) {
    let mut mesh = scenes::ball(n, 0.1, false, false);
    for p in &mut mesh.positions {
        *p = (DVec3::from(p.map(f64::from)) + place).as_vec3().to_array();
    }
    let ray = |i: usize| {
        let [a, b, _] = mesh.triangles[stream.random_range(0..mesh.triangles.len())];
        let [a, b] = [a, b].map(|corner| DVec3::from(mesh.positions[corner as usize].map(f64::from)));
        let inside = place + direction(stream) * 0.5 * stream.random::<f64>();
        let (o, d) = match i % 4 {
            0 => (inside, a - inside),
            1 => (inside, a.lerp(b, stream.random()) - inside),
            2 => {
                let axis = i / 4 % 3;
                let mut o = a;
                o[axis] = place[axis];
                let mut d = DVec3::ZERO;
                d[axis] = if (a - o)[axis] < 0.0 { -1.0 } else { 1.0 };
                if o.distance(place) < 0.8 { (o, d) } else { (inside, d) }
            }
            _ => (inside, direction(stream)),
        };
        let ([ox, oy, oz], [dx, dy, dz]) = (o.as_vec3().to_array(), d.normalize().as_vec3().to_array());
        [ox, oy, oz, dx, dy, dz, 1e30]
    };
    let rays = (0..count).map(ray).collect();
    (mesh, rays)
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(53, 0, 0);
    for (n, place) in [(3, DVec3::ZERO), (12, DVec3::splat(3.0)), (30, DVec3::new(100.0, -300.0, 200.0))] {
        let (mut mesh, rays) = from_inside(n, place, 40_000, stream);
        let escaped = |mesh: Mesh| {
            let mesh = scenes::placed(mesh, DAffine3::IDENTITY, 0);
            let scene = scenes::scene(16, 16, vec![scenes::matte([0.5; 3])], vec![mesh]);
            let tables = Tables::new(&Prepared::new(&scene, 0).job()).unwrap();
            let out = probe::<7, 17>(&device, LINES, &bits(&rays), &tables);
            out.iter().filter(|out| f32::from_bits(out[0]) == f32::MAX || out[2] == 0).count()
        };
        assert_eq!(escaped(mesh.clone()), 0, "{n} at {place}");
        // Negative control: one triangle is missing.
        mesh.triangles.pop();
        assert!(escaped(mesh) > 0, "{n}: nothing leaves by a hole");
    }
}

/// A tree of nodes that each hold one of some spheres and the next node, in unbounded boxes.
fn chain(tables: &mut Tables, spheres: u32) {
    let everywhere = Bounds { low: [-1e3; 3], high: [1e3; 3] };
    let mut children = [Bounds::NOTHING; 8];
    (children[2], children[5]) = (everywhere, everywhere);
    tables.tree.levels = spheres;
    tables.tree.nodes = (0..spheres)
        .map(|i| {
            let mut node = tree::boxes(&children);
            (node.parent, node.nodes, node.surfaces) = (i.saturating_sub(1), i + 1, i);
            node.leaves[1] = tree::SPHERES << 12 | 1;
            if i + 1 < spheres {
                node.scales |= 1 << (24 + 5);
            }
            node
        })
        .collect();
}

#[test]
fn deep_trees_are_traversed_completely() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(54, 0, 0);
    let spheres = 70;
    let entities: Vec<_> = (0..spheres)
        .map(|_| scenes::sphere((direction(stream) * 10.0).to_array(), stream.random_range(0.2..2.0), 0))
        .collect();
    let scene = scenes::scene(16, 16, vec![scenes::matte([0.5; 3])], entities);
    let mut tables = Tables::new(&Prepared::new(&scene, 0).job()).unwrap();
    chain(&mut tables, spheres);
    let rays = rays(10.0, DVec3::ZERO, 4000, stream);
    let seen = compare(&device, &scene, &tables, &rays);
    println!("{} levels: {seen:?}", tables.tree.levels);
    assert!(seen.hits > 1000 && seen.differ <= 4 && seen.limits <= 4 && seen.points <= 4, "{seen:?}");
    // Negative control: a trail of 64 levels loses pending nodes of the first ones.
    tables.tree.levels = 65;
    let seen = compare(&device, &scene, &tables, &rays);
    assert!(seen.differ > 20, "a short trail is not detected: {seen:?}");
}

#[test]
fn non_finite_rays_hit_nothing() {
    let Some(device) = device() else { return };
    let stream = &mut Stream::new(57, 0, 0);
    let lines = "let ray = Ray(float3(0u), float3(3u), 0.0);
        put(0u, select(0u, 1u, intersect(ray, true).t < NOTHING));
        put(1u, select(0u, 1u, occluded(ray, float(6u), true, false)));";
    let mut custom = jumble(1.0, DVec3::ZERO, stream);
    custom.entities.push(scenes::disk([0.0; 3], [0.0, 0.6, 0.8], 1.0, 0));
    custom.entities.push(scenes::cylinder([0.0; 3], [0.0, 0.0, 1.0], 1.0, 0));
    for scene in [jumble(1.0, DVec3::ZERO, stream), copies(1.0, DVec3::ZERO, stream), custom] {
        let tables = Tables::new(&Prepared::new(&scene, 0).job()).unwrap();
        let finite = rays(1.0, DVec3::ZERO, 2000, stream);
        let mut broken = Vec::new();
        for (i, ray) in finite.iter().enumerate() {
            let mut ray = *ray;
            // In one coordinate, or in several.
            let which = if i % 2 == 0 { 1 << (i / 2 % 6) } else { stream.random_range(1..64_u32) };
            for coordinate in (0..6).filter(|coordinate| which >> coordinate & 1 != 0) {
                ray[coordinate] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][stream.random_range(0..3)];
            }
            broken.push(ray);
        }
        let met = probe::<7, 2>(&device, lines, &bits(&broken), &tables);
        let wrong = met.iter().zip(&broken).find(|(met, _)| **met != [0, 0]);
        assert_eq!(wrong, None);
        // Negative control: finite rays do have hits.
        let met = probe::<7, 2>(&device, lines, &bits(&finite), &tables);
        assert!(met.iter().filter(|met| met[0] == 1).count() > 500);
    }
}
