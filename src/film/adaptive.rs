//! Which pixels go on: samples are spent where they take the most error away.
//!
//! At a milestone every pixel either stops with the samples that it has or goes on to twice as many. Of a pixel whose
//! samples have the relative variance v, n samples leave the error v/n, so that doubling them takes away v/2n for
//! the price of n: v/2n² each. A pixel goes on where that is more than some λ, the same for all (Neyman 1934: for the
//! least error, samples go as the standard deviation), and λ is such that what is left in the end is the error that
//! is asked for.
//!
//! What decides must not depend on what is decided about, or the picture is biased: of samples that have missed a
//! bright path so far, both mean and spread are too small, and a pixel that stopped by its own spread would stop too
//! dark. So v is the mean over the pixels around one, without itself: the samples of different pixels are
//! independent, and what a pixel's own samples say is in its decisions only at third hand, by λ, by the brightness that
//! errors are relative to, and by neighbours that went on because of it. And no pixel is taken to be much quieter than
//! the picture is on the whole, however few of its neighbours have seen anything yet.

use super::metrics::bound_of_worst;

/// Pixels to each side whose samples tell how much a pixel's vary. The difference of two halves is one number, and far
/// from the mean of many: with fewer than a hundred and more around it, what is won by following the error is lost to
/// chance (measured on the cover, smallpt and the room).
const REACH: usize = 6;

/// A pixel's samples vary at least this fraction as much as those of the whole picture on average: what a few samples
/// of its neighbourhood have missed can cost no more than that.
const LEAST: f64 = 1.0 / 64.0;

/// What is planned for is this fraction of the squared error that is asked for: pixels stop for good, some of them too
/// early, by chance, and the others must not have to make up for it alone.
const CAUTION: f64 = 0.9;

/// Steps of the search for λ, each of which halves the octaves that are left of [`OCTAVES`].
const STEPS: u32 = 24;

/// How far below its highest λ is looked for: no pixel is worth a millionth as many samples as another.
const OCTAVES: i32 = 40;

/// How far each pixel goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The samples at which each pixel stops, or is decided about again.
    pub(super) ends: Vec<u32>,
    /// The share of the squared error that is in pixels that have stopped.
    pub(super) stopped: f64,
}

impl Plan {
    /// The samples at which each pixel stops, or is decided about again.
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Whether pixels may have so many samples, when all had those of the milestone at which this was decided.
    pub fn allows(&self, samples: u32, mut seen: impl FnMut(usize) -> u64) -> bool {
        let fits = |(pixel, &end): (usize, &u32)| {
            (u64::from(end.min(samples))..=u64::from(end)).contains(&seen(pixel))
        };
        self.ends.iter().enumerate().all(fits)
    }

    /// Decides at `samples` a pixel, with the relative squared error of each by what it has, in rows of `width`, and
    /// the error of the picture. `last` is what was decided before, `asked` the error to end at, and no pixel is to
    /// have more than `most` samples.
    pub(super) fn decide(
        width: usize,
        mut errors: Vec<f64>,
        error: f64,
        last: Option<&Plan>,
        samples: u32,
        [asked, most]: [f64; 2],
    ) -> Plan {
        // Of the worst there are too few to be asked about, and a firefly must not light up its neighbourhood.
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
        // What neighbours say of a pixel and what it says itself are the same on the whole.
        let scale = if guessed > 0.0 { of_open / guessed } else { 0.0 };
        let goes_on: Box<dyn Fn(f64) -> bool> = if wanted >= of_open || scale == 0.0 {
            Box::new(|_| false)
        } else if let Some(lambda) = lambda(&open, n, most, wanted / scale) {
            Box::new(move |v| v > 2.0 * n * n * lambda)
        } else {
            // So few samples do not get there: what is as good as the whole is to be need not be better.
            Box::new(move |v| v * scale / n > asked * asked)
        };
        let mut ends: Vec<u32> = (0..errors.len()).map(had).collect();
        for (pixel, v) in open {
            if goes_on(v) {
                ends[pixel] = samples.saturating_mul(2);
            }
        }
        let stopped: f64 = errors.iter().zip(&ends).filter(|(_, end)| **end <= samples).map(|(e, _)| e).sum();
        Plan { ends, stopped: if all > 0.0 { (stopped / all).min(1.0) } else { 1.0 } }
    }
}

/// The largest λ that leaves no more than `wanted` in the pixels that have `n` samples and may have `most`; none if
/// even the smallest leaves more.
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

