//! Workers that are asked to stop: they stop at once, or are abandoned.

use super::*;
use crossbeam_channel::never;
use std::cell::Cell;

/// The time limit of workers before they are abandoned. A responsive worker stops within microseconds.
const TIMEOUT: Duration = Duration::from_secs(3);

/// Runs an accumulator with the batches of some workers that asks them to stop; and their orders.
struct Wired {
    configuration: Configuration,
    inbox: Inbox,
    stop: Sender<Infallible>,
    mailboxes: Vec<(Receiver<Assignment>, Receiver<()>, Sender<SampleBatch>)>,
}

fn wired(workers: usize, spp: u32) -> Wired {
    let (batches_out, batches) = bounded(2 * workers);
    let (stop_out, stop) = bounded(0);
    let (mut ports, mut mailboxes) = (Vec::new(), Vec::new());
    for _ in 0..workers {
        let (orders_out, orders_in) = bounded(2);
        let (stops_out, stops_in) = bounded(1);
        ports.push(Port { stop: Some(stops_out), time_limit: TIMEOUT, ..Port::new(orders_out) });
        mailboxes.push((orders_in, stops_in, batches_out.clone()));
    }
    let schedule = Schedule::new(workers, WHOLE.len(), spp, None, Vec::new());
    let film = empty_film(WHOLE);
    let configuration = Configuration::new(film, WHOLE, schedule, ports);
    let inbox = Inbox { batches, changes: never(), stop, viewer: never() };
    Wired { configuration, inbox, stop: stop_out, mailboxes }
}

fn worker(index: usize, integrator: &dyn Integrator) -> Worker<'_> {
    Worker {
        index,
        integrator,
        level: level(),
        region: WHOLE,
        sends_samples: false,
        splatter: None,
        layers: layers(),
    }
}

#[test]
fn an_unresponsive_worker_is_abandoned_and_its_order_reported() {
    let integrator = common::integrator(&scene());
    let Wired { configuration, inbox, stop, mut mailboxes } = wired(2, 1_000_000);
    let (silent_orders, silent_stop, silent_batches) = mailboxes.pop().unwrap();
    let (orders, stops, batches) = mailboxes.pop().unwrap();
    let (held_out, held) = bounded(1);
    let (release, released) = bounded::<Infallible>(0);
    let (outcome, order) = std::thread::scope(|scope| {
        let integrator = &*integrator;
        scope.spawn(move || worker(0, integrator).run_until(&orders, &stops, &batches));
        scope.spawn(move || {
            let Assignment { order, .. } = silent_orders.recv().unwrap();
            held_out.send(order).unwrap();
            // It ignores all requests until the test ends.
            let _ = released.recv();
            drop((silent_orders, silent_stop, silent_batches));
        });
        let run = scope.spawn(move || Accumulator::new(configuration).run(inbox));
        let order = held.recv().unwrap();
        drop(stop);
        let outcome = run.join().unwrap();
        drop(release);
        (outcome, order)
    });
    let slots = order.stride.len(WHOLE.len());
    assert_eq!(
        outcome.unanswered,
        [Unanswered { worker: 1, within: TIMEOUT, order: Some((order, 0..slots)) }]
    );
    // The other worker may have been asked to stop before it had traced anything.
    assert!(
        outcome.failure.is_none() && (!outcome.whole || outcome.totals.samples == 0) && !outcome.overtime
    );
    is_a_prefix(&outcome);
}

#[test]
fn only_a_worker_with_a_longer_time_limit_is_waited_for() {
    let Wired { mut configuration, inbox, stop, mut mailboxes } = wired(2, 1_000_000);
    configuration.workers[0].time_limit = Duration::ZERO;
    let (slow_orders, slow_stop, slow_batches) = mailboxes.pop().unwrap();
    let (silent_orders, silent_stop, silent_batches) = mailboxes.pop().unwrap();
    let (release, released) = bounded::<Infallible>(0);
    drop(stop);
    let outcome = std::thread::scope(|scope| {
        scope.spawn(move || {
            let _ = released.recv();
            drop((silent_orders, silent_stop, silent_batches));
        });
        scope.spawn(move || {
            // It ends when there are no more orders, which is after the time limit of the other worker.
            slow_orders.iter().for_each(|_: Assignment| {});
            drop((slow_stop, slow_batches));
        });
        let outcome = Accumulator::new(configuration).run(inbox);
        drop(release);
        outcome
    });
    let silent: Vec<_> = outcome.unanswered.iter().map(|it| (it.worker, it.within)).collect();
    assert_eq!(silent, [(0, Duration::ZERO)]);
}

