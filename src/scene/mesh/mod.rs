//! Readers of mesh files, one file per format.
//!
//! They read a file once, from front to back, and keep nothing but the mesh. What a header promises is believed
//! only as far as the file is long.

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
pub use notes::Note;
pub use source::{MeshFileError, Place};

use self::parts::Parts;
use self::source::{Read_, Source};
use super::description::{Colour, MaterialKind};
use std::collections::HashSet;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What of a file is to be a mesh by itself.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// All of it.
    Whole,
    /// All that has one of the file's own materials.
    Materials,
    /// All that is in the group of this name or, if it is in none of these, has the material of this name; and what
    /// is left.
    Named(Vec<String>),
}

/// What was read.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The parts in which there is something, each with the name of its group or material; without one where the
    /// file is whole, and where no name is for it.
    pub parts: Vec<(String, Arc<Mesh>)>,
    /// The file's own materials; none unless the file was [split by them](Split::Materials).
    pub materials: Vec<FileMaterial>,
    /// The names of the first groups and materials in it.
    pub names: Vec<String>,
    /// What was left out, repaired or approximated.
    pub notes: Vec<Note>,
}

/// A material as a mesh file has it, in this program's terms.
#[derive(Clone, Debug, PartialEq)]
pub struct FileMaterial {
    /// Its name in the file.
    pub name: String,
    /// What it does with light.
    pub kind: MaterialKind,
    /// Radiance that it emits.
    pub emission: Colour,
}

/// What a progress display hears: bytes read so far, and how many there are.
pub type Watch<'a> = &'a mut dyn FnMut(u64, u64);

/// Reads the mesh file at `path`; its extension says what it is: `.ply`, `.obj`, `.glb` or `.gltf`.
pub fn read(path: &Path, split: &Split, watch: Watch<'_>) -> Result<MeshFile, MeshFileError> {
    let (file, len) = open(path)?;
    parse(path, BufReader::with_capacity(1 << 16, file), len, split, watch)
}

/// Opens a file, and says how long it is.
fn open(path: &Path) -> Read_<(File, u64)> {
    let fail = |message: String| Err(MeshFileError { file: path.into(), place: None, message });
    let unreadable = |error: &std::io::Error| match error.kind() {
        ErrorKind::NotFound => fail("there is no such file".into()),
        ErrorKind::PermissionDenied => fail("you have no permission to read this file".into()),
        _ => fail(format!("cannot be read: {error}")),
    };
    match std::fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => fail("this is not a file".into()),
        Err(error) => unreadable(&error),
        Ok(metadata) => match File::open(path) {
            Ok(file) => Ok((file, metadata.len())),
            Err(error) => unreadable(&error),
        },
    }
}

/// Reads a mesh of `len` bytes. `name` is what errors call it; it says by its extension what it is, and other files
/// that it names are looked for beside it.
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
        _ => return Err(source.whole("a mesh file is a .ply, an .obj, a .glb or a .gltf")),
    }
    if source.marked() {
        parts.note(MARKED, None);
    }
    parts.finish(materials).map_err(|error| source.whole(error))
}

/// What is said of a file that begins with a byte-order mark.
const MARKED: &str = "the byte-order mark is skipped";

/// The materials of the libraries that an OBJ file names; notes say which libraries and which materials are not there.
fn libraries(name: &Path, names: &obj::Names, parts: &mut Parts<'_>) -> Read_<Vec<FileMaterial>> {
    let mut materials = Vec::new();
    for obj::Name { name: line, place } in &names.libraries {
        for path in libraries_beside(name, line) {
            let (file, len) = match open(&path) {
                Ok(opened) => opened,
                Err(error) => {
                    parts.note(&format!("material library {error}"), place.clone());
                    continue;
                }
            };
            let mut watch = |_, _| {};
            let mut source = Source::new(&path, BufReader::new(file), len, &mut watch);
            mtl::read(&mut source, parts, &mut materials)?;
            if source.marked() {
                parts.note(MARKED, mtl::place(&source, 1));
            }
        }
    }
    let known: HashSet<_> = materials.iter().map(|material| material.name.as_str()).collect();
    for obj::Name { name, place } in names.materials.iter().filter(|used| !known.contains(used.name.as_str()))
    {
        if !name.is_empty() {
            parts.note("materials that are in no library are left to the scene", place.clone());
        }
    }
    Ok(materials)
}

/// A file that another one names.
fn beside(file: &Path, name: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(name)
}

/// The libraries that a line of an OBJ file names: one, in whose name there may be blanks or, if that is no file,
/// several between blanks.
fn libraries_beside(file: &Path, line: &str) -> Vec<PathBuf> {
    let whole = beside(file, line);
    let several: Vec<_> = line.split_ascii_whitespace().map(|name| beside(file, name)).collect();
    // If there are none at all, the error is best about the whole.
    if !whole.is_file() && several.iter().any(|path| path.is_file()) { several } else { vec![whole] }
}
