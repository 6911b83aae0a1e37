//! Small scenes for tests.

use crate::camera::CameraSettings;
use crate::scene::{
    BoxParameters, CheckerboardParameters, CylinderParameters, DiskParameters, Entity, FilmSettings, Filter,
    GlassParameters, Integrator, Light, Material, MaterialKind, MatteParameters, Mesh, MirrorParameters,
    PlaneParameters, PointLightParameters, QuadParameters, RenderSettings, Sampler, Scene, Shape,
    SphereParameters,
};
use glam::{DAffine3, DQuat, DVec3};
use std::sync::Arc;

fn material(kind: MaterialKind) -> Material {
    Material { name: "a material".to_owned(), kind, ..Material::default() }
}

pub(super) fn matte(reflectance: [f64; 3]) -> Material {
    material(MaterialKind::Matte(MatteParameters { reflectance, roughness: 0.0 }))
}

fn mirror(reflectance: [f64; 3]) -> Material {
    material(MaterialKind::Mirror(MirrorParameters { reflectance }))
}

fn entity(shape: Shape, material: usize) -> Entity {
    Entity { shape, material, ..Entity::default() }
}

pub(super) fn plane(normal: [f64; 3], distance: f64, material: usize) -> Entity {
    entity(Shape::Plane(PlaneParameters { normal: DVec3::from_array(normal), distance }), material)
}

pub(super) fn sphere(center: [f64; 3], radius: f64, material: usize) -> Entity {
    entity(Shape::Sphere(SphereParameters { center: DVec3::from_array(center), radius }), material)
}

pub(super) fn quad(corner: [f64; 3], u: [f64; 3], v: [f64; 3], material: usize) -> Entity {
    let [corner, u, v] = [corner, u, v].map(DVec3::from_array);
    entity(Shape::Quad(QuadParameters { corner, u, v }), material)
}

pub(super) fn disk(center: [f64; 3], normal: [f64; 3], radius: f64, material: usize) -> Entity {
    let [center, normal] = [center, normal].map(DVec3::from_array);
    entity(Shape::Disk(DiskParameters { center, normal: normal.normalize(), radius }), material)
}

pub(super) fn cylinder(from: [f64; 3], to: [f64; 3], radius: f64, material: usize) -> Entity {
    let [from, to] = [from, to].map(DVec3::from_array);
    entity(Shape::Cylinder(CylinderParameters { from, to, radius }), material)
}

fn cuboid(min: [f64; 3], max: [f64; 3], material: usize) -> Entity {
    let [min, max] = [min, max].map(DVec3::from_array);
    entity(Shape::Box(BoxParameters { min, max }), material)
}

pub(super) fn scene(width: u32, height: u32, materials: Vec<Material>, entities: Vec<Entity>) -> Scene {
    Scene {
        film: FilmSettings { width, height, ..FilmSettings::default() },
        render: RenderSettings {
            integrator: Integrator::PathNaive,
            sampler: Sampler::Independent,
            samples: 1,
            ..RenderSettings::default()
        },
        materials,
        entities,
        ..Scene::default()
    }
}

/// A scene with another integrator and sampler.
pub(super) fn with(mut scene: Scene, integrator: Integrator, sampler: Sampler) -> Scene {
    (scene.render.integrator, scene.render.sampler) = (integrator, sampler);
    scene
}

/// The cover of the report.
pub(super) fn cover(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.75, 0.25, 0.25]),
        matte([0.25, 0.25, 0.75]),
        matte([0.75; 3]),
        mirror([0.6, 0.4, 0.2]),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 2,
            odd: 3,
            checks_per_unit: [10.0; 2],
        })),
        mirror([0.25, 0.75, 0.25]),
        mirror([1.0; 3]),
    ];
    let entities = vec![
        plane([0.0, 1.0, 0.0], -6.0, 0),
        plane([0.0, -1.0, 0.0], -6.0, 1),
        plane([0.0, 0.0, -1.0], -8.0, 2),
        plane([-1.0, 0.0, 0.0], -10.0, 2),
        plane([0.0, 0.0, 1.0], -3.0, 4),
        sphere([8.0, 3.0, -1.0], 2.0, 5),
        sphere([6.0, -2.0, -1.0], 2.0, 6),
        Entity { emission: [1.0; 3], ..sphere([7.0, 0.0, 3.0], 1.0, 2) },
    ];
    scene(width, height, materials, entities)
}

