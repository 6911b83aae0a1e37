//! The triangles of all meshes.

use super::Hit;
use super::instances::{Instances, NO_INSTANCE};
use crate::math::lanes::Device;
use crate::math::{Bounds, Float, LaneFloat, Uint, Vec3, value};
use crate::shape::{BOUNDS_ERROR, Mesh, Sides, is_needle, triangle_error};
use glam::{DAffine3, DVec3};
use std::ops::Range;

pub(super) mod uv;

/// The number of the first triangle: surfaces are numbered with rows of the surface table from 0, and triangles from
/// here.
pub const FIRST_TRIANGLE: u32 = 1 << 31;

/// Triangles of all meshes, one column for each property.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Indices of the corners' vertices.
    pub corners: [Vec<u32>; 3],
    /// The rows in the surface table of triangles in world space and in groups. The triangles after them belong to
    /// shared meshes.
    pub rows: Vec<u32>,
    /// The number of triangles in world space, which come first. They are followed by those of groups and then of
    /// shared meshes, each in its own space: see [`super::Instances`].
    placed: usize,
    /// The vertices.
    pub positions: [Vec<f32>; 3],
    /// Shading normals of the vertices, on the outward side; zero where the mesh has none.
    pub normals: [Vec<f32>; 3],
    /// uv coordinates of the vertices.
    pub uv: [Vec<f32>; 2],
    /// The second uv coordinates of the vertices; empty if no mesh has some, or they are not [kept](Self::keeping).
    pub second_uv: [Vec<f32>; 2],
    /// Whether second uv are kept.
    keeps_second_uv: bool,
    /// Whether any vertex has a shading normal.
    pub has_normals: bool,
    /// Whether any triangle is a needle (see [`crate::shape::NEEDLE`]).
    pub has_needles: bool,
}

impl Triangles {
    /// No triangles yet. Second uv of meshes that are added are kept if they are wanted.
    pub fn keeping(second_uv: bool) -> Triangles {
        Triangles { keeps_second_uv: second_uv, ..Triangles::default() }
    }

