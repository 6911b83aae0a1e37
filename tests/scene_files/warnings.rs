//! Legal but probably unintended input.

use super::read;

fn warnings(text: &str) -> Vec<String> {
    read(text).warnings.iter().map(ToString::to_string).collect()
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
fn a_scene_without_light_gives_a_warning() {
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
fn unsampled_textured_emission_gives_a_warning() {
    let emits = "emission = \"t\"\n[textures.t]\ntype = \"constant\"\nvalue = 1";
    let chance = "box.toml:8:12: with textured emission, only quads and boxes are sampled as lights; \
                  paths find the emission of other shapes by chance";
    assert_eq!(warnings(&format!("{BALL}{emits}")), [chance]);
    let ball = r#"type = "sphere", center = [0, 0, 0], radius = 1"#;
    let none: [&str; 0] = [];
    for shape in [
        r#"type = "quad", corner = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0]"#,
        r#"type = "box", min = [0, 0, 0], max = [1, 1, 1]"#,
    ] {
        let text = BALL.replace(ball, shape);
        assert_ne!(text, BALL);
        assert_eq!(warnings(&format!("{text}{emits}")), none);
    }
}

#[test]
fn an_empty_scene_gives_a_warning() {
    let empty = "box.toml: there is nothing in this scene; add [[entities]] with a shape and a material";
    assert_eq!(warnings("[environment]\nradiance = [1, 1, 1]"), [empty]);
}

#[test]
fn an_unused_ambient_term_gives_a_warning() {
    let text = format!("{BALL}emission = [1, 1, 1]\n[render]\nambient = [1, 1, 1]");
    let warning = "box.toml:10:11: ambient has no effect: only integrator \"whitted\" has an ambient term; \
                   light the scene with an [environment] instead";
    assert_eq!(warnings(&text), [warning]);
}

#[test]
fn unused_materials_give_a_warning() {
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
        |line: u32, name| format!("box.toml:{line}:12: material \"{name}\" is not used; no entity uses it");
    assert_eq!(warnings(&text), [unused(9, "alone"), unused(12, "board"), unused(16, "part")]);
    let text = text.replace("material = \"grey\"", "material = \"board\"");
    assert_eq!(warnings(&text), [unused(9, "alone")]);
}

#[test]
fn entities_with_the_same_name_give_a_warning() {
    let second =
        "[[entities]]\nname = \"ball\"\nshape = { type = \"sphere\", center = [3, 0, 0], radius = 1 }\n";
    let text = format!("{BALL}{second}material = \"grey\"\n[environment]\nradiance = [1, 1, 1]");
    let warning =
        "box.toml:9:8: entity 2 has the name of entity 1, \"ball\"; messages cannot distinguish them";
    assert_eq!(warnings(&text), [warning]);
}
