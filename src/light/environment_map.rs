//! The environment map: light from infinity, given by a picture.

use super::bounds::LightBounds;
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, Escaped, LightSample};
use super::textured_quad::limited;
use crate::math::trig::{angle_turns, sin_cos_turns};
use crate::math::{BELOW_ONE, Float, Frame, Mask, Rgb, Vec3, narrow};
use crate::parameter::limits::RADIANCE;
use crate::sampling::{Grids, MOST_POINTS, SmoothPoint, warp};
use crate::texture::TextureTable;
use glam::DVec3;
use std::f64::consts::PI;

/// The parameters of an environment map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentMapParameters {
    /// The index of the picture in the [`TextureTable`]. It must be an image in the equirectangular projection, without
    /// transformed uv, repeated along u and clamped along v.
    pub texture: u32,
    /// The scale factor of its radiance.
    pub scale: [f64; 3],
    /// The rotation about `up` in radians, counter-clockwise seen from above.
    pub rotate: f64,
    /// The direction to its upper edge, of length one. For +z without rotation, the central column is along +x, and the
    /// column a quarter of the width to its left along +y. For other directions the frame is that of Duff et al. (see
    /// [`Frame::around`]).
    pub up: DVec3,
    /// Whether directions to it are sampled for integrators that also find it by sampling the BxDF (see
    /// [`EnvironmentMap`]).
    pub is_contested: bool,
}

/// An environment map, sampled in proportion to its radiance by solid angle.
///
/// The density by the picture's area is bilinear between the centres of its texels, as the radiance is: see
/// [`Grids::push_smooth`].
///
/// Integrators that also find the map by sampling the BxDF combine both by multiple importance sampling. Sampling the
/// parts that are darker than the mean gains little then. The density is that of the radiance minus its mean over the
/// sphere, and zero where that is negative (Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, "MIS Compensation:
/// Optimizing Sampling Techniques in Multiple Importance Sampling", §5.1). Only BxDF samples find those parts, with
/// full weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// The directions of the central column and of the column a quarter of the width to its left, both at the horizon,
    /// and up.
    axes: [[f32; 3]; 3],
    /// The index of the texture in the [`TextureTable`].
    texture: u32,
    /// The start of the smooth grid.
    grid: u32,
    /// The scale factor of the texture.
    scale: [f32; 3],
    /// The fraction of emitted rays whose directions are sampled by the grid; the others are uniform. If the grid omits
    /// parts that are darker than the mean, the uniform rays represent the mean.
    share: f32,
}

/// Parts darker than the mean are omitted only if at least this fraction of the light is above the mean: in a nearly
/// uniform map the remainder would be noise.
const LEAST_CONTRAST: f64 = 1e-3;

/// The mean radiance of the part of a picture around each point of a smooth grid, the lowest row first, and the columns
/// and rows of that grid.
fn radiances(around: &EnvironmentMapParameters, textures: &TextureTable) -> ([usize; 2], Vec<f64>) {
    let ([width, height], texel) = textures.image_texels(around.texture);
    let [columns, rows] = [width.min(MOST_POINTS[0]), height.min(MOST_POINTS[1])];
    let radiance = |x: usize, y: usize| {
        let channels = texel(x, y).map(|value| f64::from(value).clamp(0.0, RADIANCE.most));
        [0, 1, 2].map(|i| channels[i] * around.scale[i]).iter().sum::<f64>() / 3.0
    };
    let mut means = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let lines = row * height / rows..((row + 1) * height).div_ceil(rows);
        for column in 0..columns {
            let places = column * width / columns..((column + 1) * width).div_ceil(columns);
            let sum: f64 = lines
                .clone()
                .flat_map(|y| places.clone().map(move |x| (x, y)))
                .map(|(x, y)| radiance(x, y))
                .sum();
            means.push(sum / (lines.len() * places.len()) as f64);
        }
    }
    ([columns, rows], means)
}

