//! The normals that smooth surfaces of meshes scatter around.
//!
//! Around an interpolated normal a mirror may reflect, and glass may reflect or refract, to the wrong side of the
//! triangle. Nothing may pass there, as it would leak through the surface, and what is dropped darkens the rims of coarse
//! meshes. A delta lobe has one direction for each way that light takes: where that is on the wrong side, the normal is
//! bent until it is on the right one, so that no energy is lost.

use super::{CompiledScene, Interaction};
use crate::material::{Bsdf, Bxdf};
use crate::math::{Float, Frame, Ray, Vec3, function};

/// The least cosine between the true normal and what is reflected around a bent one: many times what rounding does to
/// directions, and less than a tenth of a degree.
const LEAST_COSINE: f32 = 1e-3;

impl CompiledScene {
    /// The frame in which light is scattered that arrives along a ray: that of the shading normal, bent where a delta lobe
    /// would send light to the wrong side of the surface.
    #[inline(always)]
    pub fn scattering_frame<F: Float>(&self, at: &Interaction<F>, ray: &Ray<F>, bsdf: &Bsdf<F>) -> Frame<F> {
        if !(self.surfaces.has_shading_normals() && self.materials.has_delta()) {
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

/// The normal nearest to a shading normal around which directions stay on their side of a surface with the normal `n`:
/// what is reflected on that of `wo`, what is refracted on the other. `wo` is on the same side by both normals; `index` is
/// the index of refraction on the side where `n` does not point over that where it does.
///
/// A reflected direction below the surface is lifted to the horizon, and the normal is halfway between that and `wo`
/// (Keller et al. 2017, "The Iray Light Transport Simulation and Rendering System"). Only light that leaves the denser
/// medium can be refracted to the wrong side; then the normal is `n`, and so it is where `wo` grazes the surface.
#[inline(always)]
fn bent_normal<F: Float>(n: Vec3<F>, shading: Vec3<F>, wo: Vec3<F>, index: F) -> Vec3<F> {
    function!(F, bent_normal(n, shading, wo, index), {
        let (zero, one) = (F::zero(), F::splat(1.0));
        let side = one.copysign(wo.dot(n));
        let (up, smooth) = (n * side, shading * side);
        let least = F::splat(LEAST_COSINE);
        let reflected = smooth * (wo.dot(smooth) * 2.0) - wo;
        let missing = least - reflected.dot(up);
        let lifted = (reflected + up * missing).normalized();
        let bent = Vec3::select(missing.gt(zero), (wo + lifted).normalized(), smooth);

        let eta = F::select(side.gt(zero), index, one / index);
        let cos = wo.dot(bent);
        let sin2_t = (-cos * cos + 1.0) / (eta * eta);
        let cos_t = (-sin2_t + 1.0).max(zero).sqrt();
        let refracted = bent * (cos / eta - cos_t) - wo * (one / eta);
        let leaks = sin2_t.lt(one) & !refracted.dot(up).lt(zero);
        // Halfway between two grazing directions there would be rounding errors.
        let grazes = wo.dot(up).lt(least);
        Vec3::select(leaks | grazes, up, bent) * side
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{SmoothDielectric, TransportMode};
    use crate::math::Rgb;
    use crate::sampling::{Stream, warp};
    use rand::RngExt;

    /// How many of the ways that light takes at smooth glass lead to the wrong side of the surface, around shading normals
    /// and around bent ones; and how many normals are bent.
    fn wrong(index: f32, count: u32) -> ([u32; 2], u32) {
        let mut stream = Stream::new(7, 0, 0);
        let (mut wrong, mut changed) = ([0; 2], 0);
        let mut done = 0;
        while done < count {
            let [n, wo, tilt] =
                [(); 3].map(|()| warp::uniform_sphere([stream.random::<f32>(), stream.random()]));
            let shading = (n + tilt * stream.random_range(0.0..0.5_f32)).normalized();
            // As `Triangles::point` has it, beyond what rounding decides.
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
                    *wrong += u32::from(way.chance > 1e-4 && !passes);
                }
            }
        }
        (wrong, changed)
    }

    #[test]
    fn no_way_that_light_takes_leads_to_the_wrong_side() {
        for index in [1.5, 1.0 / 1.5, 1.001, 4.0] {
            let ([smooth, bent], changed) = wrong(index, 20_000);
            assert_eq!(bent, 0, "of index {index}");
            // Negative control; and most normals stay what they are.
            assert!(smooth > 200, "{smooth} of index {index}");
            assert!(changed < 10_000, "{changed} of index {index}");
        }
    }

    #[test]
    fn normals_that_do_no_harm_stay_as_they_are() {
        let n = Vec3::new(0.0_f32, 0.0, 1.0);
        let shading = Vec3::new(0.1, 0.0, 1.0).normalized();
        for wo in [Vec3::new(0.3, 0.4, 0.8), Vec3::new(-0.5, 0.1, -0.9)] {
            assert_eq!(bent_normal(n, shading, wo.normalized(), 1.5), shading);
        }
        // A flat surface has no other normal, however flat the ray.
        let flat = bent_normal(n, n, Vec3::new(1.0, 0.0, 1e-5).normalized(), 1.5);
        assert_eq!(flat, n);
    }
}
