//! The world that finds its way to what a ray may meet: a tree of boxes.
//!
//! Boxes are grown by the error of a hit, so that the tree never hides what a shape would answer: its hits have
//! the bits of [`Simple`](super::Simple)'s.

mod build;
mod node;
#[cfg(test)]
mod tests;
mod traverse;
mod tree;

pub use self::node::{Contents, WIDTH};
pub use self::tree::{Boxes, Bvh};
