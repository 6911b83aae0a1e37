//! The point at which a texture is looked up.

use crate::math::{Vec3, value};

/// The properties of a point that textures and materials may depend on.
#[derive(Clone, Copy, Debug)]
pub struct Site<F> {
    /// The point in world space.
    pub p: Vec3<F>,
    /// The surface's coordinates there, or those within a check. They are unspecified where the surface's material does
    /// not depend on them.
    pub uv: [F; 2],
    /// The area in uv of what a pixel of the camera covers there. It depends on the point and the camera alone, so that
    /// all paths see one and the same surface. Zero where the finest level of pictures is wanted; unspecified likewise.
    pub footprint: F,
}

value!(Site { p, uv, footprint });
