//! The bits of images do not change: a digest of every scene with every integrator and sampler.
//!
//! `tests/digests.txt` contains the digests. They do not prove that an image is right, only that it has not changed;
//! other tests compare images with mathematics and independent renderers. A change that alters bits on purpose runs
//! `STRIDE_BLESS=1 cargo test --release --test program digests` and states the reason in its commit message.

use crate::common;
use crate::common::scenes::*;
use glam::DVec3;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::{env, fs};
use stride::integrator::{FirstHit, Paths};
use stride::math::lanes::Level;
use stride::output::read_picture;
use stride::sampling::Region;
use stride::scene::{Integrator, Material, MaterialKind, MatteParameters, Sampler, Scene, load};
use stride::world::AcceleratorChoice;

const INTEGRATORS: [(&str, Integrator); 3] =
    [("path", Integrator::Path), ("path-naive", Integrator::PathNaive), ("whitted", Integrator::Whitted)];
const SAMPLERS: [(&str, Sampler); 2] = [("sobol", Sampler::Sobol), ("independent", Sampler::Independent)];
const WORLDS: [(&str, AcceleratorChoice); 2] =
    [("simple", AcceleratorChoice::Simple), ("bvh", AcceleratorChoice::Bvh)];
const SIZE: [u32; 2] = [24, 18];
const SAMPLES: u32 = 3;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scene files of the repository, by name.
fn scene_files() -> BTreeMap<String, PathBuf> {
    let files =
        fs::read_dir(root().join("scenes")).expect("scenes/").map(|entry| entry.expect("an entry").path());
    let files = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.map(|path| (path.file_stem().unwrap().to_string_lossy().into_owned(), path)).collect()
}

/// Every scene of the repository, and scenes with further features: many lights, textures, shared meshes, emissive
/// meshes.
fn scenes() -> Vec<(String, Scene)> {
    let [width, height] = SIZE;
    let files = scene_files().into_iter().map(|(name, path)| (name, load(&path).expect("a scene").scene));
    let built = [
        ("built: bazaar", bazaar(width, height)),
        ("built: gallery", gallery(width, height)),
        ("built: glow", glow(width, height)),
        ("built: interiors", interiors(width, height)),
        ("built: meshes", mesh_room(width, height)),
        ("built: modified", modified(width, height)),
        ("built: sunny", sunny(width, height)),
    ];
    files.chain(built.map(|(name, scene)| (name.to_owned(), scene))).collect()
}

/// Meshes with shading normals of every material, illuminated by a mesh and a point light, with a thin lens.
fn mesh_room(width: u32, height: u32) -> Scene {
    let ball = |centre, radius, n, material| mesh(icosphere(centre, radius, n, true), material);
    let entities = vec![
        plane(DVec3::Z, -1.0, 4),
        ball(v(5.0, -1.5, 0.0), 1.0, 4, 2),
        ball(v(5.0, 1.2, -0.2), 0.8, 3, 1),
        ball(v(3.5, 0.1, -0.5), 0.5, 2, 0),
        mesh(icosphere(v(7.0, 0.3, 0.3), 0.9, 2, false), 3),
        emitting(ball(v(4.0, 0.0, 2.2), 0.4, 2, 0), 6.0),
    ];
    let red = Material {
        name: "red".into(),
        kind: MaterialKind::Matte(MatteParameters { reflectance: [0.8, 0.2, 0.1], roughness: 0.0 }),
        ..Material::default()
    };
    let materials =
        vec![matte([0.7, 0.6, 0.5]), mirror([0.9, 0.8, 0.7]), glass(1.5), red, checkerboard(0, 3, 2.0)];
    let mut all = scene(materials, entities);
    all.lights = vec![point_light(v(3.0, 2.0, 3.0), 4.0)];
    all.environment = [0.1, 0.2, 0.3];
    all.camera.aperture_radius = 0.05;
    all.camera.focus_distance = 5.0;
    all.render.max_depth = 9;
    sized(all, width, height)
}

