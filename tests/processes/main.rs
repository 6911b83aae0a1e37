//! Workers, channels and the accumulator: the film depends on none of them.

mod abandoned;
mod checkpoints;
#[path = "../common/mod.rs"]
mod common;
mod contributions;
mod film;
mod joining;
mod losses;
mod schedules;
mod stopping;
mod wiring;
mod workers;

use common::scenes::*;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, never, unbounded};
use rand::RngExt;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use stride::camera::Camera;
use stride::film::head::Head;
use stride::film::{
    Film, Identity, LAYER_SAMPLES, Layer, LayerSet, LayerSums, Layout, LightScale, Made, Milestone, Picture,
    Reject, Snapshot, Splatter, Statistics, Weights,
};
use stride::integrator::{Event, Finished, FirstHit, Found, Integrator, Paths};
use stride::math::lanes::Level;
use stride::output::{FilmSink, open_film, tev};
use stride::render::accumulator::{Goal, Inbox, Outbox, Outcome, Totals, Unanswered, WorkerFailure};
use stride::render::worker::Worker;
use stride::render::{
    Accumulator, Assignment, Barrier, Change, Configuration, Dispatch, Order, Payload, Port, SampleBatch,
    Schedule, Stride, Traced,
};
use stride::sampling::{Contribution, Pixel, Region, Sample, Stream};
use stride::scene::{Filter, Scene};
use wiring::{Rendered, Wiring, add_first_hits, is_a_prefix, plain_film, plain_film_from, plain_picture};

/// The time without a message after which a test fails. No passing test depends on it.
const TIMEOUT: Duration = Duration::from_secs(60);

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;
const WHOLE: Region = Region { film_width: WIDTH, x: 0, y: 0, width: WIDTH, height: HEIGHT };

fn level() -> Level {
    Level::available()[0]
}

fn scene() -> Scene {
    cover(WIDTH, HEIGHT)
}

/// All layers of the scene.
fn layers() -> LayerSet {
    let scene = scene();
    LayerSet::new(&Layer::ALL, scene.entities.len(), scene.materials.len())
}

/// A film with all layers and without samples.
fn empty_film(region: Region) -> Film {
    Film::with_layout(Layout { layers: layers(), ..Layout::plain(region.width, region.height) }).unwrap()
}

/// An integrator with a callback before and after each block.
struct Hooked<B, A> {
    inner: Box<dyn Integrator>,
    before: B,
    after: A,
}

impl<B: Fn(&Paths<'_>) + Send + Sync, A: Fn(&mut Sample) + Send + Sync> Integrator for Hooked<B, A> {
    fn trace_until(
        &self,
        level: Level,
        paths: &Paths<'_>,
        stop: &dyn Fn() -> bool,
        out: &mut Found,
    ) -> Option<u64> {
        (self.before)(paths);
        let from = out.finished.len();
        let rays = self.inner.trace_until(level, paths, stop, out)?;
        out.finished[from..].iter_mut().for_each(|finished| (self.after)(&mut finished.sample));
        Some(rays)
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        self.inner.first_hits(level, paths, out);
    }

    fn seen_by(&self, camera: Camera) -> Box<dyn Integrator> {
        self.inner.seen_by(camera)
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        self.inner.explain(pixel, sample)
    }
}

/// The number in the name of the current worker thread.
fn this_worker() -> usize {
    let thread = std::thread::current();
    let number = thread.name().and_then(|name| name.strip_prefix("worker ")).and_then(|n| n.parse().ok());
    number.expect("a worker's thread")
}

fn hooked(before: impl Fn(&Paths<'_>) + Send + Sync) -> impl Integrator {
    Hooked { inner: common::integrator(&scene()), before, after: |_: &mut Sample| {} }
}
