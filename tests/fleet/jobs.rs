//! Jobs that share workers, and changes of jobs.

use crate::common::watched::poll;
use crate::machines::{Place, SIZE, cover, has_faults, has_server, scene, signal};

fn submit(place: &Place, more: &[&str]) -> String {
    let scene = cover();
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms"];
    place.succeed(&[&fixed[..], more].concat()).0.trim().to_owned()
}

#[test]
fn jobs_are_rendered_by_priority_cancelled_and_extended() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    let low = submit(&place, &["--spp", "5000"]);
    let high = submit(&place, &["--spp", "6", "--priority", "-5"]);
    let list = || place.succeed(&["jobs", "list"]).0;
    let is_first = |id: &str| list().lines().next().is_some_and(|line| line.starts_with(id));
    assert!(is_first(&low), "{}", list());
    place.succeed(&["jobs", "priority", &high, "5"]);
    assert!(is_first(&high) && list().lines().count() == 2, "{}", list());
    let mut worker = place.worker("w", |_| ());
    let outputs = ["--film", "h.film", "-o", "h.exr"];
    place.succeed(&[&["jobs", "collect", &high, "-q"][..], &outputs].concat());
    place.expect_single("h", &["--spp", "6"]);
    // All of its units came before the first of the other job.
    let said = place.said("w");
    let first_of = |id: &str| said.lines().position(|line| line.contains(id) && line.contains("samples"));
    let (first, count) =
        (first_of(&low).unwrap_or(usize::MAX), said.lines().filter(|l| l.contains(&high)).count());
    assert!(first > count, "{said}");
    // More samples of the job that is done.
    place.succeed(&["jobs", "extend", &high, "--spp", "9"]);
    assert!(place.fail(&["jobs", "extend", &high, "--spp", "7"]).contains("request more"));
    place.succeed(&[&["jobs", "collect", &high, "-q"][..], &outputs].concat());
    place.expect_single("h", &["--spp", "9"]);
    // The other job, with a collector, is cancelled.
    let mut collecting = place.watch(&["jobs", "collect", &low, "-o", "low.exr", "--checkpoint", "100ms"]);
    collecting.wait_for(&format!("low-{low}.film"), |film| film.exists());
    // Otherwise a fast worker could complete the job before.
    signal("STOP", &worker.0);
    assert!(place.fail(&["jobs", "remove", &low]).contains("jobs cancel"));
    let (_, said) = place.succeed(&["jobs", "cancel", &low]);
    assert!(said.contains("writes the samples so far") && said.contains("jobs remove"), "{said}");
    let (code, said) = collecting.end();
    signal("CONT", &worker.0);
    assert!(
        code == Some(1) && said.contains("was cancelled; the samples so far have been written"),
        "{said}"
    );
    assert!(place.path("low.exr").exists());
    assert!(place.fail(&["jobs", "collect", &low, "-o", "low.exr"]).contains("was cancelled"));
    assert!(place.fail(&["jobs", "cancel", "j0"]).contains("no job j0"));
    // Jobs that are over are removed, with the scene that they share; a later job sends it again.
    place.succeed(&["jobs", "remove", &low]);
    assert!(list().lines().count() == 1 && list().starts_with(&high), "{}", list());
    place.succeed(&["jobs", "remove", &high]);
    assert_eq!(list(), "");
    let again = submit(&place, &["--spp", "3"]);
    place.succeed(&["jobs", "collect", &again, "-q", "--film", "a.film", "-o", "a.exr"]);
    place.expect_single("a", &["--spp", "3"]);
    signal("TERM", &worker.0);
    assert!(worker.end().success());
}

#[test]
fn a_render_with_a_requested_error_ends_at_the_sample_of_one_machine() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    let _workers = ["a", "b"].map(|name| place.worker(name, |_| ()));
    let (scene, end) = (cover(), ["--noise", "0.25", "--spp", "400"]);
    let fixed = ["submit", &scene, "-q", "--size", SIZE, "--unit", "1ms", "--film", "n.film", "-o", "n.exr"];
    place.succeed(&[&fixed[..], &end].concat());
    place.expect_single("n", &end);
    let film = stride::output::open_film(&place.path("n.film")).unwrap();
    let spp = film.sample_ranges().least();
    assert!(spp > 16 && spp < 400, "{spp} samples show nothing");
}

#[test]
fn a_fleet_on_this_machine_is_one_command() {
    if !has_server() {
        return;
    }
    // Its own server is another one.
    let place = Place::without_server();
    let scene = cover();
    let fixed = ["fleet", "local", "--workers", "2", &scene, "--size", SIZE];
    let (_, said) = place.succeed(&[&fixed[..], &["--film", "l.film", "-o", "l.exr", "--spp", "5"]].concat());
    assert!(said.contains("2 workers with") && said.contains("wrote l.exr"), "{said}");
    place.expect_single("l", &["--spp", "5"]);
}

#[test]
fn a_worker_that_is_asked_to_end_hands_its_unit_back() {
    if !has_server() || !has_faults() {
        return;
    }
    let place = Place::start(&[]);
    // The only unit. Its worker would be waited for.
    let studio = scene("studio");
    let fixed = ["submit", &studio, "--size", SIZE, "--spp", "1", "--patience", "10h"];
    let submit = place.watch(&[&fixed[..], &["--film", "b.film", "-o", "b.exr"]].concat());
    let mut hanging = place.worker("a", |command| {
        command.args(["--grace", "10ms"]).env("STRIDE_TEST_FLEET_HANG", "1");
    });
    poll("a unit of the worker", || place.said("a").contains("hanging"));
    signal("TERM", &hanging.0);
    assert!(hanging.end().success(), "{}", place.said("a"));
    let _worker = place.worker("b", |_| ());
    let (code, said) = submit.end();
    assert_eq!(code, Some(0), "{said}");
    // The scene's mesh and picture came over the server, too.
    place.expect_single_of(&studio, "b", &["--spp", "1"]);
}
