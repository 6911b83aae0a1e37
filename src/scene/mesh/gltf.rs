//! glTF 2.0: triangles where their nodes, morph weights and skins put them at rest, and base materials. Both `.glb`,
//! and `.gltf` with its buffers in other files or in `data:` URIs.
//!
//! Cameras, lights, textures and animations are left out, with a note. Coordinates stay as they are: +y is up in
//! glTF, `rotate = [90, 0, 0]` makes that +z.

mod accessors;
mod buffers;
mod document;
mod extensions;
mod fault;
mod json;
mod material;
mod morph;
mod place;
mod primitive;
mod room;
mod skin;

use self::buffers::Buffers;
use self::document::Document;
use self::fault::{Fault, item, only};
use self::json::Unfit;
use self::material::Material;
use self::primitive::{Counts, Pose};
use self::room::Room;
use self::skin::Skins;
use super::FileMaterial;
use super::MeshFileError;
use super::parts::Parts;
use super::source::{BYTE_ORDER_MARK, FilePosition, Read_, Source};
use std::io::BufRead;

const MAGIC: u32 = u32::from_le_bytes(*b"glTF");
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

/// The cost of a primitive, in bytes, besides its vertices, triangles and names: even an empty one takes time.
const PRIMITIVE: u64 = 256;

/// Reads a `.glb`, and gives its materials.
pub(super) fn read_binary<R: BufRead>(
    source: &mut Source<'_, R>,
    parts: &mut Parts<'_>,
) -> Read_<Vec<FileMaterial>> {
    let word = |source: &mut Source<'_, R>| {
        let mut bytes = [0; 4];
        source.exact(&mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    };
    let [magic, version, length] = [word(source)?, word(source)?, word(source)?];
    if magic != MAGIC {
        return Err(source.whole("this is not a binary glTF file: it does not begin with \"glTF\""));
    }
    if version != 2 {
        return Err(source.whole(format!("this is glTF version {version}; version 2 is read")));
    }
    if u64::from(length) != source.len() {
        let message = "the length in the header differs from that of the file, which is read to its end";
        parts.note(message, Some(FilePosition::Byte(8)));
    }
    let (mut text, mut binary) = (None, None);
    while source.left() >= 8 && (text.is_none() || binary.is_none()) {
        let (len, kind) = (u64::from(word(source)?), word(source)?);
        if len > source.left() {
            let left = source.left();
            return Err(
                source.at_byte(format!("a chunk of {len} bytes, but only {left} are left: it is truncated"))
            );
        }
        let bytes = source.bytes(len)?;
        match kind {
            JSON if text.is_none() => text = Some(bytes),
            BINARY if binary.is_none() => binary = Some(bytes),
            // Further chunks may follow, and are skipped.
            _ => {}
        }
    }
    let Some(text) = text else { return Err(source.whole("it has no JSON chunk")) };
    read(source, parts, &text, binary)
}

/// Reads a `.gltf`, and gives its materials.
pub(super) fn read_text<R: BufRead>(
    source: &mut Source<'_, R>,
    parts: &mut Parts<'_>,
) -> Read_<Vec<FileMaterial>> {
    let text = source.bytes(source.left())?;
    read(source, parts, &text, None)
}

fn read<R: BufRead>(
    source: &Source<'_, R>,
    parts: &mut Parts<'_>,
    text: &[u8],
    binary: Option<Vec<u8>>,
) -> Read_<Vec<FileMaterial>> {
    // Readers may pass over a byte-order mark, though writers may not add one.
    let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
    let document = json::decode(text)
        .map_err(|Unfit { place, message }| MeshFileError { place, ..source.whole(message) })?;
    let mut buffers = Buffers::new(source.name(), binary, Room::new(source));
    read_document(&document, &mut buffers, parts).map_err(|fault| MeshFileError {
        place: Some(FilePosition::Item(fault.place)),
        ..source.whole(fault.message)
    })
}

fn read_document(
    document: &Document,
    buffers: &mut Buffers<'_>,
    parts: &mut Parts<'_>,
) -> Result<Vec<FileMaterial>, Fault> {
    let noted = document.materials.iter().flat_map(Material::missing_extensions).collect();
    extensions::check(&document.extensions_used, &document.extensions_required, &noted, parts)?;
    let names = document.material_names();
    let mut skins = Skins::new(document);
    let mut is_used = vec![false; names.len()];
    // The notes about a mesh are added once, for any number of instances.
    let mut is_noted = vec![false; document.meshes.len()];
    for placed in place::meshes(document, parts)? {
        let (mesh, node) = (placed.mesh, &document.nodes[placed.node]);
        let at_node = |message: String| Fault::at(format_args!("nodes[{}]", placed.node), message);
        let Some(of_mesh) = document.meshes.get(mesh) else {
            let meshes = only(document.meshes.len());
            return Err(at_node(format!("it has mesh {mesh}, but {meshes}")));
        };
        let group = [&node.name, &of_mesh.name].into_iter().flatten();
        let group = group.map(String::as_str).find(|name| !name.is_empty()).unwrap_or_default();
        let joints = node.skin.map(|skin| skins.joints(buffers, skin)).transpose()?;
        let copies = if joints.is_some() {
            if node.extensions.copies.is_some() {
                let message = "only one copy of each skinned mesh is read";
                parts.note(message, item(format_args!("nodes[{}]", placed.node)));
            }
            vec![placed.to_world]
        } else {
            place::copies(document, buffers, &placed).map_err(at_node)?
        };
        let mut pose = Pose {
            weights: node.weights.as_ref().unwrap_or(&of_mesh.weights),
            to_world: placed.to_world,
            joints,
        };
        for to_world in copies {
            pose.to_world = to_world;
            for (i, primitive) in of_mesh.primitives.iter().enumerate() {
                let wrong =
                    |message: String| Fault::at(format_args!("meshes[{mesh}].primitives[{i}]"), message);
                let material = match primitive.material {
                    None => "",
                    Some(material) if material < names.len() => {
                        is_used[material] = true;
                        &names[material]
                    }
                    Some(material) => {
                        let materials = only(names.len());
                        return Err(wrong(format!("it has material {material}, but {materials}")));
                    }
                };
                let length = group.len() + material.len();
                buffers.room.take(0, 0, PRIMITIVE + length as u64).map_err(wrong)?;
                let part = parts.of(group, material);
                let mut counts = Counts::new();
                primitive::add(document, buffers, primitive, &pose, (&mut *parts, part), &mut counts)
                    .map_err(wrong)?;
                for (message, &count) in counts.iter().filter(|_| !is_noted[mesh]) {
                    let place = item(format_args!("meshes[{mesh}].primitives[{i}]"));
                    parts.note_several(message, count, place);
                }
            }
            is_noted[mesh] = true;
        }
    }
    for (i, animation) in document.animations.iter().enumerate() {
        if !animation.channels.is_empty() {
            let message = "animations are left out; the rest pose is rendered";
            parts.note(message, item(format_args!("animations[{i}]")));
        }
    }
    let used = document.materials.iter().enumerate().filter(|&(i, _)| is_used[i]);
    used.for_each(|(i, material)| material.note(i, parts));
    Ok(names.into_iter().zip(&document.materials).map(|(name, of)| of.read(name)).collect())
}
