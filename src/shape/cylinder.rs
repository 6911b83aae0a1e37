//! The cylinder.

use super::disk::around;
use super::{
    BOUNDS_ERROR, Bounds, CustomKind, CustomSurface, NOTHING, Piece, Shape, ShapeParameters, Surface,
    SurfaceFunctions, SurfaceKind, UNIT_ROUNDOFF, overlap,
};
use crate::math::{Float, Frame, Ray, Vec3, narrow, trig};
use crate::parameter::limits::{LENGTH, POINT, SHORTEST};
use crate::parameter::{ParameterKind, Problem, parameters};
use glam::DVec3;
use std::f32::consts::TAU;

parameters! {
    /// The points at a distance from a line segment, without caps; outward is away from the axis.
    pub struct CylinderParameters: "cylinder", "a cylinder" {
        /// The end of the cylinder's axis where v is 0. Both ends are open.
        from: DVec3 = POINT,
        /// The end where v is 1.
        to: DVec3 = POINT,
        /// The radius of the cylinder. Its u is the angle about the axis divided by 2π.
        radius: f64 = ParameterKind::Number(LENGTH),
    }
    check = with_a_length;
}

fn with_a_length(tube: CylinderParameters, _: &mut Vec<Problem>) -> Result<CylinderParameters, Problem> {
    if tube.from.distance(tube.to) < SHORTEST {
        let message = "to is the same point as from: the cylinder has no length".into();
        return Err(Problem { parameter: "to", message, help: None });
    }
    Ok(tube)
}

/// A cylinder's contribution to its hits' error bound, per unit of its radius and half its length.
///
/// Of a point at w from the middle of the axis a, the component across is w − a(w·a). It is off by the rounding of w,
/// the four of w·a, one of their product and one of the difference: 7 roundings of |w|, which is at most the sum of
/// both. Its length adds 2.5 roundings of the radius. The error occurs twice: when the hit is projected onto the
/// cylinder, and when the next ray is tested against it. That test, |m|² − r², adds 1.5 roundings of the radius.
const CYLINDER_ERROR: f32 = 24.0 * UNIT_ROUNDOFF;

/// The points at a radius from an axis, between its ends. It has no caps; disks can close it.
///
/// It extends beyond its ends by `overlap`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// The middle of the axis.
    pub middle: [f32; 3],
    /// The direction of the axis, of length one.
    pub axis: [f32; 3],
    /// Half the length of the axis.
    pub half: f32,
    /// The radius, above zero.
    pub radius: f32,
    /// The direction from the axis in which u is zero, of length one.
    pub x_axis: [f32; 3],
    /// v of a point X is X·v_axis + the fourth component.
    pub v_axis: [f32; 4],
}

impl Cylinder {
    /// The cylinder about the line segment between two points.
    pub fn new(from: DVec3, to: DVec3, radius: f64) -> Cylinder {
        let (middle, along) = ((from + to) * 0.5, to - from);
        let length = along.length();
        let largest = from.abs().max(to.abs()).max_element() + radius;
        let axis = narrow((along / length).to_array());
        let middle = narrow(middle.to_array());
        let half = (0.5 * length + overlap(largest, length)) as f32;
        // From here on the rounded numbers are used.
        let x_axis = Frame::<f32>::around(Vec3::splat(axis)).s;
        let per_length = 0.5 / f64::from(half);
        let [x, y, z] = axis.map(f64::from);
        let height: f64 = axis.iter().zip(middle).map(|(&a, m)| f64::from(a) * f64::from(m)).sum();
        let v_axis = [x * per_length, y * per_length, z * per_length, 0.5 - height * per_length];
        Cylinder {
            middle,
            axis,
            half,
            radius: radius as f32,
            x_axis: [x_axis.x, x_axis.y, x_axis.z],
            v_axis: narrow(v_axis),
        }
    }

    /// One end of the axis.
    pub fn from(&self) -> [f32; 3] {
        [0, 1, 2].map(|i| self.middle[i] - self.axis[i] * self.half)
    }

    /// Its surface area.
    pub fn area(&self) -> f32 {
        TAU * self.radius * 2.0 * self.half
    }

