//! Materials, and the scattering functions that they give a point.
//!
//! [`Bxdf`] is the contract that integrators see; `lobes/` has a file for each scattering function; [`MaterialTable`]
//! finds the one of a hit.

#[cfg(feature = "broken-material")]
mod broken;
mod bsdf;
mod bxdf;
mod checkerboard;
mod glass;
mod kind;
pub(crate) mod list;
mod lobes;
mod matte;
mod mirror;
mod table;

pub use bsdf::Bsdf;
pub use bxdf::{Bxdf, BxdfSample, TransportMode};
pub use kind::Kind;
pub use list::*;
pub use lobes::{Dielectric, Lambertian, Mirror, fresnel_dielectric};
pub use table::{MaterialTable, Row};
