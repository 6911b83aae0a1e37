//! GPU workers in the place of CPU workers: the same channels, the same accumulator.
#![cfg(feature = "gpu")]

use crossbeam_channel::bounded;
use glam::DVec3;
use stride::camera::CameraSettings;
use stride::film::{Film, film_offset};
use stride::gpu::{self, GpuError, GpuWorker, Job};
use stride::render::accumulator::{Inbox, Outbox, Outcome};
use stride::render::{Accumulator, Region, Schedule};
use stride::scene::{
    Entity, FilmSettings, Filter, Integrator, Material, MaterialKind, RenderSettings, Sampler, Scene, Shape,
};
use stride::world::compile;

/// A mirror sphere and a light over a matte floor.
fn scene(width: u32, height: u32) -> Scene {
    let material = |kind| Material { name: "a material".to_owned(), kind };
    let entity = |shape, material, emission| Entity {
        name: "an entity".to_owned(),
        shape,
        material,
        emission: [emission; 3],
        flip_normal: false,
    };
    let sphere = |x, y, z, radius| Shape::Sphere { center: DVec3::new(x, y, z), radius };
    Scene {
        film: FilmSettings { width, height, exposure: 0.0, filter: Filter::Tent { radius: 1.0 } },
        camera: CameraSettings {
            eye: DVec3::ZERO,
            forward: DVec3::X,
            up: DVec3::Z,
            vertical_fov: 1.2,
            focal_length: 1.0,
            near: 0.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        },
        render: RenderSettings {
            integrator: Integrator::PathNaive,
            sampler: Sampler::Independent,
            max_depth: 5,
            samples: 1,
            seed: 0,
            ambient: [0.0; 3],
        },
        materials: vec![
            material(MaterialKind::Matte { reflectance: [0.7, 0.6, 0.5] }),
            material(MaterialKind::Mirror { reflectance: [0.9, 0.9, 0.8] }),
        ],
        entities: vec![
            entity(Shape::Plane { normal: DVec3::Z, distance: -1.0 }, 0, 0.0),
            entity(sphere(4.0, -1.0, 0.0, 1.0), 1, 0.0),
            entity(sphere(5.0, 1.5, 1.5, 0.8), 0, 4.0),
        ],
        lights: Vec::new(),
        environment: [0.1, 0.1, 0.2],
    }
}

/// Renders with so many GPU workers, or not at all where there is no GPU and that is allowed.
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
    let (compiled, _) = compile(scene, width, height);
    let region = Region::whole(width, height);
    let (batches_out, batches) = bounded(2 * workers as usize);
    let (_failures_out, failures) = bounded(1);
    let (_stop_out, stop) = bounded(1);
    std::thread::scope(|scope| {
        let mut orders = Vec::new();
        for index in 0..workers {
            let (orders_out, orders_in) = bounded(2);
            orders.push(Some(orders_out));
            let job = Job {
                scene: &compiled,
                render: &scene.render,
                offset: film_offset(scene.film.filter),
                region,
                index: index as usize,
                sends_samples: false,
            };
            let mut worker = GpuWorker::new(&device, &job).unwrap();
            let batches_out = batches_out.clone();
            scope.spawn(move || worker.run(&orders_in, &batches_out).unwrap());
        }
        drop(batches_out);
        let schedule = Schedule::new(workers as usize, region.len(), spp, None, Vec::new());
        let outbox =
            Outbox { orders, samples: None, barriers: None, film: None, snapshots: None, progress: None };
        let film = Film::new(width, height).unwrap();
        let accumulator = Accumulator::new(film, region, schedule, &[], Some(spp), outbox);
        Some(accumulator.run(Inbox { batches, failures, stop }))
    })
}

#[test]
fn the_film_is_the_same_from_run_to_run_and_for_any_number_of_workers() {
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
