//! Resuming films: the end of the render, the layers of merged films, and the message about a missed error.

use serde_json::json;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Runs a command that must end with this exit code; returns its standard error.
fn said(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

fn info(folder: &Path, file: &str) -> String {
    String::from_utf8(run(folder, &["info", file]).stdout).expect("text")
}

fn stats(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("s.json")).expect("a file")).expect("JSON")
}

/// A small, quiet render of the cover.
fn render<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let cover = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml");
    [&["render", cover, "--headless", "-q", "--size", "24x18", "-o", "a.exr"][..], more].concat()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

#[test]
fn a_limit_of_time_or_error_replaces_the_requested_range_of_a_film() {
    let dir = folder();
    let begin = |name: &str| said(dir.path(), 0, &render(&["--spp", "4", "--film", name]));
    begin("a.film");
    let go_on = ["--resume", "a.film", "--noise", "0.2", "--stats", "s.json"];
    said(dir.path(), 0, &render(&go_on));
    let spp = stats(dir.path())["spp"].as_f64().expect("a number");
    assert!(spp > 16.0, "{spp}");
    begin("b.film");
    said(dir.path(), 0, &render(&["--resume", "b.film", "--time", "300ms", "--stats", "s.json"]));
    assert!(stats(dir.path())["spp"].as_f64().expect("a number") > 4.0);
    // Negative control: without a limit, the film's own end is kept, and --spp changes it.
    begin("c.film");
    said(dir.path(), 0, &render(&["--resume", "c.film", "--stats", "s.json"]));
    assert_eq!(stats(dir.path())["spp"], 4.0);
    let limited = ["--resume", "c.film", "--noise", "0.0001", "--spp", "20", "--stats", "s.json"];
    said(dir.path(), 0, &render(&limited));
    assert_eq!(stats(dir.path())["spp"], 20.0);
}

#[test]
fn spp_counts_from_sample_0_for_any_film() {
    let dir = folder();
    said(dir.path(), 0, &render(&["--range", "4..8", "--film", "a.film"]));
    said(dir.path(), 0, &render(&["--resume", "a.film", "--spp", "12"]));
    assert!(info(dir.path(), "a.film").contains("samples     4..12\n"));
    let text = said(dir.path(), 1, &render(&["--resume", "a.film", "--spp", "10"]));
    assert!(text.contains("it already has the samples up to 12, and 4 to 10 are requested"), "{text}");
    let text = said(dir.path(), 2, &render(&["--resume", "a.film", "--spp", "4"]));
    assert!(text.contains("begins with sample 4") && text.contains("--spp 4"), "{text}");
    // The same samples as those of a range, to the bit.
    said(dir.path(), 0, &render(&["--range", "4..12", "--film", "b.film"]));
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a film");
    assert!(bytes("a.film") == bytes("b.film"));
    said(dir.path(), 0, &render(&["--range", "4..11", "--film", "c.film"]));
    assert!(bytes("a.film") != bytes("c.film"));
}

#[test]
fn a_film_that_differs_from_its_facts_is_refused() {
    let dir = folder();
    let path = dir.path().join("a.film");
    said(dir.path(), 0, &render(&["--spp", "2", "--film", "a.film"]));
    let good = fs::read(&path).expect("a film");
    // Width and height of the film and of the shown part are swapped, with a valid digest.
    let mut forged = good.clone();
    for at in [16, 36] {
        forged[at..at + 8].rotate_left(4);
    }
    let end = forged.len() - 32;
    let digest = Sha256::digest(&forged[..end]);
    forged[end..].copy_from_slice(&digest);
    fs::write(&path, &forged).expect("a film");
    let text = said(dir.path(), 1, &render(&["--resume", "a.film", "--spp", "3"]));
    assert!(text.contains("it has 18×24 plain pixels, but its facts say 24×18"), "{text}");
    assert!(fs::read(&path).expect("a film") == forged);
    // Negative control.
    fs::write(&path, &good).expect("a film");
    said(dir.path(), 0, &render(&["--resume", "a.film", "--spp", "3"]));
}

