//! GPU workers in place of CPU workers: the same channels, the same accumulator.
#![cfg(feature = "gpu")]

mod common;

use common::watched::Watched;
use crossbeam_channel::{bounded, never};
use glam::DVec3;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use stride::camera::CameraSettings;
use stride::film::{Film, Layer, LayerSet, Layout, film_offset};
use stride::gpu::{self, GpuError, GpuWorker, Job};
use stride::math::lanes::Level;
use stride::output::open_film;
use stride::render::accumulator::{Inbox, Outcome};
use stride::render::{Accumulator, Configuration, FirstHitTracer, Port, Schedule, Stride};
use stride::sampling::Region;
use stride::scene::{
    Entity, FilmSettings, Integrator, Material, MaterialKind, MatteParameters, MirrorParameters,
    PlaneParameters, RenderSettings, Sampler, Scene, Shape, SphereParameters,
};
use stride::world::{AcceleratorChoice, World, compile};

/// A mirror sphere and a light over a matte floor.
fn scene(width: u32, height: u32) -> Scene {
    let material = |kind| Material { name: "a material".to_owned(), kind, ..Material::default() };
    let entity =
        |shape, material, emission| Entity { shape, material, emission: [emission; 3], ..Entity::default() };
    let sphere = |x, y, z, radius| Shape::Sphere(SphereParameters { center: DVec3::new(x, y, z), radius });
    Scene {
        film: FilmSettings { width, height, ..FilmSettings::default() },
        camera: CameraSettings { vertical_fov: 1.2, ..CameraSettings::default() },
        render: RenderSettings {
            integrator: Integrator::PathNaive,
            sampler: Sampler::Independent,
            samples: 1,
            ..RenderSettings::default()
        },
        materials: vec![
            material(MaterialKind::Matte(MatteParameters { reflectance: [0.7, 0.6, 0.5], roughness: 0.0 })),
            material(MaterialKind::Mirror(MirrorParameters { reflectance: [0.9, 0.9, 0.8] })),
        ],
        entities: vec![
            entity(Shape::Plane(PlaneParameters { normal: DVec3::Z, distance: -1.0 }), 0, 0.0),
            entity(sphere(4.0, -1.0, 0.0, 1.0), 1, 0.0),
            entity(sphere(5.0, 1.5, 1.5, 0.8), 0, 4.0),
        ],
        environment: [0.1, 0.1, 0.2],
        ..Scene::default()
    }
}

/// The tracer of first hits for all layers of a scene.
fn first_hit_tracer(scene: &Scene, threads: usize) -> FirstHitTracer {
    let (integrator, level) = (Arc::from(common::integrator(scene)), Level::available()[0]);
    let layers = LayerSet::new(&Layer::ALL, scene.entities.len(), scene.materials.len());
    let region = Region::whole(scene.film.width, scene.film.height);
    FirstHitTracer { integrator, level, layers, region, threads }
}

/// Renders with a number of GPU workers; `None` where there is no GPU and that is allowed.
fn render(scene: &Scene, workers: u32, spp: u32) -> Option<Outcome> {
    let device = match gpu::Device::open(None) {
        Ok(device) => device,
        Err(GpuError::NoAdapter | GpuError::NotBuilt)
            if std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1") =>
        {
            println!("skipped: no GPU adapter");
            return None;
        }
        Err(error) => panic!("{error}"),
    };
    let (width, height) = (scene.film.width, scene.film.height);
    let (compiled, surfaces) = compile(scene, width, height).unwrap();
    let world = World::new(&surfaces, AcceleratorChoice::Fastest);
    let compiled = compiled.with_camera_media(&world);
    let region = Region::whole(width, height);
    let (batches_out, batches) = bounded(2 * workers as usize);
    let (_changes_out, changes) = bounded(1);
    let (_stop_out, stop) = bounded(1);
    std::thread::scope(|scope| {
        let mut orders = Vec::new();
        for index in 0..workers {
            let (orders_out, orders_in) = bounded(2);
            orders.push(orders_out);
            let job = Job {
                scene: &compiled,
                world: &world,
                render: &scene.render,
                offset: film_offset(&scene.film),
                region,
                index: index as usize,
                sends_samples: false,
                splatter: None,
            };
            let mut worker = GpuWorker::new(&device, &job).unwrap();
            worker.trace_first_hits_with(Some(first_hit_tracer(scene, 2)));
            let batches_out = batches_out.clone();
            scope.spawn(move || worker.run(&orders_in, &batches_out).unwrap());
        }
        drop(batches_out);
        let schedule = Schedule::new(workers as usize, region.len(), spp, None, Vec::new());
        let layers = first_hit_tracer(scene, 1).layers;
        let film = Film::with_layout(Layout { layers, ..Layout::plain(width, height) }).unwrap();
        let ports = orders.into_iter().map(Port::new).collect();
        let accumulator = Accumulator::new(Configuration::new(film, region, schedule, ports));
        Some(accumulator.run(Inbox { batches, changes, stop, viewer: never() }))
    })
}

