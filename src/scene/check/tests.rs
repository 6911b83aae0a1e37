use super::*;
use crate::parameter::ImageIndex;
use crate::scene::{
    CheckerboardParameters, ConstantTexture, FilmMode, ImageFile, Integrator, MaterialKind, MatteParameters,
    Named, PlaneParameters, PointLightParameters, QuadParameters, SphereParameters, Texture, Textured,
};
use crate::texture::Picture;
use glam::DMat3;

/// A scene of two materials, of which the second is a checkerboard of the first, a sphere and a triangle.
fn good() -> Scene {
    let matte = MaterialKind::Matte(MatteParameters { reflectance: [0.5; 3], roughness: 0.0 });
    let mesh = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let shape = Shape::Mesh { mesh: Arc::new(mesh), transform: DAffine3::IDENTITY };
    Scene {
        materials: vec![
            Material { name: "white".into(), kind: matte, ..Material::default() },
            board("board", 0, 0),
        ],
        entities: vec![Entity::default(), Entity { name: "ramp".into(), shape, ..Entity::default() }],
        ..Scene::default()
    }
}

/// Adds an environment picture.
fn surround(scene: &mut Scene, change: fn(&mut EnvironmentPicture)) {
    scene.images.push(ImageFile::of("sky".into(), Arc::new(Picture::black())));
    let mut picture = EnvironmentPicture::of(ImageIndex(0));
    change(&mut picture);
    scene.environment_picture = Some(picture);
}

fn board(name: &str, even: usize, odd: usize) -> Material {
    let parameters = CheckerboardParameters { even, odd, checks_per_unit: [1.0; 2] };
    Material { name: name.into(), kind: parameters.into(), ..Material::default() }
}

fn texture(value: Varying) -> Texture {
    Texture { name: "t".into(), kind: ConstantTexture { value }.into() }
}

fn turned(scene: &mut Scene, turn: DMat3) {
    if let Shape::Mesh { transform, .. } = &mut scene.entities[1].shape {
        transform.matrix3 = turn;
    }
}

fn remeshed(scene: &mut Scene, change: fn(&mut Mesh)) {
    if let Shape::Mesh { mesh, .. } = &mut scene.entities[1].shape {
        change(Arc::make_mut(mesh));
    }
}

#[test]
fn valid_scenes_are_accepted() {
    assert_eq!(good().checked(), Ok(good()));
    assert_eq!(Scene::default().problems(), []);
}

