//! The configuration of an accumulator.

use crate::film::{Film, Milestone, Splatter};
use crate::render::channels::{Outbox, Port};
use crate::render::schedule::Schedule;
use crate::sampling::Region;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A render as seen by the accumulator. [`Configuration::new`] makes one without a time limit, without intermediate
/// pictures and without viewers; the other fields are public, to be set by name.
pub struct Configuration {
    /// The film to add to. It may have samples already; each pixel then has its first ones.
    pub film: Film,
    /// The part of the film's picture that its pixels are.
    pub region: Region,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// The order of work, for the workers that are present at the start.
    pub schedule: Schedule,
    /// The workers that are present at the start, in the order of their numbers.
    pub workers: Vec<Port>,
    /// Adds weighted samples to the pixels around them, if the film has them.
    pub splatter: Option<Arc<Splatter>>,
    /// Adds contributions to the film's light image, if it has one.
    pub light: Option<Arc<Splatter>>,
    /// The sample indices, exclusive, at which a picture of the whole region is wanted. The schedule stops at them.
    pub barriers: Vec<u32>,
    /// The requested error, if there is one.
    pub goal: Option<Goal>,
    /// The interval at which the film is sent to [`Outbox::film`].
    pub checkpoint: Duration,
    /// The time at which to stop even without a whole sample.
    pub overtime: Option<Instant>,
    /// The samples per pixel that viewers are told as the target.
    pub target: Option<u32>,
    /// The sinks and viewers.
    pub outbox: Outbox,
}

impl Configuration {
    /// A render by these workers, from sample 0 on.
    pub fn new(film: Film, region: Region, schedule: Schedule, workers: Vec<Port>) -> Configuration {
        Configuration {
            film,
            region,
            first: 0,
            schedule,
            workers,
            splatter: None,
            light: None,
            barriers: Vec::new(),
            goal: None,
            checkpoint: Duration::MAX,
            overtime: None,
            target: None,
            outbox: Outbox::default(),
        }
    }
}

/// An estimated error at which a render ends.
#[derive(Clone, Debug)]
pub struct Goal {
    /// The estimated error at which to end, above 0.
    pub error: f64,
    /// Whether the numbers of samples of pixels adapt to their errors.
    pub is_adaptive: bool,
    /// The last milestone that the film has passed.
    pub milestone: Option<Milestone>,
}
