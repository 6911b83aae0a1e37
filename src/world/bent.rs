//! Shading normals that are bent so that light is scattered to the correct side of a surface.
//!
//! Around a shading normal, a mirror may reflect and glass may refract to the wrong side of the true surface. Such
//! light would leak, so it is dropped, which darkens the surface. A normal is bent in two cases:
//!
//! 1. A normal from a map is bent, for any material, until a mirror with this normal would reflect to the correct side.
//!    The map may even have turned it away from the viewer.
//! 2. A mapped or interpolated normal is bent where the material has a delta lobe. Such a lobe has a single direction
//!    for reflection and one for refraction. The normal is bent until all of them are on their correct sides, so that
//!    no energy is lost and the silhouettes of coarse meshes are not dark.

use super::{CompiledScene, Interaction};
use crate::material::{Bsdf, Bxdf};
use crate::math::{Float, Frame, Ray, Vec3, function};

/// The smallest cosine between the true normal and a direction reflected around a bent normal. It is many times the
/// rounding error of a direction, and corresponds to less than a tenth of a degree above the horizon.
const LEAST_COSINE: f32 = 1e-3;

impl CompiledScene {
    /// The shading frame at the hit of a ray. Its normal is the shading normal, bent where a delta lobe would otherwise
    /// send light to the wrong side of the surface.
    #[inline(always)]
    pub fn scattering_frame<F: Float>(&self, at: &Interaction<F>, ray: &Ray<F>, bsdf: &Bsdf<F>) -> Frame<F> {
        if !self.has_shading_normals || !self.materials.has_delta() {
            return self.frame(at);
        }
        let normal = F::branch(
            bsdf.has_delta(),
            at.point.shading,
            #[inline(always)]
            || bent_normal(at.point.n, at.point.shading, -ray.d, bsdf.index()),
        );
        self.frame_around(at, normal)
    }
}

/// The normal halfway between `wo` and a reflected direction that is moved along `up`.
#[inline(always)]
fn halfway<F: Float>(wo: Vec3<F>, reflected: Vec3<F>, up: Vec3<F>) -> Vec3<F> {
    (wo + (reflected + up).normalized()).normalized()
}

/// A mapped normal, bent as little as needed for a mirror to reflect `wo` above the surface. `n` is the true normal;
/// both normals are outward, and all three vectors have unit length. A mapped normal that equals `n` is never bent.
///
/// The mirrored direction is moved along the true normal up to the surface, and the normal is halfway between it and
/// `wo` (Keller et al. 2017, "The Iray Light Transport Simulation and Rendering System", appendix A.3).
#[inline(always)]
pub(super) fn bent_mapped<F: Float>(mapped: Vec3<F>, n: Vec3<F>, wo: Vec3<F>) -> Vec3<F> {
    let cos = n.dot(wo);
    let side = F::splat(1.0).copysign(cos);
    let (m, up) = (mapped * side, n * side);
    let facing = m.dot(wo);
    let mirrored = m * (facing * 2.0) - wo;
    let height = mirrored.dot(up);
    // If the mapped normal is the true normal, the height is the cosine itself.
    let least = (cos.abs() * 0.9).min(F::splat(0.01));
    let is_bent = height.lt(least) | facing.le(F::zero());
    let bent = halfway(wo, mirrored, up * (least - height).max(F::zero()));
    Vec3::select(is_bent, bent * side, mapped)
}

