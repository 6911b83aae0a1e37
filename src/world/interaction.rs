//! Interactions of rays with surfaces: the inputs of scattering, and the rays that leave.

use super::{CompiledScene, Hit, SurfacePoint};
use crate::light::{LightSample, textured_radiance};
use crate::material::{Bsdf, Site};
use crate::math::lanes::Value;
use crate::math::{Float, Frame, Mask, Ray, Rgb, Uint, Vec3, function, value};
use crate::shape::offset_origin;
use crate::texture::{NO_TEXTURE, SecondUv};

/// The lanes in which uv coordinates are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uv {
    /// Lanes whose material or emission depends on uv.
    IfTextured,
    /// All lanes that hit a surface.
    Everywhere,
}

/// The interaction of a ray with a surface. Everything is in world space.
#[derive(Clone, Copy, Debug)]
pub struct Interaction<F: Float> {
    /// The point, its error bound, its normals and the surface's row.
    pub point: SurfacePoint<F>,
    /// The surface's uv coordinates, in the lanes that [`Uv`] selects; unspecified in others.
    pub uv: [F; 2],
    /// The uv coordinates for the material; within a square of the pattern where the entity's material is a
    /// checkerboard. Unspecified in lanes whose material does not use uv.
    pub material_uv: [F; 2],
    /// [`NO_INSTANCE`](super::NO_INSTANCE), or one more than the index in [`Instances`](super::Instances).
    pub instance: F::Uint,
    /// The row of the material at this point. Where the entity's material is a checkerboard, this is the material of
    /// the square.
    pub material: F::Uint,
    /// The ratio of an area in `material_uv` to that in `uv`, in scenes with mipmaps.
    pub uv_area: F,
    /// cos θ between the outward normal and the direction back along the ray.
    pub cos_o: F,
    /// The ray's time, which scattered rays inherit.
    pub time: F,
}

value!(Interaction { point, uv, material_uv, instance, material, uv_area, cos_o, time });

impl CompiledScene {
    /// The interactions of rays at their hits, in the lanes of `met`; other lanes are unspecified. The scene must have
    /// a surface. In scenes that [resolve materials](crate::material::MaterialTable::is_walked), the material is the
    /// entity's own until [`Self::modified`] has resolved it.
    #[inline(always)]
    pub fn interaction<F: Float>(&self, ray: &Ray<F>, hit: &Hit<F>, met: F::Mask, uv: Uv) -> Interaction<F> {
        let (ray, hit) = (*ray, *hit);
        function!(F, interaction(ray, hit, met), {
            let point = self.surfaces.point(&ray, &hit);
            let entity_material = self.surfaces.material(&point);
            let mut own = [F::zero(); 2];
            if uv == Uv::Everywhere {
                own = self.surfaces.uv(&point, hit.instance, met);
            }
            let (mut material, mut material_uv) = (entity_material, own);
            if self.materials.uses_uv() || self.surfaces.has_textured_emission() {
                let mut looks = self.materials.lanes_using_uv::<F>(material);
                if self.surfaces.has_textured_emission() {
                    looks = looks | self.has_textured_emission(&point);
                }
                let looks = met & looks;
                (own, material, material_uv) = F::guard(
                    looks,
                    (own, material, material_uv),
                    #[inline(always)]
                    || {
                        let mut own = own;
                        if uv == Uv::IfTextured {
                            own = self.surfaces.uv(&point, hit.instance, looks);
                        }
                        if self.materials.is_walked() {
                            return (own, material, own);
                        }
                        let (material, material_uv) = self.materials.resolve(material, own);
                        (own, material, material_uv)
                    },
                );
            }
            let mut uv_area = F::splat(1.0);
            if self.materials.textures().has_mipmaps() && !self.materials.is_walked() {
                uv_area = self.materials.uv_area_scale(entity_material, own);
            }
            Interaction {
                uv: own,
                material_uv,
                instance: hit.instance,
                material,
                uv_area,
                cos_o: -ray.d.dot(point.n),
                time: ray.time,
                point,
            }
        })
    }

