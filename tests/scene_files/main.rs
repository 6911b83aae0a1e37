//! Scene files that are right, files that are no scene at all, and what is legal but surely unmeant.

mod unreadable;

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use stride::scene::toml::schema;
use stride::scene::*;

fn read(text: &str) -> Loaded {
    parse(text, "box.toml".as_ref()).unwrap_or_else(|errors| panic!("{errors}"))
}

fn warnings(text: &str) -> Vec<String> {
    read(text).warnings.iter().map(ToString::to_string).collect()
}

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
    let matte = |r, g, b| MaterialKind::Matte(MatteParameters { reflectance: [r, g, b] });
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

#[test]
fn an_empty_file_has_the_defaults_of_the_design() {
    let Loaded { scene, warnings, .. } = read("");
    assert_eq!(scene, Scene::default());
    assert_eq!(
        (scene.film.width, scene.film.height, scene.film.filter),
        (640, 480, Filter::Tent { radius: 1.0 })
    );
    assert_eq!((scene.camera.eye, scene.camera.forward, scene.camera.up), (DVec3::ZERO, DVec3::X, DVec3::Z));
    assert_eq!(scene.camera.vertical_fov, std::f64::consts::FRAC_PI_2);
    assert_eq!((scene.render.integrator, scene.render.sampler), (Integrator::Path, Sampler::Sobol));
    assert_eq!((scene.render.max_depth, scene.render.samples, scene.render.seed), (5, 500, 0));
    assert_eq!(warnings.len(), 2);
}

#[test]
fn every_name_of_a_choice_is_read_shown_and_in_the_schema() {
    fn hold<C: Choice + std::fmt::Debug + PartialEq>(table: &str, key: &str, of: fn(&Scene) -> C) {
        let described = &schema()["properties"][table]["properties"][key];
        let listed = [&described["enum"], &described["anyOf"][0]["enum"]];
        let names: Vec<&str> = C::names().collect();
        let names = serde_json::json!(names);
        assert!(listed.contains(&&names), "{described}");
        for (name, choice) in C::NAMED {
            let text = |value: &str| format!("[{table}]\n{key} = {value}");
            assert_eq!(of(&read(&text(&format!("\"{name}\""))).scene), *choice);
            if !described["anyOf"].is_null() {
                assert_eq!(of(&read(&text(&format!("{{ type = \"{name}\" }}"))).scene), *choice);
            }
            assert_eq!((C::of_name(name), choice.name()), (Ok(*choice), *name));
        }
    }
    hold::<Integrator>("render", "integrator", |scene| scene.render.integrator);
    hold::<Sampler>("render", "sampler", |scene| scene.render.sampler);
    hold::<Tone>("film", "tone", |scene| scene.film.tone);
    hold::<Filter>("film", "filter", |scene| scene.film.filter);
    hold::<FilmMode>("film", "mode", |scene| scene.film.mode());
    assert_eq!(Sampler::listed(), "sobol or independent");
}

