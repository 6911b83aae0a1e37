//! Transforms of the nodes of a glTF document, and the meshes of nodes.

use super::buffers::Buffers;
use super::document::{Document, Node};
use super::fault::{Fault, item, only};
use super::room::Room;
use crate::scene::mesh::parts::Parts;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use std::collections::HashMap;

/// A mesh with the transform of its node.
pub(super) struct Placed {
    pub(super) mesh: usize,
    pub(super) node: usize,
    /// The transform from the mesh's space to the file's.
    pub(super) to_world: DAffine3,
}

/// The meshes of the document's scene, in the order in which their nodes are found.
///
/// Nodes must form a forest: a node with two parents could make the tree infinite or exponentially large.
pub(super) fn meshes(document: &Document, parts: &mut Parts<'_>) -> Result<Vec<Placed>, Fault> {
    let nodes = &document.nodes;
    let mut placed = Vec::new();
    let mut met = vec![false; nodes.len()];
    // Nodes with their parent's transform and visibility.
    let mut waiting: Vec<(usize, DAffine3, bool)> =
        roots(document, parts)?.into_iter().rev().map(|root| (root, DAffine3::IDENTITY, true)).collect();
    while let Some((at, above, is_visible)) = waiting.pop() {
        let wrong = |message: &str| Fault::at(format_args!("nodes[{at}]"), message);
        let Some(node) = nodes.get(at) else {
            return Err(wrong(&format!("it is not a node: {}", only(nodes.len()))));
        };
        if std::mem::replace(&mut met[at], true) {
            return Err(wrong("it has more than one parent, or is its own ancestor"));
        }
        let to_world = under(above, node).map_err(wrong)?;
        note(node, at, parts);
        let is_visible = is_visible && node.extensions.visibility.visible;
        match node.mesh {
            Some(mesh) if is_visible => placed.push(Placed { mesh, node: at, to_world }),
            Some(_) => parts.note("meshes of hidden nodes are left out", item(format_args!("nodes[{at}]"))),
            None => {}
        }
        waiting.extend(node.children.iter().rev().map(|&child| (child, to_world, is_visible)));
    }
    for at in (0..nodes.len()).filter(|&at| !met[at] && nodes[at].mesh.is_some()) {
        parts.note("meshes of nodes outside the scene are left out", item(format_args!("nodes[{at}]")));
    }
    Ok(placed)
}

/// The root nodes of the default scene.
fn roots(document: &Document, parts: &mut Parts<'_>) -> Result<Vec<usize>, Fault> {
    let scenes = &document.scenes;
    if let Some(shown) = document.scene.or((!scenes.is_empty()).then_some(0)) {
        let Some(scene) = scenes.get(shown) else {
            return Err(Fault::at(
                format_args!("scene"),
                format!("scene {shown} is the default, but {}", only(scenes.len())),
            ));
        };
        for other in (0..scenes.len()).filter(|&other| other != shown) {
            let message = "scenes other than the default one are left out";
            parts.note(message, item(format_args!("scenes[{other}]")));
        }
        if scene.extensions.environment.is_some() {
            parts.note("lights are left out", item(format_args!("scenes[{shown}]")));
        }
        return Ok(scene.nodes.clone());
    }
    // Without scenes, all nodes that have no parent.
    let mut is_child = vec![false; document.nodes.len()];
    let children = document.nodes.iter().flat_map(|node| &node.children);
    children.for_each(|&child| is_child.get_mut(child).into_iter().for_each(|is| *is = true));
    Ok((0..is_child.len()).filter(|&node| !is_child[node]).collect())
}

/// Adds notes about the parts of a node that are not read.
fn note(node: &Node, at: usize, parts: &mut Parts<'_>) {
    let mut note = |is: bool, message: &str| {
        if is {
            parts.note(message, item(format_args!("nodes[{at}]")));
        }
    };
    note(node.camera.is_some(), "cameras are left out");
    note(node.extensions.light.is_some(), "lights are left out");
    let is_affine = |m: &[f64; 16]| {
        let last = [m[3], m[7], m[11], m[15] - 1.0];
        last.iter().all(|x| x.abs() <= 1e-4)
    };
    let message = "the last row of matrices is read as 0 0 0 1";
    note(node.matrix.as_ref().is_some_and(|matrix| !is_affine(matrix)), message);
}

/// The transform of a node to the file's space, given that of its parent.
fn under(above: DAffine3, node: &Node) -> Result<DAffine3, &'static str> {
    let own = transform(node).ok_or("it has a transform that is not finite")?;
    let to_world = above * own;
    if to_world.is_finite() { Ok(to_world) } else { Err("its transform overflows") }
}

/// A node's own transform.
fn transform(node: &Node) -> Option<DAffine3> {
    let transform = match node.matrix {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix)),
        None => {
            let rotation = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
            moved(
                DVec3::from(node.translation.unwrap_or_default()),
                rotation,
                DVec3::from(node.scale.unwrap_or([1.0; 3])),
            )?
        }
    };
    transform.is_finite().then_some(transform)
}

