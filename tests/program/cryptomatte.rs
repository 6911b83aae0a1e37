//! Cryptomatte layers, compared with single paths and with a reader that was written from the specifications alone.

use crate::common;
use crate::common::scenes::cover;
use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use stride::film::cryptomatte::{Mattes, id};
use stride::film::{Channel, Layer};
use stride::integrator::Event;
use stride::math::lanes::Level;
use stride::render::preview;
use stride::sampling::Region;
use stride::scene::Scene;

const BOTH: [Layer; 2] = [Layer::CryptoEntity, Layer::CryptoMaterial];

/// The expected ids and coverages of a pixel: counted from the first hits of single paths.
fn counted(scene: &Scene, place: u32, samples: u32) -> Vec<(u32, f32)> {
    let integrator = common::integrator(scene);
    let pixel = Region::whole(scene.film.width, scene.film.height).pixel(place);
    let mut counts: HashMap<u32, u32> = HashMap::new();
    for sample in 0..samples {
        let (_, events) = integrator.explain(pixel, sample);
        // The first event is the camera's ray, the second its hit.
        if let Some(Event::Hit { entity, .. }) = events.get(1) {
            *counts.entry(id(&scene.entities[*entity as usize].name)).or_default() += 1;
        }
    }
    let mut ranks: Vec<_> = counts.into_iter().map(|(id, n)| (id, n as f32 / samples as f32)).collect();
    ranks.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    ranks
}

