//! Estimates the error of a picture from its own samples.
//!
//! The samples of a pixel are divided into two halves. The difference of the pictures of the two halves estimates the
//! error of their mean: for independent samples, half the difference has the same variance as the mean. The variance of
//! single samples would say nothing about low-discrepancy samples (`sobol`). The halves of 2ᵏ such samples are as well
//! distributed as the whole, and overestimate the error by a few per cent at most, because the two halves complement
//! each other.
//!
//! Errors are relative to the local radiance, and in nearly black regions to the [`brightness`] of the whole picture:
//! the units of length and radiance do not affect when a render ends. A black picture has no error estimate.

use super::Picture;
use super::adaptive::AdaptivePlan;
use super::metrics::relative_error;
use std::sync::Arc;

pub use super::metrics::{WORST, brightness, root_mean_without_worst};

/// The samples per pixel of the first milestone.
pub const FIRST_MILESTONE: u32 = 8;

/// The picture at a power of two of samples per pixel, and the estimate of its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Milestone {
    /// Samples per pixel.
    pub samples: u32,
    /// The estimated error, if there was a previous milestone.
    pub error: Option<f64>,
    /// The picture; for stopped pixels, the radiance at half their samples.
    pub picture: Arc<Picture>,
    /// The number of samples of each pixel, if sampling is adaptive.
    pub plan: Option<Arc<AdaptivePlan>>,
}

impl Milestone {
    /// The milestone after `last` in a render: at twice its samples.
    pub fn new(samples: u32, picture: Picture, last: Option<&Milestone>) -> Milestone {
        let half = last.filter(|last| last.samples == samples / 2);
        let errors = half.and_then(|half| errors(&half.picture, &picture));
        let error = errors.map(root_mean_without_worst);
        Milestone { samples, error, picture: Arc::new(picture), plan: None }
    }

    /// A milestone of an adaptive render, which continues until the error is `asked` or pixels have `most` samples:
    /// every pixel of `picture` has the samples of the plan of `last`.
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
        let plan = AdaptivePlan::decide(width, errors, error, last, samples, [asked, f64::from(most)]);
        // Pixels that stop keep the picture of half their samples for later comparisons.
        for ((rgb, half), &end) in picture.rgb.iter_mut().zip(&half.picture.rgb).zip(plan.ends()) {
            if end <= samples {
                *rgb = *half;
            }
        }
        Milestone { samples, error: Some(error), picture: Arc::new(picture), plan: Some(Arc::new(plan)) }
    }

    /// The share of the squared error in stopped pixels, 0 to 1.
    fn stopped(&self) -> f64 {
        self.plan.as_ref().map_or(0.0, |plan| plan.stopped)
    }

    /// The samples per pixel, of pixels that continue, at which the error reaches the requested one, if that is before
    /// the next milestone: errors fall as 1/√n, or slightly faster. At least the number of samples so far.
    pub fn end(&self, asked: f64) -> Option<u32> {
        if self.plan.as_ref().is_some_and(|plan| plan.ends().iter().all(|&end| end <= self.samples)) {
            return Some(self.samples);
        }
        let (excess, stopped) = ((self.error? / asked).powi(2), self.stopped());
        if excess <= 1.0 {
            return Some(self.samples);
        }
        let samples = f64::from(self.samples) * excess * (1.0 - stopped) / (1.0 - stopped * excess);
        let is_known = samples > 0.0 && samples < f64::from(self.samples) * 2.0;
        is_known.then(|| self.samples.max(samples.ceil() as u32))
    }

    /// The expected error if the pixels that continue have this many samples, at least the milestone's own.
    pub fn error_at(&self, samples: u32) -> Option<f64> {
        let left = f64::from(self.samples) / f64::from(samples.max(self.samples));
        let stopped = self.stopped();
        Some(self.error? * (stopped + (1.0 - stopped) * left).sqrt())
    }
}

/// Estimates the squared relative error of each pixel of a picture, from the picture of the first half of its samples;
/// `None` for a black picture, to which no error can be relative.
fn errors(half: &Picture, whole: &Picture) -> Option<Vec<f64>> {
    let brightness = brightness(&whole.rgb);
    if brightness == 0.0 {
        return None;
    }
    // The difference of one half and the mean of both is half the difference of the halves. Errors are relative to the
    // mean around a pixel: relative to the pixel itself, noise would determine its own weight.
    let around = blurred(whole);
    let errors = half.rgb.iter().zip(&whole.rgb).zip(&around);
    Some(errors.map(|((half, whole), around)| relative_error(*half, *whole, *around, brightness)).collect())
}

