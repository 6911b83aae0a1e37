//! `stride render`, by the command line.

use crate::common::watched::{Watched, poll};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

fn cover() -> String {
    format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"))
}

/// Renders a scene in a folder; panics with the message on failure.
fn render(folder: &Path, scene: &str, arguments: &[&str]) {
    render_at("", folder, scene, arguments);
}

fn render_at(level: &str, folder: &Path, scene: &str, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", scene, "--headless"])
        .args(arguments)
        .current_dir(folder)
        .env("STRIDE_SIMD", level)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn stats(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&bytes(folder, name)).expect("JSON")
}

#[test]
fn any_number_of_threads_and_any_lanes_give_the_same_files() {
    let dir = folder();
    let small = ["--size", "64x48", "--spp", "9", "-q"];
    for scene in fs::read_dir(format!("{}/scenes", env!("CARGO_MANIFEST_DIR"))).expect("the scenes") {
        let scene = scene.expect("an entry").path();
        if scene.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let scene = scene.to_str().expect("a name in UTF-8");
        let mut first = None;
        for threads in ["1", "2", "3", "7", "16", "16"] {
            render(dir.path(), scene, &[&small[..], &["--threads", threads, "-o", "a.exr"]].concat());
            let file = bytes(dir.path(), "a.exr");
            assert!(first.get_or_insert_with(|| file.clone()) == &file, "{scene}: {threads} threads");
        }
        for level in stride::math::lanes::Level::available() {
            let level = level.to_string();
            render_at(&level, dir.path(), scene, &[&small[..], &["-o", "a.exr"]].concat());
            assert!(first.as_ref() == Some(&bytes(dir.path(), "a.exr")), "{scene}: {level}");
        }
        // Negative control: another seed gives another file.
        render(dir.path(), scene, &[&small[..], &["--seed", "77", "-o", "a.exr"]].concat());
        assert!(first.as_ref() != Some(&bytes(dir.path(), "a.exr")), "{scene}: the seed does nothing");
    }
}

#[test]
fn numbered_pictures_equal_shorter_renders() {
    let dir = folder();
    let size = ["--size", "40x30", "-q"];
    let long = ["--spp", "37", "--dump-at", "1,10,36,37", "-o", "a.exr", "-o", "a.png"];
    render(dir.path(), &cover(), &[&size[..], &long].concat());
    for spp in ["1", "10", "36", "37"] {
        render(dir.path(), &cover(), &[&size[..], &["--spp", spp, "-o", "b.exr", "-o", "b.png"]].concat());
        assert!(bytes(dir.path(), &format!("a-{spp}.exr")) == bytes(dir.path(), "b.exr"), "{spp} spp");
        assert!(bytes(dir.path(), &format!("a-{spp}.png")) == bytes(dir.path(), "b.png"), "{spp} spp");
    }
    assert!(bytes(dir.path(), "a-36.exr") != bytes(dir.path(), "a.exr"));
}

#[test]
fn a_crop_equals_that_part_of_the_whole() {
    let dir = folder();
    let common = ["--size", "40x30", "--spp", "4", "-q"];
    render(dir.path(), &cover(), &[&common[..], &["-o", "whole.png"]].concat());
    render(dir.path(), &cover(), &[&common[..], &["--crop", "7,11,16,8", "-o", "part.png"]].concat());
    let whole = image(&bytes(dir.path(), "whole.png"));
    let part = image(&bytes(dir.path(), "part.png"));
    assert_eq!((part.width(), part.height()), (16, 8));
    for (x, y, pixel) in part.enumerate_pixels() {
        assert_eq!(pixel, whole.get_pixel(x + 7, y + 11), "at {x},{y}");
    }
}

fn image(png: &[u8]) -> image::RgbImage {
    image::load_from_memory(png).expect("a PNG").to_rgb8()
}

