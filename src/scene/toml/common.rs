//! Value forms shared by several tables.

use super::value::{Colour, Direction, NonZero, Vector};
use crate::parameter::limits;

pub(super) const POINT: Vector = Vector(limits::COORDINATE);
pub(super) const DIRECTION: Direction = Direction(NonZero(POINT));
pub(super) const RADIANCE: Colour = Colour(limits::RADIANCE);
