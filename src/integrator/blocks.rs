//! Which random numbers each decision of each integrator gets, beside those of the camera ray.
//!
//! `whitted` has no blocks: it draws from a [`Stream`](crate::sampling::Stream). What any of them meets of mixed materials
//! and of surfaces with holes is decided by [`VertexBlock::MEETING`](crate::sampling::VertexBlock::MEETING).

/// The blocks of `path` and `path-naive`.
pub mod path {
    use crate::sampling::{Blocks, VertexBlock};

    const BLOCKS: Blocks = Blocks::new(0, 2);

    /// A BxDF's direction (first pair), its lobe (third) and the path's survival (fourth).
    pub const SCATTER: VertexBlock = BLOCKS.each(0);
    /// A point on a light (first pair) and which light (third).
    pub const LIGHT: VertexBlock = BLOCKS.each(1);
}
