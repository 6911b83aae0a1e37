//! Lanes: SIMD numbers for many independent paths in one program.
//!
//! Everything on a path (shapes, BxDFs, lights, warps, random streams) is written once, generic over [`Float`], and
//! reads like the mathematics for one number. With `F = f32` it traces a single path; with a wider type it traces four,
//! eight or sixteen at once. A type that records its operations turns the same code into a program for a GPU.
//!
//! | file | what is in it |
//! |---|---|
//! | `number` | [`Mask`], [`Uint`] and [`Float`], which lanes and recorded programs share; [`Value`], structures of them; [`LaneFloat`] and others, for lanes only |
//! | `value` | tuples and arrays as values |
//! | `macros` | `value!` and `function!`: structures, and functions of recorded programs |
//! | `level` | the choice of lanes for a processor |
//! | `scalar`, `sse2`, `avx2`, `avx512` | the lanes of x86-64 |
//! | `portable` | the lanes of other processors, in place of `sse2` |
//!
//! Every operation here is exact or correctly rounded by IEEE 754 and never fused, so that a lane has the same bits at
//! every [`Level`]. That is why there is no `mul_add` and no reciprocal estimate, and why the results of `min` and
//! `max` for NaN are specified.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod level;
mod macros;
mod number;
#[cfg(any(test, not(target_arch = "x86_64")))]
mod portable;
pub mod scalar;
#[cfg(target_arch = "x86_64")]
mod sse2;
#[cfg(test)]
mod tests;
mod value;

pub use level::{Level, UnknownLevel, dispatch};
pub use number::{
    Device, Float, Function, Kernel, LaneFloat, LaneMask, LaneUint, Layout, MAX_LANES, Mask, Part, Uint,
    Value, layout_of,
};

pub(crate) use level::{dispatch_minor, dispatch_paths};
pub(crate) use macros::{function, value};

/// Refuses to gather from a table that is empty, or longer than indices reach. The length is a value, as one that is
/// formatted in place would be written to memory before every gather.
#[cfg(target_arch = "x86_64")]
#[cold]
#[inline(never)]
fn no_table(len: usize) -> ! {
    panic!("a gather from a table of {len} entries")
}

// The lanes of the level `portable`.
#[cfg(not(target_arch = "x86_64"))]
use portable::{Eight, Four};
#[cfg(target_arch = "x86_64")]
use sse2::{Eight, Four};
