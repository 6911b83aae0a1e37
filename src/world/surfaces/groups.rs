//! Hits on surfaces of groups other than triangles: they are completed in the group's own space, and taken to the world.
//!
//! All of it is behind [`SurfaceTable::has_groups`], in functions of their own: scenes without groups pay nothing.

use super::SurfaceTable;
use crate::math::{Float, Ray, Vec3};
use crate::world::rarely;
use crate::world::triangles::is_shared;

impl SurfaceTable {
    /// Rays in the own spaces of their hits' groups, where they are in one.
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

    /// Points, outward normals of length one, and error bounds in the world, of those in groups.
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

    /// Points and normals of length one in their own groups' spaces, of those in the world.
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

    /// Directions on surfaces in the world, of those in groups.
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

    /// Gradients of u and of v in the world along surfaces with normals `n` in the world, of those in groups' spaces: what
    /// they are of changes as much along an image as along what it is the image of, so that they go as normals do. Squeezed,
    /// they may leave the surface, along which there is only a part of them.
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

    /// The area in a group's space for each area in the world, on surfaces with normals `n` in the world; one elsewhere.
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

    /// Orientations of triangles, turned where their groups are mirrored, which turns the order of their corners.
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
