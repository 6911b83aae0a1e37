//! Where the nodes of a glTF document put its meshes.

use super::document::{Document, Node};
use glam::{DAffine3, DMat4, DQuat, DVec3};

/// A mesh where a node puts it.
pub(super) struct Placed {
    pub(super) mesh: usize,
    pub(super) node: usize,
    /// From the mesh's space to the file's.
    pub(super) to_world: DAffine3,
}

/// The meshes of the document's scene, in the order in which their nodes are found.
///
/// Nodes are a forest: one that is met twice would make a tree without end, or as large as it likes.
pub(super) fn meshes(document: &Document) -> Result<Vec<Placed>, String> {
    let nodes = &document.nodes;
    let roots = match document.scene.or((!document.scenes.is_empty()).then_some(0)) {
        Some(scene) => match document.scenes.get(scene) {
            Some(scene) => scene.nodes.clone(),
            None => {
                return Err(format!("scene {scene} is shown, but there are only {}", document.scenes.len()));
            }
        },
        // Without scenes, whatever is no child.
        None => {
            let mut is_child = vec![false; nodes.len()];
            let children = nodes.iter().flat_map(|node| &node.children);
            children.for_each(|&child| is_child.get_mut(child).into_iter().for_each(|is| *is = true));
            (0..nodes.len()).filter(|&node| !is_child[node]).collect()
        }
    };
    let mut placed = Vec::new();
    let mut met = vec![false; nodes.len()];
    let mut waiting: Vec<(usize, DAffine3)> =
        roots.into_iter().rev().map(|root| (root, DAffine3::IDENTITY)).collect();
    while let Some((at, above)) = waiting.pop() {
        let Some(node) = nodes.get(at) else {
            return Err(format!("there is a node {at}, but there are only {}", nodes.len()));
        };
        if std::mem::replace(&mut met[at], true) {
            return Err(format!("node {at} has more than one parent, or is its own"));
        }
        let own = transform(node).ok_or_else(|| format!("node {at} has a transform that is not finite"))?;
        let to_world = above * own;
        if !to_world.is_finite() {
            return Err(format!("node {at} is moved beyond all numbers"));
        }
        if let Some(mesh) = node.mesh {
            placed.push(Placed { mesh, node: at, to_world });
        }
        waiting.extend(node.children.iter().rev().map(|&child| (child, to_world)));
    }
    Ok(placed)
}

/// A node's own transform.
fn transform(node: &Node) -> Option<DAffine3> {
    let transform = match node.matrix {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(&matrix)),
        None => {
            let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
            // Rounded ones are not quite of length one.
            let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { return None };
            DAffine3::from_scale_rotation_translation(
                DVec3::from(node.scale.unwrap_or([1.0; 3])),
                rotation,
                DVec3::from(node.translation.unwrap_or_default()),
            )
        }
    };
    transform.is_finite().then_some(transform)
}
