//! Reports of parts without a counterpart: one for each kind, with the count and the first place.

use super::super::super::LoadOptions;
use super::{read_with, scene, warnings, whole};

#[test]
fn parts_without_a_counterpart_are_reported_once_with_their_count() {
    let body = "<shape type=\"sphere\"><bsdf type=\"plastic\"/></shape>\n<shape type=\"sphere\"><bsdf type=\"plastic\"/></shape>\n<shape type=\"linearcurve\"/>";
    let told = [
        "a.xml:2:22: bsdf \"plastic\" has no counterpart (2 in all, the first one here); a matte material of its diffuse_reflectance is rendered instead",
        "a.xml:4:1: shape \"linearcurve\" has no counterpart; it is left out",
    ];
    assert_eq!(warnings(body), told);
    let options = LoadOptions { strict: true, ..LoadOptions::default() };
    let errors = read_with(&whole(body), &options).expect_err("strict").to_string();
    assert_eq!(errors, told.join("\n").replace("; ", "; without --strict, "));
}

#[test]
fn a_part_without_a_counterpart_is_reported_without_its_parameters() {
    let told = |body: &str, what: &str| assert_eq!(warnings(body), [format!("a.xml:2:{what}")], "{body}");
    told(
        "<integrator type=\"guided\"><float name=\"guide\" value=\"1\"/></integrator>",
        "1: integrator \"guided\" has no counterpart; a path tracer is used instead",
    );
    told(
        "<shape type=\"sphere\"><emitter type=\"lamp\"><float name=\"width\" value=\"1\"/></emitter></shape>",
        "22: emitter \"lamp\" has no counterpart; the shape emits nothing",
    );
    told(
        "<shape type=\"Sphere\"><float name=\"width\" value=\"1\"/></shape>",
        "1: shape \"Sphere\" has no counterpart; it is left out; did you mean \"sphere\"?",
    );
    let film = "<scene version=\"3.0.0\"><sensor type=\"perspective\">\n<film type=\"timed\"><float name=\"bins\" value=\"1\"/><integer name=\"width\" value=\"8\"/></film></sensor><emitter type=\"constant\"/></scene>";
    let loaded = read_with(film, &LoadOptions::default()).expect("a scene");
    let warnings: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        warnings,
        ["a.xml:2:1: film \"timed\" has no counterpart; a film of colours is rendered instead"]
    );
    assert_eq!(loaded.scene.film.width, 8);
}

#[test]
fn the_integrator_in_another_one_is_read() {
    let inner = "<integrator type=\"path\"><integer name=\"max_depth\" value=\"3\"/></integrator>";
    let body = format!("<integrator type=\"stokes\">{inner}</integrator>");
    assert_eq!(scene(&body).render.max_depth, 2);
    let told = "a.xml:2:1: integrator \"stokes\" has no counterpart; the integrator in it is used";
    assert_eq!(warnings(&body), [told]);
    let body = "<integrator type=\"aov\"><string name=\"aovs\" value=\"dd:depth\"/></integrator>";
    let told = "a.xml:2:1: integrator \"aov\" has no counterpart; use --layers for further layers";
    assert_eq!(warnings(body), [told]);
}

