//! The conversion of plugins and their defaults.

use super::super::super::LoadOptions;
use super::{read, read_with, scene, whole};
use crate::light::Falloff;
use crate::parameter::Varying;
use crate::scene::description::{
    Filter, Integrator, Light, MaterialKind, Sampler, Shape, TextureKind, UNLIMITED,
};
use glam::DVec3;

fn near(a: DVec3, b: [f64; 3]) -> bool {
    (a - DVec3::from(b)).length() < 1e-12
}

#[test]
fn defaults_are_those_of_mitsuba() {
    let loaded =
        read("<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/></scene>");
    let scene = &loaded.scene;
    assert_eq!((scene.film.width, scene.film.height), (768, 576));
    assert_eq!(scene.film.filter, Filter::Gaussian { radius: 2.0, sigma: 0.5 });
    assert_eq!((scene.render.integrator, scene.render.max_depth), (Integrator::Path, UNLIMITED));
    assert_eq!((scene.camera.forward, scene.camera.up, scene.camera.near), (DVec3::Z, DVec3::Y, 0.01));
    assert_eq!(scene.environment, [1.0; 3]);
    // 50 mm, for the diagonal of a film of 36 mm by 24 mm.
    let diagonal = 2.0 * libm::atan(libm::sqrt(36.0_f64.powi(2) + 24.0_f64.powi(2)) / 100.0);
    let half = libm::tan(diagonal / 2.0) * 0.6;
    assert!((libm::tan(scene.camera.vertical_fov / 2.0) - half).abs() < 1e-12);
    assert_eq!((loaded.crop, loaded.warnings.len()), (None, 0));
}

#[test]
fn cameras_films_and_samplers_are_read() {
    let text = r#"<scene version="3.0.0">
        <default name="spp" value="16"/>
        <integrator type="moment"><integrator type="path"><integer name="max_depth" value="3"/></integrator></integrator>
        <sensor type="thinlens" id="near">
            <float name="fov" value="90"/> <string name="fov_axis" value="x"/>
            <float name="aperture_radius" value="0.1"/> <float name="focus_distance" value="7"/>
            <transform name="to_world"><lookat origin="0 -5 0" target="0 0 0" up="0 0 1"/></transform>
            <film type="hdrfilm">
                <integer name="width" value="40"/> <integer name="height" value="20"/>
                <integer name="crop_offset_x" value="10"/> <integer name="crop_width" value="20"/>
                <rfilter type="catmullrom"/>
            </film>
            <sampler type="multijitter"><integer name="sample_count" value="$spp"/><integer name="seed" value="7"/></sampler>
        </sensor>
        <sensor type="orthographic" id="far">
            <transform name="to_world"><scale x="3" y="3"/><lookat origin="0 0 9" target="0 0 0" up="0 1 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/><rfilter type="box"/></film>
            <sampler type="independent"/>
        </sensor>
        <emitter type="constant"/>
    </scene>"#;
    let options = LoadOptions { defines: vec![("spp".into(), "64".into())], ..LoadOptions::default() };
    let loaded = read_with(text, &options).expect("a scene");
    let scene = loaded.scene;
    assert_eq!(
        (scene.camera.eye, scene.camera.forward, scene.camera.up),
        (DVec3::new(0.0, -5.0, 0.0), DVec3::Y, DVec3::Z)
    );
    assert!((libm::tan(scene.camera.vertical_fov / 2.0) - 0.5).abs() < 1e-12);
    assert_eq!((scene.camera.aperture_radius, scene.camera.focus_distance), (0.1, 7.0));
    assert_eq!(scene.film.filter, Filter::Mitchell { radius: 2.0, b: 0.0, c: 0.5 });
    assert_eq!((scene.render.samples, scene.render.seed, scene.render.max_depth), (64, 7, 2));
    assert_eq!((scene.render.sampler, loaded.crop), (Sampler::Sobol, Some([10, 0, 20, 20])));

    let options = LoadOptions { camera: Some("far".into()), ..LoadOptions::default() };
    let scene = read_with(text, &options).expect("a scene").scene;
    assert_eq!((scene.camera.orthographic_height, scene.camera.forward), (Some(3.0), DVec3::NEG_Z));
    assert_eq!((scene.render.sampler, scene.render.samples), (Sampler::Independent, 4));
    let options = LoadOptions { camera: Some("fa".into()), ..LoadOptions::default() };
    let errors = read_with(text, &options).unwrap_err().to_string();
    assert_eq!(errors, "a.xml:1:1: no sensor has the id \"fa\"; did you mean \"far\"?");
}

