//! Disks and folders that fail during a render to a film.

use super::{bytes, cover, folder, render, stride, succeed};
use crate::common::watched::Watched;
use std::fs;
use std::path::Path;
use std::process::Command;

const ENDLESS: [&str; 5] = ["--spp", "4000000000", "--checkpoint", "20ms", "-o"];

/// Checks that the film at a path is valid, and that the picture is that of its samples.
fn film_shows(dir: &Path, film: &str, picture: &str) {
    succeed(dir, &["merge", film, "-o", "check.exr"]);
    assert!(bytes(dir, "check.exr") == bytes(dir, picture), "the picture is not the film's");
}

#[test]
fn a_folder_that_is_missing_for_a_while_loses_nothing() {
    let dir = folder();
    let scene = cover();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    // The numbered picture is due long after the first film.
    let files = ["out/a.exr", "--dump-at", "20000", "--film", "out/a.film"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &[&ENDLESS[..], &files].concat())), &out);
    run.wait_for("a.film", Path::exists);
    fs::rename(&out, dir.path().join("away")).unwrap();
    run.hear("will retry the film");
    run.hear("will retry the picture");
    fs::rename(dir.path().join("away"), &out).unwrap();
    run.hear("is written again");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said}");
    film_shows(dir.path(), "out/a.film", "out/a.exr");
    // The numbered picture is written too, and correct.
    succeed(dir.path(), &render(&scene, &["--spp", "20000", "-o", "b.exr"]));
    assert!(bytes(dir.path(), "out/a-20000.exr") == bytes(dir.path(), "b.exr"));
}

#[test]
fn files_without_a_folder_at_the_end_are_written_elsewhere() {
    let dir = folder();
    let scene = cover();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    let files = ["out/a.exr", "-o", "out/a.png", "--film", "out/a.film"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &[&ENDLESS[..], &files].concat())), &out);
    run.wait_for("a.film", Path::exists);
    fs::rename(&out, dir.path().join("away")).unwrap();
    run.hear("will retry the film");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(1));
    for words in ["retrying", "to \"./a.film\" instead", "to \"./a.exr\" instead", "to \"./a.png\" instead"] {
        assert!(said.contains(words), "{said}");
    }
    assert!(dir.path().join("a.png").exists());
    film_shows(dir.path(), "a.film", "a.exr");
}

#[test]
fn a_picture_is_written_when_the_disk_has_no_room_for_the_film() {
    let dir = folder();
    // A limit on the size of files simulates a full disk: the film has 77 kB, a small PNG less than 20.
    let scene = cover();
    let arguments = render(&scene, &[&ENDLESS[..], &["a.png", "--film", "a.film"]].concat());
    let mut command = Command::new("bash");
    command.args(["-c", "trap '' XFSZ; ulimit -f 40; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_stride")]);
    command.args(arguments).current_dir(dir.path());
    let mut run = Watched::start(command, dir.path());
    run.hear("will retry the film");
    run.hear("will retry the film");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot write \"a.film\""), "{said}");
    image::open(dir.path().join("a.png")).expect("a picture");
    let names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a.png"], "a partial file is left");
}

#[test]
fn a_locked_folder_is_reported_and_written_when_it_is_unlocked() {
    use std::os::unix::fs::PermissionsExt;
    let dir = folder();
    let scene = cover();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    let files = ["out/a.exr", "--film", "out/a.film"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &[&ENDLESS[..], &files].concat())), &out);
    run.wait_for("a.film", Path::exists);
    fs::set_permissions(&out, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(out.join("probe"), "").is_ok() {
        println!("skipped: this user may write into a read-only folder");
    } else {
        run.hear("no permission");
        fs::set_permissions(&out, fs::Permissions::from_mode(0o755)).unwrap();
        run.hear("is written again");
    }
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said}");
    film_shows(dir.path(), "out/a.film", "out/a.exr");
}
