//! The table that hits look up: one row for each surface, one column for each property.

use super::rare::Rares;
use super::triangles::{FIRST_TRIANGLE, Triangles, triangle_of};
use super::{Hit, Instances, NO_INSTANCE};
use crate::light::NO_LIGHT;
use crate::math::lanes::Device;
use crate::math::{ColumnReader, Float, LaneFloat, LaneMask, Ray, Rgb, Uint, Vec3, push3, trig, value};
use crate::shape::{Form, POSITION_ERROR, Rare, Shape, Surface};
use std::sync::Arc;

/// The properties of a surface other than its form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Row in the material table.
    pub material: u32,
    /// Radiance that leaves the outward side.
    pub emission: [f32; 3],
    /// Whether outward is the other side.
    pub flip_normal: bool,
    /// Index of the entity in the scene.
    pub entity: u32,
    /// Index in the light table, or [`NO_LIGHT`].
    pub light: u32,
}

/// The value of [`SurfaceTable::rare_index`] for other surfaces.
const NOT_RARE: u32 = u32::MAX;

/// All surfaces, one column for each property.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTable {
    /// Of round surfaces.
    anchor: [Vec<f32>; 3],
    /// Zero for others.
    radius: Vec<f32>,
    /// The normal of flat surfaces, the vector from the anchor to the centre of round ones.
    axis: [Vec<f32>; 3],
    /// The distance of flat surfaces, the anchor's power of round ones.
    constant: Vec<f32>,
    error: Vec<f32>,
    u_axis: [Vec<f32>; 3],
    u_offset: Vec<f32>,
    v_axis: [Vec<f32>; 3],
    v_offset: Vec<f32>,
    /// 1, or −1 where `flip_normal` reverses a surface.
    orientation: Vec<f32>,
    emission: [Vec<f32>; 3],
    material: Vec<u32>,
    light: Vec<u32>,
    /// For a mesh that emits, the difference between a triangle's light and its index, wrapping.
    triangle_light: Vec<u32>,
    /// Whether some are round.
    has_round: bool,
    /// The index of each row in `rare`, or [`NOT_RARE`].
    rare_index: Vec<u32>,
    /// The rare shapes, which compute themselves what the other columns hold for other surfaces.
    rare: Vec<Rare>,
    rows: Vec<(Surface, Look)>,
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
    /// The normal that light scatters around, of length one: `n`, or the normal of a mesh's vertices, on
    /// the same side of the triangle for the ray.
    pub shading: Vec3<F>,
    /// See [`Hit::weights`].
    weights: [F; 2],
    /// How far at most the point lies off the surface, along the normal, plus how close to the surface
    /// a ray may start without meeting it again (see [`crate::shape::offset_origin`]).
    pub error: F,
    /// The surface's number: see [`Hit::surface`].
    pub surface: F::Uint,
    /// Its row in the [`SurfaceTable`].
    pub row: F::Uint,
}

value!(SurfacePoint { p, n, shading, weights, error, surface, row });

impl SurfaceTable {
    /// Adds a row and returns its number.
    pub fn push(&mut self, surface: Surface, look: Look) -> u32 {
        let row = self.rows.len() as u32;
        let (axis, constant) = match surface.form {
            Form::Round => (surface.to_centre, surface.anchor_power),
            Form::Flat | Form::Rare => (surface.normal, surface.distance),
        };
        push3(&mut self.anchor, surface.anchor);
        self.radius.push(surface.radius);
        push3(&mut self.axis, axis);
        self.constant.push(constant);
        self.error.push(surface.error);
        let [ux, uy, uz, u_offset] = surface.u_axis;
        push3(&mut self.u_axis, [ux, uy, uz]);
        self.u_offset.push(u_offset);
        let [vx, vy, vz, v_offset] = surface.v_axis;
        push3(&mut self.v_axis, [vx, vy, vz]);
        self.v_offset.push(v_offset);
        self.orientation.push(if look.flip_normal { -1.0 } else { 1.0 });
        push3(&mut self.emission, look.emission);
        self.material.push(look.material);
        self.light.push(look.light);
        self.triangle_light.push(0);
        self.rare_index.push(NOT_RARE);
        self.has_round |= surface.form == Form::Round;
        self.rows.push((surface, look));
        row
    }

