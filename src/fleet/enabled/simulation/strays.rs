//! Results and collectors that come too late, and a server that has lost its last messages.

use super::{Server, film_of, job, posted, settings, whole};
use crate::api::Render;
use crate::fleet::FleetError;
use crate::fleet::enabled::collector::{Collector, Judge, Step};
use crate::fleet::enabled::gathering::Gathering;
use crate::fleet::enabled::job::{JobDevice, Lease};
use crate::fleet::enabled::unit::{Beat, Unit};
use crate::output::open_film;
use crate::scene::Scene;
use crate::session::RenderSettings;
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::time::Duration;

/// A collector that takes the lease.
fn take_over<'a>(
    server: &'a Server,
    owner: &str,
    settings: &RenderSettings,
    film: &Path,
    judge: Judge<'a>,
) -> Collector<'a, Server> {
    server.job.borrow_mut().0.collector = Some(Lease { owner: owner.into(), renewed: 0 });
    let gathering = Gathering::open(settings.clone(), JobDevice::Cpu, film).unwrap();
    let place = (film.parent().unwrap(), Duration::from_secs(5));
    Collector::new(server, owner.into(), gathering, place, judge).unwrap()
}

/// Renders every unit that waits, and adds their results, in each of these seconds or until the film is complete. A sample
/// takes ten seconds, so that units have one.
fn drive(
    server: &Server,
    collector: &mut Collector<'_, Server>,
    settings: &RenderSettings,
    mut seconds: Range<u64>,
) -> bool {
    seconds.any(|second| {
        while let Some(unit) = server.queue.borrow_mut().pop_front() {
            let film = film_of(settings, &unit.range(), false);
            let nonce = server.last.get() as usize;
            let seconds = 10.0 * f64::from(unit.end - unit.first);
            server.post(posted(&unit, "w", nonce, &film, seconds), film);
        }
        collector.step(Duration::from_secs(second)).unwrap() == Step::Complete
    })
}

#[test]
fn results_that_are_no_units_are_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(40, &path);
    let server = Server::new(job(&settings, 0.0));
    let mut judge = |_: &Unit| Ok(None);
    let mut collector = take_over(&server, "a", &settings, &path, &mut judge);
    assert_eq!(collector.step(Duration::ZERO).unwrap(), Step::Waits);
    for range in [0..3, 1..3, 100..101] {
        let film = film_of(&settings, &range, false);
        server.post(
            posted(&Unit::new("j1", &range), "w", (range.start + 10 * range.end) as usize, &film, 1.0),
            film,
        );
    }
    collector.step(Duration::ZERO).unwrap();
    assert_eq!(collector.take_notes().iter().filter(|note| note.contains("no such unit")).count(), 3);
    assert!(server.results.borrow().is_empty() && collector.gathering().held().least() == 0);
    assert!(drive(&server, &mut collector, &settings, 1..100));
    assert!(fs::read(&path).unwrap() == whole(40));
}

#[test]
fn a_server_that_has_lost_its_last_messages_is_told_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(400, &path);
    let server = Server::new(job(&settings, 0.0));
    let (mut judge, mut other) = (|_: &Unit| Ok(None), |_: &Unit| Ok(None));
    let mut first = take_over(&server, "a", &settings, &path, &mut judge);
    assert!(!drive(&server, &mut first, &settings, 1..4));
    let lose = |plan| {
        server.job.borrow_mut().0.plan = plan;
        server.queue.borrow_mut().clear();
        server.results.borrow_mut().clear();
    };
    let older = server.job.borrow().0.plan.clone();
    // The collector lives on.
    assert!(!drive(&server, &mut first, &settings, 4..16));
    lose(older.clone());
    assert!(!drive(&server, &mut first, &settings, 16..19));
    let newer = server.job.borrow().0.plan.clone();
    assert!(newer.end() > older.end() && newer != older);
    // Another one finds a film with more samples than the plan has.
    lose(older);
    let held = open_film(&path).unwrap().sample_ranges().least();
    let mut second = take_over(&server, "b", &settings, &path, &mut other);
    assert!(u64::from(second.job().plan.end()) >= held && held > 0);
    assert!(drive(&server, &mut second, &settings, 1..300));
    assert!(fs::read(&path).unwrap() == whole(400));
}

#[test]
fn a_film_with_more_samples_than_the_job_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    fs::write(&path, whole(9)).unwrap();
    let settings = settings(8, &path);
    let server = Server::new(job(&settings, 0.0));
    let gathering = Gathering::open(settings, JobDevice::Cpu, &path).unwrap();
    let mut judge = |_: &Unit| Ok(None);
    let place = (folder.path(), Duration::from_secs(5));
    let error = Collector::new(&server, "a".into(), gathering, place, &mut judge).err().unwrap();
    assert!(error.to_string().contains("jobs extend"), "{error}");
}

#[test]
fn results_of_another_device_are_refused_from_the_first_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(8, &path);
    let film = folder.path().join("unit.film");
    fs::write(&film, film_of(&settings, &(0..1), false)).unwrap();
    let posted = posted(&Unit::new("j1", &(0..1)), "w", 1, &[0; 32], 1.0);
    let add = |device: JobDevice| {
        Gathering::open(settings.clone(), device, &path).unwrap().add(&posted, &film).is_ok()
    };
    assert!(!add(JobDevice::Gpu(None)) && !add(JobDevice::All(None)) && add(JobDevice::Cpu));
}

