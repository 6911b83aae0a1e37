//! Trees of boxes, by which a ray is tested against a few surfaces only.
//!
//! Boxes are grown by the error bound of a hit, so that no hit is missed: the hits have the bits of those of
//! [`Simple`](super::Simple).

mod build;
mod node;
#[cfg(test)]
mod tests;
mod traverse;
mod tree;

pub use self::node::{Contents, WIDTH};
pub use self::tree::{Boxes, Bvh};
