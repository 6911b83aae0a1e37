//! The light-emitting sphere.

use super::area::{self, AreaLight};
use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, LightSample};
use crate::math::{Float, Frame, Mask, Rgb, Vec3, trig};
use crate::sampling::warp;
use crate::shape::{POSITION_ERROR, Shape, Sphere};
use std::f32::consts::{FRAC_1_PI, PI};

/// From outside it is sampled uniformly within its cone of directions (Pharr, Jakob and Humphreys 2023, §6.2.4). A
/// sphere that emits inwards is sampled uniformly by area.
impl Light for AreaLight<Sphere> {
    const HAS_OWN_PDF: bool = true;
    const IS_FREQUENT: bool = true;

    fn row(&self) -> LightRow {
        let (sphere, surface) = (&self.shape, self.shape.surface());
        // A point on the light is computed from the centre and the radius, however large they are.
        let extent = sphere.centre.iter().fold(sphere.radius, |m, x| m.max(x.abs()));
        LightRow {
            origin: sphere.centre,
            radius: sphere.radius,
            area: surface.area,
            error: surface.error + extent * POSITION_ERROR,
            inward: self.flipped,
            emission: self.emission,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        use std::f64::consts::PI;
        let (centre, r) = (self.shape.centre, self.shape.radius);
        Some(LightBounds {
            lo: centre.map(|c| c - r),
            hi: centre.map(|c| c + r),
            mean: centre.map(f64::from),
            spread: f64::from(r) * f64::from(r),
            power: 4.0 * PI * PI * f64::from(r) * f64::from(r) * grey(self.emission),
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
        let centre = lights.origin;
        let radius = lights.radius();
        let inward = lights.inward();
        let error = lights.error();
        let cone = Cone::new(centre - p, radius);

        // 1 − cos θ is uniform and gives sin² θ without cancellation.
        let versine = u[0] * cone.versine;
        let cos = -versine + 1.0;
        let sin2 = versine * (-versine + 2.0);
        let sin = sin2.max(F::zero()).sqrt();
        let (sin_phi, cos_phi) = trig::sin_cos_turns(u[1]);
        let wi = Frame::around(cone.axis).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, cos));
        let near = cone.distance * cos
            - (radius * radius - cone.distance * cone.distance * sin2).max(F::zero()).sqrt();
        let on_cone = p + wi * near;
        let outer = ((on_cone - centre).normalized(), wi, cone.pdf, cone.outside & !inward);

        // A point on the inner side itself may be rounded to the outside: only points outside by more than the errors
        // of both receive no light.
        let inside = inward & cone.distance.le(radius + error * 4.0);
        let (normal, wi, pdf, illuminates) = F::branch(
            inside,
            outer,
            #[inline(always)]
            || {
                let outwards = warp::uniform_sphere(u);
                let to_light = centre + outwards * radius - p;
                let distance2 = to_light.dot(to_light);
                let back = to_light * (F::splat(1.0) / distance2.sqrt());
                let cos = back.dot(outwards);
                let pdf = distance2 / (cos * (radius * radius * (4.0 * PI)));
                (outwards, back, pdf, cos.gt(F::zero()))
            },
        );
        let on_light = centre + normal * radius;
        let off = on_light.max_abs().max(p.max_abs()) * POSITION_ERROR + error;
        let off = F::select(inward, -off, off);
        LightSample {
            wi,
            target: on_light + normal * off,
            radiance: emission.only(illuminates),
            pdf: pdf.only(illuminates),
            delta: F::Mask::splat(false),
            infinite: F::Mask::splat(false),
        }
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
        let cone = Cone::new(lights.origin - p, lights.radius());
        // A point on the inside of a sphere may be rounded to its outside: `inward` decides, because the ray hit the
        // emitting side.
        F::select(cone.outside & !lights.inward(), cone.pdf, by_area)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let outwards = warp::uniform_sphere([a, b]);
        let point = lights.origin + outwards * lights.radius();
        let n = Vec3::select(lights.inward(), -outwards, outwards);
        area::emit(lights, emission, point, n, [c, d])
    }
}

/// The cone of directions from a point to a sphere.
struct Cone<F: Float> {
    /// The direction to the centre, of length one.
    axis: Vec3<F>,
    /// The distance to the centre.
    distance: F,
    /// 1 − cos of half the opening angle.
    versine: F,
    /// The density of a uniform direction within the cone, by solid angle.
    pdf: F,
    /// Whether the point is outside the sphere; otherwise the other fields are unspecified.
    outside: F::Mask,
}

impl<F: Float> Cone<F> {
    #[inline(always)]
    fn new(to_centre: Vec3<F>, radius: F) -> Self {
        let distance2 = to_centre.dot(to_centre);
        let distance = distance2.sqrt();
        let sin2 = radius * radius / distance2;
        let outside = sin2.lt(F::splat(1.0));
        let cos = (-sin2 + 1.0).max(F::zero()).sqrt();
        // 1 − cos without cancellation, for a distant sphere.
        let versine = sin2 / (cos + 1.0);
        Cone {
            axis: to_centre * (F::splat(1.0) / distance),
            distance,
            versine,
            pdf: F::splat(0.5 * FRAC_1_PI) / versine,
            outside,
        }
    }
}
