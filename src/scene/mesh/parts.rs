//! The parts of a file: what its groups and materials are called, and a mesh for each that is wanted apart.

use super::notes::Notes;
use super::source::Place;
use super::{FileMaterial, Mesh, MeshFile, Split};
use crate::shape::MeshError;
use std::collections::HashMap;

/// Names that errors and warnings may list; a file may have a million.
const MOST_NAMES: usize = 100;

/// A mesh that grows.
#[derive(Default)]
struct Part {
    name: String,
    mesh: Mesh,
    /// How many vertices came with a normal, and with uv.
    with_normal: usize,
    with_uv: usize,
}

/// The meshes of a file while it is read.
pub(super) struct Parts<'a> {
    split: &'a Split,
    parts: Vec<Part>,
    /// By material, where parts are of one each.
    by_material: HashMap<String, usize>,
    names: Vec<String>,
    notes: Notes,
}

impl<'a> Parts<'a> {
    pub(super) fn new(split: &'a Split) -> Self {
        let named = match split {
            Split::Whole => vec![String::new()],
            Split::Materials => Vec::new(),
            // The last is what none of the names is for.
            Split::Named(names) => names.iter().cloned().chain([String::new()]).collect(),
        };
        let parts = named.into_iter().map(|name| Part { name, ..Part::default() }).collect();
        Parts { split, parts, by_material: HashMap::new(), names: Vec::new(), notes: Notes::default() }
    }

    /// The part to which triangles of this group and this material belong. A name of a group counts before that of
    /// a material.
    pub(super) fn of(&mut self, group: &str, material: &str) -> usize {
        for name in [group, material] {
            if !name.is_empty() && self.names.len() < MOST_NAMES && !self.names.iter().any(|n| n == name) {
                self.names.push(name.to_owned());
            }
        }
        match self.split {
            Split::Whole => 0,
            Split::Named(names) => {
                let find = |name: &str| names.iter().position(|n| n == name);
                find(group).or_else(|| find(material)).unwrap_or(names.len())
            }
            Split::Materials => {
                if let Some(&part) = self.by_material.get(material) {
                    return part;
                }
                self.parts.push(Part { name: material.to_owned(), ..Part::default() });
                self.by_material.insert(material.to_owned(), self.parts.len() - 1);
                self.parts.len() - 1
            }
        }
    }

    /// Adds a vertex to a part and returns its number there.
    pub(super) fn vertex(
        &mut self,
        part: usize,
        position: [f32; 3],
        normal: Option<[f32; 3]>,
        uv: Option<[f32; 2]>,
    ) -> u32 {
        let Part { mesh, with_normal, with_uv, .. } = &mut self.parts[part];
        let number = mesh.positions.len();
        mesh.positions.push(position);
        // Zero normals shade flat: columns begin with the first vertex that has one.
        *with_normal += usize::from(normal.is_some());
        if *with_normal > 0 {
            mesh.normals.resize(number, [0.0; 3]);
            mesh.normals.push(normal.unwrap_or_default());
        }
        *with_uv += usize::from(uv.is_some());
        // uv are of use only if all have them.
        if *with_uv == number + 1 {
            mesh.uv.push(uv.unwrap_or_default());
        } else {
            mesh.uv = Vec::new();
        }
        number as u32
    }

    /// The mesh of a part.
    pub(super) fn mesh(&mut self, part: usize) -> &mut Mesh {
        &mut self.parts[part].mesh
    }

    /// Notes that something was left out, repaired or approximated.
    pub(super) fn note(&mut self, message: &str, place: Option<Place>) {
        self.notes.add(message, place);
    }

    /// Checks all parts, and gives those in which there is something.
    pub(super) fn finish(self, materials: Vec<FileMaterial>) -> Result<MeshFile, MeshError> {
        let mut some = false;
        let mut meshes = Vec::new();
        for part in self.parts.into_iter().filter(|part| !part.mesh.triangles.is_empty()) {
            part.mesh.check()?;
            some |= part.mesh.has_area();
            meshes.push((part.name, std::sync::Arc::new(part.mesh)));
        }
        match (meshes.is_empty(), some) {
            (true, _) => Err(MeshError::Empty),
            (false, false) => Err(MeshError::Flat),
            _ => Ok(MeshFile { parts: meshes, materials, names: self.names, notes: self.notes.into_all() }),
        }
    }
}
