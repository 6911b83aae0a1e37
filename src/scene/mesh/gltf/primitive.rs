//! The triangles of a primitive, morphed, skinned and placed.

use super::accessors::Indices;
use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::extensions::compressed;
use super::morph::{self, wide};
use super::room::Room;
use super::skin::Skinned;
use crate::math::narrow;
use crate::scene::mesh::parts::{self, Parts};
use crate::shape::{Mesh, MeshError};
use glam::{DAffine3, DVec3};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The modes of primitives.
const LINES_AND_POINTS: std::ops::RangeInclusive<u32> = 0..=3;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// The note about second sets of uv that cannot be read.
const BROKEN_SECOND_UV: &str = "second sets of uv that are invalid are left out";

/// The numbers of items in a primitive that are not read or are repaired, by message.
pub(super) type Counts = BTreeMap<&'static str, u64>;

/// Counts one more item of a message.
fn add_one(counts: &mut Counts, message: &'static str) {
    *counts.entry(message).or_default() += 1;
}

/// The pose of a mesh.
#[derive(Clone)]
pub(super) struct Pose<'p> {
    /// The weights of morph targets.
    pub(super) weights: &'p [f64],
    /// The transform of its node.
    pub(super) to_world: DAffine3,
    /// The joints' transforms, which replace that of the node.
    pub(super) joints: Option<Rc<Vec<DAffine3>>>,
}

