//! Invalid command lines: each ends with a message with a remedy, exit code 1 or 2, and no picture.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = r#"
[film]
width = 8
height = 6
[render]
samples = 1
[materials]
white = { type = "matte", reflectance = [0.8, 0.8, 0.8] }
[[entities]]
shape = { type = "sphere", center = [3, 0, 0], radius = 1 }
material = "white"
emission = [1, 1, 1]
"#;

fn stride(folder: &Path, arguments: &[&str]) -> Output {
    fs::write(folder.join("scene.toml"), SCENE).expect("a writable folder");
    Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .env_remove("STRIDE_SIMD")
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn pictures(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    names.filter(|name| !name.ends_with(".toml") && !name.ends_with("folder.png")).collect()
}

#[test]
fn no_option_of_another_meaning_is_suggested() {
    for (given, wrong) in [("--denoise", "--noise"), ("--pixelsamples", "--samples"), ("--width", "--window")]
    {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let output = stride(folder.path(), &["render", "scene.toml", given]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!message.contains(&format!("'{wrong}'")), "{message}");
    }
}

/// Runs the program in a new folder and checks its exit code and words of its message.
fn refused(arguments: &[&str], code: i32, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    refused_in(folder.path(), arguments, code, words);
}

fn refused_in(folder: &Path, arguments: &[&str], code: i32, words: &[&str]) {
    let output = stride(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{message}");
    for word in words {
        assert!(message.contains(word), "no {word:?} in: {message}");
    }
    assert!(!message.contains("panicked"), "{message}");
    assert_eq!(pictures(folder), Vec::<String>::new(), "a picture was written");
}

macro_rules! refuses {
    ($($name:ident: $arguments:expr => $code:expr, $words:expr;)*) => {
        $(#[test] fn $name() { refused(&$arguments, $code, &$words); })*
    };
}

refuses! {
    an_unknown_tone: ["render", "scene.toml", "--tone", "sepia"] => 2, ["sepia", "srgb", "filmic"];
    tev_without_a_port: ["render", "scene.toml", "--headless", "--tev", "localhost"] => 2, ["localhost:14158"];
    tev_does_not_answer: ["render", "scene.toml", "--headless", "--tev", "localhost:1"] => 1, ["localhost:1", "start it first"];
    info_without_a_file: ["info"] => 2, ["name a file", "stride info --devices"];
    no_scene: ["render"] => 2, ["SCENE", "Usage"];
    unknown_command: ["rendr", "scene.toml"] => 2, ["rendr", "render"];
    unknown_option: ["render", "scene.toml", "--thread", "2"] => 2, ["--thread", "--threads"];
    a_denoiser: ["render", "scene.toml", "--denoise"] => 2, ["no denoiser", "--layers albedo,normal"];
    a_width: ["render", "scene.toml", "--width", "64"] => 2, ["--size"];
    samples_of_another_program: ["render", "scene.toml", "--pixelsamples", "64"] => 2, ["--spp"];
    a_scene_without_a_command: ["scene.toml"] => 2, ["stride render scene.toml"];
    a_number_of_samples_for_a_file: ["render", "scene.toml", "--samples", "64"] => 2, [".npy", "--spp 64"];
    zero_threads: ["render", "scene.toml", "--threads", "0"] => 2, ["--threads", "1..=1024"];
    too_many_threads: ["render", "scene.toml", "--threads", "100000"] => 2, ["--threads"];
    negative_threads: ["render", "scene.toml", "--threads=-1"] => 2, ["--threads"];
    threads_without_number: ["render", "scene.toml", "--threads"] => 2, ["--threads"];
    zero_samples: ["render", "scene.toml", "--spp", "0"] => 2, ["--spp"];
    samples_in_words: ["render", "scene.toml", "--spp", "many"] => 2, ["--spp", "many"];
    an_infinite_time: ["render", "scene.toml", "--time", "inf"] => 2, ["--time", "30s"];
    a_zero_time: ["render", "scene.toml", "--time", "0s"] => 2, ["--time", "30s"];
    an_unknown_unit_of_time: ["render", "scene.toml", "--time", "3 days"] => 2, ["--time", "30s"];
    a_size_without_height: ["render", "scene.toml", "--size", "640"] => 2, ["640x480"];
    no_pixels: ["render", "scene.toml", "--size", "0x480"] => 2, ["1 to 65536"];
    a_billion_pixels: ["render", "scene.toml", "--size", "40000x25000"] => 1, ["GB", "--size"];
    four_billion_pixels: ["render", "scene.toml", "--size", "65536x65536"] => 2, ["GB", "2³¹"];
    a_crop_outside: ["render", "scene.toml", "--crop", "4,4,8,8"] => 2, ["--crop", "8×6"];
    an_empty_crop: ["render", "scene.toml", "--crop", "0,0,0,4"] => 2, ["--crop"];
    a_crop_in_words: ["render", "scene.toml", "--crop", "all"] => 2, ["X,Y,WIDTH,HEIGHT"];
    an_unknown_integrator: ["render", "scene.toml", "--integrator", "bidir"] => 2, ["path-naive", "whitted"];
    an_invalid_number_of_bounces: ["render", "scene.toml", "--max-depth", "endless"] => 2, ["10000", "unlimited"];
    unlimited_depth_without_roulette: ["render", "scene.toml", "--integrator", "path-naive", "--max-depth", "unlimited"]
        => 2, ["unlimited", "path"];
    an_unknown_sampler: ["render", "scene.toml", "--sampler", "halton"] => 2, ["sobol", "independent"];
    an_unknown_filter: ["render", "scene.toml", "--filter", "tnet"] => 2, ["tent"];
    an_unknown_film_mode: ["render", "scene.toml", "--film-mode", "splat"] => 2, ["importance", "continuous"];
    a_negative_filter_to_draw_from: ["render", "scene.toml", "--filter", "mitchell", "--film-mode", "importance"]
        => 2, ["negative", "continuous"];
    a_continuous_film_of_pixel_centres: ["render", "scene.toml", "--filter", "none", "--film-mode", "continuous"]
        => 2, ["none", "a filter with a radius"];
    a_checkpoint_of_no_film: ["render", "scene.toml", "--checkpoint", "5s"] => 2, ["--checkpoint", "--film"];
    an_unknown_world: ["render", "scene.toml", "--world", "octree"] => 2, ["simple", "bvh"];
    an_unknown_device: ["render", "scene.toml", "--device", "tpu"] => 2, ["cpu", "gpu"];
    an_unknown_overlay: ["render", "scene.toml", "--overlay", "depth"] => 2, ["owner"];
    an_overlay_in_an_exr_file: ["render", "scene.toml", "--overlay", "owner", "-o", "a.exr"] => 2, [".png"];
    an_exposure_in_words: ["render", "scene.toml", "--exposure", "bright"] => 2, ["stops"];
    a_negative_depth: ["render", "scene.toml", "--max-depth=-1"] => 2, ["--max-depth"];
    a_seed_too_large: ["render", "scene.toml", "--seed", "4294967296"] => 2, ["--seed"];
    a_dump_past_the_end: ["render", "scene.toml", "--dump-at", "2"] => 2, ["--dump-at 2", "1 sample"];
    a_dump_of_nothing: ["render", "scene.toml", "--dump-at", "0"] => 2, ["--dump-at"];
    window_and_headless: ["render", "scene.toml", "--window", "--headless"] => 2, ["--window", "--headless"];
    a_missing_scene: ["render", "scnee.toml"] => 1, ["scnee.toml"];
    a_folder_as_scene: ["render", "."] => 1, ["."];
    an_output_without_extension: ["render", "scene.toml", "-o", "picture"] => 2, [".png"];
    an_unknown_extension: ["render", "scene.toml", "-o", "picture.bmp"] => 2, [".bmp", ".exr"];
    an_output_in_no_folder: ["render", "scene.toml", "-o", "nowhere/picture.png"] => 1, ["nowhere", "create"];
    an_output_twice: ["render", "scene.toml", "-o", "a.png", "-o", "a.png"] => 2, ["twice"];
    an_output_over_a_numbered_picture: ["render", "scene.toml", "-o", "a.png", "-o", "a-1.png", "--dump-at", "1"] => 2, ["twice"];
    samples_in_no_folder: ["render", "scene.toml", "--samples", "nowhere/all.npy"] => 1, ["nowhere"];
    stats_in_no_folder: ["render", "scene.toml", "--stats", "nowhere/stats.json"] => 1, ["nowhere"];
    statistics_over_the_scene: ["render", "scene.toml", "--stats", "./scene.toml"] => 2, ["replace the scene"];
    one_path_in_two_spellings: ["render", "scene.toml", "-o", "a.png", "-o", "./a.png"] => 2, ["twice"];
    a_window_without_display: ["render", "scene.toml", "--window"] => 1, ["display", "--headless"];
    check_of_a_missing_file: ["check", "nothing.toml"] => 1, ["nothing.toml"];
    trace_without_pixel: ["trace", "scene.toml"] => 2, ["--pixel"];
    trace_off_the_film: ["trace", "scene.toml", "--pixel", "8,0"] => 2, ["8,0", "8×6"];
    trace_of_a_word: ["trace", "scene.toml", "--pixel", "middle"] => 2, ["X,Y"];
}

#[test]
fn an_unknown_simd_level() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("a writable folder");
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", "scene.toml"])
        .current_dir(folder.path())
        .env("STRIDE_SIMD", "sse9")
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("portable"));
}

#[test]
fn a_folder_in_the_picture_s_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    refused_in(folder.path(), &["render", "scene.toml", "-o", "folder.png"], 1, &["folder"]);
}

