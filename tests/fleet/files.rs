//! Files of scenes on the server, and submitters at the same time.

use crate::common::watched::Watched;
use crate::machines::{Place, SIZE, cover, has_faults, has_server};
use std::fs;

fn submit(place: &Place, scene: &str) -> String {
    let arguments = ["submit", scene, "--detach", "-q", "--size", SIZE, "--unit", "1ms", "--spp", "3"];
    place.succeed(&arguments).0.trim().to_owned()
}

/// Collects a job with an empty cache: the scene comes from the server.
fn collect(place: &Place, id: &str, name: &str) {
    let (film, exr, cache) = (format!("{name}.film"), format!("{name}.exr"), format!("{name}-cache"));
    place.succeed(&["jobs", "collect", id, "-q", "--film", &film, "-o", &exr, "--cache", &cache]);
}

/// A submitter of the same job that waits at a point until a file is there.
fn held(place: &Place, point: &str, dies: bool) -> Watched {
    let scene = cover();
    let mut command = place.stride(&["submit", &scene, "--detach", "-q", "--size", SIZE, "--spp", "3"]);
    command.env(format!("STRIDE_TEST_FLEET_HOLD_{point}"), "go");
    if dies {
        command.env("STRIDE_TEST_FLEET_DIE", "1");
    }
    let mut held = place.watch_command(command);
    held.hear("holding");
    held
}

#[test]
fn submitters_at_the_same_time_do_not_spoil_files() {
    if !has_server() || !has_faults() {
        return;
    }
    // One has found the file missing, and one has sent its parts: then another job is complete on the server.
    for (point, dies) in [("UPLOAD", true), ("UPLOAD", false), ("LINK", true), ("LINK", false)] {
        let place = Place::start(&[]);
        let earlier = held(&place, point, dies);
        let id = submit(&place, &cover());
        fs::write(place.path("go"), "").unwrap();
        let (code, said) = earlier.end();
        assert_eq!(code, Some(if dies { 9 } else { 0 }), "{said}");
        let _worker = place.worker("w", |_| ());
        collect(&place, &id, "r");
        place.expect_single("r", &["--spp", "3"]);
        // A removal leaves the file to the other job, and takes it with the last one.
        place.succeed(&["jobs", "remove", &id]);
        let others = place.succeed(&["jobs", "list"]).0;
        assert_eq!(others.lines().count(), usize::from(!dies), "{others}");
        if let Some((id, _)) = others.split_once(' ') {
            collect(&place, id, "s");
            place.expect_single("s", &["--spp", "3"]);
        }
    }
}

#[test]
fn a_file_that_changes_while_it_is_sent_is_an_error() {
    if !has_server() || !has_faults() {
        return;
    }
    let place = Place::start(&[]);
    let text = fs::read_to_string(cover()).unwrap();
    fs::write(place.path("a.toml"), &text).unwrap();
    let mut command = place.stride(&["submit", "a.toml", "--detach", "-q", "--size", SIZE, "--spp", "3"]);
    command.env("STRIDE_TEST_FLEET_HOLD_UPLOAD", "go");
    let mut changed = place.watch_command(command);
    changed.hear("holding");
    fs::write(place.path("a.toml"), format!("{text}\n")).unwrap();
    fs::write(place.path("go"), "").unwrap();
    let (code, said) = changed.end();
    assert!(code == Some(1) && said.contains("was changed while it was sent"), "{said}");
    assert_eq!(place.succeed(&["jobs", "list"]).0, "");
    // Nothing of it is taken for the file.
    let id = submit(&place, "a.toml");
    let _worker = place.worker("w", |_| ());
    collect(&place, &id, "c");
    place.expect_single_of("a.toml", "c", &["--spp", "3"]);
}

#[test]
fn films_do_not_depend_on_where_the_scene_is() {
    if !has_server() {
        return;
    }
    let place = Place::start(&[]);
    fs::create_dir(place.path("scenes")).unwrap();
    fs::write(place.path("scenes/m.obj"), "v 3 0 0\nv 3 1 0\nv 3 0 1\nf 1 2 3\n").unwrap();
    let text = |file: &str| {
        format!(
            "environment = {{ radiance = [1, 1, 1] }}\nmaterials.m = {{ type = \"matte\", reflectance = [0.5, 0.5, 0.5] }}\nentities = [{{ shape = {{ type = \"mesh\", file = \"{file}\" }}, material = \"m\" }}]\n"
        )
    };
    fs::write(place.path("scenes/a.toml"), text("m.obj")).unwrap();
    let absolute = place.path("scenes/a.toml").to_str().unwrap().to_owned();
    let id = submit(&place, &absolute);
    let _worker = place.worker("w", |_| ());
    // The collector has the scene in another folder.
    collect(&place, &id, "p");
    place.expect_single_of("scenes/a.toml", "p", &["--spp", "3"]);
    // An absolute path inside the scene is refused at once, whatever the path of the scene.
    let mesh = place.path("scenes/m.obj").to_str().unwrap().to_owned();
    fs::write(place.path("scenes/b.toml"), text(&mesh)).unwrap();
    for scene in ["scenes/b.toml", &absolute.replace("a.toml", "b.toml")] {
        let said = place.fail(&["submit", scene, "--detach"]);
        assert!(said.contains("absolute path") && said.contains("m.obj"), "{said}");
    }
    assert_eq!(place.succeed(&["jobs", "list"]).0.lines().count(), 1);
}
