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
fn surfaces_that_lead_to_several_media_give_a_warning() {
    let green = |rest: &str| format!("type = \"dielectric\"\nior = 1.5\nabsorption = [1, 0, 1]\n{rest}");
    let sky = "[environment]\nradiance = [1, 1, 1]\n[materials.clear]\ntype = \"glass\"\nior = 1.5";
    let with = |material: &str| {
        let matte = "type = \"matte\"\nreflectance = [0.5, 0.5, 0.5]";
        warnings(&format!("{}{sky}", BALL.replace(matte, material)))
    };
    let several = "box.toml:10:12: \"ball\" leads to several media by mix, checkerboard or back: a path may leave another \
                   medium than it entered; give these dielectrics the same ior, absorption and priority, or let one \
                   material be opaque";
    assert_eq!(with(&green("back = \"clear\"\n")), [several]);
    let holed = "box.toml:10:12: \"ball\" has an opacity below 1 on a dielectric: a path that enters through a hole is \
                 not in its medium; remove the opacity, or the absorption and the priorities";
    assert!(with(&green("opacity = 0.5\n")).contains(&holed.to_owned()));
    assert!(!with(&green("reflectance = [1, 1, 1]\n")).iter().any(|warning| warning.contains("med")));
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
