//! Film, camera, render.

use super::*;

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
    tone_unknown,
    "[film]\ntone = \"filmik\"\n",
    ["2:8: unknown tone curve \"filmik\"; did you mean \"filmic\"?"]
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
    a_filter_that_is_negative_in_places_cannot_be_drawn_from,
    r#"
[film]
filter = { type = "lanczos", radius = 3 }
mode = "importance"
"#,
    [
        r#"3:8: this filter has negative lobes, from which samples cannot be drawn: it needs mode "continuous""#
    ]
);
broken!(
    a_continuous_film_without_a_filter,
    r#"
[film]
mode = "continuous"
filter = "none"
"#,
    [r#"2:8: filter "none" samples only pixel centres: mode "continuous" needs a filter with a radius"#]
);
broken!(
    a_continuous_film_with_gaps,
    r#"
[film]
filter = { type = "mitchell", radius = 0.4 }
"#,
    [
        r#"2:10: with mode "continuous" a filter's radius must be at least 0.5, or some samples would reach no pixel"#
    ]
);
broken!(
    filter_without_type,
    "[film]\nfilter = { radius = 1 }\n",
    [
        r#"2:10: missing key "type" in filter; a filter is one of "none", "box", "tent", "gaussian", "mitchell", "blackman-harris", "lanczos""#
    ]
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
    [
        r#"2:10: filter must be a string or a table, not an integer; valid here: "none", "box", "tent", "gaussian", "mitchell", "blackman-harris", "lanczos""#
    ]
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
    ["3:6: up is parallel to the viewing direction; up = [0, 0, 1] would do"]
);
broken!(
    up_against_forward,
    r#"
[camera]
forward = [0, 1, 0]
up = [0, -1, 0]
"#,
    ["3:6: up is parallel to the viewing direction; up = [0, 0, 1] would do"]
);
broken!(
    forward_along_the_default_up,
    "[camera]\nforward = [0, 0, -1]\n",
    ["2:11: the viewing direction is parallel to up, whose default is [0, 0, 1]; up = [0, 1, 0] would do"]
);
broken!(
    look_at_along_up,
    r#"
[camera]
eye = [1, 2, 3]
look_at = [1, 2, 9]
"#,
    ["3:11: the viewing direction is parallel to up, whose default is [0, 0, 1]; up = [0, 1, 0] would do"]
);
broken!(
    look_at_is_eye,
    r#"
[camera]
eye = [1, 2, 3]
look_at = [1.0, 2.0, 3.0]
"#,
    ["3:11: look_at equals eye, which gives no viewing direction"]
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
        r#"2:19: missing key "focus_distance" in the camera, which a lens needs; add focus_distance, or remove aperture_radius for a pinhole"#
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
    [r#"2:11: unknown sampler "halton"; there is "sobol", which is pbrt's paddedsobol, and "independent""#]
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
    ["3:13: max_depth can be \"unlimited\" only with integrator \"path\": no other uses Russian roulette"]
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
broken!(
    camera_of_an_unknown_type,
    "[camera]\ntype = \"ortographic\"\nheight = 4\n",
    [r#"2:8: unknown type "ortographic"; did you mean "orthographic"?"#]
);
broken!(
    orthographic_without_height,
    "[camera]\ntype = \"orthographic\"\n",
    [r#"2:8: missing key "height" in the camera, which an orthographic camera needs"#]
);
broken!(
    orthographic_of_no_height,
    "[camera]\ntype = \"orthographic\"\nheight = 0\n",
    ["3:10: height must be above 0, not 0"]
);
broken!(
    orthographic_with_a_field_of_view,
    "[camera]\ntype = \"orthographic\"\nheight = 4\nvertical_fov = 40\n",
    ["4:16: an orthographic camera has height instead of vertical_fov; remove vertical_fov"]
);
broken!(
    perspective_with_a_height,
    "[camera]\nheight = 4\n",
    ["2:10: height is a key of an orthographic camera; use vertical_fov, or set type = \"orthographic\""]
);
