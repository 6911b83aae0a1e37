//! Tests of schedules without workers.

use super::*;

/// All orders of one worker until it must wait, each completed at once.
fn orders(schedule: &mut Schedule, worker: usize, pace: Option<Duration>) -> Vec<Order> {
    std::iter::from_fn(|| match schedule.next(worker, pace) {
        Dispatch::Order(order) => {
            schedule.complete(order.stride, order.end);
            Some(order)
        }
        Dispatch::Later | Dispatch::Done => None,
    })
    .collect()
}

fn ranges(orders: &[Order]) -> Vec<(u32, u32)> {
    orders.iter().map(|o| (o.first, o.end)).collect()
}

#[test]
fn orders_double_and_pass_every_stop_up_to_the_target() {
    let mut schedule = Schedule::new(1, 100, 50, None, vec![30, 10]);
    let quick = Some(Duration::from_micros(1));
    let given = ranges(&orders(&mut schedule, 0, quick));
    assert_eq!(given, [(0, 1), (1, 2), (2, 4), (4, 8), (8, 10), (10, 20), (20, 30), (30, 50)]);
    assert_eq!((schedule.completed(), schedule.next(0, quick)), (50, Dispatch::Done));
}

#[test]
fn slow_scenes_get_one_sample_at_a_time_and_orders_are_bounded() {
    let mut slow = Schedule::new(1, 100, 5, None, vec![]);
    assert_eq!(orders(&mut slow, 0, Some(Duration::from_secs(9))).len(), 5);
    let mut fast = Schedule::new(1, 100, 100_000, None, vec![]);
    let longest = orders(&mut fast, 0, Some(Duration::ZERO)).iter().map(|o| o.end - o.first).max();
    assert_eq!(longest, Some(LONGEST_ORDER));
}

#[test]
fn a_schedule_may_begin_anywhere() {
    let quick = Some(Duration::from_micros(1));
    let mut schedule = Schedule::new(1, 100, 50, None, vec![42, 3]).starting_at(40, 40);
    assert_eq!(schedule.completed(), 40);
    assert_eq!(ranges(&orders(&mut schedule, 0, quick)), [(40, 42), (42, 50)]);
    let mut finished = Schedule::new(1, 100, 50, None, vec![]).starting_at(50, 50);
    assert_eq!((finished.next(0, quick), finished.completed()), (Dispatch::Done, 50));
    let mut late = Schedule::new(1, 100, 50, Some(Instant::now()), vec![]).starting_at(7, 7);
    assert_eq!(ranges(&orders(&mut late, 0, None)), [(7, 8)]);
    // Some pixels have more samples: the render cannot end at fewer.
    let mut uneven = Schedule::new(1, 100, 50, Some(Instant::now()), vec![]).starting_at(7, 9);
    assert_eq!(ranges(&orders(&mut uneven, 0, None)), [(7, 8), (8, 9)]);
}

#[test]
fn no_worker_passes_a_gate_before_the_decision() {
    let quick = Some(Duration::from_micros(1));
    let mut schedule = Schedule::new(1, 10, 1000, None, vec![]);
    schedule.decide(None, Some(8));
    assert_eq!(orders(&mut schedule, 0, quick).last().map(|order| order.end), Some(8));
    assert_eq!((schedule.next(0, quick), schedule.waits_at()), (Dispatch::Later, Some(8)));
    schedule.decide(None, Some(16));
    let Dispatch::Order(order) = schedule.next(0, quick) else { panic!("no order") };
    assert_eq!((order.first, order.end), (8, 16));
    assert_eq!((schedule.next(0, quick), schedule.waits_at()), (Dispatch::Later, None));
    schedule.complete(order.stride, order.end);
    assert_eq!(schedule.waits_at(), Some(16));
    // The end comes before the next gate: no worker waits there.
    schedule.decide(Some(20), Some(32));
    assert_eq!((ranges(&orders(&mut schedule, 0, quick)), schedule.target()), (vec![(16, 20)], 20));
    assert_eq!((schedule.next(0, quick), schedule.waits_at()), (Dispatch::Done, None));
    // The end was reached before: the render ends at once.
    let mut schedule = Schedule::new(1, 10, 1000, None, vec![]);
    schedule.decide(None, Some(8));
    orders(&mut schedule, 0, quick);
    schedule.decide(Some(8), None);
    assert_eq!(schedule.next(0, quick), Dispatch::Done);
}

