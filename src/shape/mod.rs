//! Shapes: the first hit of a ray on a surface, and the properties of the surface there.
//!
//! Distances are along a ray of unit direction; [`NOTHING`] stands for no hit. Outward is a plane's normal,
//! a sphere's outside, a quad's u × v, a triangle's counter-clockwise side, a disk's normal, and away from a cylinder's
//! axis. A box is six quads.

mod cuboid;
mod cylinder;
mod disk;
pub(crate) mod list;
mod mesh;
mod moved;
mod plane;
mod quad;
mod rare;
mod sphere;
mod triangle;

pub use list::*;
pub use mesh::{FARTHEST, MOST as MOST_TRIANGLES, Mesh, MeshError};
pub use moved::moved;
pub use plane::Plane;
pub use quad::{Quad, QuadForm};
pub use rare::*;
pub use sphere::{Sphere, SphereForm};
pub use triangle::{Meeting, NEEDLE, Sheared, Shears, Sides, TRIANGLE_ERROR, is_needle, triangle_error};

use crate::math::{Bounds, Float, Ray, Vec3};

/// The distance of a hit that does not happen.
pub const NOTHING: f32 = f32::INFINITY;

/// The parameters of a shape, as a scene describes it.
pub trait ShapeParameters {
    /// What rays meet: most shapes are one piece, a box is six.
    fn pieces(&self) -> Vec<Piece>;
}

/// A part of a described shape, as rays meet it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A plane.
    Plane(Plane),
    /// A sphere.
    Sphere(Sphere),
    /// A quad.
    Quad(Quad),
    /// A shape of which most scenes have none.
    Rare(Rare),
}

impl Piece {
    /// See [`Shape::bounds`].
    pub fn bounds(&self) -> Bounds {
        match self {
            Piece::Plane(plane) => plane.bounds(),
            Piece::Sphere(sphere) => sphere.bounds(),
            Piece::Quad(quad) => quad.bounds(),
            Piece::Rare(rare) => rare.bounds(),
        }
    }

    /// See [`Shape::surface`].
    pub fn surface(&self) -> Surface {
        match self {
            Piece::Plane(plane) => plane.surface(),
            Piece::Sphere(sphere) => sphere.surface(),
            Piece::Quad(quad) => quad.surface(),
            Piece::Rare(rare) => rare.surface(),
        }
    }
}

/// The interface of shapes.
pub trait Shape {
    /// Distance to the first hit in front of the ray's origin, or [`NOTHING`]. A hit at the origin itself
    /// is none.
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F;
    /// A box around it, grown by the error of rounding: wherever [`Shape::intersect`] says that a ray meets the
    /// shape, the ray passes there through the box grown by [`BOUNDS_ERROR`] of the largest coordinate of the
    /// ray's origin. Not finite if the shape is not.
    fn bounds(&self) -> Bounds;
    /// The surface's properties, in the form that hits look up.
    fn surface(&self) -> Surface;
}

/// A shape of which most scenes have none. Its hits are completed apart from those on other surfaces, by the functions
/// here, from the numbers that its [`Surface`] holds.
trait RareShape: Shape {
    /// The outward unit normal of the surface at its point nearest to `p`, and how far `p` lies off the surface along
    /// that normal. `p` is a computed hit: off by rounding alone.
    fn point<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> (Vec3<F>, F);

    /// The direction at a point on the surface in which u grows and v does not change, of any length.
    fn tangent<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> Vec3<F>;

    /// uv at a point on the surface, where the outward unit normal is `n`.
    fn uv<F: Float>(form: &RareForm<F>, p: Vec3<F>, n: Vec3<F>) -> [F; 2];

    /// The area of uv for each area of the surface at a point on it; large where it has no bound.
    fn uv_per_area<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> F;

    /// The gradients of u and of v along the surface at a point on it.
    fn uv_gradients<F: Float>(form: &RareForm<F>, p: Vec3<F>) -> [Vec3<F>; 2];
}

