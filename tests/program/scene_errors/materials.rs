//! Materials.

use super::*;

broken!(
    material_without_type,
    "[materials.a]\nreflectance = [1, 1, 1]\n",
    [
        r#"1:1: missing key "type" in materials.a; a material is one of "matte", "mirror", "glass", "conductor", "dielectric", "checkerboard", "mix""#
    ]
);
broken!(
    material_type_unknown,
    r#"
[materials.a]
type = "velvet"
"#,
    [
        r#"2:8: unknown material type "velvet"; valid here: "matte", "mirror", "glass", "conductor", "dielectric", "checkerboard", "mix""#
    ]
);
broken!(
    material_type_without_a_counterpart,
    r#"
[materials.a]
type = "principled"
"#,
    [
        r#"2:8: unknown material type "principled"; there is no layered material: use "conductor" for metal, "dielectric" for glass, and "matte" or a "mix" for the rest"#
    ]
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
    [r#"4:12: checkerboard "m0" is nested more than 16 levels deep"#]
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

broken!(
    conductor_of_nothing,
    r#"
[materials.a]
type = "conductor"
"#,
    ["1:1: a conductor needs either metal or both eta and k; for example: metal = \"gold\""]
);
broken!(
    conductor_of_an_unknown_metal,
    r#"
[materials.a]
type = "conductor"
metal = "golld"
"#,
    [r#"3:9: unknown metal "golld"; did you mean "gold"?"#]
);
broken!(
    conductor_of_a_metal_that_is_a_number,
    r#"
[materials.a]
type = "conductor"
metal = 79
"#,
    ["3:9: metal must be a string, not an integer"]
);
broken!(
    conductor_of_two_kinds,
    r#"
[materials.a]
type = "conductor"
metal = "gold"
eta = [1, 1, 1]
k = [1, 1, 1]
"#,
    ["4:7: the conductor has both metal and eta; keep one of them"]
);
broken!(
    conductor_with_a_metal_and_k,
    r#"
[materials.a]
type = "conductor"
metal = "gold"
k = [1, 1, 1]
"#,
    ["4:5: the conductor has both metal and k; keep one of them"]
);
broken!(
    conductor_without_k,
    r#"
[materials.a]
type = "conductor"
eta = [1, 1, 1]
"#,
    ["3:7: the conductor has eta but no k; give both"]
);
broken!(
    conductor_without_eta,
    r#"
[materials.a]
type = "conductor"
k = [1, 1, 1]
"#,
    ["3:5: the conductor has k but no eta; give both"]
);
broken!(
    conductor_with_eta_of_zero,
    r#"
[materials.a]
type = "conductor"
eta = [0, 1, 1]
k = [1, 1, -1]
"#,
    ["3:8: red of eta must be above 0, not 0", "4:12: blue of k must be from 0 to 1000, not -1"]
);
broken!(
    conductor_with_metal_misspelt,
    r#"
[materials.a]
type = "conductor"
metl = "gold"
"#,
    [r#"3:1: unknown key "metl" in a conductor; did you mean "metal"?"#]
);
broken!(
    conductor_with_a_key_that_there_is_not,
    r#"
[materials.a]
type = "conductor"
metal = "gold"
reflectance = [1, 1, 1]
"#,
    [
        r#"4:1: unknown key "reflectance" in a conductor; a metal that reflects the fraction R has eta = [1, 1, 1] and k = 2·√(R / (1 − R)), for each channel"#
    ]
);
broken!(
    dielectric_with_a_colour,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
tint = [1, 1, 1]
"#,
    [
        r#"4:1: unknown key "tint" in a dielectric; valid here: "type", "ior", "roughness", "absorption", "priority", "thin_walled", "reflectance", "transmittance", "opacity", "back", "normal_map", "normal_scale", …"#
    ]
);
broken!(
    dielectric_with_a_negative_absorption,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
absorption = [1, -0.5, 1]
"#,
    ["4:18: green of absorption must be from 0 to 1e18, not -0.5"]
);
broken!(
    dielectric_with_an_absorption_without_colours,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
absorption = 0.5
"#,
    ["4:14: absorption must be an array of 3 numbers (red, green, blue), not a number with a point"]
);
broken!(
    dielectric_with_an_infinite_absorption,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
absorption = [0, 0, inf]
"#,
    ["4:21: blue of absorption must be a finite number, not inf"]
);
broken!(
    dielectric_with_a_texture_inside,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
absorption = "t"
[textures.t]
type = "constant"
value = 1
"#,
    ["4:14: absorption of a dielectric cannot be a texture"]
);
broken!(
    dielectric_whose_priority_is_not_whole,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
priority = 1.5
"#,
    ["4:12: priority must be an integer, not a number with a point"]
);
broken!(
    dielectric_with_a_negative_priority,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
priority = -1
"#,
    ["4:12: priority must be from 0 to 1000, not -1"]
);
broken!(
    thin_dielectric_with_absorption,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
absorption = [0, 0.5, 0]
thin_walled = true
"#,
    ["4:14: a thin-walled dielectric has no inside that could absorb; remove it, or remove thin_walled"]
);
broken!(
    thin_dielectric_with_a_priority,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
priority = 2
thin_walled = true
"#,
    [
        "4:12: a thin-walled dielectric has no inside that could overlap others; remove it, or remove thin_walled"
    ]
);
broken!(
    index_of_refraction_that_varies_beside_priorities,
    r#"
[materials.a]
type = "glass"
ior = "t"
[materials.b]
type = "dielectric"
ior = 1.5
priority = 2
[textures.t]
type = "constant"
value = 1.5
"#,
    ["3:7: ior of a glass cannot be a texture if any dielectric has a priority"]
);
broken!(
    smooth_glass_with_absorption,
    r#"
[materials.a]
type = "glass"
ior = 1.5
absorption = [1, 1, 1]
"#,
    [
        r#"4:1: unknown key "absorption" in a glass; valid here: "type", "ior", "reflectance", "transmittance", "opacity", "back", "normal_map", "normal_scale", "bump_map", "bump_scale""#
    ]
);
broken!(
    conductor_that_is_too_rough,
    r#"
[materials.a]
type = "conductor"
metal = "gold"
roughness = 1.5
"#,
    ["4:13: roughness must be from 0 to 1, not 1.5"]
);
broken!(
    conductor_with_a_negative_roughness_along_v,
    r#"
[materials.a]
type = "conductor"
metal = "gold"
roughness = [0.5, -0.5]
"#,
    ["4:19: v of roughness must be from 0 to 1, not -0.5"]
);

broken!(
    matte_that_is_too_rough,
    r#"
[materials.a]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
roughness = 2
"#,
    ["4:13: roughness must be from 0 to 1, not 2"]
);
broken!(
    matte_that_is_rough_along_two_axes,
    r#"
[materials.a]
type = "matte"
reflectance = [0.5, 0.5, 0.5]
roughness = [0.1, 0.2]
"#,
    ["4:13: roughness must be a number, not an array"]
);
broken!(
    dielectric_without_ior,
    r#"
[materials.a]
type = "dielectric"
roughness = 0.3
"#,
    [r#"1:1: missing key "ior" in a dielectric"#]
);
broken!(
    dielectric_with_an_ior_of_zero,
    r#"
[materials.a]
type = "dielectric"
ior = 0
"#,
    ["3:7: ior must be above 0, not 0"]
);
broken!(
    dielectric_that_is_thin_by_a_number,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
thin_walled = 1
"#,
    ["4:15: thin_walled must be true or false, not an integer"]
);
broken!(
    dielectric_with_a_negative_roughness,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
roughness = -0.1
"#,
    ["4:13: roughness must be from 0 to 1, not -0.1"]
);
broken!(
    dielectric_with_a_tint_above_one,
    r#"
[materials.a]
type = "dielectric"
ior = 1.5
transmittance = [1, 1, 1.5]
"#,
    ["4:24: blue of transmittance must be from 0 to 1, not 1.5"]
);