#[test]
fn a_time_limit_ends_at_a_whole_sample_with_the_picture_of_a_plain_render() {
    let dir = folder();
    let start = Instant::now();
    let timed = ["--size", "64x48", "--time", "500ms", "-q", "-o", "a.exr", "--stats", "a.json"];
    render(dir.path(), &cover(), &timed);
    assert!(start.elapsed() < Duration::from_secs(20), "it took {:?}", start.elapsed());
    let spp = stats(dir.path(), "a.json")["spp"].as_f64().expect("a number");
    assert!(spp >= 1.0 && spp.fract() == 0.0, "{spp} spp");
    let spp = spp.to_string();
    render(dir.path(), &cover(), &["--size", "64x48", "--spp", &spp, "-q", "-o", "b.exr"]);
    assert!(bytes(dir.path(), "a.exr") == bytes(dir.path(), "b.exr"), "{spp} spp");
}

#[test]
fn a_dump_has_each_sample_once_and_its_mean_is_the_picture() {
    let dir = folder();
    let common = ["--size", "12x9", "--spp", "5", "--threads", "3", "-q", "-o", "a.exr"];
    render(dir.path(), &cover(), &[&common[..], &["--samples", "all.npy"]].concat());
    let with_dump = bytes(dir.path(), "a.exr");
    render(dir.path(), &cover(), &common);
    assert!(with_dump == bytes(dir.path(), "a.exr"), "dumping samples changes the picture");
    let file = bytes(dir.path(), "all.npy");
    let header = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
    let records: Vec<&[u8]> = file[header..].chunks(28).collect();
    assert_eq!(records.len(), 12 * 9 * 5);
    let word =
        |record: &[u8], i: usize| u32::from_le_bytes(record[4 * i..4 * i + 4].try_into().expect("4 bytes"));
    let mut seen: Vec<(u32, u32)> = records.iter().map(|r| (word(r, 0), word(r, 1))).collect();
    seen.sort_unstable();
    let all: Vec<(u32, u32)> =
        (0..12 * 9).flat_map(|pixel| (0..5).map(move |sample| (pixel, sample))).collect();
    assert_eq!(seen, all);
    for record in records {
        let (x, y) = (f32::from_bits(word(record, 2)), f32::from_bits(word(record, 3)));
        let (px, py) = ((word(record, 0) % 12) as f32 + 0.5, (word(record, 0) / 12) as f32 + 0.5);
        assert!((x - px).abs() <= 1.0 && (y - py).abs() <= 1.0, "a tent reaches one pixel far");
    }
}

#[test]
fn statistics_are_written() {
    let dir = folder();
    render(
        dir.path(),
        &cover(),
        &["--size", "40x30", "--spp", "8", "--threads", "2", "-q", "--stats", "s.json"],
    );
    let stats = stats(dir.path(), "s.json");
    assert_eq!(stats["samples"], 40 * 30 * 8);
    assert_eq!(stats["spp"], 8.0);
    assert_eq!(stats["threads"], 2);
    assert_eq!(stats["device"], "cpu");
    assert_eq!(stats["rejected"], 0);
    for key in ["seconds", "samples_per_second", "load_seconds", "build_seconds"] {
        assert!(stats[key].as_f64().is_some_and(|x| x >= 0.0), "{key}");
    }
    assert!(stats["rays"].as_u64() > stats["samples"].as_u64());
    assert!(dir.path().join("cover.png").exists(), "the default output");
}

#[test]
fn the_owner_overlay_shows_every_nth_pixel_in_one_colour() {
    let dir = folder();
    let arguments =
        ["--size", "50x10", "--spp", "1", "--threads", "25", "--overlay", "owner", "-q", "-o", "o.png"];
    render(dir.path(), &cover(), &arguments);
    let picture = image(&bytes(dir.path(), "o.png"));
    let colours: Vec<_> = picture.pixels().collect();
    for (place, colour) in colours.iter().enumerate() {
        assert_eq!(*colour, colours[place % 25]);
    }
    let mut distinct: Vec<_> = colours[..25].iter().map(|c| c.0).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 25);
}

