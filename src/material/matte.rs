//! Matte.

use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, parameters};

parameters! {
    /// Scatters evenly, on both sides.
    pub struct MatteParameters: "matte", "a matte material" {
        /// The fraction of light that is reflected: red, green, blue, each 0 to 1.
        reflectance: Colour = FRACTION,
    }
}
