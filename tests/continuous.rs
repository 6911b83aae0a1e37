//! Continuous films as users meet them: samples that count in every pixel within the filter's reach.

mod common;

use common::tiles::{Replicates, welch};
use rand::RngExt;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};
use stride::film::Picture;
use stride::film::noise::root_mean_without_worst;
use stride::output::read_picture;
use stride::sampling::Stream;

fn cover() -> String {
    format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"))
}

fn stride(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    stride(folder, arguments).output().expect("the program starts")
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

fn refused(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// A render of the cover without a window or a word.
fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", scene, "--headless", "-q"][..], more].concat()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn picture(folder: &Path, name: &str) -> Picture {
    read_picture(&folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}")).1
}

const SMALL: [&str; 4] = ["--size", "40x30", "--filter", "mitchell"];

#[test]
fn threads_lanes_and_shards_in_any_order_give_the_same_files() {
    let (dir, scene) = (folder(), cover());
    let whole = [&SMALL[..], &["--spp", "12", "-o", "whole.exr", "--film", "whole.film"]].concat();
    succeed(dir.path(), &render(&scene, &whole));
    for threads in ["1", "2", "3", "40", "200"] {
        let part = [&SMALL[..], &["--spp", "12", "--threads", threads, "-o", "a.exr", "--film", "a.film"]];
        succeed(dir.path(), &render(&scene, &part.concat()));
        assert!(bytes(dir.path(), "a.exr") == bytes(dir.path(), "whole.exr"), "{threads} threads");
        assert!(bytes(dir.path(), "a.film") == bytes(dir.path(), "whole.film"), "{threads} threads");
    }
    for level in ["scalar", "portable", "avx2"] {
        let part = render(&scene, &[&SMALL[..], &["--spp", "12", "-o", "a.exr"]].concat());
        let output = stride(dir.path(), &part).env("STRIDE_SIMD", level).output().expect("it starts");
        if level == "avx2" && !output.status.success() {
            println!("skipped: this processor has no AVX2");
            continue;
        }
        assert!(bytes(dir.path(), "a.exr") == bytes(dir.path(), "whole.exr"), "{level}");
    }
    // Twelve shards, merged in another order.
    let names: Vec<String> = (0..12).map(|i| format!("{}.film", (i * 7 + 5) % 12)).collect();
    for (i, name) in (0..12).map(|i| (i, format!("{i}.film"))) {
        let (range, threads) = (format!("{i}..{}", i + 1), (1 + i % 3).to_string());
        let shard = ["--range", &range, "--threads", &threads, "--film", &name, "-o", "shard.png"];
        succeed(dir.path(), &render(&scene, &[&SMALL[..], &shard].concat()));
    }
    let films: Vec<&str> = names.iter().map(String::as_str).collect();
    succeed(dir.path(), &[&["merge", "-q"], &films[..], &["-o", "m.exr", "-o", "m.film"]].concat());
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "whole.exr"));
    assert!(picture(dir.path(), "m.exr") == picture(dir.path(), "whole.exr"));
    // Negative controls: one shard less, another filter, another mode.
    succeed(dir.path(), &[&["merge", "-q"], &films[1..], &["-o", "m.exr"]].concat());
    assert!(picture(dir.path(), "m.exr") != picture(dir.path(), "whole.exr"));
    for other in [["--filter", "tent"], ["--filter", "lanczos"]] {
        let arguments =
            ["--size", "40x30", "--film-mode", "continuous", "--range", "12..13", "--film", "o.film"];
        succeed(dir.path(), &render(&scene, &[&other[..], &arguments, &["-o", "o.exr"]].concat()));
        let said = refused(dir.path(), 1, &["merge", "whole.film", "o.film", "-o", "m.exr"]);
        assert!(said.contains("its filter is"), "{said}");
    }
    let arguments =
        ["--size", "40x30", "--filter", "tent", "--range", "13..14", "--film", "p.film", "-o", "p.exr"];
    succeed(dir.path(), &render(&scene, &arguments));
    let tent = ["--size", "40x30", "--filter", "tent", "--film-mode", "continuous", "--film", "q.film"];
    succeed(dir.path(), &render(&scene, &[&tent[..], &["--range", "12..13", "-o", "q.exr"]].concat()));
    let said = refused(dir.path(), 1, &["merge", "p.film", "q.film", "-o", "m.exr"]);
    assert!(said.contains("its mode is continuous, not importance"), "{said}");
}

