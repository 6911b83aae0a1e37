//! The interface for programs, from outside: this crate uses only public items.

use super::examples::buffer;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use stride::film::Layer;
use stride::scene::{CameraSettings, Entity, SceneProblem, Tone};
use stride::session::DeviceChoice;
use stride::{Error, Event, Picture, Render, Scene, SettingsError};

/// The scene of `examples/buffer.rs` as a file.
const BALL: &str = r#"
camera = { eye = [0, -6, 2.5], look_at = [0, 0, 0.9], vertical_fov = 40 }
environment = { radiance = [0.15, 0.2, 0.3] }
entities = [
    { name = "floor", shape = { type = "plane", normal = [0, 0, 1], distance = 0 }, material = "white" },
    { name = "ball", shape = { type = "sphere", center = [0, 0, 1], radius = 1 }, material = "copper" },
    { name = "lamp", shape = { type = "sphere", center = [2, -2, 4], radius = 0.7 }, material = "white", emission = [12, 11, 9] },
]
[materials]
white = { type = "matte", reflectance = [0.8, 0.8, 0.8] }
copper = { type = "mirror", reflectance = [0.9, 0.6, 0.4] }
"#;

fn ball() -> Render {
    Render::new(&buffer::scene()).size((40, 30)).samples(8).threads(2)
}

fn bits(picture: &Picture) -> Vec<[u32; 3]> {
    picture.rgb.iter().map(|rgb| rgb.map(f32::to_bits)).collect()
}

/// Runs `stride render` on the scene's file.
fn command_line(folder: &Path, arguments: &[&str]) {
    fs::write(folder.join("ball.toml"), BALL).expect("a writable folder");
    let status = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", "ball.toml", "--headless", "-q", "--size", "40x30", "--spp", "8", "--threads", "1"])
        .args(arguments)
        .current_dir(folder)
        .status();
    assert!(status.expect("the program starts").success(), "{arguments:?}");
}

fn same_files(folder: &Path, pairs: &[(&str, &str)]) {
    for (one, other) in pairs {
        let read = |name| fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(read(one) == read(other), "{one} and {other} differ");
    }
}

#[test]
fn a_scene_in_code_gives_the_files_of_the_command_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let layers = ["--layers", "all", "--exposure", "1", "--tone", "filmic"];
    let files = ["-o", "a.exr", "-o", "a.png", "-o", "a.hdr", "--film", "a.film"];
    command_line(folder.path(), &[&layers[..], &files].concat());
    let render = ball().layers(Layer::ALL).exposure(1.0).tone(Tone::Filmic);
    let report = render.clone().output(path("b.exr")).film(path("b.film")).run().expect("a picture");
    for name in ["c.exr", "c.png", "c.hdr"] {
        report.save(path(name)).expect("a file");
    }
    let pairs = [
        ("b.exr", "a.exr"),
        ("b.film", "a.film"),
        ("c.exr", "a.exr"),
        ("c.png", "a.png"),
        ("c.hdr", "a.hdr"),
    ];
    same_files(folder.path(), &pairs);
    // Other settings give other files.
    render.seed(1).run().expect("a picture").save(path("d.exr")).expect("a file");
    assert!(fs::read(path("d.exr")).expect("a file") != fs::read(path("a.exr")).expect("a file"));
}

#[test]
fn meshes_in_code_match_the_command_line_and_films_name_their_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    let wall = r#"{ name = "wall", shape = { type = "mesh", file = "wall.obj" }, material = "white" },"#;
    fs::write(path("wall.obj"), "v -2 2 0\nv 2 2 0\nv 2 2 3\nv -2 2 3\nf 1 2 3 4\n")
        .expect("a writable folder");
    fs::write(path("wall.toml"), BALL.replacen("entities = [", &format!("entities = [\n    {wall}"), 1))
        .expect("a writable folder");
    let status = Command::new(env!("CARGO_BIN_EXE_stride"))
        .arg("render")
        .arg(path("wall.toml"))
        .args(["--headless", "-q", "--size", "40x30", "--spp", "8", "-o", "a.exr", "--film", "a.film"])
        .current_dir(folder.path())
        .status();
    assert!(status.expect("the program starts").success());
    let loaded = stride::scene::load(&path("wall.toml")).expect("a scene");
    let render = Render::new(&loaded.scene).size((40, 30)).samples(8);
    render.clone().film(path("c.film")).run().expect("a picture").save(path("c.exr")).expect("a file");
    render.sources(loaded.sources).film(path("b.film")).run().expect("a picture");
    same_files(folder.path(), &[("c.exr", "a.exr"), ("b.film", "a.film")]);
    // Without the names the film differs in its notes, but not in its identity.
    let head = |name: &str| stride::output::open_film(&path(name)).expect("a film").head().clone();
    assert_eq!(head("c.film").identity, head("a.film").identity);
    assert_ne!(head("c.film").notes, head("a.film").notes);
}

