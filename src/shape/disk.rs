//! The disk.

use super::plane::distance_to_plane;
use super::{
    BOUNDS_ERROR, Bounds, CustomKind, CustomSurface, NOTHING, POSITION_ERROR, Piece, Shape, ShapeParameters,
    Surface, SurfaceFunctions, SurfaceKind, overlap,
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
        /// The normal of the disk, of any length.
        normal: DVec3 = DIRECTION,
        /// The radius of the disk. Its u is the angle about the normal divided by 2π, its v the distance from the
        /// centre divided by the radius.
        radius: f64 = ParameterKind::Number(LENGTH),
    }
}

/// The points of a plane whose distance from a centre is at most the radius.
///
/// It extends beyond its rim by `overlap`, so that no ray passes between it and a cylinder that it closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// The centre.
    pub centre: [f32; 3],
    /// The radius, above zero.
    pub radius: f32,
    /// The normal, of length one.
    pub normal: [f32; 3],
    /// The disk's plane consists of the points X with X·normal = distance.
    pub distance: f32,
    /// X·x_axis + the fourth component is the first coordinate of a point X of the plane in the frame of the normal.
    /// The centre has the coordinate zero, and the unit is the radius.
    pub x_axis: [f32; 4],
    /// Likewise for the second coordinate.
    pub y_axis: [f32; 4],
}

impl Disk {
    /// The disk of a centre, a normal of length one and a radius above zero.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Disk {
        let radius = radius + overlap(centre.abs().max_element() + radius, radius);
        let frame = Frame::<f32>::around(Vec3::splat(narrow(normal.to_array())));
        let wide = |v: Vec3<f32>| DVec3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z));
        // The frame's axes are rounded; these are perpendicular to the normal and to each other.
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
        vec![Piece::Custom(Disk::new(self.center, self.normal, self.radius).into())]
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
        // As for a square around it: a and b are off by a few roundings of |X|/radius.
        let reach = self.normal.map(|n| self.radius * (1.0 - n * n).max(0.0).sqrt());
        around(self.centre, reach).grown(3.0 * BOUNDS_ERROR)
    }

    fn surface(&self) -> Surface {
        Surface {
            kind: SurfaceKind::Custom(CustomKind::Disk),
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

/// The smallest v for densities of uv: closer to the centre, the density at this v is used.
const LEAST_V: f32 = 1e-3;

/// The axis is the normal and the constant is the distance; u_axis and v_axis are x_axis and y_axis.
impl SurfaceFunctions for Disk {
    #[inline(always)]
    fn point<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> (Vec3<F>, F) {
        (surface.axis, p.dot(surface.axis) - surface.constant)
    }

    /// The direction of increasing angle.
    #[inline(always)]
    fn tangent<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> Vec3<F> {
        let x = p.dot(surface.u_axis) + surface.u_offset;
        let y = p.dot(surface.v_axis) + surface.v_offset;
        surface.v_axis * x - surface.u_axis * y
    }

    /// Polar coordinates: φ/2π, and the distance from the centre divided by the radius.
    #[inline(always)]
    fn uv<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>, _n: Vec3<F>) -> [F; 2] {
        let x = p.dot(surface.u_axis) + surface.u_offset;
        let y = p.dot(surface.v_axis) + surface.v_offset;
        [trig::angle_turns(y, x), (x * x + y * y).sqrt()]
    }

    #[inline(always)]
    fn uv_per_area<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> F {
        let x = p.dot(surface.u_axis) + surface.u_offset;
        let y = p.dot(surface.v_axis) + surface.v_offset;
        // The axes have the length 1/radius.
        let v = (x * x + y * y).sqrt().max(F::splat(LEAST_V));
        surface.u_axis.dot(surface.u_axis) * (1.0 / TAU) / v
    }

    #[inline(always)]
    fn uv_gradients<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> [Vec3<F>; 2] {
        let x = p.dot(surface.u_axis) + surface.u_offset;
        let y = p.dot(surface.v_axis) + surface.v_offset;
        let v = (x * x + y * y).sqrt().max(F::splat(LEAST_V));
        let (around, outwards) =
            (surface.v_axis * x - surface.u_axis * y, surface.u_axis * x + surface.v_axis * y);
        [around * (F::splat(1.0 / TAU) / (v * v)), outwards * (F::splat(1.0) / v)]
    }
}

/// The box around a point with this extent along each axis.
pub(super) fn around(centre: [f32; 3], reach: [f32; 3]) -> Bounds {
    let offset_by = |by: f32| [0, 1, 2].map(|i| centre[i] + by * reach[i]);
    Bounds::of([offset_by(-1.0), offset_by(1.0)])
}
