//! Continuous films, by the command line: samples are weighted in every pixel within the filter radius.

mod develop;

use crate::common::tiles::{Replicates, welch};
use crate::common::watched::{kill_at_any_moment, kill_at_every_moment, kills};
use rand::RngExt;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use stride::film::Picture;
use stride::film::noise::root_mean_without_worst;
use stride::output::{open_film, read_picture};
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

/// Its output.
fn succeed_with(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn refused(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// A quiet render of the cover without a window.
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
    // Of the layers that need no first hits, the sample count is available and the variance is not: it needs extra
    // sums.
    succeed(dir.path(), &["merge", "-q", "m.film", "--layers", "all", "-o", "l.exr"]);
    assert!(picture(dir.path(), "l.exr") == picture(dir.path(), "whole.exr"));
    let has = |name: &str| bytes(dir.path(), "l.exr").windows(name.len()).any(|at| at == name.as_bytes());
    assert!(has("samples.Y") && !has("variance.Y"));
    let said = refused(dir.path(), 2, &["merge", "m.film", "--layers", "variance", "-o", "l.exr"]);
    assert!(said.contains("begun without --layers variance"), "{said}");
    // Negative controls: one shard fewer, another filter, another mode.
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

#[test]
fn renders_killed_at_any_moment_are_resumed_to_the_same_files() {
    kill_and_go_on(&[], kills(6));
}

#[test]
fn killed_at_any_moment_a_film_keeps_its_variance_and_its_layers() {
    kill_and_go_on(&["--layers", "all"], kills(6).div_ceil(2));
}

// With 320×240 pixels a checkpoint has three pieces, and new samples lie before, after or across them.
fn kill_and_go_on(layers: &[&str], kills: u32) {
    let (dir, scene) = (folder(), cover());
    let common =
        ["--size", "320x240", "--filter", "lanczos", "--integrator", "path-naive", "--max-depth", "1"];
    let common = [&common[..], layers].concat();
    let part = |spp: &str, threads: &str| {
        let begins = !dir.path().join("part.film").exists();
        let film = if begins { "--film" } else { "--resume" };
        let more = [film, "part.film", "--spp", spp, "--threads", threads, "--checkpoint", "5ms"];
        stride(dir.path(), &render(&scene, &[&common[..], &more, &["-o", "part.exr"]].concat()))
    };
    // The render is endless, so that no machine is too fast for the kills.
    let stream = &mut Stream::new(5, 0, 0);
    let killed = kill_at_any_moment(dir.path(), kills, 60, stream, |stream| {
        part("4000000000", &stream.random_range(1..=3).to_string())
    });
    assert_eq!(killed, kills, "a render without end has ended");
    let film = open_film(&dir.path().join("part.film")).expect("a film").read().expect("a whole film");
    let spp = &(film.seen_range()[1] + 1).to_string();
    let at_end = kill_at_every_moment(dir.path(), || part(spp, "2"));
    println!("{killed} kills on the way to {spp} samples, {at_end} at the end");
    let whole = ["--spp", spp, "--film", "whole.film", "-o", "whole.exr"];
    succeed(dir.path(), &render(&scene, &[&common[..], &whole].concat()));
    assert!(bytes(dir.path(), "part.exr") == bytes(dir.path(), "whole.exr"), "another picture");
    assert!(bytes(dir.path(), "part.film") == bytes(dir.path(), "whole.film"), "another film");
}

/// The values of a channel of an EXR file, beside colour.
fn channel(folder: &Path, name: &str, channel: &str) -> Vec<f32> {
    let image = exr::prelude::read_first_flat_layer_from_file(folder.join(name)).expect("an EXR file");
    let found = image.layer_data.channel_data.list.iter().find(|there| there.name.to_string() == channel);
    found.unwrap_or_else(|| panic!("{name} has no {channel}")).sample_data.values_as_f32().collect()
}

#[test]
fn variances_are_the_same_for_all_workers_and_other_films_are_unchanged() {
    let (dir, scene) = (folder(), cover());
    let spread = [&SMALL[..], &["--layers", "variance,samples"]].concat();
    let whole = ["--spp", "12", "-o", "whole.exr", "--film", "whole.film", "--samples", "s.npy"];
    succeed(dir.path(), &render(&scene, &[&spread[..], &whole].concat()));
    let is_whole = |exr: &str, film: Option<&str>, what: &str| {
        assert!(bytes(dir.path(), exr) == bytes(dir.path(), "whole.exr"), "{what}");
        assert!(film.is_none_or(|film| bytes(dir.path(), film) == bytes(dir.path(), "whole.film")), "{what}");
    };
    for threads in ["1", "3", "200"] {
        let part = ["--spp", "12", "--threads", threads, "-o", "a.exr", "--film", "a.film"];
        succeed(dir.path(), &render(&scene, &[&spread[..], &part].concat()));
        is_whole("a.exr", Some("a.film"), threads);
    }
    for level in ["scalar", "portable"] {
        let part = render(&scene, &[&spread[..], &["--spp", "12", "-o", "a.exr"]].concat());
        let output = stride(dir.path(), &part).env("STRIDE_SIMD", level).output().expect("it starts");
        assert!(output.status.success());
        is_whole("a.exr", None, level);
    }
    // Resumed, once by a render that does not request layers.
    succeed(
        dir.path(),
        &render(&scene, &[&spread[..], &["--spp", "3", "--film", "p.film"], &["-o", "p.exr"]].concat()),
    );
    succeed(
        dir.path(),
        &render(&scene, &[&SMALL[..], &["--spp", "7", "--resume", "p.film", "-o", "p.exr"]].concat()),
    );
    succeed(
        dir.path(),
        &render(&scene, &[&spread[..], &["--spp", "12", "--resume", "p.film", "-o", "p.exr"]].concat()),
    );
    is_whole("p.exr", Some("p.film"), "resumed");
    // Shards, with the layers of their renders.
    for (i, range) in ["0..5", "5..6", "6..12"].into_iter().enumerate() {
        let name = format!("{i}.film");
        let shard = ["--range", range, "--film", &name, "-o", "shard.exr"];
        succeed(dir.path(), &render(&scene, &[&spread[..], &shard].concat()));
    }
    succeed(dir.path(), &["merge", "-q", "2.film", "0.film", "1.film", "-o", "m.exr", "-o", "m.film"]);
    is_whole("m.exr", Some("m.film"), "merged");
    succeed(
        dir.path(),
        &["develop", "-q", "s.npy", "--filter", "mitchell", "--layers", "all", "-o", "d.exr"],
    );
    is_whole("d.exr", None, "developed");
    let variance = channel(dir.path(), "whole.exr", "variance.Y");
    assert!(variance.iter().all(|v| v.is_finite() && *v >= 0.0));
    assert!(variance.iter().filter(|v| **v > 0.0).count() > 1000, "the cover is noisy");
    let told = succeed_with(dir.path(), &["info", "whole.film"]);
    assert!(told.contains("variance    the film has the sums for it"), "{told}");
    // Negative control: fewer samples.
    succeed(dir.path(), &["merge", "-q", "2.film", "0.film", "-o", "m.exr"]);
    assert!(channel(dir.path(), "m.exr", "variance.Y") != variance);
    // Without the layer, the picture is the same and pixels have 64 bytes.
    let plain = ["--spp", "12", "-o", "plain.exr", "--film", "plain.film"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &plain].concat()));
    assert!(picture(dir.path(), "plain.exr") == picture(dir.path(), "whole.exr"));
    let sizes = ["plain.film", "whole.film"].map(|name| bytes(dir.path(), name).len());
    // One of them requests its layers.
    assert_eq!(sizes[1] - sizes[0], 40 * 30 * 64 + "layers: variance,samples\n".len());
    // In a crop it equals that of the whole.
    let crop = ["--spp", "12", "--crop", "9,8,12,10", "-o", "c.exr"];
    succeed(dir.path(), &render(&scene, &[&spread[..], &crop].concat()));
    let part = channel(dir.path(), "c.exr", "variance.Y");
    for (i, value) in part.iter().enumerate() {
        assert_eq!(*value, variance[(8 + i / 12) * 40 + 9 + i % 12], "pixel {i}");
    }
}

