//! Layers: first hits beside colour in EXR files.

use crate::common;
use crate::common::scenes::cover;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use stride::film::cryptomatte::Mattes;
use stride::film::layers::NO_DEPTH;
use stride::film::{Channel, Layer, LayerSet};
use stride::integrator::{Event, Integrator};
use stride::math::lanes::Level;
use stride::render::{FirstHitTracer, Stride, preview};
use stride::sampling::Region;
use stride::scene::{Scene, parse};

fn layers_at(level: Level, scene: &Scene, region: Region, samples: u32) -> Vec<Channel> {
    let integrator = Arc::from(common::integrator(scene));
    preview(&integrator, level, region, samples, &Layer::ALL, &Mattes::of(scene))
}

fn layers(scene: &Scene, region: Region, samples: u32) -> Vec<Channel> {
    layers_at(Level::available()[0], scene, region, samples)
}

fn channel<'a>(channels: &'a [Channel], name: &str) -> &'a [f32] {
    let found = channels.iter().find(|channel| channel.name == name);
    &found.unwrap_or_else(|| panic!("no {name}")).values
}

/// The expected layers: means over the first hits of single paths; `None` where no path hit a surface. Single paths are
/// traced without lanes.
fn told(integrator: &dyn Integrator, scene: &Scene, place: u32, samples: u32) -> Option<Vec<(String, f64)>> {
    let pixel = Region::whole(scene.film.width, scene.film.height).pixel(place);
    let (mut met, mut sums) = (0.0, [0.0_f64; 7]);
    for sample in 0..samples {
        let (_, events) = integrator.explain(pixel, sample);
        let hit = events.iter().find_map(|event| match event {
            Event::Hit { point, normal, .. } => Some((*point, *normal)),
            _ => None,
        });
        // The first event is the camera's ray, the second its hit.
        let Some((p, n)) = hit.filter(|_| matches!(events[1], Event::Hit { .. })) else { continue };
        met += 1.0;
        let depth = f64::from(p[0]) * scene.camera.forward.x
            + f64::from(p[1]) * scene.camera.forward.y
            + f64::from(p[2]) * scene.camera.forward.z
            - scene.camera.eye.dot(scene.camera.forward);
        let values = [p[0], p[1], p[2], n[0], n[1], n[2]].map(f64::from);
        sums[..6].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        sums[6] += depth;
    }
    let names = ["position.X", "position.Y", "position.Z", "normal.X", "normal.Y", "normal.Z", "depth.Z"];
    let count = |name: &str| if name.starts_with("normal") { f64::from(samples) } else { met };
    let mean = |(name, sum): (&str, f64)| (name.to_owned(), sum / count(name));
    (met > 0.0).then(|| names.into_iter().zip(sums).map(mean).collect())
}

#[test]
fn layers_are_means_over_first_hits() {
    let scene = cover(40, 30);
    let region = Region::whole(40, 30);
    let channels = layers(&scene, region, 6);
    let integrator = common::integrator(&scene);
    let off = |place: u32, samples: u32| -> f64 {
        let told = told(&*integrator, &scene, place, samples).expect("the cover is closed in front");
        let values = |name: &str| f64::from(channel(&channels, name)[place as usize]);
        told.iter().map(|(name, mean)| (values(name) - mean).abs()).fold(0.0, f64::max)
    };
    let mut others = 0;
    for place in (0..1200).step_by(7) {
        assert!(off(place, 6) < 1e-4, "place {place} is off by {}", off(place, 6));
        others += u32::from(off(place, 5) > 1e-4);
    }
    // Negative control: one sample fewer gives other means.
    assert!(others > 150, "{others}");
}

const WALL: &str = r#"
    [film]
    width = 16
    height = 12
    filter = "none"
    [camera]
    eye = [1, 0, 0]
    [materials]
    grey = { type = "matte", reflectance = [0.5, 0.25, 0.125] }
    glass = { type = "glass", ior = 1.5, transmittance = [0.75, 1, 1] }
    [[entities]]
    shape = { type = "quad", corner = [4, -9, -9], u = [0, 0, 18], v = [0, 9, 0] }
    material = "grey"
    [[entities]]
    shape = { type = "quad", corner = [3, 0, -9], u = [0, 9, 0], v = [0, 0, 9] }
    material = "glass"
"#;

