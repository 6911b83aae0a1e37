//! The parts of a file: the names of its groups and materials, and a mesh for each part that is requested.

use super::file::{FileMaterial, MeshFile, Split};
use super::notes::{Note, Notes};
use super::polygon::{Cut, triangulate};
use super::source::FilePosition;
use crate::shape::{FARTHEST, Mesh, MeshError};
use std::collections::HashMap;

/// The maximum number of names in errors and warnings; a file may have a million.
const MOST_NAMES: usize = 100;

/// A mesh under construction.
#[derive(Default)]
struct Part {
    name: String,
    mesh: Mesh,
    /// The numbers of vertices with a normal, and with uv of each set.
    with_normal: usize,
    with_uv: [usize; 2],
}

/// The meshes of a file while it is read.
pub(super) struct Parts<'a> {
    split: &'a Split,
    parts: Vec<Part>,
    /// The parts by material, if the file is split by materials.
    by_material: HashMap<String, usize>,
    names: Vec<String>,
    notes: Notes,
}

impl<'a> Parts<'a> {
    pub(super) fn new(split: &'a Split) -> Self {
        let named = match split {
            Split::Whole => vec![String::new()],
            Split::Materials => Vec::new(),
            // The last part takes everything without a listed name.
            Split::Named(names) => names.iter().cloned().chain([String::new()]).collect(),
        };
        let parts = named.into_iter().map(|name| Part { name, ..Part::default() }).collect();
        Parts { split, parts, by_material: HashMap::new(), names: Vec::new(), notes: Notes::default() }
    }

    /// The part for triangles with this group and material. Group names take precedence over material names.
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

    /// Adds a vertex, with uv of up to two sets, to a part and returns its index there.
    pub(super) fn vertex(
        &mut self,
        part: usize,
        position: [f32; 3],
        normal: Option<[f32; 3]>,
        uv: [Option<[f32; 2]>; 2],
    ) -> u32 {
        let Part { mesh, with_normal, with_uv, .. } = &mut self.parts[part];
        let number = mesh.positions.len();
        mesh.positions.push(position);
        // Zero normals mean flat shading: columns begin with the first vertex that has one.
        *with_normal += usize::from(normal.is_some());
        if *with_normal > 0 {
            mesh.normals.resize(number, [0.0; 3]);
            mesh.normals.push(normal.unwrap_or_default());
        }
        for ((column, with), uv) in [&mut mesh.uv, &mut mesh.second_uv].into_iter().zip(with_uv).zip(uv) {
            *with += usize::from(uv.is_some());
            // uv are used only if all vertices have them.
            if *with == number + 1 {
                column.push(uv.unwrap_or_default());
            } else {
                *column = Vec::new();
            }
        }
        number as u32
    }

    /// The mesh of a part.
    pub(super) fn mesh(&mut self, part: usize) -> &mut Mesh {
        &mut self.parts[part].mesh
    }

    /// Adds a note about an omission, repair or approximation.
    pub(super) fn note(&mut self, message: &str, place: Option<FilePosition>) {
        self.notes.add(message, place);
    }

    /// Adds a note about a material of the file.
    pub(super) fn note_of_material(&mut self, message: &str, place: Option<FilePosition>) {
        self.notes.add_of_material(message, place);
    }

    /// Adds a note about several items of a kind, with the location of the first.
    pub(super) fn note_several(&mut self, message: &str, count: u64, place: Option<FilePosition>) {
        self.notes.add_several(message, count, place);
    }

    /// Adds a face of more than three corners, all of whose vertices exist, to a part, and notes its problems.
    pub(super) fn polygon(
        &mut self,
        part: usize,
        corners: &[u32],
        place: impl FnOnce() -> Option<FilePosition>,
    ) {
        let Mesh { positions, triangles, .. } = &mut self.parts[part].mesh;
        match triangulate(corners, positions, triangles) {
            Cut::Exact => {}
            Cut::Flat => self.note(FLAT, place()),
            Cut::Crossed => {
                self.note("self-intersecting faces are split into overlapping triangles", place())
            }
        }
    }

    /// Checks all parts and returns those with triangles. Fails if there are none; notes about omissions may explain
    /// why.
    pub(super) fn finish(mut self, materials: Vec<FileMaterial>) -> Result<MeshFile, String> {
        let mut some = false;
        let mut meshes = Vec::new();
        for mut part in self.parts.into_iter().filter(|part| !part.mesh.triangles.is_empty()) {
            repair(&mut part.mesh, &mut self.notes, |vertex| match part.name.as_str() {
                "" => format!("vertex {vertex}"),
                name => format!("vertex {vertex} of {name:?}"),
            });
            for (with, uv) in part.with_uv.into_iter().zip([&part.mesh.uv, &part.mesh.second_uv]) {
                if with > 0 && uv.is_empty() {
                    self.notes.add("uv are ignored in parts where some vertices have none", None);
                }
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
pub(super) const FLAT: &str = "faces without area are invisible";

/// The note about colours of vertices, which counts vertices.
pub(super) const VERTEX_COLOURS: &str = "colours of vertices are not read";

/// A normal of a file, of any length but zero; `None` if it is not finite.
pub(super) fn normal(n: [f32; 3]) -> Option<[f32; 3]> {
    let largest = n.iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
    match n.iter().all(|x| x.is_finite()) {
        true if largest > FARTHEST => Some(n.map(|x| x / largest)),
        true => Some(n),
        false => None,
    }
}

/// The note about invalid normals; it counts vertices, or lines that give normals.
pub(super) const NO_NORMAL: &str = "normals that are not numbers are ignored; shading is flat there";

/// uv of a file; `None` if they are invalid.
pub(super) fn uv(uv: [f32; 2]) -> Option<[f32; 2]> {
    uv.iter().all(|x| x.abs() <= FARTHEST).then_some(uv)
}

/// The note about invalid uv; it counts vertices, or lines that give uv.
pub(super) const NO_UV: &str = "uv that are not numbers, or larger than 10¹⁸, are taken for 0";

/// Replaces normals and uv that are not numbers by zeros. `name` names a vertex in messages.
fn repair(mesh: &mut Mesh, notes: &mut Notes, name: impl Fn(usize) -> String) {
    for (i, n) in mesh.normals.iter_mut().enumerate() {
        *n = normal(*n).unwrap_or_else(|| {
            notes.add(NO_NORMAL, Some(FilePosition::Item(name(i))));
            [0.0; 3]
        });
    }
    for column in [&mut mesh.uv, &mut mesh.second_uv] {
        for (i, of_vertex) in column.iter_mut().enumerate() {
            *of_vertex = uv(*of_vertex).unwrap_or_else(|| {
                notes.add(NO_UV, Some(FilePosition::Item(name(i))));
                [0.0; 2]
            });
        }
    }
}

/// For each vertex, whether a triangle uses it. The positions of the others, which may be invalid, become zero.
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

/// Removes unused vertices from a mesh that was checked.
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
    retain(&mut mesh.second_uv, used);
}

/// Removes the unused entries of a column.
fn retain<T>(column: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    column.retain(|_| used.next().copied().unwrap_or_default());
    column.shrink_to_fit();
}
