//! The light-emitting disk.

use super::area::AreaLight;
use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::flat;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Rgb, Vec3};
use crate::sampling::warp;
use crate::shape::{Disk, Shape};
use std::f64::consts::PI;

/// Sampled uniformly by area.
impl Light for AreaLight<Disk> {
    fn row(&self) -> LightRow {
        let (disk, surface) = (&self.shape, self.shape.surface());
        let [edge_u, edge_v] = disk.radii();
        LightRow {
            origin: disk.centre,
            edge_u,
            edge_v,
            normal: self.facing(disk.normal),
            area: surface.area,
            error: surface.error,
            inward: self.flipped,
            emission: self.emission,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        let (disk, bounds) = (&self.shape, self.shape.bounds());
        let r = f64::from(disk.radius);
        Some(LightBounds {
            lo: bounds.low,
            hi: bounds.high,
            mean: disk.centre.map(f64::from),
            spread: r * r / 2.0,
            power: PI * PI * r * r * grey(self.emission),
            axis: self.facing(disk.normal),
            cos_o: 1.0,
            ..LightBounds::default()
        })
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let (x, y) = warp::disk(u);
        flat::sample(lights, lights.edges(), p, emission, [x, y], None)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let (x, y) = warp::disk([a, b]);
        flat::emit(lights, emission, [x, y], [c, d])
    }
}