#[test]
fn a_missed_error_is_reported_even_with_quiet() {
    let dir = folder();
    let go = |more: &[&str]| said(dir.path(), 0, &render(&[more, &["--stats", "s.json"]].concat()));
    let told = || ["noise_asked", "noise_reached"].map(|key| stats(dir.path())[key].clone());
    let missed = go(&["--noise", "0.001", "--spp", "40"]);
    assert!(
        missed.starts_with("warning: ") && missed.contains("0.001 was not reached: the estimate is 0."),
        "{missed}"
    );
    assert!(missed.contains("at 40 samples per pixel\n"), "{missed}");
    assert_eq!(told(), [json!(0.001), json!(false)]);
    let unknown = go(&["--noise", "0.5", "--spp", "12"]);
    assert!(
        unknown.contains("cannot be checked: an estimate needs more than 16 samples per pixel"),
        "{unknown}"
    );
    assert!(unknown.contains("ended at 12\n"), "{unknown}");
    assert_eq!(told(), [json!(0.5), json!(false)]);
    assert!(stats(dir.path())["estimated_noise"].is_null());
    // A reached error causes no warning.
    assert_eq!(go(&["--noise", "0.1"]), "");
    assert_eq!(told(), [json!(0.1), json!(true)]);
    assert_eq!(go(&["--spp", "2"]), "");
    assert_eq!(told(), [json!(null), json!(null)]);
}

#[test]
fn merged_films_have_the_layers_that_they_were_rendered_with() {
    let dir = folder();
    let part = |range: &str, film: &str, layers: &str| {
        said(dir.path(), 0, &render(&["--range", range, "--film", film, "--layers", layers]));
    };
    part("0..5", "a.film", "all");
    part("5..9", "b.film", "all");
    said(dir.path(), 0, &["merge", "a.film", "b.film", "-q", "-o", "m.exr", "-o", "m.film"]);
    // Equal to the bit to those of a render of all samples.
    said(dir.path(), 0, &render(&["--spp", "9", "--layers", "all", "-o", "w.exr", "--film", "w.film"]));
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a file");
    assert!(bytes("m.exr") == bytes("w.exr") && bytes("m.film") == bytes("w.film"));
    let told = info(dir.path(), "m.film");
    let names = "first hits  the film has the sums for albedo,normal,position,depth,uv,crypto-entity,crypto-material\n";
    assert!(told.contains(names) && told.contains("entities    8 names, for Cryptomatte\n"), "{told}");
    // Requested by name, or not at all.
    let channels = |file: &str| {
        let told = info(dir.path(), file);
        told.lines().find_map(|line| line.strip_prefix("channels    ")).expect("channels").to_owned()
    };
    said(dir.path(), 0, &["merge", "a.film", "b.film", "-q", "-o", "m.exr", "--layers", "samples,depth"]);
    assert_eq!(channels("m.exr"), "B, G, R, depth.Z, samples.Y");
    // Films with other layers cannot be merged, with a message.
    part("9..10", "c.film", "normal");
    let text = said(dir.path(), 1, &["merge", "a.film", "c.film", "-o", "m.exr"]);
    assert!(text.contains("its set of layers is normal, not albedo,"), "{text}");
    let text = said(dir.path(), 2, &["merge", "c.film", "-o", "m.exr", "--layers", "depth"]);
    assert!(text.contains("were begun without the layer depth") && text.contains("--layers depth"), "{text}");
    said(dir.path(), 0, &["merge", "c.film", "-q", "-o", "m.exr"]);
    assert_eq!(channels("m.exr"), "B, G, R, normal.X, normal.Y, normal.Z");
}