/// For each pixel the mean over those around it, without itself; where there is none, its own.
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

    /// A picture of which the left half has `quiet` and the right half `loud` squared error.
    fn halves(quiet: f64, loud: f64) -> Vec<f64> {
        (0..SIDE * SIDE).map(|i| if i % SIDE < SIDE / 2 { quiet } else { loud }).collect()
    }

    fn decide(errors: Vec<f64>, last: Option<&Plan>, samples: u32, asked: f64, most: f64) -> Plan {
        let error = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        Plan::decide(SIDE, errors, error, last, samples, [asked, most])
    }

    fn at(plan: &Plan, x: usize) -> u32 {
        plan.ends[SIDE / 2 * SIDE + x]
    }

    #[test]
    fn samples_go_where_the_error_is_and_nowhere_once_it_is_small() {
        // Spreads of 1 to 16 ask for samples as 1 to 16 standard deviations.
        let plan = decide(halves(0.01, 2.56), None, 16, 0.5, 1e9);
        assert_eq!((at(&plan, 5), at(&plan, 35)), (16, 32));
        assert!(plan.stopped > 0.0 && plan.stopped < 0.01, "{}", plan.stopped);
        let enough = decide(halves(0.01, 2.56), None, 16, 1.2, 1e9);
        assert!(enough.ends.iter().all(|&end| end == 16) && enough.stopped == 1.0);
        // Equal spreads go on together, or stop together.
        let flat = decide(halves(0.5, 0.5), None, 16, 0.5, 1e9);
        assert!(flat.ends.iter().all(|&end| end == 32) && flat.stopped == 0.0);
        // Who has stopped does not go on again, however bad it turns out to be.
        let next = decide(halves(1.0, 1.28), Some(&plan), 32, 0.5, 1e9);
        assert_eq!((at(&next, 5), at(&next, 35)), (16, 64));
        assert!(decide(vec![0.0; SIDE * SIDE], None, 16, 0.5, 1e9).ends.iter().all(|&end| end == 16));
    }

    /// Errors v/n under plans until the end: the mean of v/n, and the mean of n.
    fn simulate(v: &[f64], asked: f64) -> [f64; 2] {
        let mut plan: Option<Plan> = None;
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
    fn the_error_that_is_asked_for_takes_nearly_as_few_samples_as_can_be() {
        // Over 2¹⁰ from the left to the right.
        let v: Vec<f64> = (0..SIDE * SIDE).map(|i| libm::exp2((i % SIDE) as f64 / 4.0)).collect();
        let mean = |of: &dyn Fn(f64) -> f64| v.iter().map(|&v| of(v)).sum::<f64>() / v.len() as f64;
        for asked in [0.3, 0.5, 1.0] {
            let [squared, samples] = simulate(&v, asked);
            assert!(squared <= asked * asked * 1.001, "{squared}");
            // As many as give this error.
            let (uniform, best) = (mean(&|v| v) / squared, mean(&|v| v.sqrt()).powi(2) / squared);
            assert!(best < 0.6 * uniform && samples >= best, "{samples} {best} {uniform}");
            assert!(samples < 1.1 * best, "{samples} samples where {best} would do");
        }
    }

    #[test]
    fn what_cannot_be_reached_is_not_asked_of_what_is_good() {
        let plan = decide(halves(0.01, 2.56), None, 16, 0.5, 20.0);
        assert_eq!((at(&plan, 5), at(&plan, 35)), (16, 32));
    }

    #[test]
    fn a_pixel_decides_nothing_about_itself() {
        // A block of noise in the quiet half, and the pixel in the middle of it.
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
        // Negative control: what is around it decides, as far as it reaches.
        let (loud, quiet) = (with(2.56, 2.56), with(0.01, 0.01));
        assert_eq!([loud[middle - 3], quiet[middle - 3]], [32, 16]);
        assert_eq!([loud[middle - 9], quiet[middle - 9]], [16, 16]);
    }

    #[test]
    fn means_leave_out_what_they_are_around() {
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
    fn what_pixels_have_must_be_what_was_planned() {
        let plan = Plan { ends: vec![16, 64], stopped: 0.0 };
        let allows = |seen: [u64; 2]| plan.allows(32, |pixel| seen[pixel]);
        assert!(allows([16, 32]) && allows([16, 64]) && allows([16, 50]));
        assert!(!allows([17, 32]) && !allows([15, 32]) && !allows([16, 65]) && !allows([16, 31]));
    }
}
