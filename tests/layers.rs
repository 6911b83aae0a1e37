//! Layers: what is seen first, beside colour in EXR files.

mod common;

use common::scenes::cover;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use stride::film::layers::NO_DEPTH;
use stride::film::{Channel, Layer};
use stride::integrator::{Event, Integrator};
use stride::math::lanes::Level;
use stride::render::{Region, first_hit_layers, layer_samples};
use stride::scene::{Scene, parse};

fn layers(scene: &Scene, region: Region, samples: u32, threads: usize) -> Vec<Channel> {
    let integrator = common::integrator(scene);
    let level = Level::available()[0];
    first_hit_layers(&*integrator, level, region, 0..samples, threads, &Layer::ALL)
}

fn channel<'a>(channels: &'a [Channel], name: &str) -> &'a [f32] {
    let found = channels.iter().find(|channel| channel.name == name);
    &found.unwrap_or_else(|| panic!("no {name}")).values
}

/// Means of what single paths tell of their first hits, as the layers should have them; none where no path met
/// anything. A path that is traced alone is no lane of many.
fn told(integrator: &dyn Integrator, scene: &Scene, place: u32, samples: u32) -> Option<Vec<(String, f64)>> {
    let pixel = Region::whole(scene.film.width, scene.film.height).pixel(place);
    let (mut met, mut sums) = (0.0, [0.0_f64; 7]);
    for sample in 0..samples {
        let (_, events) = integrator.explain(pixel, sample);
        let hit = events.iter().find_map(|event| match event {
            Event::Hit { point, normal, .. } => Some((*point, *normal)),
            _ => None,
        });
        // The first event is the camera's ray, the second what it met.
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
fn layers_are_the_means_of_what_paths_meet_first() {
    let scene = cover(40, 30);
    let region = Region::whole(40, 30);
    let channels = layers(&scene, region, 6, 2);
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
    // Negative control: means of one sample fewer are others.
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
fn a_wall_has_the_layers_that_one_can_work_out() {
    let scene = parse(WALL, Path::new("wall.toml")).expect("a scene").scene;
    let channels = layers(&scene, Region::whole(16, 12), 2, 3);
    let at = |name: &str, x: usize, y: usize| channel(&channels, name)[y * 16 + x];
    // Right of the middle a grey wall three in front of the eye; its u × v faces away along +x... and the left is
    // the camera's +y: there, in the lower half, glass two in front; in the upper half nothing.
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
fn no_threads_lanes_or_crops_show() {
    let scene = cover(40, 30);
    let whole = layers(&scene, Region::whole(40, 30), 5, 1);
    for threads in [2, 3, 50] {
        assert!(layers(&scene, Region::whole(40, 30), 5, threads) == whole, "{threads} threads");
    }
    let integrator = common::integrator(&scene);
    for level in Level::available() {
        let region = Region::whole(40, 30);
        assert!(first_hit_layers(&*integrator, level, region, 0..5, 2, &Layer::ALL) == whole, "{level}");
    }
    let region = Region { film_width: 40, x: 11, y: 7, width: 9, height: 5 };
    let crop = layers(&scene, region, 5, 2);
    for (part, whole) in crop.iter().zip(&whole) {
        for place in 0..region.len() {
            let there = region.pixel(place).index as usize;
            assert_eq!(part.values[place as usize], whole.values[there], "{}", part.name);
        }
    }
    assert_eq!([1, 3, 64, 100_000].map(layer_samples), [1, 1, 16, 32]);
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
fn files_have_the_layers_that_were_asked_for_and_the_colour_is_the_same() {
    let dir = tempfile::tempdir().expect("a folder");
    render(dir.path(), &["--spp", "8", "--threads", "1", "--layers", "all", "-o", "a.exr", "-o", "a.png"]);
    render(dir.path(), &["--spp", "3", "--film", "b.film", "-o", "b.exr"]);
    // Gone on with, on other threads: the same file.
    let rest = ["--spp", "8", "--resume", "b.film", "--threads", "3"];
    render(dir.path(), &[&rest[..], &["--layers", "all", "-o", "b.exr"]].concat());
    let bytes = |name: &str| fs::read(dir.path().join(name)).expect("a file");
    assert!(bytes("a.exr") == bytes("b.exr"));
    let told = String::from_utf8(stride(dir.path(), &["info", "a.exr"]).stdout).expect("text");
    let channels = "channels    B, G, R, albedo.B, albedo.G, albedo.R, depth.Z, normal.X, normal.Y, normal.Z, \
                    position.X, position.Y, position.Z, samples.Y, uv.U, uv.V, variance.Y\n";
    assert!(told.contains(channels), "{told}");
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

/// Reads the file with the makers' own reader: every channel as 32-bit floats, the facts, and the means of two.
const OPEN: &str = "
import sys, numpy, OpenEXR, Imath
f = OpenEXR.InputFile(sys.argv[1])
h = f.header()
w = h['dataWindow']
size = (w.max.y - w.min.y + 1, w.max.x - w.min.x + 1)
float_type = Imath.PixelType(Imath.PixelType.FLOAT)
assert all(c.type == float_type for c in h['channels'].values()), h['channels']
read = lambda name: numpy.frombuffer(f.channel(name, float_type), 'f4').reshape(size)
assert (read('samples.Y') == 8).all() and (read('depth.Z') > 0).all() and (read('variance.Y') >= 0).all()
n = sum(read('normal.' + c) ** 2 for c in 'XYZ')
assert (n < 1.0001).all() and (n > 0.2).mean() > 0.99
assert b'seed: 0' in h['comments'], h['comments']
print(len(h['channels']), *size)
";

#[test]
fn the_makers_of_the_format_open_it() {
    let has = |python: &&str| {
        let program = ["-c", "import OpenEXR, Imath, numpy"];
        let status = Command::new(python).args(program).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    let Some(python) = ["python3", "/usr/bin/python3"].into_iter().find(has) else {
        assert!(std::env::var_os("STRIDE_REQUIRE_ALL").is_none(), "no python3 has OpenEXR");
        println!("skipped: no python3 with OpenEXR");
        return;
    };
    let dir = tempfile::tempdir().expect("a folder");
    render(dir.path(), &["--spp", "8", "--layers", "all", "-o", "a.exr"]);
    let run = |program: &str| {
        let output = Command::new(python).args(["-c", program]).arg(dir.path().join("a.exr")).output();
        output.expect("python runs")
    };
    let output = run(OPEN);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "17 30 40");
    // Negative control: the program notices another number of samples.
    assert!(!run(&OPEN.replace("== 8", "== 9")).status.success());
}
