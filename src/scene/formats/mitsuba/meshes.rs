//! Meshes from files.
//!
//! In Mitsuba the v of textures runs down, and converted meshes keep it. The v of OBJ files runs up; as in Mitsuba, it
//! is replaced by 1 − v. If a file has no normals, they are computed with the angles of triangles as weights (Thürmer
//! and Wüthrich 1998), unless `face_normals` is set.

use super::builder::{Builder, MeshKey};
use super::formed::Formed;
use super::limits::MOST_UNPACKED;
use super::object::Object;
use super::report::{Place, Read, UNREADABLE};
use super::transform::uniform_scale;
use crate::scene::description::Mesh;
use crate::scene::mesh::Split;
use crate::scene::mesh::cache::{Found, Unreadable};
use crate::shape::MeshError;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The maximum number of edges for which borders are searched. Larger meshes count as closed.
const MOST_EDGES: usize = 1 << 22;

impl Builder<'_, '_> {
    /// The mesh of a file, in the mesh's space. None for a file in which no triangle has an area.
    pub(super) fn mesh(&mut self, object: &Object, transform: DAffine3) -> Read<Option<Formed>> {
        let path = self.file(object, "filename")?;
        let place = object.find("filename").map_or(object.place, |property| property.place);
        let is_obj = object.plugin == "obj";
        let turned_uv = object.flag("flip_tex_coords", is_obj, self.reports)?;
        let face_normals = object.flag("face_normals", false, self.reports)?;
        let number = match object.plugin.as_str() {
            "serialized" => object.whole("shape_index", 0, self.reports)?,
            _ => 0,
        };
        let Ok(number) = usize::try_from(number) else {
            return Err(self.reports.error(place, "shape_index must not be below 0"));
        };
        let key = MeshKey::File(path.clone(), number, turned_uv, face_normals);
        if let Some(mesh) = self.made.get(&key) {
            let mesh = Arc::clone(mesh);
            let source = (path, number, turned_uv);
            return self.with_normals(mesh, transform, face_normals, source, place).map(Some);
        }
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        let mesh = if object.plugin == "serialized" {
            let read = self.serialized.get(&path, number, &mut self.room);
            read.map_err(|error| self.reports.error(place, format!("{}: {error}", path.display())))?
        } else if !extension.eq_ignore_ascii_case(&object.plugin) {
            let message = format!("the file of {} must end in .{}", object.what(), object.plugin);
            return Err(self.reports.error(place, message));
        } else {
            match self.mesh_of_cache(&path, place)? {
                Some(mesh) => mesh,
                None => return Ok(None),
            }
        };
        let needs_change = turned_uv && !mesh.uv.is_empty() || face_normals && !mesh.normals.is_empty();
        let mesh = if needs_change {
            let mut changed = (*mesh).clone();
            if turned_uv {
                changed.uv.iter_mut().for_each(|[_, v]| *v = 1.0 - *v);
            }
            if face_normals {
                changed.normals = Vec::new();
            }
            self.made_here(changed, place)?
        } else {
            mesh
        };
        self.made.insert(key, Arc::clone(&mesh));
        self.with_normals(mesh, transform, face_normals, (path, number, turned_uv), place).map(Some)
    }

    /// Counts a mesh that differs from the one in the file. A scene may have one for each shape.
    fn made_here(&mut self, mesh: Mesh, place: Place) -> Read<Arc<Mesh>> {
        let Mesh { positions, normals, uv, second_uv, triangles } = &mesh;
        let bytes =
            12 * (positions.len() + normals.len() + triangles.len()) + 8 * (uv.len() + second_uv.len());
        match self.room.checked_sub(bytes as u64) {
            Some(room) => {
                self.room = room;
                Ok(Arc::new(mesh))
            }
            None => {
                let most = MOST_UNPACKED >> 30;
                let message = format!("meshes whose normals are computed are larger than {most} GiB in all");
                let help = || Some("give them normals, or say face_normals".into());
                Err(self.reports.error_with(place, message, help))
            }
        }
    }

    /// Whether a cached mesh has a border.
    fn is_open(&mut self, mesh: &Arc<Mesh>) -> bool {
        *self.borders.entry(Arc::as_ptr(mesh).addr()).or_insert_with(|| has_border(mesh))
    }

    fn mesh_of_cache(&mut self, path: &Path, place: Place) -> Read<Option<Arc<Mesh>>> {
        let name = self.files.name(path);
        let Some(name) = name.to_str() else {
            return Err(self.reports.error(place, "the path of this file is not UTF-8"));
        };
        match self.meshes.get(name, Split::Whole) {
            Ok(Found { file, notes }) => {
                notes.into_iter().for_each(|note| self.reports.note(place, note, None));
                match file.parts.first() {
                    Some((_, mesh)) => Ok(Some(Arc::clone(mesh))),
                    None => Err(self.reports.error(place, "there is nothing in this file")),
                }
            }
            // Exporters write them, and Mitsuba renders a scene without them.
            Err(Unreadable::First(error)) if error.message.starts_with(&MeshError::Flat.to_string()) => {
                self.reports.note(place, error.to_string(), Some("it is left out".into()));
                self.flat.insert(path.into());
                Ok(None)
            }
            Err(Unreadable::Again) if self.flat.contains(path) => Ok(None),
            Err(Unreadable::First(error)) => Err(self.reports.error(place, error.to_string())),
            Err(Unreadable::Again) => Err(self.reports.error(place, UNREADABLE)),
        }
    }

