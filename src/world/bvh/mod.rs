//! Bounding volume hierarchies, by which a ray is tested against few surfaces.
//!
//! Boxes are enlarged by the error bound of a hit, so that no hit is missed: hits are identical to the bit with those
//! of [`Simple`](super::Simple).

mod build;
mod node;
#[cfg(test)]
mod tests;
mod traverse;
mod tree;

pub use self::node::{Contents, WIDTH};
pub use self::tree::{Boxes, Bvh};
