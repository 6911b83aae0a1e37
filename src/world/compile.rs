//! From the description to the tables.

use super::surfaces::{Look, NO_LIGHT, SurfaceTable};
use super::{Instances, Simple, Triangles};
use crate::camera::Camera;
use crate::light::{AreaLight, Environment, LightTable, PointLight};
use crate::material::{self, MaterialTable, Row};
use crate::scene::{self, MaterialKind, Scene};
use crate::shape::{Cylinder, Disk, Mesh, Plane, Quad, Shape, Sphere};
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
    /// Every light that can be sampled, and what rays see that leave the scene.
    pub lights: LightTable,
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
        MaterialKind::Matte { reflectance } => material::Matte::row(reflectance),
        MaterialKind::Mirror { reflectance } => material::Mirror::row(reflectance),
        MaterialKind::Glass { ior, reflectance, transmittance } => {
            material::Glass::row(ior, reflectance, transmittance)
        }
        MaterialKind::Checkerboard { even, odd, checks_per_unit } => {
            material::Checkerboard::row(even, odd, checks_per_unit)
        }
        #[cfg(feature = "broken-material")]
        MaterialKind::Broken => material::Broken::row(),
    }
}

/// Triangles in all copies of a mesh from which on it is kept once, and rays are taken to each place where it
/// stands: fewer are found faster in one tree.
pub const SHARING_PAYS_FROM: usize = 1 << 16;

/// Which mesh is shared by an entity, if it is: meshes that stand at several places, have so many triangles in all
/// copies, and do not emit; a light is chosen triangle by triangle, each of which needs a place of its own.
pub(super) fn shared(scene: &Scene, from: usize) -> (Vec<&Mesh>, Vec<Option<usize>>) {
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

/// Compiles a scene for a film of `width` × `height` pixels, into tables and the surfaces that rays meet. The tables
/// have room for it: see [`Size::check`](super::Size::check).
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
    // The last mesh that emits.
    let mut lamp = None;
    for light in &scene.lights {
        let scene::Light::Point { position, intensity } = *light;
        lights.push(PointLight { position: narrow(position), intensity: colour(intensity) });
    }
    for (index, entity) in scene.entities.iter().enumerate() {
        let emission = colour(entity.emission);
        let flipped = entity.flip_normal;
        let emits = emission.iter().any(|&e| e > 0.0);
        let material = entity.material as u32;
        let mut look =
            Look { material, emission, flip_normal: flipped, entity: index as u32, light: NO_LIGHT };
        match entity.shape {
            scene::Shape::Plane { normal, distance } => {
                let plane = Plane { normal: narrow(normal), distance: distance as f32 };
                all.planes.push((plane, surfaces.push(plane.surface(), look)));
            }
            scene::Shape::Sphere { center, radius } => {
                let sphere = Sphere::new(center, radius);
                if emits {
                    look.light = lights.push(AreaLight { shape: sphere, flipped, emission });
                }
                all.spheres.push((sphere, surfaces.push(sphere.surface(), look)));
            }
            scene::Shape::Quad { corner, u, v } => {
                let quad = Quad::new(corner, u, v);
                if emits {
                    look.light = lights.push(AreaLight { shape: quad, flipped, emission });
                }
                all.quads.push((quad, surfaces.push(quad.surface(), look)));
            }
            scene::Shape::Box { min, max } => {
                for quad in Quad::sides(min, max) {
                    if emits {
                        look.light = lights.push(AreaLight { shape: quad, flipped, emission });
                    }
                    all.quads.push((quad, surfaces.push(quad.surface(), look)));
                }
            }
            scene::Shape::Disk { center, normal, radius } => {
                let disk = Disk::new(center, normal, radius);
                if emits {
                    look.light = lights.push(AreaLight { shape: disk, flipped, emission });
                }
                all.rare.push((disk.into(), surfaces.push_rare(disk.into(), look)));
            }
            scene::Shape::Cylinder { from, to, radius } => {
                let cylinder = Cylinder::new(from, to, radius);
                if emits {
                    look.light = lights.push(AreaLight { shape: cylinder, flipped, emission });
                }
                all.rare.push((cylinder.into(), surfaces.push_rare(cylinder.into(), look)));
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
    lights.set_environment(Environment { radiance: colour(scene.environment) });
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
        lights,
        ambient: colour(scene.render.ambient),
    };
    (compiled, all)
}