#[test]
fn every_kind_of_problem_is_reported_alone() {
    type Break = fn(&mut Scene);
    let cases: &[(Break, &str)] = &[
        (
            |s| s.materials[0].modifiers.opacity = 1.5,
            "material 1 (\"white\"): opacity must be from 0 to 1, not 1.5",
        ),
        (
            |s| s.materials[0].modifiers.back = Some(1),
            "material 1 (\"white\"): it names material 2, which does not precede it",
        ),
        (
            |s| s.materials[0].modifiers.bump_map = Some(Named),
            "material 1 (\"white\"): bump_map must be present if and only if a texture is named for it",
        ),
        (|s| s.film.width = 0, "the film: width must be from 1 to 65536, not 0"),
        (|s| s.film.height = 65_537, "the film: height must be from 1 to 65536, not 65537"),
        (|s| s.film.exposure = f64::NAN, "the film: exposure must be"),
        (|s| s.film.filter = Filter::Tent { radius: 0.0 }, "the film: the filter's radius must be"),
        (
            |s| s.film.filter = Filter::Gaussian { radius: 1.5, sigma: f64::INFINITY },
            "the film: the filter's sigma must be",
        ),
        (
            |s| s.film.filter = Filter::Mitchell { radius: 2.0, b: 1.5, c: 0.0 },
            "the film: the filter's b must be",
        ),
        (
            |s| s.film.filter = Filter::Mitchell { radius: 2.0, b: 1.0, c: -0.5 },
            "the film: the filter's c must be",
        ),
        (
            |s| (s.film.filter, s.film.mode) = (Filter::None, Some(FilmMode::Continuous)),
            "the film: filter \"none\" samples",
        ),
        (|s| s.camera.eye.y = f64::NAN, "the camera: eye must be"),
        (|s| s.camera.forward = DVec3::X * 2.0, "the camera: forward must have a length of 1, not 2e0"),
        (|s| s.camera.up = DVec3::new(f64::NAN, 0.0, 1.0), "the camera: up must have a length of 1"),
        (|s| s.camera.up = -s.camera.forward, "the camera: up is parallel"),
        (|s| s.camera.orthographic_height = Some(0.0), "the camera: orthographic_height must be"),
        (|s| s.camera.vertical_fov = PI, "the camera: vertical_fov must be"),
        (|s| s.camera.vertical_fov = 0.0, "the camera: vertical_fov must be"),
        (|s| s.camera.focal_length = 0.0, "the camera: focal_length must be"),
        (|s| s.camera.near = -1.0, "the camera: near must be"),
        (|s| s.camera.aperture_radius = 1e19, "the camera: aperture_radius must be"),
        (|s| s.camera.focus_distance = 0.0, "the camera: focus_distance must be"),
        (|s| s.render.samples = 0, "the render settings: samples must be from 1"),
        (|s| s.render.max_depth = 10_001, "the render settings: max_depth must be"),
        (
            |s| (s.render.max_depth, s.render.integrator) = (UNLIMITED, Integrator::Whitted),
            "the render settings: max_depth can be",
        ),
        (|s| s.render.ambient[1] = -1.0, "the render settings: ambient must be"),
        (|s| s.environment[2] = f64::NAN, "the environment: radiance must be"),
        (
            |s| s.environment_picture = Some(EnvironmentPicture::of(ImageIndex(0))),
            "the environment: there is no image 1, only 0",
        ),
        (|s| surround(s, |picture| picture.scale[1] = -1.0), "the environment: scale must be from 0"),
        (|s| surround(s, |picture| picture.rotate = f64::NAN), "the environment: rotate must be a finite"),
        (|s| surround(s, |picture| picture.up *= 2.0), "the environment: up must have a length of 1"),
        (
            |s| s.materials[1] = board("board", 0, 1),
            "material 2 (\"board\"): it names material 2, which does not precede it",
        ),
        (|s| s.materials[0] = board("loop", 7, 7), "material 1 (\"loop\"): it names material 8"),
        (
            |s| s.materials[0].textures.push(Textured { parameter: "reflectance", texture: 0 }),
            "material 1 (\"white\"): there is no texture 1, only 0",
        ),
        (
            |s| s.textures.push(texture(Varying::Texture(0))),
            "texture 1 (\"t\"): it names texture 1, which does not precede it",
        ),
        (|s| s.textures.push(texture(Varying::Colour([-1.0; 3]))), "texture 1 (\"t\"): value must be from 0"),
        (
            |s| {
                s.textures.push(texture(Varying::Colour([1.0; 3])));
                s.materials[1].textures.push(Textured { parameter: "checks_per_unit", texture: 0 });
            },
            "material 2 (\"board\"): checks_per_unit cannot be a texture",
        ),
        (
            |s| s.entities[0].emission_texture = Some(0),
            "entity 1 (\"entity\"): there is no texture 1, only 0",
        ),
        (|s| s.entities[0].material = 2, "entity 1 (\"entity\"): there is no material 3, only 2"),
        (|s| s.entities[0].emission[0] = 2e9, "entity 1 (\"entity\"): emission must be"),
        (
            |s| s.materials[0].kind = MatteParameters { reflectance: [0.5, 1.5, 0.5], roughness: 0.0 }.into(),
            "material 1 (\"white\"): reflectance must be from 0 to 1, not 1.5e0",
        ),
        (
            |s| s.entities[0].shape = SphereParameters { center: DVec3::ZERO, radius: 0.0 }.into(),
            "entity 1 (\"entity\"): radius must be above 0",
        ),
        (
            |s| s.entities[0].shape = PlaneParameters { normal: DVec3::Z * 2.0, distance: 0.0 }.into(),
            "entity 1 (\"entity\"): normal must be [0, 0, 1], not [0, 0, 2]",
        ),
        (
            |s| {
                let (corner, u, v) = (DVec3::ZERO, DVec3::X, DVec3::X);
                s.entities[0].shape = QuadParameters { corner, u, v }.into();
            },
            "entity 1 (\"entity\"): v is parallel to u",
        ),
        (
            |s| {
                // In 64 bits it has an area.
                let (corner, u, v) = (DVec3::ZERO, DVec3::X * 1e-50, DVec3::Y);
                s.entities[0].shape = QuadParameters { corner, u, v }.into();
            },
            "entity 1 (\"entity\"): u is so small that 32 bits would round it to 0, not 1e-50",
        ),
        (
            |s| s.environment[0] = 1e-50,
            "the environment: radiance is so small that 32 bits would round it to 0",
        ),
        (|s| s.camera.near = 1e-50, "the camera: near is so small that 32 bits would round it to 0"),
        (
            |s| {
                let (position, intensity) = (DVec3::NAN, [1.0; 3]);
                s.lights
                    .push(PointLightParameters { position, intensity: Some(intensity), power: None }.into());
            },
            "light 1: position must be a finite number",
        ),
        (
            |s| turned(s, DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0))),
            "entity 2 (\"ramp\"): the transform is singular",
        ),
        (
            |s| turned(s, DMat3::from_diagonal(DVec3::splat(2e18))),
            "entity 2 (\"ramp\"): the transform moves some of the mesh farther than 1e18 from the origin",
        ),
        (
            |s| turned(s, DMat3::from_diagonal(DVec3::splat(1e-16))),
            "entity 2 (\"ramp\"): the transformed mesh is smaller than 1e-15",
        ),
        (|s| turned(s, DMat3::NAN), "entity 2 (\"ramp\"): the transform is singular"),
        (
            |s| remeshed(s, |mesh| mesh.triangles[0][1] = 3),
            "entity 2 (\"ramp\"): its mesh is invalid: triangle 0",
        ),
        (
            |s| remeshed(s, |mesh| mesh.uv.push([0.0; 2])),
            "entity 2 (\"ramp\"): its mesh has 3 vertices and 1 uv",
        ),
    ];
    for (spoil, message) in cases {
        let mut scene = good();
        spoil(&mut scene);
        let problems = scene.checked().expect_err(message);
        let reported: Vec<String> = problems.iter().map(SceneProblem::to_string).collect();
        assert!(reported.iter().all(|reported| reported.starts_with(message)), "{message}: {reported:?}");
    }
}

