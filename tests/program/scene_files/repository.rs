//! The scenes of the repository.

use glam::DVec3;
use std::fs;
use std::path::{Path, PathBuf};
use stride::scene::*;

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let files = fs::read_dir(folder).expect("scenes/").map(|entry| entry.expect("an entry").path());
    let mut scenes: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    scenes.sort();
    assert!(scenes.len() >= 12);
    scenes
}

fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    load(&path).unwrap_or_else(|errors| panic!("{errors}")).scene
}

#[test]
fn scenes_of_the_repository_load_without_a_warning_and_name_their_schema() {
    for path in scenes() {
        let loaded = load(&path).unwrap_or_else(|errors| panic!("{errors}"));
        assert_eq!(loaded.warnings, [], "{}", path.display());
        let text = fs::read_to_string(&path).expect("text");
        assert!(text.starts_with("#:schema ../docs/scene.schema.json\n"), "{}", path.display());
        let command = format!("stride render scenes/{}", path.file_name().expect("a name").to_string_lossy());
        assert!(text.contains(&command), "{} does not say how to render it", path.display());
    }
}

#[test]
fn the_figures_are_variations_of_the_cover() {
    let cover = scene("cover.toml");
    let film = |f: &dyn Fn(&mut Scene)| {
        let mut scene = cover.clone();
        scene.render.integrator = Integrator::PathNaive;
        f(&mut scene);
        scene
    };
    assert_eq!(scene("figure-6-1-to-6-3.toml"), film(&|_| {}));
    assert_eq!(scene("figure-6-4.toml"), film(&|s| s.render.samples = 200));
    assert_eq!(scene("figure-6-5.toml"), film(&|s| (s.render.samples, s.render.max_depth) = (200, 3)));
    assert_eq!(scene("figure-6-6.toml"), film(&|s| (s.render.samples, s.render.max_depth) = (200, 2)));
    let bigger_light = film(&|s| {
        let light = s.entities.last_mut().expect("the light");
        light.shape = Shape::Sphere(SphereParameters { center: DVec3::new(7.0, 0.0, 3.0), radius: 2.0 });
        light.emission = [0.25; 3];
    });
    assert_eq!(scene("figure-6-7.toml"), bigger_light);
    assert_eq!(scene("figure-2-4-tent.toml"), cover);
    let unfiltered = Scene { film: FilmSettings { filter: Filter::None, ..cover.film.clone() }, ..cover };
    assert_eq!(scene("figure-2-4-none.toml"), unfiltered);

    let (whitted, path) = (scene("figure-1-1-whitted.toml"), scene("figure-1-1-path.toml"));
    assert_eq!(whitted.render.integrator, Integrator::Whitted);
    assert_eq!((whitted.film, whitted.camera), (path.film, path.camera));
    assert_eq!((whitted.materials, whitted.entities), (path.materials, path.entities));
}

#[test]
fn the_cover_is_the_reports_program() {
    let Scene { film, camera, render, materials, entities, lights, environment, .. } = scene("cover.toml");
    assert_eq!((film.width, film.height, film.filter), (640, 480, Filter::Tent { radius: 1.0 }));
    assert_eq!((camera.eye, camera.forward, camera.up), (DVec3::ZERO, DVec3::X, DVec3::Z));
    assert_eq!(camera.vertical_fov, std::f64::consts::FRAC_PI_2);
    assert_eq!((render.max_depth, render.samples), (5, 500));
    assert_eq!((lights, environment), (vec![], [0.0; 3]));

    let kind = |entity: &Entity| materials[entity.material].kind.clone();
    let matte = |r, g, b| MaterialKind::Matte(MatteParameters { reflectance: [r, g, b], roughness: 0.0 });
    let mirror = |r, g, b| MaterialKind::Mirror(MirrorParameters { reflectance: [r, g, b] });
    let plane = |x, y, z, distance| Shape::Plane(PlaneParameters { normal: DVec3::new(x, y, z), distance });
    let sphere = |x, y, z, radius| Shape::Sphere(SphereParameters { center: DVec3::new(x, y, z), radius });
    let grey = matte(0.75, 0.75, 0.75);
    let expected = [
        (plane(0.0, 1.0, 0.0, -6.0), Some(matte(0.75, 0.25, 0.25))),
        (plane(0.0, -1.0, 0.0, -6.0), Some(matte(0.25, 0.25, 0.75))),
        (plane(0.0, 0.0, -1.0, -8.0), Some(grey.clone())),
        (plane(-1.0, 0.0, 0.0, -10.0), Some(grey.clone())),
        (plane(0.0, 0.0, 1.0, -3.0), None),
        (sphere(8.0, 3.0, -1.0, 2.0), Some(mirror(0.25, 0.75, 0.25))),
        (sphere(6.0, -2.0, -1.0, 2.0), Some(mirror(1.0, 1.0, 1.0))),
        (sphere(7.0, 0.0, 3.0, 1.0), Some(grey.clone())),
    ];
    assert_eq!(entities.len(), expected.len());
    for (entity, (shape, material)) in entities.iter().zip(expected) {
        assert_eq!(entity.shape, shape, "{}", entity.name);
        assert!(!entity.flip_normal);
        match (kind(entity), material) {
            (kind, Some(material)) => assert_eq!(kind, material, "{}", entity.name),
            (MaterialKind::Checkerboard(CheckerboardParameters { even, odd, checks_per_unit }), None) => {
                assert_eq!(materials[even].kind, grey);
                assert_eq!(materials[odd].kind, mirror(0.6, 0.4, 0.2));
                assert_eq!(checks_per_unit, [10.0, 10.0]);
            }
            (kind, None) => panic!("{} is {kind:?}", entity.name),
        }
        let emission = if entity.name == "light" { [1.0; 3] } else { [0.0; 3] };
        assert_eq!(entity.emission, emission);
    }
}