#[test]
fn every_key_reaches_the_scene() {
    let Loaded { scene, warnings, .. } = read(
        r#"
        [film]
        width = 1
        height = 65536
        exposure = -1.5
        tone = "filmic"
        filter = { type = "box" }
        [camera]
        eye = [1, 2, 3]
        look_at = [1, 2, -3]
        up = [0, 7, 0]
        vertical_fov = 45
        near = 0.25
        focal_length = 2
        aperture_radius = 0.5
        focus_distance = 9
        [render]
        integrator = "whitted"
        sampler = "independent"
        max_depth = 0
        samples = 4_294_967_295
        seed = 0xffff_ffff
        ambient = [0.1, 0.2, 0.3]
        [materials.board]
        type = "checkerboard"
        even = "inner"
        odd = "glass"
        checks_per_unit = [1, 2.5]
        [materials.inner]
        type = "checkerboard"
        even = "matte"
        odd = "mirror"
        [materials.glass]
        type = "glass"
        ior = 1
        [materials.tinted]
        type = "glass"
        ior = 1.5
        reflectance = [1, 1, 0.5]
        transmittance = [0.5, 1, 1]
        [materials.matte]
        type = "matte"
        reflectance = [0, 0.5, 1]
        [materials.mirror]
        type = "mirror"
        reflectance = [1, 1, 1]
        [[entities]]
        shape = { type = "quad", corner = [1, 2, 3], u = [2, 0, 0], v = [0, 2, 0] }
        material = "board"
        [[entities]]
        name = "ball"
        shape.type = "sphere"
        shape.center = [-1e18, 0, 1e18]
        shape.radius = 1e5
        material = "tinted"
        emission = [0, 0, 1073741824]
        flip_normal = true
        [[entities]]
        material = "mirror"
        [entities.shape]
        type = "plane"
        normal = [0, 3, 4]
        distance = -2
        [[entities]]
        material = "mirror"
        shape = { type = "disk", center = [1, 2, 3], normal = [0, -3, 4], radius = 2.5 }
        [[entities]]
        material = "mirror"
        shape = { type = "cylinder", from = [1, 2, 3], to = [4, 5, 6], radius = 0.5 }
        [[entities]]
        material = "mirror"
        shape = { type = "box", min = [-1, -2, -3], max = [1, 2, 3.5] }
        [[lights]]
        type = "point"
        position = [1, 2, 3]
        intensity = [10, 20, 30]
        [environment]
        radiance = [0.5, 0.25, 0.125]
        "#,
    );
    // What is legal and odd in it.
    let warnings: Vec<_> = warnings.iter().map(|warning| warning.message.as_str()).collect();
    let told = [
        "\"entity 1\" is a quad of glass: light that enters bends on its way in and never back",
        "the normal's length is 5, and distance is a length all the same",
    ];
    assert_eq!(warnings, told);
    let film = &scene.film;
    assert_eq!((film.width, film.height, film.exposure, film.mode), (1, 65536, -1.5, None));
    assert_eq!((film.tone, film.filter), (Tone::Filmic, Filter::Box { radius: 0.5 }));
    let camera = &scene.camera;
    let eye = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!((camera.eye, camera.forward, camera.up), (eye, DVec3::NEG_Z, DVec3::Y));
    assert_eq!((camera.vertical_fov, camera.near), (std::f64::consts::FRAC_PI_4, 0.25));
    assert_eq!((camera.focal_length, camera.aperture_radius, camera.focus_distance), (2.0, 0.5, 9.0));
    let render = &scene.render;
    assert_eq!((render.integrator, render.sampler), (Integrator::Whitted, Sampler::Independent));
    assert_eq!((render.max_depth, render.samples, render.seed), (0, u32::MAX, u32::MAX));
    assert_eq!((render.adaptive, render.ambient), (false, [0.1, 0.2, 0.3]));
    let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["matte", "mirror", "inner", "glass", "board", "tinted"]);
    let checks = |i: usize| match scene.materials[i].kind {
        MaterialKind::Checkerboard(CheckerboardParameters { even, odd, checks_per_unit }) => {
            (even, odd, checks_per_unit)
        }
        ref other => panic!("{other:?}"),
    };
    assert_eq!(checks(2), (0, 1, [1.0, 1.0]));
    assert_eq!(checks(4), (2, 3, [1.0, 2.5]));
    let clear =
        MaterialKind::Glass(GlassParameters { ior: 1.0, reflectance: [1.0; 3], transmittance: [1.0; 3] });
    assert_eq!(scene.materials[3].kind, clear);
    let tinted = MaterialKind::Glass(GlassParameters {
        ior: 1.5,
        reflectance: [1.0, 1.0, 0.5],
        transmittance: [0.5, 1.0, 1.0],
    });
    assert_eq!(scene.materials[5].kind, tinted);

    let entity =
        |name: &str, shape, material| Entity { name: name.into(), shape, material, ..Entity::default() };
    let corner = DVec3::new(1.0, 2.0, 3.0);
    let quad = Shape::Quad(QuadParameters { corner, u: DVec3::X * 2.0, v: DVec3::Y * 2.0 });
    let ball = Shape::Sphere(SphereParameters { center: DVec3::new(-1e18, 0.0, 1e18), radius: 1e5 });
    let plane = Shape::Plane(PlaneParameters { normal: DVec3::new(0.0, 0.6, 0.8), distance: -2.0 });
    assert_eq!(scene.entities[0], entity("entity 1", quad, 4));
    let emission = [0.0, 0.0, 1073741824.0];
    let ball = Entity { emission, flip_normal: true, ..entity("ball", ball, 5) };
    assert_eq!(scene.entities[1], ball);
    let Shape::Plane(PlaneParameters { normal, .. }) = scene.entities[2].shape else { panic!("no plane") };
    assert!((normal - DVec3::new(0.0, 0.6, 0.8)).length() < 1e-15 && (normal.length() - 1.0).abs() < 1e-15);
    let third = Entity { shape: plane, ..scene.entities[2].clone() };
    assert_eq!(third, entity("entity 3", third.shape.clone(), 1));
    let Shape::Disk(DiskParameters { center, normal, radius }) = scene.entities[3].shape else {
        panic!("no disk")
    };
    assert!((center, radius) == (corner, 2.5) && (normal - DVec3::new(0.0, -0.6, 0.8)).length() < 1e-15);
    let tube =
        Shape::Cylinder(CylinderParameters { from: corner, to: DVec3::new(4.0, 5.0, 6.0), radius: 0.5 });
    assert_eq!(scene.entities[4], entity("entity 5", tube, 1));
    let (min, max) = (DVec3::new(-1.0, -2.0, -3.0), DVec3::new(1.0, 2.0, 3.5));
    assert_eq!(scene.entities[5], entity("entity 6", Shape::Box(BoxParameters { min, max }), 1));
    let position = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(
        scene.lights,
        [Light::Point(PointLightParameters { position, intensity: [10.0, 20.0, 30.0] })]
    );
    assert_eq!(scene.environment, [0.5, 0.25, 0.125]);
}

