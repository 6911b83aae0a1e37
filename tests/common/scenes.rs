//! Scenes, and their parts.

use glam::{DAffine3, DVec3};
use rand::RngExt;
use std::collections::HashMap;
use std::sync::Arc;
use stride::math::Vec3;
use stride::sampling::Stream;
use stride::scene::{
    BoxParameters, CheckerboardParameters, ConductorParameters, CylinderParameters, DiskParameters, Entity,
    FilmSettings, Filter, GlassParameters, Integrator, Light, Material, MaterialKind, MatteParameters, Mesh,
    MirrorParameters, PlaneParameters, PointLightParameters, QuadParameters, RenderSettings, Sampler, Scene,
    Shape, SphereParameters,
};

pub fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Rounded to single precision.
pub fn narrow(v: DVec3) -> Vec3<f32> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

pub fn wide(v: Vec3<f32>) -> DVec3 {
    DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z))
}

/// A unit vector, uniformly distributed.
pub fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let phi = stream.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    v(r * phi.cos(), r * phi.sin(), z)
}

pub fn matte(reflectance: [f64; 3]) -> Material {
    Material {
        name: "matte".into(),
        kind: MaterialKind::Matte(MatteParameters { reflectance, roughness: 0.0 }),
        ..Material::default()
    }
}

pub fn mirror(reflectance: [f64; 3]) -> Material {
    Material {
        name: "mirror".into(),
        kind: MaterialKind::Mirror(MirrorParameters { reflectance }),
        ..Material::default()
    }
}

pub fn glass(ior: f64) -> Material {
    let (reflectance, transmittance) = ([1.0; 3], [1.0; 3]);
    Material {
        name: "glass".into(),
        kind: MaterialKind::Glass(GlassParameters { ior, reflectance, transmittance }),
        ..Material::default()
    }
}

pub fn checkerboard(even: usize, odd: usize, checks: f64) -> Material {
    let kind = MaterialKind::Checkerboard(CheckerboardParameters { even, odd, checks_per_unit: [checks; 2] });
    Material { name: "checkerboard".into(), kind, ..Material::default() }
}

/// An entity without emission of the given material.
pub fn entity(shape: Shape, material: usize) -> Entity {
    Entity { shape, material, ..Entity::default() }
}

pub fn plane(normal: DVec3, distance: f64, material: usize) -> Entity {
    entity(Shape::Plane(PlaneParameters { normal, distance }), material)
}

pub fn sphere(center: DVec3, radius: f64, material: usize) -> Entity {
    entity(Shape::Sphere(SphereParameters { center, radius }), material)
}

pub fn quad(corner: DVec3, u: DVec3, v: DVec3, material: usize) -> Entity {
    entity(Shape::Quad(QuadParameters { corner, u, v }), material)
}

pub fn disk(center: DVec3, normal: DVec3, radius: f64, material: usize) -> Entity {
    entity(Shape::Disk(DiskParameters { center, normal, radius }), material)
}

pub fn cylinder(from: DVec3, to: DVec3, radius: f64, material: usize) -> Entity {
    entity(Shape::Cylinder(CylinderParameters { from, to, radius }), material)
}

pub fn cuboid(min: DVec3, max: DVec3, material: usize) -> Entity {
    entity(Shape::Box(BoxParameters { min, max }), material)
}

/// The entity, emitting.
pub fn emitting(entity: Entity, radiance: f64) -> Entity {
    Entity { emission: [radiance; 3], ..entity }
}

/// The entity with a flipped normal.
pub fn flipped(entity: Entity) -> Entity {
    Entity { flip_normal: true, ..entity }
}

/// A point light of the same intensity in all channels.
pub fn point_light(position: DVec3, intensity: f64) -> Light {
    Light::Point(PointLightParameters { position, intensity: Some([intensity; 3]), power: None })
}

