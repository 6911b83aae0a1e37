//! A material whose values no sample may have.

use crate::parameter::parameters;

parameters! {
    /// Returns NaN, infinity and −1 in turn: for testing that samples are rejected.
    pub struct BrokenParameters: "broken", "a broken material" {}
    hidden = true;
}
