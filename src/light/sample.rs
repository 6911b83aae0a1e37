//! Samples of lights: a direction towards a light, radiance from infinity, and a ray that leaves a light.

use crate::math::{Float, Frame, Ray, Rgb, Vec3, value};
use crate::sampling::warp;
use crate::shape::POSITION_ERROR;

/// A shadow ray ends at this share of its length; the rest is the error bound of a hit at that distance from the
/// origin.
pub const SHADOW_LENGTH: f32 = 1.0 - POSITION_ERROR;

/// A point on a light, seen from a point in the scene.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<F: Float> {
    /// Direction to the light, of length one.
    pub wi: Vec3<F>,
    /// The point on the light, moved off its surface by its error bound so that the light doesn't shadow
    /// itself. The bound includes the rounding of the shadow ray's origin. Unspecified for a light at infinity.
    pub target: Vec3<F>,
    /// Radiance from there; for a delta light, irradiance on a surface that faces it: of a point, intensity over
    /// distance². Zero where the light doesn't shine.
    pub radiance: Rgb<F>,
    /// Density of `wi` by solid angle; 1 for a delta light, whose direction is certain.
    pub pdf: F,
    /// Whether no BxDF can find this direction: see [`Light::DELTA`](super::Light::DELTA).
    pub delta: F::Mask,
    /// Whether the light is at infinity: see [`Light::INFINITE`](super::Light::INFINITE).
    pub infinite: F::Mask,
}

value!(LightSample { wi, target, radiance, pdf, delta, infinite });

impl<F: Float> LightSample<F> {
    /// The ray from `o` to the light, and the distance up to which a hit hides the light: infinite for a light at
    /// infinity.
    ///
    /// `target` is moved off the light by the error of a point on it. Over a great distance rounding makes the ray meet
    /// the light too early, by some roundings of its length; so it ends that much before the light.
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

    /// Radiance over density; black where the density is zero.
    #[inline(always)]
    pub fn weight(&self) -> Rgb<F> {
        (self.radiance * (F::splat(1.0) / self.pdf)).only(self.pdf.gt(F::zero()))
    }
}

/// The radiance of a light at infinity along a ray that leaves the scene.
#[derive(Clone, Copy, Debug)]
pub struct Escaped<F: Float> {
    /// Radiance from there.
    pub radiance: Rgb<F>,
    /// Density by solid angle with which sampling the light would have drawn the ray's direction; zero if it is never
    /// drawn.
    pub pdf: F,
}

value!(Escaped { radiance, pdf });

impl<F: Float> Escaped<F> {
    /// That of a light that no ray can see.
    #[inline(always)]
    pub fn nothing() -> Self {
        Escaped { radiance: Rgb::black(), pdf: F::zero() }
    }
}

/// A ray that leaves a light, as paths that start at lights need it.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay<F: Float> {
    /// From a point on the light, moved off its surface by its error bound.
    pub ray: Ray<F>,
    /// cos θ between the ray and the normal of the side that emits; 1 for a light without a surface.
    pub cos: F,
    /// Radiance along the ray; intensity of a point, and what a light at infinity without a size gives in irradiance.
    pub radiance: Rgb<F>,
    /// Density of the origin by area; 1 for a point, whose place is certain.
    pub pdf_position: F,
    /// Density of the direction by solid angle, given the origin.
    pub pdf_direction: F,
}

value!(EmittedRay { ray, cos, radiance, pdf_position, pdf_direction });

impl<F: Float> EmittedRay<F> {
    /// A ray that comes from infinity in the direction `d`, as if it left a disk that touches the ball around the scene
    /// (see [`LaneLights::extent`](super::LaneLights::extent)) and shows it all of its face. The origin is drawn
    /// uniformly with `u` in [0, 1)²; the direction is certain, unless the caller has drawn it and states its density.
    #[inline(always)]
    pub fn from_beyond((centre, radius): (Vec3<F>, F), d: Vec3<F>, radiance: Rgb<F>, u: [F; 2]) -> Self {
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

    /// The flux in W that the ray stands for: its mean over all rays is the power of the light.
    #[inline(always)]
    pub fn flux(&self) -> Rgb<F> {
        self.radiance * (self.cos / (self.pdf_position * self.pdf_direction))
    }
}