#[test]
fn responsive_workers_are_not_abandoned_and_their_samples_count() {
    let integrator = common::integrator(&scene());
    for workers in 1..5 {
        let Wired { configuration, inbox, stop, mailboxes } = wired(workers, 1_000_000);
        let (begun_out, begun) = bounded(1);
        let sent = std::sync::atomic::AtomicU32::new(0);
        let outcome = std::thread::scope(|scope| {
            for (index, (orders, stops, batches)) in mailboxes.into_iter().enumerate() {
                let (integrator, begun_out, sent) = (&*integrator, begun_out.clone(), &sent);
                scope.spawn(move || {
                    let hooked = Hooked {
                        inner: integrator.seen_by(Camera::new(&scene().camera, WIDTH, HEIGHT)),
                        before: |_: &Paths<'_>| {
                            // It is reported once.
                            let _ = begun_out.try_send(());
                        },
                        after: |_: &mut Sample| {
                            sent.fetch_add(1, Ordering::Relaxed);
                        },
                    };
                    worker(index, &hooked).run_until(&orders, &stops, &batches);
                });
            }
            let run = scope.spawn(move || Accumulator::new(configuration).run(inbox));
            begun.recv().unwrap();
            drop(stop);
            run.join().unwrap()
        });
        assert_eq!(outcome.unanswered, []);
        is_a_prefix(&outcome);
        // Every completed path of a block is in the film.
        assert_eq!(outcome.totals.samples, u64::from(sent.into_inner()), "{workers} workers");
    }
}

#[test]
fn a_time_limit_may_end_a_render_before_its_first_whole_sample() {
    let Wired { configuration, inbox, stop, mut mailboxes } = wired(1, 1_000_000);
    let (orders, stops, batches) = mailboxes.pop().unwrap();
    let outcome = std::thread::scope(|scope| {
        // It takes an order, and waits until it is asked to stop.
        scope.spawn(move || {
            let _ = (orders.recv(), stops.recv());
            drop(batches);
        });
        Accumulator::new(Configuration { overtime: Some(Instant::now()), ..configuration }).run(inbox)
    });
    assert!(outcome.overtime && outcome.unanswered.is_empty());
    assert_eq!(outcome.totals.samples, 0);
    drop(stop);
}

#[test]
fn paths_stop_at_the_next_bounce_on_request() {
    let pixels: Vec<_> = (0..WHOLE.len()).map(|place| WHOLE.pixel(place)).collect();
    for integrator in [
        stride::scene::Integrator::Path,
        stride::scene::Integrator::PathNaive,
        stride::scene::Integrator::Whitted,
    ] {
        let mut scene = scene();
        scene.render.integrator = integrator;
        let tracer = common::integrator(&scene);
        for level in Level::available() {
            let asked = Cell::new(0_u64);
            // The number of checks: at least one per bounce of the longest path.
            let paths = Paths { pixels: &pixels[..1], first_sample: 0, samples: 64 };
            let mut out = Found::default();
            let count = || {
                asked.set(asked.get() + 1);
                false
            };
            assert!(tracer.trace_until(level, &paths, &count, &mut out).is_some());
            let (all, mut longest) = (asked.get(), 0);
            for sample in 0..64 {
                let (_, events) = tracer.explain(pixels[0], sample);
                let bounces = events.iter().filter(|event| matches!(event, Event::Ray { .. })).count();
                longest = longest.max(bounces as u64);
            }
            assert!(all >= longest, "{integrator:?} at {level}: asks {all} times for {longest} bounces");
            // After a positive answer there is at most one more check.
            for after in [1, 2, all] {
                asked.set(0);
                let stop = || {
                    asked.set(asked.get() + 1);
                    asked.get() >= after
                };
                assert_eq!(tracer.trace_until(level, &paths, &stop, &mut out), None);
                assert!(asked.get() <= after + 1, "{integrator:?} at {level}");
            }
        }
    }
}
