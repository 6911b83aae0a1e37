//! The sphere.

use super::{
    BOUNDS_ERROR, Bounds, NOTHING, Piece, Shape, ShapeParameters, Surface, SurfaceKind, UNIT_ROUNDOFF,
};
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

/// A sphere's contribution to its hits' error bound, per unit of its anchor's coordinates and, unless it is nearly
/// flat, of its radius.
///
/// In w·(w − 2h), each factor, product and sum is rounded once, which gives the power within 5 roundings of
/// |w|·|w − 2h|. The distance, power/2r, is then within 2.5 roundings of r for an ordinary sphere, and within 5 of |w|
/// for a nearly flat one. The error occurs twice: when the hit is projected onto the sphere, and when the next ray is
/// tested against it. |w| is at most the sum of the hit's and the anchor's distances from the origin;
/// [`super::POSITION_ERROR`] covers the hit's.
const SPHERE_ERROR: f32 = 8.0 * UNIT_ROUNDOFF;

/// The points X with |X − centre| = radius: a hollow surface, so that light can pass (report §2.3.2.1).
///
/// The *power* of a point is |X − centre|² − radius², which is zero on the sphere. For a sphere so large that the scene
/// sees it as a wall, that difference loses all significant digits: with a radius of 10⁵ it locates the wall within
/// 0.02, and paths slip out between two such walls at a corner. Therefore the power of a point X is computed as w·(w −
/// 2h) + k. Here w and h are the vectors from an anchor A to X and to the centre, and k is the power of A. The anchor
/// of an ordinary sphere is its centre, which gives |w|² − radius². That of a nearly flat sphere is its point nearest
/// to the world's origin, which keeps all terms small within the scene.
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
        // The nearest point to the origin is much nearer than the centre.
        let is_wall = (distance - radius).abs() < 0.25 * radius;
        let anchor = if is_wall { centre * (1.0 - radius / distance) } else { centre };
        // The rounding error of the anchor is known, and is included in its power.
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

/// The numbers for intersections with spheres, one sphere per lane or the same one in all lanes: see [`Sphere`].
#[derive(Clone, Copy, Debug)]
pub struct SphereLanes<F> {
    /// The anchor A.
    pub anchor: Vec3<F>,
    /// h, from the anchor to the centre.
    pub to_centre: Vec3<F>,
    /// 2h.
    pub twice_to_centre: Vec3<F>,
    /// k, the anchor's power.
    pub anchor_power: F,
}

impl<F: Float> SphereLanes<F> {
    /// The power of the point at `w` from the anchor.
    #[inline(always)]
    fn power(&self, w: Vec3<F>) -> F {
        w.dot(w - self.twice_to_centre) + self.anchor_power
    }

    /// The distance to the first hit: see [`Shape::intersect`].
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray<F>) -> F {
        // t² + 2bt + c = 0 with b = m·d and c = m·m − r², the power of the origin. The discriminant b² − c cancels for
        // a small and distant sphere. The power of the point nearest to the centre does not (Haines, Günther and
        // Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection"), and neither does the smaller root
        // as c/q.
        let w = ray.o - self.anchor;
        let b = (w - self.to_centre).dot(ray.d);
        let c = self.power(w);
        let discriminant = -self.power(w - ray.d * b);
        let root = discriminant.max(F::zero()).sqrt();
        let q = -b - root.copysign(b);
        let (t0, t1) = (c / q, q);
        // Either one of the roots is negative, or the smaller one is nearer; a root at or before the origin is not a
        // hit.
        let (near, far) = (t0.min(t1), t0.max(t1));
        let zero = F::zero();
        let t = F::select(near.gt(zero), near, far);
        let hit = zero.le(discriminant) & t.gt(zero);
        F::select(hit, t, F::splat(NOTHING))
    }

    /// The same for a ray with a direction of any length, in units of that length.
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
    /// The numbers for intersections, the same in all lanes.
    #[inline(always)]
    pub fn lanes<F: Float>(&self) -> SphereLanes<F> {
        SphereLanes {
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
        self.lanes().intersect(ray)
    }

    fn bounds(&self) -> Bounds {
        let r = self.radius;
        Bounds::of([self.centre.map(|x| x - r), self.centre.map(|x| x + r)]).grown(BOUNDS_ERROR)
    }

    fn surface(&self) -> Surface {
        let largest = |v: [f32; 3]| v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        // The largest distance of a point of the sphere from the anchor that is not bounded by its coordinates.
        let is_wall = largest(self.to_centre) > 0.0;
        let reach = if is_wall { 0.0 } else { self.radius };
        Surface {
            kind: SurfaceKind::Round,
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