#[test]
fn the_film_is_the_same_in_every_run_and_for_any_number_of_workers() {
    let scene = scene(64, 48);
    let Some(alone) = render(&scene, 1, 40) else { return };
    assert!(alone.whole && alone.failure.is_none());
    assert_eq!((alone.totals.samples, alone.totals.rejected), (64 * 48 * 40, 0));
    assert!(alone.totals.rays > alone.totals.samples);
    for workers in [1, 3] {
        let other = render(&scene, workers, 40).unwrap();
        assert!(other.film == alone.film, "{workers} workers make another film");
        assert_eq!(other.totals.rays, alone.totals.rays);
    }
    // Layers are traced on the CPU, from the first samples.
    let traced = |end| first_hit_tracer(&scene, 1).trace_first_hits(Stride::ALL, 0..64 * 48, &(0..end)).sums;
    assert!(*alone.film.first_hits() == traced(40) && traced(32) == traced(40) && traced(31) != traced(40));
    // Negative control: one sample more makes another film.
    assert!(render(&scene, 1, 41).unwrap().film != alone.film);
}

#[test]
fn adapters_describe_themselves() {
    for adapter in gpu::adapters() {
        assert!(!adapter.name.is_empty() && adapter.max_binding > 0 && adapter.max_workgroup_size > 0);
        assert!(adapter.to_string().contains(&adapter.name));
    }
}

/// Runs the program in a folder with a device; `None` where there is no GPU and that is allowed.
fn program(folder: &Path, device: &str, more: &[&str]) -> Option<Value> {
    if gpu::adapters().is_empty() && std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1") {
        println!("skipped: no GPU adapter");
        return None;
    }
    let cover = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", &cover, "--headless", "-q", "--size", "64x48", "--threads", "2", "--device", device])
        .args(["--stats", "s.json"])
        .args(more)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(output.status.success(), "{more:?}: {}", String::from_utf8_lossy(&output.stderr));
    let stats = std::fs::read(folder.join("s.json")).expect("statistics");
    Some(serde_json::from_slice(&stats).expect("JSON"))
}

#[test]
fn cpu_and_gpu_together_render_the_whole_image_and_report_reproducibility() {
    let dir = tempfile::tempdir().unwrap();
    let all = ["--spp", "64", "--layers", "all", "--film", "a.film", "-o", "a.exr"];
    let Some(stats) = program(dir.path(), "all", &all) else { return };
    let devices = stats["devices"].as_array().expect("a list");
    let made: Vec<_> = devices.iter().map(|device| device["samples"].as_u64().expect("a number")).collect();
    assert!(made.len() == 2 && made.iter().all(|&n| n > 0), "{made:?}");
    assert_eq!(made.iter().sum::<u64>(), 64 * 48 * 64);
    assert_eq!((&stats["spp"], &stats["samples"]), (&64.0.into(), &(64 * 48 * 64).into()));
    assert!(stats["promise"].as_str().expect("words").contains("statistically"), "{stats}");
    assert!(stats["lost"].is_null());
    // Both devices use the same random numbers: the differences from the CPU's image are rounding errors.
    program(dir.path(), "cpu", &["--spp", "64", "--layers", "all", "--film", "b.film", "-o", "b.exr"]);
    let [all, cpu] = ["a.exr", "b.exr"]
        .map(|name| stride::output::read_picture(&dir.path().join(name)).expect("a picture").1.rgb);
    let differs = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.02 * (a + b));
    let different = all.iter().zip(&cpu).filter(|(a, b)| differs(a, b)).count();
    assert!(different < all.len() / 100, "{different} pixels differ");
    assert!(all != cpu, "the GPU has had no part in it");
    let film = |name: &str| open_film(&dir.path().join(name)).expect("a film").read().expect("a whole film");
    let [all, cpu] = ["a.film", "b.film"].map(film);
    assert!(all.first_hits() == cpu.first_hits() && all.first_hits().samples(1000) == u32::MAX);
}

#[test]
fn the_owner_overlay_shows_the_gpu_beside_the_threads() {
    let dir = tempfile::tempdir().unwrap();
    if program(dir.path(), "all", &["--spp", "1", "--overlay", "owner", "-o", "o.png"]).is_none() {
        return;
    }
    let picture = image::open(dir.path().join("o.png")).expect("a picture").to_rgb8();
    let colours: std::collections::BTreeSet<_> = picture.pixels().map(|pixel| pixel.0).collect();
    assert_eq!(colours.len(), 3);
}

