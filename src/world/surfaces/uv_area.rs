//! The ratio of areas in uv and on surfaces, by which mipmap levels are chosen.

use super::{SurfacePoint, SurfaceTable};
use crate::math::{Float, Mask, Uint, Vec3};
use crate::world::triangles::FIRST_TRIANGLE;
use crate::world::triangles::uv::UvSet;
use std::f32::consts::PI;

/// The smallest sine of θ: closer to the poles of a sphere, ratios are those at this angle.
const LEAST_SINE: f32 = 1e-3;

impl SurfaceTable {
    /// The ratio of an area in uv to that on the surface at points; large where it is unbounded.
    #[inline(always)]
    pub fn uv_per_area<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> F {
        match &self.triangles {
            None => self.smooth_uv_per_area(point, instance),
            Some(triangles) => {
                let on_mesh = !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
                F::fork(
                    on_mesh,
                    #[inline(always)]
                    || {
                        triangles.uv_per_area(
                            UvSet::First,
                            self.instances(),
                            point.surface,
                            instance,
                            on_mesh,
                        )
                    },
                    #[inline(always)]
                    || self.smooth_uv_per_area(point, instance),
                )
            }
        }
    }

    /// The ratio on all surfaces but meshes.
    #[inline(always)]
    fn smooth_uv_per_area<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> F {
        let (mut p, mut n, row) = (point.p, point.n, point.row);
        if self.has_groups {
            (p, n) = self.point_within(p, n, instance, F::Mask::splat(true));
        }
        let across = Vec3::<F>::gather(&self.u_axis, row).cross(Vec3::gather(&self.v_axis, row));
        let mut area = across.length();
        let radius = F::gather(&self.radius, row);
        if self.has_round {
            area = F::branch(
                radius.gt(F::zero()),
                area,
                #[inline(always)]
                || {
                    // Of φ/2π and θ/π: 1/(2π²·r²·sin θ).
                    let sin = (n.x * n.x + n.y * n.y).sqrt().max(F::splat(LEAST_SINE));
                    F::splat(0.5 / (PI * PI)) / (radius * radius * sin)
                },
            );
        }
        if self.has_custom {
            area = F::branch(
                radius.lt(F::zero()),
                area,
                #[inline(always)]
                || {
                    let (kind, form) = self.custom::<F>(row);
                    form.uv_per_area(kind, p)
                },
            );
        }
        if self.has_groups {
            area = area * self.area_within(point.n, instance);
        }
        area
    }
}

#[cfg(test)]
mod tests {
    use crate::math::{Ray, Vec3};
    use crate::scene::{
        CylinderParameters, DiskParameters, Entity, Material, MatteParameters, Mesh, PlaneParameters,
        QuadParameters, Scene, Shape, SphereParameters,
    };
    use crate::world::{AcceleratorChoice, CompiledScene, World, compile};
    use glam::{DAffine3, DVec3};
    use std::sync::Arc;

    /// A scene with a single shape, either in the world or in a group with an anisotropic transform.
    fn seen(shape: Shape, within: Option<usize>) -> (CompiledScene, World) {
        let matte = MatteParameters { reflectance: [0.5; 3], roughness: 0.0 };
        let material = Material { name: "matte".into(), kind: matte.into(), ..Material::default() };
        let entities = vec![Entity { shape, within, ..Entity::default() }];
        let mut scene = Scene { materials: vec![material], entities, ..Scene::default() };
        if within.is_some() {
            let group = scene.add_group("group");
            let about = DAffine3::from_translation(DVec3::X * 4.0);
            let squeezed = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.1)
                * DAffine3::from_scale(DVec3::new(1.2, -0.8, 0.9));
            scene.add_instance("instance", group, about * squeezed * about.inverse());
        }
        let (tables, surfaces) = compile(&scene, 16, 16).expect("a scene");
        (tables, World::new(&surfaces, AcceleratorChoice::Simple))
    }

    /// The ratio of areas in uv and on the surface, from three neighbouring points.
    #[test]
    fn uv_areas_agree_with_finite_differences() {
        let mesh = Mesh {
            positions: vec![[3.0, -2.0, -2.0], [4.0, 3.0, -2.0], [3.5, 0.0, 3.0]],
            uv: vec![[0.1, 0.2], [0.9, 0.3], [0.4, 2.5]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let (normal, up) = (DVec3::new(-0.8, 0.6, 0.0), DVec3::new(0.6, 0.8, 0.0));
        let shapes: [(&str, Shape); 6] = [
            ("plane", PlaneParameters { normal, distance: -3.0 }.into()),
            (
                "quad",
                QuadParameters {
                    corner: DVec3::new(4.0, -3.0, -2.0),
                    u: DVec3::new(0.5, 6.0, 1.0),
                    v: DVec3::new(0.0, 0.4, 4.0),
                }
                .into(),
            ),
            ("sphere", SphereParameters { center: DVec3::new(5.0, 0.2, 0.1), radius: 2.0 }.into()),
            ("disk", DiskParameters { center: DVec3::new(5.0, 0.9, -0.8), normal, radius: 3.0 }.into()),
            (
                "cylinder",
                CylinderParameters {
                    from: DVec3::X * 5.0 - up * 3.0,
                    to: DVec3::X * 5.0 + up * 3.0,
                    radius: 1.5,
                }
                .into(),
            ),
            (
                "mesh",
                Shape::Mesh {
                    mesh: Arc::new(mesh),
                    transform: DAffine3::from_scale(DVec3::new(1.0, 0.7, 1.3)),
                },
            ),
        ];
        let both = shapes
            .into_iter()
            .flat_map(|(name, shape)| [(name, shape.clone(), None), (name, shape, Some(0))]);
        for (name, shape, within) in both.filter(|(name, _, within)| *name != "plane" || within.is_none()) {
            let (tables, world) = seen(shape, within);
            for [y, z] in [[0.0, 0.0], [0.05, 0.1], [-0.1, 0.07]] {
                let at = |dy: f32, dz: f32| {
                    let d = Vec3::splat([1.0, y + dy, z + dz]).normalized();
                    let ray = Ray::new(Vec3::<f32>::zero(), d);
                    let hit = world.intersect(&ray, true);
                    assert!(hit.is_some(), "{name} is not hit");
                    let point = tables.surfaces.point(&ray, &hit);
                    let uv = tables.surfaces.uv(&point, hit.instance, true);
                    (point.p, uv, tables.surfaces.uv_per_area(&point, hit.instance))
                };
                let step = 4e-3;
                let ((p, uv, ours), (p1, uv1, _), (p2, uv2, _)) =
                    (at(0.0, 0.0), at(step, 0.0), at(0.0, step));
                let area = (p1 - p).cross(p2 - p).length();
                let [a, b] = [uv1, uv2].map(|other| [0, 1].map(|i| other[i] - uv[i]));
                let expected = (a[0] * b[1] - a[1] * b[0]).abs() / area;
                assert!((ours / expected - 1.0).abs() < 0.05, "{name}: {ours}, not {expected}");
            }
        }
    }
}
