//! Shapes: the first hit of a ray on a surface, and the properties of the surface at a hit.
//!
//! Distances are multiples of the ray's direction, which has unit length except in groups; [`NOTHING`] means no hit. The
//! description of each shape's parameters says which side is outward.

mod cuboid;
mod custom;
mod cylinder;
mod disk;
pub(crate) mod list;
mod mesh;
mod plane;
mod quad;
mod sphere;
mod transformed;
mod triangle;

pub use custom::*;
pub use list::*;
pub use mesh::{FARTHEST, MOST as MOST_TRIANGLES, Mesh, MeshError};
pub use plane::Plane;
pub use quad::{Quad, QuadLanes};
pub use sphere::{Sphere, SphereLanes};
pub use transformed::transformed;
pub use triangle::{
    NEEDLE, ShearedRay, ShearedRays, Sides, TRIANGLE_ERROR, TriangleHit, is_needle, triangle_error,
};

use crate::math::{Bounds, Float, Ray, Vec3};

/// The distance of a ray without a hit.
pub const NOTHING: f32 = f32::INFINITY;

/// The parameters of a shape, as a scene describes it.
pub trait ShapeParameters {
    /// The pieces that rays are tested against: one for most shapes, six for a box.
    fn pieces(&self) -> Vec<Piece>;
}

/// A part of a shape that rays are tested against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A plane.
    Plane(Plane),
    /// A sphere.
    Sphere(Sphere),
    /// A quad.
    Quad(Quad),
    /// A shape with functions of its own.
    Custom(CustomShape),
}

impl Piece {
    /// See [`Shape::bounds`].
    pub fn bounds(&self) -> Bounds {
        match self {
            Piece::Plane(plane) => plane.bounds(),
            Piece::Sphere(sphere) => sphere.bounds(),
            Piece::Quad(quad) => quad.bounds(),
            Piece::Custom(custom) => custom.bounds(),
        }
    }

    /// See [`Shape::surface`].
    pub fn surface(&self) -> Surface {
        match self {
            Piece::Plane(plane) => plane.surface(),
            Piece::Sphere(sphere) => sphere.surface(),
            Piece::Quad(quad) => quad.surface(),
            Piece::Custom(custom) => custom.surface(),
        }
    }
}

/// The interface of surfaces that rays can hit.
pub trait Shape {
    /// The distance to the first hit in front of the ray's origin, or [`NOTHING`]. A point at the origin itself is not
    /// a hit.
    ///
    /// The numbers of the shape are constants of the ray's type, [`Float::splat`]. (`Float::given`, for numbers that the
    /// GPU reads from a buffer, is for functions that are recorded for it; `intersect` is written for the GPU by hand.)
    ///
    /// Custom shapes are also called with rays of groups, whose directions have any length; the distance is then in
    /// units of that length. Lengths of a scene lie between 1e-18 and 1e18, so their squares are finite, but higher
    /// powers are not: a formula of a higher degree must scale its numbers first.
    fn intersect<F: Float>(&self, ray: &Ray<F>) -> F;
    /// A bounding box that includes rounding errors. If [`Shape::intersect`] returns a hit, the ray passes there
    /// through the box grown by [`BOUNDS_ERROR`] of the largest coordinate of the ray's origin. Not finite if the shape
    /// is unbounded.
    fn bounds(&self) -> Bounds;
    /// The surface's properties, for evaluation at hits.
    fn surface(&self) -> Surface;
}

/// A shape whose hits are completed by functions of its own, from the numbers of its [`Surface`], apart from those on
/// other surfaces.
///
/// All functions return finite numbers for every finite point, also where a quotient has the divisor zero: lanes share
/// code, and a sample with a NaN is rejected. A unit test evaluates them at singular points of the samples of all shapes.
trait SurfaceFunctions: Shape {
    /// The outward unit normal of the surface at its point nearest to `p`, and the distance of `p` from the surface
    /// along that normal. `p` is a computed hit: off by rounding errors only.
    ///
    /// Where the surface has no normal, such as at the apex of a cone, or has several nearest points, such as on the axis
    /// of a cylinder that is thinner than the rounding errors, the normal is a fixed unit vector of the shape.
    fn point<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> (Vec3<F>, F);

    /// The direction, at a point on the surface, in which u increases and v is constant, of any length; zero where there
    /// is none, such as in the centre of a disk.
    fn tangent<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> Vec3<F>;

