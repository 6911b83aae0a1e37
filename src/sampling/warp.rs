//! Warps from the unit square, each with its density.

use crate::math::{Float, Uint, Vec3, function, trig};
use std::f32::consts::FRAC_1_PI;

/// A symmetric triangle on (−1, 1) (report §5.2.2), by inverting its distribution function.
#[inline(always)]
pub fn tent<F: Float>(u: F) -> F {
    function!(F, tent(u), {
        let rising = u.lt(F::splat(0.5));
        // Reflected to [0, 1] from the nearer end, where √ keeps its precision.
        let twice = F::select(rising, u, -u + 1.0) * 2.0;
        let x = -twice.sqrt() + 1.0;
        F::select(rising, -x, x)
    })
}

/// Density of [`tent`] at `x`.
#[inline(always)]
pub fn tent_pdf<F: Float>(x: F) -> F {
    (-x.abs() + 1.0).max(F::zero())
}

/// A point on the unit disk, uniform by area: r = √u₀, θ = 2π·u₁ (report §4.3.1.1).
#[inline(always)]
pub fn disk<F: Float>(u: [F; 2]) -> (F, F) {
    function!(F, disk(u), {
        let r = u[0].sqrt();
        let (sin, cos) = trig::sin_cos_turns(u[1]);
        (r * cos, r * sin)
    })
}

/// Density of [`disk`] by area, inside the disk.
#[inline(always)]
pub fn disk_pdf<F: Float>() -> F {
    F::splat(FRAC_1_PI)
}

/// A direction around +z with density proportional to its cosine, by Malley's method: a point on the
/// disk, lifted to the hemisphere.
#[inline(always)]
pub fn cosine_hemisphere<F: Float>(u: [F; 2]) -> Vec3<F> {
    function!(F, cosine_hemisphere(u), {
        let (x, y) = disk(u);
        // 1 − r² with r² = u₀ is exact, whereas 1 − x² − y² would lose half its digits near the horizon.
        Vec3::new(x, y, (-u[0] + 1.0).sqrt())
    })
}

/// Density of [`cosine_hemisphere`] by solid angle, for a direction with this cosine to +z.
#[inline(always)]
pub fn cosine_hemisphere_pdf<F: Float>(cos_theta: F) -> F {
    cos_theta.max(F::zero()) * FRAC_1_PI
}

/// A direction, uniform over the sphere.
#[inline(always)]
pub fn uniform_sphere<F: Float>(u: [F; 2]) -> Vec3<F> {
    function!(F, uniform_sphere(u), {
        let z = -u[0] * 2.0 + 1.0;
        let r = (u[0] * (-u[0] + 1.0)).sqrt() * 2.0;
        let (sin, cos) = trig::sin_cos_turns(u[1]);
        Vec3::new(r * cos, r * sin, z)
    })
}

/// Density of [`uniform_sphere`] by solid angle.
#[inline(always)]
pub fn uniform_sphere_pdf<F: Float>() -> F {
    F::splat(FRAC_1_PI * 0.25)
}

/// A direction around +z, uniform by solid angle in a cone, given by 1 − cos of its half angle.
#[inline(always)]
pub fn cone<F: Float>(u: [F; 2], versine: F) -> Vec3<F> {
    function!(F, cone(u, versine), {
        // In terms of 1 − cos there is no cancellation for a narrow cone.
        let own = u[0] * versine;
        let r = (own * (-own + 2.0)).max(F::zero()).sqrt();
        let (sin, cos) = trig::sin_cos_turns(u[1]);
        Vec3::new(r * cos, r * sin, -own + 1.0)
    })
}

/// Density of [`cone`] by solid angle, within the cone.
#[inline(always)]
pub fn cone_pdf<F: Float>(versine: F) -> F {
    F::splat(0.5 * FRAC_1_PI) / versine
}

/// The distribution of samples around a pixel's centre by which their plain mean is the filtered image. The film
/// selects it; integrators only sample it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
pub enum FilmOffset {
    /// At the centre.
    Centre,
    /// Uniform within this distance along each axis, in pixels.
    Uniform(f32),
    /// [`tent`] along each axis, scaled by this number of pixels.
    Tent(f32),
    /// Tabulated, for a symmetric density that falls from its middle to its ends. Node i is the distance, in pixels,
    /// beyond which the fraction (i/64)² of the density lies, with linear interpolation between nodes. The square makes
    /// the nodes nearly linear where the density falls to its end, whatever its slope there.
    Drawn([f32; OFFSET_NODES]),
}

