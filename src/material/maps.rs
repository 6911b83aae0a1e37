//! Normal maps and bump maps.

use super::modifiers::is_texture;
use super::row::Site;
use super::table::MaterialTable;
use super::walk::Walked;
use crate::math::{Float, Frame, Vec3, value};

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

impl MaterialTable {
    #[inline(always)]
    fn height<F: Float>(&self, texture: F::Uint, site: Site<F>) -> F {
        self.textures.value(texture, site).r
    }

    /// The change of heights per change of one coordinate, 0 for u and 1 for v, around a point: a central difference.
    /// `step` is a distance of the coordinate, and one in the scene, of which the shorter counts. `along` is the change
    /// of the point per change of the coordinate.
    #[inline(always)]
    fn slope<F: Float>(
        &self,
        texture: F::Uint,
        site: Site<F>,
        axis: usize,
        step: (F, F),
        along: Vec3<F>,
    ) -> F {
        let x = site.uv[axis];
        let step = step.0.min(step.1 / along.max_abs().max(F::splat(1e-18)));
        let half = step.max(x.abs() * LEAST_STEP) * 0.5;
        // Distances as rounded. The point moves as well, because noise depends on it.
        let (before, after) = (x - half, x + half);
        let higher = self.height(texture, moved(site, axis, after, along));
        let lower = self.height(texture, moved(site, axis, before, along));
        (higher - lower) / (after - before)
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
                    let steps = self.modifiers.bump_steps::<F>(walked.map);
                    let slope_u =
                        self.slope(texture, here, 0, (steps.x, steps.z), basis.along_u * (F::splat(1.0) / a));
                    let slope_v =
                        self.slope(texture, here, 1, (steps.y, steps.z), basis.along_v * (F::splat(1.0) / b));
                    let slope = basis.gradient_u * (slope_u * a) + basis.gradient_v * (slope_v * b);
                    let slope = slope * scale;
                    // A surface p + h·n has the normal n − ∇h (Blinn 1978, "Simulation of Wrinkled Surfaces").
                    unit_or(normal - (slope - normal * normal.dot(slope)), normal)
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
                    let encoded = self.textures.value(texture, here);
                    let (x, y, z) = (encoded.r * 2.0 - 1.0, encoded.g * 2.0 - 1.0, encoded.b * 2.0 - 1.0);
                    let frame = Frame::along(n, basis.along_u);
                    // If uv are mirrored or the normal is reversed, v increases in the opposite direction.
                    let side = F::splat(1.0).copysign(frame.t.dot(basis.along_v));
                    let tilted = frame.to_world(Vec3::new(x * scale, y * scale * side, z));
                    unit_or(tilted, n)
                },
            );
        }
        n
    }
}

/// The site at another value of a coordinate: see [`MaterialTable::slope`].
#[inline(always)]
fn moved<F: Float>(site: Site<F>, axis: usize, to: F, along: Vec3<F>) -> Site<F> {
    let mut uv = site.uv;
    uv[axis] = to;
    Site { uv, p: site.p + along * (to - site.uv[axis]), ..site }
}

/// A vector divided by its length; another one if its length is zero.
#[inline(always)]
fn unit_or<F: Float>(v: Vec3<F>, otherwise: Vec3<F>) -> Vec3<F> {
    let length2 = v.dot(v);
    let has_one = length2.gt(F::splat(1e-12)) & length2.lt(F::splat(f32::MAX));
    let unit = v * (F::splat(1.0) / F::select(has_one, length2, F::splat(1.0)).sqrt());
    Vec3::select(has_one, unit, otherwise)
}
