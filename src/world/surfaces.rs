//! What hits look up: one row for each surface, one column for each property.

use super::Hit;
use crate::math::trig;
use crate::math::{Float, Mask, Ray, Rgb, Uint, Vec3};
use crate::shape::{POSITION_ERROR, Surface};

/// What a surface looks like beside its form.
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

/// The light of a surface that can't be sampled as one.
pub const NO_LIGHT: u32 = u32::MAX;

/// All surfaces, one column for each property.
#[derive(Clone, Debug, Default)]
pub struct SurfaceTable {
    /// Of round surfaces.
    anchor: [Vec<f32>; 3],
    /// Zero for flat surfaces.
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
    /// 1, or −1 where `flip_normal` turns a surface round.
    orientation: Vec<f32>,
    emission: [Vec<f32>; 3],
    material: Vec<u32>,
    light: Vec<u32>,
    has_round: bool,
    rows: Vec<(Surface, Look)>,
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint<F: Float> {
    /// The point.
    pub p: Vec3<F>,
    /// Outward normal, of length one.
    pub n: Vec3<F>,
    /// How far at most the point lies off the surface, along the normal, plus how close to the surface
    /// a ray may start without meeting it again (see [`crate::shape::offset_origin`]).
    pub error: F,
    /// Row in the surface table.
    pub surface: F::Uint,
}

fn push3(columns: &mut [Vec<f32>; 3], values: [f32; 3]) {
    for (column, value) in columns.iter_mut().zip(values) {
        column.push(value);
    }
}

impl SurfaceTable {
    /// Adds a row and returns its number.
    pub fn push(&mut self, surface: Surface, look: Look) -> u32 {
        let row = self.rows.len() as u32;
        let round = surface.radius > 0.0;
        push3(&mut self.anchor, surface.anchor);
        self.radius.push(surface.radius);
        push3(&mut self.axis, if round { surface.to_centre } else { surface.normal });
        self.constant.push(if round { surface.anchor_power } else { surface.distance });
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
        self.has_round |= round;
        self.rows.push((surface, look));
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

    /// The point that a ray met, put back onto its surface. Lanes without a hit hold nonsense; the table
    /// is not empty.
    #[inline(always)]
    pub fn point<F: Float>(&self, ray: &Ray<F>, hit: &Hit<F>) -> SurfacePoint<F> {
        let row = hit.surface;
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
            normal = Vec3::select(round, from_centre * (F::splat(1.0) / length), normal);
            let power = w.dot(from_centre - axis) + constant;
            off = F::select(round, power / (length + radius), off);
        }
        // Along a far hit's ray the error grows with the distance; put back onto the surface, what is left
        // grows only with the coordinates.
        let p = p - normal * off;
        SurfacePoint {
            p,
            n: normal * F::gather(&self.orientation, row),
            error: p.max_abs() * POSITION_ERROR + F::gather(&self.error, row),
            surface: row,
        }
    }

    /// uv of points, of use in the lanes where they are wanted: see the shapes for what they mean.
    #[inline(always)]
    pub fn uv<F: Float>(&self, point: &SurfacePoint<F>, wanted: F::Mask) -> (F, F) {
        let (p, row) = (point.p, point.surface);
        let mut u = p.dot(Vec3::gather(&self.u_axis, row)) + F::gather(&self.u_offset, row);
        let mut v = p.dot(Vec3::gather(&self.v_axis, row)) + F::gather(&self.v_offset, row);
        if self.has_round {
            let round = wanted & F::gather(&self.radius, row).gt(F::zero());
            if round.any() {
                // φ/2π and θ/π from +z, of the direction from the centre.
                let d = point.n * F::gather(&self.orientation, row);
                let phi = trig::angle_turns(d.y, d.x);
                let theta = trig::angle_turns((d.x * d.x + d.y * d.y).sqrt(), d.z);
                u = F::select(round, phi, u);
                v = F::select(round, theta * 2.0, v);
            }
        }
        (u, v)
    }

    /// Material rows of points.
    #[inline(always)]
    pub fn material<F: Float>(&self, surface: F::Uint) -> F::Uint {
        F::Uint::gather(&self.material, surface)
    }

    /// Indices in the light table, or [`NO_LIGHT`].
    #[inline(always)]
    pub fn light<F: Float>(&self, surface: F::Uint) -> F::Uint {
        F::Uint::gather(&self.light, surface)
    }

    /// Radiance that surfaces emit on their outward sides.
    #[inline(always)]
    pub fn emission<F: Float>(&self, surface: F::Uint) -> Rgb<F> {
        Rgb::gather(&self.emission, surface)
    }
}
