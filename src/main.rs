//! spike
use ::stride::{
    camera::CameraSettings, film::*, integrator::*, math::lanes::Level, render::Region, sampling::*,
    scene::*, session, world,
};
use glam::DVec3;
use std::sync::Arc;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let threads: usize = args[1].parse().unwrap();
    let spp: u32 = args[2].parse().unwrap();
    let mat =
        |n: &str, c: [f64; 3]| Material { name: n.into(), kind: MaterialKind::Matte { reflectance: c } };
    let mir =
        |n: &str, c: [f64; 3]| Material { name: n.into(), kind: MaterialKind::Mirror { reflectance: c } };
    let materials = vec![
        mat("r", [0.75, 0.25, 0.25]),
        mat("l", [0.25, 0.25, 0.75]),
        mat("g", [0.75; 3]),
        mir("c", [0.6, 0.4, 0.2]),
        Material {
            name: "f".into(),
            kind: MaterialKind::Checkerboard { even: 2, odd: 3, checks_per_unit: [10.0; 2] },
        },
        mir("gr", [0.25, 0.75, 0.25]),
        mir("w", [1.0; 3]),
    ];
    let pl = |n: [f64; 3], d: f64, m| Entity {
        name: "p".into(),
        shape: Shape::Plane { normal: DVec3::from_array(n), distance: d },
        material: m,
        emission: [0.0; 3],
        flip_normal: false,
    };
    let sp = |c: [f64; 3], r: f64, m, e| Entity {
        name: "s".into(),
        shape: Shape::Sphere { center: DVec3::from_array(c), radius: r },
        material: m,
        emission: [e; 3],
        flip_normal: false,
    };
    let entities = vec![
        pl([0.0, 1.0, 0.0], -6.0, 0),
        pl([0.0, -1.0, 0.0], -6.0, 1),
        pl([0.0, 0.0, -1.0], -8.0, 2),
        pl([-1.0, 0.0, 0.0], -10.0, 2),
        pl([0.0, 0.0, 1.0], -3.0, 4),
        sp([8.0, 3.0, -1.0], 2.0, 5, 0.0),
        sp([6.0, -2.0, -1.0], 2.0, 6, 0.0),
        sp([7.0, 0.0, 3.0], 1.0, 2, 1.0),
    ];
    let (w, h) = (640, 480);
    let scene = Scene {
        film: FilmSettings { width: w, height: h, exposure: 0.0, filter: Filter::Tent { radius: 1.0 } },
        camera: CameraSettings {
            eye: DVec3::ZERO,
            forward: DVec3::X,
            up: DVec3::Z,
            vertical_fov: std::f64::consts::FRAC_PI_2,
            focal_length: 1.0,
            near: 0.0,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        },
        render: RenderSettings {
            integrator: ::stride::scene::Integrator::PathNaive,
            max_depth: 5,
            samples: spp,
            seed: 0,
            ambient: [0.0; 3],
        },
        materials,
        entities,
        lights: vec![],
        environment: [0.0; 3],
    };
    let (compiled, geometry) = world::compile(&scene, w, h);
    let world::Geometry::Simple(simple) = geometry else { panic!() };
    let integrator = PathNaive {
        scene: Arc::new(compiled),
        world: Arc::new(simple),
        settings: Settings {
            sampler: Independent { seed: 0 },
            offset: film_offset(scene.film.filter),
            max_depth: 5,
        },
    };
    let plan = session::Plan {
        region: Region::whole(w, h),
        threads,
        level: Level::from_environment().unwrap(),
        spp,
        time: None,
        dump_at: vec![],
    };
    let film = Film::new(w, h).unwrap();
    let (_tx, rx) = crossbeam_channel::bounded(1);
    let out = session::render(&plan, &integrator, film, rx);
    let t = out.totals;
    println!(
        "{} {:.3} Ms/s {:.2} rays/sample {:?} adding {:.2}%",
        plan.level,
        t.samples as f64 / t.elapsed.as_secs_f64() / 1e6,
        t.rays as f64 / t.samples as f64,
        t.elapsed,
        100.0 * t.adding.as_secs_f64() / t.elapsed.as_secs_f64() / threads as f64
    );
    let p = out.film.picture();
    let mut m = [0.0f64; 3];
    for c in &p.rgb {
        for k in 0..3 {
            m[k] += c[k] as f64 / p.rgb.len() as f64;
        }
    }
    println!("mean {m:?}");
}
