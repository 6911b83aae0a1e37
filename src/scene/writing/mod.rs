//! Scenes as TOML, with meshes and pictures in files beside them. The written scene renders to the same bits.
//!
//! | file | what is in it |
//! |---|---|
//! | `words` | numbers, names and vectors |
//! | `sought` | numbers whose conversion by the reader gives a certain value |
//! | `ply` | meshes |
//! | `tables` | the tables of a file |
//!
//! A mesh is written as PLY, and a picture is copied. Names of materials and textures are made unique.

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

/// The contents of a file beside a scene file.
#[derive(Debug)]
pub enum Contents {
    /// A mesh, which is written as PLY.
    Mesh(Arc<Mesh>),
    /// A copy of the file at this path.
    Copy(PathBuf),
}

impl Contents {
    /// Writes the contents of the file.
    pub fn write(&self, mut out: impl Write) -> io::Result<()> {
        match self {
            Contents::Mesh(mesh) => ply::write(mesh, out),
            Contents::Copy(path) => io::copy(&mut std::fs::File::open(path)?, &mut out).map(|_| ()),
        }
    }
}

/// A scene as TOML. The paths of its pictures are relative to `folder`. Its files go to the folder `beside`, which is
/// relative to the text.
///
/// # Errors
///
/// If no decimal number is read as the same value, or a picture is not from a file.
pub fn write(scene: &Scene, folder: &Path, beside: &Path) -> Result<Written, String> {
    let mut files = Vec::new();
    let pictures = pictures(scene, folder, beside, &mut files)?;
    let meshes = meshes(scene, beside, &mut files);
    let text = tables::scene(scene, &pictures, &meshes)?;
    Ok(Written { text, files })
}

/// A path in a scene file.
fn shown(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

/// The path of each picture, relative to the text.
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

/// The path of each entity's mesh, relative to the text, if it has one.
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