/// A camera at the origin that looks along x with z up, with a vertical field of view of 90°, on a film of 16 × 16
/// pixels sampled at their centres, over these entities. Its samples are independent, so that noise can be estimated.
pub fn scene(materials: Vec<Material>, entities: Vec<Entity>) -> Scene {
    Scene {
        film: FilmSettings { width: 16, height: 16, filter: Filter::None, ..FilmSettings::default() },
        render: RenderSettings {
            integrator: Integrator::PathNaive,
            sampler: Sampler::Independent,
            samples: 16,
            ..RenderSettings::default()
        },
        materials,
        entities,
        ..Scene::default()
    }
}

/// The scene on a film of another size.
pub fn sized(mut scene: Scene, width: u32, height: u32) -> Scene {
    (scene.film.width, scene.film.height) = (width, height);
    scene
}

/// Indices of the cover's entities.
pub const COVER_COLOURED_SPHERE: usize = 5;
pub const COVER_WHITE_SPHERE: usize = 6;
pub const COVER_LIGHT: usize = 7;
/// Index of the white sphere's material.
pub const COVER_WHITE_MIRROR: usize = 6;

/// The report's cover: a room with two mirror spheres and a light.
pub fn cover(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.75, 0.25, 0.25]),
        matte([0.25, 0.25, 0.75]),
        matte([0.75; 3]),
        mirror([0.6, 0.4, 0.2]),
        checkerboard(2, 3, 10.0),
        mirror([0.25, 0.75, 0.25]),
        mirror([1.0; 3]),
    ];
    let entities = vec![
        plane(v(0.0, 1.0, 0.0), -6.0, 0),
        plane(v(0.0, -1.0, 0.0), -6.0, 1),
        plane(v(0.0, 0.0, -1.0), -8.0, 2),
        plane(v(-1.0, 0.0, 0.0), -10.0, 2),
        plane(v(0.0, 0.0, 1.0), -3.0, 4),
        sphere(v(8.0, 3.0, -1.0), 2.0, 5),
        sphere(v(6.0, -2.0, -1.0), 2.0, 6),
        emitting(sphere(v(7.0, 0.0, 3.0), 1.0, 2), 1.0),
    ];
    let mut scene = sized(scene(materials, entities), width, height);
    scene.film.filter = Filter::Tent { radius: 1.0 };
    scene
}

/// The bounds of the smallpt box, which no path leaves.
pub const SMALLPT_BOX: [[f64; 2]; 3] = [[1.0, 99.0], [0.0, 81.6], [0.0, 170.0]];

/// Three hundred small lights above a floor with boxes made of quads.
pub fn bazaar(width: u32, height: u32) -> Scene {
    let mut entities = vec![plane(DVec3::Z, -2.0, 0)];
    // Quasi-random positions by a generalised golden ratio (Roberts 2018).
    let spread = |i: u32, step: f64| (0.5 + f64::from(i) * step).fract();
    for i in 0..8 {
        let (x, y) = (4.0 + 8.0 * spread(i, 0.7548776662), -5.0 + 10.0 * spread(i, 0.5698402910));
        let (side, tall) = (0.4 + 0.1 * f64::from(i), 0.5 + 1.5 * spread(i, 0.6180339887));
        let corner = v(x, y, -2.0);
        let (a, b, up) = (v(side, 0.3, 0.0), v(-0.3, side, 0.0), v(0.0, 0.0, tall));
        for (corner, u, w) in [
            (corner, a, up),
            (corner + a, b, up),
            (corner + a + b, -a, up),
            (corner + b, -b, up),
            (corner + up, a, b),
        ] {
            entities.push(quad(corner, u, w, 1));
        }
    }
    for i in 0..300 {
        let place = [0.8191725134, 0.6710436067, 0.5497004779].map(|step| spread(i, step));
        let centre = v(3.0 + 9.0 * place[0], -6.0 + 12.0 * place[1], -1.8 + 3.0 * place[2]);
        entities.push(emitting(sphere(centre, 0.05, 0), 20.0));
    }
    let mut scene = scene(vec![matte([0.7, 0.6, 0.5]), mirror([0.8; 3])], entities);
    scene.render.max_depth = 5;
    sized(scene, width, height)
}

