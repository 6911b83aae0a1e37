//! glTF 2.0: triangles where their nodes put them, and base materials. Both `.glb`, and `.gltf` with its buffers in
//! other files or in `data:` URIs.
//!
//! Cameras, lights, textures, animations, skins and morphs are passed over. Coordinates stay as they are: +y is up
//! in glTF, `rotate = [90, 0, 0]` makes that +z.

mod accessors;
mod buffers;
mod document;
mod place;

use self::accessors::{Floats, Indices};
use self::buffers::Buffers;
use self::document::{Document, Material, Primitive};
use self::place::Placed;
use super::FileMaterial;
use super::mtl::{fraction, glass, radiance};
use super::parts::Parts;
use super::source::{Read_, Source};
use crate::scene::description::MaterialKind;
use crate::shape::MOST_TRIANGLES;
use glam::{DAffine3, DVec3};
use std::io::BufRead;

/// Extensions without which a file could not be understood, and that are.
const UNDERSTOOD: [&str; 4] = [
    "KHR_mesh_quantization",
    "KHR_materials_ior",
    "KHR_materials_transmission",
    "KHR_materials_emissive_strength",
];

const MAGIC: u32 = u32::from_le_bytes(*b"glTF");
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

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
    let [magic, version, _] = [word(source)?, word(source)?, word(source)?];
    if magic != MAGIC {
        return Err(source.whole("this is no binary glTF file: it does not begin with \"glTF\""));
    }
    if version != 2 {
        return Err(source.whole(format!("this is glTF version {version}; version 2 is read")));
    }
    let (mut text, mut binary) = (None, None);
    while source.left() >= 8 && (text.is_none() || binary.is_none()) {
        let (len, kind) = (u64::from(word(source)?), word(source)?);
        if len > source.left() {
            let left = source.left();
            return Err(
                source.at_byte(format!("a chunk of {len} bytes, but only {left} are left: it is cut off"))
            );
        }
        let bytes = source.bytes(len)?;
        match kind {
            JSON if text.is_none() => text = Some(bytes),
            BINARY if binary.is_none() => binary = Some(bytes),
            // Others may follow, which are to be passed over.
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
    let document: Document =
        serde_json::from_slice(text).map_err(|error| source.at_line(error.line(), format!("{error}")))?;
    if !document.asset.version.starts_with("2.") {
        let version = &document.asset.version;
        return Err(source.whole(format!("this is glTF version {version:?}; version 2 is read")));
    }
    if let Some(unknown) =
        document.extensions_required.iter().find(|name| !UNDERSTOOD.contains(&name.as_str()))
    {
        return Err(
            source.whole(format!("it cannot be understood without {unknown:?}, which stride does not know"))
        );
    }
    let whole = |message: String| source.whole(message);
    let placed = place::meshes(&document).map_err(whole)?;
    let names = document.material_names();
    let mut buffers = Buffers::new(source.name(), binary, Room::new(source));
    for Placed { mesh, node, to_world } in placed {
        let Some(of_mesh) = document.meshes.get(mesh) else {
            return Err(whole(format!(
                "node {node} has mesh {mesh}, but there are only {}",
                document.meshes.len()
            )));
        };
        let group = [&document.nodes[node].name, &of_mesh.name].into_iter().flatten();
        let group = group.map(String::as_str).find(|name| !name.is_empty()).unwrap_or_default();
        for (i, primitive) in of_mesh.primitives.iter().enumerate() {
            let material = match primitive.material {
                None => "",
                Some(material) if material < names.len() => &names[material],
                Some(material) => {
                    let message =
                        format!("material {material}, but there are only {}", document.materials.len());
                    return Err(whole(format!("mesh {mesh}, primitive {i} has {message}")));
                }
            };
            let wrong = |message: String| whole(format!("mesh {mesh}, primitive {i}: {message}"));
            let names = group.len() + material.len();
            buffers.room.take(0, 0, PRIMITIVE + names as u64).map_err(wrong)?;
            let part = parts.of(group, material);
            add(&document, &mut buffers, primitive, &to_world, parts, part).map_err(wrong)?;
        }
    }
    let materials = names.into_iter().zip(&document.materials).map(|(name, of)| material(name, of)).collect();
    if document.materials.iter().any(Material::has_texture) {
        parts.note("textures are not read", None);
    }
    Ok(materials)
}

/// How much more may be made of a file: nodes may repeat a mesh, but not a million times.
struct Room {
    vertices: usize,
    triangles: usize,
    repeats: u64,
}

/// How many times the length of a file, and of those beside it that it names, the vertices and triangles may take that are made of it, in bytes.
const MOST_REPEATS: u64 = 64;

/// What a primitive counts for besides its vertices and triangles, and its names: time, though it be empty.
const PRIMITIVE: u64 = 256;

/// What a vector counts for that replaces another.
const REPLACING: u64 = 16;

impl Room {
    fn new<R: BufRead>(source: &Source<'_, R>) -> Room {
        // A small file may repeat more.
        let bytes = source.len().max(1 << 16).saturating_mul(MOST_REPEATS);
        Room { vertices: MOST_TRIANGLES, triangles: MOST_TRIANGLES, repeats: bytes }
    }

    /// Makes room for what comes of a file beside.
    fn add_file(&mut self, len: u64) {
        self.repeats = self.repeats.saturating_add(len.saturating_mul(MOST_REPEATS));
    }

    /// Takes room for vertices, triangles, and as much as so many bytes.
    fn take(&mut self, vertices: usize, triangles: usize, more: u64) -> Result<(), String> {
        let bytes = 32 * vertices as u64 + 12 * triangles as u64 + more;
        match (
            self.vertices.checked_sub(vertices),
            self.triangles.checked_sub(triangles),
            self.repeats.checked_sub(bytes),
        ) {
            (Some(vertices), Some(triangles), Some(repeats)) => {
                *self = Room { vertices, triangles, repeats };
                Ok(())
            }
            _ => Err(format!(
                "with it, the file's nodes repeat its meshes to more than {MOST_REPEATS} times its size; \
                 let entities of the scene place them"
            )),
        }
    }
}

/// The modes of primitives that are made of triangles.
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Adds a primitive's triangles to a part.
fn add(
    document: &Document,
    buffers: &mut Buffers<'_>,
    primitive: &Primitive,
    to_world: &DAffine3,
    parts: &mut Parts<'_>,
    part: usize,
) -> Result<(), String> {
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    if ![TRIANGLES, STRIP, FAN].contains(&mode) {
        parts.note("points and lines are left out", None);
        return Ok(());
    }
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let Some(position) = attribute("POSITION") else { return Ok(()) };
    let positions = buffers.floats::<3>(document, position)?;
    let normals = attribute("NORMAL").map(|a| buffers.floats::<3>(document, a)).transpose()?;
    let uv = attribute("TEXCOORD_0").map(|a| buffers.floats::<2>(document, a)).transpose()?;
    let vertices = positions.count();
    if normals.as_ref().is_some_and(|n| n.count() != vertices)
        || uv.as_ref().is_some_and(|uv| uv.count() != vertices)
    {
        return Err(format!("it has {vertices} positions, but not as many normals or uv"));
    }
    let indices = primitive.indices.map(|accessor| buffers.indices(document, accessor)).transpose()?;
    let corners = indices.as_ref().map_or(vertices, Indices::count);
    let count = match mode {
        TRIANGLES => corners / 3,
        _ => corners.saturating_sub(2),
    };
    let replacing = positions.replacing()
        + normals.as_ref().map_or(0, Floats::replacing)
        + uv.as_ref().map_or(0, Floats::replacing);
    buffers.room.take(vertices, count, REPLACING * replacing as u64)?;

    let positions = positions.decode()?;
    let normals = normals.map(|normals| normals.decode()).transpose()?;
    let uv = uv.map(|uv| uv.decode()).transpose()?;
    let indices = match indices {
        Some(indices) => indices.decode()?,
        None => (0..vertices as u32).collect(),
    };
    if let Some(&index) = indices.iter().find(|&&index| index as usize >= vertices) {
        return Err(format!("it has vertex {index}, but there are only {vertices} (counted from 0)"));
    }

    let mirrors = to_world.matrix3.determinant() < 0.0;
    let turned = to_world.matrix3.inverse().transpose();
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
    let mut first = None;
    for i in 0..vertices {
        let normal = normals.as_ref().map(|n| narrow((turned * wide(n[i])).normalize_or_zero()));
        let position = narrow(to_world.transform_point3(wide(positions[i])));
        let number = parts.vertex(part, position, normal, uv.as_ref().map(|uv| uv[i]));
        first.get_or_insert(number);
    }
    let first = first.unwrap_or_default();
    let triangles = &mut parts.mesh(part).triangles;
    triangles.reserve(count);
    for i in 0..count {
        let [a, b, c] = match mode {
            TRIANGLES => [3 * i, 3 * i + 1, 3 * i + 2],
            // Every other one is wound the other way.
            STRIP if i % 2 == 1 => [i + 1, i, i + 2],
            STRIP => [i, i + 1, i + 2],
            _ => [0, i + 1, i + 2],
        }
        .map(|corner| first + indices[corner]);
        triangles.push(if mirrors { [a, c, b] } else { [a, b, c] });
    }
    Ok(())
}

/// A material in this program's terms: what lets light through is glass, metal is a mirror, the rest is matte.
fn material(name: String, of: &Material) -> FileMaterial {
    let base = of.pbr_metallic_roughness.base_color_factor;
    let base = fraction([base[0], base[1], base[2]]);
    let kind = if of.extensions.transmission.factor >= 0.5 {
        glass(of.extensions.ior.ior, base)
    } else if of.pbr_metallic_roughness.metallic_factor >= 0.5
        && !of.pbr_metallic_roughness.has_metal_texture()
    {
        MaterialKind::Mirror { reflectance: base }
    } else {
        MaterialKind::Matte { reflectance: base }
    };
    let strength = of.extensions.emissive_strength.strength;
    let emission =
        if of.has_emissive_texture() { [0.0; 3] } else { radiance(of.emissive_factor.map(|c| c * strength)) };
    FileMaterial { name, kind, emission }
}
