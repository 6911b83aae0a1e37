//! Tangents, along which u increases and v is constant, on every shape.

use crate::common::scenes::*;
use crate::common::shapes::{bounded_samples, unbounded_samples};
use glam::{DAffine3, DQuat, DVec3};
use std::sync::Arc;
use stride::math::{Ray, Vec3};
use stride::sampling::Stream;
use stride::scene::{ConductorParameters, Entity, Material, MaterialKind, Mesh, Scene, Shape};
use stride::world::{AcceleratorChoice, World, compile_sharing};

fn brushed() -> Material {
    let (eta, k) = (Some([0.2; 3]), Some([3.0; 3]));
    let parameters = ConductorParameters { metal: None, eta, k, roughness: [0.2, 0.6] };
    Material { name: "brushed".into(), kind: MaterialKind::Conductor(parameters), ..Material::default() }
}

/// A curved sheet of triangles with skewed uv, which are mirrored if it is flipped.
fn sheet(turned: bool) -> Mesh {
    let n = 12;
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let [a, b] = [i, j].map(|x| x as f32 / n as f32 * 2.0 - 1.0);
            mesh.positions.push([a, b, 0.3 * a * a - 0.2 * a * b]);
            let uv = [0.7 * a + 0.2 * b, 0.9 * b - 0.1 * a];
            mesh.uv.push(if turned { [uv[1], uv[0]] } else { uv });
        }
    }
    let at = |i: u32, j: u32| i * (n + 1) + j;
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn place() -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        v(1.5, -0.8, 1.1),
        DQuat::from_axis_angle(v(0.3, 0.4, 0.866).normalize(), 0.8),
        v(0.2, -0.1, 0.3),
    )
}

/// An entity of the only group, whose instance scales it unevenly and mirrors it.
fn grouped(entity: Entity) -> Vec<Entity> {
    vec![Entity { within: Some(0), ..entity }]
}

fn everything() -> Vec<(String, Vec<Entity>)> {
    let placed = |turned| Entity {
        shape: Shape::Mesh { mesh: Arc::new(sheet(turned)), transform: place() },
        ..Entity::default()
    };
    // Twice, the second time far away, so that they are shared.
    let one = Arc::new(sheet(false));
    let copy = |at: DVec3| Entity {
        shape: Shape::Mesh { mesh: Arc::clone(&one), transform: DAffine3::from_translation(at) * place() },
        ..Entity::default()
    };
    // Sheets take the place of the sample mesh, whose uv are stretched too much.
    let mut all = vec![
        ("sheet".into(), vec![placed(false)]),
        ("sheet with mirrored uv".into(), vec![placed(true)]),
        ("instances".into(), vec![copy(DVec3::ZERO), copy(v(50.0, 0.0, 0.0))]),
        ("sheet in a group".into(), grouped(mesh(sheet(false), 0))),
    ];
    all.extend(unbounded_samples().into_iter().map(|(name, shape)| (name.into(), vec![entity(shape, 0)])));
    for (name, shape) in bounded_samples(v(0.1, 0.1, -0.1), 1.4) {
        if matches!(shape, Shape::Mesh { .. }) {
            continue;
        }
        let own = entity(shape, 0);
        all.push((format!("flipped {name}"), vec![flipped(own.clone())]));
        all.push((format!("flipped {name} in a group"), grouped(flipped(own.clone()))));
        all.push((format!("{name} in a group"), grouped(own.clone())));
        all.push((name.into(), vec![own]));
    }
    all
}

/// A scene of these shapes, with an instance of the group that they may be in.
fn seen(entities: Vec<Entity>) -> Scene {
    let mut scene = scene(vec![brushed()], entities);
    if scene.entities[0].within.is_some() {
        let group = scene.add_group("group");
        let mild = DAffine3::from_scale(v(1.2, -0.9, 1.1));
        scene.add_instance(
            "instance",
            group,
            place() * DAffine3::from_scale(v(1.5, -0.8, 1.1)).inverse() * mild,
        );
    }
    scene
}

/// Between a point of a surface and one slightly further along its tangent, only u changes.
#[test]
fn along_a_tangent_u_increases_and_v_is_constant() {
    let stream = &mut Stream::new(1, 0, 0);
    for (name, entities) in everything() {
        let scene = seen(entities);
        let (tables, surfaces) = compile_sharing(&scene, 16, 16, 1).unwrap();
        let world = World::new(&surfaces, AcceleratorChoice::Simple);
        let (mut seen, mut wrong) = (0, 0);
        for _ in 0..2000 {
            let o = direction(stream) * 4.0;
            let d = (direction(stream) * 0.9 - o).normalize();
            let ray = Ray::new(narrow(o), narrow(d));
            let hit = world.intersect(&ray, true);
            if !hit.is_some() {
                continue;
            }
            let point = tables.surfaces.point(&ray, &hit);
            let tangent = wide(tables.surfaces.tangent(&point, hit.instance));
            let n = wide(point.n);
            // Near the centre of a disk and the poles of a sphere, u changes quickly; along the surface a step is long.
            if d.dot(n).abs() < 0.2 || tangent.length() < 0.2 * 1e-2 {
                continue;
            }
            assert!(tangent.normalize().dot(n).abs() < 1e-4, "{name}: {tangent} is not along the surface");
            let step = 2e-3;
            let moved = Ray::new(narrow(o + tangent.normalize() * step), narrow(d));
            let next = world.intersect(&moved, true);
            let beyond = next.is_some() && next.surface == hit.surface;
            if !beyond {
                continue;
            }
            let uv = |point, instance| tables.surfaces.uv(&point, instance, true).map(f64::from);
            let next_point = tables.surfaces.point(&moved, &next);
            let ([u, v], [next_u, next_v]) = (uv(point, hit.instance), uv(next_point, next.instance));
            // u may wrap around.
            let (du, dv) = (next_u - u, next_v - v);
            if du.abs() > 0.5 {
                continue;
            }
            seen += 1;
            // Over a step, curved surfaces bend away by the step over their radius.
            wrong += u32::from(!(du > 0.0 && dv.abs() < 0.03 * du.abs().max(1e-4)));
        }
        assert!(seen > 150, "{name}: {seen}");
        assert!(wrong * 50 <= seen, "{name}: {wrong} of {seen} tangents");
    }
}