/// The formula for the normal and uv of a surface at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A plane or a quad; also meshes, whose triangles have their own formula.
    Flat,
    /// A sphere.
    Round,
    /// The shape's own: see [`Rare`].
    Rare(RareKind),
}

/// Everything that a hit looks up of a surface, in one form for flat and round ones, so that lanes on different shapes
/// evaluate the same formula. In world space and the scene's unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Its form.
    pub form: Form,
    /// Centre of a round surface; zero for others.
    pub centre: [f32; 3],
    /// Radius of a round surface; zero for others.
    pub radius: f32,
    /// The point near which a round surface is described best (see [`Sphere`]), and a rare one's [`RareForm::anchor`];
    /// zero for a flat one.
    pub anchor: [f32; 3],
    /// From the anchor to the centre of a round surface; zero for a flat one.
    pub to_centre: [f32; 3],
    /// The anchor's power; zero for a flat surface.
    pub anchor_power: f32,
    /// Outward normal of a flat surface, of length one, and a rare one's [`RareForm::axis`]; zero for a round one.
    pub normal: [f32; 3],
    /// A flat surface is where X·normal is this. A rare one's [`RareForm::constant`].
    pub distance: f32,
    /// The surface's share of a hit's error bound: how far a computed hit may lie off the surface, plus how
    /// close to it a ray may start before its intersection is in doubt.
    pub error: f32,
    /// u of a point X on a flat surface is X·axis + offset, with the offset in the fourth place. What a rare surface has
    /// it for its shape says.
    pub u_axis: [f32; 4],
    /// v likewise.
    pub v_axis: [f32; 4],
    /// Area; infinite for a plane.
    pub area: f32,
}

impl Surface {
    /// The row of a mesh, whose triangles hold the rest.
    pub const OF_A_MESH: Surface = Surface {
        form: Form::Flat,
        centre: [0.0; 3],
        radius: 0.0,
        anchor: [0.0; 3],
        to_centre: [0.0; 3],
        anchor_power: 0.0,
        normal: [0.0; 3],
        distance: 0.0,
        error: 0.0,
        u_axis: [0.0; 4],
        v_axis: [0.0; 4],
        area: 0.0,
    };
}

/// The unit roundoff of f32: the relative error of one operation.
pub(crate) const UNIT_ROUNDOFF: f32 = f32::EPSILON / 2.0;

/// Error of a hit's position for each unit of its largest coordinate (see [`offset_origin`]).
pub const POSITION_ERROR: f32 = 16.0 * UNIT_ROUNDOFF;

/// By how much a disk, a cylinder or a side of a box of some size reaches over its edges, so that rays do not slip
/// between two of them that meet there: by what rounding does to a hit, where the largest coordinate is so large, but
/// never so much that it is seen.
fn overlap(largest: f64, size: f64) -> f64 {
    (0.5 * f64::from(POSITION_ERROR) * largest).min(1e-4 * size)
}

/// How far outside of a shape a computed hit on it may lie, for each unit of the largest coordinates of the
/// shape and of the ray's origin.
///
/// The hit is where the distance that [`Shape::intersect`] computes takes the ray. On a plane that distance is
/// off by a few roundings of the origin and the plane's own distance, and what an oblique quad adds its bounds
/// pay for. On a sphere or cylinder the distance from the centre or axis is off by some 12 roundings of the origin's
/// distance from the centre, which is up to √3 times the sum of both's coordinates. Comparing the distance with those to a
/// box takes 4 more.
pub const BOUNDS_ERROR: f32 = 64.0 * UNIT_ROUNDOFF;

/// The origin of a ray that leaves a surface at `p`, moved off it by the hit's own error bound, towards
/// the side that `d` points to, so that the ray can't meet the surface it leaves.
///
/// `n` is the unit normal; `error` the bound on |distance to the surface|. The bound grows with the
/// coordinates: a fixed epsilon leaks in large scenes.
#[inline(always)]
pub fn offset_origin<F: Float>(p: Vec3<F>, n: Vec3<F>, error: F, d: Vec3<F>) -> Vec3<F> {
    p + n * error.copysign(n.dot(d))
}

#[cfg(test)]
mod tests;
