//! The rows of lights, stored by columns, so that each lane can look up a light of its own.

use crate::math::{Bounds, ColumnReader, Float, Mask, Rgb, Uint, Vec3, push3};
use crate::sampling::Grids;
use crate::shape::BOUNDS_ERROR;
use crate::texture::TextureTable;
use glam::DVec3;
use std::sync::Arc;

/// The row of a light in a [`LightTable`](super::LightTable). Fields that its kind does not use are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightRow {
    /// Position of a point, centre of a sphere or disk, corner of a quad or triangle, one end of a cylinder's axis.
    pub origin: [f32; 3],
    /// First edge of a quad or triangle, from the corner; a radius of a disk; the direction of the middle of a picture at
    /// infinity.
    pub edge_u: [f32; 3],
    /// Second edge; the radius at a right angle; a cylinder's axis from end to end; the direction of the quarter left of
    /// that middle.
    pub edge_v: [f32; 3],
    /// Normal of the side of a quad, triangle or disk that emits; direction of a cylinder's axis, or of a spot's; the
    /// direction to the middle of a light at infinity, or to the upper edge of a picture there.
    pub normal: [f32; 3],
    /// Radius of a sphere or cylinder; 1 − cos of the half angle of a spot's cone, or of a disk at infinity; of a picture
    /// at infinity the share of emitted rays that its grid draws.
    pub radius: f32,
    /// Area of a surface.
    pub area: f32,
    /// The surface's share of the error bound of a point on it.
    pub error: f32,
    /// Whether a surface emits against its own outward side.
    pub inward: bool,
    /// Whether a quad's sides meet at right angles.
    pub square: bool,
    /// Of a spot: the cosine less one, or the angle, of darkness,
    pub ramp_from: f32,
    /// the slope of intensity by cosine or angle,
    pub ramp_slope: f32,
    /// and the number of its [`Falloff`](super::Falloff).
    pub falloff: f32,
    /// Of a quad that emits a texture, or of a picture at infinity: the texture,
    pub texture: u32,
    /// and where its grid begins.
    pub grid: u32,
    /// Radiance; intensity of a point; irradiance by a light at infinity without a size; the factor of
    /// a texture.
    pub emission: [f32; 3],
}

/// The rows of lights, one column for each property.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    kind: Vec<u32>,
    // As in a `LightRow`.
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
    /// Centre and radius of a ball around the scene.
    extent: ([f32; 3], f32),
    /// Those that lights emit.
    pub(super) textures: Arc<TextureTable>,
    /// Those by which points of them are drawn.
    pub(super) grids: Grids,
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

    /// Gives all columns to a reader.
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

    /// Says how far the scene reaches.
    pub(super) fn set_extent(&mut self, around: Bounds) {
        let Bounds { low, high } = around.grown(BOUNDS_ERROR);
        let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
        let (centre, radius) = ((wide(low) + wide(high)) / 2.0, wide(low).distance(wide(high)) / 2.0);
        // Of nothing, and of what has no end, there is no ball.
        if radius.is_finite() {
            self.extent = (centre.to_array().map(|x| x as f32), radius as f32);
        }
    }

    /// See [`LaneLights::extent`].
    pub(super) fn extent(&self) -> &([f32; 3], f32) {
        &self.extent
    }

    /// How many lights there are.
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

/// One light for each lane: its row, looked up where it is needed (see [`LightRow`]).
#[derive(Clone, Copy)]
pub struct LaneLights<'a, F: Float> {
    columns: &'a Columns,
    pub(super) light: F::Uint,
    kind: F::Uint,
    /// See [`LightRow::origin`].
    pub origin: Vec3<F>,
}

impl<'a, F: Float> LaneLights<'a, F> {
    /// The lights of these indices.
    #[inline(always)]
    pub(super) fn new(columns: &'a Columns, light: F::Uint) -> Self {
        LaneLights {
            columns,
            light,
            kind: F::Uint::gather(&columns.kind, light),
            origin: Vec3::gather(&columns.origin, light),
        }
    }

    /// The lights of these indices, at these origins. [`LaneLights::are`] keeps to the kinds of the former ones.
    #[inline(always)]
    pub(super) fn of(&self, light: F::Uint, origin: Vec3<F>) -> Self {
        LaneLights { light, origin, ..*self }
    }

    /// Whether there are lights of a kind at all.
    #[inline(always)]
    pub(super) fn has(&self, kind: u32) -> bool {
        self.columns.has(kind)
    }

    /// Whether there are lights of any of these kinds, which are bits.
    #[inline(always)]
    pub(super) fn has_any(&self, kinds: u32) -> bool {
        self.columns.kinds & kinds != 0
    }

    /// The lanes whose light is of this kind or of one after it.
    #[inline(always)]
    pub(super) fn are_from(&self, kind: u32) -> F::Mask {
        !self.kind.lt(F::Uint::splat(kind))
    }

    /// The lanes whose light is of a kind.
    #[inline(always)]
    pub(super) fn are(&self, kind: u32) -> F::Mask {
        self.kind.eq(F::Uint::splat(kind))
    }

    /// Centre and radius of a ball around all surfaces of the scene that are bounded, for lights at infinity. The radius
    /// is zero if there is no such surface.
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

    /// The grids by which points of textures are drawn.
    #[inline(always)]
    pub fn grids(&self) -> &'a Grids {
        &self.columns.grids
    }

    /// See [`LightRow::emission`].
    #[inline(always)]
    pub fn emission(&self) -> Rgb<F> {
        Rgb::gather(&self.columns.emission, self.light)
    }
}
