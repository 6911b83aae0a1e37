//! Adaptive sampling: which pixels receive more samples.
//!
//! At a milestone every pixel either stops with the samples that it has or continues to twice as many. If the samples
//! of a pixel have the relative variance v, n samples leave the squared error v/n. Doubling them removes v/2n of it at
//! the cost of n samples: v/2n² per sample. A pixel continues where that benefit exceeds a threshold λ, which all
//! pixels share (Neyman 1934: the error is least when samples are allocated in proportion to the standard deviation). λ
//! is chosen such that the final error is the requested one.
//!
//! The decision must not depend on the samples it is about, or the picture is biased: samples that have missed a bright
//! path so far underestimate both mean and variance, and a pixel that stopped by its own variance would stop too dark.
//! So v is the mean over the neighbouring pixels, without the pixel itself. The samples of different pixels are
//! independent, and a pixel's own samples affect its decisions only indirectly: by λ, by the brightness that errors are
//! relative to, and by neighbours that continued because of it. v also has a lower limit relative to the mean over the
//! picture, in case no neighbour has sampled a bright path yet.

use super::metrics::bound_of_worst;

/// Radius in pixels of the square neighbourhood from which the variance of a pixel is estimated. The squared difference
/// of two halves estimates a variance with one degree of freedom. With fewer than about a hundred neighbours its noise
/// costs more than adaptive sampling gains (measured on the cover, smallpt and the room).
const REACH: usize = 6;

/// The variance of a pixel is taken to be at least this fraction of the mean over the picture: this limits the cost of
/// bright paths that the few samples of its neighbourhood have missed.
const LEAST: f64 = 1.0 / 64.0;

/// The plan aims at this fraction of the requested squared error: stopped pixels never continue, some of them have
/// stopped too early by chance, and the others need not make up for that alone.
const CAUTION: f64 = 0.9;

/// Steps of the bisection for λ, each of which halves the remaining part of [`OCTAVES`].
const STEPS: u32 = 24;

/// Octaves below its upper bound in which λ is searched: no pixel is worth a millionth as many samples as another.
const OCTAVES: i32 = 40;

/// The number of samples at which each pixel stops.
#[derive(Clone, Debug, PartialEq)]
pub struct AdaptivePlan {
    /// The samples at which each pixel stops, or is decided again.
    pub(super) ends: Vec<u32>,
    /// The share of the squared error in stopped pixels, 0 to 1.
    pub(super) stopped: f64,
}

impl AdaptivePlan {
    /// The samples at which each pixel stops, or is decided again; row-major.
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Whether the numbers of samples of the pixels are possible under this plan, which was made at the milestone
    /// `samples`.
    pub fn allows(&self, samples: u32, mut seen: impl FnMut(usize) -> u64) -> bool {
        let fits = |(pixel, &end): (usize, &u32)| {
            (u64::from(end.min(samples))..=u64::from(end)).contains(&seen(pixel))
        };
        self.ends.iter().enumerate().all(fits)
    }

    /// Decides at the milestone `samples` from the relative squared error of each pixel, in rows of `width`, and the
    /// error of the picture. `last` is the previous plan, `asked` the requested error, and `most` the maximum samples
    /// per pixel.
    pub(super) fn decide(
        width: usize,
        mut errors: Vec<f64>,
        error: f64,
        last: Option<&AdaptivePlan>,
        samples: u32,
        [asked, most]: [f64; 2],
    ) -> AdaptivePlan {
        // The worst pixels are too few to be estimated, and a firefly must not raise its neighbourhood.
        let bound = bound_of_worst(&errors);
        errors.iter_mut().for_each(|error| *error = error.min(bound));
        let had = |pixel: usize| last.map_or(samples, |plan| plan.ends[pixel].min(samples));
        let spread: Vec<f64> = (0..).zip(&errors).map(|(p, error)| error * f64::from(had(p))).collect();
        let least = LEAST * spread.iter().sum::<f64>() / spread.len().max(1) as f64;
        let around = around(&spread, width);
        let open: Vec<(usize, f64)> =
            (0..errors.len()).filter(|&p| had(p) == samples).map(|p| (p, around[p].max(least))).collect();

        let all: f64 = errors.iter().sum();
        let of_open: f64 = open.iter().map(|&(p, _)| errors[p]).sum();
        let wanted = CAUTION * all * (asked / error).powi(2) - (all - of_open);
        let n = f64::from(samples);
        let guessed: f64 = open.iter().map(|&(_, v)| v / n).sum();
        // The estimates from neighbours are scaled to have the mean of the pixels' own errors.
        let scale = if guessed > 0.0 { of_open / guessed } else { 0.0 };
        let goes_on: Box<dyn Fn(f64) -> bool> = if wanted >= of_open || scale == 0.0 {
            Box::new(|_| false)
        } else if let Some(lambda) = lambda(&open, n, most, wanted / scale) {
            Box::new(move |v| v > 2.0 * n * n * lambda)
        } else {
            // `most` samples do not reach the requested error: the good pixels then need not be better than the whole.
            Box::new(move |v| v * scale / n > asked * asked)
        };
        let mut ends: Vec<u32> = (0..errors.len()).map(had).collect();
        for (pixel, v) in open {
            if goes_on(v) {
                ends[pixel] = samples.saturating_mul(2);
            }
        }
        let stopped: f64 = errors.iter().zip(&ends).filter(|(_, end)| **end <= samples).map(|(e, _)| e).sum();
        AdaptivePlan { ends, stopped: if all > 0.0 { (stopped / all).min(1.0) } else { 1.0 } }
    }
}

