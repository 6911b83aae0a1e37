//! The sphere, disk and cylinder that emit a texture.

use super::area::{self, AreaLight};
use super::bounds::{LightBounds, grey};
use super::columns::{LaneLights, LightRow};
use super::contract::Light;
use super::sample::{EmittedRay, LightSample};
use super::textured_quad::textured_radiance;
use crate::math::lanes::scalar::Wrapping;
use crate::math::{Float, Mask, Rgb, Vec3, trig, value};
use crate::sampling::{CELLS, Grids};
use crate::shape::{Cylinder, Disk, POSITION_ERROR, Sphere};
use crate::texture::{Site, TextureTable};
use std::f32::consts::PI;

/// The number of points per side of each cell at which a texture is evaluated for a grid.
const POINTS: usize = 2;

/// The curve that is turned about the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Profile {
    /// A half circle from the end of the axis (v = 0) to the opposite point.
    Sphere,
    /// A line from the centre to the rim.
    Disk,
    /// A line along the axis.
    Cylinder,
}

/// A surface of revolution whose radiance is a texture: a sphere, a disk or a cylinder. Its points are sampled in
/// proportion to the texture, on all sides: those that face away from the receiver contribute nothing.
///
/// A point is c + ρ(v)·(cos 2πu·x + sin 2πu·y) + h(v)·z, with the vectors x, y and z of the lengths of the radius and of
/// the axis. For a sphere ρ is sin πv and h is cos πv, for a disk v and 0, for a cylinder 1 and v.
#[derive(Clone, Copy, Debug)]
pub struct TexturedRound {
    row: LightRow,
    bounds: LightBounds,
}