/// Features that the cover lacks: a flipped quad light, a lens, a near plane, an environment, glass, nested
/// checkerboards on a plane, a quad and a sphere, point lights, the box filter.
pub(super) fn bazaar(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.8, 0.7, 0.6]),
        matte([0.2, 0.3, 0.4]),
        mirror([0.9, 0.8, 0.7]),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 0,
            odd: 1,
            checks_per_unit: [2.0, 3.0],
        })),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 3,
            odd: 2,
            checks_per_unit: [1.0, 0.5],
        })),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 3,
            odd: 1,
            checks_per_unit: [6.0, 4.0],
        })),
        material(MaterialKind::Glass(GlassParameters {
            ior: 1.5,
            reflectance: [1.0, 0.9, 0.8],
            transmittance: [0.8, 0.9, 1.0],
        })),
    ];
    let light = Entity {
        emission: [3.0, 2.0, 1.0],
        flip_normal: true,
        ..quad([4.0, -2.0, 4.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.5], 0)
    };
    let entities = vec![
        plane([0.1, 0.0, 1.0], -2.0, 4),
        light,
        quad([9.0, -4.0, -2.0], [0.5, 8.0, 0.0], [0.0, 0.0, 5.0], 5),
        sphere([5.0, 1.5, -0.8], 1.2, 6),
        sphere([6.0, -1.5, -0.5], 1.3, 5),
    ];
    let mut scene = scene(width, height, materials, entities);
    for entity in &mut scene.entities {
        if let Shape::Plane(PlaneParameters { normal, .. }) = &mut entity.shape {
            *normal = normal.normalize();
        }
    }
    scene.film.filter = Filter::Box { radius: 0.5 };
    scene.camera = CameraSettings {
        eye: DVec3::new(-1.0, 0.2, 0.5),
        near: 0.7,
        aperture_radius: 0.2,
        focus_distance: 6.0,
        ..scene.camera
    };
    scene.environment = [0.2, 0.3, 0.5];
    let point = |position: [f64; 3], intensity| {
        Light::Point(PointLightParameters {
            position: DVec3::from_array(position),
            intensity: Some(intensity),
            power: None,
        })
    };
    scene.lights = vec![point([2.0, 3.0, 2.0], [4.0, 5.0, 6.0]), point([7.0, -3.0, 3.0], [9.0, 3.0, 3.0])];
    scene
}

/// A box whose walls are spheres of radius 10⁵, as in smallpt: nothing leaks in single precision.
pub(super) fn large_spheres(width: u32, height: u32) -> Scene {
    let (far, size) = (1e5, 1e5 + 50.0);
    let materials =
        vec![matte([0.75, 0.25, 0.25]), matte([0.25, 0.25, 0.75]), matte([0.75; 3]), mirror([1.0; 3])];
    let entities = vec![
        sphere([0.0, size, 0.0], far, 0),
        sphere([0.0, -size, 0.0], far, 1),
        sphere([0.0, 0.0, size], far, 2),
        sphere([0.0, 0.0, -size], far, 2),
        sphere([size + 40.0, 0.0, 0.0], far, 2),
        sphere([-size, 0.0, 0.0], far, 2),
        sphere([50.0, 10.0, -30.0], 20.0, 3),
        Entity { emission: [6.0; 3], ..sphere([40.0, 0.0, 45.0], 20.0, 2) },
    ];
    scene(width, height, materials, entities)
}

