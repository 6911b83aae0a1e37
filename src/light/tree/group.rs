//! Groups of lights, represented by nodes of the tree.

use crate::light::bounds::LightBounds;

/// A group of lights.
pub(super) struct Group {
    pub(super) bounds: LightBounds,
    /// See [`super::node::Node::far2`].
    pub(super) far2: f32,
    pub(super) units: u32,
    pub(super) first_unit: u32,
    /// The position of its first light in the order of the tree.
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