#[test]
fn a_paused_collector_does_not_replace_the_film_of_its_successor() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(40, &path);
    let server = Server::new(job(&settings, 0.0));
    let (mut judge, mut other) = (|_: &Unit| Ok(None), |_: &Unit| Ok(None));
    let mut first = take_over(&server, "a", &settings, &path, &mut judge);
    assert!(!drive(&server, &mut first, &settings, 1..3));
    // It is paused after its check, and the other one completes the film.
    let saved = first.gathering().save(|| {
        let mut second = take_over(&server, "b", &settings, &path, &mut other);
        assert!(drive(&server, &mut second, &settings, 1..300));
        Ok(())
    });
    assert!(matches!(saved, Err(FleetError::Output(_))), "{saved:?}");
    assert!(fs::read(&path).unwrap() == whole(40));
    // From now on the check fails.
    let error = first.write().unwrap_err();
    assert!(error.to_string().contains("another collector"), "{error}");
    assert!(fs::read(&path).unwrap() == whole(40));
    // Negative control: without the check it would be replaced.
    first.gathering().save(|| Ok(())).unwrap();
    assert!(fs::read(&path).unwrap() != whole(40));
}

#[test]
fn a_flood_of_names_takes_limited_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(8, &path);
    let server = Server::new(job(&settings, 0.0));
    let mut judge = |_: &Unit| Ok(None);
    let mut collector = take_over(&server, "a", &settings, &path, &mut judge);
    let say = |collector: &mut Collector<'_, Server>, name: String, now: u64| {
        let beat = Beat { worker: name, done: 0.0, waits: false };
        collector.hear(beat, Duration::from_secs(now));
    };
    for name in 0..20_000 {
        say(&mut collector, format!("w{name}"), 1);
    }
    say(&mut collector, "one-more".into(), 2);
    assert_eq!(collector.present(Duration::from_secs(2)), 20_000);
    // Those that are silent make room.
    say(&mut collector, "one-more".into(), 60);
    assert_eq!(collector.present(Duration::from_secs(60)), 1);
}

#[test]
fn a_collector_that_has_lost_its_lease_touches_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let settings = settings(8, &path);
    let server = Server::new(job(&settings, 0.0));
    server.job.borrow_mut().0.collector = Some(Lease { owner: "a".into(), renewed: 0 });
    let mut judge = |_: &Unit| Ok(None);
    let gathering = Gathering::open(settings.clone(), JobDevice::Cpu, &path).unwrap();
    let place = (folder.path(), Duration::from_secs(5));
    let mut collector = Collector::new(&server, "a".into(), gathering, place, &mut judge).unwrap();
    assert_eq!(collector.step(Duration::ZERO).unwrap(), Step::Waits);
    let film = film_of(&settings, &(0..1), false);
    server.post(posted(&Unit::new("j1", &(0..1)), "w", 0, &film, 1.0), film);
    server.job.borrow_mut().0.collector = Some(Lease { owner: "b".into(), renewed: 0 });
    let error = collector.step(Duration::from_secs(10)).unwrap_err();
    assert!(error.to_string().contains("another collector"), "{error}");
    assert!(!path.exists() && server.results.borrow().len() == 1);
    // Negative control: with the lease, it is added and removed.
    server.job.borrow_mut().0.collector = Some(Lease { owner: "a".into(), renewed: 0 });
    collector.step(Duration::from_secs(20)).unwrap();
    assert!(server.results.borrow().is_empty());
    assert_eq!(open_film(&path).unwrap().sample_ranges().whole(), std::slice::from_ref(&(0..1)));
}

/// The disk of the collector is full while it writes a film, which is larger than the buffer of the file.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_of_the_collector_bars_no_worker() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.film");
    let render = Render::new(&Scene::default()).size((300, 200)).samples(4).film(&path);
    let settings = render.settings().unwrap();
    let server = Server::new(job(&settings, 0.0));
    let mut judge = |_: &Unit| Ok(None);
    let mut collector = take_over(&server, "a", &settings, &path, &mut judge);
    assert_eq!(collector.step(Duration::ZERO).unwrap(), Step::Waits);
    let unit = server.queue.borrow_mut().pop_front().unwrap();
    let film = film_of(&settings, &unit.range(), false);
    assert!(film.len() > 1 << 20);
    server.post(posted(&unit, "w", 0, &film, 1.0), film);
    // Writes to it fail as those to a full disk do.
    let spool = folder.path().join("result.film");
    std::os::unix::fs::symlink("/dev/full", &spool).unwrap();
    let error = collector.step(Duration::from_secs(1)).unwrap_err();
    assert!(matches!(error, FleetError::File { .. }), "{error}");
    assert!(server.job.borrow().0.barred.is_empty() && server.results.borrow().len() == 1);
    // Without the fault, the same result is taken.
    fs::remove_file(&spool).unwrap();
    collector.step(Duration::from_secs(2)).unwrap();
    assert!(server.job.borrow().0.barred.is_empty());
}
