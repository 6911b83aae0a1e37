//! The GGX distribution of microfacet normals.

use crate::math::{Float, Vec3, trig, value};
use std::f32::consts::FRAC_1_PI;

/// The smallest α. Below it, single precision cannot distinguish the normals of microfacets.
pub const LEAST_ALPHA: f32 = 1e-4;

/// Directions whose cosines have a product below about this scatter nothing: it keeps quotients finite.
const LEAST_PRODUCT: f32 = 1e-12;

/// A sum of two directions that is shorter than this has no meaningful direction.
pub(super) const LEAST_LENGTH: f32 = 1e-18;

/// The GGX distribution of slopes (Trowbridge and Reitz 1975; Walter et al. 2007), with one width along each tangent,
/// and height-correlated masking by Smith's function (Heitz 2014, "Understanding the Masking-Shadowing Function in
/// Microfacet-Based BRDFs", §5).
///
/// Directions and normals are above the surface, with z ≥ 0.
#[derive(Clone, Copy, Debug)]
pub struct Ggx<F> {
    /// The widths along the tangents, from [`LEAST_ALPHA`] to 1.
    pub alpha: [F; 2],
}

value!(Ggx { alpha });

impl<F: Float> Ggx<F> {
    /// The direction with its slopes multiplied by α.
    #[inline(always)]
    fn stretched(&self, w: Vec3<F>) -> Vec3<F> {
        let [along_s, along_t] = self.alpha;
        Vec3::new(w.x * along_s, w.y * along_t, w.z)
    }

    /// D(h), the area of the microfacets with this normal per area of the surface and per steradian.
    #[inline(always)]
    pub fn density(&self, h: Vec3<F>) -> F {
        let [along_s, along_t] = self.alpha;
        let (x, y) = (h.x / along_s, h.y / along_t);
        let spread = x * x + y * y + h.z * h.z;
        F::splat(FRAC_1_PI) / (along_s * along_t * spread * spread)
    }

    /// G₂(wo, wi)/(4 cos θₒ cos θᵢ), where G₂ = 1/(1 + Λ(wo) + Λ(wi)).
    #[inline(always)]
    pub fn visibility(&self, wo: Vec3<F>, wi: Vec3<F>) -> F {
        let (o, i) = (self.stretched(wo).length(), self.stretched(wi).length());
        F::splat(0.5) / (o * wi.z + i * wo.z).max(F::splat(LEAST_PRODUCT))
    }

    /// G₁(wo)/cos θₒ: twice the visible area of the surface's microfacets over the surface's area as seen along `wo`.
    #[inline(always)]
    pub fn masking(&self, wo: Vec3<F>) -> F {
        F::splat(2.0) / (wo.z + self.stretched(wo).length())
    }

    /// The normal of a microfacet that is visible along `wo`, in proportion to its visible area, sampled with `u` in
    /// [0, 1)² (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical Caps").
    ///
    /// Its density by solid angle is [`Ggx::masking`]·(wo·h)·[`Ggx::density`].
    #[inline(always)]
    pub fn sample(&self, wo: Vec3<F>, u: [F; 2]) -> Vec3<F> {
        let seen = self.stretched(wo).normalized();
        // On the hemisphere of slopes, a direction of the spherical cap of reflected directions. Its height is 1 − a,
        // and 1 + (1 − a) is the sum of 1 − seen.z and z, which avoids cancellation.
        let above = seen.z + 1.0;
        let (a, z) = (u[0] * above, (-u[0] + 1.0) * above);
        let sin = (a * ((seen.x * seen.x + seen.y * seen.y) / above + z)).sqrt();
        let (s, c) = trig::sin_cos_turns(u[1]);
        self.stretched(Vec3::new(sin * c + seen.x, sin * s + seen.y, z)).normalized()
    }
}

