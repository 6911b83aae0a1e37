//! Materials, and what is made of them: names become indices, each comes after the materials that it names, and none
//! contains itself.

use super::declared::{Values, Wanted};
use super::one_of::{Members, OneOf};
use super::order::order;
use super::report::{Placed, Read, Reported, Reports};
use super::table::Named;
use super::textures::TextureNames;
use crate::material::Place;
use crate::parameter::Family;
use crate::scene::description::{Material, MaterialKind, Textured};
use crate::scene::interfaces::{of_unknown_index, unknown_index};
use crate::scene::names::Names;
use crate::scene::spelling::quote;

pub(super) const MATERIAL: OneOf<Values> = OneOf {
    what: "material",
    members: Some(Members {
        declarations: MaterialKind::DECLARATIONS,
        textured: true,
        more: |_| &[],
        build: |values, _, _| Ok(values),
    }),
    variants: &[],
};

/// The file's materials, in its order.
pub(super) type RawMaterials = [Named<Read<Values>>];

/// The names of the file's materials, in its order.
pub(super) fn names(materials: &RawMaterials) -> Names<'_> {
    Names::new(materials.iter().map(|material| material.name.as_str()))
}

/// The index, in the order of the file, of the material that the file names.
pub(super) fn find(
    name: &Placed<String>,
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<usize, Reported> {
    names.find(&name.value).ok_or_else(|| {
        reports.error_with(name.at, format!("no material {}", quote(&name.value)), |_| {
            let none = || "this file has no [materials.NAME]".into();
            Some(names.instead(&name.value).unwrap_or_else(none))
        })
    })
}

/// Materials in their final order.
pub(super) struct Resolved {
    pub(super) materials: Vec<Material>,
    /// The final index of each material in the order of the file.
    pub(super) index_of: Vec<usize>,
}

/// Puts materials in order and resolves their names.
pub(super) fn resolve(
    raw: &RawMaterials,
    names: &Names<'_>,
    textures: &TextureNames<'_>,
    reports: &mut Reports<'_>,
) -> Result<Resolved, Reported> {
    let mut edges = vec![Vec::new(); raw.len()];
    let kinds: Vec<_> = raw
        .iter()
        .zip(&mut edges)
        .map(|(material, edges)| link(material, edges, names, textures, reports))
        .collect();
    let order = order(raw, &edges, names, reports)?;

    let mut index_of = vec![0; raw.len()];
    for (index, &i) in order.iter().enumerate() {
        index_of[i] = index;
    }
    let materials: Result<Vec<Material>, _> = order
        .into_iter()
        .map(|i| {
            let (mut kind, textures) = kinds[i].clone()?;
            kind.renumber(&|index| index_of[index]);
            Ok(Material { name: raw[i].name.clone(), kind, textures })
        })
        .collect();
    let materials = materials?;
    let mut outcome = Ok(());
    for unknown in of_unknown_index(&materials) {
        let places = raw.iter().zip(&index_of).filter(|(_, index)| **index == unknown);
        for values in places.filter_map(|(material, _)| material.value.as_ref().ok()) {
            outcome = Err(reports.error(values.place_of("ior"), unknown_index(&materials[unknown])));
        }
    }
    outcome.map(|()| Resolved { materials, index_of })
}

/// Resolves a material's names to indices in the order of the file, and lists them as `edges`.
fn link(
    material: &Named<Read<Values>>,
    edges: &mut Vec<Placed<usize>>,
    names: &Names<'_>,
    textures: &TextureNames<'_>,
    reports: &mut Reports<'_>,
) -> Result<(MaterialKind, Vec<Textured>), Reported> {
    let find = |wanted, name: &Placed<String>, reports: &mut Reports<'_>| {
        if wanted == Wanted::Texture {
            return textures.find(name, reports);
        }
        let index = find(name, names, reports)?;
        edges.push(Placed { at: name.at, value: index });
        Ok(index)
    };
    let values = material.value.as_ref().map_err(|reported| *reported)?;
    let (kind, textured): (MaterialKind, _) = values.build(find, reports)?;
    let mut outcome = Ok(());
    for Textured { parameter, .. } in &textured {
        if Place::of(&kind, parameter).is_none() {
            let message = format!("{parameter} of {} can be no texture", values.declaration.what);
            outcome = Err(reports.error(values.place_of(parameter), message));
        }
    }
    outcome.map(|()| (kind, textured))
}

/// Warns of materials that no entity shows.
pub(super) fn warn_of_unused(
    raw: &RawMaterials,
    resolved: &Resolved,
    mut used: Vec<bool>,
    reports: &mut Reports<'_>,
) {
    // What a material names comes before it, so going backwards meets every user first.
    for (i, material) in resolved.materials.iter().enumerate().rev() {
        if used[i] {
            material.kind.materials().for_each(|named| used[named] = true);
        }
    }
    for (material, &index) in raw.iter().zip(&resolved.index_of) {
        if !used[index] {
            let message = format!("material {} is not used", quote(&material.name));
            reports.warn(Some(material.at), message, "no entity shows it");
        }
    }
}
