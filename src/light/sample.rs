//! Samples of lights: a direction towards a light, radiance from infinity, and a ray that leaves a light.

use crate::math::{Float, Frame, Ray, Rgb, Vec3, value};
use crate::sampling::warp;
use crate::shape::POSITION_ERROR;

/// The fraction of its length at which a shadow ray ends; the rest is the error bound of a hit at that distance from
/// the origin.
pub const SHADOW_LENGTH: f32 = 1.0 - POSITION_ERROR;

/// A point on a light, seen from a point in the scene.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<F: Float> {
    /// The direction to the light, of length one.
    pub wi: Vec3<F>,
    /// The point on the light, moved off its surface by its error bound so that the light does not shadow itself. The
    /// bound includes the rounding of the shadow ray's origin. Unspecified for a light at infinity.
    pub target: Vec3<F>,
    /// The radiance from there; for a delta light, irradiance on a surface that faces it, such as intensity over
    /// distance² for a point. Zero if the light does not illuminate the point.
    pub radiance: Rgb<F>,
    /// The density of `wi` by solid angle; 1 for a delta light, which has only one direction.
    pub pdf: F,
    /// Whether no BxDF sample can find this direction: see [`Light::DELTA`](super::Light::DELTA).
    pub delta: F::Mask,
    /// Whether the light is at infinity: see [`Light::INFINITE`](super::Light::INFINITE).
    pub infinite: F::Mask,
}

value!(LightSample { wi, target, radiance, pdf, delta, infinite });

impl<F: Float> LightSample<F> {
    /// The ray from `o` to the light, and the distance before which a hit occludes the light: infinite for a light at
    /// infinity.
    ///
    /// `target` is off the light by the error of a point on it. At a great distance, rounding makes the ray reach the
    /// light too early by some roundings of its length. The ray therefore ends that much before the light.
    #[inline(always)]
    pub fn shadow_ray(&self, o: Vec3<F>) -> (Ray<F>, F) {
        let segment = self.target - o;
        let length = segment.length();
        let (d, distance) = F::branch(
            self.infinite,
            (segment * (F::splat(1.0) / length), length * SHADOW_LENGTH),
            #[inline(always)]
            || (self.wi, F::splat(f32::INFINITY)),
        );
        (Ray::new(o, d), distance)
    }

    /// Radiance over density; black if the density is zero.
    #[inline(always)]
    pub fn weight(&self) -> Rgb<F> {
        (self.radiance * (F::splat(1.0) / self.pdf)).only(self.pdf.gt(F::zero()))
    }
}

/// The radiance of a light at infinity along a ray that leaves the scene.
#[derive(Clone, Copy, Debug)]
pub struct Escaped<F: Float> {
    /// The radiance from there.
    pub radiance: Rgb<F>,
    /// The density by solid angle with which sampling the light would have sampled the ray's direction; zero if it is
    /// never sampled.
    pub pdf: F,
}

value!(Escaped { radiance, pdf });

impl<F: Float> Escaped<F> {
    /// The result for a light that no ray can see.
    #[inline(always)]
    pub fn none() -> Self {
        Escaped { radiance: Rgb::black(), pdf: F::zero() }
    }
}

/// A ray that leaves a light, for paths that start at lights.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay<F: Float> {
    /// From a point on the light, moved off its surface by its error bound.
    pub ray: Ray<F>,
    /// cos θ between the ray and the normal of the emitting side; 1 for a light without a surface.
    pub cos: F,
    /// Radiance along the ray; intensity for a point light, and irradiance for a light at infinity without a size.
    pub radiance: Rgb<F>,
    /// The density of the origin by area; 1 for a point light, which has only one position.
    pub pdf_position: F,
    /// The density of the direction by solid angle, given the origin.
    pub pdf_direction: F,
}

value!(EmittedRay { ray, cos, radiance, pdf_position, pdf_direction });

impl<F: Float> EmittedRay<F> {
    /// A ray from infinity in the direction `d`. It starts on a disk perpendicular to `d` that touches the ball around
    /// the scene (see [`LaneLights::extent`](super::LaneLights::extent)) and has the same radius. The origin is sampled
    /// uniformly with `u` in [0, 1)². The direction has the density 1, unless the caller has sampled it and sets its
    /// density.
    #[inline(always)]
    pub fn from_infinity((centre, radius): (Vec3<F>, F), d: Vec3<F>, radiance: Rgb<F>, u: [F; 2]) -> Self {
        let (x, y) = warp::disk(u);
        let on_disk = Frame::around(d).to_world(Vec3::new(x, y, F::splat(-1.0)));
        EmittedRay {
            ray: Ray::new(centre + on_disk * radius, d),
            cos: F::splat(1.0),
            radiance,
            pdf_position: warp::disk_pdf::<F>() / (radius * radius),
            pdf_direction: F::splat(1.0),
        }
    }

    /// The flux in W that the ray represents: its mean over all rays is the power of the light.
    #[inline(always)]
    pub fn flux(&self) -> Rgb<F> {
        self.radiance * (self.cos / (self.pdf_position * self.pdf_direction))
    }
}
