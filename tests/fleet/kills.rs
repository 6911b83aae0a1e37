//! Processes that are killed and paused at any moment.

use crate::common::watched::{kills, poll};
use crate::machines::{Place, Process, SIZE, cover, has_server, signal};
use rand::RngExt;
use std::process::Stdio;
use std::time::Instant;
use stride::output::open_film;
use stride::sampling::Stream;

/// Samples per pixel in the film of the last checkpoint.
fn held(place: &Place) -> u64 {
    open_film(&place.path("x.film")).map_or(0, |film| film.sample_ranges().least())
}

/// A worker that has connected: a fault of the server before that would end it.
fn worker(place: &Place, name: &str) -> Process {
    let started = || place.said(name).matches("waits for jobs").count();
    let before = started();
    let worker = place.worker(name, |_| ());
    poll("the connection of a worker", || started() > before);
    worker
}

fn collector(place: &Place, job: &str) -> Process {
    let log = std::fs::OpenOptions::new().create(true).append(true).open(place.path("collector.log"));
    let outputs = ["--film", "x.film", "-o", "x.exr", "--checkpoint", "200ms"];
    let mut command = place.stride(&[&["jobs", "collect", job][..], &outputs].concat());
    command.stdout(Stdio::null()).stderr(log.unwrap());
    Process(command.spawn().expect("a collector starts"))
}

/// What happens to processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    KilledWorker,
    KilledCollector,
    KilledServer,
    PausedWorker,
    /// Another collector takes over.
    PausedCollector,
    /// For the time in which another program runs.
    PausedServer,
}

const KILLS: [Fault; 3] = [Fault::KilledServer, Fault::KilledCollector, Fault::KilledWorker];
const PAUSES: [Fault; 3] = [Fault::PausedWorker, Fault::PausedCollector, Fault::PausedServer];

/// Kills in three groups, each kind once and the others by chance, with pauses between them.
fn faults(kills: u32, stream: &mut Stream) -> Vec<Fault> {
    let mut faults = Vec::new();
    for kill in 0..kills as usize {
        faults.push(if kill < 3 { KILLS[kill] } else { KILLS[stream.random_range(0..3)] });
        if kill % 4 == 1 {
            faults.push(PAUSES[kill / 4 % 3]);
        }
    }
    faults
}

#[test]
fn whatever_is_killed_the_files_are_those_of_one_machine() {
    if !has_server() {
        return;
    }
    let start = Instant::now();
    let mut place = Place::start(&[]);
    let (kills, scene) = (kills(40), cover());
    let mut spp = 40 + 12 * kills;
    // Units of one sample: as many moments as possible.
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms", "--patience", "500ms"];
    let (id, _) = place.succeed(&[&fixed[..], &["--layers", "albedo", "--spp", &spp.to_string()]].concat());
    let id = id.trim().to_owned();
    let names = ["a", "b", "c"];
    let mut workers = names.map(|name| worker(&place, name));
    let mut collecting = collector(&place, &id);
    let stream = &mut Stream::new(kills, 1, 2);
    let faults = faults(kills, stream);
    let mut paused_worker: Option<usize> = None;
    let mut paused_collector: Option<Process> = None;
    for fault in &faults {
        // Each fault comes in the middle: when the film has grown, and is not complete.
        let mut more = 40;
        loop {
            let before = held(&place);
            poll("progress", || held(&place) > before || collecting.has_ended());
            if !collecting.has_ended() {
                break;
            }
            assert!(collecting.end().success(), "{}", place.said("collector"));
            // It was too fast: more samples are requested of the job that is done, and more each time.
            spp += more;
            more *= 2;
            place.succeed(&["jobs", "extend", &id, "--spp", &spp.to_string()]);
            collecting = collector(&place, &id);
        }
        if let Some(index) = paused_worker.take() {
            signal("CONT", &workers[index].0);
        }
        if let Some(mut earlier) = paused_collector.take() {
            // It notices that another one has taken over, or had nothing left to do.
            let taken_over = || place.said("collector").matches("another collector").count();
            let before = taken_over();
            signal("CONT", &earlier.0);
            let code = earlier.end().code();
            assert!(code == Some(0) || taken_over() > before, "{code:?}: {}", place.said("collector"));
        }
        let index = stream.random_range(0..names.len());
        match fault {
            Fault::KilledWorker => {
                workers[index].kill();
                workers[index] = worker(&place, names[index]);
            }
            Fault::KilledCollector => {
                collecting.kill();
                collecting = collector(&place, &id);
            }
            Fault::KilledServer => {
                place.server().kill();
                place.start_server();
            }
            Fault::PausedWorker => {
                signal("STOP", &workers[index].0);
                paused_worker = Some(index);
            }
            Fault::PausedCollector => {
                signal("STOP", &collecting.0);
                paused_collector = Some(std::mem::replace(&mut collecting, collector(&place, &id)));
            }
            Fault::PausedServer => {
                signal("STOP", &place.server().0);
                place.succeed(&["render", "--help"]);
                signal("CONT", &place.server().0);
            }
        }
    }
    if let Some(index) = paused_worker {
        signal("CONT", &workers[index].0);
    }
    if let Some(earlier) = paused_collector {
        signal("CONT", &earlier.0);
    }
    assert!(collecting.end().success(), "{}", place.said("collector"));
    let units = names.map(|name| place.said(name).matches(" samples ").count());
    let made: usize = units.iter().sum();
    println!(
        "{} kills and {} pauses in {:.0} s; {made} units were reported for {spp} samples: {} of them lost or rendered twice",
        kills,
        faults.len() as u32 - kills,
        start.elapsed().as_secs_f64(),
        made as i64 - i64::from(spp),
    );
    place.expect_single("x", &["--layers", "albedo", "--spp", &spp.to_string()]);
    // A worker that is asked to end does so.
    for worker in &mut workers {
        signal("TERM", &worker.0);
        assert!(worker.end().success());
    }
}