#[test]
fn a_part_of_a_normal_that_rounds_to_nothing_is_nothing() {
    let scene = read(
        "materials.a = { type = \"matte\", reflectance = [1, 1, 1] }\nenvironment.radiance = [1, 1, 1]\n\
         entities = [{ shape = { type = \"plane\", normal = [1e18, -1e-37, 0], distance = 0 }, material = \"a\" }]",
    )
    .scene;
    let plane = PlaneParameters { normal: DVec3::X, distance: 0.0 };
    assert_eq!(scene.entities[0].shape, Shape::Plane(plane));
}

/// A folder with a square of two triangles of two materials in two groups, and their colours.
fn house() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let obj = "mtllib house.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
               g wall\nusemtl brick\nf 1 2 3\ng window\nusemtl pane\nf 1 3 4\n";
    fs::write(folder.path().join("house.obj"), obj).expect("written");
    let mtl = "newmtl brick\nKd 0.5 0.25 0.125\nnewmtl pane\nillum 4\nNi 1.25\nKe 1 2 3\n";
    fs::write(folder.path().join("house.mtl"), mtl).expect("written");
    folder
}

/// The scene of that mesh with these keys more, or what is wrong with it.
fn housed(more: &str) -> Result<stride::scene::Loaded, String> {
    let folder = house();
    let text = format!(
        "entities = [{{ name = \"house\", shape = {{ type = \"mesh\", file = \"house.obj\"{more} }}, \
         material = \"a\", emission = [9, 9, 9] }}]\n\
         materials.a = {{ type = \"matte\", reflectance = [1, 1, 1] }}\n\
         materials.b = {{ type = \"mirror\", reflectance = [1, 1, 1] }}\n"
    );
    let path = folder.path().join("house.toml");
    fs::write(&path, text).expect("written");
    load(&path).map_err(|errors| errors.to_string().replace(&folder.path().display().to_string(), "…"))
}

#[test]
fn parts_of_meshes_have_materials_of_their_own() {
    let parts = |more: &str| {
        let scene = housed(more).expect("a scene").scene;
        let of = |e: &Entity| (e.name.clone(), scene.materials[e.material].clone(), e.emission[0]);
        scene.entities.iter().map(of).collect::<Vec<_>>()
    };
    let names = |parts: &[(String, stride::scene::Material, f64)]| {
        parts.iter().map(|(name, material, _)| format!("{name} of {}", material.name)).collect::<Vec<_>>()
    };
    assert_eq!(names(&parts("")), ["house of a"]);
    // By groups and by materials; the rest has the entity's.
    assert_eq!(names(&parts(", materials = { window = \"b\" }")), ["house: window of b", "house of a"]);
    assert_eq!(names(&parts(", materials = { brick = \"b\" }")), ["house: brick of b", "house of a"]);
    // The order of keys says nothing.
    for both in
        [", materials = { window = \"b\", wall = \"a\" }", ", materials = { wall = \"a\", window = \"b\" }"]
    {
        assert_eq!(names(&parts(both)), ["house: wall of a", "house: window of b"]);
    }
    let of_file = parts(", materials = \"file\"");
    assert_eq!(names(&of_file), ["house: brick of house.obj: brick", "house: pane of house.obj: pane"]);
    assert_eq!(of_file[0].1.kind, MaterialKind::Matte(MatteParameters { reflectance: [0.5, 0.25, 0.125] }));
    let pane =
        MaterialKind::Glass(GlassParameters { ior: 1.25, reflectance: [1.0; 3], transmittance: [1.0; 3] });
    assert_eq!(of_file[1].1.kind, pane);
    // What the file's materials emit counts before the entity's emission.
    assert_eq!((of_file[0].2, of_file[1].2), (9.0, 1.0));
}