    /// Adds the row of a rare shape and returns its number.
    pub fn push_rare(&mut self, shape: Rare, look: Look) -> u32 {
        let row = self.push(shape.surface(), look);
        self.rare_index[row as usize] = self.rare.len() as u32;
        self.rare.push(shape);
        row
    }

    /// The rare shape of a row, if it is one's.
    pub fn rare(&self, row: u32) -> Option<&Rare> {
        self.rare.get(self.rare_index[row as usize] as usize)
    }

    /// Adds the row of a mesh whose triangles begin with `first`, and whose lights, if it emits, with the look's
    /// own.
    pub fn push_mesh(&mut self, look: Look, first: usize) -> u32 {
        let row = self.push(Surface::OF_A_MESH, look);
        self.triangle_light[row as usize] = look.light.wrapping_sub(first as u32);
        row
    }

    /// Adds the row of an instance. What `mirrors` turns the order of its triangles' corners.
    pub fn push_instance(&mut self, look: Look, mirrors: bool) -> u32 {
        let row = self.push(Surface::OF_A_MESH, look);
        if mirrors {
            self.orientation[row as usize] *= -1.0;
        }
        row
    }

    /// How many rows there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The rows that the table was made of.
    pub fn rows(&self) -> &[(Surface, Look)] {
        &self.rows
    }

    /// Gives the rows of meshes their triangles, and those of instances their places.
    pub fn set_triangles(&mut self, triangles: Arc<Triangles>, instances: Arc<Instances>) {
        self.triangles = (!triangles.is_empty()).then_some(triangles);
        self.instances = (!instances.is_empty()).then_some(instances);
    }

