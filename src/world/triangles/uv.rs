//! The uv of triangles.

use super::{Corners, Triangles, is_shared};
use crate::light::UvTriangle;
use crate::math::{Float, Uint, Vec3};
use crate::world::instances::Instances;

/// uv at the corners of triangles of meshes without uv.
const NO_U: [f32; 3] = [0.0, 1.0, 1.0];
const NO_V: [f32; 3] = [0.0, 0.0, 1.0];

/// A set of uv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::world) enum UvSet {
    First,
    /// The second one, which only meshes have. It is zero on meshes without it.
    Second,
}

impl Triangles {
    /// A triangle with its uv.
    pub(in crate::world) fn with_uv(&self, triangle: usize) -> UvTriangle {
        let vertices = self.corners.each_ref().map(|column| column[triangle] as usize);
        let of = |set: &[Vec<f32>; 2]| {
            [0, 1, 2].map(|corner| {
                let value = |axis: usize| set[axis].get(vertices[corner]).copied().unwrap_or(0.0);
                let [u, v] = [value(0), value(1)];
                [if u.is_nan() { NO_U[corner] } else { u }, if v.is_nan() { NO_V[corner] } else { v }]
            })
        };
        UvTriangle { corners: self.positions_of(triangle), uv: of(&self.uv), second_uv: of(&self.second_uv) }
    }

    /// The columns of a set of uv.
    #[inline(always)]
    fn set(&self, set: UvSet) -> &[Vec<f32>; 2] {
        match set {
            UvSet::First => &self.uv,
            UvSet::Second => &self.second_uv,
        }
    }

    /// uv coordinates of points on triangles, from the weights of the second and the third corner.
    #[inline(always)]
    pub(in crate::world) fn uv<F: Float>(&self, set: UvSet, surface: F::Uint, weights: [F; 2]) -> [F; 2] {
        let vertices = self.corners_of::<F>(surface).vertices;
        let [u, v] = self.set(set);
        [corner_mean(u, vertices, NO_U, weights), corner_mean(v, vertices, NO_V, weights)]
    }

    /// ∂p/∂u on triangles, of any length; zero where uv are equal at all corners. `instance` is that of the hits. Lanes
    /// outside `on_mesh` are unspecified.
    #[inline(always)]
    pub(in crate::world) fn tangent<F: Float>(
        &self,
        instances: Option<&Instances>,
        surface: F::Uint,
        instance: F::Uint,
        on_mesh: F::Mask,
    ) -> Vec3<F> {
        let UvSides { ab, ac, u: [ub, uc], v: [vb, vc] } =
            self.uv_sides::<F>(UvSet::First, instances, surface, instance, on_mesh);
        let along = ab * vc - ac * vb;
        along * F::splat(1.0).copysign(ub * vc - uc * vb)
    }

    /// The ratio of an area in uv to that on triangles in the world; zero for degenerate triangles. Lanes outside
    /// `on_mesh` are unspecified.
    #[inline(always)]
    pub(in crate::world) fn uv_per_area<F: Float>(
        &self,
        set: UvSet,
        instances: Option<&Instances>,
        surface: F::Uint,
        instance: F::Uint,
        on_mesh: F::Mask,
    ) -> F {
        let UvSides { ab, ac, u: [ub, uc], v: [vb, vc] } =
            self.uv_sides::<F>(set, instances, surface, instance, on_mesh);
        let area = ab.cross(ac).length();
        ((ub * vc - uc * vb).abs() / area).only(area.gt(F::zero()))
    }

    /// The gradients of u and of v on triangles in the world. Lanes outside `on_mesh` are unspecified.
    #[inline(always)]
    pub(in crate::world) fn uv_gradients<F: Float>(
        &self,
        set: UvSet,
        instances: Option<&Instances>,
        surface: F::Uint,
        instance: F::Uint,
        on_mesh: F::Mask,
    ) -> [Vec3<F>; 2] {
        let UvSides { ab, ac, u: [ub, uc], v: [vb, vc] } =
            self.uv_sides::<F>(set, instances, surface, instance, on_mesh);
        // Scaled first, as the fourth power of a side may overflow or underflow.
        let inverse = F::splat(1.0) / ab.max_abs().max(ac.max_abs()).max(F::splat(f32::MIN_POSITIVE));
        let (ab, ac) = (ab * inverse, ac * inverse);
        let across = ab.cross(ac);
        let per_area = inverse / across.dot(across);
        // For a gradient g, g·ab and g·ac are the differences along the sides.
        let (of_b, of_c) = (ac.cross(across) * per_area, across.cross(ab) * per_area);
        [of_b * ub + of_c * uc, of_b * vb + of_c * vc]
    }

    /// Sides of triangles in the world, with the differences of uv along them. Lanes outside `on_mesh` are unspecified.
    #[inline(always)]
    fn uv_sides<F: Float>(
        &self,
        set: UvSet,
        instances: Option<&Instances>,
        surface: F::Uint,
        instance: F::Uint,
        on_mesh: F::Mask,
    ) -> UvSides<F> {
        let Corners { a, b, c, vertices } = self.corners_of::<F>(surface);
        let mut sides = (b - a, c - a);
        if let Some(instances) = instances {
            sides = F::branch(
                on_mesh & is_shared::<F>(instance),
                sides,
                #[inline(always)]
                || {
                    let place = instances.gather::<F>(instance);
                    let corner = place.point(a);
                    (place.point(b) - corner, place.point(c) - corner)
                },
            );
        }
        let [u, v] = self.set(set);
        let [ua, ub, uc] = values_of::<F>(u, vertices, NO_U);
        let [va, vb, vc] = values_of::<F>(v, vertices, NO_V);
        let (ab, ac) = sides;
        UvSides { ab, ac, u: [ub - ua, uc - ua], v: [vb - va, vc - va] }
    }
}

/// The sides of a triangle from its first corner to the second and to the third, and the differences of uv along them.
struct UvSides<F> {
    ab: Vec3<F>,
    ac: Vec3<F>,
    u: [F; 2],
    v: [F; 2],
}

/// The weighted mean of a column's values at three vertices; `without` replaces NaN.
#[inline(always)]
fn corner_mean<F: Float>(column: &[f32], vertices: [F::Uint; 3], without: [f32; 3], weights: [F; 2]) -> F {
    let [a, b, c] = values_of::<F>(column, vertices, without);
    a + (b - a) * weights[0] + (c - a) * weights[1]
}

/// A column's values at three vertices; `without` replaces NaN.
#[inline(always)]
fn values_of<F: Float>(column: &[f32], vertices: [F::Uint; 3], without: [f32; 3]) -> [F; 3] {
    let mut values = [F::zero(); 3];
    for (i, value) in values.iter_mut().enumerate() {
        let given = F::gather(column, vertices[i]);
        let magnitude = given.to_bits() & F::Uint::splat(i32::MAX as u32);
        let is_nan = F::Uint::splat(f32::INFINITY.to_bits()).lt(magnitude);
        *value = F::select(is_nan, F::splat(without[i]), given);
    }
    values
}