// Of 320×240 pixels a checkpoint takes three pieces, and what is added meanwhile lies before, behind or across them.
#[test]
fn killed_at_random_moments_and_gone_on_with_the_files_are_the_same() {
    let (dir, scene) = (folder(), cover());
    let common =
        ["--size", "320x240", "--filter", "lanczos", "--integrator", "path-naive", "--max-depth", "1"];
    let spp = ["--spp", "120"];
    succeed(
        dir.path(),
        &render(&scene, &[&common[..], &spp, &["--film", "whole.film", "-o", "whole.exr"]].concat()),
    );
    let stream = &mut Stream::new(5, 0, 0);
    let mut killed = 0;
    for round in 0..40 {
        let begins = !dir.path().join("part.film").exists();
        let film: &[&str] = if begins { &["--film", "part.film"] } else { &["--resume", "part.film"] };
        let threads = stream.random_range(1..=3).to_string();
        let more = ["--threads", &threads, "--checkpoint", "5ms", "-o", "part.exr"];
        let mut child = stride(dir.path(), &render(&scene, &[&common[..], &spp, film, &more].concat()))
            .spawn()
            .expect("the program starts");
        let (start, moment) = (Instant::now(), Duration::from_micros(stream.random_range(20_000..300_000)));
        let ended = loop {
            if let Some(status) = child.try_wait().expect("a child") {
                break Some(status);
            }
            if start.elapsed() >= moment && round < 39 && killed < 6 {
                break None;
            }
            std::thread::sleep(Duration::from_micros(300));
        };
        if let Some(status) = ended {
            assert!(status.success());
            break;
        }
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");
        killed += 1;
    }
    println!("{killed} kills");
    assert!(killed >= 2, "only {killed} kills");
    assert!(bytes(dir.path(), "part.exr") == bytes(dir.path(), "whole.exr"), "another picture");
    assert!(bytes(dir.path(), "part.film") == bytes(dir.path(), "whole.film"), "another film");
}

#[test]
fn a_crop_is_the_part_of_the_whole_with_what_reaches_into_it() {
    let (dir, scene) = (folder(), cover());
    for filter in ["mitchell", "lanczos", "blackman-harris"] {
        let common = ["--size", "40x30", "--filter", filter, "--spp", "3"];
        succeed(dir.path(), &render(&scene, &[&common[..], &["-o", "whole.exr"]].concat()));
        let whole = picture(dir.path(), "whole.exr");
        for [x, y, width, height] in [[3, 0, 9, 5], [0, 0, 40, 30], [20, 14, 1, 1], [30, 20, 10, 10]] {
            let crop = format!("{x},{y},{width},{height}");
            let layers = ["--layers", "samples,depth", "--film", "c.film", "-o", "c.exr"];
            succeed(dir.path(), &render(&scene, &[&common[..], &["--crop", &crop], &layers].concat()));
            let part = picture(dir.path(), "c.exr");
            assert_eq!([part.width, part.height], [width, height]);
            for (i, rgb) in (0..).zip(&part.rgb) {
                let place = (y + i / width) * 40 + x + i % width;
                assert_eq!(*rgb, whole.rgb[place as usize], "{filter}, pixel {i} of {crop}");
            }
            succeed(dir.path(), &["merge", "-q", "c.film", "-o", "m.exr"]);
            assert!(picture(dir.path(), "m.exr") == part, "a film of {crop}");
        }
    }
}

#[test]
fn pictures_at_barriers_are_those_of_plain_renders() {
    let (dir, scene) = (folder(), cover());
    let dumps = ["--spp", "9", "--dump-at", "1,4,9", "--threads", "3", "-o", "a.exr", "--film", "a.film"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &dumps].concat()));
    for spp in ["1", "4", "9"] {
        succeed(dir.path(), &render(&scene, &[&SMALL[..], &["--spp", spp, "-o", "plain.exr"]].concat()));
        let name = format!("a-{spp}.exr");
        assert!(bytes(dir.path(), &name) == bytes(dir.path(), "plain.exr"), "{spp}");
    }
    assert!(bytes(dir.path(), "a-9.exr") == bytes(dir.path(), "a.exr"));
    assert!(bytes(dir.path(), "a-4.exr") != bytes(dir.path(), "a.exr"));
    // To an error, with pictures on the way, and gone on with.
    let noise =
        ["--noise", "0.02", "--dump-at", "3,20", "-o", "n.exr", "--film", "n.film", "--stats", "n.json"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &noise, &["--spp", "4000"]].concat()));
    let stats: serde_json::Value = serde_json::from_slice(&bytes(dir.path(), "n.json")).expect("JSON");
    let spp = stats["spp"].as_f64().expect("a number") as u64;
    assert!(spp > 20 && spp < 4000, "{spp}");
    let (plain, half) = (spp.to_string(), (spp / 3).to_string());
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &["--spp", &plain, "-o", "plain.exr"]].concat()));
    assert!(bytes(dir.path(), "n.exr") == bytes(dir.path(), "plain.exr"));
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &["--spp", "20", "-o", "plain.exr"]].concat()));
    assert!(bytes(dir.path(), "n-20.exr") == bytes(dir.path(), "plain.exr"));
    let begun = ["--noise", "0.02", "--spp", &half, "-o", "h.exr", "--film", "h.film"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &begun].concat()));
    let rest = ["--noise", "0.02", "--spp", "4000", "--resume", "h.film", "-o", "h.exr", "--threads", "1"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &rest].concat()));
    assert!(bytes(dir.path(), "h.exr") == bytes(dir.path(), "n.exr"));
}

