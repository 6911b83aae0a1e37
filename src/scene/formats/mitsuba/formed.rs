//! What shapes and meshes become.

use crate::scene::description::{Mesh, Shape};
use glam::DAffine3;
use std::sync::Arc;

/// What a shape is, and what is special about it.
pub(super) struct Formed {
    pub(super) shape: Shape,
    /// Whether its normal is turned about, in addition to what the file asks for.
    pub(super) turned: bool,
    /// Whether it has a border, so that its back can be seen.
    pub(super) is_open: bool,
    /// The same shape in a space of its own, whose uv are those in Mitsuba, from where it comes to its place, and whether
    /// it is no such shape otherwise.
    pub(super) local: Option<(Shape, DAffine3, bool)>,
    /// What its uv differ from those in Mitsuba by, if they do.
    pub(super) uv: Option<&'static str>,
}

impl Formed {
    pub(super) fn mesh(mesh: Arc<Mesh>, transform: DAffine3, is_open: bool) -> Formed {
        Formed { shape: Shape::Mesh { mesh, transform }, turned: false, is_open, local: None, uv: None }
    }
}
