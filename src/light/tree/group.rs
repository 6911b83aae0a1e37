//! Groups of lights, which nodes of the tree stand for.

use crate::light::bounds::LightBounds;

/// Lights that stay together.
pub(super) struct Group {
    pub(super) bounds: LightBounds,
    /// See [`super::node::Node::far2`].
    pub(super) far2: f32,
    pub(super) units: u32,
    pub(super) first_unit: u32,
    /// The place of its first light in the order of the tree.
    pub(super) first: u32,
    pub(super) lights: u32,
    pub(super) below: Below,
}

/// The parts of a group.
pub(super) enum Below {
    /// One light.
    Light(u32),
    /// The indices of two groups.
    Two(usize, usize),
}