    /// The number of triangles.
    pub fn len(&self) -> usize {
        self.corners[0].len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of triangles in world space, which come first.
    pub fn placed(&self) -> usize {
        self.placed
    }

    /// Adds a transformed mesh with a row of the surface table, and returns its first triangle.
    ///
    /// A transform that mirrors reverses the order of the corners, so that the outward side stays the same.
    pub fn push(&mut self, mesh: &Mesh, transform: &DAffine3, row: u32) -> usize {
        assert_eq!(self.len(), self.placed(), "groups and shared meshes come last");
        let first = self.add(mesh, transform);
        self.rows.resize(self.len(), row);
        self.placed = self.len();
        first
    }

    /// Adds a mesh in the space of a group. Triangles in world space must come first.
    pub fn push_grouped(&mut self, mesh: &Mesh, transform: &DAffine3, row: u32) {
        assert_eq!(self.len(), self.rows.len(), "shared meshes come last");
        self.add(mesh, transform);
        self.rows.resize(self.len(), row);
    }

    /// Adds a mesh in its own space and returns its triangles. Triangles in world space and in groups must come first.
    pub fn push_shared(&mut self, mesh: &Mesh) -> Range<usize> {
        let first = self.add(mesh, &DAffine3::IDENTITY);
        first..self.len()
    }

    fn add(&mut self, mesh: &Mesh, transform: &DAffine3) -> usize {
        let first = self.len();
        let base = self.positions[0].len() as u32;
        self.positions.iter_mut().for_each(|column| column.reserve(mesh.positions.len()));
        self.normals.iter_mut().for_each(|column| column.reserve(mesh.positions.len()));
        self.uv.iter_mut().for_each(|column| column.reserve(mesh.positions.len()));
        self.corners.iter_mut().for_each(|column| column.reserve(mesh.triangles.len()));
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        for &p in &mesh.positions {
            let p = transform.transform_point3(wide(p)).to_array();
            self.positions.iter_mut().zip(p).for_each(|(column, x)| column.push(x as f32));
        }
        let mirrors = transform.matrix3.determinant() < 0.0;
        // Normals transform by the inverse transpose; a mirroring transform swaps the sides, and negates normals.
        let turned = transform.matrix3.inverse().transpose();
        for &n in &mesh.normals {
            let n = (turned * wide(n)).normalize_or_zero().to_array();
            self.normals.iter_mut().zip(n).for_each(|(column, x)| column.push(x as f32));
        }
        for &uv in &mesh.uv {
            self.uv.iter_mut().zip(uv).for_each(|(column, x)| column.push(x));
        }
        self.has_normals |= !mesh.normals.is_empty();
        let vertices = self.positions[0].len();
        if self.keeps_second_uv && !(mesh.second_uv.is_empty() && self.second_uv[0].is_empty()) {
            for (i, column) in self.second_uv.iter_mut().enumerate() {
                column.resize(base as usize, 0.0);
                column.extend(mesh.second_uv.iter().map(|uv| uv[i]));
                column.resize(vertices, 0.0);
            }
        }
        self.normals.iter_mut().for_each(|column| column.resize(vertices, 0.0));
        self.uv.iter_mut().for_each(|column| column.resize(vertices, f32::NAN));
        for &[a, b, c] in &mesh.triangles {
            let corners = if mirrors { [a, c, b] } else { [a, b, c] };
            self.corners.iter_mut().zip(corners).for_each(|(column, i)| column.push(base + i));
        }
        self.has_needles = self.has_needles || (first..self.len()).any(|triangle| self.is_needle(triangle));
        first
    }

    /// Whether a triangle is a needle (see [`crate::shape::NEEDLE`]).
    pub fn is_needle(&self, triangle: usize) -> bool {
        let [a, b, c] = self.positions_of(triangle).map(Vec3::<f32>::splat);
        is_needle(b - a, c - a)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let Triangles {
            corners,
            rows,
            placed: _,
            positions,
            normals,
            uv,
            second_uv,
            keeps_second_uv: _,
            has_normals: _,
            has_needles: _,
        } = self;
        let of = |columns: &[Vec<f32>]| columns.iter().map(|column| size_of_val(&column[..])).sum::<usize>();
        let indices = corners.iter().chain([rows]).map(|column| size_of_val(&column[..])).sum::<usize>();
        indices + of(positions) + of(normals) + of(uv) + of(second_uv)
    }

    /// The positions of a triangle's corners.
    pub fn positions_of(&self, triangle: usize) -> [[f32; 3]; 3] {
        let [a, b, c] = &self.corners;
        let [x, y, z] = &self.positions;
        let position = |vertex: u32| [x[vertex as usize], y[vertex as usize], z[vertex as usize]];
        [position(a[triangle]), position(b[triangle]), position(c[triangle])]
    }

    /// Whether some triangles form a convex emitter: all other vertices lie behind the plane of each triangle, within
    /// the error of points on it, so that none occludes another from a point in front of it. `turned` swaps front and
    /// back. For more than 1024 triangles the result is false, as the test is quadratic.
    pub fn is_convex(&self, triangles: Range<usize>, turned: bool) -> bool {
        const MOST: usize = 1024;
        if triangles.len() > MOST {
            return false;
        }
        let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
        let all: Vec<_> = triangles.map(|triangle| self.positions_of(triangle)).collect();
        all.iter().all(|&corners| {
            let [a, b, c] = corners.map(wide);
            let normal = (b - a).cross(c - a).normalize_or_zero() * if turned { -1.0 } else { 1.0 };
            let [a32, b32, c32] = corners.map(Vec3::<f32>::splat);
            let error = f64::from(triangle_error(a32, b32 - a32, c32 - a32));
            all.iter().flatten().all(|&p| (wide(p) - a).dot(normal) <= error)
        })
    }

    /// The bounds of a triangle: see [`crate::shape::Shape::bounds`].
    pub fn bounds(&self, triangle: usize) -> Bounds {
        Bounds::of(self.positions_of(triangle)).grown(BOUNDS_ERROR)
    }

    /// The corners' vertices of one triangle per lane.
    #[inline(always)]
    pub(super) fn vertices<F: Float>(&self, triangle: F::Uint) -> [F::Uint; 3] {
        let [a, b, c] = &self.corners;
        [F::Uint::gather(a, triangle), F::Uint::gather(b, triangle), F::Uint::gather(c, triangle)]
    }

    /// Positions of vertices.
    #[inline(always)]
    pub(super) fn position<F: Float>(&self, vertex: F::Uint) -> Vec3<F> {
        Vec3::gather(&self.positions, vertex)
    }

    /// The corners of the triangles that are hit.
    #[inline(always)]
    fn corners_of<F: Float>(&self, surface: F::Uint) -> Corners<F> {
        F::device(&CornersOf(self), surface)
    }

    /// The rows in the surface table of hits on meshes. Lanes outside `on_mesh` are unspecified.
    #[inline(always)]
    pub(super) fn row<F: Float>(
        &self,
        instances: Option<&Instances>,
        hit: &Hit<F>,
        on_mesh: F::Mask,
    ) -> F::Uint {
        let mut row = hit.surface;
        if !self.rows.is_empty() {
            row = F::Uint::gather(&self.rows, triangle_of::<F>(hit.surface));
        }
        match instances {
            None => row,
            Some(instances) => F::branch(
                on_mesh & is_shared::<F>(hit.instance),
                row,
                #[inline(always)]
                || instances.row::<F>(hit.instance, row),
            ),
        }
    }

    /// The hit points of rays on triangles, interpolated from the corners, so that the error is that of the corners'
    /// coordinates at any distance. Lanes outside `on_mesh` are unspecified. `orientation` is 1, or −1 where the
    /// outward side is flipped.
    #[inline(always)]
    pub(super) fn point<F: Float>(
        &self,
        instances: Option<&Instances>,
        ray_d: Vec3<F>,
        hit: &Hit<F>,
        on_mesh: F::Mask,
        orientation: F,
    ) -> TrianglePoint<F> {
        let Corners { a, b, c, vertices } = self.corners_of::<F>(hit.surface);
        let mut corners = [a, b, c];
        let mut normals = [Vec3::zero(); 3];
        if self.has_normals {
            let [a, b, c] = vertices;
            normals = [
                Vec3::gather(&self.normals, a),
                Vec3::gather(&self.normals, b),
                Vec3::gather(&self.normals, c),
            ];
        }
        // The error that an instance's transform adds.
        let mut of_place = F::zero();
        if let Some(instances) = instances {
            (corners, normals, of_place) = F::branch(
                on_mesh & is_shared::<F>(hit.instance),
                (corners, normals, of_place),
                #[inline(always)]
                || {
                    let place = instances.gather::<F>(hit.instance);
                    let error = Sides::new(b - a, c - a).error(a);
                    let corners = [place.point(a), place.point(b), place.point(c)];
                    let mut turned = normals;
                    if self.has_normals {
                        let [a, b, c] = normals;
                        turned = [place.normal(a), place.normal(b), place.normal(c)];
                    }
                    (corners, turned, place.error(corners[0], error))
                },
            );
        }
        let [a, b, c] = corners;
        let (ab, ac) = (b - a, c - a);
        let sides = Sides::new(ab, ac);
        let mut error = sides.error(a);
        if instances.is_some() {
            error = error + of_place;
        }
        let weights = hit.weights;
        let p = a + ab * weights[0] + ac * weights[1];
        // A degenerate triangle was hit within rounding errors, and has no normal.
        let n = F::branch(
            on_mesh & !sides.length.gt(F::zero()),
            sides.across * (orientation / sides.length),
            #[inline(always)]
            || -ray_d,
        );

        let mut shading = n;
        if self.has_normals {
            let [na, nb, nc] = normals;
            let mean = na + (nb - na) * weights[0] + (nc - na) * weights[1];
            let length = mean.length();
            // The order of the corners determines the outward side.
            let smooth = mean * (F::splat(1.0) / length).copysign(mean.dot(n));
            // Where the ray arrives on opposite sides of the triangle and of the shading surface, the shading normal is
            // useless.
            let (geometric, seen) = (ray_d.dot(n), ray_d.dot(smooth));
            let agrees = (geometric * seen).gt(F::zero()) & length.gt(F::zero());
            shading = Vec3::select(agrees, smooth, n);
        }
        TrianglePoint { p, n, shading, error }
    }
}

/// The lanes with hits on instances.
#[inline(always)]
pub(super) fn is_shared<F: Float>(instance: F::Uint) -> F::Mask {
    !instance.eq(F::Uint::splat(NO_INSTANCE))
}

/// The corners of a triangle, in order.
#[derive(Clone, Copy, Debug)]
pub struct Corners<F: Float> {
    a: Vec3<F>,
    b: Vec3<F>,
    c: Vec3<F>,
    /// The indices of the corners' vertices.
    vertices: [F::Uint; 3],
}

value!(Corners { a, b, c, vertices });

/// [`Triangles::corners_of`], as a device function: GPUs store the corners with the triangles, in the order of their
/// trees.
struct CornersOf<'a>(&'a Triangles);

impl Device for CornersOf<'_> {
    const NAME: &'static str = "triangle_corners";
    type Arguments<F: Float> = F::Uint;
    type Output<F: Float> = Corners<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, surface: F::Uint) -> Corners<F> {
        let vertices = self.0.vertices::<F>(triangle_of::<F>(surface));
        let [a, b, c] = vertices;
        Corners {
            a: self.0.position::<F>(a),
            b: self.0.position::<F>(b),
            c: self.0.position::<F>(c),
            vertices,
        }
    }
}

/// A point on a triangle.
pub(super) struct TrianglePoint<F> {
    pub(super) p: Vec3<F>,
    /// Outward normal, of length one.
    pub(super) n: Vec3<F>,
    /// The shading normal, of unit length: the interpolated normal on the side of `n`. It is `n` where there is none,
    /// or where the ray arrives on the other side of the shading surface.
    pub(super) shading: Vec3<F>,
    /// See [`SurfacePoint::error`](super::SurfacePoint::error).
    pub(super) error: F,
}

/// The indices of triangles, from their surface numbers.
#[inline(always)]
pub(super) fn triangle_of<F: Float>(surface: F::Uint) -> F::Uint {
    surface & F::Uint::splat(FIRST_TRIANGLE - 1)
}
