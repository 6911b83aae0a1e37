//! Common limits of parameters.

use super::kind::{Number, ParameterKind};

/// The maximum length: its square, and the inverse of its square, are representable in 32 bits.
pub const LONGEST: f64 = 1e18;
/// The minimum positive length, for the same reason.
pub const SHORTEST: f64 = 1e-18;

/// A coordinate, or another signed length.
pub const COORDINATE: Number = Number::between(-LONGEST, LONGEST);
/// A length above zero.
pub const LENGTH: Number = Number::positive(SHORTEST, LONGEST);
/// A length that may be zero.
pub const DISTANCE: Number = Number::between(0.0, LONGEST);
/// A radiance: the maximum of a film is 2³⁰.
pub const RADIANCE: Number = Number::between(0.0, (1u32 << 30) as f64);
/// A radiant intensity: sufficient for the maximum radiance at any valid distance, in any unit of length.
pub const INTENSITY: Number = Number::between(0.0, LONGEST * LONGEST);

/// A point in space.
pub const POINT: ParameterKind = ParameterKind::Vector(COORDINATE);
/// A displacement between two points.
pub const EDGE: ParameterKind = ParameterKind::NonZero(COORDINATE);
/// A direction, of any length.
pub const DIRECTION: ParameterKind = ParameterKind::Direction(COORDINATE);
/// The reflected or transmitted fraction of each channel.
pub const FRACTION: ParameterKind = ParameterKind::Colour(Number::between(0.0, 1.0));

/// The sine of the angle below which two directions count as parallel: a basis built on them in 32 bits would
/// be inaccurate.
pub const PARALLEL: f64 = 1e-6;
