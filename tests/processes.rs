//! Workers, channels and the accumulator: the film depends on none of them.

mod common;

use common::scenes::*;
use crossbeam_channel::{Receiver, bounded};
use rand::RngExt;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use stride::film::file::Head;
use stride::film::{Film, Identity, Milestone, Picture, Reject, Snapshot};
use stride::integrator::{Event, Finished, FirstHit, Integrator, Paths, Pixel, Sample};
use stride::math::lanes::Level;
use stride::output::{FilmSink, open_film};
use stride::render::accumulator::{Inbox, Outbox, Outcome, Totals, WorkerFailure};
use stride::render::worker::Worker;
use stride::render::{
    Accumulator, Barrier, Deal, Held, Order, Region, SampleBatch, Schedule, Stride, Traced,
};
use stride::sampling::Stream;
use stride::scene::Scene;

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;
const WHOLE: Region = Region { film_width: WIDTH, x: 0, y: 0, width: WIDTH, height: HEIGHT };

fn level() -> Level {
    Level::available()[0]
}

fn scene() -> Scene {
    cover(WIDTH, HEIGHT)
}

/// An integrator with something done before and after each block that it traces.
struct Hooked<B, A> {
    inner: Box<dyn Integrator>,
    before: B,
    after: A,
}

impl<B: Fn(&Paths<'_>) + Send + Sync, A: Fn(&mut Sample) + Send + Sync> Integrator for Hooked<B, A> {
    fn trace(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<Finished>) -> u64 {
        (self.before)(paths);
        let from = out.len();
        let rays = self.inner.trace(level, paths, out);
        out[from..].iter_mut().for_each(|finished| (self.after)(&mut finished.sample));
        rays
    }

    fn first_hits(&self, level: Level, paths: &Paths<'_>, out: &mut Vec<FirstHit>) {
        self.inner.first_hits(level, paths, out);
    }

    fn explain(&self, pixel: Pixel, sample: u32) -> (Sample, Vec<Event>) {
        self.inner.explain(pixel, sample)
    }
}

fn hooked(before: impl Fn(&Paths<'_>) + Send + Sync) -> impl Integrator {
    Hooked { inner: common::integrator(&scene()), before, after: |_: &mut Sample| {} }
}

/// How a render is wired.
struct Wiring {
    region: Region,
    workers: usize,
    spp: u32,
    dump_at: Vec<u32>,
    sends_samples: bool,
    deadline: Option<Instant>,
    stop: Option<Receiver<Infallible>>,
    /// The index of each pixel's first sample.
    first: u32,
    /// A film to go on with.
    film: Option<Film>,
    /// What writes the film, all the time.
    keeper: Option<FilmSink>,
    /// The error to end at, and the milestone that the film has.
    noise: Option<(f64, Option<Milestone>)>,
    /// How long the sample sink takes for each delivery.
    sink_takes: Duration,
    /// How much faster the last worker is held to be, where the others can do without it.
    spare: Option<f64>,
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
            keeper: None,
            noise: None,
            sink_takes: Duration::ZERO,
            spare: None,
        }
    }
}

/// What comes out of a render.
struct Rendered {
    outcome: Outcome,
    barriers: Vec<Barrier>,
    samples: Vec<Sample>,
    snapshots: Vec<Arc<Snapshot>>,
    progress: Vec<Totals>,
}

