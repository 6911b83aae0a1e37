//! From the description to the tables.

use super::surfaces::{Look, NO_LIGHT, SurfaceTable};
use super::{Instances, Simple, Triangles};
use crate::camera::Camera;
use crate::light::{AreaLight, LightTable, PointLight, PointLights};
use crate::material::{Kind, MaterialTable, Row};
use crate::scene::{
    self, CheckerboardParameters, GlassParameters, MaterialKind, MatteParameters, MirrorParameters, Scene,
};
use crate::shape::{Cylinder, Disk, Mesh, Plane, Quad, Rare, Shape, Sphere};
use std::collections::HashMap;
use std::sync::Arc;

/// What a path looks up, whatever the world that finds its hits.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    /// The camera over the film.
    pub camera: Camera,
    /// The surfaces.
    pub surfaces: SurfaceTable,
    /// The materials.
    pub materials: MaterialTable,
    /// The lights that no path can hit.
    pub point_lights: PointLights,
    /// Every light that can be sampled: points, and emitters with a finite area.
    pub lights: LightTable,
    /// Radiance from everywhere outside.
    pub environment: [f32; 3],
    /// The ambient term of `whitted`.
    pub ambient: [f32; 3],
}

impl CompiledScene {
    /// The same scene, seen by another camera.
    pub fn seen_by(&self, camera: Camera) -> CompiledScene {
        CompiledScene { camera, ..self.clone() }
    }
}

fn narrow(v: glam::DVec3) -> [f32; 3] {
    colour(v.to_array())
}

fn colour(c: [f64; 3]) -> [f32; 3] {
    c.map(|x| x as f32)
}

fn material_row(kind: &MaterialKind) -> Row {
    match *kind {
        MaterialKind::Matte(MatteParameters { reflectance }) => Row::matte(colour(reflectance)),
        MaterialKind::Mirror(MirrorParameters { reflectance }) => {
            Row { kind: Kind::Mirror, ..Row::matte(colour(reflectance)) }
        }
        MaterialKind::Glass(GlassParameters { ior, reflectance, transmittance }) => Row {
            kind: Kind::Glass,
            transmittance: colour(transmittance),
            ior: ior as f32,
            ..Row::matte(colour(reflectance))
        },
        MaterialKind::Checkerboard(CheckerboardParameters { even, odd, checks_per_unit }) => Row {
            kind: Kind::Checkerboard,
            checks: [even as u32, odd as u32],
            checks_per_unit: checks_per_unit.map(|x| x as f32),
            ..Row::matte([0.0; 3])
        },
        #[cfg(feature = "broken-material")]
        MaterialKind::Broken(_) => Row { kind: Kind::Broken, ..Row::matte([1.0; 3]) },
    }
}

/// Triangles in all copies of a mesh from which on it is kept once, and rays are taken to each place where it
/// stands: fewer are found faster in one tree.
pub const SHARING_PAYS_FROM: usize = 1 << 16;

/// Which mesh is shared by an entity, if it is: meshes that stand at several places, have so many triangles in all
/// copies, and do not emit; a light is chosen triangle by triangle, each of which needs a place of its own.
fn shared(scene: &Scene, from: usize) -> (Vec<&Mesh>, Vec<Option<usize>>) {
    let could = |entity: &scene::Entity| match &entity.shape {
        scene::Shape::Mesh { mesh, transform }
            if !entity.emission.iter().any(|&e| e > 0.0) && Instances::can_place(transform) =>
        {
            Some(Arc::as_ptr(mesh))
        }
        _ => None,
    };
    let mut copies = HashMap::new();
    for mesh in scene.entities.iter().filter_map(could) {
        *copies.entry(mesh).or_insert(0_usize) += 1;
    }
    let (mut meshes, mut numbers) = (Vec::new(), HashMap::new());
    let of_entity = scene.entities.iter().map(|entity| {
        let (pointer, scene::Shape::Mesh { mesh, .. }) = (could(entity)?, &entity.shape) else { return None };
        let copies = copies[&pointer];
        let pays = copies > 1 && copies.saturating_mul(mesh.triangles.len()) >= from;
        pays.then(|| {
            *numbers.entry(pointer).or_insert_with(|| {
                meshes.push(&**mesh);
                meshes.len() - 1
            })
        })
    });
    let of_entity = of_entity.collect();
    (meshes, of_entity)
}

/// Compiles a scene for a film of `width` × `height` pixels, into tables and the surfaces that rays meet.
pub fn compile(scene: &Scene, width: u32, height: u32) -> (CompiledScene, Simple) {
    compile_sharing(scene, width, height, SHARING_PAYS_FROM)
}

