//! Barriers: pictures at given samples per pixel.

use crate::film::{Film, Picture};
use crate::render::channels::Barrier;
use crate::render::stride::Stride;
use crate::sampling::Region;
use crossbeam_channel::Sender;

/// The pictures that are still to be gathered.
pub(super) struct Barriers {
    gathering: Vec<Gathering>,
    region: Region,
    sink: Option<Sender<Barrier>>,
    is_disconnected: bool,
}

/// The picture of a barrier, filled share by share, and the number of missing pixels.
struct Gathering {
    barrier: Barrier,
    missing: u32,
}

impl Barriers {
    /// A picture of the region at each of these sample indices.
    pub(super) fn new(ends: &[u32], region: Region, sink: Option<Sender<Barrier>>) -> Barriers {
        let gather = |&end: &u32| {
            // Memory is allocated later: there may be many barriers, and few are gathered at a time.
            let picture = Picture { width: region.width, height: region.height, rgb: Vec::new() };
            Gathering { barrier: Barrier { end, picture }, missing: region.len() }
        };
        Barriers { gathering: ends.iter().map(gather).collect(), region, sink, is_disconnected: false }
    }

    /// The sample index of the next barrier.
    pub(super) fn next(&self) -> Option<u32> {
        self.ends().min()
    }

    /// The sample indices of the remaining barriers.
    pub(super) fn ends(&self) -> impl Iterator<Item = u32> {
        self.gathering.iter().map(|gathering| gathering.barrier.end)
    }

    /// Whether the sink has closed its channel, which ends the render.
    pub(super) fn is_disconnected(&self) -> bool {
        self.is_disconnected
    }

    /// Copies the pixels of a stride that has just reached `end` samples into the picture of that barrier, if there is
    /// one, and sends the picture once it is complete.
    pub(super) fn gather_share(&mut self, film: &Film, stride: Stride, end: u32) {
        let Some(index) = self.gathering.iter().position(|g| g.barrier.end == end) else { return };
        let gathering = &mut self.gathering[index];
        gathering.barrier.picture.rgb.resize(self.region.len() as usize, [0.0; 3]);
        let slots = stride.len(self.region.len());
        for slot in 0..slots {
            let place = stride.place(slot) as usize;
            gathering.barrier.picture.rgb[place] = film.mean(place);
        }
        gathering.missing -= slots;
        if gathering.missing == 0 {
            let done = self.gathering.swap_remove(index);
            self.send(done.barrier);
        }
    }

    /// Sends the picture of the barrier that all pixels have reached, if there is one.
    pub(super) fn gather_whole(&mut self, film: &Film, end: u32) {
        if let Some(index) = self.gathering.iter().position(|g| g.barrier.end == end) {
            self.gathering.swap_remove(index);
            self.send(Barrier { end, picture: film.picture() });
        }
    }

    /// Sends a finished picture to its sink, and waits until it is received.
    fn send(&mut self, barrier: Barrier) {
        if let Some(sink) = &self.sink
            && sink.send(barrier).is_err()
        {
            self.sink = None;
            self.is_disconnected = true;
        }
    }
}
