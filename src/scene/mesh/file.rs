//! The input and output of readers of mesh files.

use super::notes::Note;
use crate::scene::description::{Colour, MaterialKind};
use crate::shape::Mesh;
use std::sync::Arc;

/// The parts of a file that become separate meshes.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// The entire file.
    Whole,
    /// One part for each of the file's own materials.
    Materials,
    /// One part for each listed name: the group with this name or, outside of listed groups, the material with this
    /// name. The rest is another part.
    Named(Vec<String>),
}

/// The contents of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The parts with triangles, each with the name of its group or material; `None` for the whole file or the rest.
    pub parts: Vec<(String, Arc<Mesh>)>,
    /// The file's own materials; empty unless the file was [split by them](Split::Materials).
    pub materials: Vec<FileMaterial>,
    /// The names of the first groups and materials.
    pub names: Vec<String>,
    /// Notes about everything that was left out, repaired or approximated.
    pub notes: Vec<Note>,
}

/// A material of a mesh file, converted to the renderer's materials.
#[derive(Clone, Debug, PartialEq)]
pub struct FileMaterial {
    /// Its name in the file.
    pub name: String,
    /// The kind of its surface.
    pub kind: MaterialKind,
    /// Radiance that it emits, W·m⁻²·sr⁻¹.
    pub emission: Colour,
}