    /// uv at a point on the surface, given its outward unit normal `n`. Where uv converge, any of their values.
    fn uv<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>, n: Vec3<F>) -> [F; 2];

    /// The area of uv per area of the surface at a point on it; large where it is unbounded.
    fn uv_per_area<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> F;

    /// The gradients of u and v along the surface at a point on it: perpendicular to the normal, and large where they are
    /// unbounded.
    fn uv_gradients<F: Float>(surface: &CustomSurface<F>, p: Vec3<F>) -> [Vec3<F>; 2];
}

/// The formula for a surface's normal and uv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKind {
    /// That of a plane or a quad. Meshes are stored as this kind, but their triangles have formulas of their own.
    Flat,
    /// A sphere.
    Round,
    /// The functions of the shape: see [`CustomShape`].
    Custom(CustomKind),
}

/// The properties of a surface that hits look up. Flat and round surfaces share one formula, so that lanes on different
/// shapes run the same code. In world space and the scene's unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Its kind.
    pub kind: SurfaceKind,
    /// Centre of a round surface; zero for others.
    pub centre: [f32; 3],
    /// Radius of a round surface; zero for others.
    pub radius: f32,
    /// The anchor of a round surface (see [`Sphere`]), and the [`CustomSurface::anchor`] of a custom one; zero for a
    /// flat one.
    pub anchor: [f32; 3],
    /// From the anchor to the centre of a round surface; zero for a flat one.
    pub to_centre: [f32; 3],
    /// The anchor's power; zero for a flat surface.
    pub anchor_power: f32,
    /// The outward unit normal of a flat surface, and the [`CustomSurface::axis`] of a custom one; zero for a round
    /// one.
    pub normal: [f32; 3],
    /// A flat surface consists of the points X with X·normal = distance. The [`CustomSurface::constant`] of a custom
    /// one.
    pub distance: f32,
    /// The surface's contribution to a hit's error bound: the largest distance of a computed hit from the surface
    /// (after it was moved onto the surface, for custom and round ones), plus the distance below which a ray that
    /// starts there might intersect it again.
    pub error: f32,
    /// u of a point X on a flat surface is X·axis + offset, with the offset as the fourth component. A custom shape
    /// stores any numbers here that its functions need, such as a second length.
    pub u_axis: [f32; 4],
    /// Likewise for v.
    pub v_axis: [f32; 4],
    /// Area; infinite for a plane.
    pub area: f32,
}

impl Surface {
    /// The row of a mesh; the rest is in its triangles.
    pub const OF_A_MESH: Surface = Surface {
        kind: SurfaceKind::Flat,
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

/// The error of a hit's position per unit of its largest coordinate (see [`offset_origin`]).
pub const POSITION_ERROR: f32 = 16.0 * UNIT_ROUNDOFF;

/// The distance by which a disk, a cylinder or a side of a box extends beyond its edges, so that rays do not slip
/// through where two of them meet. It covers the rounding errors of hits at the largest coordinate, but is limited to a
/// fraction of the size that cannot be seen.
fn overlap(largest: f64, size: f64) -> f64 {
    (0.5 * f64::from(POSITION_ERROR) * largest).min(1e-4 * size)
}

/// The largest distance of a computed hit outside its shape, per unit of the largest coordinates of the shape and of
/// the ray's origin.
///
/// The hit is at the distance that [`Shape::intersect`] computes. On a plane, that distance is off by a few roundings
/// of the origin and of the plane's own distance; the additional error of an oblique quad is in its bounds. On a sphere
/// or cylinder, the distance from the centre or axis is off by some 12 roundings of the origin's distance from the
/// centre, which is up to √3 times the sum of the coordinates of both. The comparison with the distances to a box adds
/// 4 more.
pub const BOUNDS_ERROR: f32 = 64.0 * UNIT_ROUNDOFF;

/// The origin of a ray that leaves a surface at `p`, moved off the surface by the hit's own error bound to the side
/// that `d` points to, so that the ray cannot hit the surface again there.
///
/// `n` is the unit normal; `error` is the bound on the distance to the surface. The bound grows with the coordinates: a
/// fixed epsilon would leak in large scenes.
#[inline(always)]
pub fn offset_origin<F: Float>(p: Vec3<F>, n: Vec3<F>, error: F, d: Vec3<F>) -> Vec3<F> {
    p + n * error.copysign(n.dot(d))
}

#[cfg(test)]
#[allow(dead_code, reason = "the integration tests use the rest")]
pub(crate) mod samples {
    use super::{AnyShape as Shape, Mesh, list::*};
    use glam::{DAffine3, DMat3, DVec3};
    use std::sync::Arc;
    include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/common/shapes.rs"));
}

#[cfg(test)]
mod tests;
