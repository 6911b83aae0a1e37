//! Groups of surfaces that are kept once and stand at many places.

use glam::DAffine3;

/// A group of surfaces, in a space of its own. The entities and instances in it name it by their `within`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Group {
    /// The name that instances use.
    pub name: String,
}

/// A group where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The name that messages use.
    pub name: String,
    /// Index of the group.
    pub group: usize,
    /// From the group's space to the world, or to that of the group that it is within; it can be inverted.
    pub transform: DAffine3,
    /// Index of the group that it is a part of, which comes after its own; of none it stands in the world.
    pub within: Option<usize>,
}

/// The first group at the origin of the world.
impl Default for Instance {
    fn default() -> Self {
        Instance { name: "instance".to_owned(), group: 0, transform: DAffine3::IDENTITY, within: None }
    }
}