impl Wiring {
    fn render(self, integrator: &dyn Integrator) -> Rendered {
        let workers = self.workers;
        let end = self.first.saturating_add(self.spp);
        let film = self.film.unwrap_or_else(|| Film::new(self.region.width, self.region.height).unwrap());
        let held = Held::of(&film, self.region, self.first);
        let schedule = Schedule::new(workers, self.region.len(), end, self.deadline, self.dump_at.clone())
            .starting_at(self.first + film.seen_range()[0] as u32, self.first + film.seen_range()[1] as u32);
        let schedule = match self.spare {
            Some(times) => schedule.with_faster(self.region.len(), times),
            None => schedule,
        };
        let (never_sent, never) = bounded(1);
        let stop = self.stop.unwrap_or(never);
        let rendered = std::thread::scope(|scope| {
            let (batches_out, batches) = bounded(2 * workers);
            let (failures_out, failures) = bounded(workers);
            let (mut orders, mut news) = (Vec::new(), Vec::new());
            for index in 0..workers {
                let (orders_out, orders_in) = bounded(2);
                orders.push(Some(orders_out));
                let (news_out, news_in) = bounded(1);
                news.push(news_out);
                let worker = Worker {
                    index,
                    integrator,
                    level: level(),
                    region: self.region,
                    sends_samples: self.sends_samples,
                    held: held.as_ref(),
                };
                let (batches_out, failures_out) = (batches_out.clone(), failures_out.clone());
                let thread = std::thread::Builder::new().name(format!("worker {index}"));
                let work = move || {
                    let run = std::panic::AssertUnwindSafe(|| {
                        worker.run_hearing(&orders_in, &news_in, &batches_out);
                    });
                    if let Err(panic) = std::panic::catch_unwind(run) {
                        let message = panic.downcast_ref::<String>().cloned().unwrap_or_default();
                        let failure = WorkerFailure { index, worker: format!("worker {index}"), message };
                        let _ = failures_out.send(failure);
                    }
                };
                thread.spawn_scoped(scope, work).unwrap();
            }
            drop((batches_out, failures_out));
            let (barriers_out, barriers) = bounded(self.dump_at.len().max(1));
            let (samples_out, samples) = bounded::<Vec<Sample>>(1);
            let (snapshots_out, snapshots) = bounded(1);
            let (progress_out, progress) = bounded(1);
            let sink_takes = self.sink_takes;
            let sink = scope.spawn(move || {
                let mut all = Vec::new();
                for delivery in samples {
                    all.extend(delivery);
                    std::thread::sleep(sink_takes);
                }
                all
            });
            let viewer = scope.spawn(move || snapshots.iter().collect());
            let teller = scope.spawn(move || progress.iter().collect());
            let (film_out, pieces) = bounded(1);
            if let Some(keeper) = &self.keeper {
                scope.spawn(move || keeper.keep(&pieces, |said| panic!("{said}")));
            }
            let outbox = Outbox {
                orders,
                samples: Some(samples_out),
                barriers: Some(barriers_out),
                film: self.keeper.is_some().then_some(film_out),
                snapshots: Some(snapshots_out),
                progress: Some(progress_out),
            };
            let spp = Some(self.spp);
            let mut accumulator = Accumulator::new(film, self.region, schedule, &self.dump_at, spp, outbox)
                .with_checkpoints(Duration::ZERO)
                .going_on(self.first);
            if self.spare.is_some() {
                accumulator = accumulator.with_spare(workers - 1, news);
            }
            if let Some((asked, milestone)) = self.noise {
                accumulator = accumulator.until_noise(asked, milestone);
            }
            let outcome = accumulator.run(Inbox { batches, failures, stop });
            Rendered {
                outcome,
                barriers: barriers.try_iter().collect(),
                samples: sink.join().unwrap(),
                snapshots: viewer.join().unwrap(),
                progress: teller.join().unwrap(),
            }
        });
        drop(never_sent);
        rendered
    }
}

/// The film of the first samples of each place, as many as `count` says, without any process.
fn plain_film(integrator: &dyn Integrator, region: Region, count: impl Fn(u32) -> u32) -> Film {
    plain_film_from(integrator, region, 0, count)
}

/// The same, of samples from `first_sample` on.
fn plain_film_from(
    integrator: &dyn Integrator,
    region: Region,
    first_sample: u32,
    count: impl Fn(u32) -> u32,
) -> Film {
    let mut film = Film::new(region.width, region.height).unwrap();
    let mut finished = Vec::new();
    for place in 0..region.len() {
        finished.clear();
        let pixels = [region.pixel(place)];
        let paths = Paths { pixels: &pixels, first_sample, samples: count(place) };
        integrator.trace(level(), &paths, &mut finished);
        for f in &finished {
            let _ = film.add_sample(place as usize, f.sample.radiance);
        }
    }
    film
}

fn plain_picture(spp: u32) -> Picture {
    plain_film(&*common::integrator(&scene()), WHOLE, |_| spp).picture()
}