#[test]
fn shapes_are_transformed() {
    let moved = r#"<transform name="to_world"><scale value="2"/><rotate z="1" angle="90"/><translate x="10"/></transform>"#;
    let of = |shape: &str| {
        let scene = scene(&format!("<shape {shape}</shape>"));
        (scene.entities[0].shape.clone(), scene.entities[0].flip_normal)
    };
    match of(&format!("type=\"rectangle\">{moved}")) {
        (Shape::Quad(quad), false) => {
            assert!(
                near(quad.corner, [12.0, -2.0, 0.0])
                    && near(quad.u, [0.0, 4.0, 0.0])
                    && near(quad.v, [-4.0, 0.0, 0.0])
            );
        }
        other => panic!("{other:?}"),
    }
    match of(&format!(
        "type=\"sphere\"><point name=\"center\" x=\"1\"/><float name=\"radius\" value=\"3\"/>{moved}"
    )) {
        (Shape::Sphere(sphere), false) => {
            assert!(near(sphere.center, [10.0, 2.0, 0.0]) && (sphere.radius - 6.0).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
    match of(&format!("type=\"disk\">{moved}<boolean name=\"flip_normals\" value=\"true\"/>")) {
        (Shape::Disk(disk), true) => assert!(
            near(disk.center, [10.0, 0.0, 0.0]) && near(disk.normal, [0.0, 0.0, 1.0]) && disk.radius == 2.0
        ),
        other => panic!("{other:?}"),
    }
    match of(&format!(
        "type=\"cylinder\"><point name=\"p1\" x=\"1\"/><float name=\"radius\" value=\"0.5\"/>{moved}"
    )) {
        (Shape::Cylinder(tube), false) => {
            assert!(
                near(tube.from, [10.0, 0.0, 0.0])
                    && near(tube.to, [10.0, 2.0, 0.0])
                    && (tube.radius - 1.0).abs() < 1e-12
            );
        }
        other => panic!("{other:?}"),
    }
    match of(&format!("type=\"cube\">{moved}")) {
        (Shape::Mesh { mesh, transform }, false) => {
            assert_eq!(mesh.triangles.len(), 12);
            assert!(near(transform.transform_point3(DVec3::X), [10.0, 2.0, 0.0]));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn mirrored_shapes_face_along_their_normals() {
    let mirrored = r#"<transform name="to_world"><scale x="-1"/></transform>"#;
    // A mirror image keeps the normal (0, 0, 1) of a rectangle, but reverses u × v. It turns that of a sphere inward.
    for (shape, flips) in [("rectangle", true), ("sphere", true), ("disk", false), ("cube", false)] {
        let scene = scene(&format!("<shape type=\"{shape}\">{mirrored}</shape>"));
        assert_eq!(scene.entities[0].flip_normal, flips, "{shape}");
    }
}

#[test]
fn instances_multiply_groups() {
    let scene = scene(
        r#"<shape type="shapegroup" id="g"><shape type="sphere"/><shape type="sphere"><transform name="to_world"><translate x="1"/></transform></shape></shape>
        <shape type="instance"><ref id="g"/></shape>
        <shape type="instance"><ref id="g"/><transform name="to_world"><scale value="2"/><translate y="5"/></transform></shape>"#,
    );
    assert_eq!((scene.entities.len(), scene.groups.len(), scene.instances.len()), (2, 1, 2));
    assert!(scene.entities.iter().all(|entity| entity.within == Some(0)));
    let placed = |i: usize| scene.instances[i].transform.transform_point3(DVec3::X);
    assert!(near(placed(0), [1.0, 0.0, 0.0]) && near(placed(1), [2.0, 5.0, 0.0]));
}

#[test]
fn an_instance_in_a_merge_stands_in_the_world() {
    let scene = scene(
        r#"<shape type="shapegroup" id="g"><shape type="sphere"/></shape>
        <shape type="merge"><shape type="cube"/><shape type="instance"><ref id="g"/><transform name="to_world"><translate y="5"/></transform></shape></shape>"#,
    );
    assert_eq!((scene.entities.len(), scene.groups.len(), scene.instances.len()), (2, 1, 1));
    assert!(near(scene.instances[0].transform.transform_point3(DVec3::X), [1.0, 5.0, 0.0]));
    assert_eq!(scene.instances[0].within, None);
}

#[test]
fn materials_of_shapes_without_any_are_made_once() {
    let shapes = "<shape type=\"sphere\"/><shape type=\"rectangle\"/><shape type=\"disk\"><emitter type=\"area\"/></shape>";
    // A grey one, one that is black on the back, and a black one.
    for count in [1, 5] {
        assert_eq!(scene(&shapes.repeat(count)).materials.len(), 3, "{count}");
    }
}

#[test]
fn a_checkerboard_of_light_is_not_one_of_reflectances() {
    let scene = scene(
        "<texture type=\"checkerboard\" id=\"t\"><spectrum name=\"color0\" value=\"300:0.5, 900:0.5\"/></texture><shape type=\"cube\"><bsdf type=\"diffuse\"><ref id=\"t\" name=\"reflectance\"/></bsdf><emitter type=\"area\"><ref id=\"t\" name=\"radiance\"/></emitter></shape>",
    );
    assert_eq!(scene.textures.len(), 2);
    assert_ne!(scene.textures[0].kind, scene.textures[1].kind);
}

#[test]
fn shapes_with_rotated_uv_and_squeezed_shapes_become_groups() {
    let of = |shape: &str, bsdf: &str| {
        let turned = r#"<transform name="to_world"><scale value="2"/><rotate x="1" angle="40"/></transform>"#;
        scene(&format!("<shape type=\"{shape}\">{turned}{bsdf}</shape>"))
    };
    let board = "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"checkerboard\"/></bsdf></bsdf>";
    for shape in ["sphere", "cylinder"] {
        assert_eq!(of(shape, board).instances.len(), 1, "{shape}");
        assert_eq!(
            of(shape, "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>").instances.len(),
            0,
            "{shape}"
        );
    }
    let squeezed = r#"<transform name="to_world"><scale x="2"/></transform>"#;
    let scene = scene(&format!("<shape type=\"disk\">{squeezed}</shape><shape type=\"sphere\"/>"));
    assert!(matches!(scene.entities[0].shape, Shape::Sphere(_)), "those of the world come first");
    assert!(matches!(scene.entities[1].shape, Shape::Disk(disk) if disk.radius == 1.0));
    assert_eq!(scene.instances.len(), 1);
}

#[test]
fn materials_have_the_counterparts_of_their_plugins() {
    let of = |bsdf: &str| {
        let scene = scene(&format!("<shape type=\"sphere\"><bsdf {bsdf}</bsdf></shape>"));
        scene.materials[scene.entities[0].material].kind.clone()
    };
    assert!(matches!(of("type=\"diffuse\">"), MaterialKind::Matte(matte) if matte.reflectance == [0.5; 3]));
    assert!(
        matches!(of("type=\"conductor\">"), MaterialKind::Mirror(mirror) if mirror.reflectance == [1.0; 3])
    );
    match of(
        "type=\"roughconductor\"><string name=\"material\" value=\"Au\"/><float name=\"alpha\" value=\"0.25\"/><string name=\"distribution\" value=\"ggx\"/>",
    ) {
        MaterialKind::Conductor(gold) => {
            assert_eq!((gold.roughness, gold.metal), ([0.5; 2], None));
            let [red, _, blue] = gold.eta.expect("eta");
            assert!(red < 0.5 && blue > 1.0, "{red} {blue}");
        }
        other => panic!("{other:?}"),
    }
    // Of a fit below 0 the square counts.
    match of("type=\"conductor\"><rgb name=\"eta\" value=\"1 2 3\"/><rgb name=\"k\" value=\"-0.5 1 2\"/>") {
        MaterialKind::Conductor(metal) => assert_eq!(metal.k, Some([0.5, 1.0, 2.0])),
        other => panic!("{other:?}"),
    }
    match of(
        "type=\"roughconductor\"><string name=\"distribution\" value=\"ggx\"/><float name=\"alpha_u\" value=\"0.04\"/><float name=\"alpha_v\" value=\"0.01\"/><spectrum name=\"eta\" value=\"2\"/><rgb name=\"k\" value=\"1 2 3\"/>",
    ) {
        MaterialKind::Conductor(metal) => {
            assert_eq!(
                (metal.roughness, metal.eta, metal.k),
                ([0.2, 0.1], Some([2.0; 3]), Some([1.0, 2.0, 3.0]))
            );
        }
        other => panic!("{other:?}"),
    }
    match of("type=\"dielectric\">") {
        MaterialKind::Glass(glass) => assert!((glass.ior - 1.5046 / 1.000277).abs() < 1e-12),
        other => panic!("{other:?}"),
    }
    match of(
        "type=\"roughdielectric\"><string name=\"distribution\" value=\"ggx\"/><string name=\"int_ior\" value=\"Water\"/><float name=\"ext_ior\" value=\"1\"/>",
    ) {
        MaterialKind::Dielectric(water) => {
            assert_eq!((water.ior, water.thin_walled), (1.333, false));
            assert!((water.roughness[0].powi(2) - 0.1).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
    match of("type=\"thindielectric\"><rgb name=\"specular_transmittance\" value=\"0.5\"/>") {
        MaterialKind::Dielectric(sheet) => assert!(sheet.thin_walled && sheet.transmittance == [0.5; 3]),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_grey_factor_of_a_conductor_is_a_mix_with_black() {
    let of = |factor: &str| {
        scene(&format!(
            "<shape type=\"sphere\"><bsdf type=\"roughconductor\" id=\"m\"><string name=\"distribution\" value=\"ggx\"/>{factor}</bsdf></shape>"
        ))
    };
    for (factor, amount) in [
        ("<rgb name=\"specular_reflectance\" value=\"0.6, 0.6, 0.6\"/>", 0.6),
        ("<spectrum name=\"specular_reflectance\" value=\"0.25\"/>", 0.25),
    ] {
        let scene = of(factor);
        let material = &scene.materials[scene.entities[0].material];
        let MaterialKind::Mix(mix) = &material.kind else { panic!("{material:?}") };
        assert!((mix.amount - amount).abs() < 1e-6 && material.name == "m", "{material:?}");
        let [black, metal] = [mix.a, mix.b].map(|index| &scene.materials[index].kind);
        assert!(matches!(black, MaterialKind::Matte(matte) if matte.reflectance == [0.0; 3]), "{black:?}");
        assert!(matches!(metal, MaterialKind::Conductor(_)), "{metal:?}");
    }
    // A colour has no counterpart, nor has a factor above one.
    for factor in ["1", "0.6 0.6 0.5", "2"] {
        let factor = format!("<rgb name=\"specular_reflectance\" value=\"{factor}\"/>");
        let scene = of(&factor);
        let kind = &scene.materials[scene.entities[0].material].kind;
        assert!(matches!(kind, MaterialKind::Conductor(_)), "{factor}: {kind:?}");
    }
}

#[test]
fn a_light_without_a_bsdf_reflects_nothing() {
    let scene = scene(
        "<shape type=\"sphere\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"1 2 3\"/></emitter></shape>",
    );
    assert_eq!(scene.entities[0].emission, [1.0, 2.0, 3.0]);
    assert!(matches!(scene.materials[0].kind, MaterialKind::Matte(matte) if matte.reflectance == [0.0; 3]));
}

#[test]
fn named_objects_are_made_once() {
    let body = "<texture type=\"checkerboard\" id=\"t\"/><bsdf type=\"diffuse\" id=\"m\"><ref id=\"t\" name=\"reflectance\"/></bsdf><emitter type=\"area\" id=\"e\"/>";
    let shape = "<shape type=\"cube\"><ref id=\"m\"/><ref id=\"e\"/></shape>";
    let scene = scene(&format!("{body}{shape}{shape}"));
    assert_eq!((scene.materials.len(), scene.textures.len(), scene.entities.len()), (1, 1, 2));
    assert!(scene.entities.iter().all(|entity| entity.emission == [1.0; 3]));
    match scene.textures[0].kind {
        TextureKind::Checkerboard(board) => {
            assert_eq!((board.even, board.odd), (Varying::Colour([0.4; 3]), Varying::Colour([0.2; 3])));
            assert_eq!(board.checks_per_unit, [2.0; 2]);
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn a_texture_of_alpha_becomes_one_of_roughness() {
    let scene = scene(
        "<shape type=\"sphere\"><bsdf type=\"roughconductor\"><string name=\"distribution\" value=\"ggx\"/><texture name=\"alpha\" type=\"checkerboard\"><float name=\"color0\" value=\"0.04\"/><float name=\"color1\" value=\"0.25\"/></texture></bsdf></shape>",
    );
    assert_eq!(scene.materials[0].textures[0].parameter, "roughness");
    match scene.textures[0].kind {
        TextureKind::Checkerboard(board) => {
            assert_eq!((board.even, board.odd), (Varying::Colour([0.5; 3]), Varying::Colour([0.2; 3])));
        }
        ref other => panic!("{other:?}"),
    }
}

/// The same texture as a colour and as a number: as a number, its values change places in Mitsuba.
#[test]
fn checks_change_places_where_they_are_numbers() {
    let board = "<texture type=\"checkerboard\" id=\"t\"><float name=\"color0\" value=\"0.1\"/><float name=\"color1\" value=\"0.9\"/></texture>";
    let of = |bsdf: &str, parameter: &str| {
        let scene = scene(&format!("{board}<shape type=\"sphere\">{bsdf}</shape>"));
        let mut textures = scene.materials.iter().flat_map(|material| &material.textures);
        let textured = textures.find(|textured| textured.parameter == parameter).expect(parameter);
        match scene.textures[textured.texture].kind {
            TextureKind::Checkerboard(board) => board.even,
            ref other => panic!("{other:?}"),
        }
    };
    let diffuse = "<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"t\"/></bsdf>";
    let colour = Varying::Colour([0.1; 3]);
    assert_eq!(of(diffuse, "reflectance"), colour);
    let metal = "<bsdf type=\"conductor\"><ref name=\"k\" id=\"t\"/></bsdf>";
    assert_eq!(of(metal, "k"), colour);
    let number = Varying::Colour([0.9; 3]);
    // The texture of the material inside is read first, and stays as it is.
    let mask = format!("<bsdf type=\"mask\"><ref name=\"opacity\" id=\"t\"/>{diffuse}</bsdf>");
    assert_eq!((of(&mask, "opacity"), of(&mask, "reflectance")), (number, colour));
    let blend = format!(
        "<bsdf type=\"blendbsdf\"><ref name=\"weight\" id=\"t\"/>{diffuse}<bsdf type=\"conductor\"/></bsdf>"
    );
    assert_eq!(of(&blend, "amount"), number);
}

#[test]
fn lights_are_read() {
    let scene = scene(
        r#"<emitter type="point"><point name="position" x="1" y="2" z="3"/><float name="intensity" value="2"/></emitter>
        <emitter type="spot"><transform name="to_world"><lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform></emitter>
        <emitter type="directional"><vector name="direction" value="0, 0, -2"/><rgb name="irradiance" value="3"/></emitter>
        <emitter type="constant"><spectrum name="radiance" value="1"/></emitter>"#,
    );
    match &scene.lights[..] {
        [Light::Point(point), Light::Spot(spot), Light::Directional(sun)] => {
            assert_eq!((point.position, point.intensity), (DVec3::new(1.0, 2.0, 3.0), Some([2.0; 3])));
            assert_eq!(
                (spot.direction, spot.cone_angle, spot.penumbra_angle),
                (DVec3::NEG_Z, 20.0, Some(5.0))
            );
            assert_eq!((spot.intensity, spot.falloff), (Some([1.0; 3]), Falloff::Angle));
            assert_eq!((sun.direction, sun.irradiance), (DVec3::NEG_Z, [3.0; 3]));
        }
        other => panic!("{other:?}"),
    }
    // Light of equal energy is not white in Rec. 709.
    let [red, green, blue] = scene.environment;
    assert!(red > 1.2 && green < 0.96 && blue < 0.92, "{red} {green} {blue}");
}

#[test]
fn integrators_set_the_number_of_bounces() {
    let depth = |integrator: &str| {
        let render = scene(&format!("<integrator {integrator}</integrator>")).render;
        render.max_depth
    };
    let path = |depth: i64| format!("type=\"path\"><integer name=\"max_depth\" value=\"{depth}\"/>");
    assert_eq!((depth(&path(-1)), depth(&path(1)), depth(&path(6))), (UNLIMITED, 0, 5));
    assert_eq!(
        (depth(&path(10_001)), depth(&path(10_002)), depth(&path(65_536))),
        (10_000, UNLIMITED, UNLIMITED)
    );
    assert_eq!(depth("type=\"direct\"><integer name=\"emitter_samples\" value=\"4\"/>"), 1);
}

#[test]
fn wrappers_become_modifiers() {
    let of = |bsdf: &str| {
        let mut scene = scene(&format!("<shape type=\"cube\"><bsdf {bsdf}</bsdf></shape>"));
        let material = scene.entities[0].material;
        (scene.materials.swap_remove(material), scene.textures)
    };
    let inner = "<bsdf type=\"diffuse\"/>";
    let (mask, _) = of(&format!("type=\"mask\">{inner}"));
    assert_eq!((mask.modifiers.opacity, mask.textures.len()), (0.5, 0));
    assert_eq!(of("type=\"null\">").0.modifiers.opacity, 0.0);
    let board = "type=\"checkerboard\"/>";
    let (mask, _) = of(&format!("type=\"mask\"><texture name=\"opacity\" {board}{inner}"));
    assert_eq!(mask.textures[0].parameter, "opacity");
    let (bump, _) =
        of(&format!("type=\"bumpmap\"><float name=\"scale\" value=\"0.1\"/><texture {board}{inner}"));
    assert_eq!((bump.modifiers.bump_scale, bump.textures[0].parameter), (0.1, "bump_map"));
    let normals = "<texture name=\"normalmap\" type=\"rawconstant\"><vector name=\"value\" value=\"0.5, 0.5, 1\"/></texture>";
    let (normal, textures) = of(&format!("type=\"normalmap\">{normals}{inner}"));
    assert_eq!(normal.textures[0].parameter, "normal_map");
    assert!(
        matches!(textures[0].kind, TextureKind::Constant(flat) if flat.value == Varying::Colour([0.5, 0.5, 1.0]))
    );
    let (mix, _) = of(&format!(
        "type=\"blendbsdf\"><float name=\"weight\" value=\"0.25\"/>{inner}<bsdf type=\"conductor\"/>"
    ));
    assert!(matches!(mix.kind, MaterialKind::Mix(mix) if (mix.a, mix.b, mix.amount) == (0, 1, 0.25)));
    let (sides, _) = of(&format!("type=\"twosided\">{inner}<bsdf type=\"conductor\"/>"));
    // The material of its front is not used itself.
    assert_eq!(sides.modifiers.back, Some(0));
}

#[test]
fn one_sided_surfaces_with_a_border_have_a_black_back() {
    let back = |shape: &str| {
        let scene = scene(&format!("<shape type={shape}</shape>"));
        let back = scene.materials[scene.entities[0].material].modifiers.back;
        back.map(|back| scene.materials[back].kind.clone())
    };
    let black = |kind| matches!(kind, Some(MaterialKind::Matte(matte)) if matte.reflectance == [0.0; 3]);
    assert!(black(back("\"rectangle\">")));
    assert!(black(back("\"disk\"><bsdf type=\"mask\"><bsdf type=\"conductor\"/></bsdf>")));
    let others = [
        "\"cube\">",
        "\"rectangle\"><emitter type=\"area\"/>",
        "\"rectangle\"><bsdf type=\"dielectric\"/>",
        "\"rectangle\"><bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>",
    ];
    for shape in others {
        assert_eq!(back(shape), None, "{shape}");
    }
    let shared = scene(
        "<bsdf type=\"diffuse\" id=\"a\"/><shape type=\"disk\"><ref id=\"a\"/></shape><shape type=\"disk\"><ref id=\"a\"/></shape>",
    );
    assert_eq!((shared.materials.len(), shared.entities[0].material), (2, shared.entities[1].material));
}

#[test]
fn a_whole_scene_is_the_same_in_toml() {
    let body = r#"<emitter type="constant"/><shape type="cube" id="box"><transform name="to_world"><scale x="0.3" y="1.7"/><rotate x="1" y="2" angle="33"/></transform>
        <bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf></shape>
        <shape type="disk"><bsdf type="roughconductor" id="metal"><string name="material" value="Cu"/></bsdf></shape>"#;
    let text = whole(body);
    let scene = read(&text).scene;
    let written = crate::scene::writing::write(&scene, std::path::Path::new(""), std::path::Path::new("f"));
    let written = written.expect("a scene that can be written");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("f")).expect("made");
    for (path, contents) in &written.files {
        let file = std::fs::File::create(folder.path().join(path)).expect("a file");
        contents.write(file).expect("written");
    }
    let path = folder.path().join("a.toml");
    std::fs::write(&path, written.text).expect("written");
    let again = crate::scene::load(&path).expect("a scene").scene;
    assert_eq!((&again.camera, &again.film, &again.render), (&scene.camera, &scene.film, &scene.render));
    for (a, b) in again.entities.iter().zip(&scene.entities) {
        assert_eq!((&a.shape, a.flip_normal), (&b.shape, b.flip_normal));
        let (a, b) = (&again.materials[a.material], &scene.materials[b.material]);
        assert_eq!(
            (&a.name, a.textured_kind(), a.textures.len()),
            (&b.name, b.textured_kind(), b.textures.len())
        );
        assert_eq!(a.modifiers.back.is_some(), b.modifiers.back.is_some());
    }
}
