//! The quad that emits a texture.

use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::flat;
use super::sample::{EmittedRay, LightSample};
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Float, Rgb, Vec3};
use crate::parameter::limits::RADIANCE;
use crate::sampling::{CELLS, Grids};
use crate::shape::{Quad, Shape};
use crate::texture::{SecondUv, Site, TextureTable};

/// The number of points per side of each cell at which a texture is evaluated for a grid.
const POINTS: usize = 2;

/// A quad whose radiance is a texture. Its points are sampled in proportion to the texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturedQuad {
    /// The surface.
    quad: Quad,
    /// Whether the emitting side is the inward one.
    flipped: bool,
    /// The index of the texture in the [`TextureTable`].
    texture: u32,
    /// The start of its grid.
    grid: u32,
    /// Its mean radiance.
    mean: [f32; 3],
}

/// The radiance of a texture at points. It is never filtered, so that all paths find the same one.
#[inline(always)]
pub fn textured_radiance<F: Float>(textures: &TextureTable, texture: F::Uint, site: Site<F>) -> Rgb<F> {
    let second = SecondUv { footprint: F::zero(), ..site.second };
    limited(textures.value(texture, Site { footprint: F::zero(), second, ..site }))
}

/// The values of a texture as radiance, within its limits.
#[inline(always)]
pub(super) fn limited<F: Float>(value: Rgb<F>) -> Rgb<F> {
    let (least, most) = (F::zero(), F::splat(RADIANCE.most as f32));
    Rgb::new(value.r.max(least).min(most), value.g.max(least).min(most), value.b.max(least).min(most))
}

impl TexturedQuad {
    /// The light of a quad that emits a texture, with its grid added to others; `None` if it is black.
    pub(super) fn new(
        quad: Quad,
        flipped: bool,
        texture: u32,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<TexturedQuad> {
        let [corner, u, v] = [quad.corner, quad.u, quad.v].map(Vec3::<f32>::splat);
        let side = CELLS * POINTS;
        let mut numbers = vec![0.0; CELLS * CELLS];
        let mut sum = [0.0; 3];
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            let at = [x, y].map(|i| (i as f32 + 0.5) / side as f32);
            let p = corner + u * at[0] + v * at[1];
            let radiance = textured_radiance(textures, Wrapping(texture), Site::new(p, at, 0.0)).channels();
            numbers[y / POINTS * CELLS + x / POINTS] += grey(radiance) as f32;
            sum.iter_mut().zip(radiance).for_each(|(sum, x)| *sum += f64::from(x));
        }
        let mean = sum.map(|sum| (sum / (side * side) as f64) as f32);
        let illuminates = mean.iter().any(|&x| x > 0.0);
        illuminates.then(|| TexturedQuad { quad, flipped, texture, grid: grids.push(&numbers), mean })
    }
}

/// The coordinates along both edges of a point of the plane.
#[inline(always)]
fn shares<F: Float>(lights: &LaneLights<'_, F>, [u, v]: [Vec3<F>; 2], on: Vec3<F>) -> [F; 2] {
    let (normal, from) = (lights.normal(), on - lights.origin);
    let (across_v, across_u) = (v.cross(normal), u.cross(normal));
    [from.dot(across_v) / u.dot(across_v), from.dot(across_u) / v.dot(across_u)]
}

impl Light for TexturedQuad {
    const HAS_OWN_PDF: bool = true;

    fn row(&self) -> LightRow {
        let (quad, surface) = (&self.quad, self.quad.surface());
        LightRow {
            origin: quad.corner,
            edge_u: quad.u,
            edge_v: quad.v,
            normal: quad.normal.map(|x| if self.flipped { -x } else { x }),
            area: surface.area,
            error: surface.error,
            inward: self.flipped,
            texture: self.texture,
            grid: self.grid,
            emission: [1.0; 3],
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        let [o, u, v] = [self.quad.corner, self.quad.u, self.quad.v];
        let corner = |a: f32, b: f32| [0, 1, 2].map(|c| o[c] + a * u[c] + b * v[c]);
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)];
        Some(flat::bounds(&corners, self.row().normal, self.quad.surface().area, self.mean))
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let edges = lights.edges();
        let (at, density, radiance) = drawn(lights, edges, emission, u);
        let sample = flat::sample(lights, edges, p, radiance, at, None);
        LightSample { pdf: sample.pdf * density, ..sample }
    }

    #[inline(always)]
    fn pdf<F: Float>(
        lights: &LaneLights<'_, F>,
        _p: Vec3<F>,
        on: Vec3<F>,
        _t: F,
        _cos_light: F,
        by_area: F,
    ) -> F {
        let at = shares(lights, lights.edges(), on);
        by_area * lights.grids().density(lights.grid(), at)
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let (at, density, radiance) = drawn(lights, lights.edges(), emission, [a, b]);
        let ray = flat::emit(lights, radiance, at, [c, d]);
        EmittedRay { pdf_position: ray.pdf_position * density, ..ray }
    }
}