#[test]
fn any_number_of_workers_makes_the_same_film() {
    let integrator = common::integrator(&scene());
    let expected = plain_film(&*integrator, WHOLE, |_| 16);
    for workers in [1, 2, 3, 7, 16] {
        for sends_samples in [false, true] {
            let wiring = Wiring { workers, sends_samples, ..Wiring::default() };
            let Rendered { outcome, .. } = wiring.render(&*integrator);
            assert!(outcome.film == expected, "{workers} workers, samples {sends_samples}");
            assert!(outcome.whole && outcome.failure.is_none());
            let totals = outcome.totals;
            assert_eq!((totals.spp, totals.samples, totals.rejected), (16, 16 * 1200, 0));
            assert!(totals.rays > totals.samples);
        }
    }
}

#[test]
fn more_workers_than_pixels_are_no_harm() {
    let integrator = common::integrator(&scene());
    let region = Region { film_width: WIDTH, x: 11, y: 7, width: 3, height: 1 };
    let outcome = Wiring { workers: 5, region, ..Wiring::default() }.render(&*integrator).outcome;
    assert!(outcome.film == plain_film(&*integrator, region, |_| 16) && outcome.whole);
}

#[test]
fn a_slow_worker_changes_nothing_but_the_time() {
    for slow in 0..3 {
        let integrator = hooked(move |paths| {
            if paths.pixels[0].index % 3 == slow {
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        let wiring = Wiring { workers: 3, dump_at: vec![3, 10], ..Wiring::default() };
        let Rendered { outcome, barriers, .. } = wiring.render(&integrator);
        assert!(outcome.film == plain_film(&*common::integrator(&scene()), WHOLE, |_| 16));
        assert_eq!(barriers.len(), 2);
        for barrier in barriers {
            assert!(barrier.picture == plain_picture(barrier.end), "at {}", barrier.end);
        }
    }
}

#[test]
fn a_crop_is_cut_out_of_the_whole_picture() {
    let integrator = common::integrator(&scene());
    let whole = plain_picture(16);
    let region = Region { film_width: WIDTH, x: 5, y: 9, width: 13, height: 8 };
    let wiring = Wiring { region, workers: 3, sends_samples: true, ..Wiring::default() };
    let Rendered { outcome, samples, .. } = wiring.render(&*integrator);
    let crop = outcome.film.picture();
    for place in 0..region.len() {
        assert_eq!(crop.rgb[place as usize], whole.rgb[region.pixel(place).index as usize]);
    }
    // Film positions are those of the whole film.
    assert!(samples.iter().all(|s| (s.x - (s.pixel % WIDTH) as f32 - 0.5).abs() <= 1.0));
}

#[test]
fn pictures_at_barriers_are_those_of_shorter_renders() {
    for (workers, sends_samples) in [(1, false), (3, false), (3, true), (7, false)] {
        // In any order, and one past the end, which never comes.
        let dump_at = vec![10, 1, 3, 16, 99];
        let wiring = Wiring { workers, sends_samples, dump_at, ..Wiring::default() };
        let mut barriers = wiring.render(&*common::integrator(&scene())).barriers;
        barriers.sort_by_key(|barrier| barrier.end);
        assert_eq!(barriers.iter().map(|b| b.end).collect::<Vec<_>>(), [1, 3, 10, 16]);
        for barrier in barriers {
            assert!(barrier.picture == plain_picture(barrier.end), "{workers} workers at {}", barrier.end);
        }
    }
}

#[test]
fn a_lossless_sink_gets_every_sample_once_however_slow_it_is() {
    let integrator = common::integrator(&scene());
    let sink_takes = Duration::from_millis(3);
    let wiring = Wiring { workers: 3, sends_samples: true, sink_takes, ..Wiring::default() };
    let Rendered { outcome, samples, .. } = wiring.render(&*integrator);
    let mut film = Film::new(WIDTH, HEIGHT).unwrap();
    let mut seen: Vec<(u32, u32)> = samples.iter().map(|s| (s.pixel, s.sample)).collect();
    for sample in &samples {
        film.add_sample(sample.pixel as usize, sample.radiance).unwrap();
    }
    assert!(film == outcome.film);
    seen.sort_unstable();
    let expected: Vec<_> = (0..WHOLE.len()).flat_map(|pixel| (0..16).map(move |n| (pixel, n))).collect();
    assert_eq!(seen, expected);
}

#[test]
fn the_last_snapshot_is_the_finished_picture() {
    let Rendered { outcome, snapshots, progress, .. } =
        Wiring::default().render(&*common::integrator(&scene()));
    let last = snapshots.last().unwrap();
    assert!(last.finished && last.picture == outcome.film.picture());
    assert_eq!((last.samples, last.spp_done, last.spp_target), (16 * 1200, 16.0, Some(16)));
    assert!(snapshots.iter().rev().skip(1).all(|s| !s.finished));
    assert!(progress.is_sorted_by_key(|totals| totals.samples));
}

/// Demands that a film holds the first samples of each pixel, as many as it says, and nothing else.
fn is_a_prefix(outcome: &Outcome) {
    let film = &outcome.film;
    let expected =
        plain_film(&*common::integrator(&scene()), WHOLE, |place| film.seen(place as usize) as u32);
    assert!(film == &expected);
    let seen: u64 = (0..WHOLE.len()).map(|place| film.seen(place as usize)).sum();
    assert_eq!(outcome.totals.samples, seen);
    let least = (0..WHOLE.len()).map(|place| film.seen(place as usize)).min().unwrap();
    assert!(u64::from(outcome.totals.spp) <= least);
}

#[test]
fn stopped_at_any_time_each_pixel_has_its_first_samples() {
    let mut cut_short = 0;
    for i in 0..40_u32 {
        let (stop_out, stop) = bounded(0);
        let stop_out = std::sync::Mutex::new(Some(stop_out));
        // Asks when some pixel's samples from some index on are about to be traced.
        let (pixel, from) = (i * 31 % WHOLE.len(), [0, 1, 7, 100, 600][i as usize % 5]);
        let integrator = hooked(move |paths| {
            if paths.first_sample >= from && paths.pixels.iter().any(|p| p.index >= pixel) {
                stop_out.lock().unwrap().take();
            }
        });
        let wiring =
            Wiring { workers: 1 + i as usize % 4, spp: 1000, sends_samples: i % 2 == 1, ..Wiring::default() };
        let Rendered { outcome, snapshots, .. } = Wiring { stop: Some(stop), ..wiring }.render(&integrator);
        is_a_prefix(&outcome);
        assert!(outcome.failure.is_none());
        let last = snapshots.last().unwrap();
        assert!(last.finished && last.picture == outcome.film.picture());
        cut_short += u32::from(outcome.totals.samples < 1000 * 1200);
    }
    assert!(cut_short >= 30, "only {cut_short} of 40 were stopped before the end");
}

#[test]
fn gone_on_with_a_film_of_any_raggedness_it_ends_as_if_it_had_never_stopped() {
    let integrator = common::integrator(&scene());
    let stream = &mut Stream::new(5, 0, 0);
    for round in 0..12_u32 {
        let first = [0, 1, 7][round as usize % 3];
        // As many threads leave it, one interrupted in an order; or as nobody ever left one.
        let (threads, cut) = (stream.random_range(1..6_u32), stream.random_range(0..WHOLE.len()));
        let (many, few) = (stream.random_range(0..24), stream.random_range(0..24));
        let mut chaos: Vec<u32> = (0..WHOLE.len()).map(|_| stream.random_range(0..=24)).collect();
        if round < 8 {
            chaos = (0..WHOLE.len())
                .map(|place| if place % threads == 0 && place < cut { many } else { few })
                .collect();
        }
        let begun = plain_film_from(&*integrator, WHOLE, first, |place| chaos[place as usize]);
        let most = *chaos.iter().max().unwrap();
        let expected = plain_film_from(&*integrator, WHOLE, first, |_| 24);
        let before: u64 = chaos.iter().map(|&n| u64::from(n)).sum();
        let dump_at = if most < 24 { vec![first + most + 1] } else { vec![] };
        for sends_samples in [false, true] {
            let workers = stream.random_range(1..5);
            let film = Some(begun.clone());
            let wiring = Wiring { workers, spp: 24, first, film, sends_samples, ..Wiring::default() };
            let Rendered { outcome, barriers, samples, .. } =
                Wiring { dump_at: dump_at.clone(), ..wiring }.render(&*integrator);
            assert!(outcome.film == expected && outcome.whole, "round {round}, {workers} workers");
            let totals = outcome.totals;
            assert_eq!((totals.spp, totals.samples, totals.before), (24, 24 * 1200, before));
            assert_eq!(totals.made(), 24 * 1200 - before, "nothing is traced twice");
            if sends_samples {
                assert_eq!(samples.len() as u64, totals.made());
            }
            assert_eq!(barriers.len(), dump_at.len());
            for barrier in barriers {
                let film = plain_film_from(&*integrator, WHOLE, first, |_| barrier.end - first);
                assert!(barrier.picture == film.picture(), "round {round} at {}", barrier.end);
            }
        }
    }
}

#[test]
fn films_written_on_the_way_hold_the_first_samples_of_each_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.film");
    let mut under_way = 0;
    for i in 0..30_u32 {
        let (stop_out, stop) = bounded(0);
        let stop_out = std::sync::Mutex::new(Some(stop_out));
        let from = [1, 3, 20, 100][i as usize % 4];
        let integrator = hooked(move |paths| {
            if paths.first_sample >= from && paths.pixels[0].index > i * 37 {
                stop_out.lock().unwrap().take();
            }
        });
        let head = Head {
            width: WIDTH,
            height: HEIGHT,
            identity: Identity::default().with("a", "b"),
            notes: Identity::default(),
        };
        let keeper = Some(FilmSink { path: path.clone(), head, range: 0..1000 });
        let wiring = Wiring { workers: 1 + i as usize % 4, spp: 1000, keeper, ..Wiring::default() };
        Wiring { stop: Some(stop), ..wiring }.render(&integrator);
        if !path.exists() {
            // Stopped before the first was on the disk; the count below sees to it that this is the exception.
            continue;
        }
        let file = open_film(&path).unwrap();
        under_way += u32::from(file.holding().open().is_some());
        let film = file.read().unwrap();
        let expected =
            plain_film(&*common::integrator(&scene()), WHOLE, |place| film.seen(place as usize) as u32);
        assert!(film == expected, "round {i}");
        assert!(film.seen_range()[1] > 0);
    }
    assert!(under_way >= 5, "only {under_way} of 30 films were written in the middle of an order");
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["a.film"]);
}

#[test]
fn an_error_is_reached_at_the_same_sample_whoever_renders_and_however_often_it_stopped() {
    let asked = 0.03;
    let integrator = common::integrator(&scene());
    let alone = Wiring { workers: 1, spp: 10_000, noise: Some((asked, None)), ..Wiring::default() };
    let alone = alone.render(&*integrator).outcome;
    let spp = alone.totals.spp;
    assert!(alone.whole && spp > 16 && spp < 10_000 && !spp.is_power_of_two(), "{spp}");
    assert!(alone.film == plain_film(&*integrator, WHOLE, |_| spp), "not a plain render of {spp}");
    let [now, told] = alone.totals.noise.unwrap();
    assert!(now <= asked && told == asked);
    // Negative control: a smaller error takes more samples, as 1/√n says.
    let smaller = Wiring { spp: 10_000, noise: Some((asked / 2.0, None)), ..Wiring::default() };
    let more = smaller.render(&*integrator).outcome.totals.spp;
    assert!((2 * spp..8 * spp).contains(&more), "{more} and {spp}");

    let mut stopped = 0;
    for round in 0..10_u32 {
        let (mut film, mut milestone) = (None, None);
        for attempt in 0.. {
            let (stop_out, stop) = bounded(0);
            let stop_out = std::sync::Mutex::new(Some(stop_out));
            let (from, pixel) = ((round * 37 + attempt * 53) % 150, (round * 211) % WHOLE.len());
            let integrator = hooked(move |paths| {
                if attempt < 3 && paths.first_sample >= from && paths.pixels[0].index >= pixel {
                    stop_out.lock().unwrap().take();
                }
            });
            let workers = 1 + (round + attempt) as usize % 5;
            let noise = Some((asked, milestone.take()));
            let wiring = Wiring { workers, spp: 10_000, film: film.take(), noise, ..Wiring::default() };
            let outcome = Wiring { stop: Some(stop), ..wiring }.render(&integrator).outcome;
            if attempt >= 3 {
                assert!(outcome.film == alone.film && outcome.whole, "round {round}");
                assert!(outcome.milestone == alone.milestone && outcome.totals.noise == alone.totals.noise);
                break;
            }
            stopped += u32::from(outcome.totals.spp < spp);
            (film, milestone) = (Some(outcome.film), outcome.milestone);
        }
    }
    assert!(stopped >= 15, "only {stopped} renders stopped on the way");
}

#[test]
fn a_closed_stop_channel_is_the_request_to_stop() {
    let (stop_out, stop) = bounded(0);
    drop(stop_out);
    let wiring = Wiring { spp: 1_000_000, stop: Some(stop), ..Wiring::default() };
    let start = Instant::now();
    is_a_prefix(&wiring.render(&*common::integrator(&scene())).outcome);
    assert!(start.elapsed() < Duration::from_secs(10));
}

#[test]
fn a_worker_that_panics_ends_the_run_by_name_and_the_rest_is_kept() {
    for (workers, culprit, from) in [(1, 0, 0), (3, 1, 0), (3, 2, 2), (7, 4, 9)] {
        let integrator = hooked(move |paths| {
            let is_culprit = std::thread::current().name() == Some(&format!("worker {culprit}"));
            if is_culprit && paths.first_sample >= from {
                panic!("no light at sample {}", paths.first_sample);
            }
        });
        let wiring = Wiring { workers, spp: 2000, ..Wiring::default() };
        let outcome = wiring.render(&integrator).outcome;
        let failure = outcome.failure.as_ref().expect("a failure");
        assert_eq!(failure.worker, format!("worker {culprit}"));
        assert!(failure.to_string().starts_with(&format!("worker {culprit} failed: no light at sample")));
        assert!(outcome.totals.spp < 2000);
        is_a_prefix(&outcome);
        assert!(from == 0 || outcome.totals.samples > 0, "what had been sent before is there");
    }
}

#[test]
fn what_a_lost_worker_leaves_is_made_by_the_others_and_the_film_is_the_same() {
    let expected = plain_film(&*common::integrator(&scene()), WHOLE, |_| 30);
    for (workers, times, blocks) in [(2, 1.0, 0), (2, 9.0, 7), (3, 40.0, 5), (4, 0.3, 3)] {
        for sends_samples in [false, true] {
            // The last worker sends every block by itself, and fails in the middle of an order.
            let (lost, begun) = (format!("worker {}", workers - 1), AtomicU32::new(0));
            let name = lost.clone();
            let integrator = hooked(move |_| {
                if std::thread::current().name() == Some(&name) {
                    std::thread::sleep(Duration::from_millis(51));
                    assert!(begun.fetch_add(1, Ordering::Relaxed) < blocks, "the device is gone");
                }
            });
            let spare = Some(times);
            let wiring =
                Wiring { workers, spp: 30, dump_at: vec![7, 20], sends_samples, spare, ..Wiring::default() };
            let Rendered { outcome, barriers, samples, .. } = wiring.render(&integrator);
            assert_eq!(outcome.lost.as_ref().expect("a lost worker").worker, lost);
            assert!(outcome.failure.is_none() && outcome.whole);
            assert_eq!((outcome.totals.samples, outcome.totals.spp), (1200 * 30, 30));
            assert_eq!(outcome.made.iter().sum::<u64>(), 1200 * 30);
            assert!((outcome.made[workers - 1] > 0) == (blocks > 1), "{:?}", outcome.made);
            assert!(outcome.film == expected, "{workers} workers, the last {times} times as fast");
            assert_eq!(barriers.len(), 2);
            for barrier in barriers {
                assert!(barrier.picture == plain_picture(barrier.end), "at {}", barrier.end);
            }
            if sends_samples {
                let mut seen: Vec<_> = samples.iter().map(|s| (s.pixel, s.sample)).collect();
                seen.sort_unstable();
                seen.dedup();
                assert_eq!((seen.len(), samples.len()), (1200 * 30, 1200 * 30), "each sample once");
            }
        }
    }
}

#[test]
fn a_worker_that_is_lost_when_the_others_are_done_leaves_nothing_out() {
    let integrator = hooked(move |_| {
        if std::thread::current().name() == Some("worker 1") {
            std::thread::sleep(Duration::from_millis(300));
            panic!("the device is gone");
        }
    });
    let wiring = Wiring { workers: 2, spp: 1, spare: Some(1.0), ..Wiring::default() };
    let outcome = wiring.render(&integrator).outcome;
    assert!(outcome.lost.is_some() && outcome.failure.is_none() && outcome.whole);
    assert!(outcome.film == plain_film(&*common::integrator(&scene()), WHOLE, |_| 1));
}

#[test]
fn a_fast_worker_owns_as_much_as_it_is_faster() {
    for (workers, times) in [(2, 1.0), (3, 7.5), (17, 100.0), (3, 0.25)] {
        let schedule = Schedule::new(workers, 1_000_000, 1, None, vec![]).with_faster(1_000_000, times);
        let owners = schedule.owners(1_000_000);
        let share = |worker: usize| owners.iter().filter(|&&owner| owner as usize == worker).count() as f64;
        for other in 0..workers - 1 {
            let ratio = share(workers - 1) / share(other);
            // Eighths of what one of the others has.
            assert!((ratio - times).abs() <= 0.063, "{ratio} is not {times}");
        }
    }
}

#[test]
fn a_deadline_ends_at_a_whole_number_of_samples() {
    let deadline = Some(Instant::now() + Duration::from_millis(150));
    let wiring = Wiring { workers: 3, spp: u32::MAX, deadline, ..Wiring::default() };
    let outcome = wiring.render(&*common::integrator(&scene())).outcome;
    let spp = outcome.totals.spp;
    assert!(outcome.whole && spp > 0 && spp < u32::MAX, "{spp}");
    assert!(outcome.film.picture() == plain_picture(spp));
}

#[test]
fn samples_that_no_film_takes_are_counted_and_named_and_bright_ones_are_kept() {
    let altered = || Hooked {
        inner: common::integrator(&scene()),
        before: |_: &Paths<'_>| {},
        after: |sample: &mut Sample| match (sample.pixel, sample.sample) {
            (5, 3) => sample.radiance[1] = f32::NAN,
            (600, 0) => sample.radiance[0] = f32::INFINITY,
            (1199, 15) => sample.radiance[2] = -1.0,
            // Brighter than sums of 64 bits take.
            (77, n) => sample.radiance = [5000.25 + n as f32; 3],
            (78, _) => sample.radiance = [1e9; 3],
            _ => {}
        },
    };
    let expected = plain_film(&altered(), WHOLE, |_| 16);
    assert_eq!(expected.mean(77)[0], 5007.75);
    for (workers, sends_samples) in [(1, false), (1, true), (4, false), (4, true)] {
        let wiring = Wiring { workers, sends_samples, ..Wiring::default() };
        let Rendered { outcome, .. } = wiring.render(&altered());
        assert!(outcome.film == expected && outcome.whole);
        assert_eq!((outcome.totals.rejected, outcome.totals.samples), (3, 16 * 1200));
        let mut rejects = outcome.rejects;
        rejects.sort_by_key(|(traced, _)| traced.pixel);
        let named = |pixel, sample, reject| (Traced { pixel, sample }, reject);
        assert_eq!(
            rejects,
            [
                named(5, 3, Reject::NotANumber),
                named(600, 0, Reject::TooBright),
                named(1199, 15, Reject::Negative)
            ]
        );
    }
}

fn lone_worker(integrator: &dyn Integrator) -> Worker<'_> {
    Worker { index: 0, integrator, level: level(), region: WHOLE, sends_samples: false, held: None }
}