#[test]
fn layers_of_a_wall_match_their_closed_forms() {
    let scene = parse(WALL, Path::new("wall.toml")).expect("a scene").scene;
    let channels = layers(&scene, Region::whole(16, 12), 2);
    let at = |name: &str, x: usize, y: usize| channel(&channels, name)[y * 16 + x];
    // Right of the centre a grey wall three in front of the eye, whose u × v points away along +x; left is
    // the camera's +y: in its lower half glass two in front, in the upper half nothing.
    for (x, y) in [(8, 0), (15, 11), (11, 6)] {
        assert_eq!([at("depth.Z", x, y), at("position.X", x, y)], [3.0, 4.0]);
        assert_eq!(["R", "G", "B"].map(|c| at(&format!("albedo.{c}"), x, y)), [0.5, 0.25, 0.125]);
        assert_eq!(["X", "Y", "Z"].map(|c| at(&format!("normal.{c}"), x, y).abs()), [1.0, 0.0, 0.0]);
        // Pixels are a sixth of the distance wide: a 90° view of twelve rows.
        let step = 3.0 / 6.0;
        let (y_there, z_there) = ((7.5 - x as f32) * step, (5.5 - y as f32) * step);
        assert!((at("position.Y", x, y) - y_there).abs() < 1e-5, "{x} {y}");
        assert!((at("position.Z", x, y) - z_there).abs() < 1e-5, "{x} {y}");
        assert!((at("uv.U", x, y) - (z_there + 9.0) / 18.0).abs() < 1e-5, "{x} {y}");
        assert!((at("uv.V", x, y) - (y_there + 9.0) / 9.0).abs() < 1e-5, "{x} {y}");
    }
    assert_eq!([at("depth.Z", 0, 11), at("albedo.R", 0, 11), at("albedo.G", 0, 11)], [2.0, 0.75, 1.0]);
    assert_eq!([at("depth.Z", 0, 0), at("albedo.R", 0, 0), at("position.X", 0, 0)], [NO_DEPTH, 0.0, 0.0]);
}

#[test]
fn threads_lanes_and_crops_do_not_affect_layers() {
    let scene = cover(40, 30);
    let region = Region::whole(40, 30);
    let whole = layers(&scene, region, 5);
    for level in Level::available() {
        assert!(layers_at(level, &scene, region, 5) == whole, "{level}");
    }
    let traced = |threads, samples| {
        let set = LayerSet::new(&Layer::ALL, scene.entities.len(), scene.materials.len());
        let (integrator, level) = (Arc::from(common::integrator(&scene)), Level::available()[0]);
        let tracer = FirstHitTracer { integrator, level, layers: set, region, threads };
        tracer.trace_first_hits(Stride::every(3, 1), 7..390, &samples)
    };
    let alone = traced(1, 20..40);
    assert_eq!((alone.first_slot, alone.sums.len(), alone.sums.samples(5)), (7, 383, 0xfff0_0000));
    for threads in [2, 3, 50] {
        assert!(traced(threads, 20..40) == alone, "{threads} threads");
    }
    assert!(traced(2, 20..31) != alone && traced(2, 32..40).sums.is_empty());
    let region = Region { film_width: 40, x: 11, y: 7, width: 9, height: 5 };
    let crop = layers(&scene, region, 5);
    for (part, whole) in crop.iter().zip(&whole) {
        for place in 0..region.len() {
            let there = region.pixel(place).index as usize;
            assert_eq!(part.values[place as usize], whole.values[there], "{}", part.name);
        }
    }
}

fn stride(folder: &Path, arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_stride")).args(arguments).current_dir(folder).output().expect("stride")
}