/// A digest, long enough that no two images share one.
fn digest(words: impl IntoIterator<Item = u32>) -> String {
    let mut hash = Sha256::new();
    words.into_iter().for_each(|word| hash.update(word.to_le_bytes()));
    hash.finalize()[..12].iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// The words of a sample: its pixel and index, its film position, and its radiance.
type SampleWords = [u32; 7];

/// All samples and all first hits of a small image at one level, as words, in a defined order.
fn traced_words(scene: &Scene, accelerator: AcceleratorChoice, level: Level) -> (Vec<SampleWords>, Vec<u32>) {
    let integrator = common::integrator_in(scene, accelerator);
    let region = Region::whole(scene.film.width, scene.film.height);
    let pixels: Vec<_> = (0..region.len()).map(|place| region.pixel(place)).collect();
    let paths = Paths { pixels: &pixels, first_sample: 5, samples: SAMPLES };
    let (mut samples, mut hits) = (Vec::new(), Vec::new());
    integrator.trace(level, &paths, &mut samples);
    integrator.first_hits(level, &Paths { samples: 1, ..paths }, &mut hits);
    let mut samples: Vec<_> = samples
        .iter()
        .map(|f| {
            let [r, g, b] = f.sample.radiance.map(f32::to_bits);
            [f.sample.pixel, f.sample.sample, f.sample.x.to_bits(), f.sample.y.to_bits(), r, g, b]
        })
        .collect();
    samples.sort_unstable();
    let hit = |hit: &FirstHit| {
        let floats = [hit.albedo, hit.normal, hit.position, [hit.depth, hit.uv[0], hit.uv[1]]];
        let floats = floats.into_iter().flatten().map(f32::to_bits);
        [hit.slot, u32::from(hit.met), hit.entity, hit.material].into_iter().chain(floats).collect::<Vec<_>>()
    };
    (samples, hits.iter().flat_map(hit).collect())
}

/// Digests of them.
fn traced(scene: &Scene, accelerator: AcceleratorChoice, level: Level) -> [String; 2] {
    let (samples, hits) = traced_words(scene, accelerator, level);
    [digest(samples.into_iter().flatten()), digest(hits)]
}

/// The committed digests.
fn committed() -> BTreeMap<String, String> {
    let text = fs::read_to_string(root().join("tests/digests.txt")).unwrap_or_default();
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.filter_map(|line| line.rsplit_once(": ")).map(|(k, v)| (k.to_owned(), v.to_owned())).collect()
}

/// Sections are replaced one at a time.
static FILE: Mutex<()> = Mutex::new(());

/// Compares digests of one section with the committed ones, or replaces these.
fn hold(section: &str, found: &BTreeMap<String, String>) {
    let _file = FILE.lock();
    let (before, others): (BTreeMap<_, _>, BTreeMap<_, _>) =
        committed().into_iter().partition(|(key, _)| key.starts_with(section));
    if env::var_os("STRIDE_BLESS").is_some() {
        let path = root().join("tests/digests.txt");
        let all: BTreeMap<_, _> = others.into_iter().chain(found.clone()).collect();
        let mut text = String::from("# Digests of pictures, kept by tests/program/digests.rs.\n");
        all.iter().for_each(|(key, value)| {
            let _ = writeln!(text, "{key}: {value}");
        });
        fs::write(path, text).expect("written");
        return;
    }
    let changed: Vec<_> = found.iter().filter(|(key, value)| before.get(*key) != Some(value)).collect();
    assert!(changed.is_empty(), "the bits of {} pictures have changed: {changed:#?}", changed.len());
    let gone: Vec<_> = before.keys().filter(|key| !found.contains_key(*key)).collect();
    assert!(gone.is_empty(), "pictures that are no longer made: {gone:#?}");
}

#[test]
fn samples_are_unchanged_at_every_level_in_every_world() {
    let mut found = BTreeMap::new();
    for (name, mut scene) in scenes() {
        [scene.film.width, scene.film.height] = SIZE;
        for (integrator_name, integrator) in INTEGRATORS {
            for (sampler_name, sampler) in SAMPLERS {
                (scene.render.integrator, scene.render.sampler) = (integrator, sampler);
                let key = format!("samples, {name}, {integrator_name}, {sampler_name}");
                let [samples, hits] = traced(&scene, AcceleratorChoice::Simple, Level::available()[0]);
                for (world, accelerator) in WORLDS {
                    for level in Level::available() {
                        let other = traced(&scene, accelerator, level);
                        assert_eq!(other, [samples.clone(), hits.clone()], "{key}, {world}, {level}");
                    }
                }
                found.insert(key.clone(), samples);
                found.insert(key.replace("samples, ", "samples, first hits, "), hits);
            }
        }
    }
    hold("samples, ", &found);
}

#[test]
fn images_of_the_program_are_unchanged_for_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut found = BTreeMap::new();
    for (name, path) in scene_files() {
        for (integrator, _) in INTEGRATORS {
            let key = format!("pictures, {name}, {integrator}");
            for threads in ["1", "2", "3", "7"] {
                let out = folder.path().join("picture.exr");
                let [width, height] = SIZE;
                let ran = Command::new(env!("CARGO_BIN_EXE_stride"))
                    .arg("render")
                    .arg(&path)
                    .args(["--headless", "--quiet", "--spp", "3", "--threads", threads])
                    .args(["--integrator", integrator, "--size", &format!("{width}x{height}"), "-o"])
                    .arg(&out)
                    .output()
                    .expect("the program runs");
                // Not every scene suits every integrator: `whitted` does not support an unlimited depth.
                if !ran.status.success() {
                    let error = String::from_utf8_lossy(&ran.stderr).into_owned();
                    assert!(error.contains("whitted"), "{key}: {error}");
                    continue;
                }
                let (_, picture) = read_picture(&out).expect("a picture");
                let bits = digest(picture.rgb.iter().flatten().map(|x| x.to_bits()));
                let before = found.insert(key.clone(), bits.clone());
                assert!(before.is_none_or(|before| before == bits), "{key}: {threads} threads");
            }
        }
    }
    hold("pictures, ", &found);
}

#[test]
fn images_that_differ_in_one_bit_have_different_digests() {
    let (samples, hits) = traced_words(&cover(8, 6), AcceleratorChoice::Simple, Level::available()[0]);
    let before = digest(samples.iter().copied().flatten());
    // The lowest bit of one channel of one sample, wherever it is.
    for (sample, word) in [(0, 4), (samples.len() / 2, 5), (samples.len() - 1, 6)] {
        let mut flipped = samples.clone();
        flipped[sample][word] ^= 1;
        assert!(digest(flipped.into_iter().flatten()) != before, "{sample} {word}");
    }
    let mut flipped = hits.clone();
    flipped[hits.len() / 2] ^= 1;
    assert!(digest(flipped) != digest(hits));
    assert!(digest([1, 2, 3]) != digest([1, 2, 2]));
}
