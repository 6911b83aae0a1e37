//! Scenes that are wrong, each in one way, and what the reader says about them: line, column, what is wrong and
//! how to put it right. Nothing wrong yields a scene.

use stride::scene::{Scene, parse};

/// A test that `$text` is refused with these messages, one for each line.
macro_rules! broken {
    ($name:ident, $text:expr, [$($message:expr),+ $(,)?]) => {
        #[test]
        fn $name() {
            assert_messages(&String::from($text), &[$($message),+]);
        }
    };
}

fn assert_messages(text: &str, messages: &[&str]) {
    // Raw strings begin on a line of their own.
    let text = text.strip_prefix('\n').unwrap_or(text);
    let result: Result<Scene, _> = parse(text, "box.toml".as_ref()).map(|loaded| loaded.scene);
    let errors = result.expect_err("a scene came of it");
    let messages: Vec<String> = messages.iter().map(|message| format!("box.toml:{message}")).collect();
    assert_eq!(errors.to_string().lines().collect::<Vec<_>>(), messages);
}

const GREY: &str = "[materials.grey]\ntype = \"matte\"\nreflectance = [0.5, 0.5, 0.5]\n";

/// A grey material in lines 1 to 3, then `text`.
fn with_grey(text: &str) -> String {
    format!("{GREY}{}", text.trim_start_matches('\n'))
}

/// A grey entity: its shape in line 5 after `shape = `, more keys from line 7.
fn entity(shape: &str, more: &str) -> String {
    with_grey(&format!("[[entities]]\nshape = {shape}\nmaterial = \"grey\"\n{more}\n"))
}

/// Checkerboards in checkerboards, the outermost in line 4.
fn checkerboards(nesting: usize) -> String {
    let board =
        |i| format!("[materials.m{i}]\ntype = \"checkerboard\"\neven = \"m{}\"\nodd = \"grey\"\n", i + 1);
    let boards: String = (0..nesting).map(board).collect();
    with_grey(&format!("{boards}[materials.m{nesting}]\ntype = \"mirror\"\nreflectance = [1, 1, 1]\n"))
}

#[test]
fn sixteen_nested_checkerboards_are_fine() {
    let loaded = parse(&checkerboards(16), "box.toml".as_ref()).expect("at the limit");
    assert_eq!(loaded.scene.materials.len(), 18);
}

