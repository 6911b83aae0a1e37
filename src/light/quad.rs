//! The light-emitting quad.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::flat;
use super::rectangle::Rectangle;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Mask, Rgb, Vec3};
use crate::shape::{Quad, Shape};

/// Rectangles of at least this solid angle, in steradians, are sampled by solid angle. A smaller solid angle, computed
/// as a sum of angles, has lost too many digits, and sampling by area is about as good.
pub const LEAST_SOLID_ANGLE: f32 = 0.03;

/// A quad counts as a rectangle if the cosine between its sides is at most this.
const SQUARE: f32 = 1e-6;

/// A rectangle is sampled uniformly by its solid angle from the point, unless that is small. Other quads are sampled
/// uniformly by area.
impl Light for AreaLight<Quad> {
    const HAS_OWN_PDF: bool = true;
    const IS_FREQUENT: bool = true;

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
        let square = lights.square();
        let (at, by_angle, pdf) = F::guard(
            square,
            (u, F::Mask::splat(false), F::zero()),
            #[inline(always)]
            || {
                let rectangle = Rectangle::new(lights.origin - p, edges[0], edges[1]);
                let by_angle = square & rectangle.solid_angle.ge(F::splat(LEAST_SOLID_ANGLE));
                let at = F::branch(
                    by_angle,
                    u,
                    #[inline(always)]
                    || rectangle.sample(u),
                );
                (at, by_angle, F::splat(1.0) / rectangle.solid_angle)
            },
        );
        flat::sample(lights, edges, p, emission, at, Some((by_angle, pdf)))
    }

    #[inline(always)]
    fn pdf<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        _on: Vec3<F>,
        _t: F,
        _cos_light: F,
        by_area: F,
    ) -> F {
        let [u, v] = lights.edges();
        let square = lights.square();
        F::guard(
            square,
            by_area,
            #[inline(always)]
            || {
                let solid_angle = Rectangle::new(lights.origin - p, u, v).solid_angle;
                let by_angle = square & solid_angle.ge(F::splat(LEAST_SOLID_ANGLE));
                F::select(by_angle, F::splat(1.0) / solid_angle, by_area)
            },
        )
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        flat::emit(lights, emission, [a, b], [c, d])
    }
}
