//! The invariant of a scene about the second set of uv, which only some meshes have.

use super::description::{Scene, Shape};
use super::spelling::quote;
use crate::texture::{TextureKind, uses_of_second_uv};
use std::collections::BTreeMap;

/// Entities that use a texture of the second set of uv, but lack that set.
pub(super) struct Lacking {
    /// The first of them.
    pub(super) first: usize,
    pub(super) message: String,
}

/// The remedy.
pub(super) const HELP: &str =
    "use a mesh with a second set, such as TEXCOORD_1 of glTF or u1 and v1 of PLY, or remove uv_set";

/// The entities that lack a second set of uv, for each texture that they use.
pub(super) fn lacking(scene: &Scene) -> Vec<Lacking> {
    let kinds: Vec<TextureKind> = scene.textures.iter().map(|texture| texture.kind.clone()).collect();
    let uses = uses_of_second_uv(&kinds);
    if !uses.contains(&true) {
        return Vec::new();
    }
    // The first such texture of each material. Materials follow those that they refer to.
    let mut of_material: Vec<Option<usize>> = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let own = material.textures.iter().map(|textured| textured.texture).find(|&texture| uses[texture]);
        of_material.push(own.or_else(|| material.named().find_map(|named| of_material[named])));
    }
    let mut by_texture: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
    for (i, entity) in scene.entities.iter().enumerate() {
        let has_set = matches!(&entity.shape, Shape::Mesh { mesh, .. } if !mesh.second_uv.is_empty());
        let emitted = entity.emission_texture.filter(|&texture| uses[texture]);
        let Some(texture) = of_material[entity.material].or(emitted).filter(|_| !has_set) else { continue };
        by_texture.entry(texture).or_insert((i, 0)).1 += 1;
    }
    let lacking = |(texture, (first, count)): (usize, (usize, usize))| {
        let (name, texture) = (quote(&scene.entities[first].name), quote(&scene.textures[texture].name));
        let message = match count {
            1 => format!("{name} has no second set of uv, which its texture {texture} needs (uv_set = 1)"),
            count => format!(
                "{count} entities, {name} the first, have no second set of uv, which their texture {texture} needs (uv_set = 1)"
            ),
        };
        Lacking { first, message }
    };
    by_texture.into_iter().map(lacking).collect()
}
