//! Output files as read by other programs: NumPy, and OpenEXR's own reader in Python.

mod exr;
mod npy;
mod tev;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A Python with these modules: the one that `./test` installs, the first on the path, or Debian's.
fn python_with(modules: &str) -> Option<PathBuf> {
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/target/python/bin/python");
    let has = |python: &&str| {
        let import = format!("import {modules}");
        let status = Command::new(python).args(["-c", &import]).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    };
    let found = [own, "python3", "/usr/bin/python3"].into_iter().find(has);
    if found.is_none() {
        assert!(
            std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"),
            "no python3 has {modules}"
        );
        println!("skipped: no python3 with {modules}");
    }
    found.map(PathBuf::from)
}

/// Runs a Python program on files and returns its output, or its error message.
fn run(python: &Path, program: &str, files: &[&Path]) -> Result<String, String> {
    let out = Command::new(python).args(["-c", program]).args(files).output().expect("Python runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim().to_owned();
    if out.status.success() { Ok(text(&out.stdout)) } else { Err(text(&out.stderr)) }
}
