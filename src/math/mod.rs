//! Mathematics: lanes, vectors, rays, frames and deterministic functions.
//!
//! Descriptions (scene, camera set-up) use glam's `f64` vectors; code on a path uses [`Vec3`], whose
//! components are lanes.

pub mod bounds;
pub mod colour;
pub mod columns;
pub mod exp;
pub mod frame;
pub mod lanes;
pub mod ray;
pub mod trig;
pub mod vec3;

pub use bounds::Bounds;
pub use columns::{ColumnReader, narrow, push3};
pub use frame::Frame;
pub use lanes::{Float, LaneFloat, LaneMask, LaneUint, Mask, Uint};
pub(crate) use lanes::{function, value};
pub use ray::Ray;
pub use vec3::{Rgb, Vec3};

/// The largest f32 below one.
pub const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
