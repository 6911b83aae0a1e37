//! Checkpoints of the film, sent in pieces, and progress and snapshots for viewers.

use super::{Accumulator, FRAME, PIECE, SNAPSHOT_SHARE, STATISTICS};
use crate::film::file::Piece;
use crate::film::{Snapshot, Statistics};
use crossbeam_channel::{Sender, TrySendError};
use std::sync::Arc;
use std::time::Instant;

impl Accumulator {
    /// Sends as much of a film as is taken without waiting, if one is under way or due.
    pub(super) fn send_film(&mut self) {
        let Some(film) = &self.outbox.film else { return };
        if self.sending.is_none() && self.last_checkpoint.elapsed() < self.checkpoint {
            return;
        }
        let mut room = !film.is_full();
        while room {
            let more = self.send_piece();
            room = more && self.outbox.film.as_ref().is_some_and(|film| !film.is_full());
        }
    }

    /// Sends pieces of a film that is under way until nothing of it that is sent yet is `clear` of what is to be added:
    /// samples that count in several pixels are in all pixels of a film or in none.
    pub(super) fn send_film_past(&mut self, clear: impl Fn(u32) -> bool) {
        while self.sending.is_some_and(|next| next > 0 && !clear(next)) && self.send_piece() {}
    }

    /// Sends the next piece of a film, waiting until it is taken; whether more of the film is left.
    pub(super) fn send_piece(&mut self) -> bool {
        let Some(film) = &self.outbox.film else { return false };
        let (piece, next) = match self.sending {
            None => (Piece::Start(self.milestone.clone()), 0),
            Some(place) => {
                let end = self.region.len().min(place + PIECE);
                (Piece::Pixels(self.film.bytes(place as usize..end as usize)), end)
            }
        };
        // Whoever keeps the film has gone only if all is over.
        if film.send(piece).is_err() {
            self.outbox.film = None;
            return false;
        }
        self.sending = (next < self.region.len()).then_some(next);
        if self.sending.is_none() {
            self.last_checkpoint = Instant::now();
        }
        self.sending.is_some()
    }

    /// Sends progress and a snapshot, unless the last one is still unread.
    pub(super) fn report(&mut self) {
        self.totals.elapsed = self.started.elapsed();
        if let Some(progress) = &self.outbox.progress {
            let _ = progress.try_send(self.totals);
        }
        let watched = self.outbox.snapshots.as_ref().is_some_and(|viewer| !viewer.is_full());
        let is_free = |viewer: &&Sender<_>| viewer.is_empty();
        let remote = self.outbox.remote.as_ref().filter(is_free);
        let pause = FRAME.max(self.frame_cost * SNAPSHOT_SHARE);
        if !(watched || remote.is_some()) || self.last_frame.is_some_and(|last| last.elapsed() < pause) {
            return;
        }
        let start = Instant::now();
        let snapshot = Arc::new(self.snapshot(false));
        // A viewer that still has one to look at gets a later one.
        let gone = |viewer: &Sender<_>| {
            matches!(viewer.try_send(Arc::clone(&snapshot)), Err(TrySendError::Disconnected(_)))
        };
        if self.outbox.snapshots.as_ref().is_some_and(gone) {
            self.outbox.snapshots = None;
            self.deserted = true;
        }
        if self.outbox.remote.as_ref().filter(is_free).is_some_and(gone) {
            self.outbox.remote = None;
        }
        self.frame_cost = start.elapsed();
        self.last_frame = Some(Instant::now());
    }

    /// The film as it is now, for viewers. Statistics are reused for a while (see [`STATISTICS`]), but not if the render
    /// is `finished`.
    pub(super) fn snapshot(&mut self, finished: bool) -> Snapshot {
        let fresh = |(at, _): &(Instant, Arc<Statistics>)| !finished && at.elapsed() < STATISTICS;
        let known = self.statistics.take().filter(fresh);
        let (at, statistics) =
            known.unwrap_or_else(|| (Instant::now(), Arc::new(Statistics::of(&self.film))));
        self.statistics = Some((at, Arc::clone(&statistics)));
        Snapshot {
            picture: self.film.picture(),
            statistics,
            owners: self.owners.clone().unwrap_or_default(),
            spp_done: self.totals.samples as f64 / f64::from(self.region.len()),
            spp_before: self.totals.before as f64 / f64::from(self.region.len()),
            spp_target: self.target,
            noise: self.totals.noise,
            samples: self.totals.made(),
            seconds: self.totals.elapsed.as_secs_f64(),
            finished,
        }
    }
}
