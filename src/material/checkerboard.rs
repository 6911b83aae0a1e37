//! The checkerboard.

use crate::parameter::limits::LENGTH;
use crate::parameter::{Kind, parameters};

parameters! {
    /// Alternates two materials over the surface's uv: `even` is where ⌊u·a⌋ + ⌊v·b⌋ is even, with a and b checks for
    /// each unit.
    pub struct CheckerboardParameters: "checkerboard", "a checkerboard" {
        /// The name of the material where the numbers of the check along u and along v have an even sum.
        even: usize = Kind::Material,
        /// The name of the material elsewhere.
        odd: usize = Kind::Material,
        // On planes the size of checks is a length.
        /// Checks for each unit of uv: one number, or one along u and one along v. A plane's uv are lengths in it.
        checks_per_unit: [f64; 2] = Kind::Pair(LENGTH) => "1",
    }
}
