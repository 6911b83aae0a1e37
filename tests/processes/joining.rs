//! Workers that join late, leave early, or fail in the middle of an order, also with all their messages serialised as
//! text.

use super::*;
use std::cell::Cell;
use std::thread::Scope;

/// The end of a worker, and its time: counted in the blocks that it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Stays,
    Leaves(u32),
    Fails(u32),
}

/// A worker of a test.
#[derive(Clone, Copy, Debug)]
struct Role {
    fate: Fate,
    /// The number of blocks, begun by all workers, after which it joins; zero for an initial worker.
    joins_after: Option<u32>,
}

const SPP: u32 = 30;

/// From this sample on the workers that stay wait for the others to join, to leave and to fail.
const WAITS_FROM: u32 = 10;

/// The number of workers, of which the first stays.
fn roles(workers: u32, variant: u32) -> Vec<Role> {
    let role = |index: u32| match index {
        0 => Role { fate: Fate::Stays, joins_after: None },
        _ => Role {
            fate: [Fate::Fails(3), Fate::Leaves(4), Fate::Stays][((index + variant) % 3) as usize],
            joins_after: (index + variant).is_multiple_of(2).then_some(3 * index),
        },
    };
    (0..workers).map(role).collect()
}

/// Forwards all messages, serialised as text.
fn relay<T: serde::Serialize + serde::de::DeserializeOwned>(from: &Receiver<T>, to: &Sender<T>) {
    for message in from {
        let text = serde_json::to_string(&message).unwrap();
        if to.send(serde_json::from_str(&text).unwrap()).is_err() {
            return;
        }
    }
}

/// The common state of all workers of a render.
struct Stage<'a> {
    integrator: &'a dyn Integrator,
    roles: &'a [Role],
    stops: &'a [(Sender<()>, Receiver<()>)],
    sends_samples: bool,
    is_text: bool,
}

impl Stage<'_> {
    /// Starts a worker. Workers that will not stay send each block separately.
    fn start<'scope>(
        &'scope self,
        scope: &'scope Scope<'scope, '_>,
        index: usize,
        batches: &Sender<SampleBatch>,
        changes: &Sender<Change>,
    ) -> Port {
        let (orders_out, mut orders) = bounded(2);
        let (mut batches, changes) = (batches.clone(), changes.clone());
        if self.is_text {
            let (read_out, read) = bounded(1);
            let unread = std::mem::replace(&mut orders, read);
            scope.spawn(move || relay(&unread, &read_out));
            let (said, heard) = bounded(1);
            let out = std::mem::replace(&mut batches, said);
            scope.spawn(move || relay(&heard, &out));
        }
        let worker = Worker {
            index,
            integrator: self.integrator,
            level: level(),
            region: WHOLE,
            sends_samples: self.sends_samples,
            splatter: None,
            layers: layers(),
        };
        let fate = self.roles[index].fate;
        let (stop, stays) = (&self.stops[index].1, fate == Fate::Stays);
        let work = move || {
            let (start, looks) = (Instant::now(), Cell::new(0));
            let slow = || {
                looks.set(looks.get() + 1);
                start + Duration::from_millis(51) * looks.get()
            };
            let clock: &dyn Fn() -> Instant = if stays { &Instant::now } else { &slow };
            let run = std::panic::AssertUnwindSafe(|| worker.run_by(clock, &orders, stop, &batches));
            let change = match std::panic::catch_unwind(run) {
                Err(_) => {
                    let (worker, message) = (format!("worker {index}"), "it was to".to_owned());
                    Change::Fails(WorkerFailure { index, worker, message })
                }
                Ok(()) if !stop.is_empty() => Change::Leaves(index),
                Ok(()) => return,
            };
            let _ = changes.send(change);
        };
        std::thread::Builder::new().name(format!("worker {index}")).spawn_scoped(scope, work).unwrap();
        // Any worker may leave; only those that are configured to may fail.
        Port { may_be_lost: matches!(fate, Fate::Fails(_)), ..Port::new(orders_out) }
    }
}

