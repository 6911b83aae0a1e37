//! Lights that are no surfaces.

use super::*;

/// A spot with these keys in line 5.
fn spot(keys: &str) -> String {
    format!("[[lights]]\ntype = \"spot\"\nposition = [0, 0, 4]\ndirection = [0, 0, -1]\n{keys}\n")
}

/// A directional light with these keys in line 3.
fn directional(keys: &str) -> String {
    format!("[[lights]]\ntype = \"directional\"\n{keys}\n")
}

broken!(
    directional_without_anything,
    directional(""),
    [
        r#"1:1: missing key "direction" in a directional light"#,
        r#"1:1: missing key "irradiance" in a directional light"#
    ]
);
broken!(
    directional_towards_nothing,
    directional("direction = [0, 0, 0]\nirradiance = [1, 1, 1]"),
    ["3:13: direction must not be zero in all of x, y, z"]
);
broken!(
    directional_of_negative_irradiance,
    directional("direction = [0, 0, -1]\nirradiance = [1, 1, -1]"),
    ["4:21: blue of irradiance must be from 0 to 1073741824, not -1"]
);
broken!(
    directional_with_a_radiance,
    directional("direction = [0, 0, -1]\nirradiance = [1, 1, 1]\nradiance = [1, 1, 1]"),
    [r#"5:1: unknown key "radiance" in a directional light; did you mean "irradiance"?"#]
);
broken!(
    directional_wider_than_the_sky,
    directional("direction = [0, 0, -1]\nirradiance = [1, 1, 1]\nangular_diameter = 181"),
    ["5:20: angular_diameter must be from 0 to 180, not 181"]
);
broken!(
    directional_with_intensity,
    directional("direction = [0, 0, -1]\nintensity = [1, 1, 1]"),
    [
        r#"1:1: missing key "irradiance" in a directional light"#,
        r#"4:1: unknown key "intensity" in a directional light; valid here: "type", "direction", "irradiance", "angular_diameter""#
    ]
);
broken!(
    spot_without_intensity,
    spot(""),
    ["1:1: a spot light needs either intensity or power; for example: intensity = [1, 1, 1]"]
);
broken!(
    spot_with_both,
    spot("intensity = [1, 1, 1]\npower = [1, 1, 1]"),
    ["6:9: a spot light has both intensity and power; keep one of them"]
);
broken!(
    spot_of_too_much_power,
    spot("power = [1e35, 1e36, 0]\ncone_angle = 1\npenumbra_angle = 0"),
    ["5:9: power gives an intensity of 1.04e38 W/sr, above 1e36; give less power, or a wider cone"]
);
broken!(
    spot_without_a_cone,
    spot("intensity = [1, 1, 1]\ncone_angle = 0"),
    ["6:14: cone_angle must be from 0.01 to 180, not 0"]
);
broken!(
    spot_with_a_penumbra_wider_than_its_cone,
    spot("intensity = [1, 1, 1]\ncone_angle = 20\npenumbra_angle = 25"),
    ["7:18: penumbra_angle, 25, is above cone_angle, 20; the penumbra lies within the cone"]
);
#[test]
fn a_narrow_spot_has_only_penumbra_by_default() {
    let narrow = |more: &str| {
        let text = spot(&format!("intensity = [1, 1, 1]\ncone_angle = 3{more}"));
        parse(&text, "box.toml".as_ref()).unwrap_or_else(|error| panic!("{error}")).scene.lights
    };
    assert_eq!(narrow(""), narrow("\npenumbra_angle = 3"));
    assert_ne!(narrow(""), narrow("\npenumbra_angle = 2"));
}
broken!(
    spot_with_a_negative_penumbra,
    spot("intensity = [1, 1, 1]\npenumbra_angle = -1"),
    ["6:18: penumbra_angle must be from 0 to 180, not -1"]
);
broken!(
    spot_with_a_falloff_that_there_is_not,
    spot("intensity = [1, 1, 1]\nfalloff = \"linear\""),
    [r#"6:11: unknown falloff "linear"; valid here: "smoothstep", "angle", "squared""#]
);
broken!(
    spot_with_a_falloff_that_is_no_word,
    spot("intensity = [1, 1, 1]\nfalloff = 2"),
    ["6:11: falloff must be a string, not an integer"]
);
broken!(
    point_with_both,
    "[[lights]]\ntype = \"point\"\nposition = [0, 0, 4]\nintensity = [1, 1, 1]\npower = [1, 1, 1]\n",
    ["5:9: a point light has both intensity and power; keep one of them"]
);
broken!(
    point_of_negative_power,
    "[[lights]]\ntype = \"point\"\nposition = [0, 0, 4]\npower = [1, -1, 1]\n",
    ["4:13: green of power must be from 0 to 1e36, not -1"]
);
