//! Progress and snapshots for viewers, and a warning about radiance that is too small.

use crate::film::{Film, Snapshot, Statistics};
use crate::render::channels::Outbox;
use crate::render::faint::Faint;
use crate::render::outcome::Totals;
use crossbeam_channel::{Sender, TrySendError};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The shortest interval between snapshots.
const FRAME: Duration = Duration::from_millis(33);

/// Making snapshots takes at most this fraction (one over) of the time.
const SNAPSHOT_SHARE: u32 = 20;

/// The maximum age of the statistics in a snapshot: they cost more than the picture.
const STATISTICS: Duration = Duration::from_secs(1);

/// Sends the state of the render to viewers.
pub(super) struct Publisher {
    snapshots: Option<Sender<Arc<Snapshot>>>,
    remote: Option<Sender<Arc<Snapshot>>>,
    progress: Option<Sender<Totals>>,
    /// The channel for a warning about radiance that is too small for the film, until that is decided.
    notes: Option<Sender<String>>,
    pub(super) has_warned_of_faint: bool,
    /// The worker that owns each pixel.
    pub(super) owners: Arc<Vec<u32>>,
    /// Pixels of the region.
    pixels: u32,
    target: Option<u32>,
    last_frame: Option<Instant>,
    frame_cost: Duration,
    /// The statistics of the last snapshots, and the time when they were made.
    statistics: Option<(Instant, Arc<Statistics>)>,
    is_disconnected: bool,
}

impl Publisher {
    /// Publishes to the viewers of an outbox, whose channels it takes, with this target and owners, for a region of
    /// this number of pixels.
    pub(super) fn new(outbox: &mut Outbox, target: Option<u32>, owners: Vec<u32>, pixels: u32) -> Publisher {
        Publisher {
            snapshots: outbox.snapshots.take(),
            remote: outbox.remote.take(),
            progress: outbox.progress.take(),
            notes: outbox.notes.take(),
            has_warned_of_faint: false,
            owners: Arc::new(owners),
            pixels,
            target,
            last_frame: None,
            frame_cost: Duration::ZERO,
            statistics: None,
            is_disconnected: false,
        }
    }

    /// Whether the viewer of snapshots has closed its channel, which ends the render.
    pub(super) fn is_disconnected(&self) -> bool {
        self.is_disconnected
    }

    /// Sends progress and a snapshot, unless the previous one has not been received.
    pub(super) fn publish(&mut self, film: &Film, totals: &Totals) {
        if let Some(progress) = &self.progress {
            let _ = progress.try_send(*totals);
        }
        let watched = self.snapshots.as_ref().is_some_and(|viewer| !viewer.is_full());
        let is_free = |viewer: &&Sender<_>| viewer.is_empty();
        let remote = self.remote.as_ref().filter(is_free);
        let pause = FRAME.max(self.frame_cost * SNAPSHOT_SHARE);
        if !(watched || remote.is_some()) || self.last_frame.is_some_and(|last| last.elapsed() < pause) {
            return;
        }
        let start = Instant::now();
        let snapshot = Arc::new(self.snapshot(film, totals, false));
        // A viewer that has not received the previous one gets a later one.
        let gone = |viewer: &Sender<_>| {
            matches!(viewer.try_send(Arc::clone(&snapshot)), Err(TrySendError::Disconnected(_)))
        };
        if self.snapshots.as_ref().is_some_and(gone) {
            self.snapshots = None;
            self.is_disconnected = true;
        }
        if self.remote.as_ref().filter(is_free).is_some_and(gone) {
            self.remote = None;
        }
        self.frame_cost = start.elapsed();
        self.last_frame = Some(Instant::now());
    }

    /// Sends the final state to all viewers, and waits until they receive it.
    pub(super) fn publish_end(&mut self, film: &Film, totals: &Totals) {
        if let Some(progress) = self.progress.take() {
            // A viewer that has closed its channel is skipped.
            let _ = progress.send(*totals);
        }
        let viewers = [self.snapshots.take(), self.remote.take()];
        if viewers.iter().any(Option::is_some) {
            let last = Arc::new(self.snapshot(film, totals, true));
            for viewer in viewers.iter().flatten() {
                let _ = viewer.send(Arc::clone(&last));
            }
        }
    }

    /// Warns about radiance that is too small for the film, once every pixel has a sample.
    pub(super) fn warn_of_faint(&mut self, faint: &Faint, spp: u32) {
        if spp == 0 {
            return;
        }
        if let Some(notes) = self.notes.take()
            && faint.is_majority()
        {
            // A warning that cannot be sent now is repeated at the end.
            self.has_warned_of_faint = notes.try_send(format!("warning: {faint}")).is_ok();
        }
    }

    /// The current state of the film, for viewers. Statistics are reused for a while (see [`STATISTICS`]), but not if
    /// the render is `finished`.
    fn snapshot(&mut self, film: &Film, totals: &Totals, finished: bool) -> Snapshot {
        let is_fresh = |(at, _): &(Instant, Arc<Statistics>)| !finished && at.elapsed() < STATISTICS;
        let known = self.statistics.take().filter(is_fresh);
        let (at, statistics) = known.unwrap_or_else(|| (Instant::now(), Arc::new(Statistics::of(film))));
        self.statistics = Some((at, Arc::clone(&statistics)));
        Snapshot {
            picture: film.picture(),
            statistics,
            owners: Arc::clone(&self.owners),
            spp_done: totals.samples as f64 / f64::from(self.pixels),
            spp_before: totals.before as f64 / f64::from(self.pixels),
            spp_target: self.target,
            noise: totals.noise,
            samples: totals.made(),
            seconds: totals.elapsed.as_secs_f64(),
            finished,
        }
    }
}