// TOML itself.
broken!(value_missing, "[film]\nwidth =\n", ["2:8: this is not TOML: the value is missing"]);
broken!(
    string_not_closed,
    r#"
[render]
integrator = "path
"#,
    [r#"2:19: this is not TOML: invalid basic string, expected `"`"#]
);
broken!(header_not_closed, "[film\nwidth = 3\n", ["1:6: this is not TOML: unclosed table, expected `]`"]);
broken!(
    array_not_closed,
    "[camera]\neye = [0, 0, 0\n",
    ["2:15: this is not TOML: unclosed array, expected `]`"]
);
broken!(
    two_syntax_errors,
    r#"
[film]
width = = 3
height = tall
"#,
    [
        "2:9: this is not TOML: extra `=`, expected nothing",
        "2:11: this is not TOML: unexpected key or value, expected newline, `#`",
        "3:10: this is not TOML: invalid boolean, expected `true`"
    ]
);
broken!(
    key_given_twice,
    r#"
[film]
width = 3
height = 4
width = 5
"#,
    ["4:1: width is given twice"]
);
broken!(
    table_given_twice,
    r#"
[film]
width = 3
[film]
height = 3
"#,
    ["3:2: film is given twice"]
);
broken!(
    arrays_nested_without_end,
    format!("a = {}{}\n", "[".repeat(3000), "]".repeat(3000)),
    ["1:85: arrays and tables are nested too deep"]
);

// Keys.
broken!(
    unknown_key_misspelt,
    "[film]\nwidht = 640\n",
    [r#"2:1: unknown key "widht" in the film; did you mean "width"?"#]
);
broken!(
    unknown_key_with_no_near_spelling,
    "[film]\nbitdepth = 8\n",
    [r#"2:1: unknown key "bitdepth" in the film; valid here: "width", "height", "exposure", "filter""#]
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
    key_by_another_programs_name,
    r#"
[materials.a]
type = "matte"
albedo = [0.5, 0.5, 0.5]
"#,
    [
        r#"1:1: missing key "reflectance" in a matte material"#,
        r#"3:1: unknown key "albedo" in a matte material; did you mean "reflectance"?"#
    ]
);
broken!(
    key_by_half_its_name,
    "[camera]\nfov = 60\n",
    [r#"2:1: unknown key "fov" in the camera; did you mean "vertical_fov"?"#]
);
broken!(
    unknown_key_in_inline_table,
    entity(r#"{ type = "sphere", centre = [0, 0, 0], radius = 1 }"#, ""),
    [
        r#"5:9: missing key "center" in a sphere"#,
        r#"5:28: unknown key "centre" in a sphere; did you mean "center"?"#
    ]
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
        r#"1:1: unknown key "\u{1b}[31m" in a scene file; valid here: "film", "camera", "render", "materials", "entities", "lights", "environment""#
    ]
);

// Types.
broken!(
    integer_is_a_string,
    r#"
[film]
width = "640"
"#,
    ["2:9: width must be an integer, not a string; take the quotes away"]
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
    ["2:16: green of radiance must be a number, not a string; take the quotes away"]
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
    ["1:1: materials must be a table of names, not an array; begin each with [materials.NAME]"]
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

// Film.
broken!(no_columns, "[film]\nwidth = 0\n", ["2:9: width must be from 1 to 65536, not 0"]);
broken!(too_many_rows, "[film]\nheight = 65537\n", ["2:10: height must be from 1 to 65536, not 65537"]);
broken!(negative_size, "[film]\nwidth = -640\n", ["2:9: width must be from 1 to 65536, not -640"]);
broken!(
    size_beyond_64_bits,
    "[film]\nwidth = 99999999999999999999\n",
    ["2:9: width must be from 1 to 65536, not 99999999999999999999"]
);
broken!(
    exposure_not_a_number,
    "[film]\nexposure = nan\n",
    ["2:12: exposure must be a finite number, not nan"]
);
broken!(
    exposure_out_of_range,
    "[film]\nexposure = 100\n",
    ["2:12: exposure must be from -64 to 64, not 100"]
);
broken!(
    filter_misspelt,
    r#"
[film]
filter = "tnet"
"#,
    [r#"2:10: unknown filter type "tnet"; did you mean "tent"?"#]
);
broken!(
    filter_of_a_later_version,
    r#"
[film]
filter = "gaussian"
"#,
    [r#"2:10: filter type "gaussian" comes in a later version; valid in this one: "none", "box", "tent""#]
);
broken!(
    filter_table_of_a_later_version,
    r#"
[film]
filter = { type = "lanczos", radius = 3 }
"#,
    [r#"2:19: filter type "lanczos" comes in a later version; valid in this one: "none", "box", "tent""#]
);
broken!(
    filter_without_type,
    "[film]\nfilter = { radius = 1 }\n",
    [r#"2:10: missing key "type" in filter; a filter is one of "none", "box", "tent""#]
);
broken!(
    filter_without_radius_to_set,
    r#"
[film]
filter = { type = "none", radius = 1 }
"#,
    [r#"2:27: unknown key "radius" in filter "none"; valid here: "type""#]
);
broken!(
    filter_radius_zero,
    r#"
[film]
filter = { type = "box", radius = 0 }
"#,
    ["2:35: radius must be above 0, not 0"]
);
broken!(
    filter_radius_too_large,
    r#"
[film]
filter = { type = "tent", radius = 16.5 }
"#,
    ["2:36: radius must be at most 16, not 16.5"]
);
broken!(
    filter_is_a_number,
    "[film]\nfilter = 1\n",
    [r#"2:10: filter must be a string or a table, not an integer; valid here: "none", "box", "tent""#]
);

// Camera.
broken!(
    forward_zero,
    "[camera]\nforward = [0, 0, 0]\n",
    ["2:11: forward must not be zero in all of x, y, z"]
);
broken!(
    up_parallel_to_forward,
    r#"
[camera]
forward = [0, 1, 0]
up = [0, 3, 0]
"#,
    ["3:6: up is parallel to the direction of view; up = [0, 0, 1] would do"]
);
broken!(
    up_against_forward,
    r#"
[camera]
forward = [0, 1, 0]
up = [0, -1, 0]
"#,
    ["3:6: up is parallel to the direction of view; up = [0, 0, 1] would do"]
);
broken!(
    forward_along_the_default_up,
    "[camera]\nforward = [0, 0, -1]\n",
    [
        "2:11: the direction of view is parallel to up, which is [0, 0, 1] unless the file says otherwise; up = [0, 1, 0] would do"
    ]
);
broken!(
    look_at_along_up,
    r#"
[camera]
eye = [1, 2, 3]
look_at = [1, 2, 9]
"#,
    [
        "3:11: the direction of view is parallel to up, which is [0, 0, 1] unless the file says otherwise; up = [0, 1, 0] would do"
    ]
);
broken!(
    look_at_is_eye,
    r#"
[camera]
eye = [1, 2, 3]
look_at = [1.0, 2.0, 3.0]
"#,
    ["3:11: look_at is the same point as eye: there is no direction of view"]
);
broken!(
    both_forward_and_look_at,
    r#"
[camera]
forward = [1, 0, 0]
look_at = [5, 0, 0]
"#,
    ["3:11: the camera has both forward and look_at; keep one of them"]
);
broken!(
    fov_zero,
    "[camera]\nvertical_fov = 0\n",
    ["2:16: vertical_fov must be above 0 and below 180, not 0"]
);
broken!(
    fov_straight,
    "[camera]\nvertical_fov = 180\n",
    ["2:16: vertical_fov must be above 0 and below 180, not 180"]
);
broken!(
    fov_straight_in_32_bits,
    "[camera]\nvertical_fov = 179.9999999999\n",
    ["2:16: vertical_fov must be above 0 and below 180, not 179.9999999999"]
);
broken!(near_negative, "[camera]\nnear = -1\n", ["2:8: near must be from 0 to 1e18, not -1"]);
broken!(focal_length_zero, "[camera]\nfocal_length = 0\n", ["2:16: focal_length must be above 0, not 0"]);
broken!(
    aperture_without_focus,
    "[camera]\naperture_radius = 0.1\n",
    [
        r#"2:19: missing key "focus_distance" in the camera: a lens needs one; give focus_distance, or take aperture_radius away for a pinhole"#
    ]
);
broken!(
    aperture_negative,
    r#"
[camera]
aperture_radius = -0.1
focus_distance = 3
"#,
    ["2:19: aperture_radius must be from 0 to 1e18, not -0.1"]
);
broken!(
    focus_distance_zero,
    r#"
[camera]
aperture_radius = 0.1
focus_distance = 0
"#,
    ["3:18: focus_distance must be above 0, not 0"]
);
broken!(eye_infinite, "[camera]\neye = [0, inf, 0]\n", ["2:11: y of eye must be a finite number, not inf"]);
broken!(
    eye_beyond_64_bits,
    "[camera]\neye = [0, 1e999, 0]\n",
    ["2:11: y of eye must be a finite number, not 1e999"]
);
broken!(
    eye_beyond_32_bits,
    "[camera]\neye = [0, 1e39, 0]\n",
    ["2:11: y of eye must be at most 3.4028234663852886e38, the largest that 32 bits hold, not 1e39"]
);
broken!(
    eye_beyond_the_limit,
    "[camera]\neye = [0, -2e18, 0]\n",
    ["2:11: y of eye must be from -1e18 to 1e18, not -2e18"]
);
broken!(
    eye_below_32_bits,
    "[camera]\neye = [0, 1e-60, 0]\n",
    ["2:11: y of eye is so small that 32 bits would round it to 0, not 1e-60"]
);

// Render.
broken!(
    integrator_misspelt,
    r#"
[render]
integrator = "Wihtted"
"#,
    [r#"2:14: unknown integrator "Wihtted"; did you mean "whitted"?"#]
);
broken!(
    integrator_unknown,
    r#"
[render]
integrator = "photon-map"
"#,
    [r#"2:14: unknown integrator "photon-map"; valid here: "whitted", "path", "path-naive""#]
);
broken!(
    sampler_unknown,
    "[render]\nsampler = \"halton\"\n",
    [r#"2:11: unknown sampler "halton"; valid here: "sobol", "independent""#]
);
broken!(no_samples, "[render]\nsamples = 0\n", ["2:11: samples must be from 1 to 4294967295, not 0"]);
broken!(
    too_many_samples,
    "[render]\nsamples = 4294967296\n",
    ["2:11: samples must be from 1 to 4294967295, not 4294967296"]
);
broken!(seed_negative, "[render]\nseed = -1\n", ["2:8: seed must be from 0 to 4294967295, not -1"]);
broken!(
    seed_too_large,
    "[render]\nseed = 4294967296\n",
    ["2:8: seed must be from 0 to 4294967295, not 4294967296"]
);
broken!(
    depth_too_large,
    "[render]\nmax_depth = 10001\n",
    ["2:13: max_depth must be from 0 to 10000, not 10001"]
);
broken!(
    depth_misspelt,
    "[render]\nmax_depth = \"unlimted\"\n",
    ["2:13: max_depth must be an integer or \"unlimited\", not \"unlimted\""]
);
broken!(
    depth_unlimited_without_roulette,
    "[render]\nintegrator = \"path-naive\"\nmax_depth = \"unlimited\"\n",
    ["3:13: max_depth can be \"unlimited\" only with integrator \"path\": no other plays Russian roulette"]
);
broken!(
    ambient_negative,
    r#"
[render]
integrator = "whitted"
ambient = [0, -0.5, 0]
"#,
    ["3:15: green of ambient must be from 0 to 1073741824, not -0.5"]
);

// Materials.
broken!(
    material_without_type,
    "[materials.a]\nreflectance = [1, 1, 1]\n",
    [
        r#"1:1: missing key "type" in materials.a; a material is one of "matte", "mirror", "glass", "checkerboard""#
    ]
);
broken!(
    material_type_unknown,
    r#"
[materials.a]
type = "plastic"
"#,
    [r#"2:8: unknown material type "plastic"; valid here: "matte", "mirror", "glass", "checkerboard""#]
);
broken!(
    material_type_misspelt,
    r#"
[materials.a]
type = "mate"
reflectance = [1, 1, 1]
"#,
    [r#"2:8: unknown material type "mate"; did you mean "matte"?"#]
);
broken!(
    material_type_empty,
    r#"
[materials.a]
type = ""
"#,
    ["2:8: type must not be empty"]
);
broken!(
    reflectance_missing,
    r#"
[materials.a]
type = "mirror"
"#,
    [r#"1:1: missing key "reflectance" in a mirror"#]
);
broken!(
    reflectance_above_one,
    r#"
[materials.a]
type = "matte"
reflectance = [0.5, 1.01, 0.5]
"#,
    ["3:21: green of reflectance must be from 0 to 1, not 1.01"]
);
broken!(
    reflectance_negative,
    r#"
[materials.a]
type = "matte"
reflectance = [0.5, 0.5, -0.1]
"#,
    ["3:26: blue of reflectance must be from 0 to 1, not -0.1"]
);
broken!(
    transmittance_above_one,
    r#"
[materials.a]
type = "glass"
ior = 1.5
transmittance = [2, 2, 2]
"#,
    [
        "4:18: red of transmittance must be from 0 to 1, not 2",
        "4:21: green of transmittance must be from 0 to 1, not 2",
        "4:24: blue of transmittance must be from 0 to 1, not 2"
    ]
);
broken!(
    ior_missing,
    r#"
[materials.a]
type = "glass"
"#,
    [r#"1:1: missing key "ior" in a glass"#]
);
broken!(
    ior_zero,
    r#"
[materials.a]
type = "glass"
ior = 0
"#,
    ["3:7: ior must be above 0, not 0"]
);
broken!(
    checkerboard_of_nothing,
    r#"
[materials.a]
type = "checkerboard"
even = "grey"
odd = "gray"
[materials.grey]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
"#,
    [r#"4:7: no material "gray"; did you mean "grey"?"#]
);
broken!(
    checkerboard_of_itself,
    with_grey(
        r#"
[materials.a]
type = "checkerboard"
even = "grey"
odd = "a"
"#
    ),
    ["7:7: checkerboard contains itself: a → a"]
);
broken!(
    checkerboards_in_a_cycle,
    r#"
[materials.a]
type = "checkerboard"
even = "b"
odd = "grey"
[materials.b]
type = "checkerboard"
even = "grey"
odd = "c"
[materials.c]
type = "checkerboard"
even = "a"
odd = "grey"
[materials.grey]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
"#,
    ["11:8: checkerboard contains itself: a → b → c → a"]
);
broken!(
    checkerboards_nested_too_deep,
    checkerboards(17),
    [r#"4:12: checkerboard "m0" is nested more than 16 deep"#]
);
broken!(
    checks_zero,
    with_grey(
        r#"
[materials.a]
type = "checkerboard"
even = "grey"
odd = "grey"
checks_per_unit = 0
"#
    ),
    ["8:19: checks_per_unit must be above 0, not 0"]
);
broken!(
    checks_negative_along_v,
    with_grey(
        r#"
[materials.a]
type = "checkerboard"
even = "grey"
odd = "grey"
checks_per_unit = [1, -1]
"#
    ),
    ["8:23: v of checks_per_unit must be above 0, not -1"]
);
broken!(
    checks_in_three_directions,
    with_grey(
        r#"
[materials.a]
type = "checkerboard"
even = "grey"
odd = "grey"
checks_per_unit = [1, 1, 1]
"#
    ),
    [
        "8:19: checks_per_unit must be a number, or an array of 2 numbers (along u, along v), not an array of 3"
    ]
);

// Entities.
broken!(
    entity_without_shape,
    with_grey(
        r#"
[[entities]]
material = "grey"
"#
    ),
    [r#"4:1: missing key "shape" in an entity"#]
);
broken!(
    entity_without_material,
    r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
"#,
    [r#"1:1: missing key "material" in an entity"#]
);
broken!(
    material_misspelt,
    r#"
[materials.red]
type = "matte"
reflectance = [1, 0, 0]

[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "rad"
"#,
    [r#"7:12: no material "rad"; did you mean "red"?"#]
);
broken!(
    material_unlike_any,
    with_grey(
        r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "marble"
"#
    ),
    [r#"6:12: no material "marble"; the materials are "grey""#]
);
broken!(
    material_where_there_is_none,
    r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "white"
"#,
    [r#"3:12: no material "white"; this file has no [materials.NAME]"#]
);
broken!(
    shape_without_type,
    entity("{ center = [0, 0, 0], radius = 1 }", ""),
    [r#"5:9: missing key "type" in shape; a shape is one of "plane", "sphere", "quad", "mesh""#]
);
broken!(
    shape_unknown,
    entity(r#"{ type = "cube" }"#, ""),
    [r#"5:18: unknown shape type "cube"; valid here: "plane", "sphere", "quad", "mesh""#]
);
broken!(
    shape_of_a_later_version,
    entity(r#"{ type = "disk", radius = 1 }"#, ""),
    [
        r#"5:18: shape type "disk" comes in a later version; valid in this one: "plane", "sphere", "quad", "mesh""#
    ]
);
broken!(mesh_without_file, entity(r#"{ type = "mesh" }"#, ""), [r#"5:9: missing key "file" in a mesh"#]);
broken!(
    mesh_file_missing_is_said_once,
    r#"
entities = [
    { shape = { type = "mesh", file = "no/dragon.ply" }, material = "grey" },
    { shape = { type = "mesh", file = "no/dragon.ply" }, material = "grey" },
]
materials = { grey = { type = "matte", reflectance = [0.5, 0.5, 0.5] } }
"#,
    ["2:39: no/dragon.ply: there is no such file"]
);
broken!(
    mesh_of_another_format,
    entity(r#"{ type = "mesh", file = "Cargo.toml" }"#, ""),
    ["5:33: Cargo.toml: a mesh file is a .ply or an .obj"]
);
broken!(
    transform_with_matrix_and_scale,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { scale = 2, matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] } }"#,
        ""
    ),
    ["5:76: the transform has a matrix and scale, rotate or translate; keep the matrix or the others"]
);
broken!(
    transform_that_flattens,
    entity(r#"{ type = "mesh", file = "a.ply", transform = { scale = [1, 0, 1] } }"#, ""),
    ["5:64: the transform makes everything flat"]
);
broken!(
    transform_matrix_that_flattens,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 5]] } }"#,
        ""
    ),
    ["5:65: the transform makes everything flat"]
);
broken!(
    transform_matrix_of_two_rows,
    entity(r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 0, 0, 0], [0, 1, 0, 0]] } }"#, ""),
    ["5:65: matrix must be an array of 3 rows of 4 numbers, not an array of 2"]
);
broken!(
    transform_matrix_of_three_columns,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] } }"#,
        ""
    ),
    ["5:66: the first row of matrix must be an array of 4 numbers, not an array of 3"]
);
broken!(
    radius_zero,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 0 }"#, ""),
    ["5:57: radius must be above 0, not 0"]
);
broken!(
    radius_negative,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = -1 }"#, ""),
    ["5:57: radius must be above 0, not -1"]
);
broken!(
    radius_not_a_number,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = nan }"#, ""),
    ["5:57: radius must be a finite number, not nan"]
);
broken!(
    radius_too_small,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1e-30 }"#, ""),
    ["5:57: radius must be at least 1e-18, not 1e-30"]
);
broken!(
    radius_missing,
    entity(r#"{ type = "sphere", center = [0, 0, 0] }"#, ""),
    [r#"5:9: missing key "radius" in a sphere"#]
);
broken!(
    normal_zero,
    entity(r#"{ type = "plane", normal = [0, 0.0, -0.0], distance = 1 }"#, ""),
    ["5:36: normal must not be zero in all of x, y, z"]
);
broken!(
    quad_edge_zero,
    entity(r#"{ type = "quad", corner = [0, 0, 0], u = [0, 0, 0], v = [0, 1, 0] }"#, ""),
    ["5:50: u must not be zero in all of x, y, z"]
);
broken!(
    quad_edges_parallel,
    entity(r#"{ type = "quad", corner = [0, 0, 0], u = [1, 2, 0], v = [-2, -4, 0] }"#, ""),
    ["5:65: v is parallel to u: the quad has no area"]
);
broken!(
    emission_negative,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "emission = [1, 1, -1]"),
    ["7:19: blue of emission must be from 0 to 1073741824, not -1"]
);
broken!(
    emission_above_the_film,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "emission = [2e9, 1, 1]"),
    ["7:13: red of emission must be from 0 to 1073741824, not 2e9"]
);
broken!(
    name_empty,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, r#"name = """#),
    ["7:8: name must not be empty"]
);

// Lights.
broken!(
    light_without_position,
    r#"
[[lights]]
type = "point"
intensity = [1, 1, 1]
"#,
    [r#"1:1: missing key "position" in a point light"#]
);
broken!(
    light_type_unknown,
    r#"
[[lights]]
type = "spot"
"#,
    [r#"2:8: unknown light type "spot"; valid here: "point""#]
);
broken!(
    light_intensity_infinite,
    r#"
[[lights]]
type = "point"
position = [0, 0, 0]
intensity = [inf, 1, 1]
"#,
    ["4:14: red of intensity must be a finite number, not inf"]
);
broken!(
    environment_negative,
    "[environment]\nradiance = [-1, 0, 0]\n",
    ["2:13: red of radiance must be from 0 to 1073741824, not -1"]
);

// Places.
broken!(
    columns_count_characters,
    r#"
[materials."größe ☃"]
type = "matte"
"ß☃" = 1
reflectance = [0.5, 0.5, 0.5]
[film]
filter = { "é" = 1, type = "box" }
"#,
    [
        r#"3:1: unknown key "ß☃" in a matte material; valid here: "type", "reflectance""#,
        r#"6:12: unknown key "é" in filter "box"; valid here: "type", "radius""#
    ]
);
broken!(
    windows_line_ends,
    "[film]\r\nwidth = 0\r\nheight = 0\r\n",
    ["2:9: width must be from 1 to 65536, not 0", "3:10: height must be from 1 to 65536, not 0"]
);
broken!(
    byte_order_mark,
    "\u{feff}widht = 0\n",
    [
        r#"1:1: unknown key "widht" in a scene file; valid here: "film", "camera", "render", "materials", "entities", "lights", "environment""#
    ]
);
broken!(
    all_errors_at_once,
    r#"
[film]
width = 0
hieght = 480
filter = "sinc"

[camera]
forward = [0, 0, 1]
aperture_radius = 0.1

[render]
integrator = "pth"

[materials.white]
type = "matte"
reflectance = [0.75, 0.75, 7.5]

[materials.floor]
type = "checkerboard"
even = "whit"
odd = "floor"
checks_per_unit = -1

[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 0 }
material = "wite"
emission = [nan, 0, 0]

[[lights]]
type = "point"
"#,
    [
        "2:9: width must be from 1 to 65536, not 0",
        r#"3:1: unknown key "hieght" in the film; did you mean "height"?"#,
        r#"4:10: unknown filter type "sinc"; valid here: "none", "box", "tent""#,
        "7:11: the direction of view is parallel to up, which is [0, 0, 1] unless the file says otherwise; up = [0, 1, 0] would do",
        r#"8:19: missing key "focus_distance" in the camera: a lens needs one; give focus_distance, or take aperture_radius away for a pinhole"#,
        r#"11:14: unknown integrator "pth"; did you mean "path"?"#,
        "15:28: blue of reflectance must be from 0 to 1, not 7.5",
        r#"19:8: no material "whit"; did you mean "white"?"#,
        "20:7: checkerboard contains itself: floor → floor",
        "21:19: checks_per_unit must be above 0, not -1",
        "24:57: radius must be above 0, not 0",
        r#"25:12: no material "wite"; did you mean "white"?"#,
        "26:13: red of emission must be a finite number, not nan",
        r#"28:1: missing key "position" in a point light"#,
        r#"28:1: missing key "intensity" in a point light"#
    ]
);
