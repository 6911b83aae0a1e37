//! Film files as users meet them: renders that are killed and gone on with, shards, damage, and disks that fail.

mod common;

use common::watched::{Watched, kill_at_any_moment, kill_at_every_moment, kills};
use rand::RngExt;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use stride::output::open_film;
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

/// Runs and demands success; returns what was said on standard output and standard error.
fn succeed(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    (String::from_utf8_lossy(&output.stdout).into_owned(), said)
}

/// Runs and demands a refusal with this exit code; returns what was said.
fn refused(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// The arguments of a render of the cover without a window or a word, and more of them.
fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", scene, "--headless", "-q", "--size", "40x30"][..], more].concat()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Names of the films that were being written when their render was killed.
fn half_written(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.filter_map(|name| name.into_string().ok()).filter(|name| name.contains(".film-")).collect()
}

#[test]
fn killed_at_any_moment_and_gone_on_with_the_files_are_the_same() {
    let dir = folder();
    let scene = cover();
    let part = |spp: &str, threads: &str| {
        let begins = !dir.path().join("part.film").exists();
        let film = if begins { "--film" } else { "--resume" };
        let common = ["--spp", spp, "--threads", threads, "--checkpoint", "10ms", "-o", "part.exr"];
        stride(dir.path(), &render(&scene, &[&[film, "part.film"][..], &common].concat()))
    };
    // Nobody waits for its end, so that no machine is too quick for the kills.
    let (kills, mut within_writes) = (kills(8), 0);
    let stream = &mut Stream::new(kills, 0, 0);
    let killed = kill_at_any_moment(dir.path(), kills, 40, stream, |stream| {
        within_writes += usize::from(!half_written(dir.path()).is_empty());
        part("4000000000", &stream.random_range(1..=3).to_string())
    });
    assert_eq!(killed, kills, "a render without end has ended");
    let film = open_film(&dir.path().join("part.film")).expect("a film").read().expect("a whole film");
    let [_, most] = film.seen_range();
    // Then it is to end soon, and is killed while it writes what there is at the end.
    let spp = &(most + 1).to_string();
    let at_end = kill_at_every_moment(dir.path(), || {
        within_writes += usize::from(!half_written(dir.path()).is_empty());
        part(spp, "2")
    });
    println!(
        "{killed} kills on the way to {spp} samples, {at_end} at the end, {within_writes} within writes"
    );
    assert!(within_writes > 0, "no write was cut short");
    // What was begun when a render was killed has been swept up.
    assert_eq!(half_written(dir.path()), [""; 0]);
    succeed(dir.path(), &render(&scene, &["--spp", spp, "--film", "whole.film", "-o", "whole.exr"]));
    assert!(bytes(dir.path(), "part.exr") == bytes(dir.path(), "whole.exr"), "another picture");
    assert!(bytes(dir.path(), "part.film") == bytes(dir.path(), "whole.film"), "another film");
    // Negative control: another seed's files are others.
    succeed(dir.path(), &render(&scene, &["--spp", spp, "--seed", "9", "--film", "n.film", "-o", "n.exr"]));
    assert!(bytes(dir.path(), "n.exr") != bytes(dir.path(), "whole.exr"));
    assert!(bytes(dir.path(), "n.film") != bytes(dir.path(), "whole.film"));
}

#[test]
fn a_render_to_an_error_that_is_killed_ends_at_the_same_sample() {
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
    // It is a plain render of that many samples.
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
fn interrupted_and_gone_on_with_to_more_samples_than_were_asked_for_at_first() {
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
    // Nothing is left to do: the outputs are written all the same.
    succeed(dir.path(), &render(&scene, &["--resume", "b.film", "-o", "d.exr", "--stats", "d.json"]));
    assert!(bytes(dir.path(), "d.exr") == bytes(dir.path(), "c.exr"));
    let stats: serde_json::Value = serde_json::from_slice(&bytes(dir.path(), "d.json")).expect("JSON");
    assert_eq!(stats["samples"], stats["resumed_samples"]);
    assert_eq!(stats["spp"], f64::from(least + 700));
}

#[test]
fn shards_rendered_and_merged_in_any_order_are_the_whole() {
    let dir = folder();
    let scene = cover();
    let small = |more: &[&str]| -> Vec<String> {
        let base = ["render", &scene, "--headless", "-q", "--size", "12x9"];
        base.iter().chain(more).map(|&word| word.to_owned()).collect()
    };
    let go = |arguments: Vec<String>| {
        succeed(dir.path(), &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    };
    let outputs = ["whole.film", "whole.exr", "whole.png", "whole.hdr"];
    go(small(&[
        "--spp",
        "128",
        "--film",
        "whole.film",
        "-o",
        "whole.exr",
        "-o",
        "whole.png",
        "-o",
        "whole.hdr",
    ]));
    let stream = &mut Stream::new(64, 0, 0);
    let shuffle = |list: &mut Vec<usize>, stream: &mut Stream| {
        (1..list.len()).rev().for_each(|i| list.swap(i, stream.random_range(0..=i)));
    };
    let mut order: Vec<usize> = (0..64).collect();
    shuffle(&mut order, stream);
    for &shard in &order {
        let threads = stream.random_range(1..=3).to_string();
        let range = format!("{}..{}", 2 * shard, 2 * shard + 2);
        let film = format!("{shard}.film");
        go(small(&["--range", &range, "--threads", &threads, "--film", &film, "-o", "shard.exr"]));
    }
    let merge = |order: &[usize], outputs: &[&str]| {
        let films: Vec<String> = order.iter().map(|shard| format!("{shard}.film")).collect();
        let mut arguments = vec!["merge"];
        arguments.extend(films.iter().map(String::as_str));
        outputs.iter().for_each(|output| arguments.extend(["-o", output]));
        run(dir.path(), &arguments)
    };
    for _ in 0..2 {
        shuffle(&mut order, stream);
        let output = merge(&order, &["m.film", "m.exr", "m.png", "m.hdr"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        for whole in outputs {
            let merged = whole.replace("whole", "m");
            assert!(bytes(dir.path(), &merged) == bytes(dir.path(), whole), "{whole} differs");
        }
    }
    // In two steps.
    let (a, b) = order.split_at(17);
    assert!(merge(a, &["a.film"]).status.success() && merge(b, &["b.film"]).status.success());
    succeed(dir.path(), &["merge", "b.film", "a.film", "-o", "m.film", "-q"]);
    assert!(bytes(dir.path(), "m.film") == bytes(dir.path(), "whole.film"));
    // Negative control, and what is missing is told.
    order.retain(|&shard| shard != 30 && shard != 31);
    let output = merge(&order, &["m.film", "m.exr"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("missing: 60..64"), "{said}");
    assert!(bytes(dir.path(), "m.exr") != bytes(dir.path(), "whole.exr"));
    let (told, _) = succeed(dir.path(), &["info", "m.film"]);
    assert!(told.contains("samples     0..60, 64..128") && told.contains("missing     60..64"), "{told}");
    // It can't be gone on with; what is missing can be rendered.
    let gap = small(&["--resume", "m.film", "--spp", "200"]);
    let said = refused(dir.path(), 1, &gap.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(said.contains("--range"), "{said}");
    go(small(&["--range", "60..64", "--film", "gap.film", "-o", "shard.exr"]));
    succeed(dir.path(), &["merge", "m.film", "gap.film", "-o", "n.film", "-o", "m.exr"]);
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "whole.exr"));
    assert!(bytes(dir.path(), "n.film") == bytes(dir.path(), "whole.film"));
    // And what is whole can be gone on with.
    go(small(&["--resume", "n.film", "--spp", "130", "-o", "m.exr"]));
    go(small(&["--spp", "130", "-o", "longer.exr"]));
    assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "longer.exr"));
}

#[test]
fn films_that_do_not_belong_together_are_refused_with_the_reason() {
    let dir = folder();
    fs::copy(cover(), dir.path().join("scene.toml")).unwrap();
    let base = |more: &[&'static str]| render("scene.toml", &[&["-o", "a.exr", "--spp", "6"], more].concat());
    succeed(dir.path(), &base(&["--film", "a.film"]));
    let before = bytes(dir.path(), "a.film");
    let resume = |more: &[&'static str]| {
        let said = refused(dir.path(), 1, &base(&[&["--resume", "a.film"], more].concat()));
        assert!(bytes(dir.path(), "a.film") == before, "a refused film is changed");
        said
    };
    for (more, reason) in [
        (&["--seed", "2"][..], "its seed is 0, not 2"),
        (&["--integrator", "path-naive"], "its integrator is path, not path-naive"),
        (&["--sampler", "independent"], "its sampler is sobol, not independent"),
        (&["--max-depth", "2"], "its max depth is 5, not 2"),
        (&["--filter", "box"], "its filter is tent 1, not box 0.5"),
        (&["--crop", "1,1,5,5"], "its crop is 0,0,40,30, not 1,1,5,5"),
        (&["--dump-at", "5"], "it has 6 samples a pixel already"),
    ] {
        let said = resume(more);
        assert!(said.contains(reason), "{more:?}: {said}");
    }
    let fewer = render("scene.toml", &["--resume", "a.film", "--spp", "5"]);
    let said = refused(dir.path(), 1, &fewer);
    assert!(said.contains("it has the samples up to 6 already, and 0 to 5 are asked for"), "{said}");
    let size = ["render", "scene.toml", "--headless", "-q", "--size", "30x40", "--resume", "a.film"];
    assert!(refused(dir.path(), 1, &size).contains("its size is 40x30, not 30x40"));
    let shifted = render("scene.toml", &["--resume", "a.film", "--range", "3..9"]);
    assert!(refused(dir.path(), 1, &shifted).contains("goes on without a gap from sample 3"));
    let missing = render("scene.toml", &["--resume", "no.film"]);
    assert!(refused(dir.path(), 1, &missing).contains("there is no such file"));
    let both = render("scene.toml", &["--spp", "4", "--range", "0..4"]);
    assert!(refused(dir.path(), 2, &both).contains("--range"));
    let named = render("scene.toml", &["--spp", "4", "--film", "a.exr2"]);
    assert!(refused(dir.path(), 2, &named).contains(".film"));

    // Merging: the same samples twice, another seed, another format.
    succeed(dir.path(), &render("scene.toml", &["--film", "b.film", "--range", "5..9", "-o", "b.exr"]));
    let said = refused(dir.path(), 1, &["merge", "a.film", "b.film", "-o", "m.film"]);
    assert!(said.contains("a.film") && said.contains("b.film") && said.contains("5..6"), "{said}");
    let other = ["--film", "c.film", "--range", "6..9", "--seed", "2", "-o", "c.exr"];
    succeed(dir.path(), &render("scene.toml", &other));
    let said = refused(dir.path(), 1, &["merge", "a.film", "c.film", "-o", "m.exr"]);
    assert!(said.contains("different renders") && said.contains("seed"), "{said}");
    assert!(refused(dir.path(), 1, &["merge", "a.film", "a.exr", "-o", "m.exr"]).contains("no film"));
    refused(dir.path(), 2, &["merge", "a.film", "-o", "m.jpg"]);
    refused(dir.path(), 2, &["merge", "a.film"]);
    assert!(!dir.path().join("m.film").exists() && !dir.path().join("m.exr").exists());

    // What changes no sample may differ: threads, exposure, comments.
    let text = fs::read_to_string(dir.path().join("scene.toml")).unwrap();
    fs::write(dir.path().join("scene.toml"), format!("# The same scene.\n{text}")).unwrap();
    succeed(dir.path(), &base(&["--resume", "a.film", "--threads", "3", "--exposure", "2"]));
    let text = text.replacen("radius = 2", "radius = 1.9", 1);
    fs::write(dir.path().join("scene.toml"), text).unwrap();
    let said = refused(dir.path(), 1, &base(&["--resume", "a.film"]));
    assert!(
        said.contains("its scene differs in the shape of ") && said.contains("is not what it was"),
        "{said}"
    );
}

#[test]
fn samples_say_what_they_are_and_films_without_an_end_that_they_have_none() {
    let dir = folder();
    let scene = cover();
    succeed(dir.path(), &render(&scene, &["--spp", "3", "--samples", "a.npy", "-o", "a.exr"]));
    let told = succeed(dir.path(), &["info", "a.npy"]).0;
    for line in
        ["samples     3600 of 28 bytes", "size        40x30", "asked       0..3", "rendered    0,0,40,30"]
    {
        assert!(told.lines().any(|told| told == line), "no {line:?} in {told}");
    }
    fs::write(dir.path().join("b.npy"), &bytes(dir.path(), "a.npy")[..5000]).expect("written");
    assert!(refused(dir.path(), 1, &["info", "b.npy"]).contains("a part of it is missing"));
    let endless = ["--time", "50ms", "--range", "7..", "--film", "a.film", "-o", "a.exr"];
    succeed(dir.path(), &render(&scene, &endless));
    let told = succeed(dir.path(), &["info", "a.film"]).0;
    assert!(told.contains("asked       7..\n") && !told.contains("4294967295"), "{told}");
}

#[test]
fn films_and_pictures_say_what_they_are() {
    let dir = folder();
    let scene = cover();
    let common = ["--spp", "4", "--seed", "77", "--exposure", "1.5", "-o", "a.exr", "-o", "a.png"];
    succeed(dir.path(), &render(&scene, &[&common[..], &["--film", "a.film"]].concat()));
    let info = |file: &str| succeed(dir.path(), &["info", file]).0;
    let facts = [
        "program     stride ",
        "size        40x30",
        "filter      tent 1",
        "integrator  path",
        "sampler     sobol",
        "max depth   5",
        "seed        77",
        "device      cpu",
        "samples     0..4",
    ];
    for file in ["a.film", "a.exr"] {
        let told = info(file);
        for fact in facts {
            assert!(told.lines().any(|line| line.starts_with(fact)), "no {fact:?} of {file} in {told}");
        }
        let scene = told.lines().find_map(|line| line.strip_prefix("scene       ")).expect("a scene");
        assert!(scene.len() == 64 && scene.bytes().all(|c| c.is_ascii_hexdigit()), "{scene}");
    }
    assert!(info("a.film").contains("exposure    1.5"));
    // The exposure changes no sample, and an EXR does not tell it: it is the same file without.
    let before = bytes(dir.path(), "a.exr");
    succeed(dir.path(), &render(&scene, &["--spp", "4", "--seed", "77", "--threads", "1", "-o", "a.exr"]));
    assert!(bytes(dir.path(), "a.exr") == before);
    assert!(info("a.png").starts_with("picture     40×30 pixels\nformat      PNG: as it is shown"));
    let parts = info("a.film").lines().find(|line| line.starts_with("parts")).expect("parts").to_owned();
    assert!(parts.starts_with("parts       33 of the scene, "), "{parts}");
    assert!(refused(dir.path(), 2, &["info", "a.txt"]).contains(".film"));
    assert!(refused(dir.path(), 1, &["info", "no.exr"]).contains("no such file"));
}

#[test]
fn merged_films_are_shown_as_they_were_rendered_or_as_asked() {
    let (dir, scene) = (folder(), cover());
    let shown = |tone: &str, exposure: &str, name: &str| {
        let view = ["--tone", tone, "--exposure", exposure, "--spp", "4", "-o", name];
        succeed(dir.path(), &render(&scene, &[&view[..], &["--film", "last.film"]].concat()));
        bytes(dir.path(), name)
    };
    let (plain, brighter) = (shown("srgb", "1", "plain.png"), shown("filmic", "2", "brighter.png"));
    let filmic = shown("filmic", "1", "filmic.png");
    let merged = |film: &str, more: &[&str]| {
        succeed(dir.path(), &[&["merge", "-q", film, "-o", "m.png", "-o", "m.film"], more].concat());
        bytes(dir.path(), "m.png")
    };
    assert!(merged("last.film", &[]) == filmic);
    assert!(merged("last.film", &["--exposure", "2"]) == brighter);
    assert!(merged("last.film", &["--tone", "srgb"]) == plain);
    // What was asked for last is what the merged film says of itself.
    fs::rename(dir.path().join("m.film"), dir.path().join("plain.film")).expect("a film");
    assert!(merged("plain.film", &[]) == plain);
    assert!(plain != filmic && filmic != brighter, "negative control: tone and exposure show");
}

#[test]
fn a_damaged_film_is_never_read_as_good() {
    let dir = folder();
    let scene = cover();
    succeed(dir.path(), &render(&scene, &["--spp", "2", "--film", "a.film", "-o", "a.exr"]));
    let good = bytes(dir.path(), "a.film");
    let stream = &mut Stream::new(7, 0, 0);
    for round in 0..24_u32 {
        let mut bad = good.clone();
        match round {
            0 => bad.clear(),
            1..6 => bad.truncate(stream.random_range(1..good.len())),
            6 => bad.push(0),
            7..12 => bad[stream.random_range(0..700)] ^= 1 << (round % 8),
            _ => bad[stream.random_range(0..good.len())] ^= 1 << (round % 8),
        }
        fs::write(dir.path().join("bad.film"), &bad).unwrap();
        let commands = [
            render(&scene, &["--resume", "bad.film", "--spp", "3", "-o", "bad.exr"]),
            vec!["merge", "bad.film", "-o", "bad.exr"],
            vec!["info", "bad.film"],
        ];
        for arguments in commands {
            let said = refused(dir.path(), 1, &arguments);
            assert!(said.contains("bad.film") && !said.contains("panicked"), "round {round}: {said}");
        }
        assert!(!dir.path().join("bad.exr").exists() && bytes(dir.path(), "bad.film") == bad);
    }
    // Negative control: nothing is wrong with the film itself.
    succeed(dir.path(), &["info", "a.film"]);
}

#[cfg(unix)]
const ENDLESS: [&str; 5] = ["--spp", "4000000000", "--checkpoint", "20ms", "-o"];

/// The film at a path is good, and the picture is that of its samples.
#[cfg(unix)]
fn film_shows(dir: &Path, film: &str, picture: &str) {
    succeed(dir, &["merge", film, "-o", "check.exr"]);
    assert!(bytes(dir, "check.exr") == bytes(dir, picture), "the picture is not the film's");
}

#[cfg(unix)]
#[test]
fn a_folder_that_vanishes_and_comes_back_loses_nothing() {
    let dir = folder();
    let scene = cover();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    // The picture on the way is due long after the first film.
    let files = ["out/a.exr", "--dump-at", "20000", "--film", "out/a.film"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &[&ENDLESS[..], &files].concat())), &out);
    run.wait_for("a.film", Path::exists);
    fs::rename(&out, dir.path().join("away")).unwrap();
    run.hear("the film is tried again");
    run.hear("the picture is tried again");
    fs::rename(dir.path().join("away"), &out).unwrap();
    run.hear("is written again");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(0), "{said}");
    film_shows(dir.path(), "out/a.film", "out/a.exr");
    // The picture on the way is there too, and is what it should be.
    succeed(dir.path(), &render(&scene, &["--spp", "20000", "-o", "b.exr"]));
    assert!(bytes(dir.path(), "out/a-20000.exr") == bytes(dir.path(), "b.exr"));
}

#[cfg(unix)]
#[test]
fn what_has_no_place_at_the_end_is_put_elsewhere() {
    let dir = folder();
    let scene = cover();
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    let files = ["out/a.exr", "-o", "out/a.png", "--film", "out/a.film"];
    let mut run = Watched::start(stride(dir.path(), &render(&scene, &[&ENDLESS[..], &files].concat())), &out);
    run.wait_for("a.film", Path::exists);
    fs::rename(&out, dir.path().join("away")).unwrap();
    run.hear("the film is tried again");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(1));
    for words in
        ["trying again", "is \"./a.film\" instead", "is \"./a.exr\" instead", "is \"./a.png\" instead"]
    {
        assert!(said.contains(words), "{said}");
    }
    assert!(dir.path().join("a.png").exists());
    film_shows(dir.path(), "a.film", "a.exr");
}