#[test]
fn parts_of_a_mesh_may_be_small() {
    let mut scene = good();
    scene.entities.push(scene.entities[1].clone());
    if let Shape::Mesh { mesh, .. } = &mut scene.entities[2].shape {
        Arc::make_mut(mesh).positions.iter_mut().flatten().for_each(|x| *x *= 1e-20);
    }
    assert_eq!(scene.problems(), []);
    // With another transform it is not a part of the same file.
    if let Shape::Mesh { transform, .. } = &mut scene.entities[2].shape {
        transform.translation = DVec3::X;
    }
    let reported: Vec<String> = scene.problems().iter().map(SceneProblem::to_string).collect();
    assert!(
        matches!(&reported[..], [reported] if reported.starts_with("entity 3 (\"ramp\"): the transformed mesh is smaller")),
        "{reported:?}"
    );
}

#[test]
fn checkerboards_nest_as_deep_as_the_limit() {
    let mut scene = good();
    for i in scene.materials.len()..=MAX_NESTING {
        scene.materials.push(board("deeper", i - 1, 0));
    }
    assert_eq!(scene.problems(), []);
    scene.materials.push(board("too deep", MAX_NESTING, 0));
    scene.materials.push(board("deeper still", MAX_NESTING + 1, 0));
    let reported: Vec<String> = scene.problems().iter().map(SceneProblem::to_string).collect();
    assert_eq!(reported, ["material 18 (\"too deep\"): it is nested more than 16 levels deep"]);
}