/// The normal nearest to `shading` that keeps directions on their sides of a surface with the normal `n`: the
/// reflection of `wo` on the side of `wo`, its refraction on the other. `wo` is on the same side by both normals.
/// `index` is the index of refraction on the inner side relative to the outer side.
///
/// A reflected direction below the surface is lifted to the horizon, as in [`bent_mapped`]. Only light that leaves the
/// denser medium can be refracted to the wrong side; the result is then `n`. It is also `n` where `wo` grazes the
/// surface, and where light is totally reflected around the shading normal but not around `n`. Otherwise a coarse glass
/// sphere would trap one path in a hundred forever.
#[inline(always)]
fn bent_normal<F: Float>(n: Vec3<F>, shading: Vec3<F>, wo: Vec3<F>, index: F) -> Vec3<F> {
    function!(F, bent_normal(n, shading, wo, index), {
        let (zero, one) = (F::zero(), F::splat(1.0));
        let side = one.copysign(wo.dot(n));
        let (up, smooth) = (n * side, shading * side);
        let least = F::splat(LEAST_COSINE);
        let reflected = smooth * (wo.dot(smooth) * 2.0) - wo;
        let missing = least - reflected.dot(up);
        let bent = Vec3::select(missing.gt(zero), halfway(wo, reflected, up * missing), smooth);

        let eta = F::select(side.gt(zero), index, one / index);
        let cos = wo.dot(bent);
        let sin2_t = (-cos * cos + 1.0) / (eta * eta);
        let cos_t = (-sin2_t + 1.0).max(zero).sqrt();
        let refracted = bent * (cos / eta - cos_t) - wo * (one / eta);
        let leaks = sin2_t.lt(one) & !refracted.dot(up).lt(zero);
        // Paths around bent normals are not reversible, so some light would be reflected internally forever.
        let sin2_of_true = (one - wo.dot(up) * wo.dot(up)) / (eta * eta);
        let is_kept_in = !sin2_t.lt(one) & sin2_of_true.lt(one);
        // Halfway between two grazing directions, rounding errors would dominate.
        let grazes = wo.dot(up).lt(least);
        Vec3::select(leaks | is_kept_in | grazes, up, bent) * side
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{SmoothDielectric, TransportMode};
    use crate::math::Rgb;
    use crate::sampling::{Stream, warp};
    use rand::RngExt;

    /// The number of directions at smooth glass that lead to the wrong side of the surface, for shading normals and for
    /// bent normals, and the number of normals that are bent.
    fn wrong(index: f32, count: u32) -> ([u32; 2], u32) {
        let mut stream = Stream::new(7, 0, 0);
        let (mut wrong, mut changed) = ([0; 2], 0);
        let mut done = 0;
        while done < count {
            let [n, wo, tilt] =
                [(); 3].map(|()| warp::uniform_sphere([stream.random::<f32>(), stream.random()]));
            let shading = (n + tilt * stream.random_range(0.0..0.5_f32)).normalized();
            // As in `Triangles::point`, beyond rounding errors.
            if wo.dot(n) * wo.dot(shading) <= 0.0 || wo.dot(n).abs() < 1e-4 {
                continue;
            }
            done += 1;
            let white = Rgb::splat([1.0; 3]);
            let glass = SmoothDielectric { ior: index, reflectance: white, transmittance: white };
            let bent = bent_normal(n, shading, wo, index);
            assert!((bent.length() - 1.0).abs() < 1e-5 && bent.dot(n) > 0.0, "{bent:?}");
            changed += u32::from((bent - shading).length() > 1e-6);
            for (normal, wrong) in [shading, bent].into_iter().zip(&mut wrong) {
                let frame = Frame::around(normal);
                for way in glass.branches(frame.to_local(wo), TransportMode::Radiance) {
                    let passes = frame.to_world(way.wi).dot(n) * way.wi.z > 0.0;
                    *wrong += u32::from(way.probability > 1e-4 && !passes);
                }
            }
        }
        (wrong, changed)
    }

    #[test]
    fn mapped_normals_reflect_to_the_side_of_the_surface() {
        let mut stream = Stream::new(81, 0, 0);
        let mut direction = || warp::uniform_sphere([stream.random::<f32>(), stream.random()]);
        let (mut bends, mut keeps) = (0, 0);
        for _ in 0..100_000 {
            let (g, n, wo) = (direction(), direction(), direction());
            let cos = g.dot(wo);
            if cos.abs() < 1e-2 {
                continue;
            }
            let found = bent_mapped(n, g, wo);
            assert!((found.length() - 1.0).abs() < 1e-5, "{found:?}");
            let (facing, reflected) = (found.dot(wo), found * (2.0 * found.dot(wo)) - wo);
            assert!(facing * cos > 0.0, "{n:?} on {g:?} along {wo:?}: {found:?} looks away");
            assert!(reflected.dot(g) * cos > 0.0, "{n:?} on {g:?} along {wo:?}: {found:?} reflects inwards");
            assert_eq!(bent_mapped(g, g, wo), g);
            let is_fine = n.dot(wo) * cos > 0.0 && (n * (2.0 * n.dot(wo)) - wo).dot(g) * cos.signum() > 0.01;
            if is_fine {
                assert_eq!(found, n);
                keeps += 1;
            }
            bends += u32::from(found != n);
        }
        assert!(bends > 30_000 && keeps > 10_000, "{bends} and {keeps}");
    }

    #[test]
    fn no_reflection_or_refraction_leads_to_the_wrong_side() {
        for index in [1.5, 1.0 / 1.5, 1.001, 4.0] {
            let ([smooth, bent], changed) = wrong(index, 20_000);
            assert_eq!(bent, 0, "of index {index}");
            // Negative control. Most normals are unchanged.
            assert!(smooth > 200, "{smooth} of index {index}");
            assert!(changed < 10_000, "{changed} of index {index}");
        }
    }

    #[test]
    fn harmless_normals_are_unchanged() {
        let n = Vec3::new(0.0_f32, 0.0, 1.0);
        let shading = Vec3::new(0.1, 0.0, 1.0).normalized();
        for wo in [Vec3::new(0.3, 0.4, 0.8), Vec3::new(-0.5, 0.1, -0.9)] {
            assert_eq!(bent_normal(n, shading, wo.normalized(), 1.5), shading);
        }
        // A flat surface has no other normal, even at grazing incidence.
        let flat = bent_normal(n, n, Vec3::new(1.0, 0.0, 1e-5).normalized(), 1.5);
        assert_eq!(flat, n);
    }
}