#[test]
fn a_resumed_film_keeps_exactly_its_layers() {
    let dir = folder();
    let go = |code: i32, more: &[&str]| said(dir.path(), code, &render(more));
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a file");
    go(0, &["--spp", "3", "--film", "a.film", "--layers", "albedo,depth,crypto-material"]);
    let before = bytes("a.film");
    let text = go(1, &["--resume", "a.film", "--spp", "9", "--layers", "depth,uv"]);
    assert!(text.contains("not albedo,depth,uv,crypto-material: "), "{text}");
    assert!(text.contains("without --layers uv; omit these, or begin another film"), "{text}");
    assert!(bytes("a.film") == before);
    go(0, &["--spp", "9", "--film", "w.film", "--layers", "albedo,depth,crypto-material", "-o", "w.exr"]);
    // The film keeps its layers, whatever the picture shows.
    fs::copy(dir.path().join("a.film"), dir.path().join("b.film")).expect("a copy");
    go(0, &["--resume", "b.film", "--spp", "9", "--layers", "depth", "-o", "b.exr"]);
    // The note of shown layers is that of the last render.
    assert_eq!(bytes("b.film").len() + ",albedo,crypto-material".len(), bytes("w.film").len());
    // It shows its original layers, unless some are requested.
    go(0, &["--resume", "a.film", "--spp", "9", "-o", "c.exr"]);
    assert!(bytes("a.film") == bytes("w.film") && bytes("c.exr") == bytes("w.exr"));
    assert!(bytes("b.exr") != bytes("w.exr"));
    said(dir.path(), 0, &["merge", "a.film", "-q", "-o", "m.exr"]);
    assert!(bytes("m.exr") == bytes("w.exr"));
    // Names do not affect samples, but Cryptomatte layers refer to them.
    let scene =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml")).expect("a scene");
    let scene = scene.replace("materials.red", "materials.other").replace("\"red\"", "\"other\"");
    fs::write(dir.path().join("b.toml"), scene).expect("a scene");
    let other = ["render", "b.toml", "--headless", "-q", "--size", "24x18", "-o", "a.exr"];
    let text = said(dir.path(), 1, &[&other[..], &["--resume", "w.film", "--spp", "10"]].concat());
    assert!(
        text.contains("its scene differs in the names of materials, which its mattes refer to"),
        "{text}"
    );
}

#[test]
fn a_film_of_another_scene_is_refused_with_the_difference_and_defaults_do_not_count() {
    let dir = folder();
    let scene =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml")).expect("a scene");
    let write = |text: &str| fs::write(dir.path().join("a.toml"), text).expect("a scene");
    let go = |code: i32, more: &[&str]| {
        let base = ["render", "a.toml", "--headless", "-q", "--size", "8x6", "-o", "a.exr"];
        said(dir.path(), code, &[&base[..], more].concat())
    };
    write(&scene);
    go(0, &["--spp", "2", "--film", "a.film"]);
    let resume = ["--resume", "a.film", "--spp", "3", "--film", "b.film"];
    // The same scene in another notation.
    write(&scene.replacen("[render]", "[render]\nsampler = \"sobol\"", 1).replacen(
        "samples = 500",
        "samples = 7",
        1,
    ));
    go(0, &resume);
    write(&scene.replacen("max_depth = 5", "max_depth = 9", 1));
    go(0, &[&resume[..], &["--max-depth", "5"]].concat());
    assert!(go(1, &resume).contains("its max depth is 5, not 9"));
    write(&scene.replacen("vertical_fov = 90", "vertical_fov = 80", 1));
    let text = go(1, &resume);
    assert!(text.contains("its scene differs in camera.vertical_fov; the scene file"), "{text}");
    write(&scene.replacen("radius = 2", "radius = 1.5", 1));
    let text = go(1, &resume);
    assert!(text.contains("its scene differs in the shape of "), "{text}");
    go(0, &["--range", "2..4", "--film", "b.film"]);
    let text = said(dir.path(), 1, &["merge", "a.film", "b.film", "-o", "m.exr"]);
    assert!(text.contains("its scene differs in the shape of "), "{text}");
}

