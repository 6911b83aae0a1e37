//! The point at which a texture is evaluated.

use crate::math::{Float, Vec3, value};

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
    /// The second set of uv, which is never that within a check.
    pub second: SecondUv<F>,
}

value!(Site { p, uv, footprint, second });

impl<F: Float> Site<F> {
    /// A site without a second set of uv.
    #[inline(always)]
    pub fn new(p: Vec3<F>, uv: [F; 2], footprint: F) -> Site<F> {
        Site { p, uv, footprint, second: SecondUv::none() }
    }
}

/// The second set of uv at a point. Zero on surfaces without one, and in scenes whose textures do not use it.
#[derive(Clone, Copy, Debug)]
pub struct SecondUv<F> {
    /// The coordinates.
    pub uv: [F; 2],
    /// See [`Site::footprint`].
    pub footprint: F,
}

value!(SecondUv { uv, footprint });

impl<F: Float> SecondUv<F> {
    /// That of surfaces without one.
    #[inline(always)]
    pub fn none() -> SecondUv<F> {
        SecondUv { uv: [F::zero(); 2], footprint: F::zero() }
    }
}