#[test]
fn a_folder_in_a_numbered_picture_s_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("a-1folder.png")).expect("a folder");
    let arguments = ["render", "scene.toml", "--spp", "1", "--dump-at", "1", "-o", "a.png"];
    fs::rename(folder.path().join("a-1folder.png"), folder.path().join("a-1.png")).expect("renamed");
    let output = stride(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("a-1.png"));
    assert!(!folder.path().join("a.png").exists());
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk() {
    // A limit on the size of files simulates a full disk: the write fails half way.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cover = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml");
    fs::copy(cover, folder.path().join("scene.toml")).expect("a writable folder");
    let script =
        "trap '' XFSZ; ulimit -f 8; exec \"$0\" render scene.toml --headless --size 200x200 --spp 1 -o a.exr";
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_stride")])
        .current_dir(folder.path())
        .output()
        .expect("a shell");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("a.exr"), "{message}");
    assert_eq!(pictures(folder.path()), Vec::<String>::new(), "half a file is left");
}

#[test]
fn broken_scenes_name_the_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("bad.toml"), "[film]\nwidht = 3\nheight = -1\n").expect("a writable folder");
    let words = ["bad.toml:2:1", "width", "bad.toml:3:"];
    refused_in(folder.path(), &["render", "bad.toml"], 1, &words);
}