/// Adds a primitive's triangles to a part, and counts the items in it that are not read or are repaired.
pub(super) fn add(
    document: &Document,
    buffers: &mut Buffers<'_>,
    primitive: &Primitive,
    pose: &Pose<'_>,
    (to, part): (&mut Parts<'_>, usize),
    counts: &mut Counts,
) -> Result<(), String> {
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    if LINES_AND_POINTS.contains(&mode) {
        add_one(counts, "primitives of points or lines are left out");
        return Ok(());
    }
    if ![TRIANGLES, STRIP, FAN].contains(&mode) {
        return Err(format!("its mode is {mode}, but modes are 0 to 6"));
    }
    let attribute = |name: &str| primitive.attributes.get(name).copied();
    let Some(position) = attribute("POSITION") else {
        add_one(counts, "primitives without positions are left out");
        return Ok(());
    };
    if primitive.extensions.draco.is_some()
        && [Some(position), primitive.indices].iter().flatten().any(|&of| is_elsewhere(document, of))
    {
        return Err(compressed("KHR_draco_mesh_compression"));
    }
    if primitive.targets.is_empty() && is_elsewhere(document, position) {
        return Err(format!(
            "accessor {position} has no buffer view, and all positions would be 0: \
             name the one with the positions, or export the file again"
        ));
    }

    let positions = buffers.floats::<3>(document, position)?;
    let normals = attribute("NORMAL").map(|a| buffers.floats::<3>(document, a)).transpose()?;
    let uv = attribute("TEXCOORD_0").map(|a| buffers.floats::<2>(document, a)).transpose()?;
    let vertices = positions.count();
    // Most scenes have no use for the second set, so that a broken one is no reason to refuse a file.
    let second_uv = attribute("TEXCOORD_1").and_then(|a| {
        let read = buffers.floats::<2>(document, a).ok().filter(|uv| uv.count() == vertices);
        if read.is_none() {
            add_one(counts, BROKEN_SECOND_UV);
        }
        read
    });
    if attribute("COLOR_0").is_some() {
        counts.insert(parts::VERTEX_COLOURS, vertices as u64);
    }
    if normals.as_ref().is_some_and(|n| n.count() != vertices)
        || uv.as_ref().is_some_and(|uv| uv.count() != vertices)
    {
        return Err(format!("it has {vertices} positions, but not as many normals or uv"));
    }
    let indices = primitive.indices.map(|accessor| buffers.indices(document, accessor)).transpose()?;
    let corners = indices.as_ref().map_or(vertices, Indices::count);
    let count = match mode {
        TRIANGLES => corners / 3,
        _ => corners.saturating_sub(2),
    };
    if mode == TRIANGLES && corners % 3 != 0 || mode != TRIANGLES && count == 0 && corners > 0 {
        add_one(counts, "incomplete triangles are left out");
    }
    let replacing = Room::replacing(positions.replacing())
        + Room::replacing(normals.as_ref().map_or(0, |n| n.replacing()))
        + Room::replacing(uv.as_ref().map_or(0, |uv| uv.replacing()))
        + second_uv.as_ref().map_or(0, |uv| Room::replacing(uv.replacing()) + 8 * vertices as u64)
        + Room::replacing(indices.as_ref().map_or(0, Indices::replacing));
    buffers.room.take(vertices, count, replacing)?;

    let positions = positions.decode()?;
    let normals = normals.map(|normals| normals.decode()).transpose()?;
    let uv = uv.map(|uv| uv.decode()).transpose()?;
    let second_uv = second_uv.and_then(|uv| {
        let read = uv.decode().ok();
        if read.is_none() {
            add_one(counts, BROKEN_SECOND_UV);
        }
        read
    });
    let indices = match indices {
        Some(indices) => indices.decode()?,
        None => (0..vertices as u32).collect(),
    };
    if let Some(&index) = indices.iter().find(|&&index| index as usize >= vertices) {
        return Err(format!("it has vertex {index}, but there are only {vertices} (counted from 0)"));
    }
    if primitive.targets.len() != pose.weights.len() && !pose.weights.is_empty() {
        add_one(
            counts,
            "primitives have more or fewer morph targets than weights, and missing weights are 0",
        );
    }
    let morph = morph::offsets(document, buffers, primitive, pose.weights, vertices)?;
    let skinned = match &pose.joints {
        None => None,
        Some(joints) => {
            let skinned = Skinned::of(document, buffers, primitive, vertices, Rc::clone(joints))?;
            if skinned.is_none() {
                add_one(counts, "primitives of skinned meshes without joints are placed by their node");
            }
            skinned
        }
    };

    let rigid = Carrier::of(&pose.to_world);
    let mut first = None;
    let mut all_finite = true;
    let mut mirrored = Vec::with_capacity(if skinned.is_some() { vertices } else { 0 });
    for i in 0..vertices {
        let of_vertex = match &skinned {
            None => None,
            Some(skinned) => {
                let (to_world, repair) = skinned.carries(i)?;
                repair.into_iter().for_each(|repair| add_one(counts, repair.message()));
                Some(Carrier::of(&to_world))
            }
        };
        let carrier = of_vertex.as_ref().unwrap_or(&rigid);
        if of_vertex.is_some() {
            mirrored.push(carrier.mirrors);
        }
        let plus = |v: [f32; 3], offsets: &Option<Vec<DVec3>>| match offsets {
            None => wide(v),
            Some(offsets) => wide(v) + offsets[i],
        };
        let position =
            narrow(carrier.to_world.transform_point3(plus(positions[i], &morph.positions)).to_array());
        all_finite &= position.iter().all(|x| x.is_finite());
        let normal = normals.as_ref().map(|normals| {
            let own = plus(normals[i], &morph.normals);
            let normal = (carrier.turned * own).normalize_or_zero();
            if !own.is_finite() {
                add_one(counts, parts::NO_NORMAL);
            } else if normal == DVec3::ZERO {
                add_one(counts, "normals of length 0 are ignored; shading is flat there");
            }
            narrow(normal.to_array())
        });
        let uv = [&uv, &second_uv].map(|uv| {
            uv.as_ref().map(|uv| {
                parts::uv(uv[i]).unwrap_or_else(|| {
                    add_one(counts, parts::NO_UV);
                    [0.0; 2]
                })
            })
        });
        first.get_or_insert(to.vertex(part, position, normal, uv));
    }
    let first = first.unwrap_or_default();
    let Mesh { positions, triangles, .. } = to.mesh(part);
    // Vertices that no triangle uses need no finite position.
    if !all_finite {
        let is_finite = |&index: &u32| positions[(first + index) as usize].iter().all(|x| x.is_finite());
        if let Some(&index) = indices.iter().find(|index| !is_finite(index)) {
            return Err(MeshError::NotFinite(index as usize, "position").to_string());
        }
    }
    triangles.reserve(count);
    for i in 0..count {
        let corners = match mode {
            TRIANGLES => [3 * i, 3 * i + 1, 3 * i + 2],
            // Every other triangle has the opposite winding.
            STRIP if i % 2 == 1 => [i + 1, i, i + 2],
            STRIP => [i, i + 1, i + 2],
            _ => [0, i + 1, i + 2],
        }
        .map(|corner| indices[corner]);
        let mirrors = match skinned {
            None => rigid.mirrors,
            Some(_) => corners.iter().filter(|&&corner| mirrored[corner as usize]).count() >= 2,
        };
        let [a, b, c] = corners.map(|corner| first + corner);
        triangles.push(if mirrors { [a, c, b] } else { [a, b, c] });
    }
    Ok(())
}

/// A transform, with its effect on normals and on the order of corners.
struct Carrier {
    to_world: DAffine3,
    turned: glam::DMat3,
    mirrors: bool,
}

impl Carrier {
    fn of(to_world: &DAffine3) -> Carrier {
        let matrix = to_world.matrix3;
        Carrier {
            to_world: *to_world,
            turned: matrix.inverse().transpose(),
            mirrors: matrix.determinant() < 0.0,
        }
    }
}

/// Whether an accessor has no data in the file: all of its elements are zero.
fn is_elsewhere(document: &Document, accessor: usize) -> bool {
    let accessor = document.accessors.get(accessor);
    accessor.is_some_and(|accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none())
}
