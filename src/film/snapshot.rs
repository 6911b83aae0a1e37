//! A snapshot for viewers: the picture so far and the progress of the render.

use std::sync::Arc;

use super::{Film, Picture};

/// Statistics of each pixel beside its radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// The number of samples per pixel.
    pub counts: Vec<u32>,
    /// The estimated variance of the mean radiance, summed over its channels. Empty if the film cannot estimate it.
    pub variances: Vec<f32>,
}

impl Statistics {
    /// The statistics of a film.
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

/// The film at one moment, made by the accumulator for viewers.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The picture so far.
    pub picture: Picture,
    /// The statistics of each pixel; exact with the last snapshot, up to a second old with others.
    pub statistics: Arc<Statistics>,
    /// The worker that renders each pixel, counted from zero; row-major like the picture.
    pub owners: Arc<Vec<u32>>,
    /// Samples per pixel so far: the mean over the picture.
    pub spp_done: f64,
    /// Samples per pixel from an earlier run.
    pub spp_before: f64,
    /// Samples per pixel at which the run ends, if they are limited.
    pub spp_target: Option<u32>,
    /// The estimated and the requested error, if the render is to end at an error.
    pub noise: Option<[f64; 2]>,
    /// Samples added since this run began, over all pixels.
    pub samples: u64,
    /// Seconds since the first ray.
    pub seconds: f64,
    /// Whether this is the final picture, after which no snapshot follows.
    pub finished: bool,
}
