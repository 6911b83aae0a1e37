//! How far a picture is from the truth, by its own account.
//!
//! The samples of a pixel are cut into two halves. Each makes a picture, and what these differ by tells how far
//! their mean is from the truth: where samples are independent, half the difference has the very variance of
//! the mean. The spread of single samples would tell nothing about samples that are spread evenly (`sobol`);
//! the halves of 2ᵏ such samples are as evenly spread as the whole, and tell a few per cent too much at most,
//! because each is even where the other is not.
//!
//! Errors are relative to what is seen, and where that is nearly black to the [`brightness`] of the whole picture:
//! neither the unit of length nor that of radiance decides where a render ends. Of a black picture no error is known.

use super::Picture;
use super::adaptive::Plan;
use super::metrics::relative_error;
use std::sync::Arc;

pub use super::metrics::{WORST, brightness, root_mean_without_worst};

/// The first number of samples whose picture is kept to hold a later one against.
pub const FIRST_MILESTONE: u32 = 8;

/// The picture at a power of two of samples a pixel, and what is known of its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Milestone {
    /// Samples a pixel.
    pub samples: u32,
    /// The estimate of its error, if there was a milestone before it.
    pub error: Option<f64>,
    /// The picture; of pixels that have stopped, the one at half their samples.
    pub picture: Arc<Picture>,
    /// How far each pixel goes, where that is decided for each.
    pub plan: Option<Arc<Plan>>,
}

impl Milestone {
    /// The one after `last` in the order of a render: at twice its samples.
    pub fn new(samples: u32, picture: Picture, last: Option<&Milestone>) -> Milestone {
        let half = last.filter(|last| last.samples == samples / 2);
        let errors = half.and_then(|half| errors(&half.picture, &picture));
        let error = errors.map(root_mean_without_worst);
        Milestone { samples, error, picture: Arc::new(picture), plan: None }
    }

    /// The same, where samples are spent where the error is until it is the one `asked` for, or pixels have `most`:
    /// every pixel of `picture` has the samples that the plan of `last` gave it.
    pub fn adaptive(
        samples: u32,
        mut picture: Picture,
        last: Option<&Milestone>,
        asked: f64,
        most: u32,
    ) -> Milestone {
        let half = last.filter(|last| last.samples == samples / 2);
        let Some((half, errors)) = half.and_then(|half| Some((half, errors(&half.picture, &picture)?)))
        else {
            return Milestone::new(samples, picture, last);
        };
        let error = root_mean_without_worst(errors.clone());
        let (width, last) = (picture.width as usize, half.plan.as_deref());
        let plan = Plan::decide(width, errors, error, last, samples, [asked, f64::from(most)]);
        // Of those that stop, what they are held against later is what they were held against now.
        for ((rgb, half), &end) in picture.rgb.iter_mut().zip(&half.picture.rgb).zip(plan.ends()) {
            if end <= samples {
                *rgb = *half;
            }
        }
        Milestone { samples, error: Some(error), picture: Arc::new(picture), plan: Some(Arc::new(plan)) }
    }

    /// The share of the squared error that more samples do nothing about.
    fn stopped(&self) -> f64 {
        self.plan.as_ref().map_or(0.0, |plan| plan.stopped)
    }

    /// How many samples a pixel, of those that go on, give the error that is asked for, as far as the next milestone
    /// tells no better: errors fall as 1/√n, or a little faster. Never fewer than there are.
    pub fn end(&self, asked: f64) -> Option<u32> {
        if self.plan.as_ref().is_some_and(|plan| plan.ends().iter().all(|&end| end <= self.samples)) {
            return Some(self.samples);
        }
        let (excess, stopped) = ((self.error? / asked).powi(2), self.stopped());
        if excess <= 1.0 {
            return Some(self.samples);
        }
        let samples = f64::from(self.samples) * excess * (1.0 - stopped) / (1.0 - stopped * excess);
        let told = samples > 0.0 && samples < f64::from(self.samples) * 2.0;
        told.then(|| self.samples.max(samples.ceil() as u32))
    }

    /// The error that is to be expected when pixels that go on have so many samples, at least the milestone's own.
    pub fn error_at(&self, samples: u32) -> Option<f64> {
        let left = f64::from(self.samples) / f64::from(samples.max(self.samples));
        let stopped = self.stopped();
        Some(self.error? * (stopped + (1.0 - stopped) * left).sqrt())
    }
}

