//! Mixes, and the modifiers of every material: holes, back sides, maps.

use super::*;

/// A grey material in lines 1 to 3, a matte one in lines 4 to 6, then `text` from line 7 on.
fn matte(text: &str) -> String {
    with_grey(&format!("[materials.a]\ntype = \"matte\"\nreflectance = [0, 0, 0]\n{text}\n"))
}

/// A grey material in lines 1 to 3, a mix in lines 4 and 5, then `text` from line 6 on.
fn mix(text: &str) -> String {
    with_grey(&format!("[materials.a]\ntype = \"mix\"\n{text}\n"))
}

broken!(
    a_mix_that_contains_itself,
    mix("a = \"grey\"\nb = \"c\"\n[materials.c]\ntype = \"mix\"\na = \"a\"\nb = \"grey\""),
    ["10:5: mix contains itself: a → c → a"]
);
broken!(
    a_mix_of_what_there_is_not,
    mix("a = \"gray\"\nb = \"velvet\""),
    [
        r#"6:5: no material "gray"; did you mean "grey"?"#,
        r#"7:5: no material "velvet"; the materials are "grey", "a""#
    ]
);
broken!(a_mix_of_one, mix("a = \"grey\""), [r#"4:1: missing key "b" in a mix"#]);
broken!(
    a_mix_by_more_than_all,
    mix("a = \"grey\"\nb = \"grey\"\namount = 1.5"),
    ["8:10: amount must be from 0 to 1, not 1.5"]
);
broken!(
    a_mix_by_a_colour,
    mix("a = \"grey\"\nb = \"grey\"\namount = [1, 0, 0]"),
    ["8:10: amount must be a number, not an array"]
);
broken!(
    a_mix_by_a_texture_that_there_is_not,
    mix("a = \"grey\"\nb = \"grey\"\namount = \"mask\""),
    [r#"8:10: no texture "mask"; this file has no [textures.NAME]"#]
);
broken!(
    a_mix_with_a_reflectance,
    mix("a = \"grey\"\nb = \"grey\"\nreflectance = [1, 1, 1]"),
    [
        r#"8:1: unknown key "reflectance" in a mix; valid here: "type", "a", "b", "amount", "opacity", "back", "normal_map", "normal_scale", "bump_map", "bump_scale""#
    ]
);
broken!(
    mixes_nested_too_deep,
    {
        let one = |i: usize| {
            let inner = if i == 0 { "grey".to_owned() } else { format!("m{}", i - 1) };
            format!("[materials.m{i}]\ntype = \"mix\"\na = \"{inner}\"\nb = \"grey\"\n")
        };
        with_grey(&(0..17).map(one).collect::<String>())
    },
    ["68:12: mix \"m16\" is nested more than 16 levels deep"]
);
broken!(an_opacity_above_one, matte("opacity = 1.5"), ["7:11: opacity must be from 0 to 1, not 1.5"]);
broken!(
    an_opacity_below_zero_and_one_that_is_a_word,
    matte("opacity = -0.5\n[materials.b]\ntype = \"mirror\"\nreflectance = [1, 1, 1]\nopacity = true"),
    ["7:11: opacity must be from 0 to 1, not -0.5", "11:11: opacity must be a number, not a boolean"]
);
broken!(
    an_opacity_that_is_a_colour,
    matte("opacity = [1, 1, 1]"),
    ["7:11: opacity must be a number, not an array"]
);
broken!(
    an_opacity_in_quotes,
    matte("opacity = \"0.5\""),
    ["7:11: opacity must be a number, not a string; remove the quotes"]
);
broken!(
    an_opacity_of_a_texture_that_there_is_not,
    matte("opacity = \"leave\"\n[textures.leaves]\ntype = \"constant\"\nvalue = 1"),
    [r#"7:11: no texture "leave"; did you mean "leaves"?"#]
);
broken!(
    a_back_that_there_is_not,
    matte("back = \"gray\""),
    [r#"7:8: no material "gray"; did you mean "grey"?"#]
);
broken!(a_back_that_is_itself, matte("back = \"a\""), ["7:8: matte contains itself: a → a"]);
broken!(
    backs_of_each_other,
    matte("back = \"b\"\n[materials.b]\ntype = \"mirror\"\nreflectance = [1, 1, 1]\nback = \"a\""),
    ["11:8: matte contains itself: a → b → a"]
);
broken!(
    a_normal_map_that_is_a_number,
    matte("normal_map = 0.5"),
    ["7:14: normal_map must be the name of a texture, not a number with a point"]
);
broken!(
    a_bump_map_that_is_a_colour,
    matte("bump_map = [0.5, 0.5, 1]"),
    ["7:12: bump_map must be the name of a texture, not an array"]
);
broken!(
    a_normal_map_that_is_a_file,
    matte("normal_map = \"bricks.png\""),
    [
        r#"7:14: no texture "bricks.png"; add [textures.bricks] with type = "image" and file = "bricks.png", and name it: "bricks""#
    ]
);
broken!(
    a_normal_map_that_is_a_material,
    matte("normal_map = \"grey\"\n[textures.t]\ntype = \"constant\"\nvalue = 1"),
    [r#"7:14: no texture "grey"; the textures are "t""#]
);
broken!(
    scales_that_are_textures,
    matte("normal_scale = \"t\"\nbump_scale = \"t\"\n[textures.t]\ntype = \"constant\"\nvalue = 1"),
    ["7:16: normal_scale must be a number, not a string", "8:14: bump_scale must be a number, not a string"]
);
broken!(
    scales_beyond_their_limits,
    matte("normal_scale = 1001\nbump_scale = inf"),
    [
        "7:16: normal_scale must be from -1000 to 1000, not 1001",
        "8:14: bump_scale must be a finite number, not inf"
    ]
);
broken!(
    a_modifier_misspelt,
    matte("normalmap = \"t\"\nopacty = 1"),
    [
        r#"7:1: unknown key "normalmap" in a matte material; did you mean "normal_map"?"#,
        r#"8:1: unknown key "opacty" in a matte material; did you mean "opacity"?"#
    ]
);
broken!(
    an_opacity_of_an_entity,
    entity("{ type = \"sphere\", center = [0, 0, 0], radius = 1 }", "opacity = 0.5"),
    [r#"7:1: unknown key "opacity" in an entity; "opacity" belongs under [materials.NAME]"#]
);

#[test]
fn colour_pictures_as_normals_and_unused_scales_give_warnings() {
    let text = r#"[materials.a]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
normal_map = "n"
opacity = "twice"
bump_scale = 2
[textures.n]
type = "image"
file = "docs/pictures/cover.png"
[textures.twice]
type = "scale"
texture = "n"
by = 2
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "a"
emission = [1, 1, 1]
"#;
    let warnings = |text: &str| {
        let loaded = parse(text, "box.toml".as_ref()).expect("a scene");
        loaded.warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let decoded = |place: &str, parameter: &str, name: &str| {
        format!(
            "box.toml:{place}: {parameter} is not a colour, but the picture of texture \"{name}\" is decoded from sRGB; give the image color_space = \"data\""
        )
    };
    let expected = [
        decoded("4:14", "normal_map", "n"),
        decoded("5:11", "opacity", "twice"),
        "box.toml:6:14: bump_scale has no effect without a bump_map; name a texture as bump_map".to_owned(),
    ];
    assert_eq!(warnings(text), expected);
    let data = text.replace("cover.png\"", "cover.png\"\ncolor_space = \"data\"");
    assert_eq!(warnings(&data), expected[2..]);
}
