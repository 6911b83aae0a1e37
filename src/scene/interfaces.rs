//! The promise of a scene about dielectrics that overlap.

use super::description::Material;
use crate::parameter::Family;

/// The materials whose index of refraction is a texture though it is that of a medium, as a dielectric has a priority:
/// where a surface is met the index on its other side must be known.
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

/// What is said of such a material.
pub(super) fn unknown_index(material: &Material) -> String {
    let what = material.kind.declaration().map_or("a dielectric", |declaration| declaration.what);
    format!("ior of {what} can be no texture where a dielectric has a priority")
}