#[test]
fn a_variance_without_its_sums_is_refused_or_omitted_with_a_message() {
    let (dir, scene) = (folder(), cover());
    let shard = |name: &str, range: &str, layers: &[&str]| {
        let film = ["--range", range, "--film", name, "-o", "s.exr"];
        succeed(dir.path(), &render(&scene, &[&SMALL[..], layers, &film].concat()));
    };
    shard("with.film", "0..2", &["--layers", "variance"]);
    shard("without.film", "2..4", &[]);
    let more = ["--range", "2..6", "--resume", "without.film", "--layers", "variance", "-o", "s.exr"];
    let said = refused(dir.path(), 1, &render(&scene, &[&SMALL[..], &more].concat()));
    assert!(said.contains("begun without --layers variance"), "{said}");
    for films in [["with.film", "without.film"], ["without.film", "with.film"]] {
        let merge = [&["merge"], &films[..], &["-o", "m.exr", "-o", "m.film"]].concat();
        let said = succeed(dir.path(), &merge);
        assert!(said.contains("without the layer variance: \"without.film\" is"), "{said}");
        let said = refused(dir.path(), 2, &[&merge[..], &["--layers", "variance"]].concat());
        assert!(said.contains("\"without.film\" is in mode"), "{said}");
    }
    let plain = ["--spp", "4", "-o", "plain.exr", "--film", "plain.film"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &plain].concat()));
    assert!(picture(dir.path(), "m.exr") == picture(dir.path(), "plain.exr"));
    assert!(succeed(dir.path(), &["merge", "with.film", "-o", "m.exr"]).contains("wrote m.exr\n"));
}

