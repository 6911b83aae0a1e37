//! Checkpoints: the film, sent in pieces while samples continue to arrive.
//!
//! Checkpoints are made at regular intervals. A due checkpoint begins with the next batch, and its pieces are sent
//! without waiting for the sink: pixels of later pieces may have samples that earlier ones lack, and each pixel has its
//! own count. Only if samples contribute to several pixels does a batch wait for the pieces that it would split: a
//! sample is in all pixels of a checkpoint or in none.

use super::adding::AffectedPixels;
use crate::film::file::Piece;
use crate::film::{Film, Milestone};
use crossbeam_channel::Sender;
use std::time::{Duration, Instant};

/// Pixels that are sent at a time: 2 MiB of plain ones, less than 19 MiB with all sums.
const PIECE: u32 = 1 << 15;

/// Sends the film to its file.
pub(super) struct Checkpoints {
    /// Pixels of the film.
    pixels: u32,
    every: Duration,
    sink: Option<Sender<Piece>>,
    last: Instant,
    /// The index of the next pixel to send of the checkpoint in progress.
    under_way: Option<u32>,
}

impl Checkpoints {
    pub(super) fn new(pixels: u32, every: Duration, sink: Option<Sender<Piece>>) -> Checkpoints {
        Checkpoints { pixels, every, sink, last: Instant::now(), under_way: None }
    }

    /// Starts the interval to the first checkpoint.
    pub(super) fn start(&mut self, now: Instant) {
        self.last = now;
    }

    /// Sends the pieces of a checkpoint that its sink can receive without waiting, if one is in progress or due.
    pub(super) fn send(&mut self, film: &Film, milestone: Option<&Milestone>) {
        if self.under_way.is_none() && self.last.elapsed() < self.every {
            return;
        }
        let has_room = |sink: &Option<Sender<Piece>>| sink.as_ref().is_some_and(|sink| !sink.is_full());
        let mut more = true;
        while more && has_room(&self.sink) {
            more = self.send_piece(film, milestone);
        }
    }

    /// Before a batch is added: sends pieces of the checkpoint in progress, waiting for the sink, until the pixels that
    /// the batch changes together are either all sent or all unsent.
    pub(super) fn send_past(&mut self, reach: AffectedPixels, film: &Film, milestone: Option<&Milestone>) {
        let is_torn = |next: u32| match reach {
            AffectedPixels::Single => false,
            AffectedPixels::Places([first, last]) => first < next && next <= last,
            AffectedPixels::All => true,
        };
        while self.under_way.is_some_and(|next| next > 0 && is_torn(next)) && self.send_piece(film, milestone)
        {
        }
    }

    /// Abandons the checkpoint in progress: at a milestone, pixels already sent may have fewer samples than those that
    /// follow. It starts again with the next batch.
    pub(super) fn restart(&mut self) {
        self.under_way = None;
    }

    /// Sends no more.
    pub(super) fn close(&mut self) {
        self.sink = None;
    }

    /// Sends the next piece, and waits until it is received. Returns whether more of the film remains.
    fn send_piece(&mut self, film: &Film, milestone: Option<&Milestone>) -> bool {
        let Some(sink) = &self.sink else { return false };
        let (piece, next) = match self.under_way {
            None => (Piece::Start(milestone.cloned()), 0),
            Some(place) => {
                let end = self.pixels.min(place + PIECE);
                (Piece::Pixels(film.bytes(place as usize..end as usize)), end)
            }
        };
        // The sink closes its channel only after the end.
        if sink.send(piece).is_err() {
            self.sink = None;
            return false;
        }
        self.under_way = (next < self.pixels).then_some(next);
        if self.under_way.is_none() {
            self.last = Instant::now();
        }
        self.under_way.is_some()
    }
}