    /// Its extent from the middle along each of the world's axes.
    pub fn reach(&self) -> [f32; 3] {
        self.axis.map(|a| self.half * a.abs() + self.radius * (1.0 - a * a).max(0.0).sqrt())
    }
}

impl ShapeParameters for CylinderParameters {
    fn pieces(&self) -> Vec<Piece> {
        vec![Piece::Custom(Cylinder::new(self.from, self.to, self.radius).into())]
    }
}

impl Shape for Cylinder {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        // With m and e, the components of the origin and the direction across the axis, |m + te|² = r²: at² + 2bt + c =
        // 0. As for a sphere, the discriminant is computed from the point nearest to the axis, and the smaller root
        // from c.
        let axis = Vec3::splat(self.axis);
        let w = ray.o - Vec3::splat(self.middle);
        let (height, rate) = (w.dot(axis), ray.d.dot(axis));
        let (m, e) = (w - axis * height, ray.d - axis * rate);
        let (a, b) = (e.dot(e), m.dot(e));
        let r2 = F::splat(self.radius * self.radius);
        let c = m.dot(m) - r2;
        let nearest = m - e * (b / a);
        // For a ray along the axis, a is zero and this is NaN.
        let discriminant = r2 - nearest.dot(nearest);
        let root = (discriminant.max(F::zero()) * a).sqrt();
        let q = -b - root.copysign(b);
        let (t0, t1) = (c / q, q / a);
        let (near, far) = (t0.min(t1), t0.max(t1));
        let (zero, nothing) = (F::zero(), F::splat(NOTHING));
        let half = F::splat(self.half);
        // Through an open end, the far side is visible.
        let far = F::select(far.gt(zero) & (height + rate * far).abs().le(half), far, nothing);
        let t = F::select(near.gt(zero) & (height + rate * near).abs().le(half), near, far);
        F::select(zero.le(discriminant), t, nothing)
    }

    fn bounds(&self) -> Bounds {
        around(self.middle, self.reach()).grown(BOUNDS_ERROR)
    }

    fn surface(&self) -> Surface {
        let largest = self.middle.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        let [x, y, z] = self.x_axis;
        Surface {
            kind: SurfaceKind::Custom(CustomKind::Cylinder),
            anchor: self.middle,
            normal: self.axis,
            distance: self.radius,
            u_axis: [x, y, z, 0.0],
            v_axis: self.v_axis,
            error: CYLINDER_ERROR * (self.radius + self.half) + 2.0 * UNIT_ROUNDOFF * largest,
            area: self.area(),
            ..Surface::OF_A_MESH
        }
    }
}

/// The anchor is the middle, the constant is the radius, and u_axis is x_axis.
impl SurfaceFunctions for Cylinder {
    #[inline(always)]
    fn point<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> (Vec3<F>, F) {
        let w = p - surface.anchor;
        let across = w - surface.axis * w.dot(surface.axis);
        let length = across.length();
        // Of a radius below the rounding errors of the hit, that may be on the axis.
        let normal = Vec3::select(length.gt(F::zero()), across * (F::splat(1.0) / length), surface.u_axis);
        (normal, length - surface.constant)
    }

    /// The direction of increasing angle.
    #[inline(always)]
    fn tangent<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> Vec3<F> {
        surface.axis.cross(p - surface.anchor)
    }

    /// φ/2π about the axis, and the height above the first end divided by the length.
    #[inline(always)]
    fn uv<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>, n: Vec3<F>) -> [F; 2] {
        let y_axis = surface.axis.cross(surface.u_axis);
        let u = trig::angle_turns(n.dot(y_axis), n.dot(surface.u_axis));
        [u, p.dot(surface.v_axis) + surface.v_offset]
    }

    #[inline(always)]
    fn uv_per_area<F: Float>(surface: &CustomSurface<F>, _p: Vec3<F>) -> F {
        surface.v_axis.length() / (surface.constant * TAU)
    }

    #[inline(always)]
    fn uv_gradients<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> [Vec3<F>; 2] {
        let around = surface.axis.cross(p - surface.anchor);
        let square = around.dot(around).max(F::splat(f32::MIN_POSITIVE));
        [around * (F::splat(1.0 / TAU) / square), surface.v_axis]
    }
}
