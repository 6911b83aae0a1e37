//! From the description of a scene to its tables.

use super::surfaces::{Look, SurfaceTable};
use super::{Instances, Simple, Triangles};
use crate::camera::Camera;
use crate::light::{Environment, LightTable, NO_LIGHT};
use crate::material::MaterialTable;
use crate::scene::{self, Scene};
use crate::shape::{Mesh, Piece, Shape};
use std::collections::HashMap;
use std::sync::Arc;

/// The tables that paths look up; they do not depend on how hits are found.
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

fn colour(c: [f64; 3]) -> [f32; 3] {
    c.map(|x| x as f32)
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
        light.add_to(&mut lights);
    }
    for (index, entity) in scene.entities.iter().enumerate() {
        let emission = colour(entity.emission);
        let flipped = entity.flip_normal;
        let emits = emission.iter().any(|&e| e > 0.0);
        let material = entity.material as u32;
        let mut look =
            Look { material, emission, flip_normal: flipped, entity: index as u32, light: NO_LIGHT };
        for piece in entity.shape.pieces().unwrap_or_default() {
            look.light = if emits { lights.push_piece(&piece, flipped, emission) } else { NO_LIGHT };
            match piece {
                Piece::Plane(plane) => all.planes.push((plane, surfaces.push(plane.surface(), look))),
                Piece::Sphere(sphere) => all.spheres.push((sphere, surfaces.push(sphere.surface(), look))),
                Piece::Quad(quad) => all.quads.push((quad, surfaces.push(quad.surface(), look))),
                Piece::Rare(rare) => all.rare.push((rare, surfaces.push_rare(rare, look))),
            }
        }
        let scene::Shape::Mesh { mesh, transform } = &entity.shape else { continue };
        if let Some(shared) = shared[index] {
            let row = surfaces.push_instance(look, transform.matrix3.determinant() < 0.0);
            instances.push(shared, transform, row);
            continue;
        }
        let first = triangles.push(mesh, transform, surfaces.len() as u32);
        if emits {
            let corners = (first..triangles.len()).map(|triangle| triangles.positions_of(triangle));
            look.light = lights.push_mesh(corners, flipped, emission);
            lamp = Some((first..triangles.len(), flipped));
        }
        surfaces.push_mesh(look, first);
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
        materials: MaterialTable::new(
            scene.materials.iter().filter_map(|material| material.kind.row()).collect(),
        ),
        lights,
        ambient: colour(scene.render.ambient),
    };
    (compiled, all)
}
