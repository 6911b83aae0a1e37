//! The results of renders that run to their end: film, barriers, samples, snapshots.

use super::*;

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

// Orders and blocks begin and end anywhere: layers use 24 of the first 32 samples here, and no others.
#[test]
fn layers_use_only_the_first_samples_of_each_pixel() {
    let integrator = common::integrator(&scene());
    for (first, spp, traced) in [(8, 40, 0xffff_ff00_u32), (32, 3, 0), (31, 2, 1 << 31)] {
        let expected = plain_film_from(&*integrator, WHOLE, first, |_| spp);
        for workers in [1, 5] {
            let Rendered { outcome, .. } =
                Wiring { workers, first, spp, ..Wiring::default() }.render(&*integrator);
            assert!(outcome.film == expected, "{first}.., {workers} workers");
        }
        assert_eq!(expected.first_hits().samples(77), traced);
    }
    // Negative control: a film with one more sample in its layers.
    let mut film = plain_film(&*integrator, WHOLE, |_| 4);
    let expected = film.clone();
    let paths = Paths { pixels: &[WHOLE.pixel(7)], first_sample: 4, samples: 1 };
    add_first_hits(&mut film, &*integrator, 7, &paths);
    assert!(film != expected);
}

#[test]
fn more_workers_than_pixels_are_allowed() {
    let integrator = common::integrator(&scene());
    let region = Region { film_width: WIDTH, x: 11, y: 7, width: 3, height: 1 };
    let outcome = Wiring { workers: 5, region, ..Wiring::default() }.render(&*integrator).outcome;
    assert!(outcome.film == plain_film(&*integrator, region, |_| 16) && outcome.whole);
}

#[test]
fn a_slow_worker_affects_only_the_time() {
    for slow in 0..3 {
        // The slow worker begins a block only when the others have begun three times as many. They can: it owns
        // two of 18 shares at most. Once it has progressed so far that they could not, it no longer waits.
        let (begun_out, begun) = unbounded();
        let paths_begun = Mutex::new([0, 0]);
        let integrator = hooked(move |paths| {
            if this_worker() != slow {
                begun_out.send(paths.len()).unwrap();
                return;
            }
            let [own, others] = &mut *paths_begun.lock().unwrap();
            *own += paths.len();
            while *others < (3 * *own).min(12_000) {
                *others += begun.recv_timeout(TIMEOUT).expect("other workers continue");
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
fn a_crop_equals_a_part_of_the_whole_picture() {
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
fn pictures_at_barriers_equal_shorter_renders() {
    for (workers, sends_samples) in [(1, false), (3, false), (3, true), (7, false)] {
        // In any order, and one beyond the end, which is never reached.
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
fn a_slow_lossless_sink_gets_every_sample_once() {
    let integrator = common::integrator(&scene());
    // It traces each sample again: all workers together are faster.
    let again = common::integrator(&scene());
    let sink = move |samples: &[Sample]| {
        for sample in samples {
            let mut finished = Vec::new();
            let pixels = [WHOLE.pixel(sample.pixel)];
            let paths = Paths { pixels: &pixels, first_sample: sample.sample, samples: 1 };
            again.trace(level(), &paths, &mut finished);
            assert_eq!(finished[0].sample, *sample);
        }
    };
    let wiring = Wiring { workers: 3, sends_samples: true, sink: Box::new(sink), ..Wiring::default() };
    let Rendered { outcome, samples, .. } = wiring.render(&*integrator);
    let mut film = empty_film(WHOLE);
    let mut seen: Vec<(u32, u32)> = samples.iter().map(|s| (s.pixel, s.sample)).collect();
    for sample in &samples {
        film.add_sample(sample.pixel as usize, sample.radiance).unwrap();
    }
    for pixel in 0..WHOLE.len() {
        let paths = Paths { pixels: &[WHOLE.pixel(pixel)], first_sample: 0, samples: 16 };
        add_first_hits(&mut film, &*integrator, pixel, &paths);
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
    assert!(*last.statistics == Statistics::of(&outcome.film) && last.statistics.counts == [16; 1200]);
    assert_eq!((last.samples, last.spp_done, last.spp_target), (16 * 1200, 16.0, Some(16)));
    assert!(snapshots.iter().rev().skip(1).all(|s| !s.finished));
    assert!(progress.is_sorted_by_key(|totals| totals.samples));
}

#[test]
fn invalid_samples_are_rejected_and_listed_and_bright_ones_are_added() {
    let altered = || Hooked {
        inner: common::integrator(&scene()),
        before: |_: &Paths<'_>| {},
        after: |sample: &mut Sample| match (sample.pixel, sample.sample) {
            (5, 3) => sample.radiance[1] = f32::NAN,
            (600, 0) => sample.radiance[0] = f32::INFINITY,
            (1199, 15) => sample.radiance[2] = -1.0,
            // Too bright for sums of 64 bits.
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
