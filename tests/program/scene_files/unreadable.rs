//! Files that cannot be read, or are no scenes.

use super::read;
use std::fs;
use std::path::Path;
use stride::scene::{load, parse};

/// Writes `bytes` to a file in a new folder and returns the message of loading it, without the folder's name.
fn load_bytes(bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.toml");
    fs::write(&path, bytes).expect("written");
    message(&path)
}

fn message(path: &Path) -> String {
    let errors = load(path).expect_err("a scene came of it");
    let folder = path.parent().expect("a folder").to_string_lossy().into_owned();
    errors.to_string().replace(&format!("{folder}{}", std::path::MAIN_SEPARATOR), "")
}

#[test]
fn a_missing_file_has_a_suggestion() {
    let folder = tempfile::tempdir().expect("a folder");
    assert_eq!(message(&folder.path().join("cover.toml")), "cover.toml: there is no such file");
    fs::write(folder.path().join("cover.toml"), "").expect("written");
    let hint = |name: &str| message(&folder.path().join(name));
    assert_eq!(hint("covre.toml"), "covre.toml: there is no such file; did you mean \"cover.toml\"?");
    assert_eq!(hint("cover"), "cover: there is no such file; did you mean \"cover.toml\"?");
    assert_eq!(hint("smallpt.toml"), "smallpt.toml: there is no such file");
}

#[test]
fn missing_meshes_and_pictures_have_suggestions() {
    let folder = tempfile::tempdir().expect("a folder");
    let parts = folder.path().join("parts");
    fs::create_dir(&parts).expect("made");
    for name in ["knot.ply", "knots.txt", "tiles.png"] {
        fs::write(parts.join(name), "").expect("written");
    }
    let told = |text: &str| {
        let scene = folder.path().join("a.toml");
        fs::write(&scene, text).expect("written");
        message(&scene)
    };
    let mesh = |file: &str| {
        told(&format!("[[entities]]\nshape = {{ type = \"mesh\", file = \"{file}\" }}\nmaterial = \"a\"\n"))
    };
    assert!(mesh("parts/knots.ply").contains("no such file; did you mean \"parts/knot.ply\"?"));
    assert!(!mesh("parts/torus.ply").contains("did you mean"));
    assert!(!mesh("parts/knot.ply").contains("did you mean"), "it is there, but no mesh");
    let picture = |file: &str| told(&format!("[environment]\nfile = \"{file}\"\n"));
    assert!(picture("parts/tlies.png").contains("no such file; did you mean \"parts/tiles.png\"?"));
}

#[test]
fn files_that_are_no_scenes_have_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, remedy) in [("knot.OBJ", "this is a mesh; "), ("a.pbrt", "this format is not read; ")] {
        let path = folder.path().join(name);
        fs::write(&path, "v 0 0 0\n").expect("written");
        let told = message(&path);
        assert!(told.starts_with(&format!("{name}: {remedy}")), "{told}");
    }
}

#[test]
fn a_folder_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scenes");
    fs::create_dir(&path).expect("made");
    assert_eq!(message(&path), "scenes: this is a folder; name a scene file, such as cover.toml, in it");
}

#[test]
fn a_path_through_a_file_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a"), "").expect("written");
    let message = message(&folder.path().join("a").join("b.toml"));
    assert!(message.starts_with("b.toml: "), "{message}");
}

#[cfg(unix)]
#[test]
fn a_file_without_permission_is_reported() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.toml");
    fs::write(&path, "").expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).expect("set");
    // The superuser can read every file.
    if fs::File::open(&path).is_err() {
        assert_eq!(message(&path), "a.toml: permission to read this file is denied");
    }
}

#[cfg(unix)]
#[test]
fn an_endless_file_is_rejected() {
    let errors = load("/dev/zero".as_ref()).expect_err("a scene came of it");
    let message =
        "/dev/zero: this file is larger than 16 MiB, the most that a scene file may be; is it a scene file?";
    assert_eq!(errors.to_string(), message);
}

#[test]
fn binary_data_is_rejected() {
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";
    let message = "a.toml: this is not a text file: byte 9 is zero; a scene file is TOML, in UTF-8";
    assert_eq!(load_bytes(png), message);
    assert_eq!(load_bytes(b"[film]\nwidth = 3\0"), message.replace("byte 9", "byte 17"));
}

#[test]
fn invalid_utf_8_is_reported() {
    let message = "a.toml:2:9: byte 17 of the file (0xe4) is not UTF-8; save it as UTF-8 in your editor";
    assert_eq!(load_bytes(b"[film]\n# \xc3\xa4 und \xe4\n"), message);
}

#[test]
fn utf_16_is_reported() {
    let utf16: Vec<u8> = "\u{feff}[film]".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let message = "a.toml: this file is UTF-16; a scene file is UTF-8; save it as UTF-8 in your editor";
    assert_eq!(load_bytes(&utf16), message);
}

#[test]
fn a_byte_order_mark_is_harmless() {
    assert_eq!(read("\u{feff}[film]\nwidth = 3").scene.film.width, 3);
}

#[test]
fn hostile_files_neither_crash_nor_hang() {
    // Dotted keys in inline tables: thousands of tables within each other, within the parser's own limit.
    let path = vec!["a"; 79].join(".");
    let deep = format!("a = {}1{}", format!("{{{path} = ").repeat(78), "}".repeat(78));
    let long = 2 << 20;
    let files = [
        deep,
        "[".repeat(long),
        format!("a = {}", "{a = ".repeat(long / 5)),
        "a.".repeat(long / 2),
        "=\n".repeat(long / 2),
        format!("a = [{}]", ",".repeat(1 << 19)),
        format!("lights = [{}]", "{},".repeat(long / 3)),
        "[[entities]]\n".repeat(long / 13),
        format!("[film]\nwidth = {}", "9".repeat(long)),
        format!("[materials.a]\ntype = \"{}\"", "x".repeat(long)),
        (0..20_000)
            .map(|i| format!("[materials.m{i}]\ntype = \"checkerboard\"\neven = \"m{}\"\n", i + 1))
            .collect(),
    ];
    for text in files {
        let errors = parse(&text, "box.toml".as_ref()).expect_err("a scene came of it");
        assert!(!errors.diagnostics().is_empty() && errors.diagnostics().len() <= 100);
        assert!(errors.to_string().len() < 100_000);
    }
}