/// A point as coordinates along the edges, its density relative to uniform points, and its radiance.
#[inline(always)]
fn drawn<F: Float>(
    lights: &LaneLights<'_, F>,
    [u, v]: [Vec3<F>; 2],
    emission: Rgb<F>,
    numbers: [F; 2],
) -> ([F; 2], F, Rgb<F>) {
    let (grids, grid) = (lights.grids(), lights.grid());
    let at = grids.sample(grid, numbers);
    let p = lights.origin + u * at[0] + v * at[1];
    let radiance = textured_radiance(lights.textures(), lights.texture(), Site::new(p, at, F::zero()));
    (at, grids.density(grid, at), radiance * emission)
}

#[cfg(test)]
mod tests {
    use super::super::table::LightTable;
    use super::*;
    use crate::parameter::ImageIndex;
    use crate::sampling::Stream;
    use crate::shape::Piece;
    use crate::texture::{
        ColorSpace, Compiler, Depth, ImageFile, ImageTexture, Picture, TexelFilter, TextureKind, Wrap,
    };
    use glam::DVec3;
    use rand::RngExt;
    use std::sync::Arc;

    /// A quad that emits a picture of 4×2 greys, half of which is black.
    fn table(greys: [f32; 8]) -> (LightTable, u32) {
        let bytes: Vec<u8> = greys.iter().flat_map(|x| x.to_le_bytes()).collect();
        let picture = Picture::new([4, 2], [1, 1], Depth::Float, &bytes);
        let images = [ImageFile::of("greys".into(), Arc::new(picture))];
        let texture: TextureKind = ImageTexture {
            file: ImageIndex(0),
            color_space: ColorSpace::Data,
            wrap: [Wrap::Clamp; 2],
            filter: TexelFilter::Linear,
            mipmap: false,
            uv_scale: [1.0; 2],
            uv_offset: [0.0; 2],
            uv_rotate: 0.0,
            uv_set: 0.0,
        }
        .into();
        let textures = [texture];
        let mut compiler = Compiler::new(&textures, &images);
        let root = compiler.root(0);
        let mut lights = LightTable::default();
        lights.set_textures(Arc::new(compiler.finish()));
        let quad = Quad::new(DVec3::new(-1.0, -1.0, 3.0), DVec3::new(0.3, 1.0, 0.2), DVec3::X * 2.0);
        let light = lights.push_textured(&Piece::Quad(quad), false, root);
        (lights, light)
    }

    const GREYS: [f32; 8] = [3.0, 8.0, 0.0, 0.0, 5.0, 1.0, 0.0, 0.0];

    #[test]
    fn a_black_texture_is_not_a_light() {
        assert_eq!(table([0.0; 8]).1, super::super::NO_LIGHT);
        assert_eq!(table(GREYS).1, 0);
    }

    #[test]
    fn rays_carry_the_power_of_the_texture_in_nearly_equal_parts() {
        let (lights, light) = table(GREYS);
        let stream = &mut Stream::new(52, 0, 0);
        let (mut flux, mut square, mut area) = (0.0, 0.0, 0.0);
        let draws = 100_000;
        for _ in 0..draws {
            let u = [stream.random(), stream.random(), stream.random(), stream.random()];
            let emitted = lights.emit_one(Wrapping(light), u);
            let carried = f64::from(emitted.flux().g);
            flux += carried;
            square += carried * carried;
            area += f64::from(1.0 / emitted.pdf_position);
        }
        let n = f64::from(draws);
        let size = Vec3::<f32>::splat([0.3, 1.0, 0.2]).cross(Vec3::splat([2.0, 0.0, 0.0])).length();
        // The mean of the picture is that of its texels, because they are clamped.
        let mean = GREYS.iter().sum::<f32>() / 8.0;
        let power = f64::from(size * mean) * std::f64::consts::PI;
        assert!((flux / n / power - 1.0).abs() < 0.01, "{} is not {power}", flux / n);
        assert!((area / n / f64::from(size) - 1.0).abs() < 0.05, "{} is not {size}", area / n);
        // With uniformly sampled points, the mean square would be larger by this factor.
        let uniform = GREYS.iter().map(|x| x * x).sum::<f32>() / 8.0 / (mean * mean);
        let spread = square / n / (flux / n * (flux / n));
        assert!(uniform > 2.0 && spread < 1.05, "{spread}, but {uniform} if sampled uniformly");
    }

    #[test]
    fn samples_have_the_density_and_radiance_of_their_point() {
        let (lights, light) = table(GREYS);
        let stream = &mut Stream::new(53, 0, 0);
        let p = Vec3::<f32>::splat([0.3, -0.2, 0.5]);
        for _ in 0..1000 {
            let u = [stream.random(), stream.random()];
            let sample = lights.sample_one(Wrapping(light), p, u);
            let normal = Vec3::<f32>::splat([0.3, 1.0, 0.2]).cross(Vec3::splat([2.0, 0.0, 0.0]));
            let normal = normal * (1.0 / normal.length());
            let from = Vec3::splat([-1.0, -1.0, 3.0]) - p;
            let t = from.dot(normal) / sample.wi.dot(normal);
            let cos = sample.wi.dot(normal).abs();
            let on = p + sample.wi * t;
            let pdf = lights.pdf_one(Wrapping(light), p, on, t, cos);
            if sample.pdf > 0.0 {
                assert!((pdf / sample.pdf - 1.0).abs() < 0.2, "{pdf} is not {}", sample.pdf);
            }
        }
    }
}
