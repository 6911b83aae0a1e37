//! The blocks of random numbers that integrators use, besides those of the camera ray.
//!
//! `whitted` has no blocks: it draws from a [`Stream`](crate::sampling::Stream). Mixed materials and holes use
//! [`VertexBlock::MATERIAL`](crate::sampling::VertexBlock::MATERIAL) with every integrator.

/// The blocks of `path` and `path-naive`.
pub mod path {
    use crate::sampling::{Blocks, VertexBlock};

    const BLOCKS: Blocks = Blocks::new(0, 2);

    /// Scattering: the direction (first pair), the lobe (third number) and Russian roulette (fourth).
    pub const SCATTER: VertexBlock = BLOCKS.each(0);
    /// Light sampling: the point on the light (first pair) and the choice of the light (third number).
    pub const LIGHT: VertexBlock = BLOCKS.each(1);
}
