//! The limits of values that several tables have in common.

use super::value::{Colour, Direction, NonZero, Number, Vector};

// Lengths whose squares, and the squares of whose inverses, fit 32 bits.
pub(super) const LONGEST: f64 = 1e18;
pub(super) const SHORTEST: f64 = 1e-18;

pub(super) const COORDINATE: Number = Number::between(-LONGEST, LONGEST);
pub(super) const LENGTH: Number = Number::positive(SHORTEST, LONGEST);
pub(super) const DISTANCE: Number = Number::between(0.0, LONGEST);
pub(super) const POINT: Vector = Vector(COORDINATE);
pub(super) const EDGE: NonZero = NonZero(POINT);
pub(super) const DIRECTION: Direction = Direction(EDGE);

// The film holds radiance up to 2³⁰ (design §2).
pub(super) const RADIANCE: Colour = Colour(Number::between(0.0, (1u32 << 30) as f64));

/// The sine of the angle below which two directions count as parallel: a basis built on them in 32 bits would
/// be noise.
pub(super) const PARALLEL: f64 = 1e-6;
