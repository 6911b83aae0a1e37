//! The point at which a texture is evaluated.

use crate::math::{Vec3, value};

/// The properties of a point on which textures and materials may depend.
#[derive(Clone, Copy, Debug)]
pub struct Site<F> {
    /// The point in world space.
    pub p: Vec3<F>,
    /// The surface's coordinates there, or those within a check. Unspecified if the surface's material does not depend
    /// on them.
    pub uv: [F; 2],
    /// The area in uv that a pixel of the camera covers there. It depends only on the point and the camera, so that all
    /// paths see the same surface. Zero for the finest level of pictures; unspecified if uv are.
    pub footprint: F,
}

value!(Site { p, uv, footprint });