/// The normal of the microfacets that reflect one direction into the other, both above the surface. Also the cosine
/// between it and each of them: half the length of their sum, which is symmetric.
#[inline(always)]
pub(super) fn halfway<F: Float>(wo: Vec3<F>, wi: Vec3<F>) -> (Vec3<F>, F) {
    let sum = wo + wi;
    let length = sum.length();
    (sum * (F::splat(1.0) / length.max(F::splat(LEAST_LENGTH))), (length * 0.5).min(F::splat(1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Stream, warp};
    use rand::RngExt;
    use std::f64::consts::TAU;

    fn above(stream: &mut Stream) -> Vec3<f32> {
        let w = warp::uniform_sphere([stream.random::<f32>(), stream.random()]);
        Vec3::new(w.x, w.y, w.z.abs())
    }

    /// ∫ f over the normals above the surface, in slopes that are stretched as the distribution is.
    fn integral(ggx: &Ggx<f32>, f: impl Fn(Vec3<f32>) -> f32) -> f64 {
        let n = 1000;
        let mut sum = 0.0;
        for i in 0..n * n {
            let [b, turns] = [i / n, i % n].map(|i| (f64::from(i) + 0.5) / f64::from(n));
            // For a distribution of width one, tan²θ at the quantile a is a/(1 − a). With b = √(1 − a) the integrand of
            // the steepest normals is bounded.
            let tan = (1.0 - b * b).sqrt() / b;
            let (x, y) = (tan * (TAU * turns).cos(), tan * (TAU * turns).sin());
            let slope = Vec3::splat([x as f32, y as f32, 1.0]);
            let h = ggx.stretched(slope).normalized();
            sum += 2.0 * b * f64::from(f(h) / (ggx.density(h) * h.z));
        }
        sum / f64::from(n * n)
    }

    /// The projected area of all normals is that of the surface, seen from above and from any other direction (Heitz
    /// 2014, equations 2 and 14).
    #[test]
    fn projected_normals_have_the_area_of_the_surface() {
        let stream = &mut Stream::new(70, 0, 0);
        for alpha in [[1.0, 1.0], [0.3, 0.3], [0.01, 0.01], [0.05, 0.6], [1.0, 0.002]] {
            let ggx = Ggx { alpha };
            let area = integral(&ggx, |h| ggx.density(h) * h.z);
            assert!((area - 1.0).abs() < 1e-4, "{alpha:?}: {area}");
            for _ in 0..10 {
                let wo = above(stream);
                let seen = integral(&ggx, |h| ggx.density(h) * wo.dot(h).max(0.0) * ggx.masking(wo));
                assert!((seen - 1.0).abs() < 2e-3, "{alpha:?}, {wo:?}: {seen}");
                // Negative control: the masking of another width, where it matters.
                let other = Ggx { alpha: alpha.map(|alpha| alpha * 0.9) };
                let wrong = integral(&ggx, |h| ggx.density(h) * wo.dot(h).max(0.0) * other.masking(wo));
                assert!((wrong - 1.0).abs() > 5e-3 || wo.z > 0.7 || alpha != [1.0; 2], "{wo:?}: {wrong}");
            }
        }
    }

    #[test]
    fn sampled_normals_face_the_direction_and_have_length_one() {
        let stream = &mut Stream::new(71, 0, 0);
        for _ in 0..200_000 {
            let alpha = [(); 2].map(|()| LEAST_ALPHA.powf(stream.random::<f32>()));
            let mut wo = above(stream);
            if stream.random_bool(0.1) {
                wo = Vec3::new(wo.x, wo.y, wo.z * 1e-6).normalized();
            }
            let ends = |u: f32| {
                if u < 0.02 {
                    0.0
                } else if u > 0.98 {
                    0.999_999_94
                } else {
                    u
                }
            };
            let u = [(); 2].map(|()| ends(stream.random()));
            let h = Ggx { alpha }.sample(wo, u);
            assert!((h.length() - 1.0).abs() < 1e-6 && h.z >= 0.0, "{alpha:?}, {wo:?}, {u:?}: {h:?}");
            assert!(h.dot(wo) > -1e-6, "{alpha:?}, {wo:?}, {u:?}: {h:?}");
        }
    }
}
