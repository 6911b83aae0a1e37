//! Converted shapes.

use crate::scene::description::{Mesh, Shape};
use glam::DAffine3;
use std::sync::Arc;

/// A converted shape, and its differences from the original.
pub(super) struct Formed {
    pub(super) shape: Shape,
    /// Whether the normal points to the other side than in Mitsuba.
    pub(super) turned: bool,
    /// Whether the surface has a border, so that its back may be visible.
    pub(super) is_open: bool,
    /// An alternative in a local space, with the uv of Mitsuba: the shape, its transform to the world, and whether it
    /// is the only conversion that is possible.
    pub(super) local: Option<(Shape, DAffine3, bool)>,
    /// How the uv differ from those of Mitsuba, if they do.
    pub(super) uv: Option<&'static str>,
}

impl Formed {
    pub(super) fn mesh(mesh: Arc<Mesh>, transform: DAffine3, is_open: bool) -> Formed {
        Formed { shape: Shape::Mesh { mesh, transform }, turned: false, is_open, local: None, uv: None }
    }
}
