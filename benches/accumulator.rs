//! Measures the samples per second that the accumulator takes, and those that sixteen workers would send.
//!
//! ```sh
//! cargo bench --bench accumulator
//! ```
//!
//! First a worker carries out an order for each share of sixteen workers, and its messages are recorded. Then the
//! accumulator runs as in a render, and each of its orders is answered with the recorded messages of that share. Its speed
//! is the number of samples divided by the processor time of its thread, which contains neither waiting nor the work of
//! other programs. The speed of the worker is measured with the same clock.
//!
//! Orders are measured in two lengths: half a second of work for all sixteen workers, as in a long render, and one sample
//! per pixel, as in the first orders. The exit code is 1 if the accumulator would be the limit with long orders.

use crossbeam_channel::{bounded, never, unbounded};
use std::collections::HashMap;
use std::process::ExitCode;
use std::sync::Arc;
use stride::film::{Film, LayerSet, Layout, Splatter, Weights, film_offset};
use stride::integrator::{self, Integrator};
use stride::math::lanes::Level;
use stride::render::accumulator::{Inbox, Outbox};
use stride::render::worker::Worker;
use stride::render::{Accumulator, Configuration, Dispatch, Order, Port, SampleBatch, Schedule};
use stride::sampling::Region;
use stride::scene::{self, FilmMode, Filter, Scene};
use stride::world::{self, AcceleratorChoice, World};

const WORKERS: usize = 16;

/// The time in seconds that the longest orders take all workers: see `src/render/schedule.rs`.
const BARRIER: f64 = 0.5;

/// The maximum number of samples in an order: see there.
const LONGEST: u32 = 256;

/// The minimum number of samples that the accumulator gets in all.
const SAMPLES: u64 = 200_000_000;

/// The maximum number of samples in recorded messages that contain each sample, of 28 bytes.
const MOST_DUMPED: u32 = 8_000_000;

/// The processor time of this thread in seconds.
fn computed() -> f64 {
    let text =
        std::fs::read_to_string("/proc/thread-self/schedstat").expect("a Linux that counts threads' time");
    let nanoseconds: u64 = text.split_whitespace().next().and_then(|word| word.parse().ok()).expect("a time");
    nanoseconds as f64 * 1e-9
}

/// A scene and the kind of messages.
struct Case {
    region: Region,
    integrator: Box<dyn Integrator>,
    splatter: Option<Arc<Splatter>>,
    dumps: bool,
}

