//! The choice of meshes that are stored once and instanced.

use super::Instances;
use crate::scene::{self, Scene};
use crate::shape::Mesh;
use std::collections::HashMap;
use std::sync::Arc;

/// The number of triangles in all copies of a mesh from which it is stored once. Smaller meshes are traversed faster as
/// copies in one tree.
pub const SHARING_PAYS_FROM: usize = 1 << 16;

/// The shared mesh of each entity, if it has one. A mesh is shared if it has several copies with enough triangles in
/// total and does not emit. Emissive triangles are chosen one by one, so each needs its own position.
pub(super) fn shared(scene: &Scene, from: usize) -> (Vec<&Mesh>, Vec<Option<usize>>) {
    let could = |entity: &scene::Entity| match &entity.shape {
        scene::Shape::Mesh { mesh, transform }
            if entity.within.is_none() && !entity.emits() && Instances::can_place(transform) =>
        {
            Some(Arc::as_ptr(mesh))
        }
        _ => None,
    };
    let mut copies = HashMap::new();
    for mesh in scene.entities.iter().filter_map(could) {
        *copies.entry(mesh).or_insert(0_usize) += 1;
    }
    let (mut meshes, mut numbers) = (Vec::new(), HashMap::new());
    let of_entity = scene.entities.iter().map(|entity| {
        let (pointer, scene::Shape::Mesh { mesh, .. }) = (could(entity)?, &entity.shape) else { return None };
        let copies = copies[&pointer];
        let pays = copies > 1 && copies.saturating_mul(mesh.triangles.len()) >= from;
        pays.then(|| {
            *numbers.entry(pointer).or_insert_with(|| {
                meshes.push(&**mesh);
                meshes.len() - 1
            })
        })
    });
    let of_entity = of_entity.collect();
    (meshes, of_entity)
}
