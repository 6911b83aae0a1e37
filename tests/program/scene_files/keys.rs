//! Keys, their defaults and their values.

use super::read;
use glam::DVec3;
use stride::scene::toml::schema;
use stride::scene::*;

#[test]
fn an_empty_file_has_the_documented_defaults() {
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
    // Legal oddities.
    let warnings: Vec<_> = warnings.iter().map(|warning| warning.message.as_str()).collect();
    let told = [
        "focal_length does not affect the image",
        "\"entity 1\" is a quad of glass: light is refracted on entry but not on exit",
        "the normal's length is 5, but distance is measured along the unit normal",
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
        [Light::Point(PointLightParameters { position, intensity: Some([10.0, 20.0, 30.0]), power: None })]
    );
    assert_eq!(scene.environment, [0.5, 0.25, 0.125]);
}

#[test]
fn a_component_of_a_normal_that_underflows_is_zero() {
    let scene = read(
        "materials.a = { type = \"matte\", reflectance = [1, 1, 1] }\nenvironment.radiance = [1, 1, 1]\n\
         entities = [{ shape = { type = \"plane\", normal = [1e18, -1e-37, 0], distance = 0 }, material = \"a\" }]",
    )
    .scene;
    let plane = PlaneParameters { normal: DVec3::X, distance: 0.0 };
    assert_eq!(scene.entities[0].shape, Shape::Plane(plane));
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
fn the_default_mode_depends_on_the_filter() {
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

#[cfg(feature = "broken-material")]
#[test]
fn the_broken_material_is_available_to_tests() {
    let text = "[materials.bad]\ntype = \"broken\"\n";
    assert_eq!(read(text).scene.materials[0].kind, MaterialKind::Broken(BrokenParameters {}));
}

/// Power is the integral of radiance: Φ = π·A·L, for any shape.
#[test]
fn power_gives_radiance_by_area() {
    let pi = std::f64::consts::PI;
    for (shape, area) in [
        (r#"{ type = "sphere", center = [1, 2, 3], radius = 2 }"#, 16.0 * pi),
        (r#"{ type = "quad", corner = [0, 0, 0], u = [2, 0, 0], v = [1, 3, 0] }"#, 6.0),
        (r#"{ type = "box", min = [0, 0, 0], max = [1, 2, 3] }"#, 22.0),
        (r#"{ type = "disk", center = [0, 0, 0], normal = [0, 0, 1], radius = 3 }"#, 9.0 * pi),
        (r#"{ type = "cylinder", from = [0, 0, 0], to = [0, 0, 4], radius = 1 }"#, 8.0 * pi),
    ] {
        let text = format!(
            "[materials.a]\ntype = \"matte\"\nreflectance = [0, 0, 0]\n[[entities]]\nshape = {shape}\n\
             material = \"a\"\npower = [1, 2, 0]\n"
        );
        let scene = read(&text).scene;
        for (emission, power) in scene.entities[0].emission.into_iter().zip([1.0, 2.0, 0.0]) {
            assert!((emission * pi * area - power).abs() < 1e-5, "{shape}: {emission}");
        }
    }
}
