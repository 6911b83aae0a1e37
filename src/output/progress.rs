//! The progress of a run, in numbers and in words.

use std::fmt;

use super::human;
use crate::film::Snapshot;

/// The progress of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Samples per pixel so far: the mean over the picture.
    pub spp_done: f64,
    /// Samples per pixel from an earlier run.
    pub spp_before: f64,
    /// Samples per pixel at which the run ends, if they are limited.
    pub spp_target: Option<u32>,
    /// Seconds since the first ray.
    pub seconds: f64,
    /// Samples since then, over all pixels.
    pub samples: u64,
    /// The time limit in seconds, if there is one.
    pub time_limit: Option<f64>,
    /// The estimated and the requested error, if the run ends at an error.
    pub noise: Option<[f64; 2]>,
}

impl Progress {
    /// The progress in a snapshot, for a run with this time limit in seconds.
    pub fn of(snapshot: &Snapshot, time_limit: Option<f64>) -> Self {
        Self {
            spp_done: snapshot.spp_done,
            spp_before: snapshot.spp_before,
            spp_target: snapshot.spp_target,
            seconds: snapshot.seconds,
            samples: snapshot.samples,
            time_limit,
            noise: snapshot.noise,
        }
    }

    /// Samples per second since the first ray; `None` before the first samples.
    pub fn rate(&self) -> Option<f64> {
        (self.samples > 0 && self.seconds > 0.0).then(|| self.samples as f64 / self.seconds)
    }

    /// The completed fraction, in [0, 1]; `None` for a run without an end.
    pub fn fraction(&self) -> Option<f64> {
        let by_samples =
            self.spp_target.filter(|&target| target > 0).map(|target| self.spp_done / f64::from(target));
        let by_time = self.time_limit.filter(|&limit| limit > 0.0).map(|limit| self.seconds / limit);
        // Errors fall as 1/√n.
        let by_noise = self.noise.map(|[now, asked]| (asked / now).powi(2));
        // The first criterion that is met ends the run.
        by_samples
            .into_iter()
            .chain(by_time)
            .chain(by_noise)
            .reduce(f64::max)
            .map(|part| part.clamp(0.0, 1.0))
    }

    /// The estimated remaining time in seconds; `None` for a run without an end, or at its start.
    pub fn seconds_left(&self) -> Option<f64> {
        let at_end = self.noise.map(|[now, asked]| self.spp_done * (now / asked).powi(2));
        let target = self.spp_target.map(f64::from).into_iter().chain(at_end).reduce(f64::min);
        let by_samples = target
            .filter(|_| self.spp_done > self.spp_before)
            .map(|target| target - self.spp_done)
            .map(|to_do| self.seconds * to_do / (self.spp_done - self.spp_before));
        let by_time = self.time_limit.map(|limit| limit - self.seconds);
        by_samples.into_iter().chain(by_time).reduce(f64::min).map(|left| left.max(0.0))
    }

    /// "500 spp in 1 min 12 s, 7.9 Msamples/s": a summary of the run.
    pub fn summary(&self) -> String {
        let spp = human::samples_per_pixel(self.spp_done);
        let mut text = format!("{spp} spp in {}", human::duration(self.seconds));
        if let Some(rate) = self.rate() {
            text += &format!(", {}", human::samples_per_second(rate));
        }
        text
    }
}

/// "128/500 spp, 7.9 Msamples/s, 41 s left".
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&human::samples_per_pixel(self.spp_done))?;
        if let Some(target) = self.spp_target {
            write!(f, "/{target}")?;
        }
        f.write_str(" spp")?;
        if let Some([now, asked]) = self.noise {
            write!(f, ", noise {now:.4} of {asked}")?;
        }
        if let Some(rate) = self.rate() {
            write!(f, ", {}", human::samples_per_second(rate))?;
        }
        if let Some(left) = self.seconds_left() {
            // Rounded up: "0 s left" would be wrong while the run continues.
            write!(f, ", {} left", human::duration(left.ceil()))?;
        }
        Ok(())
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// 640×480 pixels with 500 samples each as the target.
    pub(crate) fn at(spp_done: f64, seconds: f64) -> Progress {
        let samples = (spp_done * 307_200.0) as u64;
        Progress {
            spp_done,
            spp_before: 0.0,
            spp_target: Some(500),
            seconds,
            samples,
            time_limit: None,
            noise: None,
        }
    }

    #[test]
    fn says_samples_rate_and_time_left() {
        assert_eq!(at(128.0, 5.0).to_string(), "128/500 spp, 7.9 Msamples/s, 15 s left");
        assert_eq!(at(0.0, 0.0).to_string(), "0/500 spp");
        assert_eq!(Progress { spp_target: None, ..at(128.0, 5.0) }.to_string(), "128 spp, 7.9 Msamples/s");
        assert_eq!(at(500.0, 72.0).to_string(), "500/500 spp, 2.1 Msamples/s, 0 s left");
        assert_eq!(at(500.0, 72.0).summary(), "500 spp in 1 min 12 s, 2.1 Msamples/s");
        assert_eq!(at(0.0, 0.0).summary(), "0 spp in 0 s");
    }

    #[test]
    fn the_earlier_end_counts() {
        let both = Progress { time_limit: Some(10.0), ..at(100.0, 5.0) };
        assert_eq!(both.fraction(), Some(0.5));
        assert_eq!(both.seconds_left(), Some(5.0));
        let samples = Progress { time_limit: Some(1000.0), ..both };
        assert_eq!(samples.fraction(), Some(0.2));
        assert_eq!(samples.seconds_left(), Some(20.0));
        // 100 samples with an error that must be halved need 300 more.
        let noisy = Progress { noise: Some([0.02, 0.01]), ..samples };
        assert_eq!((noisy.fraction(), noisy.seconds_left()), (Some(0.25), Some(15.0)));
        assert!(noisy.to_string().starts_with("100/500 spp, noise 0.0200 of 0.01, "), "{noisy}");
        let gone_on_with = Progress { spp_before: 50.0, ..samples };
        assert_eq!(gone_on_with.seconds_left(), Some(40.0));
        let neither = Progress { spp_target: None, time_limit: None, ..both };
        assert_eq!((neither.fraction(), neither.seconds_left()), (None, None));
        let late = Progress { time_limit: Some(4.0), ..both };
        assert_eq!((late.fraction(), late.seconds_left()), (Some(1.0), Some(0.0)));
    }
}
