//! The disk.

use super::plane::distance_to_plane;
use super::{
    BOUNDS_ERROR, Bounds, Form, NOTHING, POSITION_ERROR, Piece, RareForm, RareKind, RareShape, Shape,
    ShapeParameters, Surface, overlap,
};
use crate::math::{Float, Frame, Ray, Vec3, narrow, trig};
use crate::parameter::limits::{DIRECTION, LENGTH, POINT};
use crate::parameter::{ParameterKind, parameters};
use glam::DVec3;
use std::f32::consts::PI;
use std::f32::consts::TAU;

parameters! {
    /// The points X of a plane with |X − center| ≤ radius; outward is the normal, of length one.
    pub struct DiskParameters: "disk", "a disk" {
        /// The centre of the disk.
        center: DVec3 = POINT,
        /// The direction the disk faces, of any length.
        normal: DVec3 = DIRECTION,
        /// The radius of the disk. Its uv are the angle about the normal over 2π and the distance from the centre over the radius.
        radius: f64 = ParameterKind::Number(LENGTH),
    }
}

/// The points of a plane that are at most the radius from a centre.
///
/// It reaches over its rim by `overlap`, so that nothing slips between it and a cylinder that it closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// The centre.
    pub centre: [f32; 3],
    /// The radius, above zero.
    pub radius: f32,
    /// Of length one.
    pub normal: [f32; 3],
    /// The disk's plane is where X·normal is this.
    pub distance: f32,
    /// X·x_axis + the fourth entry is the first coordinate of a point X in the plane, with the centre at zero and the
    /// radius for its unit, in the frame of the normal.
    pub x_axis: [f32; 4],
    /// The second likewise.
    pub y_axis: [f32; 4],
}

impl Disk {
    /// The disk of a centre, a normal of length one and a radius above zero.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Disk {
        let radius = radius + overlap(centre.abs().max_element() + radius, radius);
        let frame = Frame::<f32>::around(Vec3::splat(narrow(normal.to_array())));
        let wide = |v: Vec3<f32>| DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z));
        // The frame's axes are rounded; these are at right angles to the normal and each other.
        let x = (wide(frame.s) - normal * normal.dot(wide(frame.s))).normalize();
        let axis = |w: DVec3| narrow((w / radius).extend(-w.dot(centre) / radius).to_array());
        Disk {
            centre: narrow(centre.to_array()),
            radius: radius as f32,
            normal: narrow(normal.to_array()),
            distance: normal.dot(centre) as f32,
            x_axis: axis(x),
            y_axis: axis(normal.cross(x)),
        }
    }

    /// The vectors from the centre to the rim along both axes.
    pub fn radii(&self) -> [[f32; 3]; 2] {
        let r2 = self.radius * self.radius;
        [self.x_axis, self.y_axis].map(|[x, y, z, _]| [x * r2, y * r2, z * r2])
    }
}

impl ShapeParameters for DiskParameters {
    fn pieces(&self) -> Vec<Piece> {
        vec![Piece::Rare(Disk::new(self.center, self.normal, self.radius).into())]
    }
}

impl Shape for Disk {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        let ([ax, ay, az, a_offset], [bx, by, bz, b_offset]) = (self.x_axis, self.y_axis);
        let t = distance_to_plane(ray, Vec3::splat(self.normal), F::splat(self.distance));
        let p = ray.at(t);
        let a = p.dot(Vec3::splat([ax, ay, az])) + a_offset;
        let b = p.dot(Vec3::splat([bx, by, bz])) + b_offset;
        F::select((a * a + b * b).le(F::splat(1.0)), t, F::splat(NOTHING))
    }

    fn bounds(&self) -> Bounds {
        // As of a square about it: a and b are off by a few roundings of |X|/radius.
        let reach = self.normal.map(|n| self.radius * (1.0 - n * n).max(0.0).sqrt());
        around(self.centre, reach).grown(3.0 * BOUNDS_ERROR)
    }

    fn surface(&self) -> Surface {
        Surface {
            form: Form::Rare(RareKind::Disk),
            normal: self.normal,
            distance: self.distance,
            u_axis: self.x_axis,
            v_axis: self.y_axis,
            error: POSITION_ERROR * self.distance.abs(),
            area: PI * self.radius * self.radius,
            ..Surface::OF_A_MESH
        }
    }
}

/// Nearer to the centre than this share of the radius areas of uv are those of here.
const LEAST_V: f32 = 1e-3;

/// The axis is the normal and the constant the distance; u and v are the first and the second coordinate.
impl RareShape for Disk {
    #[inline(always)]
    fn point<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> (Vec3<F>, F) {
        (form.axis, p.dot(form.axis) - form.constant)
    }

    /// Around the centre.
    #[inline(always)]
    fn tangent<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> Vec3<F> {
        let x = p.dot(form.u_axis) + form.u_offset;
        let y = p.dot(form.v_axis) + form.v_offset;
        form.v_axis * x - form.u_axis * y
    }

    /// Polar coordinates: φ/2π, and the distance from the centre with the radius for its unit.
    #[inline(always)]
    fn uv<F: Float>(form: &RareForm<F>, p: Vec3<F>, _n: Vec3<F>) -> [F; 2] {
        let x = p.dot(form.u_axis) + form.u_offset;
        let y = p.dot(form.v_axis) + form.v_offset;
        [trig::angle_turns(y, x), (x * x + y * y).sqrt()]
    }

    #[inline(always)]
    fn uv_per_area<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> F {
        let x = p.dot(form.u_axis) + form.u_offset;
        let y = p.dot(form.v_axis) + form.v_offset;
        // The axes have the length of one over the radius.
        let v = (x * x + y * y).sqrt().max(F::splat(LEAST_V));
        form.u_axis.dot(form.u_axis) * (1.0 / TAU) / v
    }

    #[inline(always)]
    fn uv_gradients<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> [Vec3<F>; 2] {
        let x = p.dot(form.u_axis) + form.u_offset;
        let y = p.dot(form.v_axis) + form.v_offset;
        let v = (x * x + y * y).sqrt().max(F::splat(LEAST_V));
        let (around, outwards) = (form.v_axis * x - form.u_axis * y, form.u_axis * x + form.v_axis * y);
        [around * (F::splat(1.0 / TAU) / (v * v)), outwards * (F::splat(1.0) / v)]
    }
}

/// The box around a point that reaches this far along each axis.
pub(super) fn around(centre: [f32; 3], reach: [f32; 3]) -> Bounds {
    let moved = |by: f32| [0, 1, 2].map(|i| centre[i] + by * reach[i]);
    Bounds::of([moved(-1.0), moved(1.0)])
}