#[cfg(unix)]
#[test]
fn an_interrupt_writes_the_picture_and_succeeds() {
    let dir = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command
        .args(["render", &cover(), "--headless", "--spp", "4000000000", "--size", "64x48", "-o", "a.exr"])
        .args(["--samples", "a.npy"])
        .current_dir(dir.path());
    let mut run = Watched::start(command, dir.path());
    // Until there are samples: the dump has a header before Ctrl-C is handled.
    run.wait_for("a.npy", |dump| fs::metadata(dump).map_or(0, |file| file.len()) >= 4096);
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(dir.path().join("a.exr").exists());
}

#[cfg(unix)]
#[test]
fn a_second_interrupt_ends_at_once() {
    let dir = folder();
    let out = dir.path().join("out");
    fs::create_dir(&out).expect("a writable folder");
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command
        .args(["render", &cover(), "--headless", "-q", "--spp", "4000000000", "--size", "64x48"])
        .args(["-o", "out/a.exr", "--samples", "a.npy"])
        .current_dir(dir.path());
    let mut run = Watched::start(command, dir.path());
    // Until there are samples: the dump has a header before Ctrl-C is handled.
    run.wait_for("a.npy", |dump| fs::metadata(dump).map_or(0, |file| file.len()) >= 4096);
    // After the first interrupt the picture cannot be written: the program retries until the second one.
    fs::rename(&out, dir.path().join("away")).expect("a folder");
    run.interrupt();
    run.hear("retrying");
    // Requests soon after the first one are the same one: `src/cli/stop.rs` tests the interval.
    poll("the end", || {
        run.interrupt();
        run.has_ended()
    });
    let (code, said) = run.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("stopped at once; no further files are written"), "{said}");
}

#[test]
fn the_last_line_of_progress_is_the_end() {
    for _ in 0..10 {
        let dir = folder();
        let output = Command::new(env!("CARGO_BIN_EXE_stride"))
            .args(["render", &cover(), "--headless", "--spp", "7", "--threads", "8", "--size", "40x30"])
            .current_dir(dir.path())
            .output()
            .expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.lines().rev().nth(1).is_some_and(|line| line.starts_with("7 spp in ")), "{said}");
        assert!(said.ends_with("wrote cover.png\n"), "{said}");
    }
}

#[cfg(feature = "broken-material")]
#[test]
fn invalid_samples_are_rejected_counted_and_traceable() {
    let dir = folder();
    let scene = r#"
        [film]
        width = 16
        height = 12
        [materials]
        broken = { type = "broken" }
        [[entities]]
        name = "wall"
        shape = { type = "plane", normal = [-1, 0, 0], distance = -3 }
        material = "broken"
        [environment]
        radiance = [1, 1, 1]
    "#;
    fs::write(dir.path().join("broken.toml"), scene).expect("a writable folder");
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_stride"))
            .args(arguments)
            .current_dir(dir.path())
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (
            String::from_utf8_lossy(&output.stdout).into_owned(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    };
    for extra in [&[][..], &["--samples", "all.npy"]] {
        let render = ["render", "broken.toml", "--headless", "--spp", "6", "--stats", "s.json"];
        let (_, said) = run(&[&render[..], extra].concat());
        let stats = stats(dir.path(), "s.json");
        // Every path hits the wall, and every weight of its material is invalid.
        assert_eq!(stats["rejected"], 16 * 12 * 6);
        let line = said.lines().find(|line| line.trim().starts_with("pixel ")).expect("a named sample");
        let numbers: Vec<&str> =
            line.split(|c: char| !c.is_ascii_digit()).filter(|s| !s.is_empty()).collect();
        let (told, _) = run(&["trace", "broken.toml", "--pixel", numbers[0], "--sample", numbers[1]]);
        for word in ["bounce 0", "\"wall\"", "\"broken\"", "a film rejects this sample"] {
            assert!(told.contains(word), "no {word:?} in {told}");
        }
    }
    let mut reasons = String::new();
    for sample in 0..24 {
        reasons += &run(&["trace", "broken.toml", "--pixel", "8,6", "--sample", &sample.to_string()]).0;
    }
    for reason in ["not a number", "infinite", "negative"] {
        assert!(reasons.contains(reason), "no sample is {reason}");
    }
}
