//! `stride compare`, by the command line.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use stride::film::Picture;
use stride::output::{PictureOptions, write_picture};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A small picture with a ramp, multiplied by `gain`.
    fn picture(&self, name: &str, width: u32, height: u32, gain: f32) -> PathBuf {
        let rgb = (0..width * height).map(|i| [i as f32 / 64.0 * gain, 0.5 * gain, 0.25 * gain]).collect();
        self.write(name, &Picture { width, height, rgb })
    }

    fn write(&self, name: &str, picture: &Picture) -> PathBuf {
        let path = self.path(name);
        write_picture(&path, picture, &PictureOptions::default()).unwrap();
        path
    }
}

#[test]
fn noise_is_relative_to_the_brightness_of_the_second_picture() {
    let folder = Folder::new();
    let figures = |scale: f32| {
        let name = |which: &str| format!("{which}-{scale}.exr");
        let a = folder.picture(&name("a"), 16, 16, scale);
        let b = folder.picture(&name("b"), 16, 16, 1.25 * scale);
        let found = json(&a, &b);
        ["relmse", "relmse_scaled", "noise"].map(|figure| found[figure].as_f64().unwrap())
    };
    let [relmse, scaled, noise] = figures(1.0);
    for scale in [2.0_f32.powi(-20), 2.0_f32.powi(12)] {
        let found = figures(scale);
        assert_eq!(found[1..], [scaled, noise], "{scale}");
        assert_ne!(found[0], relmse, "{scale}");
    }
}

fn compare(arguments: &[&Path]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stride")).arg("compare").args(arguments).output().unwrap()
}

