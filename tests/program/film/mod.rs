//! Film files, by the command line.

#[cfg(unix)]
mod disks;
mod info;
mod interrupted;
mod merging;
mod refusals;
mod thousands;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn cover() -> String {
    format!("{}/scenes/cover.toml", env!("CARGO_MANIFEST_DIR"))
}

fn stride(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_stride"));
    command.args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    stride(folder, arguments).output().expect("the program starts")
}

/// Runs a command that must succeed; returns its standard output and standard error.
fn succeed(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {said}");
    (String::from_utf8_lossy(&output.stdout).into_owned(), said)
}

/// Runs a command that must fail with this exit code; returns its message.
fn refused(folder: &Path, code: i32, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    said
}

/// The arguments of a quiet render of the cover without a window, and additional ones.
fn render<'a>(scene: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", scene, "--headless", "-q", "--size", "40x30"][..], more].concat()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}