/// The box of Kevin Beason's smallpt. Its walls are the insides of spheres of radius 10⁵, which deviate by 0.05 from
/// planes over the box.
pub fn smallpt(width: u32, height: u32) -> Scene {
    let materials = vec![
        matte([0.75, 0.25, 0.25]),
        matte([0.25, 0.25, 0.75]),
        matte([0.75; 3]),
        matte([0.0; 3]),
        mirror([0.999; 3]),
        Material {
            name: "glass".into(),
            kind: MaterialKind::Glass(GlassParameters {
                ior: 1.5,
                reflectance: [0.999; 3],
                transmittance: [0.999; 3],
            }),
            ..Material::default()
        },
    ];
    let wall = |x, y, z, material| flipped(sphere(v(x, y, z), 1e5, material));
    let entities = vec![
        wall(1e5 + 1.0, 40.8, 81.6, 0),
        wall(-1e5 + 99.0, 40.8, 81.6, 1),
        wall(50.0, 40.8, 1e5, 2),
        wall(50.0, 40.8, -1e5 + 170.0, 3),
        wall(50.0, 1e5, 81.6, 2),
        wall(50.0, -1e5 + 81.6, 81.6, 2),
        sphere(v(27.0, 16.5, 47.0), 16.5, 4),
        sphere(v(73.0, 16.5, 78.0), 16.5, 5),
        emitting(sphere(v(50.0, 681.6 - 0.27, 81.6), 600.0, 3), 12.0),
    ];
    let mut scene = sized(scene(materials, entities), width, height);
    // smallpt's camera rays start 140 in front of its eye, inside the box.
    let forward = v(0.0, -0.042_612, -1.0).normalize();
    scene.camera.eye = v(50.0, 52.0, 295.6) + forward * 140.0;
    scene.camera.forward = forward;
    scene.camera.up = DVec3::Y;
    scene.camera.vertical_fov = 2.0 * (0.5135_f64 / 2.0).atan();
    scene.film.filter = Filter::Tent { radius: 1.0 };
    scene
}

/// The entity of a mesh, without a transform.
pub fn mesh(mesh: Mesh, material: usize) -> Entity {
    entity(Shape::Mesh { mesh: Arc::new(mesh), transform: DAffine3::IDENTITY }, material)
}

/// A sphere of triangles: an icosahedron whose sides are divided into `n` × `n`, with the sphere's normals if it is
/// smooth.
pub fn icosphere(centre: DVec3, radius: f64, n: u32, smooth: bool) -> Mesh {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        corners.extend([v(a, b, 0.0), v(0.0, a, b), v(b, 0.0, a)]);
    }
    let edge = corners[0].distance(corners[3]);
    let near = |a: DVec3, b: DVec3| (a.distance(b) - edge).abs() < 1e-6;
    let mut mesh = Mesh::default();
    let mut triangles = Vec::new();
    let mut seen: HashMap<[i64; 3], u32> = HashMap::new();
    let mut vertex = |p: DVec3| {
        let p = p.normalize();
        // Neighbours share the vertices of their common side.
        let next = seen.len() as u32;
        *seen.entry((p * 1e9).round().to_array().map(|x| x as i64)).or_insert_with(|| {
            mesh.positions.push((centre + p * radius).to_array().map(|x| x as f32));
            if smooth {
                mesh.normals.push(p.to_array().map(|x| x as f32));
            }
            next
        })
    };
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1).filter(|&&c| near(a, b) && near(b, c) && near(c, a)) {
                let (b, c) = if (b - a).cross(c - a).dot(a) > 0.0 { (b, c) } else { (c, b) };
                let at =
                    |i: u32, j: u32| a + ((b - a) * f64::from(i) + (c - a) * f64::from(j)) / f64::from(n);
                for i in 0..n {
                    for j in 0..n - i {
                        let lower = [at(i, j), at(i + 1, j), at(i, j + 1)].map(&mut vertex);
                        triangles.push(lower);
                        if i + j + 2 <= n {
                            triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)].map(&mut vertex));
                        }
                    }
                }
            }
        }
    }
    mesh.triangles = triangles;
    mesh
}

