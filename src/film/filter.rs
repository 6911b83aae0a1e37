//! Reconstruction filters.
//!
//! A filter without negative lobes can be importance sampled: the mean of samples drawn from it with equal weights is
//! the filtered picture (report §5.2.5). Samples that are uniform over the film can be weighted by any filter: see
//! [`Weights`](super::Weights).

use crate::sampling::warp::{FilmOffset, OFFSET_NODES};
use crate::scene::{FilmMode, FilmSettings, Filter};
use std::f64::consts::PI;

/// The distribution of samples around the centre of a pixel.
pub fn film_offset(film: &FilmSettings) -> FilmOffset {
    match (film.mode(), film.filter) {
        // Uniform over the pixel, so that those of all pixels are uniform over the film.
        (FilmMode::Continuous, _) => FilmOffset::Uniform(0.5),
        (FilmMode::Importance, Filter::None) => FilmOffset::Centre,
        (FilmMode::Importance, Filter::Box { radius }) => FilmOffset::Uniform(radius as f32),
        (FilmMode::Importance, Filter::Tent { radius }) => FilmOffset::Tent(radius as f32),
        (FilmMode::Importance, filter) => FilmOffset::Drawn(drawn(filter)),
    }
}

/// The filter along one axis, `x` pixels from its centre, up to a factor. Zero beyond the radius.
pub fn profile(filter: Filter, x: f64) -> f64 {
    let (x, radius) = (x.abs(), filter.radius());
    if x > radius {
        return 0.0;
    }
    match filter {
        Filter::None | Filter::Box { .. } => 1.0,
        Filter::Tent { .. } => 1.0 - x / radius,
        Filter::Gaussian { sigma, .. } => {
            let bell = |x: f64| libm::exp(-x * x / (2.0 * sigma * sigma));
            bell(x) - bell(radius)
        }
        Filter::Mitchell { b, c, .. } => {
            // The two pieces of the paper's equation 8, each of width one; times 6.
            let x = 2.0 * x / radius;
            if x < 1.0 {
                ((12.0 - 9.0 * b - 6.0 * c) * x + (-18.0 + 12.0 * b + 6.0 * c)) * x * x + (6.0 - 2.0 * b)
            } else {
                (((-b - 6.0 * c) * x + (6.0 * b + 30.0 * c)) * x + (-12.0 * b - 48.0 * c)) * x
                    + (8.0 * b + 24.0 * c)
            }
        }
        Filter::BlackmanHarris { .. } => {
            // Table 1 of the paper: the minimum four-term window of −92 dB.
            let turn = PI * (1.0 + x / radius);
            0.35875 - 0.48829 * libm::cos(turn) + 0.14128 * libm::cos(2.0 * turn)
                - 0.01168 * libm::cos(3.0 * turn)
        }
        Filter::Lanczos { .. } => sinc(x) * sinc(x / radius),
    }
}

/// sin πx / πx.
fn sinc(x: f64) -> f64 {
    if x < 1e-8 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}

/// Steps of the numerical integration of a filter.
const STEPS: usize = 1 << 13;

/// The quantile function of a non-negative filter, for [`FilmOffset::Drawn`].
fn drawn(filter: Filter) -> [f32; OFFSET_NODES] {
    let step = filter.radius() / STEPS as f64;
    // The integral over each step from the centre, and the total.
    let mut within = vec![0.0];
    for i in 0..STEPS {
        let middle = (i as f64 + 0.5) * step;
        within.push(within[i] + profile(filter, middle));
    }
    let whole = within[STEPS];
    let mut nodes = [0.0; OFFSET_NODES];
    for (i, node) in nodes.iter_mut().enumerate() {
        // Node i bounds the tail with the square of its share.
        let outside = (i as f64 / (OFFSET_NODES - 1) as f64).powi(2);
        let wanted = whole * (1.0 - outside);
        let after = within.partition_point(|&sum| sum < wanted).clamp(1, STEPS);
        let (low, high) = (within[after - 1], within[after]);
        let part = if high > low { ((wanted - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        *node = ((after - 1) as f64 + part) as f32 * step as f32;
    }
    // No sample is placed where the filter nearly vanishes before its radius.
    nodes[OFFSET_NODES - 1] = 0.0;
    nodes
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const WIDE: [Filter; 6] = [
        Filter::Box { radius: 0.5 },
        Filter::Tent { radius: 1.0 },
        Filter::Gaussian { radius: 1.5, sigma: 0.5 },
        Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 },
        Filter::BlackmanHarris { radius: 1.5 },
        Filter::Lanczos { radius: 3.0 },
    ];

    #[test]
    fn filters_peak_at_the_centre_and_end_at_the_radius() {
        for filter in WIDE {
            let (radius, top) = (filter.radius(), profile(filter, 0.0));
            let mut lowest = top;
            for i in 0..=1000 {
                let x = radius * f64::from(i) / 1000.0;
                let value = profile(filter, x);
                assert!(value <= top && value == profile(filter, -x), "{filter} at {x}");
                lowest = lowest.min(value);
            }
            assert_eq!(lowest < 0.0, filter.has_negative_lobes(), "{filter}");
            assert_eq!(profile(filter, radius.next_up()), 0.0);
            if !matches!(filter, Filter::Box { .. }) {
                assert!(profile(filter, radius).abs() < 1e-4 * top, "{filter} jumps at its end");
            }
        }
    }

    // From the papers: Mitchell's filters have unit integral and continuous slopes for all B and C, and weights at unit
    // spacing sum to one; B = 1, C = 0 is the cubic B-spline, B = 0, C = ½ the Catmull–Rom spline. A Lanczos filter is
    // zero at whole numbers. Blackman and Harris's coefficients sum to one.
    #[test]
    fn filters_match_their_papers() {
        let mitchell = |b, c, x| profile(Filter::Mitchell { radius: 2.0, b, c }, x) / 6.0;
        for (b, c) in [(1.0 / 3.0, 1.0 / 3.0), (1.0, 0.0), (0.0, 0.5), (0.3, 0.9)] {
            for i in 0..10 {
                let x = f64::from(i) / 10.0;
                let sum: f64 = (-2..=2).map(|k| mitchell(b, c, x + f64::from(k))).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{sum} at {x} with B = {b}, C = {c}");
            }
            for joint in [1.0, 2.0] {
                let slope = |x: f64| (mitchell(b, c, x + 1e-6) - mitchell(b, c, x)) / 1e-6;
                assert!((slope(joint - 1e-6) - slope(joint)).abs() < 1e-4);
            }
        }
        assert!((mitchell(1.0, 0.0, 0.0) - 2.0 / 3.0).abs() < 1e-12);
        assert!((mitchell(1.0, 0.0, 1.5) - 1.0 / 48.0).abs() < 1e-12);
        assert!((mitchell(0.0, 0.5, 0.5) - 9.0 / 16.0).abs() < 1e-12);
        assert!((mitchell(0.0, 0.5, 1.5) + 1.0 / 16.0).abs() < 1e-12);
        let lanczos = |x| profile(Filter::Lanczos { radius: 3.0 }, x);
        assert!((1..=3).all(|x| lanczos(f64::from(x)).abs() < 1e-12));
        assert!((lanczos(0.5) - 6.0 / (PI * PI)).abs() < 1e-12);
        let harris = |x| profile(Filter::BlackmanHarris { radius: 2.0 }, x);
        assert!((harris(0.0) - 1.0).abs() < 1e-12 && (harris(2.0) - 6e-5).abs() < 1e-9);
        assert!((harris(1.0) - (0.35875 - 0.14128)).abs() < 1e-9);
    }
}
