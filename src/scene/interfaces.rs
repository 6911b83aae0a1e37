//! The invariant of a scene about overlapping dielectrics.

use super::description::Material;
use crate::parameter::Family;

/// Materials of media whose index of refraction is a texture, in scenes where a dielectric has a priority. There, the
/// index on the far side of a surface must be known at the hit.
pub(super) fn of_unknown_index(materials: &[Material]) -> Vec<usize> {
    let medium = |material: &Material| material.kind.row().medium;
    if !materials.iter().filter_map(medium).any(|medium| medium.priority > 0) {
        return Vec::new();
    }
    let is_unknown = |material: &Material| {
        medium(material).is_some() && material.textures.iter().any(|textured| textured.parameter == "ior")
    };
    (0..materials.len()).filter(|&i| is_unknown(&materials[i])).collect()
}

/// The message about such a material.
pub(super) fn unknown_index(material: &Material) -> String {
    let what = material.kind.declaration().map_or("a dielectric", |declaration| declaration.what);
    format!("ior of {what} cannot be a texture if any dielectric has a priority")
}