/// Textures of every kind on materials of every kind, on shapes of every kind.
pub fn gallery(width: u32, height: u32) -> Scene {
    let (materials, textures, images) = textured::textured_materials();
    let lamp = sphere(v(4.5, 0.0, 2.5), 0.5, 6);
    let entities = vec![
        plane(DVec3::Z, -1.5, 4),
        quad(v(7.0, 3.0, -1.5), v(0.0, -3.0, 0.0), v(0.5, 0.0, 3.5), 5),
        quad(v(7.0, -0.1, -1.5), v(0.0, -3.0, 0.0), v(0.5, 0.0, 3.5), 1),
        sphere(v(5.0, 1.8, -0.7), 0.8, 2),
        sphere(v(4.0, 0.0, -0.7), 0.7, 3),
        sphere(v(5.0, -1.8, -0.6), 0.9, 1),
        sphere(v(3.6, 1.1, -1.1), 0.4, 7),
        sphere(v(3.6, -1.0, -1.1), 0.4, 8),
        quad(v(2.0, -3.0, -1.4), v(5.0, 0.0, 0.0), v(0.0, 0.4, 2.0), 9),
        disk(v(5.5, 0.0, 1.2), v(-1.0, 0.0, 0.0), 0.6, 9),
        cylinder(v(4.5, 2.4, -1.5), v(4.5, 2.4, 0.5), 0.3, 9),
        emitting(lamp, 6.0),
        Entity {
            emission_texture: Some(13),
            ..quad(v(3.0, 3.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 0.0, 2.0), 6)
        },
    ];
    let mut all = Scene { textures, images, ..scene(materials, entities) };
    all.environment = [0.2, 0.3, 0.4];
    all.render.max_depth = 6;
    sized(all, width, height)
}

/// Rough metal, glass and matte spheres on a floor, under a picture with a sun, beside a lamp.
pub fn sunny(width: u32, height: u32) -> Scene {
    let metal = ConductorParameters {
        metal: None,
        eta: Some([0.2, 0.9, 1.1]),
        k: Some([3.9, 2.4, 2.1]),
        roughness: [0.4; 2],
    };
    let metal = Material { kind: MaterialKind::Conductor(metal), ..matte([0.0; 3]) };
    let materials = vec![matte([0.6, 0.5, 0.4]), metal, glass(1.5)];
    let entities = vec![
        plane(DVec3::Z, -1.0, 0),
        sphere(v(4.0, 1.4, -0.3), 0.7, 0),
        sphere(v(4.0, 0.0, -0.3), 0.7, 1),
        sphere(v(4.0, -1.4, -0.3), 0.7, 2),
        emitting(quad(v(3.5, -3.5, 1.5), v(0.0, 1.0, 0.0), v(1.0, 0.0, 0.0), 0), 5.0),
    ];
    let mut all = Scene { images: vec![textured::sunny_sky()], ..scene(materials, entities) };
    all.environment_picture = Some(textured::sunny());
    sized(all, width, height)
}

