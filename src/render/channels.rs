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

/// The channels that the accumulator receives from.
pub struct Inbox {
    /// The batches of workers.
    pub batches: Receiver<SampleBatch>,
    /// Workers that join, leave and fail.
    pub changes: Receiver<Change>,
    /// Closing this channel requests the end.
    pub stop: Receiver<Infallible>,
    /// Closes when the user leaves the viewer, which ends the render. The channel of snapshots is not enough: snapshots
    /// are sent when batches arrive, and if a worker hangs none may arrive.
    pub viewer: Receiver<Infallible>,
}

/// The channels that the accumulator sends to: sinks and viewers. Closed ones are ignored.
#[derive(Default)]
pub struct Outbox {
    /// Every sample, without loss. The render stops when this sink closes its channel.
    pub samples: Option<Sender<Vec<Sample>>>,
    /// Pictures at the requested barriers.
    pub barriers: Option<Sender<Barrier>>,
    /// The film's words, in pieces, for a film file. Pieces of one film may be from different times: each pixel has its
    /// own count of samples.
    pub film: Option<Sender<Piece>>,
    /// Snapshots of the unfinished picture, which may be dropped, except for the last. The render stops when
    /// the viewer closes its channel.
    pub snapshots: Option<Sender<Arc<Snapshot>>>,
    /// Snapshots for a remote viewer, without which the render continues. The accumulator does not wait for it: its
    /// channel holds two snapshots, so that the last one always fits.
    pub remote: Option<Sender<Arc<Snapshot>>>,
    /// The progress of the render, which may be dropped.
    pub progress: Option<Sender<Totals>>,
    /// A warning that radiance is too small for the film, once every pixel has a sample.
    pub notes: Option<Sender<String>>,
}

/// A picture in which every pixel has exactly the same number of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Barrier {
    /// One past the index of each pixel's last sample.
    pub end: u32,
    /// The picture.
    pub picture: Picture,
}

/// A change among the workers. The batches of a worker that leaves or fails count, and its unfinished orders are
/// assigned to others. Worker numbers are not reused.
#[derive(Debug)]
pub enum Change {
    /// A worker with a new number joins.
    Joins {
        /// Its number, which its batches carry: the lowest that no worker has had. A worker with a used number is
        /// rejected by closing its channels.
        worker: usize,
        /// Its channels.
        port: Port,
        /// Its speed relative to the initial workers; above zero.
        speed: f64,
    },
    /// A worker leaves, possibly with unfinished orders.
    Leaves(usize),
    /// A worker fails. That ends the render unless [`Port::may_be_lost`] is set and another worker is present.
    Fails(WorkerFailure),
}

/// The accumulator's ends of a worker's channels.
#[derive(Clone, Debug)]
pub struct Port {
    /// Its orders. The channel closes when there are no more. It must have capacity for two orders: otherwise the
    /// accumulator waits.
    pub orders: Sender<Assignment>,
    /// The request to stop: a single message that the worker leaves in the channel. It has ended when it drops its end.
    pub stop: Option<Sender<()>>,
    /// The time within which it must end then. Its batches until then count.
    pub time_limit: Duration,
    /// Whether the render continues without it if it fails, as long as another worker is present: that one gets its
    /// unfinished orders.
    pub may_be_lost: bool,
}

impl Port {
    /// A port for orders only.
    pub fn new(orders: Sender<Assignment>) -> Port {
        Port { orders, stop: None, time_limit: Duration::ZERO, may_be_lost: false }
    }
}