/// Steps along ∂p/∂u and ∂p/∂v change uv as given by the gradients, and only one of the two.
#[test]
fn along_each_of_uv_the_other_is_constant() {
    let stream = &mut Stream::new(2, 0, 0);
    for (name, entities) in everything() {
        let scene = seen(entities);
        let (tables, surfaces) = compile_sharing(&scene, 16, 16, 1).unwrap();
        let world = World::new(&surfaces, AcceleratorChoice::Simple);
        let (mut seen, mut wrong) = (0, 0);
        for _ in 0..2000 {
            let o = direction(stream) * 4.0;
            let d = (direction(stream) * 0.9 - o).normalize();
            let ray = Ray::new(narrow(o), narrow(d));
            let hit = world.intersect(&ray, true);
            if !hit.is_some() {
                continue;
            }
            let point = tables.surfaces.point(&ray, &hit);
            let basis = tables.surfaces.uv_basis(&point, hit.instance);
            let n = wide(point.n);
            let [along_u, along_v] = [basis.along_u, basis.along_v].map(wide);
            let gradients = [basis.gradient_u, basis.gradient_v].map(wide);
            // Near the centre of a disk and the poles of a sphere, u changes quickly; along the surface a step is long.
            if d.dot(n).abs() < 0.2 || gradients.iter().any(|gradient| gradient.length() > 2.0) {
                continue;
            }
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-4, "{name}: {a} is not {b}");
            for (i, along) in [along_u, along_v].into_iter().enumerate() {
                close(along.dot(gradients[i]), 1.0);
                close(along.normalize().dot(gradients[1 - i].normalize()), 0.0);
                close(along.normalize().dot(n), 0.0);
            }
            let tangent = wide(tables.surfaces.tangent(&point, hit.instance));
            close(tangent.normalize().dot(along_u.normalize()), 1.0);
            let uv = |point| tables.surfaces.uv(&point, hit.instance, true).map(f64::from);
            let own = uv(point);
            for (i, along) in [along_u, along_v].into_iter().enumerate() {
                let step = along.normalize() * 2e-3;
                let moved = Ray::new(narrow(o + step), narrow(d));
                let next = world.intersect(&moved, true);
                if !(next.is_some() && next.surface == hit.surface && next.instance == hit.instance) {
                    continue;
                }
                let after = uv(tables.surfaces.point(&moved, &next));
                let changes = [after[0] - own[0], after[1] - own[1]];
                // u may wrap around.
                if changes[0].abs() > 0.5 {
                    continue;
                }
                seen += 1;
                let expected = step.dot(gradients[i]);
                let (same, other) = (changes[i] - expected, changes[1 - i]);
                wrong += u32::from(same.abs().max(other.abs()) > 0.03 * expected.max(1e-4));
            }
        }
        assert!(seen > 150, "{name}: {seen}");
        assert!(wrong * 50 <= seen, "{name}: {wrong} of {seen}");
    }
}

/// A frame follows uv on anisotropic surfaces, and is the usual one in scenes without any.
#[test]
fn frames_of_anisotropic_materials_follow_uv() {
    let ball = || vec![sphere(DVec3::ZERO, 1.0, 0)];
    let ray = Ray::new(Vec3::splat([3.0, 0.5, 0.25]), Vec3::splat([-1.0, 0.0, 0.0]));
    let frame = |material| {
        let scene = scene(vec![material], ball());
        let (tables, surfaces) = compile_sharing(&scene, 16, 16, 1 << 20).unwrap();
        let hit = World::new(&surfaces, AcceleratorChoice::Simple).intersect(&ray, true);
        let at = tables.interaction(&ray, &hit, true, stride::world::Uv::IfTextured);
        (tables.frame(&at), at.point.n)
    };
    let (brushed, n) = frame(brushed());
    let expected = DVec3::Z.cross(wide(n)).normalize();
    assert!((wide(brushed.s) - expected).length() < 1e-5);
    let (usual, n) = frame(matte([0.5; 3]));
    assert_eq!(usual.s, stride::math::Frame::around(n).s);
}
