//! Materials, and the scattering functions that they give a point.
//!
//! [`Bxdf`] is the contract that integrators see; `lobes/` has a file for each scattering function; [`MaterialTable`]
//! finds the one of a hit.

mod bsdf;
mod bxdf;
mod kind;
mod lobes;
mod table;

pub use bsdf::Bsdf;
pub use bxdf::{Bxdf, BxdfSample, TransportMode};
pub use kind::Kind;
pub use lobes::{Dielectric, Lambertian, Mirror, fresnel_dielectric};
pub use table::{MaterialTable, Row};
