//! The uv of triangles that emit a texture.

use crate::math::{ColumnReader, Float, Vec3, push3};
use crate::texture::{SecondUv, Site};

/// A triangle with its uv, as the part of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTriangle {
    /// The corners.
    pub corners: [[f32; 3]; 3],
    /// Their uv.
    pub uv: [[f32; 2]; 3],
    /// Their uv of the second set.
    pub second_uv: [[f32; 2]; 3],
}

/// The uv of the corners of textured triangles, one column for each corner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CornerUv {
    u: [Vec<f32>; 3],
    v: [Vec<f32>; 3],
    second_u: [Vec<f32>; 3],
    second_v: [Vec<f32>; 3],
}

impl CornerUv {
    /// Adds a triangle.
    pub(super) fn push(&mut self, triangle: &UvTriangle) {
        push3(&mut self.u, triangle.uv.map(|[u, _]| u));
        push3(&mut self.v, triangle.uv.map(|[_, v]| v));
        push3(&mut self.second_u, triangle.second_uv.map(|[u, _]| u));
        push3(&mut self.second_v, triangle.second_uv.map(|[_, v]| v));
    }

    /// Adds the triangles of another one and returns the index of the first.
    pub(super) fn append(&mut self, other: &CornerUv) -> u32 {
        let first = self.u[0].len() as u32;
        let CornerUv { u, v, second_u, second_v } = self;
        for (own, others) in
            [(u, &other.u), (v, &other.v), (second_u, &other.second_u), (second_v, &other.second_v)]
        {
            own.iter_mut().zip(others).for_each(|(own, others)| own.extend(others));
        }
        first
    }

    /// Visits the columns.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let CornerUv { u, v, second_u, second_v } = self;
        reader.vectors("u", u);
        reader.vectors("v", v);
        reader.vectors("second_u", second_u);
        reader.vectors("second_v", second_v);
    }

    /// The place on triangles at the weights of their second and third corner.
    #[inline(always)]
    pub(super) fn site<F: Float>(
        &self,
        triangle: F::Uint,
        p: Vec3<F>,
        weights: [F; 2],
        has_second: bool,
    ) -> Site<F> {
        let mut site = Site::new(
            p,
            [between(&self.u, triangle, weights), between(&self.v, triangle, weights)],
            F::zero(),
        );
        if has_second {
            let uv = [between(&self.second_u, triangle, weights), between(&self.second_v, triangle, weights)];
            site.second = SecondUv { uv, footprint: F::zero() };
        }
        site
    }
}

/// A number of the corners of triangles at the weights of their second and third corner.
#[inline(always)]
fn between<F: Float>(columns: &[Vec<f32>; 3], triangle: F::Uint, weights: [F; 2]) -> F {
    let Vec3::<F> { x: a, y: b, z: c } = Vec3::gather(columns, triangle);
    a + (b - a) * weights[0] + (c - a) * weights[1]
}