/// Estimates of the squared relative error of each pixel of a picture, from the picture of the first half of its
/// samples; none of a picture without brightness, which tells nothing to hold an error against.
fn errors(half: &Picture, whole: &Picture) -> Option<Vec<f64>> {
    let brightness = brightness(&whole.rgb);
    if brightness == 0.0 {
        return None;
    }
    // Of the difference of the halves, a half: that of one of them and the mean of both. Errors are relative to
    // what the eye sees around a pixel, because what noise makes of one pixel would weigh it by its own luck.
    let around = blurred(whole);
    let errors = half.rgb.iter().zip(&whole.rgb).zip(&around);
    Some(errors.map(|((half, whole), around)| relative_error(*half, *whole, *around, brightness)).collect())
}

/// Means over 3×3 pixels; beyond the border lies what is on it.
fn blurred(picture: &Picture) -> Vec<[f32; 3]> {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let near = |i: usize, len: usize| [i.saturating_sub(1), i, (i + 1).min(len - 1)];
    let mean = |x: usize, y: usize| {
        let mut sum = [0.0; 3];
        for y in near(y, height) {
            for x in near(x, width) {
                sum.iter_mut().zip(picture.rgb[y * width + x]).for_each(|(sum, c)| *sum += c / 9.0);
            }
        }
        sum
    };
    (0..width * height).map(|i| mean(i % width, i / width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Stream;
    use rand::RngExt;

    const SIDE: u32 = 64;

    /// The mean of samples first..end of every pixel, around `level(pixel)` with a spread of `spread`.
    fn picture(seed: u32, samples: std::ops::Range<u32>, level: impl Fn(u32) -> f32, spread: f32) -> Picture {
        let pixel = |pixel: u32| {
            let mut sum = [0.0; 3];
            for sample in samples.clone() {
                let stream = &mut Stream::new(seed, pixel, sample);
                sum.iter_mut().for_each(|c| *c += level(pixel) + spread * (stream.random::<f32>() - 0.5));
            }
            sum.map(|c| c / samples.len() as f32)
        };
        Picture { width: SIDE, height: SIDE, rgb: (0..SIDE * SIDE).map(pixel).collect() }
    }

    fn level(pixel: u32) -> f32 {
        0.2 + (pixel % SIDE) as f32 / SIDE as f32
    }

    /// The true figure, against what is known.
    fn truth(picture: &Picture) -> f64 {
        let exact: Vec<_> = (0..SIDE * SIDE).map(|pixel| [level(pixel); 3]).collect();
        let brightness = brightness(&exact);
        let errors = picture
            .rgb
            .iter()
            .zip(&exact)
            .map(|(rgb, exact)| relative_error(*rgb, *exact, *exact, brightness));
        root_mean_without_worst(errors.collect())
    }

    // The estimate of 3·4096 squared differences has a standard error of 1% or so, as has the truth: 5% are four.
    #[test]
    fn the_estimate_is_the_error_of_independent_samples() {
        for (seed, spread, samples) in [(1, 1.0, 16), (2, 0.3, 16), (3, 1.0, 64)] {
            let first = Milestone::new(samples / 2, picture(seed, 0..samples / 2, level, spread), None);
            let whole = Milestone::new(samples, picture(seed, 0..samples, level, spread), Some(&first));
            let (error, truth) = (whole.error.unwrap(), truth(&whole.picture));
            assert!((error / truth - 1.0).abs() < 0.05, "{error} is not {truth}");
            assert_eq!(first.error, None);
            // Negative control: of a milestone that is not the half nothing is concluded.
            assert_eq!(Milestone::new(samples * 2, (*whole.picture).clone(), Some(&first)).error, None);
            // One of twice the spread is told apart.
            let rough = picture(seed, 0..samples, level, 2.0 * spread);
            let half = Milestone::new(samples / 2, picture(seed, 0..samples / 2, level, 2.0 * spread), None);
            assert!(Milestone::new(samples, rough, Some(&half)).error.unwrap() > 1.9 * error);
        }
    }

    #[test]
    fn the_unit_of_radiance_does_not_matter() {
        // Powers of two, which change no other bit. The last is near the end of what a film holds.
        let error = |scale: f32, floor: f32| {
            let level = |pixel| scale * (floor + level(pixel));
            let first = Milestone::new(8, picture(1, 0..8, level, scale), None);
            Milestone::new(16, picture(1, 0..16, level, scale), Some(&first)).error.unwrap()
        };
        for scale in [-30, -20, 10, 29].map(|power| libm::exp2f(power as f32)) {
            assert_eq!(error(scale, 0.0), error(1.0, 0.0), "{scale}");
        }
        // Negative control: a brighter picture with the same noise is another one.
        assert!(error(1.0, 1.0) < 0.6 * error(1.0, 0.0), "{} {}", error(1.0, 1.0), error(1.0, 0.0));
    }

    #[test]
    fn of_a_black_picture_no_error_is_known() {
        let lit = |count: usize| {
            let mut rgb = vec![[0.0; 3]; 1000];
            rgb[..count].fill([1.0; 3]);
            Picture { width: 100, height: 10, rgb }
        };
        // Half a per cent of the pixels do not count.
        for (count, is_known) in [(0, false), (5, false), (6, true)] {
            let first = Milestone::new(8, lit(count), None);
            let next = Milestone::new(16, lit(count), Some(&first));
            assert_eq!(
                (next.error, next.end(0.01)),
                if is_known { (Some(0.0), Some(16)) } else { (None, None) }
            );
            let adaptive = Milestone::adaptive(16, lit(count), Some(&first), 0.01, 1024);
            assert_eq!((adaptive.error, adaptive.plan.is_some()), (next.error, is_known));
        }
    }

    #[test]
    fn a_few_fireflies_say_nothing_and_many_do() {
        let with = |every: u32| {
            let mut whole = picture(1, 0..16, level, 1.0);
            whole.rgb.iter_mut().step_by(every as usize).for_each(|rgb| *rgb = [1e4; 3]);
            let half = Milestone::new(8, picture(1, 0..8, level, 1.0), None);
            Milestone::new(16, whole, Some(&half)).error.unwrap()
        };
        let clean = with(100_000);
        assert!(with(300) < 1.1 * clean && with(100) > 2.0 * clean, "{} {} {clean}", with(300), with(100));
    }

    #[test]
    fn the_end_lies_between_a_milestone_and_the_next() {
        let picture = Arc::new(Picture { width: 1, height: 1, rgb: vec![[0.0; 3]] });
        let milestone = Milestone { samples: 64, error: Some(0.02), picture, plan: None };
        assert_eq!(milestone.end(0.02), Some(64));
        assert_eq!(milestone.end(0.05), Some(64), "there are 64 already");
        assert_eq!(milestone.end(0.016), Some(100));
        assert_eq!(milestone.end(0.014), None, "the next will tell better");
        assert_eq!(milestone.error_at(100), Some(0.016));
        assert_eq!((milestone.error_at(64), milestone.error_at(1)), (Some(0.02), Some(0.02)));
        // Pixels that have stopped leave less to be won.
        let plan = |ends: Vec<u32>| Some(Arc::new(Plan { ends, stopped: 0.25 }));
        let partly = Milestone { plan: plan(vec![128]), ..milestone.clone() };
        assert_eq!((partly.end(0.02), partly.end(0.0179)), (Some(64), Some(88)));
        assert!((partly.error_at(96).unwrap() - 0.0173).abs() < 1e-4, "{:?}", partly.error_at(96));
        assert_eq!((partly.end(0.015), partly.end(0.009)), (None, None));
        assert_eq!(
            Milestone { plan: plan(vec![32]), ..milestone.clone() }.end(0.001),
            Some(64),
            "nobody goes on"
        );
        let fresh = Milestone { error: None, ..milestone.clone() };
        assert_eq!((fresh.end(1.0), fresh.error_at(100)), (None, None));
        // A picture without any noise.
        assert_eq!(Milestone { error: Some(0.0), ..milestone }.end(1e-6), Some(64));
    }

    #[test]
    fn the_blur_goes_on_beyond_the_border() {
        let rgb = (0..6).map(|i| [i as f32, 1.0, 0.0]).collect();
        let seen = blurred(&Picture { width: 3, height: 2, rgb });
        assert!((seen[0][0] - (0.0 * 4.0 + 1.0 * 2.0 + 3.0 * 2.0 + 4.0) / 9.0).abs() < 1e-5);
        assert!(seen.iter().all(|rgb| (rgb[1] - 1.0).abs() < 1e-6 && rgb[2] == 0.0));
    }
}