/// Many different lights of every kind in a bright room: a quad, spheres, points, a sky on the inside of a sphere,
/// glass and a mirror; paths are long enough for Russian roulette.
pub(super) fn lamps(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.85, 0.8, 0.75]),
        mirror([0.95; 3]),
        material(MaterialKind::Glass(GlassParameters {
            ior: 1.5,
            reflectance: [1.0; 3],
            transmittance: [1.0; 3],
        })),
        matte([0.3, 0.4, 0.5]),
    ];
    let emitting = |emission: f64, entity| Entity { emission: [emission; 3], ..entity };
    let mut entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 0),
        plane([0.0, 1.0, 0.0], -4.0, 0),
        Entity { flip_normal: true, ..emitting(0.3, sphere([0.0, 0.0, 0.0], 30.0, 3)) },
        emitting(3.0, quad([3.0, -1.0, 2.5], [0.0, 1.5, 0.0], [1.5, 0.0, 0.0], 0)),
        sphere([4.0, 1.4, -0.6], 0.9, 2),
        sphere([5.5, -1.5, -0.5], 1.0, 1),
        sphere([4.5, 0.0, -1.0], 0.5, 0),
    ];
    for i in 0..5 {
        let x = f64::from(i);
        entities.push(emitting(1.0 + 2.0 * x, sphere([3.0 + x * 0.7, 2.0 - x * 0.9, -1.1], 0.25, 3)));
    }
    let mut scene = scene(width, height, materials, entities);
    let point = |position: [f64; 3], intensity| {
        Light::Point(PointLightParameters {
            position: DVec3::from_array(position),
            intensity: Some(intensity),
            power: None,
        })
    };
    scene.lights = vec![point([4.0, 2.5, 1.0], [2.0; 3]), point([6.0, -2.0, 1.5], [0.5, 1.0, 2.0])];
    scene.environment = [0.1, 0.1, 0.2];
    scene.render.max_depth = 12;
    scene.render.ambient = [0.05, 0.06, 0.07];
    scene
}

/// Disks, cylinders and boxes of every material, all of which emit somewhere; cylinders outwards and inwards.
pub(super) fn shop(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.7, 0.6, 0.5]),
        matte([0.2, 0.3, 0.4]),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 0,
            odd: 1,
            checks_per_unit: [8.0, 4.0],
        })),
        material(MaterialKind::Glass(GlassParameters {
            ior: 1.5,
            reflectance: [1.0; 3],
            transmittance: [0.9, 1.0, 0.9],
        })),
        mirror([0.9; 3]),
    ];
    let emitting = |emission: f64, entity| Entity { emission: [emission; 3], ..entity };
    let shade = cylinder([5.5, -1.5, -1.3], [5.5, -1.5, -0.3], 0.5, 0);
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 0),
        emitting(6.0, disk([4.0, 0.5, 1.5], [0.0, 0.6, -0.8], 0.6, 0)),
        emitting(12.0, cylinder([3.0, -2.0, -0.5], [4.0, -1.5, 0.5], 0.05, 0)),
        emitting(2.0, cuboid([5.0, 2.0, -1.5], [5.5, 2.5, -0.5], 0)),
        Entity { flip_normal: true, ..emitting(3.0, shade) },
        cylinder([3.5, 1.0, -1.5], [3.5, 1.0, -0.7], 0.5, 2),
        disk([3.5, 1.0, -0.7], [0.0, 0.0, 1.0], 0.5, 2),
        cuboid([3.5, -0.6, -1.49], [4.2, 0.1, -0.6], 3),
        cuboid([6.5, -0.5, -1.5], [7.0, 1.5, 0.5], 4),
        cylinder([3.0, 0.3, -1.3], [3.3, -0.8, -1.4], 0.1, 4),
    ];
    let mut scene = scene(width, height, materials, entities);
    scene.environment = [0.1, 0.12, 0.15];
    scene
}

/// A sphere of triangles: six sides of `n` × `n` squares, each of two triangles, with radii varied by `bumps`. If
/// smooth, it has the sphere's normals; uv cover each side.
pub(super) fn ball(n: u32, bumps: f64, smooth: bool, with_uv: bool) -> Mesh {
    let mut mesh = Mesh::default();
    let mut seen = std::collections::BTreeMap::new();
    for side in 0..6 {
        let mut vertex = |i: u32, j: u32| {
            let [a, b] = [i, j].map(|i| f64::from(i) / f64::from(n) * 2.0 - 1.0);
            let p = match side {
                0 => DVec3::new(a, b, 1.0),
                1 => DVec3::new(b, a, -1.0),
                2 => DVec3::new(1.0, a, b),
                3 => DVec3::new(-1.0, b, a),
                4 => DVec3::new(b, 1.0, a),
                _ => DVec3::new(a, -1.0, b),
            };
            // Neighbours share the vertices of their common side, unless each has its own uv.
            let key = ((p * 1e6).round().to_array().map(|x| x as i64), if with_uv { side } else { 0 });
            let next = seen.len() as u32;
            *seen.entry(key).or_insert_with(|| {
                let wave = (p.x * 7.0).sin() * (p.y * 9.0).sin() * (p.z * 8.0 + 1.0).sin();
                let out = p.normalize();
                mesh.positions.push((out * (1.0 + bumps * wave)).to_array().map(|x| x as f32));
                if smooth {
                    mesh.normals.push(out.to_array().map(|x| x as f32));
                }
                if with_uv {
                    mesh.uv.push([a as f32, b as f32]);
                }
                next
            })
        };
        let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let triangles: Vec<_> = squares
            .flat_map(|(i, j)| {
                let [a, b, c, d] =
                    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| vertex(i, j));
                [[a, b, c], [a, c, d]]
            })
            .collect();
        mesh.triangles.extend(triangles);
    }
    mesh
}

