//! Readers of mesh files, one file per format.
//!
//! They read a file once, from front to back, and keep nothing but the mesh. Sizes in a header are checked against the
//! length of the file.

pub mod cache;
mod file;
mod gltf;
mod mtl;
mod notes;
mod obj;
mod parts;
mod ply;
mod polygon;
mod source;
#[cfg(test)]
mod tests;

pub use crate::shape::Mesh;
pub use file::{FileMaterial, MeshFile, Split};
pub use notes::Note;
pub use source::{FilePosition, MeshFileError, Watch};

use self::parts::Parts;
use self::source::{Read_, Source, beside, open};
use std::collections::HashSet;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// The extensions of mesh files.
pub const EXTENSIONS: [&str; 4] = ["ply", "obj", "glb", "gltf"];

/// Reads the mesh file at `path`. Its extension gives the format: `.ply`, `.obj`, `.glb` or `.gltf`.
pub fn read(path: &Path, split: &Split, watch: Watch<'_>) -> Result<MeshFile, MeshFileError> {
    let (file, len) = open(path)?;
    parse(path, BufReader::with_capacity(1 << 16, file), len, split, watch)
}

/// Reads a mesh of `len` bytes. `name` is used in errors; its extension gives the format, and files that it refers to
/// are resolved relative to it.
pub fn parse(
    name: &Path,
    input: impl BufRead,
    len: u64,
    split: &Split,
    watch: Watch<'_>,
) -> Result<MeshFile, MeshFileError> {
    let extension = name.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let mut source = Source::new(name, input, len, watch);
    let mut parts = Parts::new(split);
    let mut materials = Vec::new();
    match extension.to_ascii_lowercase().as_str() {
        "ply" => ply::read(&mut source, &mut parts)?,
        "obj" => {
            let names = obj::read(&mut source, &mut parts)?;
            if *split == Split::Materials {
                materials = libraries(name, &names, &mut parts)?;
            }
        }
        "glb" => materials = gltf::read_binary(&mut source, &mut parts)?,
        "gltf" => materials = gltf::read_text(&mut source, &mut parts)?,
        _ => return Err(source.whole("unknown kind of mesh file; supported are .ply, .obj, .glb and .gltf")),
    }
    parts.finish(materials).map_err(|error| source.whole(error))
}

/// The materials of the libraries that an OBJ file refers to; notes list missing libraries and materials.
fn libraries(name: &Path, names: &obj::Names, parts: &mut Parts<'_>) -> Read_<Vec<FileMaterial>> {
    let mut materials = Vec::new();
    for obj::Name { name: line, place } in &names.libraries {
        for path in libraries_beside(name, line) {
            let (file, len) = match open(&path) {
                Ok(opened) => opened,
                Err(error) => {
                    let line = place.as_ref().map(FilePosition::to_string).unwrap_or_default();
                    let place = FilePosition::Item(format!("{line}: {error}"));
                    parts.note_of_material("unreadable material libraries are ignored", Some(place));
                    continue;
                }
            };
            let mut watch = |_, _| {};
            let mut source = Source::new(&path, BufReader::new(file), len, &mut watch);
            mtl::read(&mut source, parts, &mut materials)?;
        }
    }
    let known: HashSet<_> = materials.iter().map(|material| material.name.as_str()).collect();
    for obj::Name { name, place } in names.materials.iter().filter(|used| !known.contains(used.name.as_str()))
    {
        if !name.is_empty() {
            parts.note_of_material("materials missing from the libraries come from the scene", place.clone());
        }
    }
    let again = (materials.len() - known.len()) as u64;
    parts.note_several("materials with a repeated name are ignored", again, None);
    Ok(materials)
}

/// The libraries in a line of an OBJ file: a single one, whose name may contain blanks, or several separated by blanks
/// if there is no such file.
fn libraries_beside(file: &Path, line: &str) -> Vec<PathBuf> {
    let whole = beside(file, line);
    let several: Vec<_> = line.split_ascii_whitespace().map(|name| beside(file, name)).collect();
    // If none exists, the error is about the whole line.
    if !whole.is_file() && several.iter().any(|path| path.is_file()) { several } else { vec![whole] }
}