impl EnvironmentMap {
    /// The light of a picture, with its grid added to others; `None` if it is black.
    pub(super) fn new(
        around: &EnvironmentMapParameters,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<EnvironmentMap> {
        let ([columns, rows], radiances) = radiances(around, textures);
        // The solid angle of a texel is proportional to the sine of its angle from the pole.
        let sines: Vec<f64> = (0..rows).map(|row| libm::sin((row as f64 + 0.5) / rows as f64 * PI)).collect();
        let by_angle = |less: f64| -> Vec<f64> {
            let number = |(i, radiance): (usize, &f64)| (radiance - less).max(0.0) * sines[i / columns];
            radiances.iter().enumerate().map(number).collect()
        };
        let sum = |numbers: &[f64]| numbers.iter().sum::<f64>();
        let all = by_angle(0.0);
        let total = sum(&all);
        if total <= 0.0 {
            return None;
        }
        let brighter = by_angle(total / (columns as f64 * sum(&sines)));
        let above = sum(&brighter);
        let (numbers, share) = if around.is_contested && above > LEAST_CONTRAST * total {
            (brighter, above / (above + total))
        } else {
            (all, 1.0)
        };
        // Adding zero turns −0 into 0; the frame of −0 differs.
        let up = narrow((around.up + DVec3::ZERO).to_array());
        let frame = Frame::around(Vec3::<f32>::splat(up));
        let (sin, cos) = (libm::sin(around.rotate) as f32, libm::cos(around.rotate) as f32);
        let axes = [frame.s * cos + frame.t * sin, frame.t * cos - frame.s * sin, frame.n];
        Some(EnvironmentMap {
            axes: axes.map(|axis| axis.lane(0)),
            texture: around.texture,
            grid: grids.push_smooth([columns, rows], &numbers),
            scale: narrow(around.scale),
            share: share as f32,
        })
    }
}

/// The direction to a point of the picture, and the sine of its angle from the pole.
#[inline(always)]
fn direction<F: Float>(lights: &LaneLights<'_, F>, [u, v]: [F; 2]) -> (Vec3<F>, F) {
    let [ahead, left] = lights.edges();
    let azimuth = -u + 0.5;
    let azimuth = F::select(azimuth.lt(F::zero()), azimuth + 1.0, azimuth);
    let (across, along) = sin_cos_turns(azimuth);
    let (sin, cos) = sin_cos_turns((-v + 1.0) * 0.5);
    (ahead * (along * sin) + left * (across * sin) + lights.normal() * cos, sin)
}

/// The point of the picture in a direction, and the sine of that direction's angle from the pole.
#[inline(always)]
fn place<F: Float>(lights: &LaneLights<'_, F>, d: Vec3<F>) -> ([F; 2], F) {
    let [ahead, left] = lights.edges();
    let (x, y, z) = (d.dot(ahead), d.dot(left), d.dot(lights.normal()));
    let sin = (x * x + y * y).sqrt();
    let azimuth = angle_turns(y, x);
    let half = F::splat(0.5);
    let u = F::select(azimuth.le(half), half - azimuth, -azimuth + 1.5);
    ([u, -angle_turns(sin, z) * 2.0 + 1.0], sin)
}

/// Converts a density by the picture's area to one by solid angle: u covers a whole turn, and v half a turn.
#[inline(always)]
fn by_solid_angle<F: Float>(density: F, sin: F) -> F {
    density * (1.0 / (2.0 * PI * PI)) as f32 / sin.max(F::splat(1e-9))
}

/// The radiance of a point of the picture.
#[inline(always)]
fn radiance<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, at: [F; 2]) -> Rgb<F> {
    limited(lights.textures().image_value(lights.texture(), at)) * emission
}

impl Light for EnvironmentMap {
    const INFINITE: bool = true;

    fn row(&self) -> LightRow {
        let [ahead, left, up] = self.axes;
        LightRow {
            edge_u: ahead,
            edge_v: left,
            normal: up,
            radius: self.share,
            texture: self.texture,
            grid: self.grid,
            emission: self.scale,
            ..LightRow::default()
        }
    }

    fn bounds(&self) -> Option<LightBounds> {
        None
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        _p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        F::out_of_line(
            #[inline(always)]
            || {
                let SmoothPoint { at, density } = lights.grids().sample_smooth(lights.grid(), u);
                let (wi, sin) = direction(lights, at);
                LightSample {
                    wi,
                    target: Vec3::zero(),
                    radiance: radiance(lights, emission, at),
                    pdf: by_solid_angle(density, sin),
                    delta: F::Mask::splat(false),
                    infinite: F::Mask::splat(true),
                }
            },
        )
    }

