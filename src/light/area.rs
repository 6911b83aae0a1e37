//! Light-emitting surfaces, independent of their shape.

use super::columns::LaneLights;
use super::sample::EmittedRay;
use crate::math::{Float, Frame, Ray, Rgb, Vec3};
use crate::sampling::warp;
use crate::shape::POSITION_ERROR;

/// A surface of finite area that emits the same radiance from every point of one side in every direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight<S> {
    /// The surface.
    pub shape: S,
    /// Whether the emitting side is the inward one.
    pub flipped: bool,
    /// Radiance in W·m⁻²·sr⁻¹.
    pub emission: [f32; 3],
}

impl<S> AreaLight<S> {
    /// The normal of the emitting side, given that of the surface.
    pub(super) fn facing(&self, normal: [f32; 3]) -> [f32; 3] {
        normal.map(|x| if self.flipped { -x } else { x })
    }
}

/// A ray from a point sampled uniformly by area, in a cosine-distributed direction about the normal `n` of the emitting
/// side.
#[inline(always)]
pub(super) fn emit<F: Float>(
    lights: &LaneLights<'_, F>,
    emission: Rgb<F>,
    point: Vec3<F>,
    n: Vec3<F>,
    u: [F; 2],
) -> EmittedRay<F> {
    let local = warp::cosine_hemisphere(u);
    let off = point.max_abs() * POSITION_ERROR + lights.error();
    EmittedRay {
        ray: Ray::new(point + n * off, Frame::around(n).to_world(local)),
        cos: local.z,
        radiance: emission,
        pdf_position: F::splat(1.0) / lights.area(),
        pdf_direction: warp::cosine_hemisphere_pdf(local.z),
    }
}