#[test]
fn binary_garbage_as_scene() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("garbage.toml"), [0xff, 0xfe, 0, 1, 2, 3]).expect("a writable folder");
    refused_in(folder.path(), &["render", "garbage.toml"], 1, &["garbage.toml"]);
}

#[test]
#[cfg(unix)]
fn a_closed_pipe_causes_an_error_and_no_panic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("a writable folder");
    let mut child = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["check", "scene.toml"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("the program ends");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    // The program may have ended before the pipe was closed: then there is no error.
    assert!(!message.contains("panicked"), "{message}");
    assert!(matches!(output.status.code(), Some(0 | 1)), "{message}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_standard_output_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("scene.toml"), SCENE).expect("a writable folder");
    let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["check", "scene.toml"])
        .current_dir(folder.path())
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("standard output"));
}

#[test]
fn an_output_of_no_known_format_is_bad_usage_in_every_command() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let film =
        ["render", "scene.toml", "--headless", "-q", "-o", "a.png", "--film", "a.film", "--samples", "a.npy"];
    assert!(stride(folder.path(), &film).status.success());
    let develop = ["develop", "a.npy", "--filter", "box", "-o", "a.jpeg"];
    for (arguments, extension) in [
        (&["render", "scene.toml", "-o", "a.tiff"][..], ".tiff"),
        (&["render", "scene.toml", "--film", "a.bin"], ".film"),
        (&["render", "scene.toml", "--samples", "a.csv"], ".npy"),
        (&["merge", "a.film", "-o", "b.webp"], ".webp"),
        (&develop, ".jpeg"),
        (&["bench", "threads", "scene.toml", "--plot", "a.pdf"], ".svg"),
    ] {
        let output = stride(folder.path(), arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(extension), "{arguments:?}: {said}");
    }
}

#[test]
fn a_mesh_too_small_for_its_precision_is_refused_and_a_tiny_one_is_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write =
        |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a writable folder");
    write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for (transform, code) in [
        ("scale = 1e-12", 0),
        ("scale = 1e-14, translate = [1e-9, 0, 0]", 0),
        ("scale = 1e-16", 1),
        ("scale = 1e-30", 1),
        // The corners are rounded to one point there.
        ("scale = 1e-12, translate = [1, 0, 0]", 1),
        ("scale = 1e-12, translate = [1, 1, 1]", 1),
    ] {
        let shape = format!("type = \"mesh\", file = \"a.obj\", transform = {{ {transform} }}");
        write("tiny.toml", &format!("{SCENE}[[entities]]\nshape = {{ {shape} }}\nmaterial = \"white\"\n"));
        let output = stride(folder.path(), &["check", "tiny.toml"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{transform}: {said}");
        assert!(code == 0 || said.contains("larger scale"), "{transform}: {said}");
    }
}
