//! Readers of mesh files, one file per format.
//!
//! They read a file once, from front to back, and keep nothing but the mesh. What a header promises is believed
//! only as far as the file is long.

mod obj;
mod ply;
mod polygon;
mod source;
#[cfg(test)]
mod tests;

pub use crate::shape::Mesh;
pub use source::MeshFileError;

use source::Source;
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind};
use std::path::Path;

/// Reads the mesh file at `path`; its extension says what it is: `.ply` or `.obj`.
pub fn read(path: &Path) -> Result<Mesh, MeshFileError> {
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
            Ok(file) => parse(path, BufReader::with_capacity(1 << 16, file), metadata.len()),
            Err(error) => unreadable(&error),
        },
    }
}

/// Reads a mesh of `len` bytes. `name` is what errors call it, and says by its extension what it is.
pub fn parse(name: &Path, input: impl BufRead, len: u64) -> Result<Mesh, MeshFileError> {
    let extension = name.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let mut source = Source::new(name, input, len);
    let mesh = match extension.to_ascii_lowercase().as_str() {
        "ply" => ply::read(&mut source)?,
        "obj" => obj::read(&mut source)?,
        "glb" | "gltf" => return Err(source.whole("glTF comes in a later version; .ply and .obj are read")),
        _ => return Err(source.whole("a mesh file is a .ply or an .obj")),
    };
    match mesh.check() {
        Ok(()) => Ok(mesh),
        Err(error) => Err(source.whole(error)),
    }
}
