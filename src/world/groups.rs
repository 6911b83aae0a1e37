//! The groups of a scene, which are stored once, and their instances.

use super::attributes::SurfaceAttributes;
use super::instances::{Instances, Members};
use super::surface_list::Surfaces;
use super::surfaces::SurfaceTable;
use crate::scene::{self, Entity, Scene};
use crate::shape::{Mesh, Piece, Shape};
use glam::DAffine3;

/// The transforms of all instances of the groups of a scene.
pub(super) struct GroupPlacements {
    /// For each group, the transforms from its space to the world.
    pub(super) of_group: Vec<Vec<DAffine3>>,
    /// See [`Scene::written_out`].
    pub(super) written_out: Vec<bool>,
}

impl GroupPlacements {
    pub(super) fn of(scene: &Scene) -> GroupPlacements {
        let places = scene.group_places();
        let mut of_group = vec![Vec::new(); scene.groups.len()];
        places.iter().for_each(|place| of_group[place.group].push(place.transform));
        GroupPlacements { of_group, written_out: scene.written_out(&places) }
    }
}

/// The stored surfaces of each group. Groups without stored surfaces or without instances are left out.
#[derive(Default)]
pub(super) struct Groups<'a> {
    /// For each group of the scene its index among the stored groups.
    numbers: Vec<Option<usize>>,
    members: Vec<Members>,
    /// The meshes of each group, whose triangles follow those in the world.
    meshes: Vec<Vec<(&'a Mesh, &'a DAffine3, SurfaceAttributes)>>,
}

impl<'a> Groups<'a> {
    /// The groups of a scene, without their surfaces.
    pub(super) fn of(scene: &Scene, places: &GroupPlacements) -> Groups<'a> {
        let mut groups = Groups { numbers: vec![None; scene.groups.len()], ..Groups::default() };
        for (entity, is_written_out) in scene.entities.iter().zip(&places.written_out) {
            if let Some(group) = entity.within
                && !is_written_out
                && !places.of_group[group].is_empty()
                && groups.numbers[group].is_none()
            {
                groups.numbers[group] = Some(groups.members.len());
                groups.members.push(Members::default());
                groups.meshes.push(Vec::new());
            }
        }
        groups
    }

    /// The number of stored groups.
    pub(super) fn len(&self) -> usize {
        self.members.len()
    }

    /// Adds an entity to its group, unless the group is not stored. The entity cannot be a sampled light.
    pub(super) fn add(
        &mut self,
        group: usize,
        entity: &'a Entity,
        attributes: SurfaceAttributes,
        table: &mut SurfaceTable,
    ) {
        let Some(number) = self.numbers[group] else { return };
        if let scene::Shape::Mesh { mesh, transform } = &entity.shape {
            self.meshes[number].push((mesh, transform, attributes));
        }
        let members = &mut self.members[number];
        for piece in entity.shape.pieces() {
            match piece {
                Piece::Sphere(sphere) => {
                    members.spheres.push((sphere, table.push(sphere.surface(), attributes)))
                }
                Piece::Quad(quad) => members.quads.push((quad, table.push(quad.surface(), attributes))),
                Piece::Custom(custom) => {
                    members.custom.push((custom, table.push(custom.surface(), attributes)))
                }
                // Checked scenes have no planes in groups.
                Piece::Plane(_) => {}
            }
        }
    }

    /// Adds the triangles of the groups, and adds the groups and their instances to `instances`. No triangles in world
    /// space may follow them.
    pub(super) fn place(self, places: &GroupPlacements, made: &mut Surfaces, instances: &mut Instances) {
        for meshes in self.meshes {
            let first = made.triangles.len();
            for (mesh, transform, attributes) in meshes {
                let row = made.table.push_mesh(attributes, 0);
                made.triangles.push_grouped(mesh, transform, row);
            }
            instances.meshes.push(first..made.triangles.len());
        }
        instances.groups = self.members;
        for (number, of_group) in self.numbers.iter().zip(&places.of_group) {
            if let Some(number) = number {
                of_group.iter().for_each(|place| instances.push_group(*number, place));
            }
        }
    }
}