#[test]
fn settings_match_the_options() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = [
        "--crop",
        "5,6,20,10",
        "--seed",
        "7",
        "--max-depth",
        "2",
        "--integrator",
        "path-naive",
        "--filter",
        "mitchell",
    ];
    command_line(folder.path(), &[&options[..], &["-o", "a.exr"]].concat());
    let render = ball()
        .crop([5, 6, 20, 10])
        .seed(7)
        .max_depth(2)
        .integrator("path-naive".parse::<stride::scene::Integrator>().expect("an integrator"))
        .filter("mitchell".parse::<stride::scene::Filter>().expect("a filter"));
    render.run().expect("a picture").save(folder.path().join("b.exr")).expect("a file");
    same_files(folder.path(), &[("b.exr", "a.exr")]);
}

#[test]
fn films_are_resumed_by_library_and_command_line_alike() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    ball().film(path("a.film")).samples(3).run().expect("a film");
    command_line(folder.path(), &["--resume", "a.film", "-o", "a.exr"]);
    command_line(folder.path(), &["-o", "b.exr", "--film", "b.film"]);
    same_files(folder.path(), &[("a.exr", "b.exr"), ("a.film", "b.film")]);
    let resumed = ball().resume(path("b.film")).samples(12).run().expect("a picture");
    assert_eq!(bits(&resumed.picture), bits(&ball().samples(12).run().expect("a picture").picture));
    assert_eq!(resumed.totals.before, 40 * 30 * 8);
}

#[test]
fn two_concurrent_renders_are_independent() {
    let mut other = buffer::scene();
    other.add_entity(
        "wall",
        stride::scene::PlaneParameters { normal: [0.0, 1.0, 0.0].into(), distance: 3.0 },
        1,
    );
    let renders = [
        ball().samples(40),
        Render::new(&other).size((37, 21)).samples(30).seed(5).threads(3).layers([Layer::Normal]),
    ];
    let alone = renders.each_ref().map(|render| render.run().expect("a picture"));
    for _ in 0..3 {
        let both = renders.each_ref().map(|render| render.start().expect("a render"));
        for (handle, alone) in both.into_iter().zip(&alone) {
            let report = handle.join().expect("a picture");
            assert_eq!(bits(&report.picture), bits(&alone.picture));
            assert_eq!(report.layers, alone.layers);
        }
    }
    assert_ne!(alone[0].picture, alone[1].picture);
}

#[test]
fn a_render_reports_its_progress_and_its_end() {
    let render = ball().start().expect("a render");
    let mut ended = None;
    let mut concluded = 0;
    for event in render.events() {
        match event {
            Event::Ended(progress) => ended = Some(progress.spp_done),
            Event::Concluded(_) => concluded += 1,
            _ => {}
        }
    }
    assert_eq!((ended, concluded), (Some(8.0), 1));
    assert!(render.join().expect("a picture").whole);
}

/// More samples per pixel than a test waits for.
const STOPPED: u32 = u32::MAX - 1;

/// An endless render, after its first progress event.
fn endless(render: Render) -> stride::RenderHandle {
    let handle = render.samples(STOPPED).start().expect("a render");
    let first = handle.events().find(|event| matches!(event, Event::Progress(_)));
    assert!(first.is_some() && !handle.is_finished());
    handle
}

#[test]
fn a_stopped_render_has_a_picture_of_its_samples() {
    let mut handle = endless(ball());
    handle.stop();
    let mut concluded = Vec::new();
    for event in handle.events() {
        if let Event::Concluded(conclusion) = event {
            concluded.push(conclusion.stopped_before);
        }
    }
    let report = handle.join().expect("a picture");
    assert!(report.totals.samples > 0 && concluded == [Some(STOPPED)], "{concluded:?}");
    assert!(report.picture.rgb.iter().flatten().any(|&channel| channel > 0.0));
}

