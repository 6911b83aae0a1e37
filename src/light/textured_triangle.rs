//! The triangle of a mesh that emits a texture.

use super::area::AreaLight;
use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::corner_uv::{CornerUv, UvTriangle};
use super::flat;
use super::sample::{EmittedRay, LightSample};
use super::textured_quad::textured_radiance;
use super::triangle::Triangle;
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Float, Rgb, Vec3};
use crate::sampling::warp;
use crate::texture::TextureTable;

/// A triangle whose radiance is a texture. It is chosen by the mean of the texture over it, and sampled uniformly by
/// area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturedTriangle {
    /// The triangle, with its mean radiance, or slightly more.
    light: AreaLight<Triangle>,
    texture: u32,
    /// Its index in [`CornerUv`].
    index: u32,
}

/// The least and the most points along a side of a triangle at which a texture is evaluated for its mean.
const LEAST_POINTS: usize = 2;
const MOST_POINTS: usize = 64;

/// The number of points of a mesh, unless its triangles have more or fewer by the limits of each.
const POINTS: usize = 1 << 14;

/// The least mean radiance of a triangle, relative to that of its mesh, so that features between its points are sampled.
const LEAST_SHARE: f32 = 0.02;

/// The lights of the triangles of a mesh, with their uv added to others; none if the mesh is black.
pub(super) fn textured_mesh(
    triangles: &[UvTriangle],
    flipped: bool,
    texture: u32,
    textures: &TextureTable,
    corners: &mut CornerUv,
) -> Vec<TexturedTriangle> {
    let per_triangle = (POINTS / triangles.len().max(1)).isqrt().clamp(LEAST_POINTS, MOST_POINTS);
    let mut uv = CornerUv::default();
    triangles.iter().for_each(|triangle| uv.push(triangle));
    let means: Vec<[f32; 3]> = (0..)
        .zip(triangles)
        .map(|(index, triangle)| mean(triangle, (&uv, index), texture, textures, per_triangle))
        .collect();
    let area = |triangle: &UvTriangle| {
        let [a, b, c] = triangle.corners.map(Vec3::<f32>::splat);
        f64::from((b - a).cross(c - a).length())
    };
    let whole: f64 = triangles.iter().map(area).sum();
    let of_mesh = [0, 1, 2].map(|i| {
        let sum: f64 =
            triangles.iter().zip(&means).map(|(triangle, mean)| area(triangle) * f64::from(mean[i])).sum();
        (sum / whole) as f32
    });
    let brightness = grey(of_mesh);
    if brightness.is_nan() || brightness <= 0.0 {
        return Vec::new();
    }
    let first = corners.append(&uv);
    let light = |((index, triangle), mean): ((u32, &UvTriangle), [f32; 3])| {
        let emission = [0, 1, 2].map(|i| mean[i].max(of_mesh[i] * LEAST_SHARE));
        let light = AreaLight { shape: Triangle(triangle.corners), flipped, emission };
        TexturedTriangle { light, texture, index }
    };
    (first..).zip(triangles).zip(means).map(light).collect()
}

/// The mean radiance of a triangle, whose uv are those of an index, from the centres of `n`² equal parts.
fn mean(
    triangle: &UvTriangle,
    (uv, index): (&CornerUv, u32),
    texture: u32,
    textures: &TextureTable,
    n: usize,
) -> [f32; 3] {
    let [a, b, c] = triangle.corners.map(Vec3::<f32>::splat);
    let mut sum = [0.0; 3];
    let mut add = |x: f64, y: f64| {
        let weights = [x / n as f64, y / n as f64].map(|weight| weight as f32);
        let p = a + (b - a) * weights[0] + (c - a) * weights[1];
        let site = uv.site::<f32>(Wrapping(index), p, weights, textures.has_second_uv());
        let radiance = textured_radiance(textures, Wrapping(texture), site).channels();
        sum.iter_mut().zip(radiance).for_each(|(sum, x)| *sum += f64::from(x));
    };
    for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i as f64, j as f64))) {
        add(i + 1.0 / 3.0, j + 1.0 / 3.0);
        if i + j + 1.0 < n as f64 {
            add(i + 2.0 / 3.0, j + 2.0 / 3.0);
        }
    }
    sum.map(|sum| (sum / (n * n) as f64) as f32)
}

/// The radiance at the weights of a triangle's second and third corner.
#[inline(always)]
fn radiance<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, weights: [F; 2]) -> Rgb<F> {
    let [u, v] = lights.edges();
    let p = lights.origin + u * weights[0] + v * weights[1];
    let textures = lights.textures();
    let site = lights.corner_uv().site(lights.grid(), p, weights, textures.has_second_uv());
    textured_radiance(textures, lights.texture(), site) * emission
}

impl Light for TexturedTriangle {
    fn row(&self) -> LightRow {
        LightRow { texture: self.texture, grid: self.index, emission: [1.0; 3], ..self.light.row() }
    }

    fn bounds(&self) -> Option<LightBounds> {
        self.light.bounds()
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let weights = warp::triangle(u);
        flat::sample(lights, lights.edges(), p, radiance(lights, emission, weights), weights, None)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let weights = warp::triangle([a, b]);
        flat::emit(lights, radiance(lights, emission, weights), weights, [c, d])
    }
}
