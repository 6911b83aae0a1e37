//! Ctrl-C: exit codes, and what is written.

use crate::machines::{Place, SIZE, cover, has_faults, has_server};

#[test]
fn ctrl_c_leaves_a_job_on_the_server_and_is_an_error_without_the_files() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    let scene = cover();
    // There is no worker yet.
    let mut submit =
        place.watch(&["submit", &scene, "--size", SIZE, "--spp", "3", "--film", "i.film", "-o", "i.exr"]);
    submit.hear("is on the server");
    submit.interrupt();
    let (code, said) = submit.end();
    let id = place.succeed(&["jobs", "list"]).0.split(' ').next().unwrap().to_owned();
    let remedy =
        format!("stopped; job {id} continues on the server: collect it with stride jobs collect {id}");
    assert!(code == Some(1) && said.contains(&remedy), "{code:?}: {said}");
    let mut collect = place.watch(&["jobs", "collect", &id, "--film", "i.film", "-o", "i.exr"]);
    collect.hear("0 workers");
    collect.interrupt();
    let (code, said) = collect.end();
    assert!(code == Some(1) && said.contains(&remedy), "{code:?}: {said}");
    assert!(!place.path("i.exr").exists());
    // These two have nothing to write.
    let mut watch = place.watch(&["jobs", "watch", &id]);
    watch.hear("0 workers");
    watch.interrupt();
    let (code, said) = watch.end();
    assert_eq!(code, Some(0), "{said}");
    let mut work = place.watch(&["work", "--threads", "1"]);
    work.hear("waits for jobs");
    work.interrupt();
    let (code, said) = work.end();
    assert_eq!(code, Some(0), "{said}");
    // Nothing was lost.
    let _worker = place.worker("w", |_| ());
    place.succeed(&["jobs", "collect", &id, "-q", "--film", "i.film", "-o", "i.exr"]);
    place.expect_single("i", &["--spp", "3"]);
}

#[test]
fn ctrl_c_ends_a_fleet_on_this_machine_with_the_samples_so_far() {
    if !has_server() {
        return;
    }
    // Its own server is another one.
    let place = Place::without_server();
    let scene = cover();
    let fixed = ["fleet", "local", "--workers", "1", &scene, "--size", SIZE, "--unit", "1ms"];
    let endless = ["--spp", "4000000000", "--checkpoint", "100ms", "--film", "c.film", "-o", "c.exr"];
    let mut local = place.watch(&[&fixed[..], &endless].concat());
    // The first checkpoint has samples.
    local.wait_for("c.film", |film| film.exists());
    local.interrupt();
    let (code, said) = local.end();
    assert!(code == Some(0) && said.contains("wrote c.exr, c.film (samples "), "{code:?}: {said}");
    assert!(place.path("c.exr").exists());
    if !has_faults() {
        return;
    }
    let mut command = place.stride(&[&fixed[..], &["-o", "d.exr"]].concat());
    command.env("STRIDE_TEST_FLEET_HANG", "1");
    let mut local = place.watch_command(command);
    local.hear("hanging");
    local.interrupt();
    let (code, said) = local.end();
    assert!(code == Some(1) && said.contains("stopped before the first result"), "{code:?}: {said}");
    assert!(!place.path("d.exr").exists());
}