#[cfg(unix)]
#[test]
fn a_disk_without_room_for_the_film_still_takes_the_picture() {
    let dir = folder();
    // A limit on the size of files stands in for a full disk: the film has 77 kB, a small PNG fewer than 20.
    let scene = cover();
    let arguments = render(&scene, &[&ENDLESS[..], &["a.png", "--film", "a.film"]].concat());
    let mut command = Command::new("bash");
    command.args(["-c", "trap '' XFSZ; ulimit -f 40; exec \"$@\"", "bash", env!("CARGO_BIN_EXE_stride")]);
    command.args(arguments).current_dir(dir.path());
    let mut run = Watched::start(command, dir.path());
    run.hear("the film is tried again");
    run.hear("the film is tried again");
    run.interrupt();
    let (code, said) = run.end();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("cannot write \"a.film\""), "{said}");
    image::open(dir.path().join("a.png")).expect("a picture");
    let names: Vec<_> = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a.png"], "nothing half-written is left");
}

#[cfg(unix)]
#[test]
fn a_locked_folder_is_told_of_and_written_when_it_opens() {
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

#[test]
fn a_merge_does_not_replace_what_it_merges() {
    let dir = folder();
    let scene = cover();
    for (range, film) in [("0..1", "a.film"), ("1..2", "b.film")] {
        succeed(dir.path(), &render(&scene, &["--range", range, "--film", film, "-o", "a.exr"]));
    }
    let before = [bytes(dir.path(), "a.film"), bytes(dir.path(), "b.film")];
    let mut others = vec!["b.film", "./b.film"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("b.film", dir.path().join("link.film")).unwrap();
        fs::hard_link(dir.path().join("b.film"), dir.path().join("twin.film")).unwrap();
        others.extend(["link.film", "twin.film"]);
    }
    for other in others {
        let said = refused(dir.path(), 2, &["merge", "a.film", "b.film", "-o", "m.film", "-o", other]);
        assert!(said.contains("replace") && said.contains(other) && said.contains("b.film"), "{said}");
        assert!(!dir.path().join("m.film").exists());
    }
    assert!([bytes(dir.path(), "a.film"), bytes(dir.path(), "b.film")] == before);
    // Negative control.
    succeed(dir.path(), &["merge", "a.film", "b.film", "-o", "m.film"]);
}
