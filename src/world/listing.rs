//! The surfaces of the world itself, as they are listed for rays and for hits.

use super::look::Look;
use super::surfaces::SurfaceTable;
use super::{Simple, Triangles};
use crate::light::{LightTable, NO_LIGHT};
use crate::scene::{self, Entity};
use crate::shape::{Mesh, Piece, Shape, moved};
use crate::texture::NO_TEXTURE;
use glam::DAffine3;
use std::ops::Range;

/// The surfaces of a scene so far, and the lights that they are.
#[derive(Default)]
pub(super) struct Surfaces {
    pub(super) table: SurfaceTable,
    pub(super) all: Simple,
    pub(super) triangles: Triangles,
    pub(super) lights: LightTable,
    /// The triangles of the last mesh that emits, and whether outward is their other side.
    pub(super) lamp: Option<(Range<usize>, bool)>,
}

impl Surfaces {
    /// Adds a piece of an entity, as a light if it emits.
    pub(super) fn add(&mut self, piece: Piece, mut look: Look) {
        look.light = if look.emission_texture != NO_TEXTURE {
            self.lights.push_textured(&piece, look.flip_normal, look.emission_texture)
        } else if look.emits() {
            self.lights.push_piece(&piece, look.flip_normal, look.emission)
        } else {
            NO_LIGHT
        };
        let (all, table) = (&mut self.all, &mut self.table);
        match piece {
            Piece::Plane(plane) => all.planes.push((plane, table.push(plane.surface(), look))),
            Piece::Sphere(sphere) => all.spheres.push((sphere, table.push(sphere.surface(), look))),
            Piece::Quad(quad) => all.quads.push((quad, table.push(quad.surface(), look))),
            Piece::Rare(rare) => all.rare.push((rare, table.push(rare.surface(), look))),
        }
    }

    /// Adds a mesh where a transform takes it, as lights if it emits.
    pub(super) fn add_mesh(&mut self, mesh: &Mesh, transform: &DAffine3, mut look: Look) {
        let first = self.triangles.push(mesh, transform, self.table.len() as u32);
        let all = first..self.triangles.len();
        if look.emits() {
            let corners = all.clone().map(|triangle| self.triangles.positions_of(triangle));
            look.light = self.lights.push_mesh(corners, look.flip_normal, look.emission);
            self.lamp = Some((all, look.flip_normal));
        }
        self.table.push_mesh(look, first);
    }

    /// Adds an entity of a group that is written out, where the group stands: see [`scene::Scene::written_out`].
    pub(super) fn add_copy(&mut self, entity: &Entity, place: &DAffine3, look: Look) {
        if let scene::Shape::Mesh { mesh, transform } = &entity.shape {
            return self.add_mesh(mesh, &(*place * *transform), look);
        }
        // Which shapes keep their uv has been decided there.
        if let Some((pieces, is_turned)) = moved(&entity.shape, place, false) {
            let look = Look { flip_normal: look.flip_normal != is_turned, ..look };
            pieces.into_iter().for_each(|piece| self.add(piece, look));
        }
    }
}