fn channel<'a>(channels: &'a [Channel], name: &str) -> &'a [f32] {
    &channels.iter().find(|channel| channel.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

#[test]
fn ranks_match_the_hits_of_single_paths() {
    let mut scene = cover(40, 30);
    for (i, entity) in scene.entities.iter_mut().enumerate() {
        entity.name = format!("thing {i}");
    }
    let (integrator, mattes) = (Arc::from(common::integrator(&scene)), Mattes::of(&scene));
    let region = Region::whole(40, 30);
    let channels = preview(&integrator, Level::available()[0], region, 6, &BOTH, &mattes);
    let ranks = |place: usize| -> Vec<(u32, f32)> {
        let at = |name: &str, c: &str| channel(&channels, &format!("CryptoEntity{name}.{c}"))[place];
        let levels = ["00", "01", "02"].into_iter();
        let all = levels.flat_map(|l| [(at(l, "R"), at(l, "G")), (at(l, "B"), at(l, "A"))]);
        all.map(|(id, coverage)| (id.to_bits(), coverage)).filter(|rank| rank.1 > 0.0).collect()
    };
    let (mut several, mut others) = (0, 0);
    for place in (0..1200).step_by(7) {
        let expected = counted(&scene, place, 6);
        assert_eq!(ranks(place as usize), expected, "place {place}");
        several += u32::from(expected.len() > 1);
        others += u32::from(counted(&scene, place, 5) != expected);
    }
    // Negative control: there are edges, and one sample fewer gives other ranks.
    assert!(several > 15 && others > 10, "{several} {others}");
}

fn stride(folder: &Path, arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_stride")).args(arguments).current_dir(folder).output().expect("stride")
}

/// Renders a scene to a.exr.
fn render(folder: &Path, more: &[&str]) {
    let arguments = [&["render", "wall.toml", "--headless", "-q", "-o", "a.exr"], more].concat();
    let output = stride(folder, &arguments);
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A python3 with NumPy, such as Debian's.
fn python() -> Option<&'static str> {
    let has = |python: &&str| {
        let status = Command::new(python).args(["-c", "import numpy"]).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    let found = ["python3", "/usr/bin/python3"].into_iter().find(has);
    if found.is_none() {
        let required = std::env::var_os("STRIDE_REQUIRE_ALL").is_some_and(|value| value == "1");
        assert!(!required, "no python3 has numpy");
        println!("skipped: no python3 with numpy");
    }
    found
}

const WALL: &str = r#"
    [film]
    width = 16
    height = 20
    filter = "none"
    [camera]
    eye = [1, 0, 0]
    [environment]
    radiance = [1, 1, 1]
    [materials]
    "grau \"größe\"" = { type = "matte", reflectance = [0.5, 0.25, 0.125] }
    glass = { type = "glass", ior = 1.5 }
    checks = { type = "checkerboard", even = "grau \"größe\"", odd = "glass" }
    [[entities]]
    name = "wall"
    shape = { type = "quad", corner = [4, -9, -9], u = [0, 0, 18], v = [0, 9, 0] }
    material = "checks"
    [[entities]]
    shape = { type = "quad", corner = [3, 0, -9], u = [0, 9, 0], v = [0, 0, 9] }
    material = "glass"
    [[entities]]
    name = "far"
    shape = { type = "sphere", center = [-9, 0, 0], radius = 1 }
    material = "grau \"größe\""
"#;

#[test]
fn an_independent_cryptomatte_reader_gets_the_mattes() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("a folder");
    fs::write(dir.path().join("wall.toml"), WALL).expect("a scene");
    render(dir.path(), &["--spp", "4", "--layers", "crypto-entity,crypto-material"]);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/cryptomatte.py");
    let read = |file: &str| {
        let output =
            Command::new(python).args([script, file]).current_dir(dir.path()).output().expect("python");
        serde_json::from_slice::<serde_json::Value>(&output.stdout)
            .map_err(|_| String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let told = read("a.exr").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((&told["width"], &told["height"]), (&16.into(), &20.into()));
    // Right of the centre the wall, three in front of the eye; in the lower left quarter the other quad; nothing
    // elsewhere. The sphere is behind the eye.
    let covers = |layer: &str, name: &str, is_there: &dyn Fn(usize, usize) -> bool| {
        let matte = told["mattes"][layer][name].as_array().unwrap_or_else(|| panic!("no {layer} {name}"));
        let is_so = |(i, coverage): (usize, &serde_json::Value)| {
            coverage.as_f64() == Some(f64::from(u8::from(is_there(i % 16, i / 16))))
        };
        matte.iter().enumerate().all(is_so)
    };
    let (right, left_below) = (|x: usize, _: usize| x >= 8, |x: usize, y: usize| x < 8 && y >= 10);
    assert!(covers("CryptoEntity", "wall", &right) && covers("CryptoEntity", "entity 2", &left_below));
    assert!(covers("CryptoMaterial", "checks", &right) && covers("CryptoMaterial", "glass", &left_below));
    for (layer, name) in [("CryptoEntity", "far"), ("CryptoMaterial", "grau \"größe\"")] {
        assert!(covers(layer, name, &|_, _| false), "{name}");
    }
    // Negative controls: the masks differ, and a file with a wrong manifest is rejected.
    assert!(!covers("CryptoEntity", "wall", &left_below));
    let mut file = fs::read(dir.path().join("a.exr")).expect("a file");
    let digits = format!("{:08x}", id("wall"));
    let at = file.windows(8).position(|window| window == digits.as_bytes()).expect("in the manifest");
    file[at + 7] = if file[at + 7] == b'0' { b'1' } else { b'0' };
    fs::write(dir.path().join("b.exr"), &file).expect("a file");
    assert!(read("b.exr").is_err_and(|error| error.contains("a hash is not that of its name")));
}

#[test]
fn equal_renders_give_equal_files_and_info_lists_mattes() {
    let dir = tempfile::tempdir().expect("a folder");
    fs::write(dir.path().join("wall.toml"), WALL).expect("a scene");
    let more = ["--spp", "4", "--layers", "crypto-material,depth,crypto-entity"];
    render(dir.path(), &more);
    let file = fs::read(dir.path().join("a.exr")).expect("a file");
    // Eight attributes in random order would be in the same order by chance once in 40,000 times.
    for threads in ["1", "3"] {
        render(dir.path(), &[&more[..], &["--threads", threads]].concat());
        assert!(fs::read(dir.path().join("a.exr")).expect("a file") == file, "{threads} threads");
    }
    let told = String::from_utf8(stride(dir.path(), &["info", "a.exr"]).stdout).expect("text");
    assert!(told.contains("mattes      CryptoEntity (3 names), CryptoMaterial (3 names)\n"), "{told}");
    assert!(told.contains("CryptoEntity02.R, CryptoMaterial00.A,"), "{told}");
    // Another entity name changes its id, and nothing else.
    fs::write(dir.path().join("wall.toml"), WALL.replace("\"wall\"", "\"wand\"")).expect("a scene");
    render(dir.path(), &more);
    assert!(fs::read(dir.path().join("a.exr")).expect("a file") != file);
    render(dir.path(), &["--spp", "4", "--layers", "depth"]);
    let told = String::from_utf8(stride(dir.path(), &["info", "a.exr"]).stdout).expect("text");
    assert!(!told.contains("mattes"), "{told}");
}
