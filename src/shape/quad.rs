//! The parallelogram.

use super::plane::distance_to_plane;
use super::{
    BOUNDS_ERROR, Bounds, NOTHING, POSITION_ERROR, Piece, Shape, ShapeParameters, Surface, SurfaceKind,
    overlap,
};
use crate::math::{Float, Ray, Vec3, narrow};
use crate::parameter::limits::{EDGE, PARALLEL, POINT};
use crate::parameter::{Problem, parameters, unit};
use glam::DVec3;

parameters! {
    /// The parallelogram corner + a·u + b·v with a and b in 0…1; outward is u × v.
    pub struct QuadParameters: "quad", "a quad" {
        /// The corner of the quad where uv is (0, 0).
        corner: DVec3 = POINT,
        /// The first edge, from the corner.
        u: DVec3 = EDGE,
        /// The second edge, from the corner. The quad faces u × v.
        v: DVec3 = EDGE,
    }
    check = with_an_area;
}

fn with_an_area(quad: QuadParameters, _: &mut Vec<Problem>) -> Result<QuadParameters, Problem> {
    if unit(quad.u).cross(unit(quad.v)).length() < PARALLEL {
        let message = "v is parallel to u: the quad has no area".into();
        return Err(Problem { parameter: "v", message, help: None });
    }
    Ok(quad)
}

/// The points corner + a·u + b·v with a and b in 0…1, which are also its uv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// The corner where uv is (0, 0).
    pub corner: [f32; 3],
    /// The first edge.
    pub u: [f32; 3],
    /// The second edge.
    pub v: [f32; 3],
    /// The unit normal, along u × v.
    pub normal: [f32; 3],
    /// The quad's plane consists of the points X with X·normal = distance.
    pub distance: f32,
    /// a of a point X is X·u_axis + the fourth component.
    pub u_axis: [f32; 4],
    /// Likewise for b.
    pub v_axis: [f32; 4],
}

impl Quad {
    /// The quad of a corner and two edges, which must not be parallel.
    pub fn new(corner: DVec3, u: DVec3, v: DVec3) -> Quad {
        let n = u.cross(v);
        // The dual basis: u_axis has the product 1 with u and 0 with v.
        let u_axis = v.cross(n) / n.length_squared();
        let v_axis = n.cross(u) / n.length_squared();
        let unit = n.normalize();
        let axis = |w: DVec3| narrow(w.extend(-w.dot(corner)).to_array());
        Quad {
            corner: narrow(corner.to_array()),
            u: narrow(u.to_array()),
            v: narrow(v.to_array()),
            normal: narrow(unit.to_array()),
            distance: unit.dot(corner) as f32,
            u_axis: axis(u_axis),
            v_axis: axis(v_axis),
        }
    }

    /// The sides of the box between two corners, facing outwards and extended beyond their edges by `overlap`: those
    /// perpendicular to x, y and z in turn, the lower one first. v runs along z, or along y on the sides perpendicular
    /// to z.
    pub fn sides(min: DVec3, max: DVec3) -> [Quad; 6] {
        let largest = min.abs().max(max.abs()).max_element();
        let more = DVec3::splat(overlap(largest, (max - min).min_element()));
        let (low, high) = (min - more, max + more);
        let size = high - low;
        let ([x, y, z], at) = ([DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z], DVec3::new);
        [
            Quad::new(at(min.x, high.y, low.z), -y, z),
            Quad::new(at(max.x, low.y, low.z), y, z),
            Quad::new(at(low.x, min.y, low.z), x, z),
            Quad::new(at(high.x, max.y, low.z), -x, z),
            Quad::new(at(high.x, low.y, min.z), -x, y),
            Quad::new(at(low.x, low.y, max.z), x, y),
        ]
    }

    fn area(&self) -> f32 {
        Vec3::<f32>::splat(self.u).cross(Vec3::splat(self.v)).length()
    }
}

/// The numbers for intersections with quads: one quad per lane, or the same one in all lanes.
#[derive(Clone, Copy, Debug)]
pub struct QuadLanes<F> {
    /// The normal, of length one.
    pub normal: Vec3<F>,
    /// The quad's plane consists of the points X with X·normal = distance.
    pub distance: F,
    /// a of a point X is X·u_axis + u_offset.
    pub u_axis: Vec3<F>,
    /// See `u_axis`.
    pub u_offset: F,
    /// Likewise for b.
    pub v_axis: Vec3<F>,
    /// See `v_axis`.
    pub v_offset: F,
}

impl<F: Float> QuadLanes<F> {
    /// The distance to the first hit: see [`Shape::intersect`].
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray<F>) -> F {
        let t = distance_to_plane(ray, self.normal, self.distance);
        let p = ray.at(t);
        let (a, b) = (p.dot(self.u_axis) + self.u_offset, p.dot(self.v_axis) + self.v_offset);
        let (zero, one) = (F::zero(), F::splat(1.0));
        let inside = zero.le(a) & a.le(one) & zero.le(b) & b.le(one);
        F::select(inside, t, F::splat(NOTHING))
    }
}

impl ShapeParameters for QuadParameters {
    fn pieces(&self) -> Vec<Piece> {
        vec![Piece::Quad(Quad::new(self.corner, self.u, self.v))]
    }
}

impl Shape for Quad {
    #[inline(always)]
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F {
        let ([ux, uy, uz, u_offset], [vx, vy, vz, v_offset]) = (self.u_axis, self.v_axis);
        let form = QuadLanes {
            normal: Vec3::splat(self.normal),
            distance: F::splat(self.distance),
            u_axis: Vec3::splat([ux, uy, uz]),
            u_offset: F::splat(u_offset),
            v_axis: Vec3::splat([vx, vy, vz]),
            v_offset: F::splat(v_offset),
        };
        form.intersect(ray)
    }

    fn bounds(&self) -> Bounds {
        // A point that the test accepts has coordinates a and b that are off by a few roundings of |X|·|axis|, as
        // fractions of an edge: the more oblique the edges, the larger.
        let [corner, u, v] = [self.corner, self.u, self.v].map(Vec3::<f32>::splat);
        let length = |axis: [f32; 4]| Vec3::<f32>::splat([axis[0], axis[1], axis[2]]).length();
        let oblique = length(self.u_axis) * u.length() + length(self.v_axis) * v.length();
        let corners = [corner, corner + u, corner + v, corner + u + v];
        Bounds::of(corners.map(|w| [w.x, w.y, w.z])).grown(BOUNDS_ERROR * (1.0 + oblique))
    }

    fn surface(&self) -> Surface {
        Surface {
            kind: SurfaceKind::Flat,
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
