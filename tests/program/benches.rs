//! The benchmark scripts still run with the program's present command line.
//!
//! The results are too short to be meaningful here; the tests check only that they exist.

use std::path::Path;
use std::process::Command;

/// Runs a script of `benches/` in its shortest form and returns its output.
fn tried(script: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ran = Command::new("bash")
        .arg(root.join("benches").join(script))
        .arg("--try")
        .env("STRIDE", env!("CARGO_BIN_EXE_stride"))
        .output()
        .expect("bash runs");
    let (out, error) = (String::from_utf8_lossy(&ran.stdout), String::from_utf8_lossy(&ran.stderr));
    assert!(ran.status.success(), "{script}: {}\n{out}\n{error}", ran.status);
    out.into_owned()
}

#[test]
fn the_filters_benchmark_runs() {
    let out = tried("filters.sh");
    assert_eq!(out.matches("cost over box").count(), 16, "{out}");
    assert!(out.contains("blackman-harris  importance"), "{out}");
}

#[test]
fn the_noise_benchmark_runs() {
    let out = tried("noise.sh");
    assert_eq!(out.matches(" of it, ").count(), 15, "{out}");
}

#[test]
fn the_gpu_benchmark_runs() {
    let devices = Command::new(env!("CARGO_BIN_EXE_stride")).args(["info", "--devices"]).output();
    let devices = String::from_utf8_lossy(&devices.expect("the program runs").stdout).into_owned();
    if !devices.lines().any(|line| line.trim_start().starts_with("kind ")) {
        assert!(std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1"), "there is no adapter: {devices}");
        println!("skipped: no GPU adapter");
        return;
    }
    let out = tried("gpu.sh");
    assert!(out.contains("5. mesh, path"), "{out}");
}

#[test]
fn the_python_scripts_compile() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches");
    let paths = std::fs::read_dir(&folder).expect("benches/").map(|entry| entry.expect("an entry").path());
    let scripts: Vec<_> = paths.filter(|path| path.extension().is_some_and(|it| it == "py")).collect();
    assert!(!scripts.is_empty());
    // Build outputs go there, not into the repository.
    let cache = tempfile::tempdir().expect("a folder");
    let compiled = Command::new("python3")
        .args(["-m", "py_compile"])
        .args(&scripts)
        .env("PYTHONPYCACHEPREFIX", cache.path())
        .output();
    match compiled {
        Ok(ran) => assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr)),
        Err(error) => {
            assert!(std::env::var("STRIDE_REQUIRE_ALL").as_deref() != Ok("1"), "no python3: {error}");
            println!("skipped: no python3");
        }
    }
}
