//! Materials, and what is made of them: names become indices, each comes after the materials that it names, and none
//! contains itself.

use super::declared::Values;
use super::one_of::{Members, OneOf};
use super::report::{Placed, Read, Reported, Reports};
use super::table::Named;
use crate::parameter::Family;
use crate::scene::description::{Material, MaterialKind};
use crate::scene::names::{self, Disorder, MAX_NESTING, Names};
use crate::scene::spelling::quote;

pub(super) const MATERIAL: OneOf<Values> = OneOf {
    what: "material",
    members: Some(Members { declarations: MaterialKind::DECLARATIONS, build: |values, _| Ok(values) }),
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
    reports: &mut Reports<'_>,
) -> Result<Resolved, Reported> {
    let mut edges = vec![Vec::new(); raw.len()];
    let kinds: Vec<_> =
        raw.iter().zip(&mut edges).map(|(material, edges)| link(material, edges, names, reports)).collect();
    let order = order(raw, &edges, names, reports)?;

    let mut index_of = vec![0; raw.len()];
    for (index, &i) in order.iter().enumerate() {
        index_of[i] = index;
    }
    let materials: Result<_, _> = order
        .into_iter()
        .map(|i| {
            let mut kind = kinds[i].clone()?;
            kind.renumber(&|index| index_of[index]);
            Ok(Material { name: raw[i].name.clone(), kind })
        })
        .collect();
    Ok(Resolved { materials: materials?, index_of })
}

/// Resolves a material's names to indices in the order of the file, and lists them as `edges`.
fn link(
    material: &Named<Read<Values>>,
    edges: &mut Vec<Placed<usize>>,
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<MaterialKind, Reported> {
    let find = |name: &Placed<String>, reports: &mut Reports<'_>| {
        let index = find(name, names, reports)?;
        edges.push(Placed { at: name.at, value: index });
        Ok(index)
    };
    material.value.as_ref().map_err(|reported| *reported)?.build(find, reports)
}

/// The materials in an order in which everything comes after what it names.
fn order(
    raw: &RawMaterials,
    edges: &[Vec<Placed<usize>>],
    names: &Names<'_>,
    reports: &mut Reports<'_>,
) -> Result<Vec<usize>, Reported> {
    let named: Vec<Vec<usize>> =
        edges.iter().map(|edges| edges.iter().map(|edge| edge.value).collect()).collect();
    names::order(&named, |disorder| match disorder {
        Disorder::Circle { nodes, last, edge } => {
            let kind = kind(&raw[nodes[0]]);
            let message = format!("{kind} contains itself: {}", names.circle(&nodes));
            reports.error(edges[last][edge].at, message)
        }
        Disorder::TooDeep(node) => {
            let (kind, name) = (kind(&raw[node]), quote(&raw[node].name));
            let message = format!("{kind} {name} is nested more than {MAX_NESTING} deep");
            reports.error(raw[node].at, message)
        }
    })
}

/// The name of a material's kind.
fn kind(material: &Named<Read<Values>>) -> &'static str {
    material.value.as_ref().map_or("material", |values| values.declaration.name)
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
