//! Common code of light-emitting flat surfaces.

use super::area;
use super::bounds::{LightBounds, distance2, grey};
use super::columns::LaneLights;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Bounds, Float, Mask, Rgb, Vec3};
use crate::shape::POSITION_ERROR;
use std::f64::consts::PI;

/// The bounds of a triangle or parallelogram with these corners that emits on the side of `normal`.
pub(super) fn bounds(corners: &[[f32; 3]], normal: [f32; 3], area: f32, emission: [f32; 3]) -> LightBounds {
    let bounds = Bounds::of(corners.iter().copied());
    let count = corners.len() as f64;
    let mean = [0, 1, 2].map(|c| corners.iter().map(|p| f64::from(p[c])).sum::<f64>() / count);
    // The second moment of a triangle is a quarter of that of its corners; of a parallelogram a third.
    let of_corners = corners.iter().map(|p| distance2(p.map(f64::from), mean)).sum::<f64>() / count;
    let share = if corners.len() == 3 { 1.0 / 4.0 } else { 1.0 / 3.0 };
    LightBounds {
        lo: bounds.low,
        hi: bounds.high,
        mean,
        spread: share * of_corners,
        power: PI * f64::from(area) * grey(emission),
        axis: normal,
        cos_o: 1.0,
        ..LightBounds::default()
    }
}

/// The point at the coordinates `at` along the edges of a flat light, seen from `p`. In the lanes of `own`, its density
/// is given there. In others, `at` is uniform by area, and the density by solid angle is distance²/(cos θ·area).
#[inline(always)]
pub(super) fn sample<F: Float>(
    lights: &LaneLights<'_, F>,
    edges: [Vec3<F>; 2],
    p: Vec3<F>,
    emission: Rgb<F>,
    at: [F; 2],
    own: Option<(F::Mask, F)>,
) -> LightSample<F> {
    let normal = lights.normal();
    let on_light = lights.origin + edges[0] * at[0] + edges[1] * at[1];
    let to_light = on_light - p;
    let distance2 = to_light.dot(to_light);
    let wi = to_light * (F::splat(1.0) / distance2.sqrt());
    let cos = -wi.dot(normal);
    let illuminates = cos.gt(F::zero());
    let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + lights.error();
    let mut pdf = distance2 / (cos * lights.area());
    if let Some((lanes, own)) = own {
        pdf = F::select(lanes, own, pdf);
    }
    LightSample {
        wi,
        target: on_light + normal * off,
        radiance: emission.only(illuminates),
        pdf: pdf.only(illuminates),
        delta: F::Mask::splat(false),
        infinite: F::Mask::splat(false),
    }
}

/// A ray from the point at the coordinates `at` along the edges, where `at` is uniform by area.
#[inline(always)]
pub(super) fn emit<F: Float>(
    lights: &LaneLights<'_, F>,
    emission: Rgb<F>,
    at: [F; 2],
    u: [F; 2],
) -> EmittedRay<F> {
    let edges = lights.edges();
    let point = lights.origin + edges[0] * at[0] + edges[1] * at[1];
    area::emit(lights, emission, point, lights.normal(), u)
}
