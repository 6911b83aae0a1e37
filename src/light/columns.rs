//! The rows of lights, stored by columns, in which each lane can look up a light of its own.

use super::corner_uv::CornerUv;
use crate::math::{Bounds, ColumnReader, Float, Mask, Rgb, Uint, Vec3, push3};
use crate::sampling::Grids;
use crate::shape::BOUNDS_ERROR;
use crate::texture::TextureTable;
use glam::DVec3;
use std::sync::Arc;

/// The row of a light in a [`LightTable`](super::LightTable). Fields that its kind does not use are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightRow {
    /// The position of a point, the centre of a sphere or disk, a corner of a quad or triangle, or one end of a
    /// cylinder's axis.
    pub origin: [f32; 3],
    /// The first edge of a quad or triangle from the corner, a radius of a disk, or the direction of the central column
    /// of an environment map.
    pub edge_u: [f32; 3],
    /// The second edge, the radius perpendicular to the first, a cylinder's axis from end to end, or the direction of
    /// the column a quarter of the map to the left of the centre. For a textured sphere, disk or cylinder, both edges
    /// are perpendicular radii.
    pub edge_v: [f32; 3],
    /// The normal of the emitting side of a quad, triangle or disk, the direction of the axis of a cylinder or spot,
    /// the direction to the centre of a light at infinity, or to the upper edge of an environment map. For a textured
    /// sphere, disk or cylinder, the axis of uv.
    pub normal: [f32; 3],
    /// The radius of a sphere or cylinder; 1 − cos of the half angle of a spot's cone or of a disk at infinity; for an
    /// environment map, the fraction of emitted rays sampled by its grid.
    pub radius: f32,
    /// The area of a surface.
    pub area: f32,
    /// The surface's contribution to the error bound of a point on it.
    pub error: f32,
    /// Whether a surface emits on its inward side.
    pub inward: bool,
    /// Whether a quad's sides are perpendicular.
    pub square: bool,
    /// For a spot: the value at which its intensity reaches zero, as the cosine minus one or as an angle.
    pub ramp_from: f32,
    /// For a spot: the slope of the intensity by cosine or by angle.
    pub ramp_slope: f32,
    /// For a spot: the number of its [`Falloff`](super::Falloff). For a textured sphere, disk or cylinder: that of its
    /// profile.
    pub falloff: f32,
    /// For a textured surface or an environment map: the texture.
    pub texture: u32,
    /// For a textured surface or an environment map: the start of its grid; for a textured triangle, its index in
    /// [`CornerUv`].
    pub grid: u32,
    /// Radiance; intensity of a point light; irradiance of a light at infinity without a size; scale factor of a
    /// texture.
    pub emission: [f32; 3],
}

/// The rows of lights, one column for each property.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    kind: Vec<u32>,
    // See [`LightRow`].
    origin: [Vec<f32>; 3],
    edge_u: [Vec<f32>; 3],
    edge_v: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    radius: Vec<f32>,
    area: Vec<f32>,
    error: Vec<f32>,
    /// 1 for yes.
    inward: Vec<f32>,
    /// 1 for yes.
    square: Vec<f32>,
    ramp_from: Vec<f32>,
    ramp_slope: Vec<f32>,
    falloff: Vec<f32>,
    texture: Vec<u32>,
    grid: Vec<u32>,
    emission: [Vec<f32>; 3],
    /// Bit `k` is set if some light is of kind `k`.
    kinds: u32,
    /// The centre and radius of a ball around the scene.
    extent: ([f32; 3], f32),
    /// The textures that lights emit.
    pub(super) textures: Arc<TextureTable>,
    /// The grids by which points of textures are sampled.
    pub(super) grids: Grids,
    /// The uv of textured triangles.
    pub(super) corner_uv: CornerUv,
}