#[test]
fn closing_the_batches_stops_a_worker_that_has_more_to_do() {
    let integrator = common::integrator(&scene());
    let (orders_out, orders) = bounded(100);
    for first in 0..100 {
        orders_out.send(Order { stride: Stride::ALL, first: first * 256, end: first * 256 + 256 }).unwrap();
    }
    let (batches_out, batches) = bounded::<SampleBatch>(1);
    std::thread::scope(|scope| {
        let running = scope.spawn(|| lone_worker(&*integrator).run(&orders, &batches_out));
        let first = batches.recv().unwrap();
        assert!(first.paths > 0);
        drop(batches);
        running.join().unwrap();
    });
    // Most orders are still there: it did not carry them out for nobody.
    assert!(orders.len() > 50, "{} left", orders.len());
}

#[test]
fn closing_the_orders_ends_a_worker_after_the_last_of_them() {
    let integrator = common::integrator(&scene());
    let (orders_out, orders) = bounded(2);
    let (batches_out, batches) = bounded::<SampleBatch>(100);
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 1 }).unwrap();
    orders_out.send(Order { stride: Stride::ALL, first: 1, end: 3 }).unwrap();
    drop(orders_out);
    lone_worker(&*integrator).run(&orders, &batches_out);
    drop(batches_out);
    let all: Vec<SampleBatch> = batches.iter().collect();
    assert_eq!(all.iter().map(|b| b.paths).sum::<u64>(), 3 * 1200);
    assert_eq!(all.iter().filter_map(|b| b.completes).collect::<Vec<_>>(), [1, 3]);
}