/// A transform that scales, then rotates by a quaternion, then translates.
fn moved(translation: DVec3, rotation: [f64; 4], scale: DVec3) -> Option<DAffine3> {
    let rotation = DQuat::from_array(rotation);
    // Rounded ones are not quite of length one.
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { return None };
    Some(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// The rest pose of nodes, whether or not they are in the scene.
pub(super) struct Rest<'d> {
    nodes: &'d [Node],
    parents: Vec<Parent>,
    known: HashMap<usize, DAffine3>,
}

#[derive(Clone, Copy)]
enum Parent {
    None,
    One(usize),
    Several,
}

impl<'d> Rest<'d> {
    pub(super) fn of(document: &'d Document) -> Self {
        let nodes = &document.nodes[..];
        let mut parents = vec![Parent::None; nodes.len()];
        for (parent, node) in nodes.iter().enumerate() {
            for &child in &node.children {
                let Some(of) = parents.get_mut(child) else { continue };
                *of = match of {
                    Parent::None => Parent::One(parent),
                    Parent::One(_) | Parent::Several => Parent::Several,
                };
            }
        }
        Rest { nodes, parents, known: HashMap::new() }
    }

    /// The transform from a node's own space to the file's.
    pub(super) fn place(&mut self, node: usize) -> Result<DAffine3, Fault> {
        let mut chain = Vec::new();
        let mut next = Some(node);
        let mut above = DAffine3::IDENTITY;
        while let Some(at) = next {
            if let Some(known) = self.known.get(&at) {
                above = *known;
                break;
            }
            let wrong = |message: &str| Fault::at(format_args!("nodes[{at}]"), message);
            next = match self.parents.get(at) {
                None => return Err(wrong(&format!("it is not a node: {}", only(self.nodes.len())))),
                Some(Parent::None) => None,
                Some(&Parent::One(parent)) if chain.len() < self.nodes.len() => Some(parent),
                Some(Parent::One(_) | Parent::Several) => {
                    return Err(wrong("it has more than one parent, or is its own ancestor"));
                }
            };
            chain.push(at);
        }
        while let Some(at) = chain.pop() {
            above = under(above, &self.nodes[at]).map_err(|m| Fault::at(format_args!("nodes[{at}]"), m))?;
            self.known.insert(at, above);
        }
        Ok(above)
    }
}

/// The cost of a copy, in bytes.
const COPY: u64 = 96;

/// The transforms of a node's mesh: a single one, or one for each copy by `EXT_mesh_gpu_instancing`.
pub(super) fn copies(
    document: &Document,
    buffers: &mut Buffers<'_>,
    Placed { node, to_world, .. }: &Placed,
) -> Result<Vec<DAffine3>, String> {
    let Some(copies) = &document.nodes[*node].extensions.copies else { return Ok(vec![*to_world]) };
    let attribute = |name: &str| copies.attributes.get(name).copied();
    let translations = attribute("TRANSLATION").map(|a| buffers.floats::<3>(document, a)).transpose()?;
    let rotations = attribute("ROTATION").map(|a| buffers.floats::<4>(document, a)).transpose()?;
    let scales = attribute("SCALE").map(|a| buffers.floats::<3>(document, a)).transpose()?;
    let vectors = translations.iter().chain(&scales).map(|v| (v.count(), v.replacing()));
    let quaternions = rotations.iter().map(|v| (v.count(), v.replacing()));
    let counts: Vec<_> = vectors.chain(quaternions).collect();
    // Without these attributes all copies coincide.
    let Some(&(count, _)) = counts.first() else { return Ok(vec![*to_world]) };
    if counts.iter().any(|&(other, _)| other != count) {
        return Err("the numbers of translations, rotations and scales of its copies differ".into());
    }
    let replacing = counts.iter().map(|&(_, replacing)| Room::replacing(replacing)).sum::<u64>();
    buffers.room.take(0, 0, COPY * count as u64 + replacing)?;
    let translations = translations.map(|v| v.decode()).transpose()?;
    let rotations = rotations.map(|v| v.decode()).transpose()?;
    let scales = scales.map(|v| v.decode()).transpose()?;
    let copy = |i: usize| {
        let vector = |of: &Option<Vec<[f32; 3]>>, otherwise: f64| match of {
            Some(all) => DVec3::from(all[i].map(f64::from)),
            None => DVec3::splat(otherwise),
        };
        let rotation = rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |all| all[i].map(f64::from));
        let own = moved(vector(&translations, 0.0), rotation, vector(&scales, 1.0));
        let to_world = own.map(|own| *to_world * own).filter(DAffine3::is_finite);
        to_world.ok_or_else(|| format!("copy {i} of its mesh has a transform that is not finite"))
    };
    (0..count).map(copy).collect()
}
