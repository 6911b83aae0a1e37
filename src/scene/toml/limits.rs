//! The limits of values that several tables have in common.

use super::value::{Colour, Direction, NonZero, Number, Vector};
use crate::scene::description::limits::MOST_RADIANCE;

pub(super) use crate::scene::description::limits::{LONGEST, PARALLEL, SHORTEST};

pub(super) const COORDINATE: Number = Number::between(-LONGEST, LONGEST);
pub(super) const LENGTH: Number = Number::positive(SHORTEST, LONGEST);
pub(super) const DISTANCE: Number = Number::between(0.0, LONGEST);
pub(super) const POINT: Vector = Vector(COORDINATE);
pub(super) const EDGE: NonZero = NonZero(POINT);
pub(super) const DIRECTION: Direction = Direction(EDGE);

pub(super) const RADIANCE: Colour = Colour(Number::between(0.0, MOST_RADIANCE));
