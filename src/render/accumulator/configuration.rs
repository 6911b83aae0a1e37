//! What an accumulator is told before it runs.

use crate::film::{Film, Milestone, Splatter};
use crate::render::channels::{Outbox, Port};
use crate::render::schedule::Schedule;
use crate::sampling::Region;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A render, as the accumulator sees it. [`Configuration::new`] is one without an end in time, without pictures on the
/// way and without viewers; the other fields are public, to be set by name.
pub struct Configuration {
    /// The film to add to. It may have samples already, each pixel its first ones.
    pub film: Film,
    /// The part of the film's picture that its pixels are.
    pub region: Region,
    /// The index of each pixel's first sample.
    pub first: u32,
    /// The order of work, for as many workers as are there from the first.
    pub schedule: Schedule,
    /// The workers that are there from the first, in the order of their numbers.
    pub workers: Vec<Port>,
    /// What puts samples on the film where they count in all pixels around them.
    pub splatter: Option<Arc<Splatter>>,
    /// What puts contributions to any pixel into the film's light image, if it has one.
    pub light: Option<Arc<Splatter>>,
    /// The sample indices, exclusive, at which a picture of the whole region is wanted. The schedule stops at them.
    pub barriers: Vec<u32>,
    /// The error to end at, if there is one.
    pub goal: Option<Goal>,
    /// How often the film is sent to [`Outbox::film`].
    pub checkpoint: Duration,
    /// When to stop even if no whole sample is done then.
    pub overtime: Option<Instant>,
    /// The number of samples a pixel that viewers are told.
    pub target: Option<u32>,
    /// The sinks and viewers.
    pub outbox: Outbox,
}

impl Configuration {
    /// A render of these workers, from sample 0 on.
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
    /// The error.
    pub error: f64,
    /// Whether samples are spent where the error is.
    pub is_adaptive: bool,
    /// The last milestone that the film has passed.
    pub milestone: Option<Milestone>,
}
