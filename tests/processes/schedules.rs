//! The assignment of orders to workers.

use super::*;

#[test]
fn a_fast_worker_owns_pixels_in_proportion_to_its_speed() {
    for (workers, times) in [(2, 1.0), (3, 7.5), (17, 100.0), (3, 0.25)] {
        let schedule = Schedule::new(workers, 1_000_000, 1, None, vec![]).with_faster(1_000_000, times);
        let owners = schedule.owners(&Layout::plain(1_000_000, 1));
        let share = |worker: usize| owners.iter().filter(|&&owner| owner as usize == worker).count() as f64;
        for other in 0..workers - 1 {
            let ratio = share(workers - 1) / share(other);
            // In eighths of the share of another worker.
            assert!((ratio - times).abs() <= 0.063, "{ratio} is not {times}");
        }
    }
}

#[test]
fn stripes_are_whole_rows_if_possible_and_contain_each_place_once() {
    for (workers, times, [width, height], rows) in [
        (1, None, [640, 480], true),
        (16, None, [640, 480], true),
        (16, None, [1920, 1080], true),
        (5, Some(0.3), [640, 480], true),
        (17, Some(40.0), [1920, 1080], true),
        (3, Some(7.5), [40, 30], true),
        (3, Some(5000.0), [40, 30], false),
        (4, None, [7, 1], false),
    ] {
        let pixels = width * height;
        let plain = Schedule::new(workers, pixels, 1, None, vec![]);
        let dealt = match times {
            Some(times) => plain.with_faster(pixels, times),
            None => plain,
        };
        let mut schedule = dealt.in_stripes(pixels, width);
        let mut times_held = vec![0; pixels as usize];
        let mut whole = true;
        for worker in 0..workers {
            while let Dispatch::Order(Order { stride, .. }) = schedule.next(worker, None) {
                (0..stride.len(pixels)).for_each(|slot| times_held[stride.place(slot) as usize] += 1);
                whole &= stride.first % width == 0 && stride.run % width == 0 && stride.step % width == 0;
            }
        }
        let case = format!("{workers} workers, {times:?}, {width}×{height}");
        assert!(times_held.iter().all(|&held| held == 1), "{case}");
        assert_eq!(whole, rows, "{case}");
    }
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
        // The orders of each worker, and the workers that have not been dismissed.
        let mut under_way: Vec<VecDeque<Order>> = vec![VecDeque::new(); workers];
        let mut open: Vec<usize> = (0..workers).collect();
        // Workers request and complete orders in any order, at any pace.
        while !open.is_empty() || under_way.iter().any(|orders| !orders.is_empty()) {
            let worker = stream.random_range(0..workers);
            let micros = 10_f64.powf(stream.random_range(-1.0..6.0));
            let pace = stream.random_bool(0.9).then(|| Duration::from_secs_f64(micros * 1e-6));
            if under_way[worker].len() < 2 && open.contains(&worker) {
                match schedule.next(worker, pace) {
                    Dispatch::Order(order) => {
                        let with_another =
                            |w: usize| w != worker && under_way[w].iter().any(|o| o.stride == order.stride);
                        assert!(!(0..workers).any(with_another), "two workers have one share");
                        given[order.stride.first as usize].push(order);
                        under_way[worker].push_back(order);
                    }
                    Dispatch::Later => assert!(under_way.iter().any(|orders| !orders.is_empty()), "all wait"),
                    Dispatch::Done => open.retain(|&w| w != worker),
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
                assert!(orders.iter().any(|order| order.end == *stop), "{stop} is skipped");
            }
        }
    }
}