    /// [`Self::interaction`] in a function of its own, which is compiled once for each level, because few rays need it.
    #[inline(always)]
    pub fn interaction_apart<F: Float>(
        &self,
        ray: &Ray<F>,
        hit: &Hit<F>,
        met: F::Mask,
        uv: Uv,
    ) -> Interaction<F> {
        let (ray, hit) = (*ray, *hit);
        F::out_of_line(
            #[inline(always)]
            move || self.interaction(&ray, &hit, met, uv),
        )
    }

    /// The BSDF at an interaction.
    #[inline(always)]
    pub fn bsdf<F: Float>(&self, at: &Interaction<F>) -> Bsdf<F> {
        let mut footprint = F::zero();
        if self.materials.textures().has_mipmaps() {
            footprint = self.footprint(at.point, at.instance) * at.uv_area;
        }
        let second = self.second_uv(&at.point, at.instance);
        self.materials.bsdf(at.material, Site { p: at.point.p, uv: at.material_uv, footprint, second })
    }

    /// The second set of uv at a point, in scenes whose textures use it.
    #[inline(always)]
    pub(super) fn second_uv<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> SecondUv<F> {
        let textures = self.materials.textures();
        if !textures.has_second_uv() {
            return SecondUv::none();
        }
        let point = *point;
        function!(F, second_uv(point, instance), {
            F::out_of_line(
                #[inline(always)]
                move || {
                    let mut footprint = F::zero();
                    if textures.has_mipmaps() {
                        let per_area = self.surfaces.second_uv_per_area(&point, instance);
                        footprint = self.camera.footprint(point.p) * per_area;
                    }
                    SecondUv { uv: self.surfaces.second_uv(&point), footprint }
                },
            )
        })
    }

    /// The area of a pixel's footprint in uv, in lanes that have uv. It depends only on the point and the camera.
    #[inline(always)]
    pub(super) fn footprint<F: Float>(&self, point: SurfacePoint<F>, instance: F::Uint) -> F {
        function!(F, footprint(point, instance), {
            F::out_of_line(
                #[inline(always)]
                move || self.camera.footprint(point.p) * self.surfaces.uv_per_area(&point, instance),
            )
        })
    }

    /// The shading frame: the shading normal and two tangents. The first tangent follows u if any material of the scene
    /// is anisotropic.
    #[inline(always)]
    pub fn frame<F: Float>(&self, at: &Interaction<F>) -> Frame<F> {
        self.frame_around(at, at.point.shading)
    }

    /// The frame around another normal.
    #[inline(always)]
    pub(super) fn frame_around<F: Float>(&self, at: &Interaction<F>, normal: Vec3<F>) -> Frame<F> {
        let around = Frame::around(normal);
        if !self.materials.is_anisotropic() {
            return around;
        }
        let (point, instance) = (at.point, at.instance);
        let (along, has_tangent) = F::out_of_line(
            #[inline(always)]
            move || {
                let tangent = self.surfaces.tangent(&point, instance);
                (Frame::along(normal, tangent), tangent.max_abs().gt(F::zero()))
            },
        );
        Frame::blend(has_tangent, along, around)
    }

    /// The lanes in which a direction, given in the world and in the frame, is on the same side of the surface by the
    /// true normal and by the shading normal. Elsewhere light would leak through the surface, and is dropped.
    #[inline(always)]
    pub fn passes<F: Float>(&self, at: &Interaction<F>, d: Vec3<F>, wi: Vec3<F>) -> F::Mask {
        if !self.has_shading_normals {
            return F::Mask::splat(true);
        }
        at.is_on_one_side(d, wi)
    }

    /// The lanes whose emission is a texture.
    #[inline(always)]
    fn has_textured_emission<F: Float>(&self, point: &SurfacePoint<F>) -> F::Mask {
        self.surfaces.emission_texture(point).lt(F::Uint::splat(NO_TEXTURE))
    }