pub(super) fn placed(mesh: Mesh, transform: DAffine3, material: usize) -> Entity {
    entity(Shape::Mesh { mesh: Arc::new(mesh), transform }, material)
}

/// One of several copies of a mesh.
pub(super) fn copy_of(mesh: &Arc<Mesh>, transform: DAffine3, material: usize) -> Entity {
    entity(Shape::Mesh { mesh: Arc::clone(mesh), transform }, material)
}

/// A transform that rotates, mirrors if a scale is negative, and translates.
pub(super) fn turned(scale: [f64; 3], angle: f64, at: DVec3) -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -0.4, 1.0).normalize(), angle);
    DAffine3::from_scale_rotation_translation(DVec3::from_array(scale), turn, at)
}

/// Copies of one mesh, scaled, rotated, mirrored and flipped, of every material; one more emits. Spheres and quads
/// between them.
pub(super) fn copies(width: u32, height: u32) -> Scene {
    let mut scene = crowd(width, height);
    let pebble = Arc::new(ball(5, 0.1, true, true));
    let place = |scale, angle, at: [f64; 3], material| {
        copy_of(&pebble, turned(scale, angle, DVec3::from_array(at)), material)
    };
    let meshes = [
        place([1.0, 1.0, 0.6], 0.3, [5.0, -1.8, -0.4], 0),
        place([0.7, -0.9, 0.9], 2.0, [5.0, 1.6, -0.2], 2),
        place([0.7, 0.7, 0.7], 1.0, [3.8, 0.1, -0.5], 4),
        place([0.2, 1.2, -1.4], 4.0, [7.0, 0.3, 0.3], 3),
        Entity { flip_normal: true, ..place([0.6; 3], 5.0, [4.2, 2.4, 0.8], 1) },
        Entity { emission: [4.0; 3], ..place([0.6, 0.6, 0.3], 0.0, [4.0, 0.0, 2.2], 0) },
    ];
    scene.entities.retain(|entity| !matches!(entity.shape, Shape::Mesh { .. }));
    scene.entities.splice(1..1, meshes);
    scene
}

/// A scene with a tree: meshes with and without normals and uv, of which one emits, one is flipped and one mirrored,
/// among spheres and quads, over a plane.
pub(super) fn crowd(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.8, 0.7, 0.6]),
        matte([0.2, 0.3, 0.4]),
        mirror([0.9, 0.8, 0.7]),
        material(MaterialKind::Checkerboard(CheckerboardParameters {
            even: 0,
            odd: 1,
            checks_per_unit: [3.0, 2.0],
        })),
        material(MaterialKind::Glass(GlassParameters {
            ior: 1.5,
            reflectance: [1.0; 3],
            transmittance: [0.9, 1.0, 0.9],
        })),
    ];
    let at = |x: f64, y: f64, z: f64, scale: f64| {
        DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            DQuat::from_rotation_z(0.3),
            DVec3::new(x, y, z),
        )
    };
    let mirrored = DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0));
    let emitting = |emission: f64, entity| Entity { emission: [emission; 3], ..entity };
    let mut entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 3),
        placed(ball(6, 0.15, false, true), at(5.0, 2.2, -0.3, 1.1), 3),
        placed(ball(5, 0.0, true, false), at(4.5, -0.2, -0.5, 0.9) * mirrored, 4),
        placed(ball(4, 0.0, true, true), at(6.5, -2.2, -0.2, 1.2), 2),
        emitting(5.0, placed(ball(2, 0.2, true, false), at(4.0, 1.0, 2.2, 0.5), 1)),
        Entity {
            flip_normal: true,
            ..emitting(0.4, placed(ball(3, 0.1, false, false), at(4.0, 0.0, 0.0, 20.0), 0))
        },
        quad([3.0, -3.2, -1.5], [0.0, 0.4, 0.0], [0.5, 0.0, 1.5], 3),
        emitting(3.0, quad([5.0, -1.0, 3.5], [0.0, 1.5, 0.0], [1.5, 0.0, 0.0], 0)),
    ];
    for i in 0..30 {
        let angle = f64::from(i) * 2.4;
        let (radius, x) = (0.12 + 0.01 * f64::from(i % 7), 3.0 + f64::from(i) * 0.12);
        let [y, z] = [angle.cos() * 2.0, -1.0 + 0.1 * f64::from(i % 5)];
        entities.push(sphere([x, y, z], radius, [0, 1, 2][i as usize % 3]));
        entities.push(quad([x, y * 0.7, 1.0 + z], [0.0, 0.3, 0.1], [0.2, 0.0, 0.2], i as usize % 4));
    }
    let mut scene = scene(width, height, materials, entities);
    scene.environment = [0.1, 0.1, 0.2];
    scene
}

