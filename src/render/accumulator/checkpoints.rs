//! Checkpoints: the film, sent in pieces while samples go on to arrive.
//!
//! A checkpoint is due every so often. It begins with the next batch after that, and its pieces are sent as fast as they
//! are taken, without waiting: pixels of later pieces may have samples that those of earlier ones have not, and each
//! counts its own. Only where samples count in several pixels a batch waits for the pieces that it would tear: a sample
//! is in all pixels of a film or in none.

use super::adding::Reach;
use crate::film::file::Piece;
use crate::film::{Film, Milestone};
use crossbeam_channel::Sender;
use std::time::{Duration, Instant};

/// Pixels that are sent at a time: 2 MiB of plain ones, less than 19 MiB of those with all sums.
const PIECE: u32 = 1 << 15;

/// What sends the film.
pub(super) struct Checkpoints {
    /// Pixels of the film.
    pixels: u32,
    every: Duration,
    sink: Option<Sender<Piece>>,
    last: Instant,
    /// The next place to send, of a film that is under way.
    under_way: Option<u32>,
}

impl Checkpoints {
    pub(super) fn new(pixels: u32, every: Duration, sink: Option<Sender<Piece>>) -> Checkpoints {
        Checkpoints { pixels, every, sink, last: Instant::now(), under_way: None }
    }

    /// Counts the time to the first one from now on.
    pub(super) fn start(&mut self, now: Instant) {
        self.last = now;
    }

    /// Sends as much of a film as is taken without waiting, if one is under way or due.
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

    /// Before a batch is added: sends pieces of a film that is under way, waiting until they are taken, until none of the
    /// pixels that the batch changes together has been sent without another of them.
    pub(super) fn send_past(&mut self, reach: Reach, film: &Film, milestone: Option<&Milestone>) {
        let is_torn = |next: u32| match reach {
            Reach::Single => false,
            Reach::Places([first, last]) => first < next && next <= last,
            Reach::All => true,
        };
        while self.under_way.is_some_and(|next| next > 0 && is_torn(next)) && self.send_piece(film, milestone)
        {
        }
    }

    /// Gives a film up that is under way: at a milestone, pixels that were sent before have less than those that follow
    /// may have. It begins anew with the next batch.
    pub(super) fn begin_anew(&mut self) {
        self.under_way = None;
    }

    /// Sends no more.
    pub(super) fn close(&mut self) {
        self.sink = None;
    }

    /// Sends the next piece of a film, waiting until it is taken; whether more of the film is left.
    fn send_piece(&mut self, film: &Film, milestone: Option<&Milestone>) -> bool {
        let Some(sink) = &self.sink else { return false };
        let (piece, next) = match self.under_way {
            None => (Piece::Start(milestone.cloned()), 0),
            Some(place) => {
                let end = self.pixels.min(place + PIECE);
                (Piece::Pixels(film.bytes(place as usize..end as usize)), end)
            }
        };
        // The sink has gone only if all is over.
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
