//! The sphere.

use super::{BOUNDS_ERROR, Bounds, Form, NOTHING, Piece, Shape, ShapeParameters, Surface, UNIT_ROUNDOFF};
use crate::math::{Float, Ray, Vec3, narrow};
use crate::parameter::limits::{LENGTH, POINT};
use crate::parameter::{ParameterKind, parameters};
use glam::DVec3;
use std::f32::consts::PI;

parameters! {
    /// All X with |X − center| = radius; outward is away from the centre.
    pub struct SphereParameters: "sphere", "a sphere" {
        /// The centre of the sphere.
        center: DVec3 = POINT,
        /// The radius of the sphere.
        radius: f64 = ParameterKind::Number(LENGTH),
    }
}

/// A sphere's share of its hits' error bound, for each unit of its anchor's coordinates and, unless it is a
/// wall, of its radius.
///
/// Of w·(w − 2h) each factor, product and sum is rounded once, which leaves the power within 5 roundings of
/// |w|·|w − 2h|, and the distance, power/2r, within 2.5 of r for an ordinary sphere and 5 of |w| for a wall.
/// That happens twice, when the hit is put onto the sphere and when the next ray is tested against it. |w| is at most
/// the hit's and the anchor's distance from the origin; [`super::POSITION_ERROR`] pays for the hit's.
const SPHERE_ERROR: f32 = 8.0 * UNIT_ROUNDOFF;

/// All X with |X − centre| = radius: hollow, so that light can pass (report §2.3.2.1).
///
/// A point's *power* is |X − centre|² − radius²: zero on the sphere. Of a sphere so large that the scene
/// sees it as a wall, that difference loses all the digits that matter: with a radius of 10⁵ it places the
/// wall within 0.02, and paths slip out between two such walls at a corner. So the power of a point X is
/// computed as w·(w − 2h) + k, with w and h from an anchor A to X and to the centre, and k the power of A.
/// An ordinary sphere is anchored in its centre, which makes it |w|² − radius²; a wall in its point nearest
/// to the world's origin, which makes all terms small where the scene is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// The centre.
    pub centre: [f32; 3],
    /// The radius, above zero.
    pub radius: f32,
    /// The anchor A.
    pub anchor: [f32; 3],
    /// h, from the anchor to the centre.
    pub to_centre: [f32; 3],
    /// k, the anchor's power.
    pub anchor_power: f32,
}

impl Sphere {
    /// The sphere of a centre and a radius above zero.
    pub fn new(centre: DVec3, radius: f64) -> Sphere {
        let distance = centre.length();
        // Seen from the origin the nearest point is much nearer than the centre.
        let is_wall = (distance - radius).abs() < 0.25 * radius;
        let anchor = if is_wall { centre * (1.0 - radius / distance) } else { centre };
        // What rounding does to the anchor is known, and goes into its power.
        let anchor = narrow(anchor.to_array());
        let to_centre = if is_wall { centre - DVec3::from(anchor.map(f64::from)) } else { DVec3::ZERO };
        Sphere {
            centre: narrow(centre.to_array()),
            radius: radius as f32,
            anchor,
            to_centre: narrow(to_centre.to_array()),
            anchor_power: (to_centre.length_squared() - radius * radius) as f32,
        }
    }
}

/// The numbers of a sphere for intersections, one sphere a lane or one in all lanes: see [`Sphere`].
#[derive(Clone, Copy, Debug)]
pub struct SphereForm<F> {
    /// The anchor A.
    pub anchor: Vec3<F>,
    /// h, from the anchor to the centre.
    pub to_centre: Vec3<F>,
    /// 2h.
    pub twice_to_centre: Vec3<F>,
    /// k, the anchor's power.
    pub anchor_power: F,
}

impl<F: Float> SphereForm<F> {
    /// The power of the point at `w` from the anchor.
    #[inline(always)]
    fn power(&self, w: Vec3<F>) -> F {
        w.dot(w - self.twice_to_centre) + self.anchor_power
    }

    /// Distance to the first hit: see [`Shape::intersect`].
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray<F>) -> F {
        // t² + 2bt + c = 0 with b = m·d and c = m·m − r², the power of the origin. The discriminant b² − c
        // cancels when the sphere is small and far; the power of the point nearest to the centre does not
        // (Haines, Günther and Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection"),
        // and neither does the smaller root as c/q.
        let w = ray.o - self.anchor;
        let b = (w - self.to_centre).dot(ray.d);
        let c = self.power(w);
        let discriminant = -self.power(w - ray.d * b);
        let root = discriminant.max(F::zero()).sqrt();
        let q = -b - root.copysign(b);
        let (t0, t1) = (c / q, q);
        // One of the roots is negative or the smaller one is nearer; a root at or before the origin is none.
        let (near, far) = (t0.min(t1), t0.max(t1));
        let zero = F::zero();
        let t = F::select(near.gt(zero), near, far);
        let hit = zero.le(discriminant) & t.gt(zero);
        F::select(hit, t, F::splat(NOTHING))
    }

    /// The same along a ray whose direction has any length, in units of that length.
    #[inline(always)]
    pub fn intersect_any_length(&self, ray: &Ray<F>) -> F {
        // at² + 2bt + c = 0 with a = d·d; otherwise as above.
        let w = ray.o - self.anchor;
        let (a, b) = (ray.d.dot(ray.d), (w - self.to_centre).dot(ray.d));
        let c = self.power(w);
        let discriminant = -self.power(w - ray.d * (b / a));
        let root = (discriminant.max(F::zero()) * a).sqrt();
        let q = -b - root.copysign(b);
        let (t0, t1) = (c / q, q / a);
        let (near, far) = (t0.min(t1), t0.max(t1));
        let zero = F::zero();
        let t = F::select(near.gt(zero), near, far);
        let hit = zero.le(discriminant) & t.gt(zero);
        F::select(hit, t, F::splat(NOTHING))
    }
}

impl Sphere {
    /// The numbers for intersections, in all lanes.
    #[inline(always)]
    pub fn form<F: Float>(&self) -> SphereForm<F> {
        SphereForm {
            anchor: Vec3::splat(self.anchor),
            to_centre: Vec3::splat(self.to_centre),
            twice_to_centre: Vec3::splat(self.to_centre.map(|x| 2.0 * x)),
            anchor_power: F::splat(self.anchor_power),
        }
    }
}

impl ShapeParameters for SphereParameters {
    fn pieces(&self) -> Vec<Piece> {
        vec![Piece::Sphere(Sphere::new(self.center, self.radius))]
    }
}

impl Shape for Sphere {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        self.form().intersect(ray)
    }

    fn bounds(&self) -> Bounds {
        let r = self.radius;
        Bounds::of([self.centre.map(|x| x - r), self.centre.map(|x| x + r)]).grown(BOUNDS_ERROR)
    }

    fn surface(&self) -> Surface {
        let largest = |v: [f32; 3]| v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        // How far a point of the sphere can be from the anchor, as far as its coordinates don't tell.
        let is_wall = largest(self.to_centre) > 0.0;
        let reach = if is_wall { 0.0 } else { self.radius };
        Surface {
            form: Form::Round,
            centre: self.centre,
            radius: self.radius,
            anchor: self.anchor,
            to_centre: self.to_centre,
            anchor_power: self.anchor_power,
            normal: [0.0; 3],
            distance: 0.0,
            error: SPHERE_ERROR * (largest(self.anchor) + reach),
            u_axis: [0.0; 4],
            v_axis: [0.0; 4],
            area: 4.0 * PI * self.radius * self.radius,
        }
    }
}
