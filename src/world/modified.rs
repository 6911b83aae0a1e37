//! The materials of hits in scenes that have mixed materials, holes, back sides or maps.

use super::bent::bent_mapped;
use super::{CompiledScene, Interaction, SurfacePoint};
use crate::material::Site;
use crate::math::{Float, Vec3, function, value};

/// The modified properties of a hit.
#[derive(Clone, Copy)]
struct Modified<F: Float> {
    /// The row of the resolved material, which is no mix.
    material: F::Uint,
    /// The uv coordinates for the material.
    uv: [F; 2],
    /// The ratio of an area in these coordinates to that in the surface's own.
    uv_area: F,
    /// The opacity: the fraction of light that interacts with the surface.
    opacity: F,
    /// The shading normal.
    shading: Vec3<F>,
}

value!(Modified { material, uv, uv_area, opacity, shading });

impl CompiledScene {
    /// Interactions of rays along `ray_d` with their entities' materials resolved, in the lanes of `met`, and the
    /// opacity. The rest of the light passes straight through. Mixes choose by `number`, uniform in [0, 1). Maps change
    /// the shading normals in the lanes of `shaded` alone: shadow rays need none.
    ///
    /// Called only in scenes that [resolve materials](crate::material::MaterialTable::is_walked).
    #[inline(always)]
    pub fn modified<F: Float>(
        &self,
        at: Interaction<F>,
        ray_d: Vec3<F>,
        met: F::Mask,
        shaded: F::Mask,
        number: F,
    ) -> (Interaction<F>, F) {
        let Interaction { mut point, uv, instance, material, .. } = at;
        let own = Modified {
            material,
            uv: at.material_uv,
            uv_area: at.uv_area,
            opacity: F::splat(1.0),
            shading: point.shading,
        };
        // Blended: see `MaterialTable::bsdf`.
        let found = F::branch(
            met,
            own,
            #[inline(always)]
            || {
                function!(F, modified_surface(point, instance, material, uv, ray_d, shaded, number), {
                    F::out_of_line(
                        #[inline(always)]
                        move || self.followed(point, instance, material, uv, ray_d, shaded, number),
                    )
                })
            },
        );
        point.shading = found.shading;
        let Modified { material, uv: material_uv, uv_area, opacity, .. } = found;
        (Interaction { point, material, material_uv, uv_area, ..at }, opacity)
    }

    #[allow(
        clippy::too_many_arguments,
        reason = "they are what a hit is known by before its material is followed"
    )]
    #[inline(always)]
    fn followed<F: Float>(
        &self,
        point: SurfacePoint<F>,
        instance: F::Uint,
        material: F::Uint,
        uv: [F; 2],
        ray_d: Vec3<F>,
        shaded: F::Mask,
        number: F,
    ) -> Modified<F> {
        let mut footprint = F::zero();
        if self.materials.textures().has_mipmaps() {
            footprint = self.footprint(point, instance);
        }
        let second = self.second_uv(&point, instance);
        let site = Site { p: point.p, uv, footprint, second };
        let behind = ray_d.dot(point.n).gt(F::zero());
        let walked = self.materials.walk(material, site, behind, number);
        let mut shading = point.shading;
        if self.materials.has_maps() {
            shading = F::branch(
                shaded & walked.has_map(),
                shading,
                #[inline(always)]
                || {
                    let basis = self.surfaces.uv_basis(&point, instance);
                    let mapped = if self.materials.textures().has_second_uv() {
                        let second = self.surfaces.second_uv_basis(&point, instance);
                        self.materials.mapped_in_sets(&walked, site, point.shading, [&basis, &second])
                    } else {
                        self.materials.mapped(&walked, site, point.shading, &basis)
                    };
                    bent_mapped(mapped, point.n, -ray_d)
                },
            );
        }
        let [a, b] = walked.scale;
        Modified {
            material: walked.material,
            uv: walked.uv,
            uv_area: a * b,
            opacity: walked.opacity,
            shading,
        }
    }
}
