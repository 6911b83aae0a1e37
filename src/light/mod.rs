//! Lights, and how to sample a direction towards one.

mod area;
mod point;

pub use area::{QuadLight, SphereLight};
pub use point::{PointLight, PointLights};

use crate::math::{Float, Ray, Rgb, Vec3};

/// A point on a light, seen from a point in the scene.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<F> {
    /// Direction to the light, of length one.
    pub wi: Vec3<F>,
    /// The point on the light, moved off its surface by its error bound so that the light doesn't shadow
    /// itself.
    pub target: Vec3<F>,
    /// Radiance from there over the density by solid angle; for a point light, irradiance on a surface
    /// that faces it: intensity over distance². Zero where the light doesn't shine.
    pub weight: Rgb<F>,
}

impl<F: Float> LightSample<F> {
    /// The ray from `o` to the light, and its length.
    #[inline(always)]
    pub fn shadow_ray(&self, o: Vec3<F>) -> (Ray<F>, F) {
        let segment = self.target - o;
        let length = segment.length();
        (Ray { o, d: segment * (F::splat(1.0) / length) }, length)
    }
}

/// What every light that can be sampled can do.
pub trait Light {
    /// A point on the light as seen from `p`, drawn with `u` in [0, 1)².
    fn sample<F: Float>(&self, p: Vec3<F>, u: [F; 2]) -> LightSample<F>;
}

/// The lights that can be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnyLight {
    /// A point.
    Point(PointLight),
    /// The outward side of a sphere.
    Sphere(SphereLight),
    /// The outward side of a quad.
    Quad(QuadLight),
}

impl Light for AnyLight {
    #[inline(always)]
    fn sample<F: Float>(&self, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        match self {
            AnyLight::Point(light) => light.sample(p, u),
            AnyLight::Sphere(light) => light.sample(p, u),
            AnyLight::Quad(light) => light.sample(p, u),
        }
    }
}
