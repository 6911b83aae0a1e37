//! Normal maps and bump maps.

use super::modifiers::is_texture;
use super::row::Site;
use super::table::MaterialTable;
use super::walk::Walked;
use super::walk::select2;
use crate::math::lanes::Value;
use crate::math::{Float, Frame, Mask, Rgb, Uint, Vec3, value};
use crate::texture::SecondUv;

/// The least step in uv for the slopes of heights, relative to the coordinate: eight times the spacing of numbers.
const LEAST_STEP: f32 = 1.0 / 1_048_576.0;

/// The parametrisation by uv of a surface at a point, in world space.
#[derive(Clone, Copy, Debug)]
pub struct UvBasis<F> {
    /// The gradient of u along the surface.
    pub gradient_u: Vec3<F>,
    /// The gradient of v.
    pub gradient_v: Vec3<F>,
    /// ∂p/∂u, along which v is constant.
    pub along_u: Vec3<F>,
    /// ∂p/∂v.
    pub along_v: Vec3<F>,
}

value!(UvBasis { gradient_u, gradient_v, along_u, along_v });

/// The step of a coordinate in the lanes of a map: the distance of the coordinate, and one in the scene, of which the
/// shorter counts.
type Step<F> = (F, F);

impl<F: Float> UvBasis<F> {
    /// The change of both coordinates along a vector.
    #[inline(always)]
    fn change(&self, along: Vec3<F>) -> [F; 2] {
        [self.gradient_u.dot(along), self.gradient_v.dot(along)]
    }
}

impl MaterialTable {
    #[inline(always)]
    fn height<F: Float>(&self, texture: F::Uint, site: Site<F>) -> F {
        self.textures.value(texture, site).r
    }

    /// The changes of heights per change of u and of v: central differences between the `ends` of both, lower and upper
    /// values. `site` is that of a value of v in the lanes of a mask, and of u elsewhere.
    ///
    /// A loop, not four evaluations in a row: GPUs' compilers inline every one.
    #[inline(always)]
    fn slopes<F: Float>(
        &self,
        texture: F::Uint,
        [of_u, of_v]: [(F, F); 2],
        site: impl Fn(F::Mask, F) -> Site<F>,
    ) -> [F; 2] {
        let (_, heights) = F::repeat(
            F::Mask::splat(true),
            (F::Uint::splat(0), [F::zero(); 4]),
            #[inline(always)]
            |(i, [h0, h1, h2, h3])| {
                let one = F::Uint::splat(1);
                let (is_v, is_upper) = (!i.lt(F::Uint::splat(2)), (i & one).eq(one));
                let (of_u, of_v) = (F::select(is_upper, of_u.1, of_u.0), F::select(is_upper, of_v.1, of_v.0));
                let h = self.height(texture, site(is_v, F::select(is_v, of_v, of_u)));
                let heights = [
                    F::select(!is_v & !is_upper, h, h0),
                    F::select(!is_v & is_upper, h, h1),
                    F::select(is_v & !is_upper, h, h2),
                    F::select(is_v & is_upper, h, h3),
                ];
                let next = i + one;
                ((next, heights), next.lt(F::Uint::splat(4)))
            },
        );
        [(heights[1] - heights[0]) / (of_u.1 - of_u.0), (heights[3] - heights[2]) / (of_v.1 - of_v.0)]
    }

    /// The normals of bump maps: a texture and a scale of heights, in the lanes of the rows `map`. Their coordinates are
    /// `uv`, with a scale against those of `basis`. `site` is that of other coordinates, and of a movement on the surface.
    #[inline(always)]
    fn with_bumps<F: Float>(
        &self,
        (map, texture, scale): (F::Uint, F::Uint, F),
        normal: Vec3<F>,
        ([u, v], [a, b], basis): ([F; 2], [F; 2], &UvBasis<F>),
        site: impl Fn([F; 2], Vec3<F>) -> Site<F>,
    ) -> Vec3<F> {
        let steps = self.modifiers.bump_steps::<F>(map);
        let (along_u, along_v) = (basis.along_u * (F::splat(1.0) / a), basis.along_v * (F::splat(1.0) / b));
        let ends = [around(u, (steps.x, steps.z), along_u), around(v, (steps.y, steps.z), along_v)];
        let [slope_u, slope_v] = self.slopes(
            texture,
            ends,
            #[inline(always)]
            |is_v, to| {
                let by = Vec3::select(is_v, along_v, along_u) * (to - F::select(is_v, v, u));
                site(select2(is_v, [u, to], [to, v]), by)
            },
        );
        let slope = basis.gradient_u * (slope_u * a) + basis.gradient_v * (slope_v * b);
        bumped(normal, slope * scale)
    }