/// The largest λ that leaves at most `wanted` of the error in the pixels that have `n` samples and may have `most`;
/// `None` if even the smallest leaves more.
fn lambda(open: &[(usize, f64)], n: f64, most: f64, wanted: f64) -> Option<f64> {
    let left = |lambda: f64| -> f64 {
        let of_one = |&(_, v): &(usize, f64)| {
            let mut n = n;
            while n < most && v > 2.0 * n * n * lambda {
                n *= 2.0;
            }
            v / n.min(most)
        };
        open.iter().map(of_one).sum()
    };
    let highest = open.iter().map(|&(_, v)| v).fold(0.0, f64::max) / (2.0 * n * n);
    let at = |octaves: f64| highest * libm::exp2(-octaves);
    let (mut enough, mut too_high) = (f64::from(OCTAVES), 0.0);
    if left(at(enough)) > wanted {
        return None;
    }
    for _ in 0..STEPS {
        let middle = 0.5 * (enough + too_high);
        if left(at(middle)) <= wanted { enough = middle } else { too_high = middle }
    }
    Some(at(enough))
}

/// The mean over the neighbours of each pixel, without the pixel itself; its own value if it has no neighbour.
fn around(values: &[f64], width: usize) -> Vec<f64> {
    let height = values.len() / width.max(1);
    let near = |i: usize, len: usize| i.saturating_sub(REACH)..(i + REACH + 1).min(len);
    let across: Vec<f64> = (0..values.len())
        .map(|i| near(i % width, width).map(|x| values[i / width * width + x]).sum())
        .collect();
    (0..values.len())
        .map(|i| {
            let (columns, rows) = (near(i % width, width), near(i / width, height));
            let count = columns.len() * rows.len() - 1;
            let sum: f64 = rows.map(|y| across[y * width + i % width]).sum();
            if count == 0 { values[i] } else { ((sum - values[i]) / count as f64).max(0.0) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 40;

    /// A picture with squared error `quiet` in the left half and `loud` in the right half.
    fn halves(quiet: f64, loud: f64) -> Vec<f64> {
        (0..SIDE * SIDE).map(|i| if i % SIDE < SIDE / 2 { quiet } else { loud }).collect()
    }

    fn decide(
        errors: Vec<f64>,
        last: Option<&AdaptivePlan>,
        samples: u32,
        asked: f64,
        most: f64,
    ) -> AdaptivePlan {
        let error = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        AdaptivePlan::decide(SIDE, errors, error, last, samples, [asked, most])
    }

    fn at(plan: &AdaptivePlan, x: usize) -> u32 {
        plan.ends[SIDE / 2 * SIDE + x]
    }

    #[test]
    fn samples_follow_the_error_until_it_is_small() {
        // Variances of 1 to 16 need samples in proportion to standard deviations.
        let plan = decide(halves(0.01, 2.56), None, 16, 0.5, 1e9);
        assert_eq!((at(&plan, 5), at(&plan, 35)), (16, 32));
        assert!(plan.stopped > 0.0 && plan.stopped < 0.01, "{}", plan.stopped);
        let enough = decide(halves(0.01, 2.56), None, 16, 1.2, 1e9);
        assert!(enough.ends.iter().all(|&end| end == 16) && enough.stopped == 1.0);
        // Pixels of equal variance continue together, or stop together.
        let flat = decide(halves(0.5, 0.5), None, 16, 0.5, 1e9);
        assert!(flat.ends.iter().all(|&end| end == 32) && flat.stopped == 0.0);
        // A stopped pixel does not continue, however large its error turns out to be.
        let next = decide(halves(1.0, 1.28), Some(&plan), 32, 0.5, 1e9);
        assert_eq!((at(&next, 5), at(&next, 35)), (16, 64));
        assert!(decide(vec![0.0; SIDE * SIDE], None, 16, 0.5, 1e9).ends.iter().all(|&end| end == 16));
    }

    /// Applies plans to errors v/n until all pixels have stopped; returns the mean of v/n and the mean of n.
    fn simulate(v: &[f64], asked: f64) -> [f64; 2] {
        let mut plan: Option<AdaptivePlan> = None;
        for samples in (4..20).map(|i| 1_u32 << i) {
            let had = |p: usize| plan.as_ref().map_or(samples, |plan| plan.ends[p].min(samples));
            let errors = (0..v.len()).map(|p| v[p] / f64::from(had(p))).collect();
            let next = decide(errors, plan.as_ref(), samples, asked, 1e9);
            let done = next.ends.iter().all(|&end| end <= samples);
            plan = Some(next);
            if done {
                break;
            }
        }
        let ends = plan.expect("a plan").ends;
        let mean = |of: &dyn Fn(usize) -> f64| (0..v.len()).map(of).sum::<f64>() / v.len() as f64;
        [mean(&|p| v[p] / f64::from(ends[p])), mean(&|p| f64::from(ends[p]))]
    }

    #[test]
    fn the_requested_error_needs_nearly_the_least_samples() {
        // Ranges over a factor of 2¹⁰ from left to right.
        let v: Vec<f64> = (0..SIDE * SIDE).map(|i| libm::exp2((i % SIDE) as f64 / 4.0)).collect();
        let mean = |of: &dyn Fn(f64) -> f64| v.iter().map(|&v| of(v)).sum::<f64>() / v.len() as f64;
        for asked in [0.3, 0.5, 1.0] {
            let [squared, samples] = simulate(&v, asked);
            assert!(squared <= asked * asked * 1.001, "{squared}");
            // The samples that uniform sampling needs for this error.
            let (uniform, best) = (mean(&|v| v) / squared, mean(&|v| v.sqrt()).powi(2) / squared);
            assert!(best < 0.6 * uniform && samples >= best, "{samples} {best} {uniform}");
            assert!(samples < 1.1 * best, "{samples} samples, but {best} suffice");
        }
    }

    #[test]
    fn good_pixels_stop_when_the_error_cannot_be_reached() {
        let plan = decide(halves(0.01, 2.56), None, 16, 0.5, 20.0);
        assert_eq!((at(&plan, 5), at(&plan, 35)), (16, 32));
    }

    #[test]
    fn a_pixel_has_no_influence_on_its_own_decision() {
        // A block of noise in the quiet half, around one pixel.
        let middle = SIDE / 2 * SIDE + 10;
        let with = |dot: f64, block: f64| {
            let mut errors = halves(0.01, 2.56);
            for row in 0..5 {
                errors[middle + row * SIDE - 2 * SIDE - 2..][..5].fill(block);
            }
            errors[middle] = dot;
            decide(errors, None, 16, 0.6, 1e9).ends
        };
        for dot in [0.0, 0.01, 2.56, 1000.0] {
            assert_eq!([with(dot, 2.56)[middle], with(dot, 0.01)[middle]], [32, 16], "{dot}");
        }
        // Negative control: the pixels around it decide, within the radius.
        let (loud, quiet) = (with(2.56, 2.56), with(0.01, 0.01));
        assert_eq!([loud[middle - 3], quiet[middle - 3]], [32, 16]);
        assert_eq!([loud[middle - 9], quiet[middle - 9]], [16, 16]);
    }

    #[test]
    fn neighbourhood_means_exclude_the_centre() {
        let seen = around(&[1.0, 2.0, 3.0, 6.0], 2);
        assert_eq!(seen, [11.0 / 3.0, 10.0 / 3.0, 3.0, 2.0]);
        assert_eq!(around(&[5.0], 1), [5.0]);
        let mut values = vec![0.0; SIDE * SIDE];
        values[20 * SIDE + 20] = 168.0;
        let seen = around(&values, SIDE);
        assert_eq!(seen[20 * SIDE + 20], 0.0);
        assert_eq!((seen[14 * SIDE + 26], seen[13 * SIDE + 20]), (1.0, 0.0));
        assert_eq!(seen.iter().sum::<f64>(), 168.0);
    }

    #[test]
    fn sample_counts_must_match_the_plan() {
        let plan = AdaptivePlan { ends: vec![16, 64], stopped: 0.0 };
        let allows = |seen: [u64; 2]| plan.allows(32, |pixel| seen[pixel]);
        assert!(allows([16, 32]) && allows([16, 64]) && allows([16, 50]));
        assert!(!allows([17, 32]) && !allows([15, 32]) && !allows([16, 65]) && !allows([16, 31]));
    }
}