#[test]
fn a_dropped_handle_ends_its_render_and_writes_its_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.film");
    drop(endless(ball().film(&path)));
    let film = stride::output::open_film(&path).expect("a whole film");
    assert!(film.sample_ranges().start() == Some(0), "{}", film.sample_ranges());
}

#[test]
fn dumped_samples_give_the_picture() {
    let mut means = vec![[0.0_f64; 3]; 40 * 30];
    let mut seen = std::collections::HashSet::new();
    let report = ball().run_with_samples(|samples| {
        for sample in samples {
            assert!(seen.insert((sample.pixel, sample.sample)), "{sample:?} comes twice");
            let mean = &mut means[sample.pixel as usize];
            (0..3).for_each(|channel| mean[channel] += f64::from(sample.radiance[channel]) / 8.0);
        }
    });
    let report = report.expect("a picture");
    assert_eq!(seen.len(), 40 * 30 * 8);
    assert_eq!(bits(&report.picture), bits(&ball().run().expect("a picture").picture));
    for (mean, rgb) in means.iter().zip(&report.picture.rgb) {
        for (mean, channel) in mean.iter().zip(rgb) {
            assert!((mean - f64::from(*channel)).abs() <= 1e-6 * mean.max(1e-3), "{mean} {channel}");
        }
    }
}

#[test]
fn a_caller_that_panics_over_samples_ends_the_render() {
    let render = || ball().samples(u32::MAX).run_with_samples(|_| panic!("on purpose"));
    assert!(std::panic::catch_unwind(render).is_err());
}

