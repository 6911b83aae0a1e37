//! The bounds of a scene.

use super::{Members, Simple, SurfaceTable};
use crate::math::{Bounds, narrow};
use crate::scene::{self, Scene};
use crate::shape::Shape;
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// The bounds of all bounded surfaces; [`Bounds::NOTHING`] if there is none. Instances contribute the bounds of their
/// boxes.
pub fn extent(scene: &Scene, table: &SurfaceTable, surfaces: &Simple) -> Bounds {
    let shapes = surfaces.spheres.iter().map(|(s, _)| s.bounds());
    let shapes = shapes.chain(surfaces.quads.iter().map(|(q, _)| q.bounds()));
    let shapes = shapes.chain(surfaces.custom.iter().map(|(s, _)| s.bounds()));
    let triangles = (0..surfaces.triangles.placed()).map(|i| surfaces.triangles.bounds(i));
    let mut own = HashMap::new();
    let meshes = (0..surfaces.instances.len()).filter_map(|instance| {
        let row = surfaces.instances.row_of(instance)?;
        let (_, attributes) = table.rows()[row as usize];
        let scene::Shape::Mesh { mesh, transform } = &scene.entities[attributes.entity as usize].shape else {
            return None;
        };
        let own = own.entry(Arc::as_ptr(mesh)).or_insert_with(|| Bounds::of(mesh.positions.iter().copied()));
        let Bounds { low, high } = *own;
        Some(Bounds::of((0..8).map(|corner| {
            let p = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] });
            let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
            narrow(p.to_array())
        })))
    });
    let groups = groups(surfaces);
    shapes
        .chain(triangles)
        .chain(meshes)
        .chain(groups)
        .fold(Bounds::NOTHING, |around, bounds| around.with(&bounds))
}

/// Bounds of the instances of groups.
fn groups(surfaces: &Simple) -> impl Iterator<Item = Bounds> {
    let Simple { instances, triangles, .. } = surfaces;
    let around = |(members, range): (&Members, &Range<usize>)| {
        let Members { spheres, quads, custom } = members;
        let shapes = spheres.iter().map(|(s, _)| s.bounds());
        let shapes = shapes.chain(quads.iter().map(|(q, _)| q.bounds()));
        let shapes = shapes.chain(custom.iter().map(|(r, _)| r.bounds()));
        let shapes = shapes.chain(range.clone().map(|triangle| triangles.bounds(triangle)));
        shapes.fold(Bounds::NOTHING, |around, bounds| around.with(&bounds))
    };
    let own: Vec<_> = instances.groups.iter().zip(&instances.meshes).map(around).collect();
    (0..instances.len()).filter_map(move |instance| {
        let around = own.get(instances.mesh[instance] as usize)?;
        Some(instances.bounds(instance, &[*around]).0)
    })
}
