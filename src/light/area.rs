//! Surfaces that emit, sampled uniformly by area.

use super::{Light, LightSample};
use crate::math::{Float, Rgb, Vec3};
use crate::sampling::warp;
use crate::shape::{POSITION_ERROR, Quad, Shape, Sphere, Surface};

/// The outward side of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// Its form and place.
    pub sphere: Sphere,
    /// Radiance in every direction of the outward side.
    pub emission: [f32; 3],
    /// Whether the outward side is the inside.
    pub flipped: bool,
}

/// The outward side of a quad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadLight {
    /// Its form and place.
    pub quad: Quad,
    /// Radiance in every direction of the outward side.
    pub emission: [f32; 3],
    /// Whether the outward side is where u × v does not point.
    pub flipped: bool,
}

/// The sample of a point on a surface, drawn uniformly by area.
///
/// `normal` is the outward one; `error` bounds how far the point lies off the surface, beside what its
/// coordinates tell. A density of 1/area becomes distance²/(cos θ·area) by solid angle.
#[inline(always)]
fn by_area<F: Float>(
    p: Vec3<F>,
    on_light: Vec3<F>,
    normal: Vec3<F>,
    area: f32,
    error: f32,
    emission: [f32; 3],
) -> LightSample<F> {
    let to_light = on_light - p;
    let distance2 = to_light.dot(to_light);
    let wi = to_light * (F::splat(1.0) / distance2.sqrt());
    let cos = -wi.dot(normal);
    let inverse_pdf = cos.max(F::zero()) * area / distance2;
    let error = on_light.max_abs() * POSITION_ERROR + error;
    LightSample { wi, target: on_light + normal * error, weight: Rgb::splat(emission) * inverse_pdf }
}

impl Light for SphereLight {
    #[inline(always)]
    fn sample<F: Float>(&self, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let outside = warp::uniform_sphere(u);
        let on_light = Vec3::splat(self.sphere.centre) + outside * F::splat(self.sphere.radius);
        let normal = if self.flipped { -outside } else { outside };
        let Surface { area, error, .. } = self.sphere.surface();
        // The point is made from the centre and the radius, however large they are.
        let extent = self.sphere.centre.iter().fold(self.sphere.radius, |m, x| m.max(x.abs()));
        by_area(p, on_light, normal, area, error + extent * POSITION_ERROR, self.emission)
    }
}

impl Light for QuadLight {
    #[inline(always)]
    fn sample<F: Float>(&self, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let (eu, ev) = (Vec3::splat(self.quad.u), Vec3::splat(self.quad.v));
        let on_light = Vec3::splat(self.quad.corner) + eu * u[0] + ev * u[1];
        let normal = Vec3::splat(self.quad.normal);
        let outward = if self.flipped { -normal } else { normal };
        let Surface { area, error, .. } = self.quad.surface();
        by_area(p, on_light, outward, area, error, self.emission)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// The mean of `n²` stratified samples of the irradiance on a surface at the origin facing +z.
    fn irradiance(light: &impl Light, n: u32) -> f64 {
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
            let sample = light.sample(Vec3::<f32>::zero(), u);
            sum += f64::from(sample.weight.r * sample.wi.z.max(0.0));
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn a_sphere_gives_the_irradiance_of_its_cone() {
        // E = π·L·sin²θ for a sphere straight above, sin θ = r/distance.
        let sphere = Sphere::new(DVec3::Z * 4.0, 1.0);
        let light = SphereLight { sphere, emission: [2.0; 3], flipped: false };
        let expected = std::f64::consts::PI * 2.0 / 16.0;
        let got = irradiance(&light, 300);
        assert!((got / expected - 1.0).abs() < 2e-3, "{got} is not {expected}");
        // Of a sphere that emits inwards, the inside of the far half fills the same cone, if nothing is in the
        // way: that the near half is, is for the shadow ray to find.
        let far_side = SphereLight { flipped: true, ..light };
        let got = irradiance(&far_side, 300);
        assert!((got / expected - 1.0).abs() < 2e-3, "{got} is not {expected}");
    }

    #[test]
    fn a_quad_gives_the_irradiance_of_its_form_factor() {
        // The form factor of a unit square 1 above the middle is 4 times that of a corner patch of ½ × ½
        // (Howell, configuration C-13): E = 4L·½·(a/√(1+a²)·atan(b/√(1+a²)) + …), a = b = ½.
        let quad = Quad::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::Y, DVec3::X);
        let light = QuadLight { quad, emission: [1.0; 3], flipped: false };
        let s = 1.25_f64.sqrt();
        let expected = 4.0 * (0.5 / s * (0.5 / s).atan());
        let got = irradiance(&light, 200);
        assert!((got / expected - 1.0).abs() < 1e-4, "{got} is not {expected}");
        assert_eq!(irradiance(&QuadLight { flipped: true, ..light }, 10), 0.0);
    }
}
