//! Gradients of uv along surfaces, for normal and height maps.

use super::{SurfacePoint, SurfaceTable};
use crate::material::UvBasis;
use crate::math::{Float, Mask, Uint, Vec3, function};
use crate::world::triangles::FIRST_TRIANGLE;
use crate::world::triangles::uv::UvSet;
use std::f32::consts::PI;

/// The smallest sine of θ: closer to the poles of a sphere, gradients are those at this angle.
const LEAST_SINE: f32 = 1e-3;

impl SurfaceTable {
    /// ∂p/∂u and ∂p/∂v on surfaces at points; zero where the uv mapping is degenerate.
    #[inline(always)]
    pub fn uv_basis<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> UvBasis<F> {
        let point = *point;
        function!(F, uv_basis(point, instance), { basis_of(self.uv_gradients(&point, instance), point.n) })
    }
    /// The gradients of u and of v along surfaces at points.
    #[inline(always)]
    fn uv_gradients<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> [Vec3<F>; 2] {
        match &self.triangles {
            None => self.smooth_uv_gradients(point, instance),
            Some(triangles) => {
                let on_mesh = !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
                F::fork(
                    on_mesh,
                    #[inline(always)]
                    || {
                        triangles.uv_gradients(
                            UvSet::First,
                            self.instances(),
                            point.surface,
                            instance,
                            on_mesh,
                        )
                    },
                    #[inline(always)]
                    || self.smooth_uv_gradients(point, instance),
                )
            }
        }
    }

    /// Gradients on all surfaces but meshes.
    #[inline(always)]
    fn smooth_uv_gradients<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> [Vec3<F>; 2] {
        let (mut p, mut n, row) = (point.p, point.n, point.row);
        if self.has_groups {
            (p, n) = self.point_within(p, n, instance, F::Mask::splat(true));
        }
        let mut gradients = [Vec3::gather(&self.u_axis, row), Vec3::gather(&self.v_axis, row)];
        let radius = F::gather(&self.radius, row);
        if self.has_round {
            gradients = F::branch(
                radius.gt(F::zero()),
                gradients,
                #[inline(always)]
                || {
                    // Of φ/2π and θ/π, where d is the direction from the centre, and sin θ the length of its component
                    // perpendicular to the z axis.
                    let d = n * F::gather(&self.orientation, row);
                    let sin2 = (d.x * d.x + d.y * d.y).max(F::splat(LEAST_SINE * LEAST_SINE));
                    let (of_u, of_v) =
                        (F::splat(0.5 / PI) / (radius * sin2), F::splat(1.0 / PI) / (radius * sin2.sqrt()));
                    [Vec3::new(-d.y, d.x, F::zero()) * of_u, Vec3::new(d.x * d.z, d.y * d.z, -sin2) * of_v]
                },
            );
        }
        if self.has_custom {
            gradients = F::branch(
                radius.lt(F::zero()),
                gradients,
                #[inline(always)]
                || {
                    let (kind, form) = self.custom::<F>(row);
                    form.uv_gradients(kind, p)
                },
            );
        }
        if self.has_groups {
            gradients = self.gradients_of_group(gradients, point.n, instance);
        }
        gradients
    }
}

/// The basis with these gradients of uv on a surface with this normal.
#[inline(always)]
pub(super) fn basis_of<F: Float>([gradient_u, gradient_v]: [Vec3<F>; 2], n: Vec3<F>) -> UvBasis<F> {
    // Computed from unit vectors, because the lengths of gradients differ by many orders of magnitude.
    let (of_u, of_v) = (unit_length(gradient_u), unit_length(gradient_v));
    let none = Vec3::zero();
    let u = Vec3::select(of_u.gt(F::zero()), gradient_u * of_u, none);
    let v = Vec3::select(of_v.gt(F::zero()), gradient_v * of_v, none);
    let turn = u.cross(v).dot(n);
    // Parallel or zero gradients.
    let is_sound = turn.abs().gt(F::splat(1e-6));
    let per_turn = (F::splat(1.0) / turn).only(is_sound);
    UvBasis {
        gradient_u,
        gradient_v,
        along_u: v.cross(n) * (per_turn * of_u),
        along_v: n.cross(u) * (per_turn * of_v),
    }
}

/// The inverse length of a vector; zero for a zero vector.
#[inline(always)]
fn unit_length<F: Float>(v: Vec3<F>) -> F {
    let most = v.max_abs();
    let has_one = most.gt(F::zero()) & most.lt(F::splat(f32::INFINITY));
    let scale = F::splat(1.0) / F::select(has_one, most, F::splat(1.0));
    let length = (v * scale).length();
    (scale / length.max(F::splat(1.0))).only(has_one)
}
