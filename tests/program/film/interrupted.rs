//! Renders that are killed or interrupted, and resumed.

use super::{bytes, cover, folder, refused, render, stride, succeed};
use crate::common::watched::{Watched, kill_at_any_moment, kill_at_every_moment, kills};
use rand::RngExt;
use std::fs;
use std::path::Path;
use stride::output::open_film;
use stride::sampling::Stream;

/// Names of the temporary films of killed renders.
fn half_written(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.filter_map(|name| name.into_string().ok()).filter(|name| name.contains(".film-")).collect()
}

#[test]
fn renders_killed_at_any_moment_are_resumed_to_the_same_files() {
    let dir = folder();
    let scene = cover();
    let part = |spp: &str, threads: &str| {
        let begins = !dir.path().join("part.film").exists();
        let film = if begins { "--film" } else { "--resume" };
        let common = ["--spp", spp, "--threads", threads, "--checkpoint", "10ms", "-o", "part.exr"];
        stride(dir.path(), &render(&scene, &[&[film, "part.film", "--layers", "all"][..], &common].concat()))
    };
    // The render is endless, so that no machine is too fast for the kills.
    let (kills, mut within_writes) = (kills(8), 0);
    let stream = &mut Stream::new(kills, 0, 0);
    let killed = kill_at_any_moment(dir.path(), kills, 40, stream, |stream| {
        within_writes += usize::from(!half_written(dir.path()).is_empty());
        part("4000000000", &stream.random_range(1..=3).to_string())
    });
    assert_eq!(killed, kills, "a render without end has ended");
    let film = open_film(&dir.path().join("part.film")).expect("a film").read().expect("a whole film");
    let [_, most] = film.seen_range();
    // Then it is to end soon, and is killed while it writes its final files.
    let spp = &(most + 1).to_string();
    let at_end = kill_at_every_moment(dir.path(), || {
        within_writes += usize::from(!half_written(dir.path()).is_empty());
        part(spp, "2")
    });
    println!(
        "{killed} kills on the way to {spp} samples, {at_end} at the end, {within_writes} within writes"
    );
    assert!(within_writes > 0, "no write was interrupted");
    // Temporary files of killed renders have been removed.
    assert_eq!(half_written(dir.path()), [""; 0]);
    let whole = ["--spp", spp, "--layers", "all"];
    succeed(
        dir.path(),
        &render(&scene, &[&whole[..], &["--film", "whole.film", "-o", "whole.exr"]].concat()),
    );
    assert!(bytes(dir.path(), "part.exr") == bytes(dir.path(), "whole.exr"), "another picture");
    assert!(bytes(dir.path(), "part.film") == bytes(dir.path(), "whole.film"), "another film");
    // Negative control: another seed gives other files.
    let other = ["--seed", "9", "--film", "n.film", "-o", "n.exr"];
    succeed(dir.path(), &render(&scene, &[&whole[..], &other].concat()));
    assert!(bytes(dir.path(), "n.exr") != bytes(dir.path(), "whole.exr"));
    assert!(bytes(dir.path(), "n.film") != bytes(dir.path(), "whole.film"));
}

#[test]
fn a_killed_render_to_an_error_ends_at_the_same_sample() {
    let dir = folder();
    let scene = cover();
    let noise = ["--noise", "0.017", "--stats", "stats.json"];
    succeed(
        dir.path(),
        &render(&scene, &[&noise[..], &["--film", "whole.film", "-o", "whole.exr"]].concat()),
    );
    let spp = |folder: &Path| {
        let stats: serde_json::Value = serde_json::from_slice(&bytes(folder, "stats.json")).expect("JSON");
        assert!(stats["estimated_noise"].as_f64().is_some_and(|noise| noise > 0.016 && noise <= 0.017));
        stats["spp"].as_f64().expect("a number")
    };
    let whole_spp = spp(dir.path());
    assert!(whole_spp > 100.0 && whole_spp.fract() == 0.0);
    let part = |more: &[&str]| {
        let film = if dir.path().join("part.film").exists() { "--resume" } else { "--film" };
        let common = [film, "part.film", "-o", "part.exr"];
        stride(dir.path(), &render(&scene, &[&common[..], more, &noise].concat()))
    };
    let stream = &mut Stream::new(3, 0, 0);
    let killed = kill_at_any_moment(dir.path(), 8, 12, stream, |_| part(&["--checkpoint", "5ms"]));
    let at_end = kill_at_every_moment(dir.path(), || part(&["--threads", "1"]));
    println!("{killed} kills on the way, {at_end} at the end");
    assert_eq!(spp(dir.path()), whole_spp);
    assert!(bytes(dir.path(), "part.exr") == bytes(dir.path(), "whole.exr"), "another picture");
    assert!(bytes(dir.path(), "part.film") == bytes(dir.path(), "whole.film"), "another film");
    // It equals a plain render of that many samples.
    let plain = whole_spp.to_string();
    succeed(dir.path(), &render(&scene, &["--spp", &plain, "-o", "plain.exr"]));
    assert!(bytes(dir.path(), "plain.exr") == bytes(dir.path(), "whole.exr"));
    for bad in ["0", "1", "-0.1", "nan", "much"] {
        refused(dir.path(), 2, &render(&scene, &["--noise", bad]));
    }
    assert!(
        refused(dir.path(), 2, &render(&scene, &["--noise", "0.1", "--range", "4..8"])).contains("--range")
    );
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_is_resumed_to_more_samples_than_requested_at_first() {
    let dir = folder();
    let scene = cover();
    let first = ["--spp", "4000000", "--film", "a.film", "--checkpoint", "20ms", "-o", "a.exr"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &first)), dir.path());
    run.wait_for("a.film", Path::exists);
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said}");
    let (told, _) = succeed(dir.path(), &["info", "a.film"]);
    assert!(told.contains("asked       0..4000000"), "{told}");
    let least: u32 = told
        .lines()
        .find_map(|line| line.strip_prefix("samples")?.trim().strip_prefix("0.."))
        .map_or(0, |rest| rest.split(',').next().unwrap().parse().unwrap());
    let spp = (least + 700).to_string();
    let out = ["--spp", &spp, "-o", "b.exr", "--threads", "1"];
    succeed(dir.path(), &render(&scene, &[&["--resume", "a.film", "--film", "b.film"], &out[..]].concat()));
    succeed(dir.path(), &render(&scene, &["--spp", &spp, "--film", "c.film", "-o", "c.exr"]));
    assert!(bytes(dir.path(), "b.exr") == bytes(dir.path(), "c.exr"));
    assert!(bytes(dir.path(), "b.film") == bytes(dir.path(), "c.film"));
    // No samples are missing: the outputs are written anyway.
    succeed(dir.path(), &render(&scene, &["--resume", "b.film", "-o", "d.exr", "--stats", "d.json"]));
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "c.exr"));
    let stats: serde_json::Value = serde_json::from_slice(&bytes(dir.path(), "d.json")).expect("JSON");
    assert_eq!(stats["samples"], stats["resumed_samples"]);
    assert_eq!(stats["spp"], f64::from(least + 700));
}
