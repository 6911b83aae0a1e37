//! Connects processes as a session does, with sinks that record all messages; and makes the same films without
//! processes.

use super::*;
use std::cell::Cell;

/// A callback for each delivery of samples.
pub(super) type Sink = Box<dyn FnMut(&[Sample]) + Send>;

/// The configuration of a test render.
pub(super) struct Wiring {
    pub(super) region: Region,
    pub(super) workers: usize,
    pub(super) spp: u32,
    pub(super) dump_at: Vec<u32>,
    pub(super) sends_samples: bool,
    pub(super) deadline: Option<Instant>,
    pub(super) stop: Option<Receiver<Infallible>>,
    /// The index of each pixel's first sample.
    pub(super) first: u32,
    /// The film to resume.
    pub(super) film: Option<Film>,
    /// Adds weighted samples to pixels, and contributions to the light image.
    pub(super) splatter: Option<Arc<Splatter>>,
    pub(super) light: Option<Arc<Splatter>>,
    /// Writes checkpoints of the film all the time.
    pub(super) keeper: Option<FilmSink>,
    /// The requested error, and the milestone of the film.
    pub(super) noise: Option<(f64, Option<Milestone>)>,
    /// The sample sink's callback for each delivery.
    pub(super) sink: Sink,
    /// Requests the end when the viewer has received this number of pictures.
    pub(super) stop_after: Option<usize>,
    /// The channel of a remote viewer.
    pub(super) remote: Option<Sender<Arc<Snapshot>>>,
    /// The assumed speed of the last worker, if the others can continue without it. By its clock each block takes
    /// so long that it is sent separately.
    pub(super) dispensable: Option<f64>,
}

impl Default for Wiring {
    fn default() -> Wiring {
        Wiring {
            region: WHOLE,
            workers: 2,
            spp: 16,
            dump_at: Vec::new(),
            sends_samples: false,
            deadline: None,
            stop: None,
            first: 0,
            film: None,
            splatter: None,
            light: None,
            keeper: None,
            noise: None,
            sink: Box::new(|_| {}),
            stop_after: None,
            remote: None,
            dispensable: None,
        }
    }
}

/// The results of a render.
pub(super) struct Rendered {
    pub(super) outcome: Outcome,
    pub(super) barriers: Vec<Barrier>,
    pub(super) samples: Vec<Sample>,
    pub(super) snapshots: Vec<Arc<Snapshot>>,
    pub(super) progress: Vec<Totals>,
}

impl Wiring {
    pub(super) fn render(self, integrator: &dyn Integrator) -> Rendered {
        let workers = self.workers;
        let end = self.first.saturating_add(self.spp);
        let film = self.film.unwrap_or_else(|| empty_film(self.region));
        let layers = film.layout().layers;
        let schedule = Schedule::new(workers, self.region.len(), end, self.deadline, self.dump_at.clone())
            .starting_at(self.first + film.seen_range()[0] as u32, self.first + film.seen_range()[1] as u32);
        let schedule = match self.dispensable {
            Some(times) => schedule.with_faster(self.region.len(), times),
            None => schedule,
        };
        let schedule = match self.splatter {
            Some(_) => schedule.in_stripes(self.region.len(), self.region.width),
            None => schedule,
        };
        let (stop_out, viewer_stops) = bounded(0);
        let mut stop_out = Some(stop_out);
        let stop = self.stop.unwrap_or(viewer_stops);
        std::thread::scope(|scope| {
            let (batches_out, batches) = bounded(2 * workers);
            let (changes_out, changes) = bounded(workers);
            let mut ports = Vec::new();
            for index in 0..workers {
                let (orders_out, orders_in) = bounded(2);
                let is_dispensable = self.dispensable.is_some() && index == workers - 1;
                ports.push(Port { may_be_lost: is_dispensable, ..Port::new(orders_out) });
                let worker = Worker {
                    index,
                    integrator,
                    level: level(),
                    region: self.region,
                    sends_samples: self.sends_samples,
                    splatter: self.splatter.as_deref(),
                    layers,
                };
                let (batches_out, changes_out) = (batches_out.clone(), changes_out.clone());
                let thread = std::thread::Builder::new().name(format!("worker {index}"));
                let work = move || {
                    let (start, looks) = (Instant::now(), Cell::new(0));
                    let slow = || {
                        looks.set(looks.get() + 1);
                        start + Duration::from_millis(51) * looks.get()
                    };
                    let clock: &dyn Fn() -> Instant = if is_dispensable { &slow } else { &Instant::now };
                    let run = std::panic::AssertUnwindSafe(|| {
                        worker.run_by(clock, &orders_in, &never(), &batches_out);
                    });
                    if let Err(panic) = std::panic::catch_unwind(run) {
                        let message = panic.downcast_ref::<String>().cloned().unwrap_or_default();
                        let failure = WorkerFailure { index, worker: format!("worker {index}"), message };
                        let _ = changes_out.send(Change::Fails(failure));
                    }
                };
                thread.spawn_scoped(scope, work).unwrap();
            }
            drop((batches_out, changes_out));
            let (barriers_out, barriers) = bounded(self.dump_at.len().max(1));
            let (samples_out, samples) = bounded::<Vec<Sample>>(1);
            let (snapshots_out, snapshots) = bounded(1);
            let (progress_out, progress) = bounded(1);
            let mut look = self.sink;
            let sink = scope.spawn(move || {
                let mut all = Vec::new();
                for delivery in samples {
                    look(&delivery);
                    all.extend(delivery);
                }
                all
            });
            let (stop_after, stop_out) = (self.stop_after, &mut stop_out);
            let viewer = scope.spawn(move || {
                let mut all = Vec::new();
                for snapshot in snapshots {
                    all.push(snapshot);
                    if stop_after == Some(all.len()) {
                        *stop_out = None;
                    }
                }
                all
            });
            let teller = scope.spawn(move || progress.iter().collect());
            let (film_out, pieces) = bounded(1);
            if let Some(keeper) = &self.keeper {
                scope.spawn(move || keeper.write_checkpoints(&pieces, |said| panic!("{said}")));
            }
            let outbox = Outbox {
                samples: Some(samples_out),
                barriers: Some(barriers_out),
                film: self.keeper.is_some().then_some(film_out),
                snapshots: Some(snapshots_out),
                remote: self.remote,
                progress: Some(progress_out),
                notes: None,
            };
            let goal = |(error, milestone)| Goal { error, is_adaptive: false, milestone };
            let accumulator = Accumulator::new(Configuration {
                first: self.first,
                splatter: self.splatter.clone(),
                light: self.light.clone(),
                barriers: self.dump_at.clone(),
                goal: self.noise.map(goal),
                checkpoint: Duration::ZERO,
                target: Some(self.spp),
                outbox,
                ..Configuration::new(film, self.region, schedule, ports)
            });
            let outcome = accumulator.run(Inbox { batches, changes, stop, viewer: never() });
            Rendered {
                outcome,
                barriers: barriers.try_iter().collect(),
                samples: sink.join().unwrap(),
                snapshots: viewer.join().unwrap(),
                progress: teller.join().unwrap(),
            }
        })
    }
}

