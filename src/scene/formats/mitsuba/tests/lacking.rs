//! What has no counterpart: told once, with its number and the first place.

use super::super::super::LoadOptions;
use super::{read_with, warnings, whole};

#[test]
fn what_has_no_counterpart_is_told_once_with_its_number() {
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
fn properties_that_nobody_knows_are_told() {
    let body = "<shape type=\"sphere\"><float name=\"radios\" value=\"2\"/></shape>";
    assert_eq!(
        warnings(body),
        ["a.xml:2:22: \"radios\" of shape \"sphere\" has no counterpart; it is left out"]
    );
    // Nothing was made of what is in no shape.
    assert_eq!(warnings("<bsdf type=\"diffuse\" id=\"a\"><float name=\"b\" value=\"1\"/></bsdf>"), [""; 0]);
}

#[test]
fn variables_of_the_command_line_that_no_file_knows_are_told() {
    let options = LoadOptions { defines: vec![("spp".into(), "8".into())], ..LoadOptions::default() };
    let loaded = read_with(&whole("<emitter type=\"constant\"/>"), &options).expect("a scene");
    assert_eq!(loaded.warnings[0].to_string(), "a.xml:1:1: the scene has no variable \"$spp\"");
}

#[test]
fn a_dark_scene_is_told() {
    let loaded = read_with(&whole("<shape type=\"sphere\"/>"), &LoadOptions::default()).expect("a scene");
    assert_eq!(
        loaded.warnings[0].to_string(),
        "a.xml:1:1: nothing in the scene shines; the picture will be black"
    );
}
