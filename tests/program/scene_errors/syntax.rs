//! Invalid TOML, and the positions of errors.

use super::*;

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
    brace_not_closed,
    r#"
camera = { eye = [0, -6, 2.5], look_at = [0, 0, 0.9]
environment = { radiance = [0.15, 0.2, 0.3] }
[materials]
white = { type = "matte", reflectance = [0.8, 0.8, 0.8] }
"#,
    [
        "2:1: this is not TOML: missing comma between key-value pairs, expected `,`, or `}` for the `{` in line 1, column 10"
    ]
);
broken!(
    the_first_of_two_syntax_errors,
    r#"
[film]
width = = 3
height = tall
"#,
    ["2:9: this is not TOML: extra `=`, expected nothing"]
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

// Positions.
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
        r#"3:1: unknown key "ß☃" in a matte material; valid here: "type", "reflectance", "roughness", "opacity", "back", "normal_map", "normal_scale", "bump_map", "bump_scale""#,
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
        r#"1:1: unknown key "widht" in a scene file; valid here: "film", "camera", "render", "textures", "materials", "entities", "groups", "instances", "lights", "environment""#
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
        r#"4:10: unknown filter type "sinc"; valid here: "none", "box", "tent", "gaussian", "mitchell", "blackman-harris", "lanczos""#,
        "7:11: the viewing direction is parallel to up, whose default is [0, 0, 1]; up = [0, 1, 0] would do",
        r#"8:19: missing key "focus_distance" in the camera, which a lens needs; add focus_distance, or remove aperture_radius for a pinhole"#,
        r#"11:14: unknown integrator "pth"; did you mean "path"?"#,
        "15:28: blue of reflectance must be from 0 to 1, not 7.5",
        r#"19:8: no material "whit"; did you mean "white"?"#,
        "20:7: checkerboard contains itself: floor → floor",
        "21:19: checks_per_unit must be above 0, not -1",
        "24:57: radius must be above 0, not 0",
        r#"25:12: no material "wite"; did you mean "white"?"#,
        "26:13: red of emission must be a finite number, not nan",
        r#"28:1: missing key "position" in a point light"#,
        "28:1: a point light needs either intensity or power; for example: intensity = [1, 1, 1]"
    ]
);
