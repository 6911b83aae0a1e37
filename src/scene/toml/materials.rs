//! Materials, and what is made of them: names become indices, each comes after the materials that it names, and none
//! contains itself.

use std::collections::HashMap;

use super::declared::Values;
use super::one_of::{Members, OneOf};
use super::report::{Placed, Read, Reported, Reports, list, nearest, quote, shorten};
use super::table::Named;
use crate::parameter::Family;
use crate::scene::description::{Material, MaterialKind};

/// Checkerboards inside checkerboards inside …: the GPU follows them with a bounded loop.
const MAX_NESTING: usize = 16;

pub(super) const MATERIAL: OneOf<Values> = OneOf {
    what: "material",
    members: Some(Members { declarations: MaterialKind::DECLARATIONS, build: |values, _| Ok(values) }),
    variants: &[],
};

/// The file's materials, in its order.
pub(super) type RawMaterials = [Named<Read<Values>>];

/// Finds materials by name.
pub(super) struct Names<'m> {
    materials: &'m RawMaterials,
    by_name: HashMap<&'m str, usize>,
}

impl<'m> Names<'m> {
    pub(super) fn new(materials: &'m RawMaterials) -> Self {
        let by_name = materials.iter().enumerate().map(|(i, material)| (material.name.as_str(), i)).collect();
        Self { materials, by_name }
    }

    /// The index, in the order of the file, of the material that the file names.
    pub(super) fn find(&self, name: &Placed<String>, reports: &mut Reports<'_>) -> Result<usize, Reported> {
        if let Some(&index) = self.by_name.get(name.value.as_str()) {
            return Ok(index);
        }
        Err(reports.error_with(name.at, format!("no material {}", quote(&name.value)), |_| {
            let names = self.materials.iter().map(|material| material.name.as_str());
            Some(match (nearest(&name.value, names.clone()), list(names)) {
                (Some(nearest), _) => format!("did you mean {}?", quote(nearest)),
                (None, Some(all)) => format!("the materials are {all}"),
                (None, None) => "this file has no [materials.NAME]".into(),
            })
        }))
    }
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
    let order = order(raw, &edges, reports)?;

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
        let index = names.find(name, reports)?;
        edges.push(Placed { at: name.at, value: index });
        Ok(index)
    };
    material.value.as_ref().map_err(|reported| *reported)?.build(find, reports)
}

/// How far a material has come in [`order`].
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    New,
    Open,
    Done,
}

/// The materials in an order in which everything comes after what it names: depth first, with a stack of our
/// own, as a file may chain as many checkerboards as it has room for.
fn order(
    raw: &RawMaterials,
    edges: &[Vec<Placed<usize>>],
    reports: &mut Reports<'_>,
) -> Result<Vec<usize>, Reported> {
    let mut marks = vec![Mark::New; raw.len()];
    let mut nesting = vec![0; raw.len()];
    let mut order = Vec::with_capacity(raw.len());
    let mut outcome = Ok(());
    for root in 0..raw.len() {
        if marks[root] != Mark::New {
            continue;
        }
        marks[root] = Mark::Open;
        let mut stack = vec![(root, edges[root].iter())];
        while let Some((node, rest)) = stack.last_mut() {
            let node = *node;
            let Some(edge) = rest.next() else {
                stack.pop();
                marks[node] = Mark::Done;
                order.push(node);
                nesting[node] = edges[node].iter().map(|edge| nesting[edge.value] + 1).max().unwrap_or(0);
                // Those that contain it are as wrong, but one message is enough.
                if nesting[node] == MAX_NESTING + 1 {
                    let (kind, name) = (kind(&raw[node]), quote(&raw[node].name));
                    let message = format!("{kind} {name} is nested more than {MAX_NESTING} deep");
                    outcome = Err(reports.error(raw[node].at, message));
                }
                continue;
            };
            match marks[edge.value] {
                Mark::New => {
                    marks[edge.value] = Mark::Open;
                    stack.push((edge.value, edges[edge.value].iter()));
                }
                Mark::Open => {
                    let cycle = stack.iter().map(|(i, _)| *i).skip_while(|i| *i != edge.value);
                    let kind = kind(&raw[edge.value]);
                    let message = format!("{kind} contains itself: {}", chain(raw, cycle, edge.value));
                    outcome = Err(reports.error(edge.at, message));
                }
                Mark::Done => {}
            }
        }
    }
    outcome.map(|()| order)
}

/// The name of a material's kind.
fn kind(material: &Named<Read<Values>>) -> &'static str {
    material.value.as_ref().map_or("material", |values| values.declaration.name)
}

/// `a → b → a`; the middle of a long chain is left out.
fn chain(raw: &RawMaterials, nodes: impl Iterator<Item = usize>, last: usize) -> String {
    const MOST: usize = 8;
    let mut text = String::new();
    for (i, node) in nodes.enumerate() {
        if i == MOST {
            text.push_str("… → ");
            break;
        }
        text.push_str(&shorten(&raw[node].name));
        text.push_str(" → ");
    }
    text + &shorten(&raw[last].name)
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
