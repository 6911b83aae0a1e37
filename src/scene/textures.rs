//! The invariants of a scene about textures and references to them.

use super::description::{Modifiers, Scene};
use super::interfaces::{of_unknown_index, unknown_index};
use super::names::MAX_NESTING;
use crate::material::{ParameterSlot, is_evaluated_directly};
use crate::parameter::{Family, Value};
use crate::texture::{ImageFile, costs};

/// The part that violates an invariant.
pub(super) enum Broken {
    /// The texture with this index.
    Texture(usize, String),
    /// The material with this index.
    Material(usize, String),
    /// The entity with this index.
    Entity(usize, String),
}

/// All violations, except values out of range.
pub(super) fn broken(scene: &Scene) -> Vec<Broken> {
    let mut all = Vec::new();
    let mut nesting = vec![0; scene.textures.len()];
    for (i, texture) in scene.textures.iter().enumerate() {
        for named in texture.kind.textures() {
            if named >= i {
                let message = format!("it names texture {}, which does not precede it", named + 1);
                all.push(Broken::Texture(i, message));
            } else {
                nesting[i] = nesting[i].max(nesting[named] + 1);
            }
        }
        for value in texture.kind.values() {
            let Value::Image(image) = value else { continue };
            let no_image = || format!("there is no image {}, only {}", image.0 + 1, scene.images.len());
            let objection = scene.images.get(image.0).map_or_else(|| Some(no_image()), ImageFile::objection);
            all.extend(objection.map(|message| Broken::Texture(i, message)));
        }
        if nesting[i] == MAX_NESTING + 1 {
            all.push(Broken::Texture(i, format!("it is nested more than {MAX_NESTING} levels deep")));
        }
    }
    for (i, material) in scene.materials.iter().enumerate() {
        let kind = material.textured_kind();
        let Modifiers { normal_map, bump_map, .. } = material.modifiers;
        for (name, map) in [("normal_map", normal_map), ("bump_map", bump_map)] {
            let has_texture = material.textures.iter().any(|textured| textured.parameter == name);
            if map.is_some() != has_texture {
                let message = format!("{name} must be present if and only if a texture is named for it");
                all.push(Broken::Material(i, message));
            }
        }
        for (place, textured) in material.textures.iter().enumerate() {
            let name = textured.parameter;
            if textured.texture >= scene.textures.len() {
                let (number, count) = (textured.texture + 1, scene.textures.len());
                all.push(Broken::Material(i, format!("there is no texture {number}, only {count}")));
            }
            if !is_evaluated_directly(&kind, name) && ParameterSlot::of(&kind, name).is_none() {
                all.push(Broken::Material(i, format!("{name} cannot be a texture")));
            }
            if material.textures[..place].iter().any(|other| other.parameter == name) {
                all.push(Broken::Material(i, format!("{name} is named as a texture twice")));
            }
        }
    }
    for i in of_unknown_index(&scene.materials) {
        all.push(Broken::Material(i, unknown_index(&scene.materials[i])));
    }
    for (i, entity) in scene.entities.iter().enumerate() {
        if let Some(texture) = entity.emission_texture.filter(|&texture| texture >= scene.textures.len()) {
            let (number, count) = (texture + 1, scene.textures.len());
            all.push(Broken::Entity(i, format!("there is no texture {number}, only {count}")));
        }
    }
    if all.is_empty() {
        let kinds: Vec<_> = scene.textures.iter().map(|texture| texture.kind.clone()).collect();
        for (i, cost) in costs(&kinds).into_iter().enumerate() {
            if let Err(error) = cost {
                all.push(Broken::Texture(i, error.to_string()));
            }
        }
    }
    all
}
