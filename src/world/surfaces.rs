//! The table that hits look up: one row for each surface, one column for each property.

use super::attributes::SurfaceAttributes;
use super::triangles::uv::UvSet;
use super::triangles::{FIRST_TRIANGLE, Triangles, triangle_of};
use super::{Hit, Instances};
use crate::light::NO_LIGHT;
use crate::math::lanes::Device;
use crate::math::{ColumnReader, Float, LaneFloat, Mask, Ray, Uint, Vec3, function, push3, trig, value};
use crate::shape::{POSITION_ERROR, Surface, SurfaceKind};
use crate::texture::NO_TEXTURE;
use std::sync::Arc;

mod custom;
mod emission;
mod gradients;
mod groups;
mod second_uv;
mod uv_area;

/// All surfaces, one column for each property.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTable {
    /// A point on round and custom surfaces.
    anchor: [Vec<f32>; 3],
    /// The radius of round surfaces, zero for flat ones, and the negated number of the kind for custom ones.
    radius: Vec<f32>,
    /// The normal of flat surfaces, the vector from the anchor to the centre of round ones, the axis of custom ones.
    axis: [Vec<f32>; 3],
    /// The distance of flat surfaces, the anchor's power of round ones, the constant of custom ones.
    constant: Vec<f32>,
    error: Vec<f32>,
    u_axis: [Vec<f32>; 3],
    u_offset: Vec<f32>,
    v_axis: [Vec<f32>; 3],
    v_offset: Vec<f32>,
    /// 1, or −1 where `flip_normal` reverses a surface.
    orientation: Vec<f32>,
    emission: [Vec<f32>; 3],
    emission_texture: Vec<u32>,
    /// Whether any emission is a texture.
    has_textured_emission: bool,
    material: Vec<u32>,
    light: Vec<u32>,
    /// For a mesh that emits, the wrapping difference between a triangle's index in the light table and its own index.
    triangle_light: Vec<u32>,
    /// Whether any surface is round.
    has_round: bool,
    /// Whether any surface is custom.
    has_custom: bool,
    /// Whether any surface is in a group.
    has_groups: bool,
    rows: Vec<(Surface, SurfaceAttributes)>,
    triangles: Option<Arc<Triangles>>,
    instances: Option<Arc<Instances>>,
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<F: Float> {
    /// The point.
    pub p: Vec3<F>,
    /// Outward normal, of length one.
    pub n: Vec3<F>,
    /// The shading normal, of unit length: `n`, or the interpolated normal of a mesh, on the same side of the triangle
    /// as seen from the ray.
    pub shading: Vec3<F>,
    /// See [`Hit::weights`].
    weights: [F; 2],
    /// A bound on the distance from the point to the surface along the normal, plus the distance at which a ray may
    /// start without hitting the surface again (see [`crate::shape::offset_origin`]).
    pub error: F,
    /// The surface's number: see [`Hit::surface`].
    pub surface: F::Uint,
    /// Its row in the [`SurfaceTable`].
    pub row: F::Uint,
}

value!(SurfacePoint { p, n, shading, weights, error, surface, row });

impl SurfaceTable {
    /// Adds a row and returns its number.
    pub fn push(&mut self, surface: Surface, attributes: SurfaceAttributes) -> u32 {
        let row = self.rows.len() as u32;
        let (axis, constant) = match surface.kind {
            SurfaceKind::Round => (surface.to_centre, surface.anchor_power),
            SurfaceKind::Flat | SurfaceKind::Custom(_) => (surface.normal, surface.distance),
        };
        push3(&mut self.anchor, surface.anchor);
        self.radius.push(match surface.kind {
            SurfaceKind::Flat | SurfaceKind::Round => surface.radius,
            SurfaceKind::Custom(kind) => -(kind.number() as f32),
        });
        push3(&mut self.axis, axis);
        self.constant.push(constant);
        self.error.push(surface.error);
        let [ux, uy, uz, u_offset] = surface.u_axis;
        push3(&mut self.u_axis, [ux, uy, uz]);
        self.u_offset.push(u_offset);
        let [vx, vy, vz, v_offset] = surface.v_axis;
        push3(&mut self.v_axis, [vx, vy, vz]);
        self.v_offset.push(v_offset);
        self.orientation.push(if attributes.flip_normal { -1.0 } else { 1.0 });
        push3(&mut self.emission, attributes.emission);
        self.emission_texture.push(attributes.emission_texture);
        self.has_textured_emission |= attributes.emission_texture != NO_TEXTURE;
        self.material.push(attributes.material);
        self.light.push(attributes.light);
        self.triangle_light.push(0);
        self.has_round |= surface.kind == SurfaceKind::Round;
        self.has_custom |= matches!(surface.kind, SurfaceKind::Custom(_));
        self.rows.push((surface, attributes));
        row
    }

