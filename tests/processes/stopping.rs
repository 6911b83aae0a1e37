//! Renders that stop before their end, and are resumed.

use super::*;

#[test]
fn stopped_at_any_time_each_pixel_has_its_first_samples() {
    let mut cut_short = 0;
    for i in 0..40_u32 {
        let (stop_out, stop) = bounded(0);
        let stop_out = std::sync::Mutex::new(Some(stop_out));
        // Requests the end when the samples of some pixel from some index on are about to be traced.
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
fn a_film_with_uneven_samples_is_resumed_to_the_same_end() {
    let integrator = common::integrator(&scene());
    let stream = &mut Stream::new(5, 0, 0);
    for round in 0..12_u32 {
        let first = [0, 1, 7][round as usize % 3];
        // The same number of threads leave, one of them interrupted in an order; or none left at all.
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
            assert_eq!(totals.made(), 24 * 1200 - before, "no sample is traced twice");
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
fn checkpoints_have_the_first_samples_of_each_pixel() {
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
            layout: empty_film(WHOLE).layout(),
            identity: Identity::default().with("a", "b"),
            notes: Identity::default(),
        };
        let keeper = Some(FilmSink { path: path.clone(), head, range: 0..1000 });
        let wiring = Wiring { workers: 1 + i as usize % 4, spp: 1000, keeper, ..Wiring::default() };
        Wiring { stop: Some(stop), ..wiring }.render(&integrator);
        if !path.exists() {
            // Stopped before the first film was on the disk; the count below ensures that this is the exception.
            continue;
        }
        let file = open_film(&path).unwrap();
        under_way += u32::from(file.sample_ranges().open().is_some());
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
fn an_error_is_reached_at_the_same_sample_for_any_threads_and_stops() {
    let asked = 0.17;
    let integrator = common::integrator(&scene());
    let alone = Wiring { workers: 1, spp: 10_000, noise: Some((asked, None)), ..Wiring::default() };
    let alone = alone.render(&*integrator).outcome;
    let spp = alone.totals.spp;
    assert!(alone.whole && spp > 16 && spp < 10_000 && !spp.is_power_of_two(), "{spp}");
    assert!(alone.film == plain_film(&*integrator, WHOLE, |_| spp), "not a plain render of {spp}");
    let [now, told] = alone.totals.noise.unwrap();
    assert!(now <= asked && told == asked);
    // Negative control: a smaller error needs more samples, by 1/√n.
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
fn a_deadline_ends_at_a_whole_number_of_samples() {
    let deadline = Some(Instant::now() + Duration::from_millis(150));
    let wiring = Wiring { workers: 3, spp: u32::MAX, deadline, ..Wiring::default() };
    let outcome = wiring.render(&*common::integrator(&scene())).outcome;
    let spp = outcome.totals.spp;
    assert!(outcome.whole && spp > 0 && spp < u32::MAX, "{spp}");
    assert!(outcome.film.picture() == plain_picture(spp));
}

#[test]
fn a_stalled_remote_viewer_delays_nothing_and_gets_the_last_picture() {
    let (remote_out, remote) = bounded(tev::MOST_WAITING);
    let (ended_out, ended) = bounded(1);
    std::thread::scope(|scope| {
        scope.spawn(move || {
            // It continues until another viewer has received four pictures, and ends with a fifth.
            let wiring = Wiring { spp: u32::MAX, stop_after: Some(4), ..Wiring::default() };
            let wiring = Wiring { remote: Some(remote_out), ..wiring };
            let rendered = wiring.render(&*common::integrator(&scene()));
            assert!(rendered.snapshots.len() > 4, "{} frames", rendered.snapshots.len());
            ended_out.send(rendered.outcome.film.picture()).unwrap();
        });
        let picture = ended.recv_timeout(TIMEOUT);
        let waiting: Vec<Arc<Snapshot>> = remote.try_iter().collect();
        // Waiting for it would block forever.
        drop(remote);
        let picture = picture.expect("the render waits for the viewer");
        assert!(waiting.len() <= 2 && !waiting[0].finished);
        let last = waiting.last().unwrap();
        assert!(last.finished && last.picture == picture);
    });
}
