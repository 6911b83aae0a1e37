//! Lanes: many independent numbers that march through one program.
//!
//! Everything that lies on a path (shapes, BxDFs, lights, warps, random streams) is written once,
//! generic over [`Float`], and reads like the mathematics for one number. With `F = f32` it traces a
//! single path; with a wider type it traces four, eight or sixteen side by side. A type that records its
//! operations turns the same code into a program for a GPU.
//!
//! | file | what is in it |
//! |---|---|
//! | `number` | [`Mask`], [`Uint`] and [`Float`]: all that lanes and recorded programs share |
//! | `value` | [`Value`]: structures of numbers, and [`value!`](crate::math::value) to make one |
//! | `function` | functions of recorded programs: [`function!`](crate::math::function), and those written by hand |
//! | `lane` | [`LaneMask`], [`LaneUint`] and [`LaneFloat`]: what only lanes have |
//! | `level` | the choice of lanes for a processor |
//! | `scalar`, `portable`, `avx2`, `avx512` | the lanes |
//!
//! Every operation here is exact or correctly rounded by IEEE 754 and never fused, so that a lane holds
//! the same bits at every [`Level`]. That is why there is no `mul_add`, no reciprocal estimate, and why
//! `min` and `max` say what they do with NaN.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod function;
mod lane;
mod level;
mod number;
mod portable;
pub mod scalar;
#[cfg(test)]
mod tests;
mod value;

pub use function::{Device, Function};
pub use lane::{Kernel, LaneFloat, LaneMask, LaneUint, MAX_LANES};
pub use level::{Level, UnknownLevel, dispatch};
pub use number::{Float, Mask, Uint};
pub use value::{Layout, Part, Value, layout_of};

pub(crate) use function::function;
pub(crate) use value::value;