    /// Adds the row of a mesh whose triangles begin at `first`. If it emits, its first light is that of the attributes.
    pub fn push_mesh(&mut self, attributes: SurfaceAttributes, first: usize) -> u32 {
        let row = self.push(Surface::OF_A_MESH, attributes);
        self.triangle_light[row as usize] = attributes.light.wrapping_sub(first as u32);
        row
    }

    /// Adds the row of an instance. A mirroring transform reverses the order of its triangles' corners.
    pub fn push_instance(&mut self, attributes: SurfaceAttributes, mirrors: bool) -> u32 {
        let row = self.push(Surface::OF_A_MESH, attributes);
        if mirrors {
            self.orientation[row as usize] *= -1.0;
        }
        row
    }

    /// The number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The rows from which the table was made.
    pub fn rows(&self) -> &[(Surface, SurfaceAttributes)] {
        &self.rows
    }

    /// Sets the triangles of the rows of meshes, and the transforms of instances.
    pub fn set_triangles(&mut self, triangles: Arc<Triangles>, instances: Arc<Instances>) {
        self.triangles = (!triangles.is_empty()).then_some(triangles);
        self.has_groups = instances.has_groups();
        self.instances = (!instances.is_empty()).then_some(instances);
    }

    /// The columns that recorded programs look up, except [`Self::errors`].
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        reader.vectors("anchor", &self.anchor);
        reader.floats("radius", &self.radius);
        reader.vectors("axis", &self.axis);
        reader.floats("constant", &self.constant);
        reader.vectors("u_axis", &self.u_axis);
        reader.floats("u_offset", &self.u_offset);
        reader.vectors("v_axis", &self.v_axis);
        reader.floats("v_offset", &self.v_offset);
        reader.vectors("emission", &self.emission);
        reader.words("emission_texture", &self.emission_texture);
        reader.floats("orientation", &self.orientation);
        reader.words("material", &self.material);
        reader.words("light", &self.light);
    }

    /// The coefficients of the error bounds of hits, by rows. Devices with another rounding have other coefficients.
    pub fn errors(&self) -> &[f32] {
        &self.error
    }

    /// The triangles of all meshes.
    pub fn triangles(&self) -> Option<&Triangles> {
        self.triangles.as_deref()
    }

    /// Whether any mesh has vertex normals.
    pub fn has_shading_normals(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| triangles.has_normals)
    }

    /// The groups, the shared meshes, and their instances.
    pub fn instances(&self) -> Option<&Instances> {
        self.instances.as_deref()
    }

    /// 1, or −1 where the outward side is the opposite of the shape's own, by `flip_normal` or by a mirroring
    /// transform.
    pub fn orientation(&self, row: u32) -> f32 {
        self.orientation[row as usize]
    }

    /// The entity of a row.
    pub fn entity(&self, row: u32) -> u32 {
        self.rows[row as usize].1.entity
    }

    /// The hit point of a ray, projected onto its surface. Lanes without a hit are unspecified; the table must not be
    /// empty.
    #[inline(always)]
    pub fn point<F: Float>(&self, ray: &Ray<F>, hit: &Hit<F>) -> SurfacePoint<F> {
        let (ray, hit) = (*ray, *hit);
        function!(F, surface_point(ray, hit), {
            let met = hit.is_some();
            match &self.triangles {
                None => self.smooth_point(&ray, &hit, met),
                Some(triangles) => {
                    let smooth = hit.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
                    let on_mesh = met & !smooth;
                    F::fork(
                        on_mesh,
                        #[inline(always)]
                        || self.mesh_point(triangles, ray.d, &hit, on_mesh),
                        #[inline(always)]
                        || self.smooth_point(&ray, &hit, met & smooth),
                    )
                }
            }
        })
    }

    /// Points on meshes. Lanes outside `on_mesh` are unspecified.
    #[inline(always)]
    fn mesh_point<F: Float>(
        &self,
        triangles: &Triangles,
        ray_d: Vec3<F>,
        hit: &Hit<F>,
        on_mesh: F::Mask,
    ) -> SurfacePoint<F> {
        let instances = self.instances();
        let row = triangles.row(instances, hit, on_mesh);
        let mut orientation = F::gather(&self.orientation, row);
        if self.has_groups {
            orientation = self.side_of(hit.instance, on_mesh, orientation);
        }
        let on = triangles.point(instances, ray_d, hit, on_mesh, orientation);
        SurfacePoint {
            p: on.p,
            n: on.n,
            shading: on.shading,
            weights: hit.weights,
            error: on.error,
            surface: hit.surface,
            row,
        }
    }

    /// Points on all surfaces but meshes. Lanes outside `lanes` are unspecified.
    #[inline(always)]
    fn smooth_point<F: Float>(&self, ray: &Ray<F>, hit: &Hit<F>, lanes: F::Mask) -> SurfacePoint<F> {
        let row = hit.surface;
        let mut own = *ray;
        if self.has_groups {
            own = self.ray_within(ray, hit.instance, lanes);
        }
        let p = own.at(hit.t);
        let (axis, constant) = (Vec3::gather(&self.axis, row), F::gather(&self.constant, row));
        let mut normal = axis;
        let mut off = p.dot(normal) - constant;
        let radius = F::gather(&self.radius, row);
        (normal, off) = F::branch(
            lanes & radius.gt(F::zero()),
            (normal, off),
            #[inline(always)]
            || {
                // The distance to the centre minus the radius, as power/(distance + radius): see `Sphere`.
                let w = p - Vec3::gather(&self.anchor, row);
                let from_centre = w - axis;
                let length = from_centre.length();
                let power = w.dot(from_centre - axis) + constant;
                (from_centre * (F::splat(1.0) / length), power / (length + radius))
            },
        );
        if self.has_custom {
            let custom = lanes & radius.lt(F::zero());
            (normal, off) = F::branch(
                custom,
                (normal, off),
                #[inline(always)]
                || self.custom_point(row, p, custom),
            );
        }
        // Along the ray, the error of a far hit grows with its distance. After the projection the error grows only with
        // the coordinates.
        let mut p = p - normal * off;
        let mut error = p.max_abs() * POSITION_ERROR + F::gather(&self.error, row);
        if self.has_groups {
            (p, normal, error) = self.point_of_group((p, normal, error), hit.instance, lanes);
        }
        let n = normal * F::gather(&self.orientation, row);
        SurfacePoint { p, n, shading: n, weights: hit.weights, error, surface: hit.surface, row }
    }

    /// uv coordinates of points, in the lanes of `wanted`, as each shape defines them. `instance` is that of the hits.
    #[inline(always)]
    pub fn uv<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint, wanted: F::Mask) -> [F; 2] {
        let point = *point;
        function!(F, surface_uv(point, instance, wanted), {
            match &self.triangles {
                None => self.smooth_uv(&point, instance, wanted),
                Some(triangles) => F::fork(
                    !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE)),
                    #[inline(always)]
                    || triangles.uv(UvSet::First, point.surface, point.weights),
                    #[inline(always)]
                    || self.smooth_uv(&point, instance, wanted),
                ),
            }
        })
    }

    /// uv coordinates on all surfaces but meshes.
    #[inline(always)]
    fn smooth_uv<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint, wanted: F::Mask) -> [F; 2] {
        let (mut p, mut n, row) = (point.p, point.n, point.row);
        if self.has_groups {
            (p, n) = self.point_within(p, n, instance, wanted);
        }
        let mut uv = [
            p.dot(Vec3::gather(&self.u_axis, row)) + F::gather(&self.u_offset, row),
            p.dot(Vec3::gather(&self.v_axis, row)) + F::gather(&self.v_offset, row),
        ];
        if self.has_round {
            uv = F::branch(
                wanted & F::gather(&self.radius, row).gt(F::zero()),
                uv,
                #[inline(always)]
                || {
                    // φ/2π and θ/π from +z, of the direction from the centre.
                    let d = n * F::gather(&self.orientation, row);
                    let theta = trig::angle_turns((d.x * d.x + d.y * d.y).sqrt(), d.z);
                    [trig::angle_turns(d.y, d.x), theta * 2.0]
                },
            );
        }
        if self.has_custom {
            let custom = wanted & F::gather(&self.radius, row).lt(F::zero());
            uv = F::branch(
                custom,
                uv,
                #[inline(always)]
                || self.custom_uv(row, p, n * F::gather(&self.orientation, row), custom),
            );
        }
        uv
    }

    /// ∂p/∂u on surfaces, of any length; zero where it is undefined. `instance` is that of the hits. Lanes without a
    /// hit are unspecified.
    #[inline(always)]
    pub fn tangent<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> Vec3<F> {
        let point = *point;
        function!(F, surface_tangent(point, instance), {
            match &self.triangles {
                None => self.smooth_tangent(&point, instance),
                Some(triangles) => {
                    let on_mesh = !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
                    F::fork(
                        on_mesh,
                        #[inline(always)]
                        || triangles.tangent(self.instances(), point.surface, instance, on_mesh),
                        #[inline(always)]
                        || self.smooth_tangent(&point, instance),
                    )
                }
            }
        })
    }

    /// Tangents on all surfaces but meshes.
    #[inline(always)]
    fn smooth_tangent<F: Float>(&self, point: &SurfacePoint<F>, instance: F::Uint) -> Vec3<F> {
        let (mut p, mut n, row) = (point.p, point.n, point.row);
        if self.has_groups {
            (p, n) = self.point_within(p, n, instance, F::Mask::splat(true));
        }
        let outward = n * F::gather(&self.orientation, row);
        // On flat surfaces v does not change along the tangent; u, v and the normal are right-handed.
        let mut tangent = Vec3::gather(&self.v_axis, row).cross(outward);
        if self.has_round {
            let round = F::gather(&self.radius, row).gt(F::zero());
            tangent = Vec3::select(round, Vec3::new(-outward.y, outward.x, F::zero()), tangent);
        }
        if self.has_custom {
            let custom = F::gather(&self.radius, row).lt(F::zero());
            tangent = F::branch(
                custom,
                tangent,
                #[inline(always)]
                || self.custom_tangent(row, p, custom),
            );
        }
        if self.has_groups {
            tangent = self.tangent_of_group(tangent, instance);
        }
        tangent
    }

    /// Material rows of points.
    #[inline(always)]
    pub fn material<F: Float>(&self, point: &SurfacePoint<F>) -> F::Uint {
        F::Uint::gather(&self.material, point.row)
    }

    /// Indices in the light table, or [`NO_LIGHT`].
    #[inline(always)]
    pub fn light<F: Float>(&self, point: &SurfacePoint<F>) -> F::Uint {
        let point = *point;
        function!(F, light_of(point), {
            let light = F::Uint::gather(&self.light, point.row);
            if self.triangles.is_none() {
                return light;
            }
            F::branch(
                !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE)) & light.lt(F::Uint::splat(NO_LIGHT)),
                light,
                #[inline(always)]
                || F::device(&TriangleLight(self), point),
            )
        })
    }
}

/// The light of a triangle: the lights of a mesh are in the order of its triangles.
struct TriangleLight<'a>(&'a SurfaceTable);

impl Device for TriangleLight<'_> {
    const NAME: &'static str = "triangle_light";
    type Arguments<F: Float> = SurfacePoint<F>;
    type Output<F: Float> = F::Uint;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, point: SurfacePoint<F>) -> F::Uint {
        triangle_of::<F>(point.surface) + F::Uint::gather(&self.0.triangle_light, point.row)
    }
}
