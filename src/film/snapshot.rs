//! What a viewing sink gets to see: the picture so far and how far it has come.

use std::sync::Arc;

use super::{Film, Picture};

/// What is known of each pixel beside its radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// How many samples it is the mean of.
    pub counts: Vec<u32>,
    /// The variance of the mean, of its channels together, by the spread of its samples. Empty where the
    /// film does not tell it.
    pub variances: Vec<f32>,
}

impl Statistics {
    /// Those of a film.
    pub fn of(film: &Film) -> Statistics {
        let layout = film.layout();
        let counts = layout.places().map(|pixel| film.count(pixel).min(u32::MAX.into()) as u32).collect();
        let variances = match film.has_variance() {
            false => Vec::new(),
            true => layout.places().map(|pixel| film.variance(pixel) as f32).collect(),
        };
        Statistics { counts, variances }
    }
}

/// The film at one moment, made by the accumulator for the sinks that only look.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The picture so far.
    pub picture: Picture,
    /// How good each pixel is; of the last picture to the latest sample, of others up to a second old.
    pub statistics: Arc<Statistics>,
    /// Which worker makes each pixel, counted from zero; row-major like the picture.
    pub owners: Arc<Vec<u32>>,
    /// Samples per pixel so far, the mean over the picture.
    pub spp_done: f64,
    /// Samples per pixel of those that an earlier run had made.
    pub spp_before: f64,
    /// Samples per pixel the run is to reach, where it has such an end.
    pub spp_target: Option<u32>,
    /// What the error is by estimate, and what is asked for, where the render is to end at an error.
    pub noise: Option<[f64; 2]>,
    /// Samples added since this run began, all pixels together.
    pub samples: u64,
    /// Seconds since the first ray.
    pub seconds: f64,
    /// No further snapshot will come: this is the final picture.
    pub finished: bool,
}