/// The film of the first samples of each place, `count` of them each, computed without processes.
pub(super) fn plain_film(integrator: &dyn Integrator, region: Region, count: impl Fn(u32) -> u32) -> Film {
    plain_film_from(integrator, region, 0, count)
}

/// The same, of samples from `first_sample` on.
pub(super) fn plain_film_from(
    integrator: &dyn Integrator,
    region: Region,
    first_sample: u32,
    count: impl Fn(u32) -> u32,
) -> Film {
    let mut film = empty_film(region);
    let mut finished = Vec::new();
    for place in 0..region.len() {
        finished.clear();
        let pixels = [region.pixel(place)];
        let paths = Paths { pixels: &pixels, first_sample, samples: count(place) };
        integrator.trace(level(), &paths, &mut finished);
        for f in &finished {
            let _ = film.add_sample(place as usize, f.sample.radiance);
        }
        add_first_hits(&mut film, integrator, place, &paths);
    }
    film
}

/// Adds the first hits of a place's paths to its pixel, for its layers.
pub(super) fn add_first_hits(film: &mut Film, integrator: &dyn Integrator, place: u32, paths: &Paths<'_>) {
    let (mut hits, mut sums) = (Vec::new(), LayerSums::new(film.layout().layers));
    let first = paths.first_sample.min(LAYER_SAMPLES);
    let end = (paths.first_sample + paths.samples).min(LAYER_SAMPLES);
    if first == end {
        return;
    }
    integrator.first_hits(level(), &Paths { first_sample: first, samples: end - first, ..*paths }, &mut hits);
    sums.grow(1);
    sums.add(0, first, &hits);
    film.add_first_hits(place as usize, &sums, 0);
}

pub(super) fn plain_picture(spp: u32) -> Picture {
    plain_film(&*common::integrator(&scene()), WHOLE, |_| spp).picture()
}

/// Checks that a film has exactly the first samples of each pixel, by its counts.
pub(super) fn is_a_prefix(outcome: &Outcome) {
    let film = &outcome.film;
    let expected =
        plain_film(&*common::integrator(&scene()), WHOLE, |place| film.seen(place as usize) as u32);
    assert!(film == &expected);
    let seen: u64 = (0..WHOLE.len()).map(|place| film.seen(place as usize)).sum();
    assert_eq!(outcome.totals.samples, seen);
    let least = (0..WHOLE.len()).map(|place| film.seen(place as usize)).min().unwrap();
    assert!(u64::from(outcome.totals.spp) <= least);
}
