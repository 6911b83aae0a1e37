//! The keys of textures, and their conversion: names become indices, each texture follows those that it refers to, and
//! none contains itself.

use super::declared::{Values, Wanted};
use super::one_of::{Members, OneOf};
use super::order::order;
use super::report::{Diagnostics, Placed, Read, Reported};
use super::table::Named;
use crate::math::colour::srgb_to_linear;
use crate::parameter::Family;
use crate::scene::description::{Entity, Material, Texture, TextureKind};
use crate::scene::names::Names;
use crate::scene::spelling::{quote, shorten};
use crate::texture::{EXTENSIONS, costs};
use std::path::Path;

pub(super) const TEXTURE: OneOf<Values> = OneOf {
    what: "texture",
    members: Some(Members {
        declarations: TextureKind::DECLARATIONS,
        textured: false,
        common: None,
        more: |_| &[],
        build: |values, _, _| Ok(values),
    }),
    variants: &[],
};

/// The file's textures, in its order.
pub(super) type RawTextures = [Named<Read<Values>>];

/// The names of the file's textures, in its order; an error if they could not be read.
pub(super) struct TextureNames<'n>(Read<Names<'n>>);

impl<'n> TextureNames<'n> {
    pub(super) fn new(textures: Read<&'n RawTextures>) -> Self {
        let names = |textures: &'n RawTextures| {
            Names::of("textures", textures.iter().map(|texture| texture.name.as_str()))
        };
        TextureNames(textures.map(names))
    }

    /// The index, in the order of the file, of a texture by its name.
    pub(super) fn find(&self, name: &Placed<String>, diagnostics: &mut Diagnostics<'_>) -> Read<usize> {
        let names = self.0.as_ref().map_err(|reported| *reported)?;
        names.find(&name.value).ok_or_else(|| {
            diagnostics.error_with(name.at, format!("no texture {}", quote(&name.value)), |_| {
                let none = || "this file has no [textures.NAME]".into();
                let of_value = of_a_colour(&name.value).or_else(|| of_a_file(&name.value, names));
                Some(of_value.or_else(|| names.instead(&name.value)).unwrap_or_else(none))
            })
        })
    }
}

/// Advice about a colour of six hexadecimal digits that is given for the name of a texture.
fn of_a_colour(name: &str) -> Option<String> {
    let digits = name.strip_prefix('#').filter(|digits| digits.len() == 6)?;
    let code = u32::from_str_radix(digits, 16).ok()?;
    let linear = [16, 8, 0].map(|shift| srgb_to_linear(f64::from(code >> shift & 0xff) / 255.0));
    let linear = linear.map(|channel| (channel * 1e3).round() / 1e3);
    Some(format!("colours are linear [red, green, blue]: this one is {linear:?}"))
}

/// Advice about a picture that is given for the name of a texture.
fn of_a_file(file: &str, names: &Names<'_>) -> Option<String> {
    let path = Path::new(file);
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    let stem = path.file_stem()?.to_str()?;
    if !EXTENSIONS.contains(&&*extension) {
        return None;
    }
    if names.find(stem).is_some() {
        return Some(format!("did you mean {}?", quote(stem)));
    }
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let header = if stem.chars().all(is_bare) { shorten(stem) } else { quote(stem) };
    Some(format!(
        "add [textures.{header}] with type = \"image\" and file = {}, and name it: {}",
        quote(file),
        quote(stem)
    ))
}

/// Textures in their final order.
pub(super) struct ResolvedTextures {
    pub(super) textures: Vec<Texture>,
    /// The final index of each texture in the order of the file.
    pub(super) index_of: Vec<usize>,
}

/// Sorts textures and resolves their names.
pub(super) fn resolve(
    raw: &RawTextures,
    names: &TextureNames<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<ResolvedTextures, Reported> {
    let mut edges = vec![Vec::new(); raw.len()];
    let kinds: Vec<_> =
        raw.iter().zip(&mut edges).map(|(texture, edges)| link(texture, edges, names, diagnostics)).collect();
    let of_names = names.0.as_ref().map_err(|reported| *reported)?;
    let order = order(raw, &edges, of_names, diagnostics)?;

    let mut index_of = vec![0; raw.len()];
    for (index, &i) in order.iter().enumerate() {
        index_of[i] = index;
    }
    let textures: Result<Vec<_>, _> = order
        .iter()
        .map(|&i| {
            let mut kind = kinds[i].clone()?;
            kind.renumber(&|index| index_of[index]);
            Ok(Texture { name: raw[i].name.clone(), kind })
        })
        .collect();
    let textures = textures?;
    let kinds: Vec<_> = textures.iter().map(|texture| texture.kind.clone()).collect();
    let mut outcome = Ok(());
    for (&i, cost) in order.iter().zip(costs(&kinds)) {
        if let Err(error) = cost {
            let message = format!("texture {}: {error}", quote(&raw[i].name));
            outcome = Err(diagnostics.error(raw[i].at, message));
        }
    }
    outcome.map(|()| ResolvedTextures { textures, index_of })
}

/// Resolves a texture's names to indices in the order of the file, and returns them as `edges`.
fn link(
    texture: &Named<Read<Values>>,
    edges: &mut Vec<Placed<usize>>,
    names: &TextureNames<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<TextureKind, Reported> {
    let find = |wanted, name: &Placed<String>, diagnostics: &mut Diagnostics<'_>| {
        if wanted == Wanted::Material {
            return Err(diagnostics.error(name.at, "textures name no materials"));
        }
        let index = names.find(name, diagnostics)?;
        edges.push(Placed { at: name.at, value: index });
        Ok(index)
    };
    let values = texture.value.as_ref().map_err(|reported| *reported)?;
    values.build(find, diagnostics).map(|(kind, _)| kind)
}

/// Warns of unused textures.
pub(super) fn warn_of_unused(
    raw: &RawTextures,
    resolved: &ResolvedTextures,
    materials: &[Material],
    entities: &[Entity],
    diagnostics: &mut Diagnostics<'_>,
) {
    let mut used = vec![false; resolved.textures.len()];
    let named = materials.iter().flat_map(|material| &material.textures);
    let named = named.map(|textured| textured.texture);
    let emitted = entities.iter().filter_map(|entity| entity.emission_texture);
    named.chain(emitted).for_each(|texture| used[texture] = true);
    // A texture follows those that it refers to, so in reverse order every user comes first.
    for (i, texture) in resolved.textures.iter().enumerate().rev() {
        if used[i] {
            texture.kind.textures().for_each(|named| used[named] = true);
        }
    }
    for (texture, &index) in raw.iter().zip(&resolved.index_of) {
        if !used[index] {
            let message = format!("texture {} is not used", quote(&texture.name));
            diagnostics.warn(Some(texture.at), message, "no material or emission uses it");
        }
    }
}
