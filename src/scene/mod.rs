//! The scene's description: names, units, source lines. One file per format.
//!
//! A [`Scene`] is what a file says, checked: every name is resolved to an index, every number is finite and
//! possible. [`crate::world`] compiles it into what rays meet.

pub mod description;

pub use description::*;