/// Dielectrics with absorption that overlap, with a lamp and a grey sphere inside.
pub fn interiors(width: u32, height: u32) -> Scene {
    let lamp = quad(v(3.0, -1.0, 3.0), v(0.0, 2.0, 0.0), v(2.0, 0.0, 0.0), 5);
    let entities = vec![
        plane(DVec3::Z, -1.5, 0),
        plane(v(-1.0, 0.0, 0.0), -8.0, 0),
        // The front of a tank, which overlaps the water behind it.
        cuboid(v(3.0, -1.6, -1.4), v(3.3, 1.6, 0.5), 1),
        cuboid(v(3.2, -1.5, -1.35), v(5.0, 1.5, 0.2), 2),
        sphere(v(4.0, 0.8, -0.5), 0.5, 1),
        sphere(v(4.2, -0.8, -0.6), 0.5, 4),
        sphere(v(4.0, 0.0, -1.0), 0.3, 0),
        // Floating: the part under water is hidden.
        sphere(v(4.2, 0.1, 0.2), 0.35, 3),
        emitting(sphere(v(4.6, 0.3, -0.5), 0.2, 5), 8.0),
        emitting(lamp, 5.0),
    ];
    let mut all = scene(textured::interior_materials(), entities);
    all.lights = vec![point_light(v(4.5, -0.2, -0.3), 1.0)];
    all.environment = [0.2, 0.3, 0.4];
    all.render.max_depth = 8;
    sized(all, width, height)
}

/// A material of a dielectric: see `gallery.rs`.
pub fn dielectric(ior: f64, roughness: f64, priority: u32, absorption: [f64; 3]) -> Material {
    textured::dielectric(ior, roughness, priority, absorption)
}

/// Every bounded shape around the origin, with a material each.
pub fn shapes_of_all_kinds() -> Vec<Entity> {
    textured::bounded_shapes()
}

/// Adds groups to a scene of at least six materials: see there.
pub fn add_groups_to(scene: &mut Scene) {
    textured::add_groups(scene);
}

/// Materials with mixes, holes, back sides and maps, on shapes of every kind.
pub fn modified(width: u32, height: u32) -> Scene {
    let (materials, textures, images) = textured::modified_materials();
    let entities = vec![
        plane(DVec3::Z, -1.5, 16),
        quad(v(7.0, 3.0, -1.5), v(0.0, -6.0, 0.0), v(0.5, 0.0, 4.5), 10),
        sphere(v(5.0, 1.8, -0.6), 0.9, 13),
        sphere(v(4.0, 0.0, -0.7), 0.7, 15),
        sphere(v(5.0, -1.8, -0.6), 0.9, 17),
        flipped(sphere(v(3.6, 1.1, -1.1), 0.4, 12)),
        // A partly transparent surface in front of all of it, and another one behind that.
        quad(v(2.0, 1.0, -1.4), v(0.2, -2.5, 0.0), v(0.0, 0.0, 1.2), 11),
        quad(v(2.4, 0.6, -1.4), v(0.0, -2.5, 0.3), v(0.0, 0.2, 1.4), 12),
        disk(v(5.5, 0.0, 1.2), v(-1.0, 0.0, 0.0), 0.6, 14),
        cylinder(v(4.5, 2.4, -1.5), v(4.5, 2.4, 0.5), 0.3, 14),
        mesh(icosphere(v(3.4, -1.0, -1.0), 0.4, 3, true), 13),
        emitting(sphere(v(4.5, 0.0, 2.5), 0.5, 6), 6.0),
        emitting(quad(v(3.0, 2.8, 0.0), v(2.0, 0.0, 0.0), v(0.0, 0.0, 2.0), 11), 1.0),
    ];
    let mut all = Scene { textures, images, ..scene(materials, entities) };
    textured::add_mapped_group(&mut all);
    all.lights = vec![point_light(v(1.0, 0.5, 1.5), 4.0)];
    all.environment = [0.2, 0.3, 0.4];
    all.render.max_depth = 6;
    sized(all, width, height)
}

mod textured {
    use crate::common::shapes::{is_bounded, samples};
    use std::sync::Arc;
    use stride::parameter::{ImageIndex, Varying};
    use stride::scene::*;
    use stride::texture::{ColorSpace, Depth, ImageFile, Picture, TexelFilter, Tile, Wrap};
    include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/common/gallery.rs"));
}

/// Shapes of every kind that emit textures, and meshes that use both sets of uv.
pub fn glow(width: u32, height: u32) -> Scene {
    let mut all = scene(Vec::new(), Vec::new());
    textured::add_glow(&mut all);
    sized(all, width, height)
}
