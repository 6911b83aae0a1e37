//! Normal maps and bump maps.

use super::modifiers::is_texture;
use super::row::Site;
use super::table::MaterialTable;
use super::walk::Walked;
use crate::math::{Float, Frame, Vec3, value};

/// The step in uv for the slopes of heights: a quarter of a texel of a picture of 256 texels per side.
const STEP: f32 = 1.0 / 1024.0;

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
                    let [u, v] = here.uv;
                    // Steps as rounded. The point moves as well, because noise depends on it.
                    let (next_u, next_v) = (u + STEP, v + STEP);
                    let (du, dv) = ((next_u - u) / a, (next_v - v) / b);
                    let h = self.height(texture, here);
                    let h_u = self
                        .height(texture, Site { uv: [next_u, v], p: site.p + basis.along_u * du, ..here });
                    let h_v = self
                        .height(texture, Site { uv: [u, next_v], p: site.p + basis.along_v * dv, ..here });
                    let slope = basis.gradient_u * ((h_u - h) / du) + basis.gradient_v * ((h_v - h) / dv);
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

/// A vector divided by its length; another one if its length is zero.
#[inline(always)]
fn unit_or<F: Float>(v: Vec3<F>, otherwise: Vec3<F>) -> Vec3<F> {
    let length2 = v.dot(v);
    let has_one = length2.gt(F::splat(1e-12)) & length2.lt(F::splat(f32::MAX));
    let unit = v * (F::splat(1.0) / F::select(has_one, length2, F::splat(1.0)).sqrt());
    Vec3::select(has_one, unit, otherwise)
}