fn refused(render: Render) -> SettingsError {
    match render.run() {
        Err(Error::Settings(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn invalid_settings_are_error_values() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    assert_eq!(
        refused(ball().crop([30, 0, 11, 1])),
        SettingsError::Crop { crop: [30, 0, 11, 1], film: [40, 30] }
    );
    assert_eq!(refused(ball().dump_at([9])), SettingsError::DumpPastEnd { at: 9, samples: 8 });
    assert_eq!(refused(ball().range(2..4)), SettingsError::RangeAndSamples);
    let reversed = std::ops::Range { start: 4, end: 4 };
    assert_eq!(refused(ball().samples(None).range(reversed.clone())), SettingsError::EmptyRange(reversed));
    assert_eq!(refused(ball().adaptive(true).device(DeviceChoice::Gpu(None))), SettingsError::AdaptiveDevice);
    assert_eq!(refused(ball().adaptive(true).dump_at([2])), SettingsError::AdaptiveDump);
    assert_eq!(refused(ball().samples(None).range(1..9).noise(0.1)), SettingsError::NoiseOfLaterSamples);
    assert_eq!(refused(ball().samples(None).range(1..9).adaptive(true)), SettingsError::AdaptiveRange);
    let twice = ball().output(path("a.png")).output(folder.path().join(".").join("a.png"));
    assert!(matches!(refused(twice), SettingsError::Twice(_)));
    assert!(matches!(refused(ball().output(path("a.exr")).keep(path("a.exr"))), SettingsError::Twice(_)));
    assert_eq!(refused(ball().threads(0)), SettingsError::Threads(0));
    assert_eq!(refused(ball().threads(5000)), SettingsError::Threads(5000));
    for (render, setting) in [
        (ball().noise(0.0), "noise"),
        (ball().noise(f64::NAN), "noise"),
        (ball().samples(0), "samples"),
        (ball().dump_at([0]), "dump_at"),
        (ball().time(std::time::Duration::ZERO), "time"),
    ] {
        let error = refused(render);
        assert!(
            matches!(&error, SettingsError::OutOfRange { setting: named, .. } if *named == setting),
            "{error}"
        );
    }
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 0);
}

#[test]
fn invalid_scenes_and_paths_are_error_values() {
    let scene = Scene { entities: vec![Entity::default()], ..Scene::default() };
    let Err(Error::Scene(problems)) = Render::new(&scene).run() else { panic!("there is no material") };
    assert!(matches!(&problems[..], [SceneProblem { .. }]), "{problems:?}");
    let mut upright = buffer::scene();
    upright.camera = CameraSettings::looking_at([0.0; 3], [0.0, 0.0, 1.0]);
    assert!(matches!(Render::new(&upright).start(), Err(Error::Scene(_))));
    assert!(matches!(ball().size((0, 4)).run(), Err(Error::Scene(_))));
    assert!(matches!(Scene::load("nowhere.toml").map_err(Error::from), Err(Error::SceneFile(_))));
    assert!(matches!(ball().output("nowhere/a.png").run(), Err(Error::Session(_))));
    assert!(matches!(ball().output("a.gif").run(), Err(Error::Session(_))));
    assert!(matches!(ball().resume("nowhere.film").run(), Err(Error::Session(_))));
}

/// Set in the process that must print nothing.
const SILENT: &str = "STRIDE_TEST_SILENT";

/// Renders with much output on the command line.
fn render_silently() {
    let mut bright = buffer::scene();
    let position = [1.0, -1.0, 3.0].into();
    bright.add_light(stride::scene::PointLightParameters {
        position,
        intensity: Some([1e20; 3]),
        power: None,
    });
    Render::new(&bright).size((8, 6)).samples(2).run().expect("a picture");
    let dark = Render::new(&Scene::default()).size((8, 6)).samples(32).noise(0.5).run().expect("a picture");
    assert!(dark.noise.is_some_and(|noise| !noise.reached()));
    drop(endless(ball()));
    assert!(ball().output("a.gif").run().is_err());
}

// Runs in a separate process, so that all of its output is the library's.
#[test]
fn nothing_is_printed_and_no_environment_is_read() {
    if std::env::var_os(SILENT).is_some() {
        return render_silently();
    }
    let output = Command::new(std::env::current_exe().expect("this test"))
        .args(["library::nothing_is_printed_and_no_environment_is_read", "--exact", "--nocapture", "--quiet"])
        .env(SILENT, "1")
        .env("STRIDE_SIMD", "no such level")
        .stdin(Stdio::null())
        .output()
        .expect("this test");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    // The test harness prints that there is one test, and that it has passed.
    let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
    let is_harness = |line: &&str| {
        line.starts_with("running 1 test") || *line == "." || line.starts_with("test result: ok")
    };
    assert!(lines.iter().all(is_harness), "{lines:?}");
}

/// Operations that are reserved for programs.
const FOR_PROGRAMS: [&str; 6] = ["println!", "stdout()", "stderr()", "process::exit", "ctrlc::", "env::var"];

/// The files that may read environment variables: for a SIMD level, which only programs request, for the display, and
/// for the name of a worker's machine.
const ASKING: [&str; 3] = ["math/lanes/level.rs", "output/window/x11.rs", "fleet/enabled/job.rs"];

/// The files that are compiled for tests only: faults on request, and a simulation.
const FOR_TESTS: [&str; 2] = ["fleet/enabled/hooks.rs", "fleet/enabled/simulation.rs"];

/// Occurrences of these in the sources of a folder, without tests, with their files.
fn of_programs(folder: &Path, found: &mut Vec<(String, &'static str)>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.to_string_lossy().replace('\\', "/");
        if path.is_dir() && !name.ends_with("/tests") {
            of_programs(&path, found);
        } else if name.ends_with(".rs") && !name.ends_with("/tests.rs") {
            let source = fs::read_to_string(&path).expect("a source");
            let code = source.split("#[cfg(test)]").next().unwrap_or_default();
            let lines = || code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let words = FOR_PROGRAMS.into_iter().filter(|word| lines().any(|line| line.contains(word)));
            found.extend(words.map(|word| (name.clone(), word)));
        }
    }
}

#[test]
fn only_the_command_line_prints_ends_the_process_or_asks_the_environment() {
    let mut found = Vec::new();
    of_programs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut found);
    let is_program = |name: &str| name.contains("/src/cli/") || name.ends_with("/src/main.rs");
    let asks = |name: &str| ASKING.iter().any(|file| name.ends_with(file));
    assert!(found.iter().any(|(name, _)| is_program(name)), "nothing is found: {found:?}");
    let is_for_tests = |name: &str| FOR_TESTS.iter().any(|file| name.ends_with(file));
    found.retain(|(name, word)| {
        !(is_program(name) || is_for_tests(name) || *word == "env::var" && asks(name))
    });
    assert_eq!(found, []);
}
