//! Compiles the description of a scene into tables.

use super::attributes::SurfaceAttributes;
use super::extent::extent;
use super::groups::{GroupPlacements, Groups};
use super::sharing::{SHARING_PAYS_FROM, shared};
use super::size::{Size, TooLarge};
use super::surface_list::Surfaces;
use super::surfaces::SurfaceTable;
use super::{Instances, Simple, Triangles, World};
use crate::camera::Camera;
use crate::light::{Environment, EnvironmentMapParameters, LightTable, NO_LIGHT};
use crate::material::{Binding, MaterialKind, MaterialTable, ParameterSlot, RowModifiers};
use crate::math::narrow;
use crate::scene::{self, Material, Modifiers, Scene};
use crate::texture::{Compiler, NO_TEXTURE, SlopeStep, uses_of_second_uv};
use std::sync::Arc;

/// The tables that paths look up. They do not depend on the accelerator.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    /// The camera, for the size of the film.
    pub camera: Camera,
    /// The surfaces.
    pub surfaces: SurfaceTable,
    /// The materials.
    pub materials: MaterialTable,
    /// Every light that can be sampled, and the radiance of rays that leave the scene.
    pub lights: LightTable,
    /// Whether any surface may have shading normals other than the true ones: those of vertices, or of maps.
    pub(super) has_shading_normals: bool,
    /// The ambient radiance of `whitted`.
    pub ambient: [f32; 3],
    /// The media that contain the camera: see [`Media::packed`](crate::material::Media::packed).
    pub inside: [u32; 2],
}

impl CompiledScene {
    /// The same scene for another camera. `world` holds its surfaces.
    pub fn seen_by(&self, camera: Camera, world: &World) -> CompiledScene {
        CompiledScene { camera, ..self.clone() }.with_camera_media(world)
    }
}

/// Compiles a scene for a film of `width` × `height` pixels. Returns its tables, and the surfaces that rays can hit. The
/// camera is outside all dielectrics until [`CompiledScene::with_camera_media`] has looked for it in the [`World`] of
/// these surfaces.
///
/// # Errors
///
/// If the scene exceeds the limits of the tables: see [`Size::check`].
pub fn compile(scene: &Scene, width: u32, height: u32) -> Result<(CompiledScene, Simple), TooLarge> {
    compile_sharing(scene, width, height, SHARING_PAYS_FROM)
}

/// As [`compile`], sharing meshes that have at least `from` triangles in all their copies.
pub fn compile_sharing(
    scene: &Scene,
    width: u32,
    height: u32,
    from: usize,
) -> Result<(CompiledScene, Simple), TooLarge> {
    let (shared_meshes, shared) = shared(scene, from);
    let places = GroupPlacements::of(scene);
    Size::sharing(scene, &shared_meshes, &shared, &places).check()?;
    let Textures { materials, emitted, environment_map } = textures(scene);
    let triangles = Triangles::keeping(materials.textures().has_second_uv());
    let mut made = Surfaces { triangles, ..Surfaces::default() };
    made.lights.set_textures(Arc::clone(materials.textures()));
    if let Some(around) = environment_map {
        made.lights.push_environment_map(&around);
    }
    for light in &scene.lights {
        light.add_to(&mut made.lights);
    }
    let mut instances = Instances::default();
    let mut groups = Groups::of(scene, &places);
    for (index, entity) in scene.entities.iter().enumerate() {
        let is_textured = emitted[index] != NO_TEXTURE;
        let attributes = SurfaceAttributes {
            material: entity.material as u32,
            emission: if is_textured { [0.0; 3] } else { narrow(entity.emission) },
            emission_texture: emitted[index],
            flip_normal: entity.flip_normal,
            entity: index as u32,
            light: NO_LIGHT,
        };
        if let Some(group) = entity.within {
            if places.written_out[index] {
                places.of_group[group].iter().for_each(|place| made.add_copy(entity, place, attributes));
            } else {
                groups.add(group, entity, attributes, &mut made.table);
            }
            continue;
        }
        entity.shape.pieces().into_iter().for_each(|piece| made.add(piece, attributes));
        let scene::Shape::Mesh { mesh, transform } = &entity.shape else { continue };
        match shared[index] {
            Some(shared) => {
                let row = made.table.push_instance(attributes, transform.matrix3.determinant() < 0.0);
                instances.push(groups.len() + shared, transform, row);
            }
            None => made.add_mesh(mesh, transform, attributes),
        }
    }
    groups.place(&places, &mut made, &mut instances);
    let Surfaces { table: mut surfaces, mut all, mut triangles, mut lights, convex_candidate } = made;
    instances.meshes.extend(shared_meshes.into_iter().map(|mesh| triangles.push_shared(mesh)));
    all.triangles = Arc::new(triangles);
    all.instances = Arc::new(instances);
    surfaces.set_triangles(Arc::clone(&all.triangles), Arc::clone(&all.instances));
    lights.set_environment(Environment { radiance: narrow(scene.environment) });
    if !lights.infinite_lights().is_empty() {
        lights.set_extent(extent(scene, &surfaces, &all));
    }
    lights.build_tree();
    if scene.render.integrator == scene::Integrator::Whitted {
        lights.build_emitters();
    }
    lights.set_convex_emitter(convex_candidate.is_some_and(|(lamp, flipped)| {
        lamp == (0..all.triangles.len()) && all.instances.is_empty() && all.triangles.is_convex(lamp, flipped)
    }));
    let compiled = CompiledScene {
        camera: Camera::new(&scene.camera, width, height),
        has_shading_normals: surfaces.has_shading_normals() | materials.has_maps(),
        surfaces,
        materials,
        lights,
        ambient: narrow(scene.render.ambient),
        inside: [0; 2],
    };
    Ok((compiled, all))
}

