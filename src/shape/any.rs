//! The list of shapes.

use super::cuboid::BoxParameters;
use super::cylinder::CylinderParameters;
use super::disk::DiskParameters;
use super::mesh::Mesh;
use super::plane::PlaneParameters;
use super::quad::QuadParameters;
use super::sphere::SphereParameters;
use crate::parameter::family;
use glam::DAffine3;
use std::sync::Arc;

family! {
    /// A form and its place, as a scene describes it.
    pub enum AnyShape {
        Plane(PlaneParameters),
        Sphere(SphereParameters),
        Quad(QuadParameters),
        Disk(DiskParameters),
        Cylinder(CylinderParameters),
        Box(BoxParameters),
        ;
        /// Triangles; outward is their counter-clockwise side.
        Mesh {
            /// The triangles, in the space of their file. Entities of one file share them.
            mesh: Arc<Mesh>,
            /// From there to the world; it can be inverted.
            transform: DAffine3,
        },
    }
}