    /// The normals that the maps of a walk give for `normal`, of length one, on either side of the surface. `site` is
    /// in the coordinates of the surface.
    #[inline(always)]
    pub fn mapped<F: Float>(
        &self,
        walked: &Walked<F>,
        site: Site<F>,
        normal: Vec3<F>,
        basis: &UvBasis<F>,
    ) -> Vec3<F> {
        let mut n = normal;
        let [a, b] = walked.map_scale;
        let here = Site { uv: walked.map_uv, footprint: site.footprint * (a * b), ..site };
        if self.modifiers.has_bumps {
            let (texture, scale) = self.modifiers.bumps::<F>(walked.map);
            n = F::branch(
                is_texture::<F>(texture),
                n,
                #[inline(always)]
                || {
                    self.with_bumps(
                        (walked.map, texture, scale),
                        normal,
                        (here.uv, [a, b], basis),
                        // The point moves as well, because noise depends on it.
                        #[inline(always)]
                        |uv, by| Site { uv, p: here.p + by, ..here },
                    )
                },
            );
        }
        if self.modifiers.has_normals {
            let (texture, scale) = self.modifiers.normals::<F>(walked.map);
            n = F::branch(
                is_texture::<F>(texture),
                n,
                #[inline(always)]
                || tilted(self.textures.value(texture, here), scale, n, basis),
            );
        }
        n
    }

    /// As [`Self::mapped`], in scenes whose textures use the second set of uv. `bases` are those of both sets.
    ///
    /// A map is along the coordinates of the second set if its texture depends on it. Where it depends on the first one
    /// as well, that one follows the point.
    #[inline(always)]
    pub fn mapped_in_sets<F: Float>(
        &self,
        walked: &Walked<F>,
        site: Site<F>,
        normal: Vec3<F>,
        [first, second]: [&UvBasis<F>; 2],
    ) -> Vec3<F> {
        let mut n = normal;
        let [a, b] = walked.map_scale;
        let here = Site { uv: walked.map_uv, footprint: site.footprint * (a * b), ..site };
        if self.modifiers.has_bumps {
            let (texture, scale) = self.modifiers.bumps::<F>(walked.map);
            n = F::branch(
                is_texture::<F>(texture),
                n,
                #[inline(always)]
                || {
                    let is_second = self.modifiers.bumps_second::<F>(walked.map);
                    let basis = UvBasis::blend(is_second, *second, *first);
                    let uv = select2(is_second, here.second.uv, here.uv);
                    let by_uv = select2(is_second, [F::splat(1.0); 2], [a, b]);
                    self.with_bumps(
                        (walked.map, texture, scale),
                        normal,
                        (uv, by_uv, &basis),
                        #[inline(always)]
                        |exact, by| {
                            let ([u, v], [u1, v1]) = (first.change(by), second.change(by));
                            let own = [here.uv[0] + u * a, here.uv[1] + v * b];
                            let other = [here.second.uv[0] + u1, here.second.uv[1] + v1];
                            let uv = select2(is_second, own, exact);
                            let second = SecondUv { uv: select2(is_second, exact, other), ..here.second };
                            Site { uv, second, p: here.p + by, ..here }
                        },
                    )
                },
            );
        }
        if self.modifiers.has_normals {
            let (texture, scale) = self.modifiers.normals::<F>(walked.map);
            n = F::branch(
                is_texture::<F>(texture),
                n,
                #[inline(always)]
                || {
                    let is_second = self.modifiers.normals_second::<F>(walked.map);
                    let basis = UvBasis::blend(is_second, *second, *first);
                    tilted(self.textures.value(texture, here), scale, n, &basis)
                },
            );
        }
        n
    }
}

/// Half a step before a coordinate and half a step after it, as rounded.
#[inline(always)]
fn around<F: Float>(x: F, step: Step<F>, along: Vec3<F>) -> (F, F) {
    let step = step.0.min(step.1 / along.max_abs().max(F::splat(1e-18)));
    let half = step.max(x.abs() * LEAST_STEP) * 0.5;
    (x - half, x + half)
}

/// The normal of a surface p + h·n, where `slope` is the gradient of h: n − ∇h (Blinn 1978, "Simulation of Wrinkled
/// Surfaces").
#[inline(always)]
fn bumped<F: Float>(normal: Vec3<F>, slope: Vec3<F>) -> Vec3<F> {
    unit_or(normal - (slope - normal * normal.dot(slope)), normal)
}

/// The normal of a map, encoded as a colour, with x and y scaled, around a normal.
#[inline(always)]
fn tilted<F: Float>(encoded: Rgb<F>, scale: F, n: Vec3<F>, basis: &UvBasis<F>) -> Vec3<F> {
    let (x, y, z) = (encoded.r * 2.0 - 1.0, encoded.g * 2.0 - 1.0, encoded.b * 2.0 - 1.0);
    let frame = Frame::along(n, basis.along_u);
    // If uv are mirrored or the normal is reversed, v increases in the opposite direction.
    let side = F::splat(1.0).copysign(frame.t.dot(basis.along_v));
    unit_or(frame.to_world(Vec3::new(x * scale, y * scale * side, z)), n)
}

/// A vector divided by its length; another one if its length is zero.
#[inline(always)]
fn unit_or<F: Float>(v: Vec3<F>, otherwise: Vec3<F>) -> Vec3<F> {
    let length2 = v.dot(v);
    let has_one = length2.gt(F::splat(1e-12)) & length2.lt(F::splat(f32::MAX));
    let unit = v * (F::splat(1.0) / F::select(has_one, length2, F::splat(1.0)).sqrt());
    Vec3::select(has_one, unit, otherwise)
}