/// Renders with such workers. Returns the outcome, the pictures at barriers, and the samples that the sink received.
fn render(roles: &[Role], sends_samples: bool, is_text: bool) -> (Outcome, Vec<Barrier>, Vec<(u32, u32)>) {
    let stops: Vec<_> = roles.iter().map(|_| bounded(1)).collect();
    let begun: Vec<AtomicU32> = roles.iter().map(|_| AtomicU32::new(0)).collect();
    let all_begun = AtomicU32::new(0);
    let (blocks_out, blocks) = unbounded();
    // It closes when all workers have joined, left and failed as configured.
    let (done_out, done) = bounded::<Infallible>(0);
    let missing = roles.iter().filter(|role| role.fate != Fate::Stays || role.joins_after.is_some()).count();
    let waiting = Mutex::new((missing, (missing > 0).then_some(done_out)));
    // A worker with all of the work would wait for one that cannot get a part of it before it is done.
    let waits = roles.iter().filter(|role| role.joins_after.is_none()).count() > 1;
    let is_done = || {
        let mut waiting = waiting.lock().unwrap();
        waiting.0 -= 1;
        if waiting.0 == 0 {
            waiting.1 = None;
        }
    };
    let integrator = hooked(|paths| {
        let worker = this_worker();
        let mine = begun[worker].fetch_add(1, Ordering::Relaxed) + 1;
        let _ = blocks_out.send(all_begun.fetch_add(1, Ordering::Relaxed) + 1);
        match roles[worker] {
            Role { fate: Fate::Fails(at), .. } if mine == at => {
                is_done();
                panic!("as configured");
            }
            Role { fate: Fate::Leaves(at), .. } if mine == at => {
                is_done();
                stops[worker].0.send(()).unwrap();
            }
            Role { fate: Fate::Stays, joins_after } => {
                if joins_after.is_some() && mine == 1 {
                    is_done();
                }
                if waits && paths.first_sample >= WAITS_FROM {
                    assert_eq!(done.recv_timeout(TIMEOUT), Err(RecvTimeoutError::Disconnected));
                }
            }
            _ => {}
        }
    });
    let stage = Stage { integrator: &integrator, roles, stops: &stops, sends_samples, is_text };
    let there: Vec<usize> = (0..roles.len()).filter(|&index| roles[index].joins_after.is_none()).collect();
    std::thread::scope(|scope| {
        let (stage, blocks) = (&stage, &blocks);
        let (batches_out, batches) = bounded(2 * roles.len());
        let (changes_out, changes) = bounded(2 * roles.len());
        let (barriers_out, barriers) = bounded(2);
        let (samples_out, samples) = bounded::<Vec<Sample>>(1);
        let sink = scope.spawn(move || samples.iter().flatten().map(|s| (s.pixel, s.sample)).collect());
        let start = |index| stage.start(scope, index, &batches_out, &changes_out);
        // Numbers are assigned in the order of joining: initial workers have the first ones.
        let ports = there.iter().map(|&index| start(index)).collect();
        let schedule = Schedule::new(there.len(), WHOLE.len(), SPP, None, vec![7, 20]);
        let film = empty_film(WHOLE);
        let accumulator = Accumulator::new(Configuration {
            barriers: vec![7, 20],
            outbox: Outbox { barriers: Some(barriers_out), samples: Some(samples_out), ..Outbox::default() },
            ..Configuration::new(film, WHOLE, schedule, ports)
        });
        let joining = scope.spawn(move || {
            for index in there.len()..roles.len() {
                let after = roles[index].joins_after.unwrap();
                assert!(blocks.iter().any(|begun| begun >= after));
                let port = stage.start(scope, index, &batches_out, &changes_out);
                let speed = [0.5, 1.0, 3.0][index % 3];
                // The render may have ended.
                let _ = changes_out.send(Change::Joins { worker: index, port, speed });
            }
        });
        let outcome = accumulator.run(Inbox { batches, changes, stop: never(), viewer: never() });
        joining.join().unwrap();
        (outcome, barriers.try_iter().collect(), sink.join().unwrap())
    })
}

