//! The mirror.

use crate::parameter::limits::FRACTION;
use crate::parameter::{Colour, parameters};

parameters! {
    /// Reflects perfectly, on both sides.
    pub struct MirrorParameters: "mirror", "a mirror" {
        /// The fraction of light that is reflected: red, green, blue, each 0 to 1.
        reflectance: Colour = FRACTION,
    }
}