/// The same with fourteen lights, none of which touches what it lights.
pub(super) fn crowd_with_few_lamps(width: u32, height: u32) -> Scene {
    let mut scene = crowd(width, height);
    let mut meshes = scene.entities.iter_mut().filter(|entity| matches!(entity.shape, Shape::Mesh { .. }));
    if let [_, _, _, lamp, sky] = &mut meshes.by_ref().collect::<Vec<_>>()[..] {
        sky.emission = [0.0; 3];
        let Shape::Mesh { mesh, .. } = &mut lamp.shape else { unreachable!("meshes are asked for") };
        *mesh = Arc::new(ball(1, 0.2, true, false));
    }
    scene
}

/// Two emissive meshes of many triangles, a quad and a point light, above a floor and a mirror.
pub(super) fn lamps_of_triangles(width: u32, height: u32) -> Scene {
    let emitting = |emission: f64, entity| Entity { emission: [emission; 3], ..entity };
    let lamp = |n, scale: f64, at: [f64; 3]| {
        placed(ball(n, 0.2, false, false), turned([scale; 3], 0.7, DVec3::from_array(at)), 1)
    };
    let entities = vec![
        plane([0.0, 0.0, 1.0], -1.5, 0),
        emitting(4.0, lamp(5, 0.5, [4.0, 1.2, 0.3])),
        emitting(3.0, quad([5.0, -1.0, 2.5], [0.0, 1.5, 0.0], [1.5, 0.0, 0.0], 0)),
        emitting(2.0, lamp(9, 0.7, [6.0, -1.5, 0.5])),
        sphere([4.5, -0.2, -0.7], 0.6, 2),
    ];
    let mut scene =
        scene(width, height, vec![matte([0.8, 0.7, 0.6]), matte([0.0; 3]), mirror([0.9; 3])], entities);
    scene.lights = vec![Light::Point(PointLightParameters {
        position: DVec3::new(3.0, 0.0, 2.0),
        intensity: Some([1.0; 3]),
        power: None,
    })];
    scene
}

/// Two scenes in one, with the camera of the first.
fn joined(mut scene: Scene, other: Scene) -> Scene {
    let first = scene.materials.len();
    for mut material in other.materials {
        if let MaterialKind::Checkerboard(parameters) = &mut material.kind {
            parameters.even += first;
            parameters.odd += first;
        }
        scene.materials.push(material);
    }
    let entities = other.entities.into_iter();
    scene.entities.extend(entities.map(|entity| Entity { material: entity.material + first, ..entity }));
    scene.lights.extend(other.lights);
    scene
}

/// Shapes, lights and materials of every kind, through a lens: the contents of the bazaar, the shop and the copies of a
/// mesh.
pub(super) fn everything(width: u32, height: u32) -> Scene {
    joined(joined(bazaar(width, height), shop(width, height)), copies(width, height))
}

/// An emissive sphere straight ahead and nothing else; paths find only its radiance.
pub(super) fn beacon(emission: [f64; 3]) -> Scene {
    let mut scene =
        scene(16, 16, vec![matte([0.5; 3])], vec![Entity { emission, ..sphere([4.0, 0.0, 0.0], 2.0, 0) }]);
    scene.film.filter = Filter::None;
    scene.render.max_depth = 0;
    scene
}

/// The cover with a broken floor.
#[cfg(feature = "broken-material")]
pub(super) fn broken(width: u32, height: u32) -> Scene {
    let mut scene = cover(width, height);
    scene.materials[4].kind = MaterialKind::Broken(crate::scene::BrokenParameters {});
    scene
}
