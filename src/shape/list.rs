//! The list of shapes.

use super::mesh::Mesh;
use super::{Piece, ShapeParameters};
use crate::parameter::family;
use glam::DAffine3;
use std::sync::Arc;

family! {
    /// A shape, as a scene describes it.
    pub enum AnyShape {
        Plane(plane::PlaneParameters),
        Sphere(sphere::SphereParameters),
        Quad(quad::QuadParameters),
        Disk(disk::DiskParameters),
        Cylinder(cylinder::CylinderParameters),
        Box(cuboid::BoxParameters),
        ;
        /// Triangles; outward is their counter-clockwise side.
        Mesh {
            /// The triangles, in the space of their file. Entities with the same file share them.
            mesh: Arc<Mesh>,
            /// The transform from there to world space; it is invertible.
            transform: DAffine3,
        },
    }

    /// The pieces that rays are tested against; none for a mesh, whose triangles are stored separately.
    pub fn pieces(&self) -> Vec<Piece> = shape => shape.pieces(), else Vec::new();
}
