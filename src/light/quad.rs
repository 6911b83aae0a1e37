//! The emitting quad.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::flat;
use super::rectangle::Rectangle;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Mask, Rgb, Vec3};
use crate::shape::{Quad, Shape};

/// Rectangles of at least this solid angle, in steradians, are sampled by it. A smaller solid angle, a sum of angles,
/// has lost too many digits, and sampling by area is about as good there.
pub const LEAST_SOLID_ANGLE: f32 = 0.03;

/// A quad counts as a rectangle if the cosine between its sides is at most this.
const SQUARE: f32 = 1e-6;

/// Seen from a point, a rectangle is sampled uniformly by the solid angle that it fills, unless that is small; all
/// others uniformly by area.
impl Light for AreaLight<Quad> {
    fn row(&self) -> LightRow {
        let (quad, surface) = (&self.shape, self.shape.surface());
        let [u, v] = [quad.u, quad.v].map(Vec3::<f32>::splat);
        LightRow {
            origin: quad.corner,
            edge_u: quad.u,
            edge_v: quad.v,
            normal: self.facing(quad.normal),
            area: surface.area,
            error: surface.error,
            inward: self.flipped,
            square: u.dot(v).abs() <= SQUARE * u.length() * v.length(),
            emission: self.emission,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        let [o, u, v] = [self.shape.corner, self.shape.u, self.shape.v];
        let corner = |a: f32, b: f32| [0, 1, 2].map(|c| o[c] + a * u[c] + b * v[c]);
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        let normal = self.facing(self.shape.normal);
        Some(flat::bounds(&corners, normal, self.shape.surface().area, self.emission))
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let edges = lights.edges();
        let seen = by_angle(lights, lights.origin - p, edges);
        let (mut at, mut own) = (u, None);
        if let Some((by_angle, rectangle)) = &seen {
            let [a, b] = rectangle.sample(u);
            at = [F::select(*by_angle, a, u[0]), F::select(*by_angle, b, u[1])];
            own = Some((*by_angle, F::splat(1.0) / rectangle.solid_angle));
        }
        flat::sample(lights, edges, p, emission, at, own)
    }

    #[inline(always)]
    fn pdf<F: Float>(lights: &LaneLights<'_, F>, p: Vec3<F>, _t: F, _cos_light: F) -> Option<(F::Mask, F)> {
        let (by_angle, rectangle) = by_angle(lights, lights.origin - p, lights.edges())?;
        Some((by_angle, F::splat(1.0) / rectangle.solid_angle))
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        flat::emit(lights, emission, [a, b], [c, d])
    }
}

/// The lanes whose light is a rectangle large enough to be sampled by solid angle, if there are any, and the rectangle
/// as seen from the point.
#[inline(always)]
fn by_angle<F: Float>(
    lights: &LaneLights<'_, F>,
    to_corner: Vec3<F>,
    [u, v]: [Vec3<F>; 2],
) -> Option<(F::Mask, Rectangle<F>)> {
    let square = lights.square();
    if !square.any() {
        return None;
    }
    let rectangle = Rectangle::new(to_corner, u, v);
    Some((square & rectangle.solid_angle.ge(F::splat(LEAST_SOLID_ANGLE)), rectangle))
}
