//! Reports of parts without a counterpart: one for each kind, with the count and the first place.

use super::super::super::LoadOptions;
use super::{read_with, warnings, whole};

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
    assert_eq!(errors.lines().collect::<Vec<_>>(), told);
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
}

#[test]
fn a_scene_without_light_is_reported() {
    let loaded = read_with(&whole("<shape type=\"sphere\"/>"), &LoadOptions::default()).expect("a scene");
    assert_eq!(
        loaded.warnings[0].to_string(),
        "a.xml:1:1: nothing in the scene shines; the picture will be black"
    );
}