impl Columns {
    /// Adds a light of a kind.
    pub(super) fn push(&mut self, kind: u32, row: &LightRow) {
        let LightRow {
            origin,
            edge_u,
            edge_v,
            normal,
            radius,
            area,
            error,
            inward,
            square,
            ramp_from,
            ramp_slope,
            falloff,
            texture,
            grid,
            emission,
        } = *row;
        self.kind.push(kind);
        push3(&mut self.origin, origin);
        push3(&mut self.edge_u, edge_u);
        push3(&mut self.edge_v, edge_v);
        push3(&mut self.normal, normal);
        self.radius.push(radius);
        self.area.push(area);
        self.error.push(error);
        self.inward.push(f32::from(u8::from(inward)));
        self.square.push(f32::from(u8::from(square)));
        self.ramp_from.push(ramp_from);
        self.ramp_slope.push(ramp_slope);
        self.falloff.push(falloff);
        self.texture.push(texture);
        self.grid.push(grid);
        push3(&mut self.emission, emission);
        self.kinds |= 1 << kind;
    }

    /// Visits all columns.
    pub(super) fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let Columns {
            kind,
            origin,
            edge_u,
            edge_v,
            normal,
            radius,
            area,
            error,
            inward,
            square,
            ramp_from,
            ramp_slope,
            falloff,
            texture,
            grid,
            emission,
            kinds: _,
            extent: _,
            textures: _,
            grids: _,
            corner_uv: _,
        } = self;
        reader.words("kind", kind);
        reader.vectors("origin", origin);
        reader.vectors("edge_u", edge_u);
        reader.vectors("edge_v", edge_v);
        reader.vectors("normal", normal);
        reader.floats("radius", radius);
        reader.floats("area", area);
        reader.floats("error", error);
        reader.floats("inward", inward);
        reader.floats("square", square);
        reader.floats("ramp_from", ramp_from);
        reader.floats("ramp_slope", ramp_slope);
        reader.floats("falloff", falloff);
        reader.words("texture", texture);
        reader.words("grid", grid);
        reader.vectors("emission", emission);
    }

    /// Sets the extent of the scene.
    pub(super) fn set_extent(&mut self, around: Bounds) {
        let Bounds { low, high } = around.grown(BOUNDS_ERROR);
        let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
        let (centre, radius) = ((wide(low) + wide(high)) / 2.0, wide(low).distance(wide(high)) / 2.0);
        // There is no ball around empty or infinite bounds.
        if radius.is_finite() {
            self.extent = (centre.to_array().map(|x| x as f32), radius as f32);
        }
    }

    /// See [`LaneLights::extent`].
    pub(super) fn extent(&self) -> &([f32; 3], f32) {
        &self.extent
    }

    /// The number of lights.
    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.kind.len()
    }

    /// Whether some light is of a kind.
    #[inline(always)]
    pub(super) fn has(&self, kind: u32) -> bool {
        self.kinds >> kind & 1 != 0
    }

    /// The kinds of all lights.
    pub(super) fn kinds(&self) -> &[u32] {
        &self.kind
    }

    /// The lanes whose light is of a kind.
    #[inline(always)]
    pub(super) fn are<F: Float>(&self, light: F::Uint, kind: u32) -> F::Mask {
        if !self.has(kind) {
            return F::Mask::splat(false);
        }
        F::Uint::gather(&self.kind, light).eq(F::Uint::splat(kind))
    }
}

/// One light per lane: its row, looked up on demand (see [`LightRow`]).
#[derive(Clone, Copy)]
pub struct LaneLights<'a, F: Float> {
    columns: &'a Columns,
    pub(super) light: F::Uint,
    kind: F::Uint,
    /// See [`LightRow::origin`].
    pub origin: Vec3<F>,
}

impl<'a, F: Float> LaneLights<'a, F> {
    /// The lights with these indices.
    #[inline(always)]
    pub(super) fn new(columns: &'a Columns, light: F::Uint) -> Self {
        LaneLights {
            columns,
            light,
            kind: F::Uint::gather(&columns.kind, light),
            origin: Vec3::gather(&columns.origin, light),
        }
    }

    /// The lights with these indices, at these origins. [`LaneLights::are`] keeps to the kinds of the former ones.
    #[inline(always)]
    pub(super) fn of(&self, light: F::Uint, origin: Vec3<F>) -> Self {
        LaneLights { light, origin, ..*self }
    }

