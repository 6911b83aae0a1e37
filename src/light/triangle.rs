//! The light-emitting triangle.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::flat;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Rgb, Vec3};
use crate::sampling::warp;
use crate::shape::Sides;

/// The corners of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle(pub [[f32; 3]; 3]);

impl AreaLight<Triangle> {
    /// Both edges from the first corner, and the normal of the emitting side. A triangle without area emits no light
    /// and is never chosen.
    fn geometry(&self) -> (Sides<f32>, [Vec3<f32>; 2], [f32; 3]) {
        let [a, b, c] = self.shape.0.map(Vec3::<f32>::splat);
        let (u, v) = (b - a, c - a);
        let sides = Sides::new(u, v);
        let normal = match sides.area() > 0.0 {
            true => sides.across * (1.0 / sides.length),
            false => Vec3::splat([0.0, 0.0, 1.0]),
        };
        (sides, [u, v], self.facing(array(normal)))
    }
}

fn array(v: Vec3<f32>) -> [f32; 3] {
    [v.x, v.y, v.z]
}

/// Sampled uniformly by area.
impl Light for AreaLight<Triangle> {
    const IS_FREQUENT: bool = true;

    fn row(&self) -> LightRow {
        let (sides, edges, normal) = self.geometry();
        let [edge_u, edge_v] = edges.map(array);
        LightRow {
            origin: self.shape.0[0],
            edge_u,
            edge_v,
            normal,
            area: sides.area(),
            error: sides.error(Vec3::splat(self.shape.0[0])),
            inward: self.flipped,
            emission: self.emission,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        let (sides, _, normal) = self.geometry();
        Some(flat::bounds(&self.shape.0, normal, sides.area(), self.emission))
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        flat::sample(lights, lights.edges(), p, emission, warp::triangle(u), None)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        flat::emit(lights, emission, warp::triangle([a, b]), [c, d])
    }
}