    /// Radiance that the surface emits back along the ray, W·m⁻²·sr⁻¹.
    #[inline(always)]
    pub fn emitted<F: Float>(&self, at: &Interaction<F>) -> Rgb<F> {
        let mut emission = self.surfaces.emission(&at.point);
        if self.surfaces.has_textured_emission() {
            emission = F::branch(
                self.has_textured_emission(&at.point),
                emission,
                #[inline(always)]
                || {
                    let texture = self.surfaces.emission_texture(&at.point);
                    let second = self.second_uv(&at.point, at.instance);
                    let site = Site { p: at.point.p, uv: at.uv, footprint: F::zero(), second };
                    textured_radiance(self.materials.textures(), texture, site)
                },
            );
        }
        emission.only(at.cos_o.gt(F::zero()))
    }
}

impl<F: Float> Interaction<F> {
    #[inline(always)]
    fn is_on_one_side(&self, d: Vec3<F>, wi: Vec3<F>) -> F::Mask {
        (d.dot(self.point.n) * wi.z).gt(F::zero())
    }

    /// The origin of a ray towards `d` that does not hit the surface where it starts.
    #[inline(always)]
    fn origin(&self, d: Vec3<F>) -> Vec3<F> {
        offset_origin(self.point.p, self.point.n, self.point.error, d)
    }

    /// The scattered ray towards the unit direction `d`.
    #[inline(always)]
    pub fn scattered(&self, d: Vec3<F>) -> Ray<F> {
        Ray { o: self.origin(d), d, time: self.time }
    }

    /// The shadow ray to a sample of a light, and the distance before which a hit occludes it.
    #[inline(always)]
    pub fn shadow(&self, light: &LightSample<F>) -> (Ray<F>, F) {
        let (ray, length) = light.shadow_ray(self.origin(light.wi));
        (Ray { time: self.time, ..ray }, length)
    }

    /// The ray that hit the surface, continued beyond it.
    #[inline(always)]
    pub fn straight_on(&self, ray: &Ray<F>) -> Ray<F> {
        self.scattered(ray.d)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::NO_LIGHT;
    use crate::math::lanes::scalar::Wrapping;
    use crate::shape::{Plane, Shape};
    use crate::world::{SurfaceAttributes, SurfaceTable};

    #[test]
    fn rays_start_on_the_side_of_their_direction() {
        let plane = Plane { normal: [0.0, 0.0, 1.0], distance: 3.0 };
        let attributes = SurfaceAttributes {
            material: 0,
            emission: [0.0; 3],
            emission_texture: NO_TEXTURE,
            flip_normal: false,
            entity: 0,
            light: NO_LIGHT,
        };
        let mut table = SurfaceTable::default();
        table.push(plane.surface(), attributes);
        let ray =
            Ray { time: 0.25, ..Ray::new(Vec3::splat([1.0, 2.0, 10.0]), Vec3::splat([0.0, 0.0, -1.0])) };
        let hit = Hit { t: plane.intersect(&ray), surface: Wrapping(0), ..Hit::<f32>::none() };
        let at = Interaction {
            point: table.point(&ray, &hit),
            uv: [0.0; 2],
            material_uv: [0.0; 2],
            instance: hit.instance,
            material: Wrapping(0),
            uv_area: 1.0,
            cos_o: 1.0,
            time: ray.time,
        };
        let (back, on) = (at.scattered(-ray.d), at.straight_on(&ray));
        assert!(back.o.z > 3.0 && on.o.z < 3.0, "{back:?} {on:?}");
        assert_eq!([plane.intersect(&back), plane.intersect(&on)], [f32::INFINITY; 2]);
        assert_eq!(on.d, ray.d);
        assert_eq!([back.time, on.time], [0.25; 2]);
        // Light from below the shading surface and above the true one, or the reverse, would leak.
        let up = Vec3::splat([0.0, 0.0, 1.0]);
        let passes = |d: Vec3<f32>, wi| at.is_on_one_side(d, wi);
        assert!(passes(up, up) && passes(-up, -up) && !passes(up, -up) && !passes(-up, up));
    }
}
