//! Materials, and the BxDFs that they choose at a point.

mod bxdf;
mod kind;
mod table;

pub use bxdf::{Bsdf, Bxdf, BxdfSample, Dielectric, Lambertian, Mirror, fresnel_dielectric};
pub use kind::Kind;
pub use table::{MaterialTable, Row};
