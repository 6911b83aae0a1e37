//! Hits on surfaces of groups other than triangles. They are completed in the group's own space and transformed to the
//! world.
//!
//! All of it is behind [`SurfaceTable::has_groups`], in separate functions: scenes without groups pay nothing.

use super::SurfaceTable;
use crate::math::{Float, Ray, Vec3};
use crate::world::rarely;
use crate::world::triangles::is_shared;

impl SurfaceTable {
    /// Rays in the spaces of the groups that they hit; other rays are unchanged.
    #[inline(always)]
    pub(super) fn ray_within<F: Float>(&self, ray: &Ray<F>, instance: F::Uint, lanes: F::Mask) -> Ray<F> {
        rarely();
        let Some(instances) = self.instances() else { return *ray };
        F::branch(
            lanes & is_shared::<F>(instance),
            *ray,
            #[inline(always)]
            || {
                F::out_of_line(
                    #[inline(always)]
                    || instances.gather::<F>(instance).ray(ray),
                )
            },
        )
    }

    /// World-space points, outward unit normals, and error bounds, where the hit is in a group.
    #[inline(always)]
    pub(super) fn point_of_group<F: Float>(
        &self,
        (p, n, error): (Vec3<F>, Vec3<F>, F),
        instance: F::Uint,
        lanes: F::Mask,
    ) -> (Vec3<F>, Vec3<F>, F) {
        rarely();
        let Some(instances) = self.instances() else { return (p, n, error) };
        F::branch(
            lanes & is_shared::<F>(instance),
            (p, n, error),
            #[inline(always)]
            || {
                F::out_of_line(
                    #[inline(always)]
                    || {
                        let place = instances.gather::<F>(instance);
                        let (p, n) = (place.point(p), place.long_normal(n));
                        let length = n.length();
                        (p, n * (F::splat(1.0) / length), place.error_along(p, length, error))
                    },
                )
            },
        )
    }

    /// Points and unit normals, transformed from the world to the spaces of their groups.
    #[inline(always)]
    pub(super) fn point_within<F: Float>(
        &self,
        p: Vec3<F>,
        n: Vec3<F>,
        instance: F::Uint,
        lanes: F::Mask,
    ) -> (Vec3<F>, Vec3<F>) {
        rarely();
        let Some(instances) = self.instances() else { return (p, n) };
        F::branch(
            lanes & is_shared::<F>(instance),
            (p, n),
            #[inline(always)]
            || {
                F::out_of_line(
                    #[inline(always)]
                    || {
                        let place = instances.gather::<F>(instance);
                        (place.point_within(p), place.normal_within(n).normalized())
                    },
                )
            },
        )
    }

    /// Directions on surfaces, transformed to the world from the spaces of their groups.
    #[inline(always)]
    pub(super) fn tangent_of_group<F: Float>(&self, tangent: Vec3<F>, instance: F::Uint) -> Vec3<F> {
        rarely();
        let Some(instances) = self.instances() else { return tangent };
        F::branch(
            is_shared::<F>(instance),
            tangent,
            #[inline(always)]
            || instances.gather::<F>(instance).vector(tangent),
        )
    }

    /// Gradients of u and of v in the world, of those in the spaces of groups, along surfaces with world-space normals
    /// `n`. Gradients transform as normals do. A transform with anisotropic scale may turn them out of the surface, so
    /// they are projected onto it.
    #[inline(always)]
    pub(super) fn gradients_of_group<F: Float>(
        &self,
        gradients: [Vec3<F>; 2],
        n: Vec3<F>,
        instance: F::Uint,
    ) -> [Vec3<F>; 2] {
        rarely();
        let Some(instances) = self.instances() else { return gradients };
        F::branch(
            is_shared::<F>(instance),
            gradients,
            #[inline(always)]
            || {
                let place = instances.gather::<F>(instance);
                let [u, v] = gradients;
                let [u, v] = [place.long_normal(u), place.long_normal(v)];
                [u - n * n.dot(u), v - n * n.dot(v)]
            },
        )
    }

    /// The ratio of an area in a group's space to that in the world, on surfaces with world-space normals `n`; one
    /// elsewhere.
    #[inline(always)]
    pub(super) fn area_within<F: Float>(&self, n: Vec3<F>, instance: F::Uint) -> F {
        rarely();
        let one = F::splat(1.0);
        let Some(instances) = self.instances() else { return one };
        F::branch(
            is_shared::<F>(instance),
            one,
            #[inline(always)]
            || {
                let place = instances.gather::<F>(instance);
                place.normal_within(n).length() / place.volume()
            },
        )
    }

    /// Orientations of triangles, reversed in mirrored groups, whose corners are in the opposite order.
    #[inline(always)]
    pub(super) fn side_of<F: Float>(&self, instance: F::Uint, lanes: F::Mask, orientation: F) -> F {
        rarely();
        let Some(instances) = self.instances() else { return orientation };
        F::branch(
            lanes & is_shared::<F>(instance),
            orientation,
            #[inline(always)]
            || orientation * instances.gather::<F>(instance).side,
        )
    }
}
