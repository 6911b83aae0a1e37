//! Workers that fail.

use super::*;

#[test]
fn a_worker_that_panics_ends_the_run_with_its_name_and_keeps_the_film() {
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
        assert!(from == 0 || outcome.totals.samples > 0, "the samples sent before are in the film");
    }
}

#[test]
fn others_complete_the_orders_of_a_lost_worker_and_the_film_is_the_same() {
    let expected = plain_film(&*common::integrator(&scene()), WHOLE, |_| 30);
    for (workers, times, blocks) in [(2, 1.0, 0), (2, 9.0, 7), (3, 40.0, 5), (4, 0.3, 3)] {
        for sends_samples in [false, true] {
            // The last worker sends every block separately, and fails in the middle of an order. The others do not
            // reach the end before that: they wait for a channel that closes then.
            let (last, begun) = (workers - 1, AtomicU32::new(0));
            let (works_out, works) = bounded::<Infallible>(0);
            let works_out = Mutex::new(Some(works_out));
            let integrator = hooked(move |paths| {
                if this_worker() == last && begun.fetch_add(1, Ordering::Relaxed) >= blocks {
                    works_out.lock().unwrap().take();
                    panic!("the device is gone");
                }
                if this_worker() != last && paths.first_sample >= 10 {
                    assert_eq!(works.recv_timeout(TIMEOUT), Err(RecvTimeoutError::Disconnected));
                }
            });
            let dispensable = Some(times);
            let wiring = Wiring {
                workers,
                spp: 30,
                dump_at: vec![7, 20],
                sends_samples,
                dispensable,
                ..Wiring::default()
            };
            let Rendered { outcome, barriers, samples, .. } = wiring.render(&integrator);
            assert_eq!(outcome.lost.first().expect("a lost worker").index, last);
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
fn samples_of_a_worker_lost_at_the_end_are_made_by_others() {
    // Worker 1 has not completed its first orders, for two shares, when the sample sink has received all others.
    let shares = Schedule::new(2, WHOLE.len(), 1, None, vec![]).with_faster(WHOLE.len(), 1.0).shares();
    let others = WHOLE.len() as usize * (shares - 2) / shares;
    let (others_out, others_work) = bounded::<Infallible>(0);
    let (mut others_out, mut got) = (Some(others_out), 0);
    let sink = move |samples: &[Sample]| {
        got += samples.len();
        if got == others {
            others_out.take();
        }
    };
    let integrator = hooked(move |_| {
        if this_worker() == 1 {
            assert_eq!(others_work.recv_timeout(TIMEOUT), Err(RecvTimeoutError::Disconnected));
            panic!("the device is gone");
        }
    });
    let wiring = Wiring {
        workers: 2,
        spp: 1,
        dispensable: Some(1.0),
        sends_samples: true,
        sink: Box::new(sink),
        ..Wiring::default()
    };
    let outcome = wiring.render(&integrator).outcome;
    assert!(!outcome.lost.is_empty() && outcome.failure.is_none() && outcome.whole);
    assert!(outcome.film == plain_film(&*common::integrator(&scene()), WHOLE, |_| 1));
}

#[test]
fn a_resumed_render_reports_all_samples_and_lost_workers() {
    let gone = hooked(move |_| {
        let is_lost = std::thread::current().name() == Some("worker 2");
        assert!(!is_lost, "the device is gone");
    });
    let earlier =
        Wiring { workers: 3, spp: 4, dispensable: Some(1.0), ..Wiring::default() }.render(&gone).outcome;
    let plain = common::integrator(&scene());
    for workers in [1, 2, 4] {
        let film = Some(earlier.film.clone());
        let wiring = Wiring { workers, spp: 9, film, ..Wiring::default() };
        let mut outcome = wiring.render(&*plain).outcome;
        assert!(outcome.lost.is_empty());
        outcome.add_earlier(&earlier);
        assert_eq!((outcome.made.len(), outcome.made.iter().sum::<u64>()), (workers.max(3), 1200 * 9));
        assert_eq!(outcome.lost.first().expect("a lost worker").worker, "worker 2");
    }
}