/// The files that a mesh file refers to belong to the scene as much as the mesh file itself.
#[test]
fn a_film_is_refused_when_colours_or_buffers_of_a_mesh_have_changed() {
    let dir = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(dir.path().join(name), bytes).expect("a file");
    write(
        "a.toml",
        br#"entities = [
            { name = "red", shape = { type = "mesh", file = "a.obj", materials = "file" }, material = "m" },
            { name = "bare", shape = { type = "mesh", file = "a.gltf" }, material = "m" },
        ]
        materials.m = { type = "matte", reflectance = [1, 1, 1] }
        environment.radiance = [1, 1, 1]"#,
    );
    write(
        "a.obj",
        b"mtllib a.mtl
v 2 -1 -1
v 2 1 -1
v 2 0 1
usemtl red
f 1 2 3
",
    );
    write(
        "a.gltf",
        br#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
            "buffers": [{ "byteLength": 36, "uri": "a.bin" }] }"#,
    );
    let buffer = |x: f32| {
        let corners = [3.0, -1.0, -1.0, 3.0, x, -1.0, 3.0, 0.0, 1.0_f32];
        write("a.bin", corners.map(f32::to_le_bytes).as_flattened());
    };
    let go = |code: i32, more: &[&str]| {
        let base = ["render", "a.toml", "--headless", "-q", "--size", "8x6", "-o", "a.exr"];
        said(dir.path(), code, &[&base[..], more].concat())
    };
    let resume = ["--resume", "a.film", "--spp", "3", "--film", "b.film"];
    write("a.mtl", b"newmtl red\nKd 1 0 0\n");
    buffer(1.0);
    go(0, &["--spp", "2", "--film", "a.film"]);
    // Negative control: the same files, and the same colour in another notation.
    write("a.mtl", b"# scarlet\nnewmtl red\nKd 1.0 0 0.0\n");
    go(0, &resume);
    write("a.mtl", b"newmtl red\nKd 1 0.5 0\n");
    let text = go(1, &resume);
    assert!(text.contains("its scene differs in the material of red: red;"), "{text}");
    write("a.mtl", b"newmtl red\nKd 1 0 0\n");
    buffer(1.5);
    let text = go(1, &resume);
    assert!(text.contains("its scene differs in a.gltf;"), "{text}");
    buffer(1.0);
    go(0, &resume);
}

#[test]
fn negative_numbers_are_refused_with_the_valid_range() {
    let dir = folder();
    let text = said(dir.path(), 2, &["render", "a.toml", "--size", "-4x4"]);
    assert!(text.contains("invalid value") && text.contains("like 640x480"), "{text}");
    for (option, value, words) in [
        ("--seed", "-1", "0 to 4294967295"),
        ("--spp", "-4", "4294967295"),
        ("--threads", "-2", "1024"),
        ("--max-depth", "-1", "0 to 10000"),
        ("--time", "-1s", "like 30s"),
        ("--crop", "-1,0,4,4", "X,Y,WIDTH,HEIGHT"),
        ("--range", "-1..4", "FIRST..END"),
        ("--dump-at", "-1,4", "4294967295"),
    ] {
        let text = said(dir.path(), 2, &render(&[option, value]));
        assert!(text.contains("invalid value") && text.contains(words), "{option} {value}: {text}");
        assert!(!text.contains("use '--"), "{text}");
    }
    let text = said(dir.path(), 2, &render(&["--noise", "small"]));
    assert!(text.contains("an error is a number above 0 and below 1, like 0.01"), "{text}");
    let text = said(dir.path(), 2, &render(&["--noise", "-0.1"]));
    assert!(text.contains("--noise must be a number above 0 and below 1, like 0.01, not -0.1"), "{text}");
}
