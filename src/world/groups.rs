//! The groups of a scene: what is kept once of each, and where it stands.

use super::instances::{Instances, Members};
use super::listing::Surfaces;
use super::look::Look;
use super::surfaces::SurfaceTable;
use crate::scene::{self, Entity, Scene};
use crate::shape::{Mesh, Piece, Shape};
use glam::DAffine3;

/// Where the groups of a scene stand.
pub(super) struct Places {
    /// From each group's space to the world.
    pub(super) of_group: Vec<Vec<DAffine3>>,
    /// See [`Scene::written_out`].
    pub(super) written_out: Vec<bool>,
}

impl Places {
    pub(super) fn of(scene: &Scene) -> Places {
        let places = scene.group_places();
        let mut of_group = vec![Vec::new(); scene.groups.len()];
        places.iter().for_each(|place| of_group[place.group].push(place.transform));
        Places { of_group, written_out: scene.written_out(&places) }
    }
}

/// What is kept once of each group. Groups of which nothing is kept, or that stand nowhere, are left out.
#[derive(Default)]
pub(super) struct Groups<'a> {
    /// For each group of the scene its number among those that are kept.
    numbers: Vec<Option<usize>>,
    members: Vec<Members>,
    /// The meshes of each, whose triangles come after those in the world.
    meshes: Vec<Vec<(&'a Mesh, &'a DAffine3, Look)>>,
}

impl<'a> Groups<'a> {
    /// The groups of a scene, nothing of which is kept yet.
    pub(super) fn of(scene: &Scene, places: &Places) -> Groups<'a> {
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

    /// How many are kept.
    pub(super) fn len(&self) -> usize {
        self.members.len()
    }

    /// Adds an entity to what is kept of its group. It is no light that can be sampled.
    pub(super) fn add(&mut self, group: usize, entity: &'a Entity, look: Look, table: &mut SurfaceTable) {
        let Some(number) = self.numbers[group] else { return };
        if let scene::Shape::Mesh { mesh, transform } = &entity.shape {
            self.meshes[number].push((mesh, transform, look));
        }
        let members = &mut self.members[number];
        for piece in entity.shape.pieces() {
            match piece {
                Piece::Sphere(sphere) => members.spheres.push((sphere, table.push(sphere.surface(), look))),
                Piece::Quad(quad) => members.quads.push((quad, table.push(quad.surface(), look))),
                Piece::Rare(rare) => members.rare.push((rare, table.push(rare.surface(), look))),
                // A scene that is checked has none in groups.
                Piece::Plane(_) => {}
            }
        }
    }

    /// Adds the triangles of the groups, all groups to the instances, and where they stand. No triangles in the world may
    /// come after them.
    pub(super) fn place(self, places: &Places, made: &mut Surfaces, instances: &mut Instances) {
        for meshes in self.meshes {
            let first = made.triangles.len();
            for (mesh, transform, look) in meshes {
                let row = made.table.push_mesh(look, 0);
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