#[test]
fn materials_of_a_file_that_the_scene_replaces_give_no_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let gltf = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0,"camera":0}],
        "meshes":[{"name":"leaf","primitives":[{"attributes":{"POSITION":0},"material":0}]}],
        "materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5],"roughnessFactor":0}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
        "uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    fs::write(folder.path().join("leaf.gltf"), gltf).expect("written");
    let scene = folder.path().join("leaf.toml");
    let warnings = |materials: &str| {
        let text = format!(
            "entities = [{{ shape = {{ type = \"mesh\", file = \"leaf.gltf\"{materials} }}, material = \"a\" }}]\n\
             materials.a = {{ type = \"matte\", reflectance = [1, 1, 1] }}\nenvironment.radiance = [1, 1, 1]\n"
        );
        fs::write(&scene, text).expect("written");
        let loaded = load(&scene).expect("a scene");
        let kinds = loaded.warnings.iter().filter_map(|warning| warning.message.split("leaf.gltf: ").nth(1));
        kinds.map(|kind| kind.split(':').next().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let camera = "cameras are left out";
    assert_eq!(warnings(""), [camera]);
    assert_eq!(warnings(", materials = { leaf = \"a\" }"), [camera]);
    let alpha = "alpha is not read";
    assert_eq!(warnings(", materials = \"file\""), [camera, alpha]);
}

#[test]
fn long_files_tell_how_far_they_have_been_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", "# nothing\n".repeat(400_000));
    fs::write(folder.path().join("long.obj"), &long).expect("written");
    let scene = folder.path().join("long.toml");
    let text = "entities = [{ shape = { type = \"mesh\", file = \"long.obj\" }, material = \"a\" }]\n\
                materials.a = { type = \"matte\", reflectance = [1, 1, 1] }\n";
    fs::write(&scene, text).expect("written");
    let mut told = Vec::new();
    let mut watch = |path: &Path, bytes: u64, of: u64| told.push((path.to_owned(), bytes, of));
    stride::scene::load_watched(&scene, &mut watch).expect("a scene");
    // Every mebibyte.
    assert_eq!(told.len(), 4, "{told:?}");
    assert!(told.is_sorted_by(|a, b| a.1 < b.1));
    let whole = (folder.path().join("long.obj"), long.len() as u64);
    assert!(told.iter().all(|(path, bytes, of)| (path, *of) == (&whole.0, whole.1) && *bytes <= *of));
}

#[test]
fn wrong_materials_of_parts_are_told() {
    for (more, told) in [
        (", materials = \"none\"", "1:88: materials must be \"file\" or a table of names, not \"none\""),
        (", materials = { window = \"c\" }", "1:99: no material \"c\"; the materials are \"a\", \"b\""),
        // Every one of them.
        (
            ", materials = { wall = \"c\", window = \"d\" }",
            "1:97: no material \"c\"; the materials are \"a\", \"b\"\n\
             …/house.toml:1:111: no material \"d\"; the materials are \"a\", \"b\"",
        ),
        (
            ", materials = { windwo = \"b\" }",
            "1:90: nothing in the mesh is of the group or material \"windwo\"; did you mean \"window\"?",
        ),
    ] {
        assert_eq!(housed(more).map(|_| ()), Err(format!("…/house.toml:{told}")));
    }
}

#[test]
fn filters_are_words_or_tables() {
    let filter = |value: &str| read(&format!("film.filter = {value}")).scene.film.filter;
    assert_eq!(filter("\"none\""), Filter::None);
    assert_eq!(filter("{ type = \"none\" }"), Filter::None);
    assert_eq!(filter("\"box\""), Filter::Box { radius: 0.5 });
    assert_eq!(filter("\"tent\""), Filter::Tent { radius: 1.0 });
    assert_eq!(filter("{ type = \"tent\", radius = 16 }"), Filter::Tent { radius: 16.0 });
    assert_eq!(filter("\"gaussian\""), Filter::Gaussian { radius: 1.5, sigma: 0.5 });
    assert_eq!(filter("\"blackman-harris\""), Filter::BlackmanHarris { radius: 1.5 });
    assert_eq!(filter("\"lanczos\""), Filter::Lanczos { radius: 3.0 });
    let catmull_rom = Filter::Mitchell { radius: 2.0, b: 0.0, c: 0.5 };
    assert_eq!(filter("{ type = \"mitchell\", b = 0, c = 0.5 }"), catmull_rom);
}