#[test]
fn a_worker_sends_at_least_every_tenth_of_a_second() {
    // Each block takes 15 ms: batches must come long before the order of many blocks is done.
    let integrator = hooked(|_| std::thread::sleep(Duration::from_millis(15)));
    let (orders_out, orders) = bounded(1);
    let (batches_out, batches) = bounded::<SampleBatch>(1000);
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 256 }).unwrap();
    drop(orders_out);
    lone_worker(&integrator).run(&orders, &batches_out);
    drop(batches_out);
    // 1200 pixels · 256 samples are 75 blocks, at most six of which fit into 100 ms.
    assert!(batches.len() >= 75 / 6, "only {} batches", batches.len());
}

#[test]
fn schedules_pass_every_stop_without_gap_or_overlap() {
    let stream = &mut Stream::new(9, 0, 0);
    for _ in 0..500 {
        let workers = stream.random_range(1..6_usize);
        let pixels = stream.random_range(1..3000_u32);
        let target = stream.random_range(1..5000_u32);
        let stops: Vec<u32> = (0..stream.random_range(0..6)).map(|_| stream.random_range(1..5000)).collect();
        let mut schedule = Schedule::new(workers, pixels, target, None, stops.clone());
        let mut given: Vec<Vec<Order>> = vec![Vec::new(); schedule.shares()];
        // What each worker has to do still, and those that have not been told to go.
        let mut under_way: Vec<VecDeque<Order>> = vec![VecDeque::new(); workers];
        let mut open: Vec<usize> = (0..workers).collect();
        // Workers ask and complete in any order, at any pace.
        while !open.is_empty() || under_way.iter().any(|orders| !orders.is_empty()) {
            let worker = stream.random_range(0..workers);
            let micros = 10_f64.powf(stream.random_range(-1.0..6.0));
            let pace = stream.random_bool(0.9).then(|| Duration::from_secs_f64(micros * 1e-6));
            if under_way[worker].len() < 2 && open.contains(&worker) {
                match schedule.next(worker, pace) {
                    Deal::Order(order) => {
                        let with_another =
                            |w: usize| w != worker && under_way[w].iter().any(|o| o.stride == order.stride);
                        assert!(!(0..workers).any(with_another), "two workers have one share");
                        given[order.stride.first as usize].push(order);
                        under_way[worker].push_back(order);
                    }
                    Deal::Later => assert!(under_way.iter().any(|orders| !orders.is_empty()), "all wait"),
                    Deal::Done => open.retain(|&w| w != worker),
                }
            }
            if stream.random_bool(0.5)
                && let Some(order) = under_way[worker].pop_front()
            {
                schedule.complete(order.stride, order.end);
            }
        }
        assert_eq!(schedule.completed(), target);
        let ranges = |orders: &[Order]| orders.iter().map(|o| (o.first, o.end)).collect::<Vec<_>>();
        for (share, orders) in (0..).zip(&given) {
            assert_eq!(ranges(orders), ranges(&given[0]), "all shares pass the same barriers");
            let stride = Stride::every(given.len() as u32, share);
            let mut at = 0;
            for order in orders {
                assert_eq!((order.stride, order.first), (stride, at));
                assert!(order.end > at && order.end - at <= stride::film::sums::MAX_COUNT);
                at = order.end;
            }
            assert_eq!(at, target);
            for stop in stops.iter().filter(|&&stop| stop <= target) {
                assert!(orders.iter().any(|order| order.end == *stop), "{stop} is passed over");
            }
        }
    }
}