    /// Whether there are lights of a kind at all.
    #[inline(always)]
    pub(super) fn has(&self, kind: u32) -> bool {
        self.columns.has(kind)
    }

    /// Whether there are lights of any of these kinds, given as bits.
    #[inline(always)]
    pub(super) fn has_any(&self, kinds: u32) -> bool {
        self.columns.kinds & kinds != 0
    }

    /// The lanes whose light is of this kind or a later one.
    #[inline(always)]
    pub(super) fn are_from(&self, kind: u32) -> F::Mask {
        !self.kind.lt(F::Uint::splat(kind))
    }

    /// The lanes whose light is of a kind.
    #[inline(always)]
    pub(super) fn are(&self, kind: u32) -> F::Mask {
        self.kind.eq(F::Uint::splat(kind))
    }

    /// The centre and radius of a ball around all bounded surfaces of the scene, for lights at infinity. The radius is
    /// zero if there are none.
    #[inline(always)]
    pub fn extent(&self) -> (Vec3<F>, F) {
        let (centre, radius) = &self.columns.extent;
        (Vec3::given(centre), F::given(radius))
    }

    /// See [`LightRow::edge_u`] and [`LightRow::edge_v`].
    #[inline(always)]
    pub fn edges(&self) -> [Vec3<F>; 2] {
        [Vec3::gather(&self.columns.edge_u, self.light), Vec3::gather(&self.columns.edge_v, self.light)]
    }

    /// See [`LightRow::edge_v`].
    #[inline(always)]
    pub fn edge_v(&self) -> Vec3<F> {
        Vec3::gather(&self.columns.edge_v, self.light)
    }

    /// See [`LightRow::normal`].
    #[inline(always)]
    pub fn normal(&self) -> Vec3<F> {
        Vec3::gather(&self.columns.normal, self.light)
    }

    /// See [`LightRow::radius`].
    #[inline(always)]
    pub fn radius(&self) -> F {
        F::gather(&self.columns.radius, self.light)
    }

    /// See [`LightRow::area`].
    #[inline(always)]
    pub fn area(&self) -> F {
        F::gather(&self.columns.area, self.light)
    }

    /// See [`LightRow::error`].
    #[inline(always)]
    pub fn error(&self) -> F {
        F::gather(&self.columns.error, self.light)
    }

    /// See [`LightRow::inward`].
    #[inline(always)]
    pub fn inward(&self) -> F::Mask {
        F::gather(&self.columns.inward, self.light).gt(F::zero())
    }

    /// See [`LightRow::square`].
    #[inline(always)]
    pub fn square(&self) -> F::Mask {
        F::gather(&self.columns.square, self.light).gt(F::zero())
    }

    /// See [`LightRow::ramp_from`], [`LightRow::ramp_slope`] and [`LightRow::falloff`].
    #[inline(always)]
    pub fn ramp(&self) -> [F; 3] {
        [
            F::gather(&self.columns.ramp_from, self.light),
            F::gather(&self.columns.ramp_slope, self.light),
            F::gather(&self.columns.falloff, self.light),
        ]
    }

    /// See [`LightRow::texture`].
    #[inline(always)]
    pub fn texture(&self) -> F::Uint {
        F::Uint::gather(&self.columns.texture, self.light)
    }

    /// See [`LightRow::grid`].
    #[inline(always)]
    pub fn grid(&self) -> F::Uint {
        F::Uint::gather(&self.columns.grid, self.light)
    }

    /// The textures that lights emit.
    #[inline(always)]
    pub fn textures(&self) -> &'a TextureTable {
        &self.columns.textures
    }

    /// The grids by which points of textures are sampled.
    #[inline(always)]
    pub fn grids(&self) -> &'a Grids {
        &self.columns.grids
    }

    /// The uv of the corners of textured triangles.
    #[inline(always)]
    pub fn corner_uv(&self) -> &'a CornerUv {
        &self.columns.corner_uv
    }

    /// See [`LightRow::emission`].
    #[inline(always)]
    pub fn emission(&self) -> Rgb<F> {
        Rgb::gather(&self.columns.emission, self.light)
    }
}
