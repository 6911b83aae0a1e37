//! The second set of uv, which only meshes have. It is zero on other surfaces.

use super::gradients::basis_of;
use super::{SurfacePoint, SurfaceTable};
use crate::material::UvBasis;
use crate::math::{Float, Uint, Vec3, function};
use crate::world::triangles::uv::UvSet;
use crate::world::triangles::{FIRST_TRIANGLE, Triangles};

/// The lanes on meshes.
#[inline(always)]
fn on_mesh<F: Float>(point: &SurfacePoint<F>) -> F::Mask {
    !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE))
}

impl SurfaceTable {
    /// The triangles, if any mesh has a second set that is kept.
    #[inline(always)]
    fn with_second_uv(&self) -> Option<&Triangles> {
        self.triangles().filter(|triangles| !triangles.second_uv[0].is_empty())
    }

    /// Second uv coordinates of points.
    #[inline(always)]
    pub fn second_uv<F: Float>(&self, point: &SurfacePoint<F>) -> [F; 2] {
        let Some(triangles) = self.with_second_uv() else { return [F::zero(); 2] };
        F::branch(
            on_mesh(point),
            [F::zero(); 2],
            #[inline(always)]
            || triangles.uv(UvSet::Second, point.surface, point.weights),
        )
    }

    /// The ratio of an area in second uv to that on the surface at points.
    #[inline(always)]
    pub fn second_uv_per_area<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> F {
        let Some(triangles) = self.with_second_uv() else { return F::zero() };
        let on_mesh = on_mesh(point);
        F::branch(
            on_mesh,
            F::zero(),
            #[inline(always)]
            || triangles.uv_per_area(UvSet::Second, self.instances(), point.surface, instance, on_mesh),
        )
    }

    /// As [`Self::uv_basis`], of second uv.
    #[inline(always)]
    pub fn second_uv_basis<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> UvBasis<F> {
        let point = *point;
        function!(F, second_uv_basis(point, instance), {
            let mut gradients = [Vec3::zero(); 2];
            if let Some(triangles) = self.with_second_uv() {
                let on_mesh = on_mesh(&point);
                gradients = F::branch(
                    on_mesh,
                    gradients,
                    #[inline(always)]
                    || {
                        triangles.uv_gradients(
                            UvSet::Second,
                            self.instances(),
                            point.surface,
                            instance,
                            on_mesh,
                        )
                    },
                );
            }
            basis_of(gradients, point.n)
        })
    }
}