#[test]
fn workers_that_join_leave_and_fail_make_the_same_film() {
    let expected = plain_film(&*common::integrator(&scene()), WHOLE, |_| SPP);
    for (workers, variant) in (1..8).flat_map(|workers| (0..3).map(move |variant| (workers, variant))) {
        let mut roles = roles(workers, variant);
        roles.sort_by_key(|role| role.joins_after);
        let (sends_samples, is_text) = (variant == 1, variant == 2);
        let (outcome, barriers, mut samples) = render(&roles, sends_samples, is_text);
        assert!(outcome.failure.is_none() && outcome.whole, "{roles:?}");
        assert!(outcome.film == expected, "{roles:?}");
        assert_eq!((outcome.totals.samples, outcome.totals.spp), (1200 * u64::from(SPP), SPP));
        assert_eq!(outcome.made.iter().sum::<u64>(), 1200 * u64::from(SPP));
        let mut lost: Vec<usize> = outcome.lost.iter().map(|failure| failure.index).collect();
        lost.sort_unstable();
        let fails = |&index: &usize| matches!(roles[index].fate, Fate::Fails(_));
        assert_eq!(lost, (0..roles.len()).filter(fails).collect::<Vec<_>>());
        assert_eq!(barriers.len(), 2);
        for barrier in barriers {
            assert!(barrier.picture == plain_picture(barrier.end), "at {}: {roles:?}", barrier.end);
        }
        if sends_samples {
            samples.sort_unstable();
            let all = samples.len();
            samples.dedup();
            assert_eq!((samples.len(), all), (1200 * SPP as usize, 1200 * SPP as usize), "each sample once");
        }
    }
}

#[test]
fn the_last_worker_is_indispensable() {
    let roles = [Role { fate: Fate::Fails(2), joins_after: None }];
    let (outcome, ..) = render(&roles, false, false);
    assert_eq!(outcome.failure.as_ref().map(|failure| failure.index), Some(0));
    assert!(outcome.lost.is_empty() && !outcome.whole);
    is_a_prefix(&outcome);
}

#[test]
fn a_render_fails_when_its_last_worker_leaves() {
    let roles = [Role { fate: Fate::Leaves(2), joins_after: None }];
    let (outcome, ..) = render(&roles, false, false);
    let failure = outcome.failure.as_ref().expect("a failure");
    assert_eq!(failure.index, 0);
    assert!(failure.message.contains("it left before the end of the render"), "{failure}");
    assert!(outcome.lost.is_empty() && !outcome.whole);
    is_a_prefix(&outcome);
}

/// Workers that act only on request of the test, with the ends of their channels.
struct Puppet {
    orders: Receiver<Assignment>,
    stop: Receiver<()>,
    batches: Sender<SampleBatch>,
}

impl Puppet {
    fn carry_out(&self, index: usize, order: Order) {
        let (out, orders) = bounded(1);
        out.send(order.into()).unwrap();
        drop(out);
        let integrator = common::integrator(&scene());
        let (level, region, layers) = (level(), WHOLE, layers());
        let integrator = &*integrator;
        let worker =
            Worker { index, integrator, level, region, sends_samples: false, splatter: None, layers };
        worker.run(&orders, &self.batches);
    }
}

/// An accumulator of this number of such workers that waits for orders of one sample.
fn puppets(count: usize) -> (Configuration, Receiver<SampleBatch>, Vec<Puppet>) {
    let (batches_out, batches) = bounded(100);
    let (mut ports, mut puppets) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let ((orders_out, orders), (stop_out, stop)) = (bounded(2), bounded(1));
        let stop_out = Some(stop_out);
        ports.push(Port { stop: stop_out, time_limit: TIMEOUT, ..Port::new(orders_out) });
        puppets.push(Puppet { orders, stop, batches: batches_out.clone() });
    }
    let schedule = Schedule::new(count, WHOLE.len(), 1, None, Vec::new());
    let film = empty_film(WHOLE);
    (Configuration::new(film, WHOLE, schedule, ports), batches, puppets)
}

