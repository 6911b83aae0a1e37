//! The window of the whole program, on a display without a screen.

#![cfg(all(target_os = "linux", feature = "window"))]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A process that ends when dropped, so that a failed test leaves none behind.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A display, gone when dropped.
struct Display {
    name: String,
    _server: Process,
}

fn quiet(program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn wait_for(what: &str, mut until: impl FnMut() -> bool) {
    let start = Instant::now();
    while !until() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what} does not happen");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A display, or none where its programs are missing and that is allowed.
fn display() -> Option<Display> {
    let there = |program| quiet(program, &["-version"]).status().is_ok();
    if !(there("Xvfb") && there("xdotool")) {
        assert!(
            std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"),
            "Xvfb or xdotool is missing"
        );
        println!("skipped: no Xvfb or no xdotool");
        return None;
    }
    // A number that no other run has: that of this process.
    let number = 100 + std::process::id() % 50_000;
    let name = format!(":{number}");
    // By itself it would start afresh whenever xdotool, its only client yet, leaves: a desktop's never does.
    let server =
        quiet("Xvfb", &[&name, "-noreset", "-screen", "0", "800x600x24"]).spawn().expect("Xvfb starts");
    let display = Display { name, _server: Process(server) };
    wait_for("the display's socket", || Path::new(&format!("/tmp/.X11-unix/X{number}")).exists());
    Some(display)
}

impl Display {
    fn tool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output();
        String::from_utf8_lossy(&output.expect("xdotool runs").stdout).trim().to_owned()
    }

    fn title(&self) -> String {
        self.tool(&["search", "--onlyvisible", "--name", "scene.toml", "getwindowname"])
    }
}

#[test]
fn the_window_shows_saves_and_closes_and_the_picture_is_written() {
    let Some(display) = display() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cover =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml")).expect("a scene");
    fs::write(folder.path().join("scene.toml"), cover).expect("a writable folder");
    let stride = quiet(env!("CARGO_BIN_EXE_stride"), &["render", "scene.toml", "--window"])
        .args(["--size", "160x120", "--spp", "4000000000"])
        .current_dir(folder.path())
        .env("DISPLAY", &display.name)
        .stderr(Stdio::inherit())
        .spawn()
        .expect("the program starts");
    let mut stride = Process(stride);
    wait_for("a title that counts", || {
        assert_eq!(stride.0.try_wait().expect("a child"), None, "the program has ended without a window");
        display.title().contains("spp")
    });
    let picture = folder.path().join("scene.png");
    assert!(!picture.exists(), "nothing is written before it is asked for");
    // Without a window manager the keyboard goes to the window under the pointer.
    display.tool(&[
        "search",
        "--onlyvisible",
        "--name",
        "scene.toml",
        "mousemove",
        "--window",
        "%1",
        "20",
        "20",
    ]);
    wait_for("a saved picture", || {
        display.tool(&["key", "s"]);
        picture.exists()
    });
    wait_for("a brighter picture", || {
        display.tool(&["key", "plus"]);
        display.title().contains("EV")
    });
    fs::remove_file(&picture).expect("the picture is there");
    wait_for("the end", || {
        display.tool(&["key", "Escape"]);
        stride.0.try_wait().expect("a child").is_some()
    });
    assert_eq!(stride.0.wait().expect("a child").code(), Some(0));
    let bytes = fs::read(&picture).expect("closing the window writes the picture");
    assert_eq!(&bytes[1..4], b"PNG");
}