impl TexturedRound {
    /// The light of a sphere that emits a texture, with its grid added to others; `None` if it is black. The others
    /// likewise.
    pub(super) fn sphere(
        shape: Sphere,
        flipped: bool,
        texture: u32,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<TexturedRound> {
        let light = |emission| AreaLight { shape, flipped, emission };
        let r = shape.radius;
        let row = LightRow {
            edge_u: [r, 0.0, 0.0],
            edge_v: [0.0, r, 0.0],
            normal: [0.0, 0.0, r],
            ..light([0.0; 3]).row()
        };
        let bounds = |mean| light(mean).bounds();
        TexturedRound::new(row, Profile::Sphere, texture, bounds, textures, grids)
    }

    /// See [`Self::sphere`].
    pub(super) fn disk(
        shape: Disk,
        flipped: bool,
        texture: u32,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<TexturedRound> {
        let light = |emission| AreaLight { shape, flipped, emission };
        let row = light([0.0; 3]).row();
        let bounds = |mean| light(mean).bounds();
        TexturedRound::new(row, Profile::Disk, texture, bounds, textures, grids)
    }

    /// See [`Self::sphere`].
    pub(super) fn cylinder(
        shape: Cylinder,
        flipped: bool,
        texture: u32,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<TexturedRound> {
        let light = |emission| AreaLight { shape, flipped, emission };
        let own = light([0.0; 3]).row();
        let (x, axis) = (Vec3::<f32>::splat(shape.x_axis), Vec3::splat(shape.axis));
        let [edge_u, edge_v] = [x, axis.cross(x)].map(|v| v * shape.radius).map(|v| [v.x, v.y, v.z]);
        let row = LightRow { edge_u, edge_v, normal: own.edge_v, ..own };
        let bounds = |mean| light(mean).bounds();
        TexturedRound::new(row, Profile::Cylinder, texture, bounds, textures, grids)
    }

    /// `bounds` are those for a mean radiance.
    fn new(
        row: LightRow,
        profile: Profile,
        texture: u32,
        bounds: impl Fn([f32; 3]) -> Option<LightBounds>,
        textures: &TextureTable,
        grids: &mut Grids,
    ) -> Option<TexturedRound> {
        let frame = RoundFrame::<f32> {
            origin: Vec3::splat(row.origin),
            x: Vec3::splat(row.edge_u),
            y: Vec3::splat(row.edge_v),
            z: Vec3::splat(row.normal),
            profile: profile as u32 as f32,
        };
        let side = CELLS * POINTS;
        let mut numbers = vec![0.0; CELLS * CELLS];
        let (mut sum, mut whole) = ([0.0; 3], 0.0);
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            let at = [x, y].map(|i| (i as f32 + 0.5) / side as f32);
            let on = frame.point(at);
            let site = Site::new(on.p, at, 0.0);
            let radiance = textured_radiance(textures, Wrapping(texture), site).channels();
            // The surface per area of uv.
            let share = 1.0 / f64::from(on.crowding);
            numbers[y / POINTS * CELLS + x / POINTS] += (grey(radiance) * share) as f32;
            sum.iter_mut().zip(radiance).for_each(|(sum, x)| *sum += f64::from(x) * share);
            whole += share;
        }
        let mean = sum.map(|sum| (sum / whole) as f32);
        if mean.iter().all(|&x| x <= 0.0) {
            return None;
        }
        let (falloff, grid) = (frame.profile, grids.push(&numbers));
        let row = LightRow { texture, grid, falloff, emission: [1.0; 3], ..row };
        bounds(mean).map(|bounds| TexturedRound { row, bounds })
    }
}

/// The vectors of a surface of revolution, and the number of its [`Profile`].
#[derive(Clone, Copy, Debug)]
struct RoundFrame<F> {
    origin: Vec3<F>,
    x: Vec3<F>,
    y: Vec3<F>,
    z: Vec3<F>,
    profile: F,
}

/// A point on a surface of revolution.
#[derive(Clone, Copy, Debug)]
struct RoundPoint<F> {
    p: Vec3<F>,
    /// The outward normal of the shape, of length one.
    n: Vec3<F>,
    /// The density of points by area, relative to uniform ones, if uv are uniform.
    crowding: F,
}

value!(RoundPoint { p, n, crowding });

/// The smallest ρ for densities.
const LEAST_RADIUS: f32 = 1e-6;

impl<F: Float> RoundFrame<F> {
    #[inline(always)]
    fn of(lights: &LaneLights<'_, F>) -> Self {
        let ([x, y], [.., profile]) = (lights.edges(), lights.ramp());
        RoundFrame { origin: lights.origin, x, y, z: lights.normal(), profile }
    }

    #[inline(always)]
    fn is(&self, profile: Profile) -> F::Mask {
        (self.profile - profile as u32 as f32).abs().lt(F::splat(0.5))
    }

    /// The density of points at v by area, relative to uniform ones, if uv are uniform. `sin` is that of πv.
    #[inline(always)]
    fn crowding(&self, v: F, sin: F) -> F {
        let least = F::splat(LEAST_RADIUS);
        let of_sphere = F::splat(2.0 / PI) / sin.max(least);
        let of_disk = F::splat(0.5) / v.max(least);
        F::select(
            self.is(Profile::Sphere),
            of_sphere,
            F::select(self.is(Profile::Disk), of_disk, F::splat(1.0)),
        )
    }

    /// The point at uv.
    #[inline(always)]
    fn point(&self, [u, v]: [F; 2]) -> RoundPoint<F> {
        let (sin, cos) = trig::sin_cos_turns(u);
        let (of_sphere, along_sphere) = trig::sin_cos_turns(v * 0.5);
        let (is_sphere, is_disk) = (self.is(Profile::Sphere), self.is(Profile::Disk));
        let one = F::splat(1.0);
        let radius = F::select(is_sphere, of_sphere, F::select(is_disk, v, one));
        let height = F::select(is_sphere, along_sphere, F::select(is_disk, F::zero(), v));
        let out = self.x * cos + self.y * sin;
        let from = out * radius + self.z * height;
        let n = Vec3::select(is_sphere, from, Vec3::select(is_disk, self.x.cross(self.y), out)).normalized();
        RoundPoint { p: self.origin + from, n, crowding: self.crowding(v, of_sphere) }
    }

    /// uv of a point on the surface, and its crowding.
    #[inline(always)]
    fn uv(&self, on: Vec3<F>) -> ([F; 2], F) {
        let from = on - self.origin;
        let (x, y, z) = (along(from, self.x), along(from, self.y), along(from, self.z));
        let radius = (x * x + y * y).sqrt();
        let (is_sphere, is_disk) = (self.is(Profile::Sphere), self.is(Profile::Disk));
        let of_sphere = trig::angle_turns(radius, z) * 2.0;
        let v = F::select(is_sphere, of_sphere, F::select(is_disk, radius, z));
        ([trig::angle_turns(y, x), v], self.crowding(v, radius))
    }
}

/// The component of a vector along an axis, in units of the axis.
#[inline(always)]
fn along<F: Float>(v: Vec3<F>, axis: Vec3<F>) -> F {
    v.dot(axis) / axis.dot(axis)
}

/// A sampled point, its density by area relative to uniform points, and its radiance.
#[inline(always)]
fn drawn<F: Float>(
    lights: &LaneLights<'_, F>,
    emission: Rgb<F>,
    numbers: [F; 2],
) -> (RoundPoint<F>, F, Rgb<F>) {
    let (grids, grid) = (lights.grids(), lights.grid());
    let at = grids.sample(grid, numbers);
    let on = RoundFrame::of(lights).point(at);
    let radiance = textured_radiance(lights.textures(), lights.texture(), Site::new(on.p, at, F::zero()));
    (on, grids.density(grid, at) * on.crowding, radiance * emission)
}

/// The normal of the emitting side.
#[inline(always)]
fn facing<F: Float>(lights: &LaneLights<'_, F>, n: Vec3<F>) -> Vec3<F> {
    Vec3::select(lights.inward(), -n, n)
}

impl Light for TexturedRound {
    const HAS_OWN_PDF: bool = true;

    fn row(&self) -> LightRow {
        self.row
    }

    fn bounds(&self) -> Option<LightBounds> {
        Some(self.bounds)
    }

    #[inline(always)]
    fn sample<F: Float>(
        lights: &LaneLights<'_, F>,
        p: Vec3<F>,
        emission: Rgb<F>,
        u: [F; 2],
    ) -> LightSample<F> {
        let (on, density, radiance) = drawn(lights, emission, u);
        let normal = facing(lights, on.n);
        let to_light = on.p - p;
        let distance2 = to_light.dot(to_light);
        let wi = to_light * (F::splat(1.0) / distance2.sqrt());
        let cos = -wi.dot(normal);
        let illuminates = cos.gt(F::zero());
        let off = on.p.max_abs().max(p.max_abs()) * POSITION_ERROR + lights.error();
        let pdf = distance2 / (cos * lights.area()) * density;
        LightSample {
            wi,
            target: on.p + normal * off,
            radiance: radiance.only(illuminates),
            pdf: pdf.only(illuminates),
            delta: F::Mask::splat(false),
            infinite: F::Mask::splat(false),
        }
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
        let (at, crowding) = RoundFrame::of(lights).uv(on);
        by_area * lights.grids().density(lights.grid(), at) * crowding
    }

    #[inline(always)]
    fn emit<F: Float>(lights: &LaneLights<'_, F>, emission: Rgb<F>, [a, b, c, d]: [F; 4]) -> EmittedRay<F> {
        let (on, density, radiance) = drawn(lights, emission, [a, b]);
        let ray = area::emit(lights, radiance, on.p, facing(lights, on.n), [c, d]);
        EmittedRay { pdf_position: ray.pdf_position * density, ..ray }
    }
}

#[cfg(test)]
mod tests {
    use super::super::table::LightTable;
    use super::*;
    use crate::parameter::Varying;
    use crate::sampling::Stream;
    use crate::shape::{CustomShape, Piece};
    use crate::texture::{CheckerboardTexture, Compiler, TextureKind};
    use glam::DVec3;
    use rand::RngExt;
    use std::sync::Arc;

    /// The radiance is 1 where v is below one half, and 3 above.
    fn lights(piece: &Piece, flipped: bool) -> LightTable {
        let (even, odd) = (Varying::Colour([1.0; 3]), Varying::Colour([3.0; 3]));
        let halves: TextureKind = CheckerboardTexture { even, odd, checks_per_unit: [1.0, 2.0] }.into();
        let textures = [halves];
        let mut compiler = Compiler::new(&textures, &[]);
        let root = compiler.root(0);
        let mut lights = LightTable::default();
        lights.set_textures(Arc::new(compiler.finish()));
        assert_eq!(lights.push_textured(piece, flipped, root), 0);
        lights
    }

    #[test]
    fn rays_carry_the_power_of_the_texture_in_nearly_equal_parts() {
        use std::f64::consts::PI;
        let (o, a) = (DVec3::new(0.3, -0.2, 0.5), DVec3::new(0.6, 0.0, 0.8));
        let disk: CustomShape = Disk::new(o, a, 1.5).into();
        let cylinder: CustomShape = Cylinder::new(o, o + a * 2.0, 0.5).into();
        // Three quarters of a disk are farther from its centre than half the radius.
        let cases = [
            (Piece::Sphere(Sphere::new(o, 0.7)), 4.0 * PI * 0.49 * 2.0),
            (Piece::Custom(disk), PI * 2.25 * (0.25 + 3.0 * 0.75)),
            (Piece::Custom(cylinder), 2.0 * PI * 0.5 * 2.0 * 2.0),
        ];
        for (i, (piece, flux)) in (0..).zip(cases) {
            for flipped in [false, true] {
                let lights = lights(&piece, flipped);
                let stream = &mut Stream::new(54, i, u32::from(flipped));
                let (mut sum, mut square) = (0.0, 0.0);
                let draws = 40_000;
                for _ in 0..draws {
                    let u = [stream.random(), stream.random(), stream.random(), stream.random()];
                    let carried = f64::from(lights.emit_one(Wrapping(0), u).flux().g);
                    (sum, square) = (sum + carried, square + carried * carried);
                }
                let (mean, n) = (sum / f64::from(draws), f64::from(draws));
                let power = flux * PI;
                assert!((mean / power - 1.0).abs() < 0.01, "{piece:?}: {mean} is not {power}");
                // With points that are uniform by area, it would be 1.12 or more.
                let spread = square / n / (mean * mean);
                assert!(spread < 1.05, "{piece:?}: {spread}");
            }
        }
    }
}
