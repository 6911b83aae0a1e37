//! The parts of a file: what its groups and materials are called, and a mesh for each that is wanted apart.

use super::file::{FileMaterial, MeshFile, Split};
use super::notes::{Note, Notes};
use super::polygon::{Cut, triangulate};
use super::source::Place;
use crate::shape::{FARTHEST, Mesh, MeshError};
use std::collections::HashMap;

/// Names that errors and warnings may list; a file may have a million.
const MOST_NAMES: usize = 100;

/// A mesh that grows.
#[derive(Default)]
struct Part {
    name: String,
    mesh: Mesh,
    /// The numbers of vertices that came with a normal, and with uv.
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

    /// Notes that something about a material of the file was left out, repaired or approximated.
    pub(super) fn note_of_material(&mut self, message: &str, place: Option<Place>) {
        self.notes.add_of_material(message, place);
    }

    /// Notes several things of a kind, the first of which is in this place.
    pub(super) fn note_several(&mut self, message: &str, count: u64, place: Option<Place>) {
        self.notes.add_several(message, count, place);
    }

    /// Adds a face of more than three corners to a part, whose vertices are all there, and notes what is wrong with it.
    pub(super) fn polygon(&mut self, part: usize, corners: &[u32], place: impl FnOnce() -> Option<Place>) {
        let Mesh { positions, triangles, .. } = &mut self.parts[part].mesh;
        match triangulate(corners, positions, triangles) {
            Cut::Exact => {}
            Cut::Flat => self.note(FLAT, place()),
            Cut::Crossed => self.note(
                "faces whose outline crosses itself are cut into triangles of which some overlap",
                place(),
            ),
        }
    }

    /// Checks all parts, and gives those in which there is something; or says why there is nothing, which what was
    /// left out may explain.
    pub(super) fn finish(mut self, materials: Vec<FileMaterial>) -> Result<MeshFile, String> {
        let mut some = false;
        let mut meshes = Vec::new();
        for mut part in self.parts.into_iter().filter(|part| !part.mesh.triangles.is_empty()) {
            repair(&mut part.mesh, &mut self.notes, |vertex| match part.name.as_str() {
                "" => format!("vertex {vertex}"),
                name => format!("vertex {vertex} of {name:?}"),
            });
            if part.with_uv > 0 && part.mesh.uv.is_empty() {
                self.notes.add("uv are left out where not all vertices have them", None);
            }
            let used = used(&mut part.mesh);
            part.mesh.check().map_err(|error| error.to_string())?;
            drop_unused(&mut part.mesh, &used);
            some |= part.mesh.has_area();
            meshes.push((part.name, std::sync::Arc::new(part.mesh)));
        }
        let notes = self.notes.into_all();
        let error = match (meshes.is_empty(), some) {
            (true, _) => MeshError::Empty,
            (false, false) => MeshError::Flat,
            _ => return Ok(MeshFile { parts: meshes, materials, names: self.names, notes }),
        };
        let error = std::iter::once(error.to_string()).chain(notes.iter().map(Note::to_string));
        Err(error.collect::<Vec<_>>().join("; "))
    }
}

/// The note about faces without area.
pub(super) const FLAT: &str = "faces without area are never seen";

/// The note about colours of vertices, which counts vertices.
pub(super) const VERTEX_COLOURS: &str = "colours of vertices are not read";

/// A normal of a file, which may have any length but zero; none in place of numbers that are none.
pub(super) fn normal(n: [f32; 3]) -> Option<[f32; 3]> {
    let largest = n.iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
    match n.iter().all(|x| x.is_finite()) {
        true if largest > FARTHEST => Some(n.map(|x| x / largest)),
        true => Some(n),
        false => None,
    }
}

/// The note about normals that are not numbers; it counts vertices, or lines that give normals.
pub(super) const NO_NORMAL: &str = "normals that are not numbers are left out, and shading is flat there";

/// uv of a file; none in place of numbers that are none.
pub(super) fn uv(uv: [f32; 2]) -> Option<[f32; 2]> {
    uv.iter().all(|x| x.abs() <= FARTHEST).then_some(uv)
}

/// The note about uv that are not numbers; it counts vertices, or lines that give uv.
pub(super) const NO_UV: &str = "uv that are not numbers, or larger than 10¹⁸, are taken for 0";

/// Puts zeros in place of normals and uv that are not numbers. `name` says how a vertex is called.
fn repair(mesh: &mut Mesh, notes: &mut Notes, name: impl Fn(usize) -> String) {
    for (i, n) in mesh.normals.iter_mut().enumerate() {
        *n = normal(*n).unwrap_or_else(|| {
            notes.add(NO_NORMAL, Some(Place::Item(name(i))));
            [0.0; 3]
        });
    }
    for (i, of_vertex) in mesh.uv.iter_mut().enumerate() {
        *of_vertex = uv(*of_vertex).unwrap_or_else(|| {
            notes.add(NO_UV, Some(Place::Item(name(i))));
            [0.0; 2]
        });
    }
}

/// For each vertex, true if a triangle uses it. The positions of the others, which may be no numbers, become zero.
fn used(mesh: &mut Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    for &corner in mesh.triangles.iter().flatten() {
        if let Some(used) = used.get_mut(corner as usize) {
            *used = true;
        }
    }
    for (position, used) in mesh.positions.iter_mut().zip(&used) {
        if !used {
            *position = [0.0; 3];
        }
    }
    used
}

/// Takes vertices that are no triangle's out of a mesh that was checked.
fn drop_unused(mesh: &mut Mesh, used: &[bool]) {
    if used.iter().all(|&used| used) {
        return;
    }
    let mut left = 0;
    let numbers: Vec<u32> = used
        .iter()
        .map(|&used| {
            let number = left;
            left += u32::from(used);
            number
        })
        .collect();
    mesh.triangles.iter_mut().flatten().for_each(|corner| *corner = numbers[*corner as usize]);
    retain(&mut mesh.positions, used);
    retain(&mut mesh.normals, used);
    retain(&mut mesh.uv, used);
}

/// Keeps what is used of a column.
fn retain<T>(column: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    column.retain(|_| used.next().copied().unwrap_or_default());
    column.shrink_to_fit();
}