// A filter that gives each sample to one pixel: the same samples in the same pixels as without weights.
#[test]
fn the_variance_with_a_box_equals_that_of_unweighted_samples() {
    let (dir, scene) = (folder(), cover());
    let common = ["--size", "40x30", "--spp", "9", "--filter", "box", "--layers", "variance", "-o", "a.exr"];
    let of = |more: &[&str]| {
        succeed(dir.path(), &render(&scene, &[&common[..], more].concat()));
        channel(dir.path(), "a.exr", "variance.Y")
    };
    // A sample on the border of two pixels may belong to either.
    let differ = |a: &[f32], b: &[f32]| {
        let scale = a.iter().fold(0.0_f32, |most, v| most.max(*v));
        a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 1e-5 * (0.01 * scale + **a)).count()
    };
    let (drawn, weighed) = (of(&["--film-mode", "importance"]), of(&["--film-mode", "continuous"]));
    assert!(differ(&drawn, &weighed) <= 2, "{}", differ(&drawn, &weighed));
    assert!(differ(&drawn, &of(&["--film-mode", "continuous", "--seed", "1"])) > 1000);
}

#[test]
fn a_crop_includes_contributions_from_around_it() {
    let (dir, scene) = (folder(), cover());
    for filter in ["mitchell", "lanczos", "blackman-harris"] {
        let common = ["--size", "40x30", "--filter", filter, "--spp", "3"];
        succeed(
            dir.path(),
            &render(&scene, &[&common[..], &["--layers", "depth", "-o", "whole.exr"]].concat()),
        );
        let (whole, depth) = (picture(dir.path(), "whole.exr"), channel(dir.path(), "whole.exr", "depth.Z"));
        for [x, y, width, height] in [[3, 0, 9, 5], [0, 0, 40, 30], [20, 14, 1, 1], [30, 20, 10, 10]] {
            let crop = format!("{x},{y},{width},{height}");
            let layers = ["--layers", "samples,depth", "--film", "c.film", "-o", "c.exr"];
            succeed(dir.path(), &render(&scene, &[&common[..], &["--crop", &crop], &layers].concat()));
            let part = picture(dir.path(), "c.exr");
            assert_eq!([part.width, part.height], [width, height]);
            let part_depth = channel(dir.path(), "c.exr", "depth.Z");
            for (i, rgb) in (0..).zip(&part.rgb) {
                let place = (y + i / width) * 40 + x + i % width;
                assert_eq!(*rgb, whole.rgb[place as usize], "{filter}, pixel {i} of {crop}");
                assert_eq!(part_depth[i as usize], depth[place as usize], "{filter}, pixel {i} of {crop}");
            }
            succeed(dir.path(), &["merge", "-q", "c.film", "-o", "m.exr"]);
            assert!(bytes(dir.path(), "m.exr") == bytes(dir.path(), "c.exr"), "a film of {crop}");
        }
    }
}

#[test]
fn pictures_at_barriers_equal_plain_renders() {
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
    // To an error, with numbered pictures, and resumed.
    let noise =
        ["--noise", "0.11", "--dump-at", "3,20", "-o", "n.exr", "--film", "n.film", "--stats", "n.json"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &noise, &["--spp", "4000"]].concat()));
    let stats: serde_json::Value = serde_json::from_slice(&bytes(dir.path(), "n.json")).expect("JSON");
    let spp = stats["spp"].as_f64().expect("a number") as u64;
    assert!(spp > 20 && spp < 4000, "{spp}");
    let (plain, half) = (spp.to_string(), (spp / 3).to_string());
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &["--spp", &plain, "-o", "plain.exr"]].concat()));
    assert!(bytes(dir.path(), "n.exr") == bytes(dir.path(), "plain.exr"));
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &["--spp", "20", "-o", "plain.exr"]].concat()));
    assert!(bytes(dir.path(), "n-20.exr") == bytes(dir.path(), "plain.exr"));
    let begun = ["--noise", "0.11", "--spp", &half, "-o", "h.exr", "--film", "h.film"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &begun].concat()));
    let rest = ["--noise", "0.11", "--spp", "4000", "--resume", "h.film", "-o", "h.exr", "--threads", "1"];
    succeed(dir.path(), &render(&scene, &[&SMALL[..], &rest].concat()));
    assert!(bytes(dir.path(), "h.exr") == bytes(dir.path(), "n.exr"));
}