#[test]
fn a_deadline_in_the_past_still_gives_one_sample() {
    let mut schedule = Schedule::new(1, 100, 100, Some(Instant::now()), vec![]);
    assert_eq!(ranges(&orders(&mut schedule, 0, None)), [(0, 1)]);
}

#[test]
fn no_sample_is_started_that_would_end_long_after_the_deadline() {
    let deadline = Instant::now() + Duration::from_secs(1000);
    for (pace, samples) in [(2000, 1), (400, 50), (1, 50)] {
        let mut schedule = Schedule::new(1, 100, 50, Some(deadline), vec![]);
        let pace = Some(Duration::from_secs(pace));
        let given = ranges(&orders(&mut schedule, 0, pace));
        assert_eq!(given.last().map(|&(_, end)| end), Some(samples), "{given:?}");
        assert_eq!((schedule.next(0, pace), schedule.completed()), (Dispatch::Done, samples));
    }
}

#[test]
fn workers_end_together_if_another_sample_would_take_too_long() {
    let deadline = Instant::now() + Duration::from_secs(1000);
    let mut schedule = Schedule::new(2, 10, 50, Some(deadline), vec![]);
    let (quick, slow) = (Some(Duration::from_secs(1)), Some(Duration::from_secs(2000)));
    let Dispatch::Order(first) = schedule.next(0, None) else { panic!("no order") };
    let Dispatch::Order(second) = schedule.next(1, None) else { panic!("no order") };
    schedule.complete(first.stride, first.end);
    assert_eq!(schedule.next(0, slow), Dispatch::Done);
    schedule.complete(second.stride, second.end);
    // Even if the time would have sufficed in the end.
    assert_eq!((schedule.next(1, quick), schedule.next(0, quick)), (Dispatch::Done, Dispatch::Done));
    assert_eq!(schedule.completed(), 1);
}

#[test]
fn a_worker_takes_over_shares_of_workers_two_barriers_behind() {
    let mut schedule = Schedule::new(2, 10_000, 8, None, vec![]);
    assert_eq!(schedule.shares(), 16);
    let mut given = Vec::new();
    // Worker 1 is slow: it never completes its order.
    let Dispatch::Order(stuck) = schedule.next(1, None) else { panic!("no order for worker 1") };
    while let Dispatch::Order(order) = schedule.next(0, None) {
        schedule.complete(order.stride, order.end);
        given.push((order.stride.first % 2, order.end));
    }
    assert!(given[..16].iter().all(|&(owner, end)| owner == 0 && end <= 2), "{given:?}");
    assert_eq!(given[16], (1, 1), "a share of worker 1, which has passed no barrier");
    // Worker 0 does everything except for the one share, and can only wait for that.
    assert_eq!(given.len(), 15 * 8);
    assert_eq!((schedule.next(0, None), schedule.completed()), (Dispatch::Later, 0));
    schedule.complete(stuck.stride, stuck.end);
    let rest = orders(&mut schedule, 0, None);
    assert_eq!(ranges(&rest), (1..8).map(|i| (i, i + 1)).collect::<Vec<_>>());
    assert_eq!((schedule.next(0, None), schedule.next(1, None)), (Dispatch::Done, Dispatch::Done));
}

#[test]
fn one_worker_at_a_time_has_orders_for_a_share() {
    let mut schedule = Schedule::new(2, 10, 4, None, vec![]);
    assert_eq!(schedule.shares(), 2, "ten pixels are not divided further");
    let Dispatch::Order(first) = schedule.next(0, None) else { panic!("no order") };
    let Dispatch::Order(second) = schedule.next(0, None) else { panic!("no second order") };
    assert_eq!(
        (first.stride, second.first),
        (second.stride, first.end),
        "two orders for its own share, in sequence"
    );
    for order in orders(&mut schedule, 1, None) {
        assert_eq!(order.stride.first, 1);
    }
    assert_eq!(schedule.next(1, None), Dispatch::Later);
    schedule.complete(first.stride, first.end);
    assert_eq!(schedule.next(1, None), Dispatch::Later, "the second order is not completed");
    schedule.complete(second.stride, second.end);
    assert!(matches!(schedule.next(1, None), Dispatch::Order(order) if order.stride.first == 0));
}

