//! One worker by itself, between its channels.

use super::*;

fn lone_worker(integrator: &dyn Integrator) -> Worker<'_> {
    let (level, region) = (level(), WHOLE);
    Worker { index: 0, integrator, level, region, sends_samples: false, splatter: None, held: None }
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
    // A block of 256 paths takes 15 ms, for which it is neither halved nor doubled: batches must come long before
    // the order is done.
    let integrator = hooked(|_| std::thread::sleep(Duration::from_millis(15)));
    let (orders_out, orders) = bounded(1);
    let (batches_out, batches) = bounded::<SampleBatch>(100);
    orders_out.send(Order { stride: Stride::ALL, first: 0, end: 8 }).unwrap();
    drop(orders_out);
    lone_worker(&integrator).run(&orders, &batches_out);
    drop(batches_out);
    // 1200 pixels · 8 samples are 38 blocks, at most six of which fit into 100 ms.
    assert!(batches.len() >= 38 / 6, "only {} batches", batches.len());
}
