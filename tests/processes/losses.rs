//! Workers that fail.

use super::*;

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
fn a_render_that_others_go_on_with_tells_what_all_have_made_and_who_was_lost() {
    let gone = hooked(move |_| {
        let is_lost = std::thread::current().name() == Some("worker 2");
        assert!(!is_lost, "the device is gone");
    });
    let earlier = Wiring { workers: 3, spp: 4, spare: Some(1.0), ..Wiring::default() }.render(&gone).outcome;
    let plain = common::integrator(&scene());
    for workers in [1, 2, 4] {
        let film = Some(earlier.film.clone());
        let wiring = Wiring { workers, spp: 9, film, ..Wiring::default() };
        let mut outcome = wiring.render(&*plain).outcome;
        assert!(outcome.lost.is_none());
        outcome.follow(&earlier);
        assert_eq!((outcome.made.len(), outcome.made.iter().sum::<u64>()), (workers.max(3), 1200 * 9));
        assert_eq!(outcome.lost.expect("a lost worker").worker, "worker 2");
    }
}
