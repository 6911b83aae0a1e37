//! Barriers: pictures at given numbers of samples a pixel.

use crate::film::{Film, Picture};
use crate::render::channels::Barrier;
use crate::render::stride::Stride;
use crate::sampling::Region;
use crossbeam_channel::Sender;

/// The pictures that are still to come.
pub(super) struct Barriers {
    gathering: Vec<Gathering>,
    region: Region,
    sink: Option<Sender<Barrier>>,
    is_deserted: bool,
}

/// A barrier's picture, filled share by share, and how many pixels it lacks.
struct Gathering {
    barrier: Barrier,
    missing: u32,
}

impl Barriers {
    /// A picture of the region at each of these sample indices.
    pub(super) fn new(ends: &[u32], region: Region, sink: Option<Sender<Barrier>>) -> Barriers {
        let gather = |&end: &u32| {
            // There is no memory for it yet: many counts may be asked for, and few be gathered at a time.
            let picture = Picture { width: region.width, height: region.height, rgb: Vec::new() };
            Gathering { barrier: Barrier { end, picture }, missing: region.len() }
        };
        Barriers { gathering: ends.iter().map(gather).collect(), region, sink, is_deserted: false }
    }

    /// The first of those that are still to come.
    pub(super) fn next(&self) -> Option<u32> {
        self.ends().min()
    }

    /// The sample indices of those that are still to come.
    pub(super) fn ends(&self) -> impl Iterator<Item = u32> {
        self.gathering.iter().map(|gathering| gathering.barrier.end)
    }

    /// Whether the sink has gone: the render ends then.
    pub(super) fn is_deserted(&self) -> bool {
        self.is_deserted
    }

    /// Copies the pixels of a stride that has just reached `end` samples into the picture of that barrier, if there is
    /// one, and sends the picture once all strides are in it.
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

    /// Sends the picture of the barrier at which all pixels are now, if there is one.
    pub(super) fn gather_whole(&mut self, film: &Film, end: u32) {
        if let Some(index) = self.gathering.iter().position(|g| g.barrier.end == end) {
            self.gathering.swap_remove(index);
            self.send(Barrier { end, picture: film.picture() });
        }
    }

    /// Sends a finished picture to its sink, waiting until it is taken.
    fn send(&mut self, barrier: Barrier) {
        if let Some(sink) = &self.sink
            && sink.send(barrier).is_err()
        {
            self.sink = None;
            self.is_deserted = true;
        }
    }
}
