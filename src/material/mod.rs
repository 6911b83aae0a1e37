//! Materials, and the BxDFs that they choose at a point.

mod bxdf;
mod table;

pub use bxdf::{Bsdf, Bxdf, BxdfSample, Dielectric, Lambertian, Mirror, fresnel_dielectric};
pub use table::{Kind, MaterialTable, Row};