/// Nodes of [`FilmOffset::Drawn`].
pub const OFFSET_NODES: usize = 65;

impl FilmOffset {
    /// An offset from the centre along one axis, in pixels.
    #[inline(always)]
    pub fn sample<F: Float>(&self, u: F) -> F {
        function!(F, film_offset(u), {
            match *self {
                FilmOffset::Centre => F::zero(),
                FilmOffset::Uniform(ref radius) => (u * 2.0 - 1.0) * F::given(radius),
                FilmOffset::Tent(ref radius) => tent(u) * F::given(radius),
                FilmOffset::Drawn(ref nodes) => {
                    let side = u * 2.0 - 1.0;
                    let at = (-side.abs() + 1.0).sqrt() * (OFFSET_NODES - 1) as f32;
                    let node = at.floor();
                    let index = node.to_uint();
                    let from = F::gather(nodes, index);
                    let to = F::gather(nodes, index + F::Uint::splat(1));
                    (from + (to - from) * (at - node)).copysign(side)
                }
            }
        })
    }

    /// Density of [`FilmOffset::sample`] per pixel; `Centre` has none and returns zero.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, x: F) -> F {
        match *self {
            FilmOffset::Centre => F::zero(),
            FilmOffset::Uniform(radius) => {
                let inside = x.lt(F::splat(radius)) & F::splat(-radius).le(x);
                F::splat(0.5 / radius).only(inside)
            }
            FilmOffset::Tent(radius) => tent_pdf(x / radius) / radius,
            FilmOffset::Drawn(ref nodes) => {
                let (x, share) = (x.abs(), 1.0 / (OFFSET_NODES - 1) as f32);
                let mut pdf = F::zero();
                for i in 0..OFFSET_NODES - 1 {
                    let (far, near) = (nodes[i], nodes[i + 1]);
                    // The fraction beyond x is a square, whose root is linear from node to node.
                    let outside = ((F::splat(far) - x) / (far - near) + i as f32) * share;
                    let density = outside * (share / (far - near));
                    pdf = F::select(F::splat(near).le(x) & x.lt(F::splat(far)), density, pdf);
                }
                pdf
            }
        }
    }
}