#[test]
fn a_film_without_a_mode_has_its_filters() {
    let mode = |keys: &str| read(&format!("[film]\n{keys}")).scene.film.mode();
    assert_eq!(mode("filter = \"tent\""), FilmMode::Importance);
    assert_eq!(mode("filter = \"mitchell\""), FilmMode::Continuous);
    assert_eq!(mode("filter = \"tent\"\nmode = \"continuous\""), FilmMode::Continuous);
    assert_eq!(mode("filter = \"gaussian\"\nmode = \"importance\""), FilmMode::Importance);
}

#[test]
fn names_outside_files_are_read_as_in_files() {
    assert_eq!("path-naive".parse(), Ok(Integrator::PathNaive));
    assert_eq!("box".parse(), Ok(Filter::Box { radius: 0.5 }));
    let error = "wihtted".parse::<Integrator>().expect_err("misspelt");
    assert_eq!(error, "unknown integrator \"wihtted\"; did you mean \"whitted\"?");
    assert_eq!("continuous".parse(), Ok(FilmMode::Continuous));
    let error = "mitchel".parse::<Filter>().expect_err("misspelt");
    assert_eq!(error, "unknown filter type \"mitchel\"; did you mean \"mitchell\"?");
}

const BALL: &str = r#"[materials.grey]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
[[entities]]
name = "ball"
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "grey"
"#;

#[test]
fn a_scene_without_light_is_warned_of() {
    let dark = "box.toml: there is no light in this scene: the picture will be black; \
                give an entity an emission, or add [[lights]] or an [environment]";
    assert_eq!(warnings(BALL), [dark]);
    assert_eq!(warnings(&format!("{BALL}emission = [0, 0, 0]\n[environment]\nradiance = [0, 0, 0]")), [dark]);
    let light = |light: &str| warnings(&format!("{BALL}{light}"));
    let none: [&str; 0] = [];
    assert_eq!(light("emission = [0, 0, 1]"), none);
    assert_eq!(light("[environment]\nradiance = [1, 0, 0]"), none);
    assert_eq!(light("[[lights]]\ntype = \"point\"\nposition = [0, 0, 9]\nintensity = [1, 1, 1]"), none);
    assert_eq!(light("[render]\nintegrator = \"whitted\"\nambient = [1, 1, 1]"), none);
}

#[test]
fn an_empty_scene_is_warned_of() {
    let empty = "box.toml: there is nothing in this scene; add [[entities]] with a shape and a material";
    assert_eq!(warnings("[environment]\nradiance = [1, 1, 1]"), [empty]);
}

#[test]
fn an_ambient_term_that_is_not_used_is_warned_of() {
    let text = format!("{BALL}emission = [1, 1, 1]\n[render]\nambient = [1, 1, 1]");
    let warning = "box.toml:10:11: ambient has no effect: only integrator \"whitted\" has an ambient term; \
                   light the scene with an [environment] instead";
    assert_eq!(warnings(&text), [warning]);
}

#[test]
fn unused_materials_are_warned_of() {
    let used = r#"emission = [1, 1, 1]
[materials.alone]
type = "mirror"
reflectance = [1, 1, 1]
[materials.board]
type = "checkerboard"
even = "part"
odd = "grey"
[materials.part]
type = "mirror"
reflectance = [1, 1, 1]
"#;
    let text = format!("{BALL}{used}");
    let unused =
        |line: u32, name| format!("box.toml:{line}:12: material \"{name}\" is not used; no entity shows it");
    assert_eq!(warnings(&text), [unused(9, "alone"), unused(12, "board"), unused(16, "part")]);
    let text = text.replace("material = \"grey\"", "material = \"board\"");
    assert_eq!(warnings(&text), [unused(9, "alone")]);
}

#[test]
fn entities_of_the_same_name_are_warned_of() {
    let second =
        "[[entities]]\nname = \"ball\"\nshape = { type = \"sphere\", center = [3, 0, 0], radius = 1 }\n";
    let text = format!("{BALL}{second}material = \"grey\"\n[environment]\nradiance = [1, 1, 1]");
    let warning =
        "box.toml:9:8: entity 2 has the name of entity 1, \"ball\"; messages will not tell them apart";
    assert_eq!(warnings(&text), [warning]);
}

#[cfg(feature = "broken-material")]
#[test]
fn the_broken_material_is_there_for_tests() {
    let text = "[materials.bad]\ntype = \"broken\"\n";
    assert_eq!(read(text).scene.materials[0].kind, MaterialKind::Broken(BrokenParameters {}));
}
