//! Environments and their pictures.

use super::*;
use std::fs;
use stride::scene::load;

/// An environment with these keys from line 2 on.
fn environment(keys: &str) -> String {
    format!("[environment]\n{keys}\n")
}

broken!(
    a_picture_and_a_radiance,
    environment("radiance = [1, 1, 1]\nfile = \"docs/pictures/cover.png\""),
    ["2:12: the environment has both radiance and file; keep one of them"]
);
broken!(
    a_picture_that_is_not_there,
    environment("file = \"nowhere.exr\""),
    ["2:8: nowhere.exr: there is no such file"]
);
broken!(
    a_picture_that_is_none,
    environment("file = \"README.md\""),
    ["2:8: README.md: a picture is a .png, .jpg, .jpeg, .tga, .bmp, .tif, .tiff, .webp, .hdr or .exr"]
);
broken!(
    a_picture_that_is_a_folder,
    environment("file = \"docs\""),
    ["2:8: docs: a picture is a .png, .jpg, .jpeg, .tga, .bmp, .tif, .tiff, .webp, .hdr or .exr"]
);
broken!(
    a_picture_of_tiles,
    environment("file = \"sky.<UDIM>.exr\""),
    [r#"2:8: the environment needs a single picture, but "<UDIM>" stands for several"#]
);
broken!(a_picture_without_a_name, environment("file = \"\""), ["2:8: file must not be empty"]);
broken!(a_picture_that_is_a_number, environment("file = 7"), ["2:8: file must be a string, not an integer"]);
broken!(
    up_of_no_length,
    environment("file = \"docs/pictures/cover.png\"\nup = [0, 0, 0]"),
    ["3:6: up must not be zero in all of x, y, z"]
);
broken!(
    a_negative_scale,
    environment("file = \"docs/pictures/cover.png\"\nscale = -1"),
    ["3:9: scale must be from 0 to 1073741824, not -1"]
);
broken!(
    a_negative_channel_of_a_scale,
    environment("file = \"docs/pictures/cover.png\"\nscale = [1, -2, 1]"),
    ["3:13: green of scale must be from 0 to 1073741824, not -2"]
);
broken!(
    a_scale_that_is_too_large,
    environment("file = \"docs/pictures/cover.png\"\nscale = 2e9"),
    ["3:9: scale must be from 0 to 1073741824, not 2e9"]
);
broken!(
    a_scale_that_is_a_word,
    environment("file = \"docs/pictures/cover.png\"\nscale = \"bright\""),
    ["3:9: scale must be a number, or an array of 3 numbers (red, green, blue), not a string"]
);
broken!(
    a_turn_that_is_none,
    environment("file = \"docs/pictures/cover.png\"\nrotate = nan"),
    ["3:10: rotate must be a finite number, not nan"]
);
broken!(
    keys_of_a_picture_that_is_not_there,
    environment("radiance = [1, 1, 1]\nscale = 2\nrotate = 90\nup = [0, 1, 0]"),
    [
        "3:9: scale applies to a picture, and the environment has none; add a picture with file, or remove scale",
        "4:10: rotate applies to a picture, and the environment has none; add a picture with file, or remove rotate",
        "5:6: up applies to a picture, and the environment has none; add a picture with file, or remove up",
    ]
);
broken!(
    a_misspelt_picture,
    environment("fil = \"docs/pictures/cover.png\"\nscale = 2"),
    [r#"2:1: unknown key "fil" in the environment; did you mean "file"?"#]
);
broken!(
    a_misspelt_turn,
    environment("file = \"docs/pictures/cover.png\"\nrotat = 90"),
    [r#"3:1: unknown key "rotat" in the environment; did you mean "rotate"?"#]
);

#[test]
fn unreadable_pictures_are_reported_at_their_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("box.toml");
    let told = |name: &str, bytes: &[u8]| {
        fs::write(folder.path().join(name), bytes).expect("written");
        fs::write(&path, environment(&format!("file = \"{name}\""))).expect("written");
        load(&path).expect_err("a scene came of it").to_string()
    };
    let png = fs::read("docs/pictures/cover.png").expect("a picture");
    let half = told("half.png", &png[..png.len() / 2]);
    assert!(half.contains("box.toml:2:8: ") && half.contains("this is not a complete PNG file"), "{half}");
    let whole = folder.path().join("whole.exr");
    exr::prelude::write_rgb_file(&whole, 64, 32, |x, y| (x as f32, y as f32, 1.0)).expect("written");
    let exr = fs::read(&whole).expect("a picture");
    for (name, bytes) in [("half.exr", &exr[..exr.len() / 2]), ("text.exr", &b"no picture"[..])] {
        let told = told(name, bytes);
        assert!(
            told.contains("box.toml:2:8: ") && told.contains("this is not a complete EXR file"),
            "{told}"
        );
    }
    let empty = told("empty.hdr", b"");
    assert!(
        empty.contains("box.toml:2:8: ") && empty.contains("this is not a complete Radiance HDR file"),
        "{empty}"
    );
}

#[test]
fn pictures_of_any_size_are_accepted_and_invalid_numbers_counted() {
    let read = |keys: &str| {
        let text = environment(keys);
        parse(&text, "box.toml".as_ref()).unwrap_or_else(|errors| panic!("{errors}"))
    };
    let loaded = read("file = \"docs/pictures/cover.png\"\nscale = [1, 2, 3]\nrotate = -90\nup = [0, 2, 0]");
    let picture = loaded.scene.environment_picture.expect("a picture");
    assert_eq!((picture.scale, picture.up.to_array()), ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0]));
    assert!((picture.rotate + std::f64::consts::FRAC_PI_2).abs() < 1e-12);

    let folder = tempfile::tempdir().expect("a folder");
    let numbers = [-1.0, 2.0, f32::NAN, 3.0, -0.0, f32::INFINITY, -2.0, 0.0, 1.0];
    let texel = |x: usize, _| (numbers[3 * x], numbers[3 * x + 1], numbers[3 * x + 2]);
    exr::prelude::write_rgb_file(folder.path().join("odd.exr"), 3, 1, texel).expect("written");
    let path = folder.path().join("box.toml");
    fs::write(&path, environment("file = \"odd.exr\"")).expect("written");
    let warnings = load(&path).expect("a scene").warnings;
    let odd = "odd.exr has 2 numbers that are negative and 2 numbers that are not finite; negative numbers and NaN are replaced by 0, and infinity by the maximum";
    assert!(warnings.iter().any(|warning| warning.to_string().ends_with(odd)), "{warnings:?}");
}