/// With meshes shared that have so many triangles in all their copies.
pub fn compile_sharing(scene: &Scene, width: u32, height: u32, from: usize) -> (CompiledScene, Simple) {
    let (shared_meshes, shared) = shared(scene, from);
    let mut instances = Instances::default();
    let mut surfaces = SurfaceTable::default();
    let mut all = Simple::default();
    let mut triangles = Triangles::default();
    let mut lights = LightTable::default();
    let mut point_lights = PointLights::default();
    // The last mesh that emits.
    let mut lamp = None;
    for light in &scene.lights {
        let scene::Light::Point(scene::PointLightParameters { position, intensity }) = *light;
        let point = PointLight { position: narrow(position), intensity: colour(intensity) };
        point_lights.push(point);
        lights.push_point(point);
    }
    for (index, entity) in scene.entities.iter().enumerate() {
        let emission = colour(entity.emission);
        let flipped = entity.flip_normal;
        let emits = emission.iter().any(|&e| e > 0.0);
        let material = entity.material as u32;
        let mut look =
            Look { material, emission, flip_normal: flipped, entity: index as u32, light: NO_LIGHT };
        match entity.shape {
            scene::Shape::Plane(scene::PlaneParameters { normal, distance }) => {
                let plane = Plane { normal: narrow(normal), distance: distance as f32 };
                all.planes.push((plane, surfaces.push(plane.surface(), look)));
            }
            scene::Shape::Sphere(scene::SphereParameters { center, radius }) => {
                let sphere = Sphere::new(center, radius);
                if emits {
                    look.light = lights.push_area(AreaLight::Sphere(sphere), flipped, emission);
                }
                all.spheres.push((sphere, surfaces.push(sphere.surface(), look)));
            }
            scene::Shape::Quad(scene::QuadParameters { corner, u, v }) => {
                let quad = Quad::new(corner, u, v);
                if emits {
                    look.light = lights.push_area(AreaLight::Quad(quad), flipped, emission);
                }
                all.quads.push((quad, surfaces.push(quad.surface(), look)));
            }
            scene::Shape::Box(scene::BoxParameters { min, max }) => {
                for quad in Quad::sides(min, max) {
                    if emits {
                        look.light = lights.push_area(AreaLight::Quad(quad), flipped, emission);
                    }
                    all.quads.push((quad, surfaces.push(quad.surface(), look)));
                }
            }
            scene::Shape::Disk(scene::DiskParameters { center, normal, radius }) => {
                let disk = Disk::new(center, normal, radius);
                if emits {
                    look.light = lights.push_area(AreaLight::Disk(disk), flipped, emission);
                }
                all.rare.push((Rare::Disk(disk), surfaces.push(disk.surface(), look)));
            }
            scene::Shape::Cylinder(scene::CylinderParameters { from, to, radius }) => {
                let cylinder = Cylinder::new(from, to, radius);
                if emits {
                    look.light = lights.push_area(AreaLight::Cylinder(cylinder), flipped, emission);
                }
                all.rare.push((Rare::Cylinder(cylinder), surfaces.push(cylinder.surface(), look)));
            }
            scene::Shape::Mesh { ref transform, .. } if shared[index].is_some() => {
                let row = surfaces.push_instance(look, transform.matrix3.determinant() < 0.0);
                instances.push(shared[index].unwrap_or_default(), transform, row);
            }
            scene::Shape::Mesh { ref mesh, ref transform } => {
                let first = triangles.push(mesh, transform, surfaces.len() as u32);
                if emits {
                    let corners = (first..triangles.len()).map(|triangle| triangles.positions_of(triangle));
                    look.light = lights.push_mesh(corners, flipped, emission);
                    lamp = Some((first..triangles.len(), flipped));
                }
                surfaces.push_mesh(look, first);
            }
        }
    }
    instances.meshes = shared_meshes.into_iter().map(|mesh| triangles.push_shared(mesh)).collect();
    all.triangles = Arc::new(triangles);
    all.instances = Arc::new(instances);
    surfaces.set_triangles(Arc::clone(&all.triangles), Arc::clone(&all.instances));
    lights.build_tree();
    if scene.render.integrator == scene::Integrator::Whitted {
        lights.build_lamps();
    }
    lights.set_bulging_mesh(lamp.is_some_and(|(lamp, flipped)| {
        lamp == (0..all.triangles.len()) && all.triangles.bulge(lamp, flipped)
    }));
    let compiled = CompiledScene {
        camera: Camera::new(&scene.camera, width, height),
        surfaces,
        materials: MaterialTable::new(scene.materials.iter().map(|m| material_row(&m.kind)).collect()),
        point_lights,
        lights,
        environment: colour(scene.environment),
        ambient: colour(scene.render.ambient),
    };
    (compiled, all)
}