/// The textures of a scene and their uses.
struct Textures {
    /// The materials, with the textures that they and the entities use.
    materials: MaterialTable,
    /// For each entity the texture of its emission, or [`NO_TEXTURE`].
    emitted: Vec<u32>,
    /// The image of the environment.
    environment_map: Option<EnvironmentMapParameters>,
}

/// See [`RowModifiers::bump_steps`]. Of heights that are constant along an axis, any step measures the slope.
fn bump_steps(step: SlopeStep) -> [f32; 3] {
    // The slope is measured along one of the sets, over the shorter step.
    let uv = [0, 1].map(|i| step.uv[i].min(step.second_uv[i]));
    let [u, v] = uv.map(|x| if x.is_finite() { x } else { 1.0 });
    // Devices may not know infinity.
    narrow([u, v, step.length.min(1e9)])
}

fn textures(scene: &Scene) -> Textures {
    let mut kinds: Vec<_> = scene.textures.iter().map(|texture| texture.kind.clone()).collect();
    kinds.extend(scene.environment_picture.map(|picture| picture.texture().into()));
    let uses_second_uv = uses_of_second_uv(&kinds);
    let mut compiler = Compiler::new(&kinds, &scene.images);
    let emitted = scene.entities.iter().map(|entity| entity.emission_texture);
    let emitted =
        emitted.map(|texture| texture.map_or(NO_TEXTURE, |texture| compiler.root(texture))).collect();
    let environment_map = scene.environment_picture.map(|picture| EnvironmentMapParameters {
        texture: compiler.root(scene.textures.len()),
        scale: picture.scale,
        rotate: picture.rotate,
        up: picture.up,
        // `whitted` finds lights only by sampling.
        is_contested: scene.render.integrator != scene::Integrator::Whitted,
    });
    let kinds: Vec<MaterialKind> = scene.materials.iter().map(Material::textured_kind).collect();
    let rows: Vec<_> = kinds.iter().map(MaterialKind::row).collect();
    let mut modifiers = vec![RowModifiers::default(); rows.len()];
    let mut bindings = Vec::new();
    for (row, material) in scene.materials.iter().enumerate() {
        let own = &mut modifiers[row];
        let Modifiers { opacity, back, normal_scale, bump_scale, normal_map: _, bump_map: _ } =
            material.modifiers;
        let [opacity, normal_scale, bump_scale] = narrow([opacity, normal_scale, bump_scale]);
        let back = back.map(|back| back as u32);
        *own = RowModifiers { opacity, back, normal_scale, bump_scale, ..*own };
        for textured in &material.textures {
            let alone = match textured.parameter {
                "opacity" => Some(&mut own.opacity_texture),
                "normal_map" => Some(&mut own.normal_map),
                "bump_map" => Some(&mut own.bump_map),
                "amount" => Some(&mut own.amount_texture),
                _ => None,
            };
            if let Some(texture) = alone {
                *texture = compiler.root(textured.texture);
                match textured.parameter {
                    "normal_map" => own.second_uv[0] = uses_second_uv[textured.texture],
                    "bump_map" => {
                        own.second_uv[1] = uses_second_uv[textured.texture];
                        own.bump_steps = bump_steps(compiler.slope_step(textured.texture));
                    }
                    _ => {}
                }
            } else if let Some(slot) = ParameterSlot::of(&kinds[row], textured.parameter) {
                // Parameters that cannot be textures are rejected when a scene is checked.
                bindings.push(Binding { row, slot, texture: compiler.root(textured.texture) });
            }
        }
    }
    Textures {
        materials: MaterialTable::modified(rows, &bindings, &modifiers, Arc::new(compiler.finish())),
        emitted,
        environment_map,
    }
}
