//! Glass.

use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, Kind, Number, parameters};

parameters! {
    /// A smooth dielectric interface; the inside is where the normal does not point.
    pub struct GlassParameters: "glass", "a glass" {
        /// Index of refraction of the inside over the outside: 1.5 for glass in air, 1.33 for water.
        ior: f64 = Kind::Number(Number::positive(1e-3, 1e3)),
        /// Tint of what is reflected.
        reflectance: Colour = FRACTION => "[1, 1, 1]",
        /// Tint of what is transmitted.
        transmittance: Colour = FRACTION => "[1, 1, 1]",
    }
}
