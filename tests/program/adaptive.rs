//! Adaptive sampling: samples follow the error, the bits do not depend on the history of the render, and there is no
//! bias.

use crate::common::tiles::{Replicates, welch};
use crate::common::watched::{kill_at_any_moment, kill_at_every_moment};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use stride::output::read_picture;
use stride::sampling::Stream;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

/// Runs a command that must end with this exit code; returns its standard error.
fn said(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

fn scene(name: &str) -> String {
    format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

fn render<'a>(scene: &'a str, size: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", scene, "--headless", "-q", "--size", size][..], more].concat()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn stats(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&bytes(folder, "s.json")).expect("JSON")
}

const GOAL: [&str; 5] = ["--adaptive", "--noise", "0.07", "--stats", "s.json"];

#[test]
fn threads_kills_and_lanes_do_not_affect_the_film() {
    let (dir, room) = (folder(), scene("room"));
    let whole = [&GOAL[..], &["--film", "whole.film", "-o", "whole.exr", "--threads", "1"]].concat();
    said(dir.path(), 0, &render(&room, "48x36", &whole));
    let [least, most] = [0, 1].map(|i| stats(dir.path())["spp_range"][i].as_u64().expect("a number"));
    assert!(least >= 16 && most >= 3 * least, "{least} to {most} samples: this decides too little");
    assert_eq!(stats(dir.path())["noise_reached"], true);
    let same = |name: &str| {
        assert!(
            bytes(dir.path(), &format!("{name}.exr")) == bytes(dir.path(), "whole.exr"),
            "another picture"
        );
        assert!(
            bytes(dir.path(), &format!("{name}.film")) == bytes(dir.path(), "whole.film"),
            "another film"
        );
    };
    for (threads, simd) in [("3", "portable"), ("7", "scalar")] {
        let more = [&GOAL[..], &["--film", "a.film", "-o", "a.exr", "--threads", threads]].concat();
        let status = command(dir.path(), &render(&room, "48x36", &more)).env("STRIDE_SIMD", simd).status();
        assert!(status.expect("the program starts").success());
        same("a");
    }
    let part = |more: &[&str]| {
        let film = if dir.path().join("part.film").exists() { "--resume" } else { "--film" };
        let common = [film, "part.film", "-o", "part.exr"];
        command(dir.path(), &render(&room, "48x36", &[&GOAL[..], &common, more].concat()))
    };
    let stream = &mut Stream::new(4, 0, 0);
    let killed = kill_at_any_moment(dir.path(), 12, 12, stream, |_| part(&["--checkpoint", "5ms"]));
    let at_end = kill_at_every_moment(dir.path(), || part(&[]));
    println!("{killed} kills on the way, {at_end} at the end");
    same("part");
    // Resumed at its end, it has no samples left to make.
    said(
        dir.path(),
        0,
        &render(&room, "48x36", &[&GOAL[..], &["--resume", "part.film", "-o", "part.exr"]].concat()),
    );
    assert_eq!(stats(dir.path())["samples"], stats(dir.path())["resumed_samples"]);
    same("part");
    let told = String::from_utf8(run(dir.path(), &["info", "part.film"]).stdout).expect("text");
    assert!(told.contains("adaptive    noise 0.07\n"), "{told}");
    assert!(told.contains(&format!("samples     0..{least}, and some of ")), "{told}");
    assert!(told.contains(&format!("per pixel   {least} to {most} samples")), "{told}");
    // Negative controls: renders with another seed, another error, or none differ, and their films are rejected.
    for other in
        [&["--adaptive", "--noise", "0.08"][..], &["--noise", "0.07"], &["--adaptive", "--spp", "64"]]
    {
        said(dir.path(), 0, &render(&room, "48x36", &[other, &["--film", "b.film", "-o", "b.exr"]].concat()));
        assert!(bytes(dir.path(), "b.exr") != bytes(dir.path(), "whole.exr"));
        let text =
            said(dir.path(), 1, &render(&room, "48x36", &[&GOAL[..], &["--resume", "b.film"]].concat()));
        assert!(text.contains("adaptive"), "{text}");
    }
}

#[test]
fn adaptive_sampling_refuses_incompatible_options() {
    let (dir, cover) = (folder(), scene("cover"));
    for (more, reason) in [
        (&["--range", "0..4"][..], "--range"),
        (&["--dump-at", "4"], "--dump-at"),
        (&["--device", "gpu"], "--device cpu"),
        (&["--film-mode", "continuous"], "--film-mode importance"),
    ] {
        let text = said(dir.path(), 2, &render(&cover, "8x6", &[&["--adaptive"], more].concat()));
        assert!(text.contains("adaptive sampling") && text.contains(reason), "{text}");
    }
    // The scene can request it; its number of samples is then the maximum.
    let text =
        fs::read_to_string(&cover).expect("a scene").replacen("[render]", "[render]\nadaptive = true", 1);
    fs::write(dir.path().join("a.toml"), text).expect("a scene");
    said(dir.path(), 0, &render("a.toml", "40x30", &["--spp", "100", "--stats", "s.json", "-o", "a.exr"]));
    assert_eq!(stats(dir.path())["spp_range"][1], 100);
    let told = String::from_utf8(run(dir.path(), &["info", "a.exr"]).stdout).expect("text");
    assert!(told.contains("adaptive    noise 0.01, at most 100 samples\n"), "{told}");
}

/// Renders with the seeds 1, 2, …
fn replicates(folder: &Path, scene: &str, more: &[&str], first_seed: u32) -> (Replicates, f64) {
    let mut samples = 0.0;
    let replicates = Replicates::of([48, 32], 1, |replicate, take| {
        let seed = (first_seed + replicate).to_string();
        let common = ["--seed", &seed, "-o", "a.exr", "--stats", "s.json"];
        said(folder, 0, &render(scene, "48x32", &[&common[..], more].concat()));
        samples += stats(folder)["spp"].as_f64().expect("a number");
        let (_, picture) = read_picture(&folder.join("a.exr")).expect("a picture");
        for (pixel, rgb) in (0..).zip(&picture.rgb) {
            take(pixel, rgb.map(f64::from));
        }
    });
    (replicates, samples / 16.0)
}

// A bias would be largest where pixels stop early: with few samples and rare bright paths. The significance level is
// that of the tile test, 1% for all together.
#[test]
fn the_mean_of_adaptive_renders_is_unbiased() {
    let dir = folder();
    for (name, goal) in [("cover", "0.22"), ("room", "0.14")] {
        let file = scene(name);
        let sampler = ["--sampler", "independent"];
        let (adaptive, mean) =
            replicates(dir.path(), &file, &[&sampler[..], &["--adaptive", "--noise", goal]].concat(), 1);
        let (plain, _) = replicates(dir.path(), &file, &[&sampler[..], &["--spp", "256"]].concat(), 101);
        let verdict = welch(&adaptive, &plain);
        println!("{name}: {mean:.1} samples a pixel, {verdict}");
        assert!(verdict.agrees(2), "{name}: {verdict}");
        // Negative control: less light, by as little as one bounce contributes.
        let (darker, _) = replicates(
            dir.path(),
            &file,
            &[&sampler[..], &["--spp", "256", "--max-depth", "3"]].concat(),
            201,
        );
        assert!(!welch(&adaptive, &darker).agrees(2), "{name}: nothing is told apart");
    }
}

/// A ball before an empty background: two thirds of the pixels are noise-free.
const ALONE: &str = r#"
    camera = { eye = [0, -6, 0], look_at = [0, 0, 0], vertical_fov = 40 }
    environment = { radiance = [0.15, 0.2, 0.3] }
    entities = [
        { shape = { type = "sphere", center = [0, 0, 0], radius = 1.2 }, material = "white" },
        { shape = { type = "sphere", center = [2, -2, 4], radius = 0.7 }, material = "white", emission = [12, 11, 9] },
    ]
    [materials]
    white = { type = "matte", reflectance = [0.8, 0.8, 0.8] }
"#;

// The seeds are fixed, so that the result does not vary. The converged pictures have at least 20 times the
// samples, so that their own error increases the figures by at most 2.5%.
#[test]
fn the_requested_error_is_reached_with_fewer_samples_for_uneven_noise() {
    for (name, goal, converged, most) in [
        ("cover", 0.17, "1500", 1.03),
        ("smallpt", 0.38, "2000", 1.1),
        ("room", 0.14, "2500", 1.1),
        ("alone", 0.1, "2500", 0.5),
    ] {
        let dir = folder();
        fs::write(dir.path().join("alone.toml"), ALONE).expect("a scene");
        let file = if name == "alone" { "alone.toml".to_owned() } else { scene(name) };
        let go = |more: &[&str]| {
            said(dir.path(), 0, &render(&file, "80x60", &[more, &["--stats", "s.json"]].concat()));
            stats(dir.path())["spp"].as_f64().expect("a number")
        };
        let noise = |file: &str| {
            let told = run(dir.path(), &["compare", file, "reference.exr", "--json"]).stdout;
            let json: serde_json::Value = serde_json::from_slice(&told).expect("JSON");
            json["noise"].as_f64().expect("a number")
        };
        go(&["--spp", converged, "--seed", "1000", "-o", "reference.exr"]);
        let asked = goal.to_string();
        // The lamp is hit by chance, which is the only noise.
        let integrator = if name == "alone" { "path-naive" } else { "path" };
        let to_goal = ["--noise", &asked, "--integrator", integrator];
        let plain = go(&[&to_goal[..], &["-o", "plain.exr"]].concat());
        let adaptive = go(&[&to_goal[..], &["--adaptive", "-o", "a.exr"]].concat());
        let (of_plain, of_adaptive) = (noise("plain.exr") / goal, noise("a.exr") / goal);
        println!(
            "{name} to {goal}: {plain} samples give {of_plain:.3} of it, {adaptive:.1} adaptive ones {of_adaptive:.3}"
        );
        for ratio in [of_plain, of_adaptive] {
            assert!((0.8..1.2).contains(&ratio), "{name}: the error is {ratio} of {goal}");
        }
        // At equal errors.
        let cost = adaptive * of_adaptive.powi(2) / (plain * of_plain.powi(2));
        assert!(cost < most, "{name}: {cost} times the samples");
    }
}