/// Means over 3×3 pixels; the border is extended by its own pixels.
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

    /// The mean of samples first..end of every pixel, with expectation `level(pixel)` and deviation `spread`.
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

    /// The true error against the known expectation.
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

    // The estimate from 3·4096 squared differences has a standard error of about 1%, as has the truth: 5% are four of
    // these.
    #[test]
    fn the_estimate_is_the_error_of_independent_samples() {
        for (seed, spread, samples) in [(1, 1.0, 16), (2, 0.3, 16), (3, 1.0, 64)] {
            let first = Milestone::new(samples / 2, picture(seed, 0..samples / 2, level, spread), None);
            let whole = Milestone::new(samples, picture(seed, 0..samples, level, spread), Some(&first));
            let (error, truth) = (whole.error.unwrap(), truth(&whole.picture));
            assert!((error / truth - 1.0).abs() < 0.05, "{error} is not {truth}");
            assert_eq!(first.error, None);
            // Negative control: no estimate follows from a milestone that is not the half.
            assert_eq!(Milestone::new(samples * 2, (*whole.picture).clone(), Some(&first)).error, None);
            // A doubled deviation is detected.
            let rough = picture(seed, 0..samples, level, 2.0 * spread);
            let half = Milestone::new(samples / 2, picture(seed, 0..samples / 2, level, 2.0 * spread), None);
            assert!(Milestone::new(samples, rough, Some(&half)).error.unwrap() > 1.9 * error);
        }
    }

    #[test]
    fn the_unit_of_radiance_does_not_matter() {
        // Powers of two, which change no other bit. The last is near the maximum of a film.
        let error = |scale: f32, floor: f32| {
            let level = |pixel| scale * (floor + level(pixel));
            let first = Milestone::new(8, picture(1, 0..8, level, scale), None);
            Milestone::new(16, picture(1, 0..16, level, scale), Some(&first)).error.unwrap()
        };
        for scale in [-30, -20, 10, 29].map(|power| libm::exp2f(power as f32)) {
            assert_eq!(error(scale, 0.0), error(1.0, 0.0), "{scale}");
        }
        // Negative control: a brighter picture with the same noise has a smaller relative error.
        assert!(error(1.0, 1.0) < 0.6 * error(1.0, 0.0), "{} {}", error(1.0, 1.0), error(1.0, 0.0));
    }

    #[test]
    fn a_black_picture_has_no_error_estimate() {
        let lit = |count: usize| {
            let mut rgb = vec![[0.0; 3]; 1000];
            rgb[..count].fill([1.0; 3]);
            Picture { width: 100, height: 10, rgb }
        };
        // Half a per cent of the pixels does not count.
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
    fn a_few_fireflies_do_not_count_and_many_do() {
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
        assert_eq!(milestone.end(0.05), Some(64), "64 are already there");
        assert_eq!(milestone.end(0.016), Some(100));
        assert_eq!(milestone.end(0.014), None, "the next milestone gives a better estimate");
        assert_eq!(milestone.error_at(100), Some(0.016));
        assert_eq!((milestone.error_at(64), milestone.error_at(1)), (Some(0.02), Some(0.02)));
        // Pixels that have stopped leave less error to remove.
        let plan = |ends: Vec<u32>| Some(Arc::new(AdaptivePlan { ends, stopped: 0.25 }));
        let partly = Milestone { plan: plan(vec![128]), ..milestone.clone() };
        assert_eq!((partly.end(0.02), partly.end(0.0179)), (Some(64), Some(88)));
        assert!((partly.error_at(96).unwrap() - 0.0173).abs() < 1e-4, "{:?}", partly.error_at(96));
        assert_eq!((partly.end(0.015), partly.end(0.009)), (None, None));
        assert_eq!(
            Milestone { plan: plan(vec![32]), ..milestone.clone() }.end(0.001),
            Some(64),
            "no pixel continues"
        );
        let fresh = Milestone { error: None, ..milestone.clone() };
        assert_eq!((fresh.end(1.0), fresh.error_at(100)), (None, None));
        // A noise-free picture.
        assert_eq!(Milestone { error: Some(0.0), ..milestone }.end(1e-6), Some(64));
    }

    #[test]
    fn the_blur_extends_the_border() {
        let rgb = (0..6).map(|i| [i as f32, 1.0, 0.0]).collect();
        let seen = blurred(&Picture { width: 3, height: 2, rgb });
        assert!((seen[0][0] - (0.0 * 4.0 + 1.0 * 2.0 + 3.0 * 2.0 + 4.0) / 9.0).abs() < 1e-5);
        assert!(seen.iter().all(|rgb| (rgb[1] - 1.0).abs() < 1e-6 && rgb[2] == 0.0));
    }
}
