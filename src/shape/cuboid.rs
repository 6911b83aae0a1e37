//! The axis-aligned box, made of six quads: [`super::Quad::sides`].

use super::{Piece, Quad, ShapeParameters};
use crate::parameter::limits::{POINT, SHORTEST};
use crate::parameter::{Problem, parameters};
use glam::DVec3;

parameters! {
    /// The six sides of an axis-aligned box; outward is away from its centre.
    pub struct BoxParameters: "box", "a box", "box of six quads", "boxes of six quads" {
        /// The corner of the box with the smallest x, y and z.
        min: DVec3 = POINT,
        /// The corner of the box with the largest x, y and z. On each side uv run from 0 to 1; v runs along z, or along
        /// y on top and bottom.
        max: DVec3 = POINT,
    }
    check = with_an_extent;
}

fn with_an_extent(cuboid: BoxParameters, _: &mut Vec<Problem>) -> Result<BoxParameters, Problem> {
    // Shapes are stored in single precision, in which sides that are far out and close together may coincide.
    let single = |x: f64| f64::from(x as f32);
    let size = |axis: usize| single(cuboid.max[axis]) - single(cuboid.min[axis]);
    if let Some(axis) = (0..3).find(|&axis| size(axis) < SHORTEST) {
        let name = ["x", "y", "z"][axis];
        let swapped = size(axis) < 0.0;
        let why = if swapped { "there min is above it along" } else { "the box has no extent along" };
        let message = format!("max must be above min in each of x, y, z: {why} {name}");
        let remedy = if swapped { "swap the two" } else { "a quad is flat" };
        return Err(Problem { parameter: "max", message, help: Some(remedy.into()) });
    }
    Ok(cuboid)
}

impl ShapeParameters for BoxParameters {
    fn pieces(&self) -> Vec<Piece> {
        Quad::sides(self.min, self.max).map(Piece::Quad).to_vec()
    }
}
