//! Textures, their files, and the materials that refer to them.

use super::*;
use std::fs;
use stride::scene::load;

/// A matte material in lines 1 to 3 whose reflectance is `value`, then `text`.
fn matte(value: &str, text: &str) -> String {
    format!("[materials.a]\ntype = \"matte\"\nreflectance = {value}\n{}", text.trim_start_matches('\n'))
}

/// A texture in lines 4 and 5, of this type, with these further lines.
fn texture(kind: &str, more: &str) -> String {
    matte("\"t\"", &format!("[textures.t]\ntype = \"{kind}\"\n{}", more.trim_start_matches('\n')))
}

broken!(
    texture_misspelt,
    matte("\"plank\"", "[textures.planks]\ntype = \"constant\"\nvalue = 1\n"),
    [r#"3:15: no texture "plank"; did you mean "planks"?"#]
);
broken!(
    texture_unknown,
    matte("\"x\"", "[textures.planks]\ntype = \"constant\"\nvalue = 1\n"),
    [r#"3:15: no texture "x"; the textures are "planks""#]
);
broken!(
    no_textures_at_all,
    matte("\"planks\"", ""),
    [r#"3:15: no texture "planks"; this file has no [textures.NAME]"#]
);
broken!(
    a_file_for_a_texture,
    matte("\"Floor tiles.PNG\"", ""),
    [
        r#"3:15: no texture "Floor tiles.PNG"; add [textures."Floor tiles"] with type = "image" and file = "Floor tiles.PNG", and name it: "Floor tiles""#
    ]
);
broken!(
    a_file_for_the_texture_of_that_name,
    matte("\"tiles.png\"", "[textures.tiles]\ntype = \"constant\"\nvalue = 1\n"),
    [r#"3:15: no texture "tiles.png"; did you mean "tiles"?"#]
);
broken!(
    a_hexadecimal_colour,
    matte("\"#ff8800\"", ""),
    [r##"3:15: no texture "#ff8800"; colours are linear [red, green, blue]: this one is [1.0, 0.246, 0.0]"##]
);
broken!(
    a_name_with_a_hash,
    matte("\"#ffg800\"", ""),
    [r##"3:15: no texture "#ffg800"; this file has no [textures.NAME]"##]
);
broken!(
    a_number_in_quotes_is_no_texture,
    matte("\"0.5\"", ""),
    ["3:15: reflectance must be an array of 3 numbers (red, green, blue), not a string; remove the quotes"]
);
broken!(
    texture_type_misspelt,
    texture("imag", "file = \"a.png\"\n"),
    [r#"5:8: unknown texture type "imag"; did you mean "image"?"#]
);
broken!(
    texture_key_misspelt,
    texture("checkerboard", "even = 1\nodd = 0\nchecks_per_unti = 2\n"),
    [r#"8:1: unknown key "checks_per_unti" in a checkerboard texture; did you mean "checks_per_unit"?"#]
);
broken!(
    texture_without_a_value,
    texture("constant", ""),
    [r#"4:1: missing key "value" in a constant texture"#]
);
broken!(
    value_of_another_type,
    texture("constant", "value = true\n"),
    [
        "6:9: value must be a number, an array of 3 numbers (red, green, blue) or the name of a texture, not a boolean"
    ]
);
broken!(
    value_out_of_range,
    texture("scale", "texture = [1, 2, -3]\nby = nan\n"),
    [
        "6:18: blue of texture must be from 0 to 1073741824, not -3",
        "7:6: by must be a finite number, not nan",
    ]
);
broken!(
    amount_out_of_range,
    texture("mix", "a = 0\nb = 1\namount = 1.5\n"),
    ["8:10: amount must be from 0 to 1, not 1.5"]
);
broken!(
    octaves_that_are_none,
    texture("noise", "octaves = 2.5\nroughness = 2\n"),
    [
        "6:11: octaves must be an integer, not a number with a point",
        "7:13: roughness must be from 0 to 1, not 2"
    ]
);
broken!(
    a_texture_that_contains_itself,
    texture("scale", "texture = \"u\"\nby = 2\n[textures.u]\ntype = \"mix\"\na = 0\nb = \"t\"\n"),
    ["11:5: scale contains itself: t → u → t"]
);
broken!(
    too_many_colours_wait,
    {
        let mix = |i: usize| {
            format!(
                "[textures.t{i}]\ntype = \"mix\"\na = 0\nb = 1\namount = {}\n",
                match i {
                    0 => "0.5".to_owned(),
                    i => format!("\"t{}\"", i - 1),
                }
            )
        };
        matte("\"t2\"", &(0..3).map(mix).collect::<String>())
    },
    [
        "14:11: texture \"t2\": textures are nested too deeply: it needs 7 values at a time, at most 6 are possible"
    ]
);
broken!(
    a_missing_file,
    texture("image", "file = \"nowhere.png\"\n"),
    ["6:8: nowhere.png: there is no such file"]
);
broken!(
    a_file_of_another_kind,
    texture("image", "file = \"README.md\"\n"),
    ["6:8: README.md: a picture is a .png, .jpg, .jpeg, .tga, .bmp, .tif, .tiff, .webp, .hdr or .exr"]
);
broken!(
    tiles_of_which_there_is_none,
    texture("image", "file = \"nowhere.<UDIM>.png\"\n"),
    ["6:8: nowhere.<UDIM>.png: there are no tiles from 1001 to 1999 with this name"]
);
broken!(
    a_file_that_is_no_name,
    texture("image", "file = 3\n"),
    ["6:8: file must be a string, not an integer"]
);
broken!(
    words_of_images_misspelt,
    texture(
        "image",
        "file = \"docs/pictures/cover.png\"\ncolor_space = \"sRGB\"\nwrap = [\"repeat\", \"mirrored\"]\nfilter = \"bilinear\"\n"
    ),
    [
        r#"7:15: unknown color_space "sRGB"; did you mean "srgb"?"#,
        r#"8:19: unknown wrap "mirrored"; did you mean "mirror"?"#,
        r#"9:10: unknown filter "bilinear"; did you mean "linear"?"#,
    ]
);
broken!(
    another_set_of_uv,
    texture("image", "file = \"docs/pictures/cover.png\"\nuv_set = 2\n"),
    ["7:10: uv_set must be from 0 to 1, not 2"]
);
broken!(
    flags_that_are_none,
    texture("image", "file = \"docs/pictures/cover.png\"\nmipmap = 1\n"),
    ["7:10: mipmap must be true or false, not an integer"]
);
broken!(
    what_can_be_no_texture,
    "[materials.a]\ntype = \"matte\"\nreflectance = [0, 0, 0]\n[materials.b]\ntype = \"checkerboard\"\neven = \"a\"\nodd = \"a\"\nchecks_per_unit = \"t\"\n[textures.t]\ntype = \"constant\"\nvalue = 1\n",
    ["8:19: checks_per_unit must be a number, or an array of 2 numbers (along u, along v), not a string"]
);
broken!(
    shapes_take_no_textures,
    entity(
        "{ type = \"sphere\", center = [0, 0, 0], radius = \"t\" }",
        "[textures.t]\ntype = \"constant\"\nvalue = 1\n"
    ),
    ["5:57: radius must be a number, not a string"]
);

/// The CRC-32 of a chunk of a PNG file.
fn png_checksum(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |mut crc, byte| {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        }
        crc
    })
}

#[test]
fn unreadable_files_are_reported_at_their_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let png = fs::read("docs/pictures/cover.png").expect("a picture");
    fs::write(folder.path().join("half.png"), &png[..png.len() / 2]).expect("written");
    fs::write(folder.path().join("text.exr"), "no picture").expect("written");
    let mut lies = png.clone();
    // A width of 70,000 in the header, and its checksum.
    lies[16..20].copy_from_slice(&70_000_u32.to_be_bytes());
    let checksum = png_checksum(&lies[12..29]);
    lies[29..33].copy_from_slice(&checksum.to_be_bytes());
    fs::write(folder.path().join("lies.png"), &lies).expect("written");
    fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    let image = |name: &str| format!("[textures.{name}]\ntype = \"image\"\nfile = \"{name}\"\n");
    let quoted = |name: &str| image(name).replacen(name, &format!("\"{name}\""), 1);
    let names = ["half.png", "text.exr", "lies.png", "folder.png"];
    let path = folder.path().join("box.toml");
    fs::write(&path, names.map(quoted).concat()).expect("written");
    let told = load(&path).expect_err("a scene came of it").to_string();
    let lines: Vec<_> = told.lines().collect();
    assert_eq!(lines.len(), 4, "{told}");
    for ((line, name), number) in lines.iter().zip(names).zip([3, 6, 9, 12]) {
        assert!(line.contains(&format!("box.toml:{number}:8: ")) && line.contains(name), "{line}");
    }
    assert!(lines[0].contains("this is not a complete PNG file"), "{}", lines[0]);
    assert!(lines[1].contains("this is not a complete EXR file"), "{}", lines[1]);
    let limits = "a picture of 70000×240 texels is larger than the limits of 65536 a side and 1 GiB";
    assert!(lines[2].ends_with(limits), "{}", lines[2]);
    assert!(lines[3].ends_with("this is a folder"), "{}", lines[3]);
}

#[test]
fn a_file_is_read_and_reported_once() {
    let two = "[textures.t]\ntype = \"image\"\nfile = \"docs/pictures/cover.png\"\n[textures.u]\ntype = \"image\"\nfile = \"docs/pictures/cover.png\"\nwrap = [\"clamp\", \"black\"]\n";
    let loaded = parse(two, "box.toml".as_ref()).expect("a scene");
    assert_eq!((loaded.scene.images.len(), loaded.scene.textures.len()), (1, 2));
    let unused: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert!(
        unused[..]
            .iter()
            .any(|told| told.contains("texture \"u\" is not used; no material or emission uses it")),
        "{unused:?}"
    );
    let errors = parse(&two.replace("cover", "nothing"), "box.toml".as_ref()).expect_err("no file");
    assert_eq!(errors.to_string().lines().count(), 1);
}