fn json(a: &Path, b: &Path) -> serde_json::Value {
    let output = compare(&[a, b, "--json".as_ref()]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checks that the command fails with this code and message, and prints nothing.
fn refused(arguments: &[&Path], code: i32, words: &[&str]) {
    let output = compare(arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(output.stdout.is_empty());
    for word in words {
        assert!(said.contains(word), "{word:?} is not in {said:?}");
    }
}

#[test]
fn equal_pictures_have_no_error_in_any_format() {
    let folder = Folder::new();
    for name in ["a.png", "a.exr", "a.hdr"] {
        let path = folder.picture(name, 8, 8, 1.0);
        let found = json(&path, &path);
        for figure in ["mse", "relmse", "relmse_scaled", "noise", "flip"] {
            assert_eq!(found[figure], 0.0, "{name} {figure}");
        }
        assert_eq!(found["flip_kind"], if name == "a.png" { "ldr" } else { "hdr" });
        assert_eq!((&found["width"], &found["compared_pixels"]), (&8.into(), &64.into()));
    }
}

#[test]
fn figures_match_their_definitions() {
    let folder = Folder::new();
    let flat = |value: f32| Picture { width: 4, height: 2, rgb: vec![[value, 0.0, 0.0]; 8] };
    let (a, b) = (folder.write("a.exr", &flat(1.5)), folder.write("b.exr", &flat(1.0)));
    let found = json(&a, &b);
    let close = |value: &serde_json::Value, expected: f64| {
        assert!((value.as_f64().unwrap() - expected).abs() < 1e-12, "{value} is not {expected}");
    };
    close(&found["mse"], 0.25 / 3.0);
    close(&found["relmse"], 0.25 / 1.01 / 3.0);
    // The brightness of b is a third, of all channels together.
    close(&found["brightness"], 1.0 / 3.0);
    let scaled = 0.25 / (1.0 + 0.01 / 9.0) / 3.0;
    close(&found["relmse_scaled"], scaled);
    close(&found["noise"], scaled.sqrt());
    close(&found["a"]["mean"][0], 1.5);
    close(&found["b"]["mean"][0], 1.0);
    // Errors are relative to the second picture.
    close(&json(&b, &a)["relmse"], 0.25 / 2.26 / 3.0);
    assert!(found["flip"].as_f64().unwrap() > 0.0);
    // Relative to black the error is infinite.
    let black = folder.write("black.exr", &flat(0.0));
    let found = json(&a, &black);
    assert!(found["relmse_scaled"].is_null() && found["noise"].is_null() && found["relmse"].is_number());
    let text = String::from_utf8(compare(&[&a, &black]).stdout).unwrap();
    assert!(text.contains("relMSE_scaled      infinite"), "{text}");
}

#[test]
fn text_output_has_the_same_figures() {
    let folder = Folder::new();
    let (a, b) = (folder.picture("a.png", 8, 8, 1.0), folder.picture("b.exr", 8, 8, 0.5));
    let output = compare(&[&a, &b]);
    // A picture for screens does not hold radiance.
    let said = stderr(&output);
    assert!(said.starts_with("warning: ") && said.contains("a.png is"), "{said}");
    let text = String::from_utf8(output.stdout).unwrap();
    for word in [
        "mean A",
        "mean B",
        "MSE",
        "relMSE ",
        "relMSE_scaled ",
        "noise",
        "FLIP",
        "LDR-FLIP",
        "a.png",
        "b.exr",
    ] {
        assert!(text.contains(word), "{word:?} is not in\n{text}");
    }
    let hdr = compare(&[&b, &b]);
    assert_eq!(stderr(&hdr), "");
    assert!(String::from_utf8(hdr.stdout).unwrap().contains("HDR-FLIP through ACES at"));
}

#[test]
fn pictures_of_different_sizes_fail_with_both_sizes() {
    let folder = Folder::new();
    let (a, b) = (folder.picture("a.png", 8, 8, 1.0), folder.picture("b.png", 8, 9, 1.0));
    refused(&[&a, &b], 1, &["differ in size", "8×8", "8×9"]);
    refused(&[&a, &b, "--json".as_ref()], 1, &["differ in size"]);
}

#[test]
fn pixels_that_are_not_finite_are_counted() {
    let folder = Folder::new();
    let mut picture = Picture { width: 4, height: 4, rgb: vec![[0.5; 3]; 16] };
    let good = folder.write("good.exr", &picture);
    picture.rgb[3][1] = f32::NAN;
    picture.rgb[9][0] = f32::INFINITY;
    let bad = folder.write("bad.exr", &picture);
    let found = json(&bad, &good);
    assert_eq!(found["a"]["non_finite_pixels"], 2);
    assert_eq!(found["b"]["non_finite_pixels"], 0);
    assert_eq!((&found["compared_pixels"], &found["mse"]), (&14.into(), &0.0.into()));
    let output = compare(&[&bad, &good]);
    assert!(String::from_utf8(output.stdout).unwrap().contains("2 pixels of A are NaN or infinite"));
    picture.rgb.fill([f32::NAN; 3]);
    let none = folder.write("none.exr", &picture);
    refused(&[&none, &good], 1, &["no pixel is finite"]);
}

#[test]
fn files_that_cannot_be_read_fail_and_are_named() {
    let folder = Folder::new();
    let good = folder.picture("good.png", 8, 8, 1.0);
    let missing = folder.path("missing.png");
    refused(&[&good, &missing], 1, &["missing.png", "no such file"]);
    let jpeg = folder.path("a.jpg");
    fs::write(&jpeg, "").unwrap();
    refused(&[&jpeg, &good], 1, &["a.jpg", ".png, .exr or .hdr"]);
    let text = folder.path("text.exr");
    fs::write(&text, "this is no picture").unwrap();
    refused(&[&good, &text], 1, &["text.exr", "not a complete .exr file"]);
    let directory = folder.path("directory.hdr");
    fs::create_dir(&directory).unwrap();
    refused(&[&directory, &good], 1, &["directory.hdr", "folder"]);
    // Valid contents under another format's extension.
    let disguised = folder.path("disguised.exr");
    fs::copy(&good, &disguised).unwrap();
    refused(&[&good, &disguised], 1, &["disguised.exr"]);
}

#[test]
fn too_few_or_unknown_arguments_are_bad_usage() {
    let folder = Folder::new();
    let good = folder.picture("good.png", 8, 8, 1.0);
    refused(&[&good], 2, &["<B>"]);
    refused(&[&good, &good, "--flop".as_ref()], 2, &["--flop"]);
}