    /// The mesh with normals, if it lacks normals and needs them. Normals are computed in the world, so a transform
    /// that does not preserve angles needs a mesh of its own.
    fn with_normals(
        &mut self,
        mesh: Arc<Mesh>,
        transform: DAffine3,
        face_normals: bool,
        (path, number, turned_uv): (Arc<Path>, usize, bool),
        place: Place,
    ) -> Read<Formed> {
        let is_open = self.is_open(&mesh);
        if face_normals || !mesh.normals.is_empty() {
            return Ok(Formed::mesh(mesh, transform, is_open));
        }
        let keeps_angles = uniform_scale(&transform.matrix3).is_some();
        let linear = if keeps_angles { DMat3::IDENTITY } else { transform.matrix3 };
        let bits = linear.to_cols_array().map(f64::to_bits);
        let key = MeshKey::Placed(path, number, turned_uv, bits);
        let shaded = match self.made.get(&key) {
            Some(known) => Arc::clone(known),
            None => {
                let made =
                    self.made_here(Mesh { normals: normals(&mesh, &linear), ..(*mesh).clone() }, place)?;
                self.made.insert(key, Arc::clone(&made));
                made
            }
        };
        Ok(Formed::mesh(shaded, transform, is_open))
    }
}

/// The vertex normals, in the mesh's space, of the mesh after a linear transform.
fn normals(mesh: &Mesh, linear: &DMat3) -> Vec<[f32; 3]> {
    let placed = |i: u32| *linear * DVec3::from(mesh.positions[i as usize].map(f64::from));
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for &corners in &mesh.triangles {
        let [a, b, c] = corners.map(placed);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for (i, [own, next, last]) in [[a, b, c], [b, c, a], [c, a, b]].into_iter().enumerate() {
            let (to_next, to_last) = ((next - own).normalize_or_zero(), (last - own).normalize_or_zero());
            // Kahan's formula, which is accurate for small angles.
            let angle = 2.0 * libm::atan2((to_next - to_last).length(), (to_next + to_last).length());
            sums[corners[i] as usize] += normal * angle;
        }
    }
    // The inverse of the transform of normals: n = M⁻ᵀn₀ in the world, so n₀ = Mᵀn. A mirror image reverses the order
    // of corners.
    let turned = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
    let back = |sum: DVec3| (linear.transpose() * sum * turned).normalize_or_zero().as_vec3().to_array();
    sums.into_iter().map(back).collect()
}

/// Whether an edge of the mesh belongs to only one triangle.
fn has_border(mesh: &Mesh) -> bool {
    if mesh.triangles.len() > MOST_EDGES / 3 || mesh.positions.len() > MOST_EDGES {
        return false;
    }
    // Vertices at the same position count as one. Files split them where uv or normals differ.
    let mut places = HashMap::new();
    let place_of: Vec<usize> = mesh
        .positions
        .iter()
        .map(|position| {
            let next = places.len();
            *places.entry(position.map(|x| (x + 0.0).to_bits())).or_insert(next)
        })
        .collect();
    let mut edges: HashMap<[usize; 2], i32> = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (from, to) = (place_of[from as usize], place_of[to as usize]);
            let (edge, way) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            if from != to {
                *edges.entry(edge).or_default() += way;
            }
        }
    }
    edges.values().any(|&ways| ways != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn borders_are_found() {
        let closed = tetrahedron();
        assert!(!has_border(&closed));
        let mut open = closed.clone();
        open.triangles.pop();
        assert!(has_border(&open));
        // The same mesh with vertices split at their positions.
        let mut parted = closed.clone();
        parted.positions.push([0.0, -0.0, 1.0]);
        parted.triangles[3][2] = 4;
        assert!(!has_border(&parted));
        let mut turned = closed;
        turned.triangles[0].swap(0, 1);
        assert!(has_border(&turned));
    }

    #[test]
    fn normals_are_weighted_by_angles_and_those_of_where_a_mesh_stands() {
        let mesh = tetrahedron();
        let own = normals(&mesh, &DMat3::IDENTITY);
        let at_origin = DVec3::from(own[0].map(f64::from));
        assert!((at_origin - DVec3::splat(-1.0).normalize()).length() < 1e-6, "{at_origin}");
        // The normals of a transformed mesh equal those that are computed from the transformed triangles.
        let linear = DMat3::from_diagonal(DVec3::new(1.0, 2.0, -3.0));
        let mut placed = mesh.clone();
        for position in &mut placed.positions {
            *position = (linear * DVec3::from(position.map(f64::from))).as_vec3().to_array();
        }
        placed.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        let there = normals(&placed, &DMat3::IDENTITY);
        for (own, there) in normals(&mesh, &linear).into_iter().zip(there) {
            let taken = super::super::transform::normal(&linear, DVec3::from(own.map(f64::from)));
            assert!((taken - DVec3::from(there.map(f64::from))).length() < 1e-5, "{taken} {there:?}");
        }
    }
}
