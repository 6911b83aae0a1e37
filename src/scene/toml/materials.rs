//! The keys of materials, and their conversion: names become indices, each material follows those that it refers to,
//! and none contains itself.

use super::declared::{Values, Wanted};
use super::one_of::{Members, OneOf};
use super::order::order;
use super::report::{Diagnostics, Placed, Read, Reported};
use super::table::Named;
use super::textures::TextureNames;
use crate::material::{ParameterSlot, is_evaluated_directly};
use crate::parameter::{Declared, Family};
use crate::scene::description::{
    ImageFile, Material, MaterialKind, Modifiers, Texture, TextureKind, Textured,
};
use crate::scene::interfaces::{of_unknown_index, unknown_index};
use crate::scene::names::Names;
use crate::scene::spelling::quote;
use crate::texture::{ColorSpace, Depth, Tile};

pub(super) const MATERIAL: OneOf<Values> = OneOf {
    what: "material",
    members: Some(Members {
        declarations: MaterialKind::DECLARATIONS,
        textured: true,
        common: Some(&<Modifiers as Declared>::DECLARATION),
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

/// The index, in the order of the file, of a material by its name.
pub(super) fn find(
    name: &Placed<String>,
    names: &Names<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<usize, Reported> {
    names.find(&name.value).ok_or_else(|| {
        diagnostics.error_with(name.at, format!("no material {}", quote(&name.value)), |_| {
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

/// Sorts materials and resolves their names.
pub(super) fn resolve(
    raw: &RawMaterials,
    names: &Names<'_>,
    textures: &TextureNames<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<Resolved, Reported> {
    let mut edges = vec![Vec::new(); raw.len()];
    let kinds: Vec<_> = raw
        .iter()
        .zip(&mut edges)
        .map(|(material, edges)| link(material, edges, names, textures, diagnostics))
        .collect();
    let order = order(raw, &edges, names, diagnostics)?;

    let mut index_of = vec![0; raw.len()];
    for (index, &i) in order.iter().enumerate() {
        index_of[i] = index;
    }
    let materials: Result<Vec<Material>, _> = order
        .into_iter()
        .map(|i| {
            let Linked { mut kind, textures, mut modifiers } = kinds[i].clone()?;
            kind.renumber(&|index| index_of[index]);
            Family::renumber(&mut modifiers, &|index| index_of[index]);
            Ok(Material { name: raw[i].name.clone(), kind, textures, modifiers })
        })
        .collect();
    let materials = materials?;
    let mut outcome = Ok(());
    for unknown in of_unknown_index(&materials) {
        let places = raw.iter().zip(&index_of).filter(|(_, index)| **index == unknown);
        for values in places.filter_map(|(material, _)| material.value.as_ref().ok()) {
            outcome = Err(diagnostics.error(values.place_of("ior"), unknown_index(&materials[unknown])));
        }
    }
    outcome.map(|()| Resolved { materials, index_of })
}

/// A material with the indices of its references.
#[derive(Clone)]
struct Linked {
    kind: MaterialKind,
    textures: Vec<Textured>,
    modifiers: Modifiers,
}

/// Resolves a material's names to indices in the order of the file, and returns them as `edges`.
fn link(
    material: &Named<Read<Values>>,
    edges: &mut Vec<Placed<usize>>,
    names: &Names<'_>,
    textures: &TextureNames<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<Linked, Reported> {
    let mut find = |wanted, name: &Placed<String>, diagnostics: &mut Diagnostics<'_>| {
        if wanted == Wanted::Texture {
            return textures.find(name, diagnostics);
        }
        let index = find(name, names, diagnostics)?;
        edges.push(Placed { at: name.at, value: index });
        Ok(index)
    };
    let values = material.value.as_ref().map_err(|reported| *reported)?;
    let built = values.build(&mut find, diagnostics);
    let common = values.common.as_ref().map(|common| common.build::<Modifiers>(&mut find, diagnostics));
    let (kind, mut textures): (MaterialKind, _) = built?;
    let mut outcome = Ok(());
    for Textured { parameter, .. } in &textures {
        if !is_evaluated_directly(&kind, parameter) && ParameterSlot::of(&kind, parameter).is_none() {
            let message = format!("{parameter} of {} cannot be a texture", values.declaration.what);
            outcome = Err(diagnostics.error(values.place_of(parameter), message));
        }
    }
    let (modifiers, of_all) = common.transpose()?.unwrap_or_default();
    textures.extend(of_all);
    outcome.map(|()| Linked { kind, textures, modifiers })
}

/// Warns of pictures that are decoded from sRGB for parameters that are not colours.
pub(super) fn warn_of_encoded(
    raw: &RawMaterials,
    resolved: &Resolved,
    textures: &[Texture],
    images: &[ImageFile],
    diagnostics: &mut Diagnostics<'_>,
) {
    for (material, &index) in raw.iter().zip(&resolved.index_of) {
        let Ok(values) = &material.value else { continue };
        let kind = &resolved.materials[index].kind;
        for Textured { parameter, texture } in &resolved.materials[index].textures {
            if is_evaluated_directly(kind, parameter) && is_encoded(*texture, textures, images) {
                let message = format!(
                    "{parameter} is not a colour, but the picture of texture {} is decoded from sRGB",
                    quote(&textures[*texture].name)
                );
                let help = "give the image color_space = \"data\"";
                diagnostics.warn(Some(values.place_of(parameter)), message, help);
            }
        }
    }
}

/// Whether a texture contains a picture that is decoded from sRGB, directly or indirectly.
fn is_encoded(index: usize, textures: &[Texture], images: &[ImageFile]) -> bool {
    match &textures[index].kind {
        TextureKind::Image(image) => match image.color_space {
            ColorSpace::Srgb => true,
            ColorSpace::Auto => images.get(image.file.0).is_some_and(|file| {
                let depth = |tile: &Tile| matches!(tile.picture.depth(), Depth::Bits8 | Depth::Bits16);
                file.tiles.iter().any(depth)
            }),
            ColorSpace::Linear | ColorSpace::Data => false,
        },
        // A texture follows those that it refers to, so the recursion ends.
        other => other.textures().any(|named| is_encoded(named, textures, images)),
    }
}

/// Warns of unused materials.
pub(super) fn warn_of_unused(
    raw: &RawMaterials,
    resolved: &Resolved,
    mut used: Vec<bool>,
    diagnostics: &mut Diagnostics<'_>,
) {
    // A material follows those that it refers to, so in reverse order every user comes first.
    for (i, material) in resolved.materials.iter().enumerate().rev() {
        if used[i] {
            material.named().for_each(|named| used[named] = true);
        }
    }
    for (material, &index) in raw.iter().zip(&resolved.index_of) {
        if !used[index] {
            let message = format!("material {} is not used", quote(&material.name));
            diagnostics.warn(Some(material.at), message, "no entity uses it");
        }
    }
}