    #[inline(always)]
    fn escaped<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, d: Vec3<F>) -> Escaped<F> {
        F::out_of_line(
            #[inline(always)]
            || {
                let (at, sin) = place(lights, d);
                let density = lights.grids().density_smooth(lights.grid(), at);
                Escaped { radiance: radiance(lights, emission, at), pdf: by_solid_angle(density, sin) }
            },
        )
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let share = lights.radius();
        let by_grid = c.lt(share);
        let rest = F::select(by_grid, c / share, (c - share) / (-share + 1.0)).min(F::splat(BELOW_ONE));
        let point = lights.grids().sample_smooth(lights.grid(), [rest, d]);
        let (drawn, _) = direction(lights, point.at);
        let towards = Vec3::select(by_grid, drawn, warp::uniform_sphere([rest, d]));
        let Escaped { radiance, pdf } = Self::escaped(lights, emission, towards);
        let uniform = warp::uniform_sphere_pdf::<F>() * (-share + 1.0);
        EmittedRay {
            pdf_direction: pdf * share + uniform,
            ..EmittedRay::from_infinity(lights.extent(), -towards, radiance, [a, b])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::LightTable;
    use super::*;
    use crate::math::Bounds;
    use crate::math::lanes::scalar::Wrapping;
    use crate::parameter::ImageIndex;
    use crate::sampling::Stream;
    use crate::texture::{
        ColorSpace, Compiler, Depth, ImageFile, ImageTexture, Picture, TexelFilter, TextureKind, Wrap,
    };
    use rand::RngExt;
    use std::sync::Arc;

    /// A picture of 8 × 4 greys with a bright spot, around a box.
    fn table(is_contested: bool) -> LightTable {
        let grey = |i: u32| if i == 9 { 20.0_f32 } else { 0.2 + 0.1 * (i % 5) as f32 };
        let bytes: Vec<u8> = (0..32).flat_map(|i| grey(i).to_le_bytes()).collect();
        let picture = Picture::new([8, 4], [1, 1], Depth::Float, &bytes);
        let images = [ImageFile::of("greys".into(), Arc::new(picture))];
        let texture: TextureKind = ImageTexture {
            file: ImageIndex(0),
            color_space: ColorSpace::Auto,
            wrap: [Wrap::Repeat, Wrap::Clamp],
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
        let texture = compiler.root(0);
        let mut lights = LightTable::default();
        lights.set_textures(Arc::new(compiler.finish()));
        let up = DVec3::new(0.6, 0.0, 0.8);
        lights.push_environment_map(&EnvironmentMapParameters {
            texture,
            scale: [1.0, 2.0, 0.5],
            rotate: 0.7,
            up,
            is_contested,
        });
        lights.set_extent(Bounds { low: [-1.0; 3], high: [1.0, 2.0, 1.0] });
        lights
    }

    /// The radiance from all directions, integrated over the sphere.
    fn all_around(lights: &LightTable) -> f64 {
        let side = 400;
        let sum: f64 = (0..side * side)
            .map(|i| {
                let u = [i % side, i / side].map(|i| (i as f32 + 0.5) / side as f32);
                f64::from(lights.escaped(warp::uniform_sphere::<f32>(u), |_| 1.0).g)
            })
            .sum();
        sum / f64::from(side * side) * 4.0 * PI
    }

    #[test]
    fn rays_carry_the_power_of_the_map_including_what_sampling_omits() {
        for is_contested in [true, false] {
            let lights = table(is_contested);
            let &(_, radius) = lights.extent();
            let stream = &mut Stream::new(71, 0, 0);
            let (mut flux, draws) = (0.0, 200_000);
            for _ in 0..draws {
                let u = [stream.random(), stream.random(), stream.random(), stream.random()];
                let emitted = lights.emit_one(Wrapping(0), u);
                flux += f64::from(emitted.flux().g);
                assert!((emitted.ray.d.length() - 1.0).abs() < 1e-5 && emitted.pdf_direction > 0.0);
            }
            let power = all_around(&lights) * PI * f64::from(radius * radius);
            let ratio = flux / f64::from(draws) / power;
            assert!((ratio - 1.0).abs() < 0.01, "{is_contested}: {ratio}");
        }
    }

    #[test]
    fn parts_darker_than_the_mean_are_omitted_with_multiple_importance_sampling() {
        let drawn = |is_contested: bool| {
            let lights = table(is_contested);
            let (mut sum, mut dark) = (0.0, 0);
            for i in 0..4096_u16 {
                let u = [f32::from(i) / 4096.0, f32::from(i.reverse_bits() >> 4) / 4096.0];
                let direction = warp::uniform_sphere::<f32>(u);
                let found = std::cell::Cell::new(0.0);
                lights.escaped(direction, |pdf| {
                    found.set(pdf);
                    1.0
                });
                let density = f64::from(found.get());
                dark += u32::from(density == 0.0);
                sum += density;
            }
            (sum / 4096.0 * 4.0 * PI, dark)
        };
        let (whole, dark) = drawn(true);
        assert!((whole - 1.0).abs() < 0.05 && dark > 2000, "{whole}, {dark}");
        let (whole, dark) = drawn(false);
        assert!((whole - 1.0).abs() < 0.05 && dark == 0, "{whole}, {dark}");
    }
}
