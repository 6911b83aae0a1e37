//! The channels of the accumulator.

use super::assignment::Assignment;
use super::batch::SampleBatch;
use super::outcome::{Totals, WorkerFailure};
use crate::film::file::Piece;
use crate::film::{Picture, Snapshot};
use crate::sampling::Sample;
use crossbeam_channel::{Receiver, Sender};
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

/// The channels that the accumulator listens to.
pub struct Inbox {
    /// The batches of workers.
    pub batches: Receiver<SampleBatch>,
    /// Workers that join, leave and fail.
    pub changes: Receiver<Change>,
    /// Closing this channel asks to stop.
    pub stop: Receiver<Infallible>,
    /// Closes when a viewer is left, which ends the render. Snapshots alone would not show it: they are sent when
    /// batches come, and beside a worker that never ends none may come any more.
    pub viewer: Receiver<Infallible>,
}

/// The channels of sinks and viewers that the accumulator talks to. A closed one is no longer served.
#[derive(Default)]
pub struct Outbox {
    /// Every sample, without loss. The render stops when this sink goes away.
    pub samples: Option<Sender<Vec<Sample>>>,
    /// Pictures at the barriers that were asked for.
    pub barriers: Option<Sender<Barrier>>,
    /// The film's words, in pieces, for a file that the render can be gone on with. Pieces that make a film are
    /// taken as they are sent: each pixel counts its own samples.
    pub film: Option<Sender<Piece>>,
    /// Views of the unfinished picture, which may be dropped, except for the last. The render stops when
    /// the viewer goes away.
    pub snapshots: Option<Sender<Arc<Snapshot>>>,
    /// The same for a viewer elsewhere, without which the render goes on. It is not waited for, however slow: it has
    /// room for one snapshot more than the one that others are dropped for, the last.
    pub remote: Option<Sender<Arc<Snapshot>>>,
    /// How far it is, which may be dropped.
    pub progress: Option<Sender<Totals>>,
    /// A warning that radiance is too small for the film, once every pixel has a sample.
    pub notes: Option<Sender<String>>,
}

/// A picture of which every pixel has exactly the same number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Barrier {
    /// One past the index of each pixel's last sample.
    pub end: u32,
    /// The picture.
    pub picture: Picture,
}

/// A change among the workers. What a worker has sent before it leaves or fails counts; what it holds then is given to
/// others. Its number is not used again.
#[derive(Debug)]
pub enum Change {
    /// A worker of a new number joins. It is as fast as so many of the first ones.
    Joins {
        /// Its number, which its batches carry: the least that no worker has had. One that is known already is refused, by
        /// closing its channels.
        worker: usize,
        /// Its channels.
        port: Port,
        /// Its speed, in that of one of the first workers; above zero.
        speed: f64,
    },
    /// A worker leaves, though it may have orders.
    Leaves(usize),
    /// A worker fails. That ends the render if [`Port::may_be_lost`] does not say otherwise, or no other is there.
    Fails(WorkerFailure),
}

/// The accumulator's ends of a worker's channels.
#[derive(Clone, Debug)]
pub struct Port {
    /// Work for it. The channel closes when there is no more. It must have room for the two orders that a worker may
    /// have: the accumulator waits where it has not.
    pub orders: Sender<Assignment>,
    /// Where it is asked to stop, by one message that it leaves there. It has ended when it has dropped its end.
    pub stop: Option<Sender<()>>,
    /// How long it may take to end then. What it sends meanwhile counts.
    pub patience: Duration,
    /// Whether the render goes on without it if it fails, as long as another is there: that one gets its orders, as far
    /// as they are not carried out.
    pub may_be_lost: bool,
}

impl Port {
    /// A worker that gets orders, and nothing else.
    pub fn new(orders: Sender<Assignment>) -> Port {
        Port { orders, stop: None, patience: Duration::ZERO, may_be_lost: false }
    }
}