#[test]
fn what_does_not_go_together_says_so() {
    let (dir, scene) = (folder(), cover());
    succeed(
        dir.path(),
        &render(&scene, &[&SMALL[..], &["--spp", "2", "--film", "a.film", "-o", "a.exr"]].concat()),
    );
    let other = ["--size", "40x30", "--filter", "lanczos", "--resume", "a.film", "--spp", "3"];
    let said = refused(dir.path(), 1, &render(&scene, &other));
    assert!(said.contains("its filter is mitchell 2"), "{said}");
    let tent = ["--size", "40x30", "--filter", "tent", "--resume", "a.film", "--spp", "3"];
    assert!(refused(dir.path(), 1, &render(&scene, &tent)).contains("filter"));
}

// Filters that can be drawn from are drawn from and weighed with: two estimators of the same picture, apart from the
// film's border, beyond which a continuous film has no samples. Level 0.01 (see `tiles`).
#[test]
fn drawing_from_a_filter_and_weighing_with_it_give_the_same_picture() {
    let (dir, scene) = (folder(), cover());
    let size = [24, 16];
    let replicates = |filter: &str, mode: &str, seed: u32| {
        Replicates::of(size, 1, |replicate, tell| {
            let seed = (seed + replicate).to_string();
            let common = ["--size", "40x32", "--crop", "8,8,24,16", "--spp", "16", "--seed", &seed];
            let film = ["--filter", filter, "--film-mode", mode, "-o", "a.exr"];
            succeed(dir.path(), &render(&scene, &[&common[..], &film].concat()));
            for (pixel, rgb) in (0..).zip(&picture(dir.path(), "a.exr").rgb) {
                tell(pixel, rgb.map(f64::from));
            }
        })
    };
    let filters = ["box", "tent", "gaussian", "blackman-harris"];
    let drawn = [0, 1, 2, 3].map(|i| replicates(filters[i], "importance", 100 * i as u32));
    for (i, filter) in filters.into_iter().enumerate() {
        let weighed = replicates(filter, "continuous", 1000 + 100 * i as u32);
        let verdict = welch(&drawn[i], &weighed);
        println!("{filter}: {verdict}");
        assert!(verdict.agrees(filters.len()), "{filter}: {verdict}");
    }
    // Negative control: darker by a tenth.
    let dim = Replicates::of(size, 1, |replicate, tell| {
        let seed = (2000 + replicate).to_string();
        let common =
            ["--size", "40x32", "--crop", "8,8,24,16", "--spp", "16", "--seed", &seed, "-o", "a.exr"];
        succeed(dir.path(), &render(&scene, &[&common[..], &["--filter", "box"]].concat()));
        for (pixel, rgb) in (0..).zip(&picture(dir.path(), "a.exr").rgb) {
            tell(pixel, rgb.map(|c| 0.9 * f64::from(c)));
        }
    });
    let verdict = welch(&drawn[0], &dim);
    assert!(!verdict.agrees(filters.len()), "{verdict}");
}

#[test]
fn at_equal_samples_a_good_filter_has_a_smaller_error_than_a_box() {
    let (dir, scene) = (folder(), cover());
    let error = |film: &[&str]| {
        let common = ["--size", "80x60", "--seed", "7", "-o", "a.exr"];
        succeed(dir.path(), &render(&scene, &[&common[..], film, &["--spp", "16"]].concat()));
        let rough = picture(dir.path(), "a.exr");
        succeed(dir.path(), &render(&scene, &[&common[..], film, &["--spp", "2048"]].concat()));
        let fine = picture(dir.path(), "a.exr");
        let channels = rough.rgb.as_flattened().iter().zip(fine.rgb.as_flattened());
        let error = |(a, b): (&f32, &f32)| f64::from((a - b) * (a - b) / (b * b + 0.01));
        root_mean_without_worst(channels.map(error).collect())
    };
    let boxed = error(&["--filter", "box"]);
    let continuous = |filter| error(&["--filter", filter, "--film-mode", "continuous"]);
    // The same samples in the same pixels.
    assert!((continuous("box") / boxed - 1.0).abs() < 1e-3);
    let errors =
        ["tent", "gaussian", "mitchell", "blackman-harris"].map(|filter| (filter, continuous(filter)));
    println!("box {boxed:.4}, {errors:.4?}");
    assert!(errors.iter().all(|(_, error)| *error < 0.9 * boxed), "{errors:?} against {boxed}");
}
