//! Processes that are killed and paused at any moment.

use crate::common::watched::{kills, poll};
use crate::machines::{Place, Process, SIZE, cover, has_server, signal};
use rand::RngExt;
use std::process::Stdio;
use stride::output::open_film;
use stride::sampling::Stream;

/// Samples per pixel in the film of the last checkpoint.
fn held(place: &Place) -> u64 {
    open_film(&place.path("x.film")).map_or(0, |film| film.sample_ranges().least())
}

fn collector(place: &Place, job: &str) -> Process {
    let log = std::fs::OpenOptions::new().create(true).append(true).open(place.path("collector.log"));
    let outputs = ["--film", "x.film", "-o", "x.exr", "--checkpoint", "200ms"];
    let mut command = place.stride(&[&["jobs", "collect", job][..], &outputs].concat());
    command.stdout(Stdio::null()).stderr(log.unwrap());
    Process(command.spawn().expect("a collector starts"))
}

#[test]
fn whatever_is_killed_the_files_are_those_of_one_machine() {
    if !has_server() {
        return;
    }
    let mut place = Place::start(&[]);
    let (kills, scene) = (kills(4), cover());
    let mut spp = 40 + 40 * kills;
    // Units of one sample: as many moments as possible.
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms", "--patience", "1s"];
    let (id, _) = place.succeed(&[&fixed[..], &["--layers", "albedo", "--spp", &spp.to_string()]].concat());
    let id = id.trim().to_owned();
    let names = ["a", "b", "c"];
    let mut workers = names.map(|name| place.worker(name, |_| ()));
    let mut collecting = collector(&place, &id);
    let stream = &mut Stream::new(kills, 1, 2);
    let mut paused: Option<usize> = None;
    let mut kinds = [0; 4];
    for kill in 0..kills {
        let before = held(&place);
        poll("progress", || held(&place) > before || collecting.0.try_wait().unwrap().is_some());
        if let Some(worker) = paused.take() {
            signal("CONT", &workers[worker].0);
        }
        if let Some(status) = collecting.0.try_wait().unwrap() {
            assert!(status.success(), "{}", place.said("collector"));
            // It was too fast: more samples are requested of the job that is done.
            spp += 40;
            place.succeed(&["jobs", "extend", &id, "--spp", &spp.to_string()]);
            collecting = collector(&place, &id);
        }
        let worker = stream.random_range(0..names.len());
        // Each kind comes first once, then by chance.
        let kind = if kill < 4 { kill as usize } else { stream.random_range(0..4) };
        kinds[kind] += 1;
        match kind {
            0 => {
                workers[worker].kill();
                workers[worker] = place.worker(names[worker], |_| ());
            }
            1 => {
                collecting.kill();
                collecting = collector(&place, &id);
            }
            2 => {
                place.server().kill();
                place.start_server();
            }
            _ => {
                signal("STOP", &workers[worker].0);
                paused = Some(worker);
            }
        }
    }
    if let Some(worker) = paused {
        signal("CONT", &workers[worker].0);
    }
    poll("the end of the collector", || collecting.0.try_wait().unwrap().is_some());
    let said = place.said("collector");
    assert!(collecting.0.wait().unwrap().success(), "{said}");
    println!("{spp} samples per pixel; killed: {kinds:?} (workers, collectors, servers, paused workers)");
    place.expect_single("x", &["--layers", "albedo", "--spp", &spp.to_string()]);
    // A worker that is asked to end does so.
    for worker in &mut workers {
        signal("TERM", &worker.0);
        assert!(worker.0.wait().unwrap().success());
    }
}
