//! The emission of surfaces.

use super::{SurfacePoint, SurfaceTable};
use crate::math::{Float, Rgb, Uint};

impl SurfaceTable {
    /// Whether the emission of any surface is a texture.
    #[inline(always)]
    pub fn has_textured_emission(&self) -> bool {
        self.has_textured_emission
    }

    /// The textures of the emission at points, or [`NO_TEXTURE`](crate::texture::NO_TEXTURE).
    #[inline(always)]
    pub fn emission_texture<F: Float>(&self, point: &SurfacePoint<F>) -> F::Uint {
        F::Uint::gather(&self.emission_texture, point.row)
    }

    /// Radiance that surfaces emit on their outward sides, W·m⁻²·sr⁻¹, where it is no texture.
    #[inline(always)]
    pub fn emission<F: Float>(&self, point: &SurfacePoint<F>) -> Rgb<F> {
        Rgb::gather(&self.emission, point.row)
    }
}