#[test]
fn the_last_order_of_a_worker_that_leaves_goes_to_an_idle_one() {
    let (configuration, batches, mut all) = puppets(2);
    let (changes_out, changes) = bounded(1);
    let leaver = all.pop().unwrap();
    let stays = all.pop().unwrap();
    let outcome = std::thread::scope(|scope| {
        scope.spawn(move || {
            // It keeps its first orders, and leaves when the other has completed the rest.
            let mut held = vec![leaver.orders.recv().unwrap().order, leaver.orders.recv().unwrap().order];
            let mut left = WHOLE.len() - held.iter().map(|order| order.stride.len(WHOLE.len())).sum::<u32>();
            let mut changes_out = Some(changes_out);
            while let Ok(Assignment { order, .. }) = stays.orders.recv() {
                stays.carry_out(0, order);
                left = left.saturating_sub(order.stride.len(WHOLE.len()));
                if left == 0
                    && let Some(changes_out) = changes_out.take()
                {
                    changes_out.send(Change::Leaves(1)).unwrap();
                    held.clear();
                }
            }
            // It is asked to stop after it has left, and is not waited for.
            assert!(leaver.stop.recv_timeout(TIMEOUT).is_ok());
            drop(stays);
            drop(leaver);
        });
        Accumulator::new(configuration).run(Inbox { batches, changes, stop: never(), viewer: never() })
    });
    assert!(outcome.failure.is_none() && outcome.whole && outcome.unanswered.is_empty());
    assert!(outcome.film == plain_film(&*common::integrator(&scene()), WHOLE, |_| 1));
}

#[test]
fn a_dispensable_worker_that_fails_while_stopping_is_no_failure() {
    for may_be_lost in [true, false] {
        let (mut configuration, batches, mut all) = puppets(2);
        configuration.workers[1].may_be_lost = may_be_lost;
        let (changes_out, changes) = bounded(2);
        let (stop_out, stop) = bounded(0);
        let fails = all.pop().unwrap();
        let other = all.pop().unwrap();
        drop(stop_out);
        let outcome = std::thread::scope(|scope| {
            scope.spawn(move || {
                let Puppet { orders, stop, batches } = fails;
                stop.recv_timeout(TIMEOUT).unwrap();
                let (worker, message) = ("the device".to_owned(), "it is gone".to_owned());
                let failure = WorkerFailure { index: 1, worker, message };
                changes_out.send(Change::Fails(failure)).unwrap();
                drop((orders, stop, batches));
                drop(other);
            });
            Accumulator::new(configuration).run(Inbox { batches, changes, stop, viewer: never() })
        });
        assert_eq!((outcome.failure.is_none(), outcome.lost.len()), (may_be_lost, may_be_lost.into()));
    }
}

#[test]
fn batches_of_absent_workers_are_ignored() {
    let (orders_out, orders) = bounded(2);
    let (batches_out, batches) = bounded(4);
    let schedule = Schedule::new(1, WHOLE.len(), 1, None, Vec::new());
    let film = empty_film(WHOLE);
    let configuration = Configuration::new(film, WHOLE, schedule, vec![Port::new(orders_out)]);
    let integrator = common::integrator(&scene());
    let worker = |index| Worker {
        index,
        integrator: &*integrator,
        level: level(),
        region: WHOLE,
        sends_samples: false,
        splatter: None,
        layers: layers(),
    };
    let outcome = std::thread::scope(|scope| {
        let stranger = batches_out.clone();
        scope.spawn(move || {
            let (out, orders) = bounded(1);
            out.send(Order { stride: Stride::ALL, first: 0, end: 1 }.into()).unwrap();
            drop(out);
            worker(7).run(&orders, &stranger);
        });
        scope.spawn(move || worker(0).run(&orders, &batches_out));
        Accumulator::new(configuration).run(Inbox {
            batches,
            changes: never(),
            stop: never(),
            viewer: never(),
        })
    });
    assert!(outcome.film == plain_film(&*common::integrator(&scene()), WHOLE, |_| 1));
    assert_eq!(outcome.made, [1200]);
}