#[test]
fn contradictory_arguments_are_explained() {
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

// Filters that can be sampled are sampled and used as weights: two estimators of the same picture, except for the
// film's border, beyond which a continuous film has no samples. Level 0.01 (see `tiles`).
#[test]
fn importance_sampling_and_weighting_by_a_filter_give_the_same_picture() {
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

/// Whether the message of a failed device says that there is none.
fn lacks_a_gpu(output: &Output) -> bool {
    let said = String::from_utf8_lossy(&output.stderr);
    let lacks = !output.status.success()
        && (said.contains("no GPU was found") || said.contains("without GPU support"));
    if lacks {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "{said}");
        println!("skipped: {said}");
    }
    lacks
}

// Complete films with other random numbers on each side: this covers sampling, splatting, and the film's border.
// Level 0.01 (see `tiles`).
#[test]
fn a_continuous_film_of_a_gpu_matches_the_cpu_statistically() {
    let (dir, scene) = (folder(), cover());
    let common = ["--size", "40x24", "--spp", "16", "--filter", "mitchell", "-o", "a.exr"];
    let on = |device: &str, seed: &str, more: &[&str]| {
        let film = [&common[..], &["--device", device, "--seed", seed], more].concat();
        run(dir.path(), &render(&scene, &film))
    };
    if lacks_a_gpu(&on("gpu", "1", &[])) {
        return;
    }
    let replicates = |device: &str, first_seed: u32, more: &[&str]| {
        Replicates::of([40, 24], 1, |replicate, tell| {
            let output = on(device, &(first_seed + replicate).to_string(), more);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            for (pixel, rgb) in (0..).zip(&picture(dir.path(), "a.exr").rgb) {
                tell(pixel, rgb.map(f64::from));
            }
        })
    };
    let (gpu, cpu) = (replicates("gpu", 1, &[]), replicates("cpu", 101, &[]));
    let verdict = welch(&gpu, &cpu);
    println!("{verdict}");
    assert!(verdict.agrees(1), "{verdict}");
    // Negative control: less light, by as little as one bounce contributes.
    let darker = replicates("cpu", 201, &["--max-depth", "3"]);
    assert!(!welch(&gpu, &darker).agrees(1), "the difference is not detected");
}

#[test]
fn a_continuous_film_of_a_gpu_is_the_same_when_resumed_and_with_a_dump() {
    let (dir, scene) = (folder(), cover());
    let on = |more: &[&str]| {
        let common = ["--size", "40x30", "--filter", "lanczos", "--device", "gpu", "--crop", "3,2,31,24"];
        run(dir.path(), &render(&scene, &[&common[..], more].concat()))
    };
    let done = |more: &[&str]| {
        let output = on(more);
        assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
    };
    if lacks_a_gpu(&on(&["--spp", "12", "--film", "whole.film", "-o", "whole.exr"])) {
        return;
    }
    done(&["--spp", "5", "--film", "a.film", "-o", "a.exr"]);
    assert!(bytes(dir.path(), "a.exr") != bytes(dir.path(), "whole.exr"), "there are samples left to render");
    done(&["--spp", "12", "--resume", "a.film", "--film", "a.film", "-o", "a.exr"]);
    // With a dump, the accumulator adds the samples to the film.
    done(&["--spp", "12", "--film", "b.film", "-o", "b.exr", "--samples", "b.npy"]);
    for name in ["a", "b"] {
        for end in ["film", "exr"] {
            let (one, whole) = (format!("{name}.{end}"), format!("whole.{end}"));
            assert!(bytes(dir.path(), &one) == bytes(dir.path(), &whole), "{one}");
        }
    }
    // Negative control.
    done(&["--spp", "12", "--seed", "1", "--film", "c.film", "-o", "c.exr"]);
    assert!(bytes(dir.path(), "c.film") != bytes(dir.path(), "whole.film"));
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