    /// The columns that recorded programs look rows up in: the others have a form of their own on devices.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        reader.vectors("emission", &self.emission);
        reader.words("material", &self.material);
    }

    /// The triangles of all meshes.
    pub fn triangles(&self) -> Option<&Triangles> {
        self.triangles.as_deref()
    }

    /// Whether light may scatter around other normals than the surfaces' own.
    #[inline(always)]
    pub fn has_shading_normals(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| triangles.has_normals)
    }

    /// The shared meshes, and where they stand.
    pub fn instances(&self) -> Option<&Instances> {
        self.instances.as_deref()
    }

    /// 1, or −1 where outward is the other side than the shape says: what `flip_normal` turns, or a place that mirrors.
    pub fn orientation(&self, row: u32) -> f32 {
        self.orientation[row as usize]
    }

    /// The entity of a row.
    pub fn entity(&self, row: u32) -> u32 {
        self.rows[row as usize].1.entity
    }

    /// Rows of hits.
    #[inline(always)]
    fn row<F: LaneFloat>(&self, hit: &Hit<F>) -> F::Uint {
        let Some(triangles) = &self.triangles else { return hit.surface };
        let flat = hit.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
        if !(!flat).any() {
            return hit.surface;
        }
        let mut row = hit.surface;
        if !triangles.rows.is_empty() {
            row = F::Uint::select(flat, row, F::Uint::gather(&triangles.rows, triangle_of::<F>(hit.surface)));
        }
        if let Some(instances) = &self.instances {
            let shared = !hit.instance.eq(F::Uint::splat(NO_INSTANCE));
            let of_instance = F::Uint::gather(&instances.rows, hit.instance + F::Uint::splat(u32::MAX));
            row = F::Uint::select(shared, of_instance, row);
        }
        row
    }

    /// The point that a ray met, put back onto its surface. Lanes without a hit are unspecified; the
    /// table must not be empty.
    #[inline(always)]
    pub fn point<F: Float>(&self, ray: &Ray<F>, hit: &Hit<F>) -> SurfacePoint<F> {
        F::device(&PointOf(self), (*ray, *hit))
    }

    #[inline(always)]
    fn point_in_lanes<F: LaneFloat>(&self, ray: &Ray<F>, hit: &Hit<F>) -> SurfacePoint<F> {
        let mut point = self.smooth_point(ray, hit);
        if let Some(triangles) = &self.triangles {
            let on_mesh = hit.is_some() & !hit.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
            if on_mesh.any() {
                let orientation = F::gather(&self.orientation, point.row);
                let on = triangles.point(self.instances(), ray.d, hit, on_mesh, orientation);
                point.p = Vec3::select(on_mesh, on.p, point.p);
                point.n = Vec3::select(on_mesh, on.n, point.n);
                point.shading = Vec3::select(on_mesh, on.shading, point.shading);
                point.error = F::select(on_mesh, on.error, point.error);
            }
        }
        point
    }

    /// Points on all but meshes.
    #[inline(always)]
    fn smooth_point<F: LaneFloat>(&self, ray: &Ray<F>, hit: &Hit<F>) -> SurfacePoint<F> {
        let row = self.row(hit);
        let p = ray.at(hit.t);
        let (axis, constant) = (Vec3::gather(&self.axis, row), F::gather(&self.constant, row));
        let mut normal = axis;
        let mut off = p.dot(normal) - constant;
        let radius = F::gather(&self.radius, row);
        let round = radius.gt(F::zero());
        if round.any() {
            // The distance to the centre less the radius, as power/(distance + radius): see `Sphere`.
            let w = p - Vec3::gather(&self.anchor, row);
            let from_centre = w - axis;
            let length = from_centre.length();
            let power = w.dot(from_centre - axis) + constant;
            normal = Vec3::select(round, from_centre * (F::splat(1.0) / length), normal);
            off = F::select(round, power / (length + radius), off);
        }
        if !self.rare.is_empty() {
            let (index, rare) = self.rare_lanes::<F>(row, hit.is_some());
            if rare.any() {
                let (n, distance) = Rares::new(&self.rare, rare, index, p).points();
                normal = Vec3::select(rare, n, normal);
                off = F::select(rare, distance, off);
            }
        }
        // Along a far hit's ray the error grows with the distance; put back onto the surface, what is left
        // grows only with the coordinates.
        let p = p - normal * off;
        let n = normal * F::gather(&self.orientation, row);
        SurfacePoint {
            p,
            n,
            shading: n,
            weights: hit.weights,
            error: p.max_abs() * POSITION_ERROR + F::gather(&self.error, row),
            surface: hit.surface,
            row,
        }
    }

    /// uv of points, in the lanes where they are wanted; each shape defines its own.
    #[inline(always)]
    pub fn uv<F: Float>(&self, point: &SurfacePoint<F>, wanted: F::Mask) -> [F; 2] {
        F::device(&UvOf(self), (*point, wanted))
    }

    #[inline(always)]
    fn uv_in_lanes<F: LaneFloat>(&self, point: &SurfacePoint<F>, wanted: F::Mask) -> [F; 2] {
        let (p, row) = (point.p, point.row);
        let mut u = p.dot(Vec3::gather(&self.u_axis, row)) + F::gather(&self.u_offset, row);
        let mut v = p.dot(Vec3::gather(&self.v_axis, row)) + F::gather(&self.v_offset, row);
        if self.has_round {
            let round = wanted & F::gather(&self.radius, row).gt(F::zero());
            if round.any() {
                // φ/2π and θ/π from +z, of the direction from the centre.
                let d = point.n * F::gather(&self.orientation, row);
                let theta = trig::angle_turns((d.x * d.x + d.y * d.y).sqrt(), d.z);
                u = F::select(round, trig::angle_turns(d.y, d.x), u);
                v = F::select(round, theta * 2.0, v);
            }
        }
        if !self.rare.is_empty() {
            let (index, rare) = self.rare_lanes::<F>(row, wanted);
            if rare.any() {
                let n = point.n * F::gather(&self.orientation, row);
                let (rare_u, rare_v) = Rares::new(&self.rare, rare, index, p).uv(n);
                u = F::select(rare, rare_u, u);
                v = F::select(rare, rare_v, v);
            }
        }
        if let Some(triangles) = &self.triangles {
            let on_mesh = !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE));
            if on_mesh.any() {
                let [own_u, own_v] = triangles.uv(point.surface, point.weights);
                u = F::select(on_mesh, own_u, u);
                v = F::select(on_mesh, own_v, v);
            }
        }
        [u, v]
    }

    /// Indices in `rare`, and which of some lanes have one.
    #[inline(always)]
    fn rare_lanes<F: LaneFloat>(&self, row: F::Uint, lanes: F::Mask) -> (F::Uint, F::Mask) {
        let index = F::Uint::gather(&self.rare_index, row);
        (index, lanes & index.lt(F::Uint::splat(NOT_RARE)))
    }

    /// Material rows of points.
    #[inline(always)]
    pub fn material<F: Float>(&self, point: &SurfacePoint<F>) -> F::Uint {
        F::Uint::gather(&self.material, point.row)
    }

    /// Indices in the light table, or [`NO_LIGHT`].
    #[inline(always)]
    pub fn light<F: Float>(&self, point: &SurfacePoint<F>) -> F::Uint {
        F::device(&LightOf(self), *point)
    }

    #[inline(always)]
    fn light_in_lanes<F: LaneFloat>(&self, point: &SurfacePoint<F>) -> F::Uint {
        let light = F::Uint::gather(&self.light, point.row);
        if self.triangles.is_none() {
            return light;
        }
        let of_triangle = triangle_of::<F>(point.surface) + F::Uint::gather(&self.triangle_light, point.row);
        let is_triangle =
            !point.surface.lt(F::Uint::splat(FIRST_TRIANGLE)) & light.lt(F::Uint::splat(NO_LIGHT));
        F::Uint::select(is_triangle, of_triangle, light)
    }

    /// Radiance that surfaces emit on their outward sides.
    #[inline(always)]
    pub fn emission<F: Float>(&self, point: &SurfacePoint<F>) -> Rgb<F> {
        Rgb::gather(&self.emission, point.row)
    }
}

