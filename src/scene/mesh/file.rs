//! The request to a reader of mesh files, and its answer.

use super::notes::Note;
use crate::scene::description::{Colour, MaterialKind};
use crate::shape::Mesh;
use std::sync::Arc;

/// The parts of a file that are to be meshes by themselves.
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

/// The contents of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// The parts in which there is something, each with the name of its group or material; without one where the
    /// file is whole, and where no name is for it.
    pub parts: Vec<(String, Arc<Mesh>)>,
    /// The file's own materials; none unless the file was [split by them](Split::Materials).
    pub materials: Vec<FileMaterial>,
    /// The names of the first groups and materials in it.
    pub names: Vec<String>,
    /// Notes of everything that was left out, repaired or approximated.
    pub notes: Vec<Note>,
}

/// A material as a mesh file has it, in this program's terms.
#[derive(Clone, Debug, PartialEq)]
pub struct FileMaterial {
    /// Its name in the file.
    pub name: String,
    /// The kind of its surface.
    pub kind: MaterialKind,
    /// Radiance that it emits.
    pub emission: Colour,
}