/// The weights of a triangle's second and third corners at a uniform point of it: the square folded along its diagonal
/// without discontinuity (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
#[inline(always)]
pub fn triangle<F: Float>(u: [F; 2]) -> [F; 2] {
    function!(F, triangle_weights(u), {
        let upper = u[0].lt(u[1]);
        let half = F::select(upper, u[0], u[1]) * 0.5;
        let rest = F::select(upper, u[1], u[0]) - half;
        [F::select(upper, half, rest), F::select(upper, rest, half)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that samples follow a density on an interval: a χ² test of 200,000 unstratified samples in 64 bins; the
    /// bound is the 1 − 10⁻⁶ quantile of χ² with 63 degrees of freedom.
    fn chi_square(
        from: f64,
        to: f64,
        sample: impl Fn(f32) -> f32,
        pdf: impl Fn(f32) -> f32,
    ) -> Result<(), f64> {
        const BINS: usize = 64;
        const N: u32 = 200_000;
        let mut seen = [0_u32; BINS];
        for i in 0..N {
            let [u, ..] = crate::sampling::Independent { seed: 1 }.draw::<f32>(
                crate::sampling::PathId {
                    pixel: crate::math::Uint::splat(i),
                    sample: crate::math::Uint::splat(0),
                },
                crate::math::Uint::splat(0),
            );
            let x = f64::from(sample(u));
            assert!((from..=to).contains(&x), "{x} is outside [{from}, {to}]");
            seen[((x - from) / (to - from) * BINS as f64).min(BINS as f64 - 1.0) as usize] += 1;
        }
        let mut chi2 = 0.0;
        for (bin, &count) in seen.iter().enumerate() {
            let width = (to - from) / BINS as f64;
            // Simpson's rule is exact for the linear pieces of all densities here, except for a kink at a bin's edge.
            let at = |t: f64| f64::from(pdf((from + (bin as f64 + t) * width) as f32));
            let expected = f64::from(N) * width * (at(1e-4) + 4.0 * at(0.5) + at(1.0 - 1e-4)) / 6.0;
            chi2 += (f64::from(count) - expected).powi(2) / expected;
        }
        if chi2 < 128.6 { Ok(()) } else { Err(chi2) }
    }

    #[test]
    fn tent_follows_its_density_and_a_wrong_one_is_detected() {
        chi_square(-1.0, 1.0, tent, tent_pdf).unwrap();
        // Negative control: a uniform variable does not follow the tent.
        assert!(chi_square(-1.0, 1.0, |u| u * 2.0 - 1.0, tent_pdf).is_err());
    }

    #[test]
    fn film_offsets_follow_their_densities() {
        for offset in
            [FilmOffset::Uniform(0.5), FilmOffset::Uniform(1.5), FilmOffset::Tent(1.0), FilmOffset::Tent(2.0)]
        {
            let radius = match offset {
                FilmOffset::Uniform(radius) | FilmOffset::Tent(radius) => f64::from(radius),
                FilmOffset::Centre | FilmOffset::Drawn(_) => 0.0,
            };
            chi_square(-radius, radius, |u| offset.sample(u), |x| offset.pdf(x)).unwrap();
        }
    }

    #[test]
    fn triangle_fills_a_triangle_evenly() {
        // Each of 16 equal triangles contains a sixteenth of a regular grid, up to points at its border.
        let (n, mut counts) = (512, [0; 16]);
        for i in 0..n * n {
            let u = [(i / n) as f32 + 0.5, (i % n) as f32 + 0.5].map(|x| x / n as f32);
            let [b, c] = super::triangle(u);
            assert!(b >= 0.0 && c >= 0.0 && b + c <= 1.0, "{b} {c}");
            let (column, row) = ((b * 4.0) as usize, (c * 4.0) as usize);
            let upper = (b * 4.0).fract() + (c * 4.0).fract() > 1.0;
            // Row by row: squares below the diagonal contain two triangles, those on it one.
            let before: usize = (0..row).map(|row| 7 - 2 * row).sum();
            counts[before + 2 * column + usize::from(upper)] += 1;
        }
        let expected = f64::from(n * n) / 16.0;
        for count in counts {
            assert!((f64::from(count) / expected - 1.0).abs() < 0.02, "{counts:?}");
        }
    }

    #[test]
    fn radii_and_cosines_of_disk_and_hemisphere_follow_their_densities() {
        // By area, P(r ≤ x) = x², so r² is uniform; by cosine, P(cos ≥ c) = 1 − c², so cos² is uniform.
        let radius2 = |u| {
            let (x, y) = disk([u, 0.3]);
            x * x + y * y
        };
        chi_square(0.0, 1.0001, radius2, |_| 1.0).unwrap();
        let cos2 = |u| {
            let w = cosine_hemisphere([u, 0.3]);
            w.z * w.z
        };
        chi_square(0.0, 1.0001, cos2, |_| 1.0).unwrap();
        // Negative control: a uniform hemisphere has a uniform cosine, not cos².
        assert!(chi_square(0.0, 1.0001, |u| u * u, |_| 1.0).is_err());
        // Angles are uniform.
        let angle = |u| {
            let (x, y) = disk([0.5, u]);
            crate::math::trig::angle_turns(y, x)
        };
        chi_square(0.0, 1.0, angle, |_| 1.0).unwrap();
    }

    #[test]
    fn densities_integrate_to_one() {
        let n = 20_000;
        let cosines = (0..n).map(|i| (i as f32 + 0.5) / n as f32);
        let hemisphere: f32 =
            cosines.map(|c| cosine_hemisphere_pdf(c) * std::f32::consts::TAU / n as f32).sum();
        assert!((hemisphere - 1.0).abs() < 1e-4, "{hemisphere}");
        assert!((disk_pdf::<f32>() * std::f32::consts::PI - 1.0).abs() < 1e-6);
        assert!((uniform_sphere_pdf::<f32>() * 4.0 * std::f32::consts::PI - 1.0).abs() < 1e-6);
    }

    #[test]
    fn directions_have_length_one() {
        for i in 0..1000 {
            let u = [(i as f32 + 0.5) / 1000.0, (i as f32 * 0.618_034).fract()];
            assert!((cosine_hemisphere(u).length() - 1.0).abs() < 1e-6);
            assert!((uniform_sphere(u).length() - 1.0).abs() < 1e-6);
        }
    }
}
