//! The parallelogram.

use super::plane::distance_to_plane;
use super::{NOTHING, POSITION_ERROR, Shape, Surface};
use crate::math::{Float, Ray, Vec3};
use glam::DVec3;

/// The points corner + a·u + b·v with a and b in 0…1, which are also its uv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// The corner where uv is (0, 0).
    pub corner: [f32; 3],
    /// First edge.
    pub u: [f32; 3],
    /// Second edge.
    pub v: [f32; 3],
    /// u × v, of length one.
    pub normal: [f32; 3],
    /// The quad's plane is where X·normal is this.
    pub distance: f32,
    /// a of a point X is X·u_axis + the fourth entry.
    pub u_axis: [f32; 4],
    /// b likewise.
    pub v_axis: [f32; 4],
}

impl Quad {
    /// The quad of a corner and two edges that are not parallel.
    pub fn new(corner: DVec3, u: DVec3, v: DVec3) -> Quad {
        let n = u.cross(v);
        // The dual basis: u_axis is 1 along u and 0 along v.
        let u_axis = v.cross(n) / n.length_squared();
        let v_axis = n.cross(u) / n.length_squared();
        let unit = n.normalize();
        let narrow = |w: DVec3| w.to_array().map(|x| x as f32);
        let axis = |w: DVec3| w.extend(-w.dot(corner)).to_array().map(|x| x as f32);
        Quad {
            corner: narrow(corner),
            u: narrow(u),
            v: narrow(v),
            normal: narrow(unit),
            distance: unit.dot(corner) as f32,
            u_axis: axis(u_axis),
            v_axis: axis(v_axis),
        }
    }

    fn area(&self) -> f32 {
        Vec3::<f32>::splat(self.u).cross(Vec3::splat(self.v)).length()
    }
}

/// X·axis + offset.
#[inline(always)]
fn along<F: Float>(p: Vec3<F>, axis: [f32; 4]) -> F {
    p.x * axis[0] + p.y * axis[1] + p.z * axis[2] + axis[3]
}

impl Shape for Quad {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        let t = distance_to_plane(ray, Vec3::splat(self.normal), self.distance);
        let p = ray.at(t);
        let (a, b) = (along(p, self.u_axis), along(p, self.v_axis));
        let (zero, one) = (F::zero(), F::splat(1.0));
        let inside = zero.le(a) & a.le(one) & zero.le(b) & b.le(one);
        F::select(inside, t, F::splat(NOTHING))
    }

    fn surface(&self) -> Surface {
        Surface {
            centre: [0.0; 3],
            radius: 0.0,
            anchor: [0.0; 3],
            to_centre: [0.0; 3],
            anchor_power: 0.0,
            normal: self.normal,
            distance: self.distance,
            error: POSITION_ERROR * self.distance.abs(),
            u_axis: self.u_axis,
            v_axis: self.v_axis,
            area: self.area(),
        }
    }
}
