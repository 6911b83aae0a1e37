//! Groups of surfaces, which are stored once, and their instances.

use glam::DAffine3;

/// A group of surfaces, in its own space. Its entities and instances refer to it by their field `within`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// The name by which instances refer to it.
    pub name: String,
}

/// An instance of a group.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The name in messages.
    pub name: String,
    /// Index of the group.
    pub group: usize,
    /// The transform from the group's space to the world, or to that of the containing group; it must be invertible.
    pub transform: DAffine3,
    /// Index of the containing group, which must follow its own; `None` in the world.
    pub within: Option<usize>,
}

/// The first group at the origin of the world.
impl Default for Instance {
    fn default() -> Self {
        Instance { name: "instance".to_owned(), group: 0, transform: DAffine3::IDENTITY, within: None }
    }
}
