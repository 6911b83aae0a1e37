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
        "ply" => {
            let part = parts.of("", "");
            *parts.mesh(part) = ply::read(&mut source)?;
        }
        "obj" => {
            let libraries = obj::read(&mut source, &mut parts)?;
            if *split == Split::Materials {
                for path in libraries.iter().flat_map(|line| libraries_beside(name, line)) {
                    let (file, len) = open(&path)?;
                    let mut watch = |_, _| {};
                    let input = BufReader::new(file);
                    mtl::read(&mut Source::new(&path, input, len, &mut watch), &mut parts, &mut materials)?;
                }
            }
        }
        "glb" => materials = gltf::read_binary(&mut source, &mut parts)?,
        "gltf" => materials = gltf::read_text(&mut source, &mut parts)?,
        _ => return Err(source.whole("a mesh file is a .ply, an .obj, a .glb or a .gltf")),
    }
    parts.finish(materials).map_err(|error| source.whole(error))
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