#[test]
fn two_runs_on_the_gpu_write_the_same_files() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.exr", "b.exr"] {
        if program(dir.path(), "gpu", &["--spp", "9", "-o", name]).is_none() {
            return;
        }
    }
    let [a, b] = ["a.exr", "b.exr"].map(|name| std::fs::read(dir.path().join(name)).unwrap());
    assert!(a == b);
    program(dir.path(), "gpu", &["--spp", "9", "--seed", "1", "-o", "b.exr"]);
    assert!(a != std::fs::read(dir.path().join("b.exr")).unwrap(), "another seed");
}

#[cfg(unix)]
#[test]
fn an_interrupted_gpu_render_keeps_its_samples() {
    for device in ["gpu", "all"] {
        let dir = tempfile::tempdir().unwrap();
        if program(dir.path(), device, &["--spp", "1", "-o", "o.exr"]).is_none() {
            return;
        }
        let cover = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
        command
            .args(["render", &cover, "--headless", "--spp", "4000000000", "--size", "64x48", "-o", "a.exr"])
            .args(["--samples", "a.npy", "--device", device])
            .current_dir(dir.path());
        let mut run = Watched::start(command, dir.path());
        // Until there are samples: the dump has a header from the start.
        run.wait_for("a.npy", |dump| std::fs::metadata(dump).map_or(0, |file| file.len()) >= 4096);
        run.interrupt();
        let (code, said) = run.end();
        assert_eq!(code, Some(0), "{said}");
        assert!(dir.path().join("a.exr").exists());
    }
}

#[test]
fn a_killed_and_resumed_gpu_render_is_the_same() {
    let dir = tempfile::tempdir().unwrap();
    if program(dir.path(), "gpu", &["--spp", "1", "-o", "o.exr"]).is_none() {
        return;
    }
    let cover = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
    let render = |film: &str, spp: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
        command.args(["render", &cover, "--headless", "-q", "--size", "64x48", "--device", "gpu"]);
        command.args(["--checkpoint", "10ms", "-o", "part.exr", film, "part.film", "--spp", spp]);
        command.args(["--layers", "all"]);
        command.current_dir(dir.path());
        command
    };
    // Killed once when a film has just been written, and again during later writes. The end is not awaited.
    let endless = "4000000000";
    let mut begun = Watched::start(render("--film", endless), dir.path());
    begun.wait_for("part.film", Path::exists);
    assert!(begun.kill_at_change(0).is_none(), "a render without end has ended");
    for change in [7, 12] {
        let mut more = Watched::start(render("--resume", endless), dir.path());
        assert!(more.kill_at_change(change).is_none(), "a render without end has ended");
    }
    let film = open_film(&dir.path().join("part.film")).expect("a film").read().expect("a whole film");
    let most = film.seen_range()[1];
    let [spp, less] = [most + 2, most + 1].map(|spp| spp.to_string());
    assert!(render("--resume", &spp).status().expect("the program starts").success());
    let whole = ["--spp", &spp, "--layers", "all", "--film", "whole.film", "-o", "whole.exr"];
    program(dir.path(), "gpu", &whole);
    let bytes = |name: &str| std::fs::read(dir.path().join(name)).expect(name);
    assert!(bytes("part.exr") == bytes("whole.exr") && bytes("part.film") == bytes("whole.film"));
    // Negative control: one sample less makes other files.
    program(dir.path(), "gpu", &["--spp", &less, "--film", "less.film", "-o", "less.exr"]);
    assert!(bytes("less.exr") != bytes("whole.exr") && bytes("less.film") != bytes("whole.film"));
}

#[test]
fn without_an_adapter_all_uses_the_cpu_and_gpu_is_an_error_with_a_remedy() {
    // Loaders search for drivers where these variables point.
    let run = |device: &str| {
        let cover = format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"));
        let dir = tempfile::tempdir().unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_stride"))
            .args(["render", &cover, "--headless", "--size", "32x24", "--spp", "2", "--device", device])
            .args(["-o", "a.exr"])
            .envs(["VK_ICD_FILENAMES", "VK_DRIVER_FILES"].map(|name| (name, "/nonexistent")))
            .current_dir(dir.path())
            .output()
            .expect("the program starts");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), dir)
    };
    if !cfg!(target_os = "linux") {
        println!("skipped: only Vulkan's loader can be told that there is no driver");
        return;
    }
    let (code, said, dir) = run("all");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("warning: no GPU was found") && said.contains("the CPU renders alone"), "{said}");
    assert!(dir.path().join("a.exr").exists());
    let (code, said, dir) = run("gpu");
    assert_eq!(code, Some(1));
    assert!(said.contains("mesa-vulkan-drivers") && said.contains("--device cpu"), "{said}");
    assert!(!dir.path().join("a.exr").exists());
}