impl Case {
    fn new(mut scene: Scene, integrator: scene::Integrator, size: [u32; 2], film: Kind) -> Case {
        [scene.film.width, scene.film.height] = size;
        scene.render.integrator = integrator;
        (scene.film.filter, scene.film.mode) = match film {
            Kind::Sums | Kind::Dumped => (Filter::Tent { radius: 1.0 }, Some(FilmMode::Importance)),
            Kind::Bands => {
                (Filter::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0 }, Some(FilmMode::Continuous))
            }
        };
        let (compiled, surfaces) =
            world::compile(&scene, size[0], size[1]).expect("a scene that can be numbered");
        let world = Arc::new(World::new(&surfaces, AcceleratorChoice::default()));
        let offset = film_offset(&scene.film);
        Case {
            region: Region::whole(size[0], size[1]),
            integrator: integrator::build(&scene.render, offset, Arc::new(compiled), world),
            splatter: Weights::of(&scene.film).map(|weights| Arc::new(Splatter::new(weights, [0, 0]))),
            dumps: matches!(film, Kind::Dumped),
        }
    }

    fn schedule(&self) -> Schedule {
        let schedule = Schedule::new(WORKERS, self.region.len(), u32::MAX, None, Vec::new());
        match self.splatter {
            Some(_) => schedule.in_stripes(self.region.len(), self.region.width),
            None => schedule,
        }
    }

    /// The messages of an order of `samples` for each share, by the first index of the share; and the samples per
    /// second of a worker.
    fn messages(&self, samples: u32, shares: Option<usize>) -> (HashMap<u32, Vec<SampleBatch>>, f64) {
        let mut schedule = self.schedule();
        let all = schedule.shares() / WORKERS;
        let firsts = (0..WORKERS).flat_map(|worker| (0..all).map(move |_| worker));
        let orders =
            firsts.take(shares.unwrap_or(usize::MAX)).map(|worker| match schedule.next(worker, None) {
                Dispatch::Order(Order { stride, .. }) => Order { stride, first: 0, end: samples },
                deal => unreachable!("a share without an order: {deal:?}"),
            });
        let (orders_out, orders_in) = unbounded();
        orders.for_each(|order| orders_out.send(order.into()).expect("an open channel"));
        drop(orders_out);
        let (batches_out, batches) = unbounded();
        let worker = Worker {
            index: 0,
            integrator: &*self.integrator,
            level: Level::available()[0],
            region: self.region,
            sends_samples: self.dumps,
            splatter: self.splatter.as_deref(),
            layers: LayerSet::NONE,
        };
        let start = computed();
        worker.run(&orders_in, &batches_out);
        let seconds = computed() - start;
        drop(batches_out);
        let (mut kept, mut paths) = (HashMap::<u32, Vec<SampleBatch>>::new(), 0);
        for batch in batches {
            paths += batch.paths;
            kept.entry(batch.stride.first).or_default().push(batch);
        }
        (kept, paths as f64 / seconds)
    }

    /// The samples per second that the accumulator takes with these messages.
    fn taken(&self, messages: &HashMap<u32, Vec<SampleBatch>>) -> f64 {
        let Region { width, height, .. } = self.region;
        let layout = Layout { weighted: self.splatter.is_some(), ..Layout::plain(width, height) };
        let film = Film::with_layout(layout).expect("memory");
        let (orders_out, orders): (Vec<_>, Vec<_>) = (0..WORKERS).map(|_| bounded(2)).unzip();
        let (samples_out, samples) = bounded(4);
        let accumulator = Accumulator::new(Configuration {
            splatter: self.splatter.clone(),
            outbox: Outbox { samples: self.dumps.then_some(samples_out), ..Outbox::default() },
            ..Configuration::new(
                film,
                self.region,
                self.schedule(),
                orders_out.into_iter().map(Port::new).collect(),
            )
        });
        let (batches_out, batches) = bounded(2 * WORKERS);
        let (_changes_out, changes) = bounded(1);
        let (stop_out, stop) = bounded(0);
        std::thread::scope(|scope| {
            let accumulator = scope.spawn(move || {
                let start = computed();
                let outcome = accumulator.run(Inbox { batches, changes, stop, viewer: never() });
                (outcome.totals.samples, computed() - start)
            });
            scope.spawn(move || samples.iter().for_each(drop));
            let mut sent = 0;
            for worker in (0..WORKERS).cycle() {
                if sent >= SAMPLES {
                    break;
                }
                let order = orders[worker].recv().expect("orders without end").order;
                for batch in &messages[&order.stride.first] {
                    let completes = batch.completes.map(|_| order.end);
                    sent += batch.paths;
                    batches_out
                        .send(SampleBatch { worker, completes, ..batch.clone() })
                        .expect("an accumulator");
                }
            }
            drop((stop_out, batches_out));
            let (samples, seconds) = accumulator.join().expect("an outcome");
            samples as f64 / seconds
        })
    }
}

/// The kind of messages that workers send.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Sums over strides: an importance film.
    Sums,
    /// Sums over bands of rows: a continuous film, `mitchell`.
    Bands,
    /// Sums, and each sample, as for `--samples`.
    Dumped,
}

fn main() -> ExitCode {
    println!("{WORKERS} workers' messages, in millions of samples a second\n");
    println!(
        "{:<18} {:<9} {:<7} {:>11} {:>9} {:>12} {:>9} {:>5}",
        "scene", "size", "sent", "spp a time", "a worker", "all workers", "taken", "busy"
    );
    let mut saturated = false;
    for (name, integrator) in [("cover", scene::Integrator::PathNaive), ("room", scene::Integrator::Path)] {
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        for size in [[640, 480], [1920, 1080]] {
            for kind in [Kind::Sums, Kind::Bands, Kind::Dumped] {
                let scene = scene::load(path.as_ref()).expect("a scene").scene;
                let case = Case::new(scene, integrator, size, kind);
                let (_, rate) = case.messages(4, Some(4));
                let pixels = case.region.len();
                let most = if case.dumps { MOST_DUMPED / pixels } else { LONGEST };
                let long = BARRIER * WORKERS as f64 * rate / f64::from(pixels);
                for (samples, counts) in [(1, false), ((long as u32).clamp(1, most), true)] {
                    let (messages, rate) = case.messages(samples, None);
                    let taken = case.taken(&messages);
                    let all = rate * WORKERS as f64;
                    saturated |= counts && all >= taken;
                    println!(
                        "{:<18} {:<9} {:<7} {samples:>11} {:>9.1} {:>12.0} {:>9.0} {:>4.0}%",
                        format!("{name}, {integrator}"),
                        format!("{}×{}", size[0], size[1]),
                        format!("{kind:?}").to_lowercase(),
                        rate / 1e6,
                        all / 1e6,
                        taken / 1e6,
                        100.0 * all / taken
                    );
                }
            }
        }
    }
    ExitCode::from(u8::from(saturated))
}