#[test]
fn objects_of_the_scene_that_others_refer_to_are_not_left_out() {
    let text = |more: &str| {
        format!(
            "<scene version=\"3.0.0\"><sampler type=\"stratified\" id=\"a\"/><sensor type=\"perspective\">{more}</sensor><emitter type=\"constant\"/></scene>"
        )
    };
    let told = |more: &str| {
        let loaded = read_with(&text(more), &LoadOptions::default()).expect("a scene");
        loaded.warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(told("<ref id=\"a\"/>"), [""; 0]);
    let left_out = "a.xml:1:24: sampler \"stratified\" in scene \"scene\" has no counterpart; it is left out";
    assert_eq!(told(""), [left_out]);
    // A misspelt parameter is reported, though its texture is used elsewhere.
    let body = "<texture type=\"checkerboard\" id=\"t\"/><shape type=\"cube\"><bsdf type=\"diffuse\"><ref id=\"t\" name=\"reflectance\"/><ref id=\"t\" name=\"reflectanc\"/></bsdf></shape>";
    let left_out =
        "a.xml:2:110: texture \"checkerboard\" in bsdf \"diffuse\" has no counterpart; it is left out";
    assert_eq!(warnings(body), [left_out]);
}

#[test]
fn long_axes_of_rotations_are_reported_once_and_normalised() {
    let shape = |axis: &str| {
        format!(
            "<shape type=\"rectangle\"><transform name=\"to_world\"><rotate {axis} angle=\"90\"/></transform></shape>"
        )
    };
    let body = format!("{}\n{}\n{}", shape("z=\"1\""), shape("z=\"2\""), shape("value=\"0 1 1\""));
    let told = "a.xml:3:52: an axis of a rotation that is not of unit length has no counterpart (2 in all, the first one here); it is normalised";
    assert_eq!(warnings(&body), [told]);
    let scene = scene(&body);
    assert_eq!(scene.entities[0].shape, scene.entities[1].shape);
    assert_eq!(warnings(&shape("value=\"0.577 0.577 0.577\"")), [""; 0]);
}

#[test]
fn unknown_properties_are_reported() {
    let body = "<shape type=\"sphere\"><float name=\"radios\" value=\"2\"/></shape>";
    assert_eq!(
        warnings(body),
        ["a.xml:2:22: \"radios\" of shape \"sphere\" has no counterpart; it is left out"]
    );
    // Objects that no shape uses are not converted.
    assert_eq!(warnings("<bsdf type=\"diffuse\" id=\"a\"><float name=\"b\" value=\"1\"/></bsdf>"), [""; 0]);
}

#[test]
fn unused_variables_of_the_command_line_are_reported() {
    let options = LoadOptions { defines: vec![("spp".into(), "8".into())], ..LoadOptions::default() };
    let loaded = read_with(&whole("<emitter type=\"constant\"/>"), &options).expect("a scene");
    assert_eq!(loaded.warnings[0].to_string(), "a.xml:1:1: the scene has no variable \"$spp\"");
    let text = whole("<default name=\"spp\" value=\"4\"/><emitter type=\"constant\"/>");
    let options = LoadOptions { defines: vec![("sp".into(), "8".into())], ..LoadOptions::default() };
    let loaded = read_with(&text, &options).expect("a scene");
    let told = "a.xml:1:1: the scene has no variable \"$sp\"; did you mean \"spp\"?";
    assert_eq!(loaded.warnings[0].to_string(), told);
}

#[test]
fn a_scene_without_light_is_reported() {
    let loaded = read_with(&whole("<shape type=\"sphere\"/>"), &LoadOptions::default()).expect("a scene");
    assert_eq!(
        loaded.warnings[0].to_string(),
        "a.xml:1:1: nothing in the scene shines; the picture will be black"
    );
}

#[test]
fn lights_that_reach_nothing_are_reported_where_they_are() {
    let lamp = "<shape type=\"rectangle\"><transform name=\"to_world\"><translate z=\"3\"/></transform><emitter type=\"area\"/></shape>";
    let spot = "<emitter type=\"spot\"><transform name=\"to_world\"><lookat origin=\"0 0 4\" target=\"0 0 9\" up=\"0 1 0\"/></transform></emitter>";
    let told = warnings(&format!("<shape type=\"sphere\"/>\n{lamp}\n<emitter type=\"point\"/>\n{spot}"));
    let [lamp, spot] = &told[..] else { panic!("{told:?}") };
    assert!(lamp.starts_with("a.xml:3:1: ") && lamp.contains("set flip_normals = true"), "{lamp}");
    assert!(spot.starts_with("a.xml:5:1: light 2 is a spot"), "{spot}");
}
