//! From the description of a scene to its tables.

use super::extent::extent;
use super::look::Look;
use super::sharing::{SHARING_PAYS_FROM, shared};
use super::size::{Size, TooLarge};
use super::surfaces::SurfaceTable;
use super::{Finder, Instances, Simple, Triangles, World};
use crate::camera::Camera;
use crate::light::{Environment, LightTable, NO_LIGHT, Surroundings};
use crate::material::{Binding, MaterialKind, MaterialTable, Place};
use crate::math::narrow;
use crate::scene::{self, Material, Scene};
use crate::shape::{Piece, Shape};
use crate::texture::{Compiler, NO_TEXTURE};
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
    /// The media that the camera is inside of: see [`Media::packed`](crate::material::Media::packed).
    pub inside: [u32; 2],
}

impl CompiledScene {
    /// The same scene, seen by another camera; its surfaces are those of the world.
    pub fn seen_by(&self, camera: Camera, world: &World) -> CompiledScene {
        CompiledScene { camera, ..self.clone() }.submerged(world)
    }
}

/// Compiles a scene for a film of `width` × `height` pixels, into tables and the surfaces that rays meet.
///
/// # Errors
///
/// If there is more in the scene than can be numbered: see [`Size::check`].
pub fn compile(scene: &Scene, width: u32, height: u32) -> Result<(CompiledScene, Simple), TooLarge> {
    compile_sharing(scene, width, height, SHARING_PAYS_FROM)
}

/// As [`compile`], with meshes shared that have so many triangles in all their copies.
pub fn compile_sharing(
    scene: &Scene,
    width: u32,
    height: u32,
    from: usize,
) -> Result<(CompiledScene, Simple), TooLarge> {
    let (shared_meshes, shared) = shared(scene, from);
    Size::sharing(scene, &shared_meshes, &shared).check()?;
    let mut instances = Instances::default();
    let mut surfaces = SurfaceTable::default();
    let mut all = Simple::default();
    let mut triangles = Triangles::default();
    let mut lights = LightTable::default();
    let Textures { materials, emitted, surroundings } = textures(scene);
    lights.set_textures(Arc::clone(materials.textures()));
    if let Some(around) = surroundings {
        lights.push_surroundings(&around);
    }
    // The last mesh that emits.
    let mut lamp = None;
    for light in &scene.lights {
        light.add_to(&mut lights);
    }
    for (index, entity) in scene.entities.iter().enumerate() {
        let emission_texture = emitted[index];
        let is_textured = emission_texture != NO_TEXTURE;
        let emission = if is_textured { [0.0; 3] } else { narrow(entity.emission) };
        let flipped = entity.flip_normal;
        let emits = emission.iter().any(|&e| e > 0.0);
        let material = entity.material as u32;
        let mut look = Look {
            material,
            emission,
            emission_texture,
            flip_normal: flipped,
            entity: index as u32,
            light: NO_LIGHT,
        };
        for piece in entity.shape.pieces() {
            look.light = if is_textured {
                lights.push_textured(&piece, flipped, emission_texture)
            } else if emits {
                lights.push_piece(&piece, flipped, emission)
            } else {
                NO_LIGHT
            };
            match piece {
                Piece::Plane(plane) => all.planes.push((plane, surfaces.push(plane.surface(), look))),
                Piece::Sphere(sphere) => all.spheres.push((sphere, surfaces.push(sphere.surface(), look))),
                Piece::Quad(quad) => all.quads.push((quad, surfaces.push(quad.surface(), look))),
                Piece::Rare(rare) => all.rare.push((rare, surfaces.push(rare.surface(), look))),
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
    lights.set_environment(Environment { radiance: narrow(scene.environment) });
    if !lights.infinite_lights().is_empty() {
        lights.set_extent(extent(scene, &surfaces, &all));
    }
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
        materials,
        lights,
        ambient: narrow(scene.render.ambient),
        inside: [0; 2],
    };
    if compiled.materials.media().is_none() {
        return Ok((compiled, all));
    }
    Ok((compiled.submerged(&World::new(&all, Finder::Simple)), all))
}

/// What is made of the textures of a scene.
struct Textures {
    /// The materials, with those that they and the entities use.
    materials: MaterialTable,
    /// For each entity the texture that its emission is, or [`NO_TEXTURE`].
    emitted: Vec<u32>,
    /// The picture that is the environment.
    surroundings: Option<Surroundings>,
}

fn textures(scene: &Scene) -> Textures {
    let mut kinds: Vec<_> = scene.textures.iter().map(|texture| texture.kind.clone()).collect();
    kinds.extend(scene.environment_picture.map(|picture| picture.texture().into()));
    let mut compiler = Compiler::new(&kinds, &scene.images);
    let emitted = scene.entities.iter().map(|entity| entity.emission_texture);
    let emitted =
        emitted.map(|texture| texture.map_or(NO_TEXTURE, |texture| compiler.root(texture))).collect();
    let surroundings = scene.environment_picture.map(|picture| Surroundings {
        texture: compiler.root(scene.textures.len()),
        scale: picture.scale,
        rotate: picture.rotate,
        up: picture.up,
        // `whitted` finds no light but by sampling it.
        is_contested: scene.render.integrator != scene::Integrator::Whitted,
    });
    let kinds: Vec<MaterialKind> = scene.materials.iter().map(Material::textured_kind).collect();
    let rows = kinds.iter().map(MaterialKind::row).collect();
    let mut bindings = Vec::new();
    for (row, material) in scene.materials.iter().enumerate() {
        for textured in &material.textures {
            // What can be no texture is refused when a scene is checked.
            if let Some(place) = Place::of(&kinds[row], textured.parameter) {
                bindings.push(Binding { row, place, texture: compiler.root(textured.texture) });
            }
        }
    }
    Textures {
        materials: MaterialTable::with_textures(rows, &bindings, Arc::new(compiler.finish())),
        emitted,
        surroundings,
    }
}
