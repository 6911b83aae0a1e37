//! Limits of a scene's values.

/// The longest length: its square, and the square of its inverse, fit 32 bits.
pub const LONGEST: f64 = 1e18;

/// The shortest length likewise.
pub const SHORTEST: f64 = 1e-18;

/// The sine of the angle below which two directions count as parallel: a basis built on them in 32 bits would
/// be noise.
pub const PARALLEL: f64 = 1e-6;

/// The largest radiance: the film holds no more.
pub const MOST_RADIANCE: f64 = (1u32 << 30) as f64;

/// The volume below which a transform counts as flat, as a fraction of the largest that its axes' lengths allow.
pub const FLAT: f64 = 1e-9;

/// The most checkerboards inside each other: the GPU follows them with a bounded loop.
pub const MAX_NESTING: usize = 16;
