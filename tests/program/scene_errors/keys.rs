//! Keys and the types of their values.

use super::*;

// Keys.
broken!(
    unknown_key_misspelt,
    "[film]\nwidht = 640\n",
    [r#"2:1: unknown key "widht" in the film; did you mean "width"?"#]
);
broken!(
    unknown_key_with_no_near_spelling,
    "[film]\nbitdepth = 8\n",
    [
        r#"2:1: unknown key "bitdepth" in the film; valid here: "width", "height", "exposure", "tone", "filter", "mode""#
    ]
);
broken!(
    unknown_table,
    "[cammera]\neye = [0, 0, 0]\n",
    [r#"1:2: unknown key "cammera" in a scene file; did you mean "camera"?"#]
);
broken!(
    key_outside_its_table,
    "width = 640\n",
    [r#"1:1: unknown key "width" in a scene file; "width" belongs under [film]"#]
);
broken!(
    key_in_the_wrong_table,
    "[film]\nsamples = 10\n",
    [r#"2:1: unknown key "samples" in the film; "samples" belongs under [render]"#]
);
broken!(
    key_of_two_tables,
    "height = 640\n",
    [r#"1:1: unknown key "height" in a scene file; "height" belongs under [film] or under [camera]"#]
);
broken!(
    key_of_a_family,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "roughness = 1\ncone_angle = 30"),
    [
        r#"7:1: unknown key "roughness" in an entity; "roughness" belongs under [materials.NAME] or under [textures.NAME]"#,
        r#"8:1: unknown key "cone_angle" in an entity; "cone_angle" belongs under [[lights]]"#
    ]
);
broken!(
    rotation_beside_the_transform,
    entity(r#"{ type = "box", min = [0, 0, 0], max = [1, 1, 1], rotate = [90, 0, 0] }"#, ""),
    [r#"5:59: unknown key "rotate" in a box; "rotate" belongs inside transform: transform = { rotate = … }"#]
);
broken!(
    rotation_beside_the_shape,
    entity(r#"{ type = "box", min = [0, 0, 0], max = [1, 1, 1] }"#, "rotate = [90, 0, 0]"),
    [
        r#"7:1: unknown key "rotate" in an entity; "rotate" belongs in the transform of a shape or an instance or under [environment]"#
    ]
);
broken!(
    environment_by_another_programs_name,
    "[world]\nradiance = [1, 1, 1]\n",
    [r#"1:2: unknown key "world" in a scene file; did you mean "environment"?"#]
);
broken!(
    depth_by_another_programs_name,
    "[render]\nmax_bounces = 8\n",
    [r#"2:1: unknown key "max_bounces" in the render settings; did you mean "max_depth"?"#]
);
broken!(
    keys_without_a_counterpart,
    "[render]\ndenoise = true\n[film]\ntransparent = true\n",
    [
        r#"2:1: unknown key "denoise" in the render settings; there is no denoiser; render with --layers albedo,normal, which other denoisers need"#,
        r#"4:1: unknown key "transparent" in the film; pictures have no alpha; see opacity and "dielectric" for transparent surfaces"#
    ]
);
broken!(
    key_by_another_programs_name,
    r#"
[materials.a]
type = "matte"
albedo = [0.5, 0.5, 0.5]
"#,
    [r#"3:1: unknown key "albedo" in a matte material; did you mean "reflectance"?"#]
);
broken!(
    key_by_half_its_name,
    "[camera]\nfov = 60\n",
    [r#"2:1: unknown key "fov" in the camera; did you mean "vertical_fov"?"#]
);
broken!(
    unknown_key_in_inline_table,
    entity(r#"{ type = "sphere", centre = [0, 0, 0], radius = 1 }"#, ""),
    [r#"5:28: unknown key "centre" in a sphere; did you mean "center"?"#]
);
broken!(
    misspelt_type,
    entity(r#"{ tpye = "sphere", center = [0, 0, 0], radius = 1 }"#, ""),
    [r#"5:11: unknown key "tpye" in shape; did you mean "type"?"#]
);
broken!(
    misspelt_beside_missing,
    entity(r#"{ type = "sphere", centre = [0, 0, 0] }"#, ""),
    [
        r#"5:9: missing key "radius" in a sphere"#,
        r#"5:28: unknown key "centre" in a sphere; did you mean "center"?"#
    ]
);
broken!(
    entities_by_one_of_them,
    "[[entity]]\nname = \"a\"\n",
    [r#"1:3: unknown key "entity" in a scene file; did you mean "entities"?"#]
);
broken!(
    material_by_another_programs_name,
    "[materials.a]\ntype = \"lambert\"\nreflectance = [0.5, 0.5, 0.5]\n",
    [r#"2:8: unknown material type "lambert"; did you mean "matte"?"#]
);
broken!(
    key_of_another_shape,
    entity(r#"{ type = "plane", normal = [0, 0, 1], distance = 0, radius = 1 }"#, ""),
    [r#"5:61: unknown key "radius" in a plane; valid here: "type", "normal", "distance""#]
);
broken!(
    key_with_control_characters,
    "\"\\u001b[31m\" = 1\n",
    [
        r#"1:1: unknown key "\u{1b}[31m" in a scene file; valid here: "film", "camera", "render", "textures", "materials", "entities", "groups", "instances", "lights", "environment""#
    ]
);

// Types.
broken!(
    integer_is_a_string,
    r#"
[film]
width = "640"
"#,
    ["2:9: width must be an integer, not a string; remove the quotes"]
);
broken!(
    integer_is_a_float,
    "[film]\nwidth = 640.0\n",
    ["2:9: width must be an integer, not a number with a point"]
);
broken!(
    number_is_a_string,
    r#"
[camera]
vertical_fov = "wide"
"#,
    ["2:16: vertical_fov must be a number, not a string"]
);
broken!(number_is_a_boolean, "[film]\nexposure = true\n", ["2:12: exposure must be a number, not a boolean"]);
broken!(
    colour_is_a_number,
    "[environment]\nradiance = 1\n",
    ["2:12: radiance must be an array of 3 numbers (red, green, blue), not an integer"]
);
broken!(
    colour_has_two_channels,
    "[environment]\nradiance = [1, 1]\n",
    ["2:12: radiance must be an array of 3 numbers (red, green, blue), not an array of 2"]
);
broken!(
    colour_has_a_string,
    r#"
[environment]
radiance = [1, "1", 1]
"#,
    ["2:16: green of radiance must be a number, not a string; remove the quotes"]
);
broken!(
    vector_has_four_parts,
    "[camera]\neye = [0, 0, 0, 1]\n",
    ["2:7: eye must be an array of 3 numbers (x, y, z), not an array of 4"]
);
broken!(
    flag_is_an_integer,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "flip_normal = 1"),
    ["7:15: flip_normal must be true or false, not an integer"]
);
broken!(
    word_is_a_number,
    "[render]\nintegrator = 3\n",
    ["2:14: integrator must be a string, not an integer"]
);
broken!(
    table_is_a_number,
    "film = 3\n",
    ["1:8: film must be a table that describes the film, not an integer"]
);
broken!(
    material_is_a_string,
    r#"
[materials]
grey = "matte"
"#,
    ["2:8: materials.grey must be a table that describes a material, not a string"]
);
broken!(
    materials_are_an_array,
    r#"
[[materials]]
type = "matte"
"#,
    ["1:1: materials must be a table of named tables, not an array; begin each with [materials.NAME]"]
);
broken!(
    entities_are_a_table,
    r#"
[entities]
name = "a"
"#,
    ["1:1: entities must be an array of tables, not a table; begin each with [[entities]]"]
);
broken!(date_for_a_number, "[render]\nseed = 2014-05-01\n", ["2:8: seed must be an integer, not a date"]);
broken!(
    shape_is_a_string,
    entity(r#""sphere""#, ""),
    ["5:9: shape must be a table that describes a shape, not a string"]
);
