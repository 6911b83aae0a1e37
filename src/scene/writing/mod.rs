//! Scenes as TOML, with meshes and pictures beside them: what is read again gives the same picture to the bit.
//!
//! | file | what is in it |
//! |---|---|
//! | `words` | numbers, names and vectors |
//! | `sought` | what has to be written so that the reader makes a given number of it |
//! | `ply` | meshes |
//! | `tables` | the tables of a file |
//!
//! A mesh becomes a file in PLY; a picture is copied as it is. Names of materials and textures are made different from each
//! other.

mod ply;
mod sought;
mod tables;
mod words;

use super::description::{ImageFile, Mesh, Scene};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scene as text, and the files that belong beside it.
#[derive(Debug)]
pub struct Written {
    /// TOML.
    pub text: String,
    /// The files, each with its path relative to the text's.
    pub files: Vec<(PathBuf, Contents)>,
}

/// What is in a file beside a scene's.
#[derive(Debug)]
pub enum Contents {
    /// A mesh, which is written as PLY.
    Mesh(Arc<Mesh>),
    /// The same as in another file.
    Copy(PathBuf),
}

impl Contents {
    /// Writes it.
    pub fn write(&self, mut out: impl Write) -> io::Result<()> {
        match self {
            Contents::Mesh(mesh) => ply::write(mesh, out),
            Contents::Copy(path) => io::copy(&mut std::fs::File::open(path)?, &mut out).map(|_| ()),
        }
    }
}

/// A scene as TOML. `folder` is that which the names of its pictures are relative to, and `beside` the folder of its files,
/// relative to the text.
///
/// # Errors
///
/// If a number can be written in no way in which the reader makes the same of it, or a picture is no file.
pub fn write(scene: &Scene, folder: &Path, beside: &Path) -> Result<Written, String> {
    let mut files = Vec::new();
    let pictures = pictures(scene, folder, beside, &mut files)?;
    let meshes = meshes(scene, beside, &mut files);
    let text = tables::scene(scene, &pictures, &meshes)?;
    Ok(Written { text, files })
}

/// A path as a scene file has it.
fn shown(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// What each picture is called beside the text.
fn pictures(
    scene: &Scene,
    folder: &Path,
    beside: &Path,
    files: &mut Vec<(PathBuf, Contents)>,
) -> Result<Vec<String>, String> {
    let mut names = Vec::new();
    for (i, image) in scene.images.iter().enumerate() {
        let own = Path::new(&image.name);
        let name = own.file_name().map_or_else(|| "picture".into(), |name| name.to_string_lossy());
        // Two folders may have pictures of one name.
        let name = beside.join(format!("{}-{name}", i + 1));
        for (from, to) in tiles(image, &folder.join(own), &name) {
            if !from.is_file() {
                return Err(format!("{} is not a file: its picture cannot be copied", from.display()));
            }
            files.push((to, Contents::Copy(from)));
        }
        names.push(shown(&name));
    }
    Ok(names)
}

/// The files of a picture, each with where it goes.
fn tiles(image: &ImageFile, from: &Path, to: &Path) -> Vec<(PathBuf, PathBuf)> {
    if !image.is_tiled {
        return vec![(from.into(), to.into())];
    }
    let of = |path: &Path, number: u32| {
        PathBuf::from(path.to_string_lossy().replace(crate::texture::UDIM, &number.to_string()))
    };
    image.tiles.iter().map(|tile| (of(from, tile.number), of(to, tile.number))).collect()
}

/// What the mesh of each entity is called beside the text, if it has one.
fn meshes(scene: &Scene, beside: &Path, files: &mut Vec<(PathBuf, Contents)>) -> Vec<Option<String>> {
    let mut known: Vec<String> = Vec::new();
    let mut by_address = std::collections::HashMap::new();
    let mut names = Vec::with_capacity(scene.entities.len());
    for entity in &scene.entities {
        let super::description::Shape::Mesh { mesh, .. } = &entity.shape else {
            names.push(None);
            continue;
        };
        let next = known.len();
        let at = *by_address.entry(Arc::as_ptr(mesh)).or_insert(next);
        if at == next {
            let path = beside.join(format!("mesh-{}.ply", next + 1));
            known.push(shown(&path));
            files.push((path, Contents::Mesh(Arc::clone(mesh))));
        }
        names.push(Some(known[at].clone()));
    }
    names
}

#[cfg(test)]
mod tests;