/// [`SurfaceTable::point`].
struct PointOf<'a>(&'a SurfaceTable);

impl Device for PointOf<'_> {
    const NAME: &'static str = "surface_point";
    type Arguments<F: Float> = (Ray<F>, Hit<F>);
    type Output<F: Float> = SurfacePoint<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (ray, hit): Self::Arguments<F>) -> SurfacePoint<F> {
        self.0.point_in_lanes(&ray, &hit)
    }
}

/// [`SurfaceTable::uv`].
struct UvOf<'a>(&'a SurfaceTable);

impl Device for UvOf<'_> {
    const NAME: &'static str = "surface_uv";
    type Arguments<F: Float> = (SurfacePoint<F>, F::Mask);
    type Output<F: Float> = [F; 2];

    #[inline(always)]
    fn run<F: LaneFloat>(&self, (point, wanted): Self::Arguments<F>) -> [F; 2] {
        self.0.uv_in_lanes(&point, wanted)
    }
}

/// [`SurfaceTable::light`].
struct LightOf<'a>(&'a SurfaceTable);

impl Device for LightOf<'_> {
    const NAME: &'static str = "light_of";
    type Arguments<F: Float> = SurfacePoint<F>;
    type Output<F: Float> = F::Uint;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, point: SurfacePoint<F>) -> F::Uint {
        self.0.light_in_lanes(&point)
    }
}
