//! The list of shapes.

use super::mesh::Mesh;
use super::{Described, Piece};
use crate::parameter::family;
use glam::DAffine3;
use std::sync::Arc;

family! {
    /// A form and its place, as a scene describes it.
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
            /// The triangles, in the space of their file. Entities of one file share them.
            mesh: Arc<Mesh>,
            /// From there to the world; it can be inverted.
            transform: DAffine3,
        },
    }

    /// The pieces that rays meet; `None` for a mesh, whose triangles are kept apart.
    pub fn pieces(&self) -> Vec<Piece> = shape => shape.pieces();
}
