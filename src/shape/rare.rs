//! What most scenes have none of.

use super::{Bounds, Cylinder, Disk, Shape, Surface};
use crate::math::{Float, Ray};

/// A shape of which most scenes have none: all of these are asked in one place, which rays pass by where there are
/// none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rare {
    /// A disk.
    Disk(Disk),
    /// A cylinder.
    Cylinder(Cylinder),
}

impl Shape for Rare {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        match self {
            Rare::Disk(disk) => disk.intersect(ray),
            Rare::Cylinder(cylinder) => cylinder.intersect(ray),
        }
    }

    fn bounds(&self) -> Bounds {
        match self {
            Rare::Disk(disk) => disk.bounds(),
            Rare::Cylinder(cylinder) => cylinder.bounds(),
        }
    }

    fn surface(&self) -> Surface {
        match self {
            Rare::Disk(disk) => disk.surface(),
            Rare::Cylinder(cylinder) => cylinder.surface(),
        }
    }
}
