//! Materials, and the scattering functions that they give a point.
//!
//! [`Bxdf`] is the contract that integrators see; `lobes/` has a file for each scattering function; [`MaterialTable`]
//! finds the one of a hit.

mod any;
#[cfg(feature = "broken-material")]
mod broken;
mod bsdf;
mod bxdf;
mod checkerboard;
mod glass;
mod kind;
mod lobes;
mod matte;
mod mirror;
mod table;

pub use any::MaterialKind;
#[cfg(feature = "broken-material")]
pub use broken::BrokenParameters;
pub use bsdf::Bsdf;
pub use bxdf::{Bxdf, BxdfSample, TransportMode};
pub use checkerboard::CheckerboardParameters;
pub use glass::GlassParameters;
pub use kind::Kind;
pub use lobes::{Dielectric, Lambertian, Mirror, fresnel_dielectric};
pub use matte::MatteParameters;
pub use mirror::MirrorParameters;
pub use table::{MaterialTable, Row};
