//! What viewers see of an unfinished picture.

use super::Picture;
use std::sync::Arc;

/// A view of the film at some moment.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The picture so far.
    pub picture: Picture,
    /// Which worker made each pixel.
    pub owners: Arc<Vec<u32>>,
    /// Samples a pixel, on average.
    pub spp_done: f64,
    /// Samples a pixel that were asked for, if a number was.
    pub spp_target: Option<u32>,
    /// Samples in all.
    pub samples: u64,
    /// Time since the first ray.
    pub seconds: f64,
    /// Whether this is the last snapshot.
    pub finished: bool,
}