fn render(folder: &Path, more: &[&str]) {
    let scene = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    let output = stride(folder, &[&["render", &scene, "--headless", "-q", "--size", "40x30"], more].concat());
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn files_have_the_requested_layers_and_the_same_colour() {
    let dir = tempfile::tempdir().expect("a folder");
    render(dir.path(), &["--spp", "8", "--threads", "1", "--layers", "all", "-o", "a.exr", "-o", "a.png"]);
    render(dir.path(), &["--spp", "3", "--layers", "all", "--film", "b.film", "-o", "b.exr"]);
    // Resumed with other threads: the same file.
    let rest = ["--spp", "8", "--resume", "b.film", "--threads", "3"];
    render(dir.path(), &[&rest[..], &["--layers", "all", "-o", "b.exr"]].concat());
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a file");
    assert!(bytes("a.exr") == bytes("b.exr"));
    let told = String::from_utf8(stride(dir.path(), &["info", "a.exr"]).stdout).expect("text");
    let mattes = |layer: &str| {
        let levels = ["00", "01", "02"].map(|level| format!("{layer}{level}"));
        levels.map(|level| ["A", "B", "G", "R"].map(|c| format!("{level}.{c}")).join(", ")).join(", ")
    };
    let channels = "G, R, albedo.B, albedo.G, albedo.R, depth.Z, normal.X, normal.Y, normal.Z, \
                    position.X, position.Y, position.Z, samples.Y, uv.U, uv.V, variance.Y\n";
    let mattes = format!("{}, {}", mattes("CryptoEntity"), mattes("CryptoMaterial"));
    assert!(told.contains(&format!("channels    B, {mattes}, {channels}")), "{told}");
    render(dir.path(), &["--spp", "8", "-o", "plain.exr", "-o", "plain.png"]);
    assert!(bytes("a.png") == bytes("plain.png") && bytes("a.exr") != bytes("plain.exr"));
    let compared = stride(dir.path(), &["compare", "a.exr", "plain.exr", "--json"]);
    let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
    assert_eq!(compared["mse"], 0.0);
    render(dir.path(), &["--spp", "8", "--layers", "depth,albedo,depth", "-o", "c.exr"]);
    let told = String::from_utf8(stride(dir.path(), &["info", "c.exr"]).stdout).expect("text");
    assert!(told.contains("B, G, R, albedo.B, albedo.G, albedo.R, depth.Z\n"), "{told}");
    let scene = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    for wrong in [&["--layers", "colour", "-o", "a.exr"][..], &["--layers", "all", "-o", "a.png"]] {
        let output = stride(dir.path(), &[&["render", &scene, "--headless"], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
}

/// A program of OpenEXR's own tools, if it is installed.
fn openexr(tool: &str) -> Option<Command> {
    let there = Command::new(tool).arg("-h").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok();
    if !there {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"), "no {tool}");
        println!("skipped: no {tool}");
    }
    there.then(|| Command::new(tool))
}

#[test]
fn the_reference_library_reads_the_file() {
    let (Some(mut header), Some(mut tiled)) = (openexr("exrheader"), openexr("exrmaketiled")) else { return };
    let dir = tempfile::tempdir().expect("a folder");
    render(dir.path(), &["--spp", "8", "--layers", "all", "-o", "a.exr"]);
    let told = header.arg("a.exr").current_dir(dir.path()).output().expect("it runs").stdout;
    let told = String::from_utf8(told).expect("text");
    let channels = [
        "B",
        "G",
        "R",
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "depth.Z",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "position.X",
        "position.Y",
        "position.Z",
        "samples.Y",
        "uv.U",
        "uv.V",
        "variance.Y",
    ];
    for name in channels {
        assert!(told.contains(&format!("    {name}, 32-bit floating-point, sampling 1 1")), "{name}: {told}");
    }
    assert!(told.contains("seed: 0") && told.contains("samples: 0..8"), "{told}");
    // A crop has its position on the film in the header, and any other picture is its whole film.
    assert!(told.contains("dataWindow (type box2i): (0 0) - (39 29)\n"), "{told}");
    render(dir.path(), &["--spp", "2", "--crop", "5,9,17,6", "-o", "crop.exr"]);
    let mut header = openexr("exrheader").expect("it is there");
    let told = header.arg("crop.exr").current_dir(dir.path()).output().expect("it runs").stdout;
    let told = String::from_utf8(told).expect("text");
    for window in ["dataWindow (type box2i): (5 9) - (21 14)", "displayWindow (type box2i): (0 0) - (39 29)"]
    {
        assert!(told.contains(window), "{window}: {told}");
    }
    // After reading and writing by OpenEXR's own code, the picture is the same to the bit.
    let status = tiled.args(["a.exr", "b.exr"]).current_dir(dir.path()).status().expect("it runs");
    assert!(status.success());
    let compare = |a: &str, b: &str| {
        let told = stride(dir.path(), &["compare", a, b, "--json"]).stdout;
        let json: serde_json::Value = serde_json::from_slice(&told).expect("JSON");
        json["mse"].as_f64().expect("a number")
    };
    assert_eq!(compare("a.exr", "b.exr"), 0.0);
    // Negative control: another seed's picture differs.
    render(dir.path(), &["--spp", "8", "--seed", "1", "-o", "c.exr"]);
    assert!(compare("c.exr", "b.exr") > 0.0);
}
