//! Jobs that share workers, and changes of jobs.

use crate::machines::{Place, SIZE, cover, has_server, signal};

fn submit(place: &Place, more: &[&str]) -> String {
    let scene = cover();
    let fixed = ["submit", &scene, "--detach", "-q", "--size", SIZE, "--patience", "2s", "--unit", "1ms"];
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
    place.succeed(&["jobs", "cancel", &low]);
    let (code, said) = collecting.end();
    assert!(
        code == Some(1) && said.contains("was cancelled; the samples so far have been written"),
        "{said}"
    );
    assert!(place.path("low.exr").exists());
    assert!(place.fail(&["jobs", "collect", &low, "-o", "low.exr"]).contains("was cancelled"));
    assert!(place.fail(&["jobs", "cancel", "j0"]).contains("no job j0"));
    signal("TERM", &worker.0);
    assert!(worker.0.wait().unwrap().success());
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
    let folder = tempfile::tempdir().unwrap();
    let scene = cover();
    let outputs = ["--film", "l.film", "-o", "l.exr", "--spp", "5"];
    let status = std::process::Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["fleet", "local", "--workers", "2", &scene, "-q", "--size", SIZE])
        .args(outputs)
        .current_dir(folder.path())
        .env("XDG_CACHE_HOME", folder.path())
        .env("RUST_MIN_STACK", (64 << 20).to_string())
        .status();
    assert!(status.unwrap().success());
    let film = stride::output::open_film(&folder.path().join("l.film")).unwrap();
    assert_eq!(film.sample_ranges().whole(), [0..5]);
}
