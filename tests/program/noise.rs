//! `--noise` reaches the requested error: the true figure, against a converged render, matches it.

use std::path::Path;
use std::process::Command;

fn stride(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("stride");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

fn render(folder: &Path, scene: &str, more: &[&str]) {
    let scene = format!("{}/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    stride(folder, &[&["render", &scene, "--headless", "-q", "--size", "80x60"], more].concat());
}

/// √relMSE_scaled of a picture without the worst 0.5% of its pixels, against the converged one.
fn noise(folder: &Path, picture: &str) -> f64 {
    let told = stride(folder, &["compare", picture, "reference.exr", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    json["noise"].as_f64().expect("a number")
}

// Each scene has an error that needs tens of samples; the converged render has 25 times as many, so that its own
// error increases the figure by 2%. The seeds are fixed, so that the result does not vary.
#[test]
fn the_true_error_is_within_a_fifth_of_the_requested_one() {
    for (scene, sampler, asked, converged) in [
        ("cover", "sobol", 0.17, "1500"),
        ("cover", "independent", 0.17, "1500"),
        ("smallpt", "sobol", 0.45, "2000"),
        ("room", "sobol", 0.14, "2500"),
    ] {
        let dir = tempfile::tempdir().expect("a folder");
        let render = |more: &[&str]| render(dir.path(), scene, &[&["--sampler", sampler], more].concat());
        render(&["--spp", converged, "--seed", "1000", "-o", "reference.exr"]);
        let error = asked.to_string();
        render(&["--noise", &error, "-o", "a.exr", "--stats", "s.json"]);
        let stats = std::fs::read(dir.path().join("s.json")).expect("a file");
        let stats: serde_json::Value = serde_json::from_slice(&stats).expect("JSON");
        let spp = stats["spp"].as_f64().expect("a number");
        assert!((16.0..converged.parse::<f64>().expect("a number") / 12.0).contains(&spp), "{spp} spp");
        let ratio = noise(dir.path(), "a.exr") / asked;
        println!("{scene} {sampler}: {spp} spp, {ratio:.3} of {asked}");
        assert!((0.8..1.2).contains(&ratio), "{scene} {sampler}: the error is {ratio} of {asked}");
        // Negative control: a quarter of the samples is not enough.
        render(&["--spp", &(spp / 4.0).ceil().to_string(), "-o", "rough.exr"]);
        let rough = noise(dir.path(), "rough.exr") / asked;
        assert!(rough > 1.3, "a quarter of the samples has {rough} of the error");
    }
}