/// Pixels that each worker owns.
fn owned(schedule: &Schedule, pixels: u32) -> BTreeMap<usize, u32> {
    let mut owned = BTreeMap::new();
    for share in &schedule.shares {
        *owned.entry(share.owner).or_default() += share.stride.len(pixels);
    }
    owned
}

#[test]
fn a_worker_that_joins_gets_shares_and_one_that_leaves_returns_them() {
    for (workers, run) in [(1, false), (2, false), (3, true)] {
        let pixels = 40 * 300;
        let mut schedule = Schedule::new(workers, pixels, 100, None, vec![]);
        if run {
            schedule = schedule.in_stripes(pixels, 40);
        }
        schedule.join(workers, 1.0);
        schedule.join(workers + 1, 2.0);
        let owned_now = owned(&schedule, pixels);
        assert_eq!(owned_now.values().sum::<u32>(), pixels);
        let part = f64::from(pixels) / (workers as f64 + 3.0);
        for (&worker, &owned) in &owned_now {
            let wanted = if worker == workers + 1 { 2.0 * part } else { part };
            assert!((f64::from(owned) - wanted).abs() < 0.4 * part, "{owned_now:?}, {part}");
        }
        schedule.lose(0);
        schedule.lose(workers);
        let owned = owned(&schedule, pixels);
        assert_eq!((owned.values().sum::<u32>(), owned.len()), (pixels, workers), "{owned:?}");
        // Each place is in exactly one share.
        let mut times = vec![0; pixels as usize];
        for share in &schedule.shares {
            let slots = 0..share.stride.len(pixels);
            slots.for_each(|slot| times[share.stride.place(slot) as usize] += 1);
        }
        assert!(times.iter().all(|&times| times == 1));
    }
}

#[test]
fn busy_shares_are_divided_when_their_orders_are_completed() {
    let mut schedule = Schedule::new(1, 10_000, 8, None, vec![]);
    let Dispatch::Order(first) = schedule.next(0, None) else { panic!("no order") };
    schedule.join(1, 1.0);
    assert_eq!((schedule.next(0, None), schedule.next(1, None)), (Dispatch::Later, Dispatch::Later));
    schedule.complete(first.stride, first.end);
    let Dispatch::Order(second) = schedule.next(1, None) else { panic!("no order") };
    assert!(second.first == first.end && second.stride.len(10_000) < first.stride.len(10_000));
    schedule.complete(second.stride, second.end);
    loop {
        let dealt = [0, 1].map(|worker| orders(&mut schedule, worker, None).len());
        if dealt == [0, 0] {
            break;
        }
    }
    assert_eq!((schedule.completed(), schedule.next(0, None)), (8, Dispatch::Done));
}

#[test]
fn a_render_may_begin_without_workers_and_lose_all_of_them() {
    let mut schedule = Schedule::new(0, 10_000, 4, None, vec![]);
    assert_eq!(schedule.completed(), 0);
    schedule.join(5, 1.0);
    let Dispatch::Order(order) = schedule.next(5, None) else { panic!("no order") };
    schedule.lose(5);
    // Its unfinished work waits for the next worker.
    schedule.join(6, 1.0);
    let mut first = None;
    while let Dispatch::Order(order) = schedule.next(6, None) {
        schedule.complete(order.stride, order.end);
        first = first.or(Some(order.first));
    }
    assert_eq!((first, order.first), (Some(0), 0));
    assert_eq!((schedule.completed(), schedule.next(6, None)), (4, Dispatch::Done));
}

#[test]
fn more_workers_may_join_than_there_are_pixels() {
    for pixels in [1, 4] {
        let mut schedule = Schedule::new(1, pixels, 3, None, vec![]);
        (1..51).for_each(|worker| schedule.join(worker, 1.0));
        let mut dealt = 1;
        while dealt > 0 {
            dealt = (0..51).map(|worker| orders(&mut schedule, worker, None).len()).sum();
        }
        assert_eq!((schedule.completed(), schedule.next(0, None)), (3, Dispatch::Done));
        assert!(schedule.shares() <= pixels as usize);
    }
}
