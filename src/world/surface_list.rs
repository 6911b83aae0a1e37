//! The surfaces in world space, collected for intersection and for the tables of hits.

use super::attributes::SurfaceAttributes;
use super::surfaces::SurfaceTable;
use super::{Simple, Triangles};
use crate::light::{LightTable, NO_LIGHT};
use crate::scene::{self, Entity};
use crate::shape::{Mesh, Piece, Shape, transformed};
use crate::texture::NO_TEXTURE;
use glam::DAffine3;
use std::ops::Range;

/// The surfaces of a scene so far, and the area lights among them.
#[derive(Default)]
pub(super) struct Surfaces {
    pub(super) table: SurfaceTable,
    pub(super) all: Simple,
    pub(super) triangles: Triangles,
    pub(super) lights: LightTable,
    /// The triangles of the last mesh that emits, and whether its normals are flipped: a candidate for a convex
    /// emitter.
    pub(super) convex_candidate: Option<(Range<usize>, bool)>,
}

impl Surfaces {
    /// Adds a piece of an entity, as a light if it emits.
    pub(super) fn add(&mut self, piece: Piece, mut attributes: SurfaceAttributes) {
        attributes.light = if attributes.emission_texture != NO_TEXTURE {
            self.lights.push_textured(&piece, attributes.flip_normal, attributes.emission_texture)
        } else if attributes.emits() {
            self.lights.push_piece(&piece, attributes.flip_normal, attributes.emission)
        } else {
            NO_LIGHT
        };
        let (all, table) = (&mut self.all, &mut self.table);
        match piece {
            Piece::Plane(plane) => all.planes.push((plane, table.push(plane.surface(), attributes))),
            Piece::Sphere(sphere) => all.spheres.push((sphere, table.push(sphere.surface(), attributes))),
            Piece::Quad(quad) => all.quads.push((quad, table.push(quad.surface(), attributes))),
            Piece::Custom(custom) => all.custom.push((custom, table.push(custom.surface(), attributes))),
        }
    }

    /// Adds a transformed mesh, as lights if it emits.
    pub(super) fn add_mesh(&mut self, mesh: &Mesh, transform: &DAffine3, mut attributes: SurfaceAttributes) {
        let first = self.triangles.push(mesh, transform, self.table.len() as u32);
        let all = first..self.triangles.len();
        if attributes.emission_texture != NO_TEXTURE {
            let triangles: Vec<_> = all.map(|triangle| self.triangles.with_uv(triangle)).collect();
            let texture = attributes.emission_texture;
            attributes.light = self.lights.push_textured_mesh(&triangles, attributes.flip_normal, texture);
        } else if attributes.emits() {
            let corners = all.clone().map(|triangle| self.triangles.positions_of(triangle));
            attributes.light = self.lights.push_mesh(corners, attributes.flip_normal, attributes.emission);
            self.convex_candidate = Some((all, attributes.flip_normal));
        }
        self.table.push_mesh(attributes, first);
    }

    /// Adds an entity of a group that is written out, with the transform of an instance: see
    /// [`scene::Scene::written_out`].
    pub(super) fn add_copy(&mut self, entity: &Entity, place: &DAffine3, attributes: SurfaceAttributes) {
        if let scene::Shape::Mesh { mesh, transform } = &entity.shape {
            return self.add_mesh(mesh, &(*place * *transform), attributes);
        }
        // [`scene::Scene::written_out`] has decided which shapes keep their uv.
        if let Some((pieces, is_turned)) = transformed(&entity.shape, place, false) {
            let attributes =
                SurfaceAttributes { flip_normal: attributes.flip_normal != is_turned, ..attributes };
            pieces.into_iter().for_each(|piece| self.add(piece, attributes));
        }
    }
}
