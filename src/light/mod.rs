//! Lights: how to sample a direction towards one, and which one to ask.

mod bounds;
mod cone;
mod cylinder;
mod lamps;
pub(crate) mod list;
mod point;
mod rectangle;
mod table;
mod tree;

pub use bounds::LightBounds;
pub use lamps::{LEAST_TRIANGLES, Lamp, MeshLamp};
pub use list::*;
pub use point::{PointLight, PointLights};
pub use table::{
    AreaLight, CYLINDER, DISK, LEAST_SOLID_ANGLE, LightRow, LightTable, POINT, QUAD, SPHERE, TRIANGLE,
};
pub use tree::{
    BELOW_ONE, COUNT_FROM, FACING, GREATEST, LEAF, LEAST_SHARE, LightNode, LightTree, NARROW, NEARNESS,
};

use crate::math::{Float, Ray, Rgb, Vec3};
use crate::shape::POSITION_ERROR;

/// The share of its length that a shadow ray has: what is left out is as for a hit so far from the origin.
pub const SHADOW_LENGTH: f32 = 1.0 - POSITION_ERROR;

/// A point on a light, seen from a point in the scene.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<F> {
    /// Direction to the light, of length one.
    pub wi: Vec3<F>,
    /// The point on the light, moved off its surface by its error bound so that the light doesn't shadow
    /// itself. A ray's distance to a surface is off by roundings of its origin, too, which therefore count as well.
    pub target: Vec3<F>,
    /// Radiance from there; for a point light, irradiance on a surface that faces it: intensity over
    /// distance². Zero where the light doesn't shine.
    pub radiance: Rgb<F>,
    /// Density of `wi` by solid angle; 1 for a point light, whose direction is certain.
    pub pdf: F,
}

impl<F: Float> LightSample<F> {
    /// The ray from `o` to the light, and the distance before which something is in the way.
    ///
    /// `target` is moved off the light by the error of a point on it. From far away rounding does more to the ray:
    /// it meets the light too early by some roundings of its length, and ends that much before the light.
    #[inline(always)]
    pub fn shadow_ray(&self, o: Vec3<F>) -> (Ray<F>, F) {
        let segment = self.target - o;
        let length = segment.length();
        (Ray { o, d: segment * (F::splat(1.0) / length) }, length * SHADOW_LENGTH)
    }

    /// Radiance over density; black where the density is zero.
    #[inline(always)]
    pub fn weight(&self) -> Rgb<F> {
        (self.radiance * (F::splat(1.0) / self.pdf)).only(self.pdf.gt(F::zero()))
    }
}
