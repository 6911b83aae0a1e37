//! The window of the whole program, on a display without a screen.

#![cfg(all(target_os = "linux", feature = "window"))]

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use stride::output::{FilmFile, open_film};

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

/// A display for a test, 0 to 2, or none where its programs are missing and that is allowed.
fn display(test: u32) -> Option<Display> {
    let there = |program| quiet(program, &["-version"]).status().is_ok();
    if !(there("Xvfb") && there("xdotool")) {
        assert!(
            std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1"),
            "Xvfb or xdotool is missing"
        );
        println!("skipped: no Xvfb or no xdotool");
        return None;
    }
    // A number that no other run has, by that of this process, and no other test.
    let number = 100 + std::process::id() % 15_000 * 3 + test;
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

    /// Moves the pointer to a place in the window, to which the keyboard then goes: there is no window manager.
    fn point(&self, x: u32, y: u32) {
        let (x, y) = (x.to_string(), y.to_string());
        let found = ["search", "--onlyvisible", "--name", "scene.toml"];
        self.tool(&[&found[..], &["mousemove", "--window", "%1", &x, &y]].concat());
    }

    fn title(&self) -> String {
        self.tool(&["search", "--onlyvisible", "--name", "scene.toml", "getwindowname"])
    }
}

/// The program with a window on the cover scene, `scene.toml`.
fn show(display: &Display, folder: &Path, more: &[&str]) -> Child {
    let cover =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cover.toml")).expect("a scene");
    fs::write(folder.join("scene.toml"), cover).expect("a writable folder");
    quiet(env!("CARGO_BIN_EXE_stride"), &["render", "scene.toml", "--window"])
        .args(more)
        .current_dir(folder)
        .env("DISPLAY", &display.name)
        .stdout(Stdio::piped())
        .stderr(Stdio::inherit())
        .spawn()
        .expect("the program starts")
}

fn shows_saves_and_closes(display: &Display, device: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let stride =
        show(display, folder.path(), &["--size", "160x120", "--spp", "4000000000", "--device", device]);
    let mut stride = Process(stride);
    wait_for("a title that counts", || {
        assert_eq!(stride.0.try_wait().expect("a child"), None, "the program has ended without a window");
        display.title().contains("spp")
    });
    let picture = folder.path().join("scene.png");
    assert!(!picture.exists(), "nothing is written before it is asked for");
    display.point(20, 20);
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

#[test]
fn the_window_shows_saves_and_closes_and_the_picture_is_written() {
    let Some(display) = display(0) else { return };
    shows_saves_and_closes(&display, "cpu");
    if stride::gpu::adapters().is_empty() {
        assert!(
            std::env::var_os("STRIDE_REQUIRE_ALL").is_none_or(|value| value != "1") || !cfg!(feature = "gpu"),
            "there is no GPU adapter"
        );
        println!("skipped: no GPU adapter");
        return;
    }
    shows_saves_and_closes(&display, "gpu");
}

/// Renders a scene without a window, and returns the picture's bits.
fn rendered(folder: &Path, scene: &str, picture: &str, more: &[&str]) -> Vec<[u32; 3]> {
    let status = Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", scene, "--headless", "-q", "--size", "64x48", "-o", picture])
        .args(more)
        .current_dir(folder)
        .status();
    assert!(status.expect("the program starts").success());
    bits(folder.join(picture))
}

fn bits(path: PathBuf) -> Vec<[u32; 3]> {
    let (_, picture) = stride::output::read_picture(&path).expect("a picture");
    picture.rgb.iter().map(|rgb| rgb.map(f32::to_bits)).collect()
}

#[test]
fn a_camera_that_is_moved_renders_anew_and_its_own_render_goes_on_where_it_was() {
    let Some(display) = display(1) else { return };
    let spp = "4000";
    let film = tour(&display, &["--spp", spp]);
    assert_eq!(film.holding().to_string(), format!("0..{spp}"));
}

// What was decided at milestones before the camera moved is what the render goes on by when it is back.
#[test]
fn a_render_that_goes_where_the_error_is_decides_the_same_when_its_camera_is_back() {
    let Some(display) = display(2) else { return };
    let film = tour(&display, &["--adaptive", "--noise", "0.017"]);
    assert_eq!(film.head().identity.get("adaptive"), Some("noise 0.017"));
    assert!(film.holding().open().is_some(), "all pixels have the same: this decides nothing");
}

/// Moves the camera while a render is on, and back again when that of the moved one is done; demands that both pictures
/// are those of plain renders. Returns the film.
fn tour(display: &Display, asked: &[&str]) -> FilmFile {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    // On its way the camera may have looked where nothing is, and had a picture of that at once.
    let views = || {
        let names = (1..10).map(|view| format!("a-view-{view}.exr"));
        names.filter(|name| path(name).exists()).collect::<Vec<_>>()
    };
    let arguments = ["--size", "64x48", "-o", "a.exr", "--film", "a.film", "--layers", "samples"];
    let mut stride = Process(show(display, folder.path(), &[&arguments[..], asked].concat()));
    wait_for("a title that counts", || {
        assert_eq!(stride.0.try_wait().expect("a child"), None, "the program has ended without a window");
        display.title().contains("spp")
    });
    display.point(150, 100);
    wait_for("keys that are heard", || {
        display.tool(&["key", "plus"]);
        display.title().contains("EV")
    });
    display.tool(&["key", "c"]);
    wait_for("a mouse that moves the camera", || display.title().contains("the mouse moves the camera"));
    // A drag, step by step as by a hand.
    display.tool(&["mousedown", "1"]);
    for x in [160, 180, 200] {
        std::thread::sleep(Duration::from_millis(100));
        display.point(x, 110);
    }
    std::thread::sleep(Duration::from_millis(100));
    display.tool(&["mouseup", "1"]);
    display.tool(&["click", "4"]);
    display.tool(&["key", "c"]);
    wait_for("a view that is not steered any more", || display.title().contains("moved camera"));
    display.tool(&["key", "k"]);
    wait_for("the moved camera's render", || display.title().contains("done"));
    wait_for("its picture", || !views().is_empty());
    display.tool(&["key", "r"]);
    wait_for("the scene's own camera", || !display.title().contains("moved camera"));
    wait_for("its render's end", || display.title().contains("done"));
    wait_for("the end", || {
        display.tool(&["key", "Escape"]);
        stride.0.try_wait().expect("a child").is_some()
    });
    assert_eq!(stride.0.wait().expect("a child").code(), Some(0));
    let mut camera = String::new();
    stride.0.stdout.take().expect("a pipe").read_to_string(&mut camera).expect("text");

    // The scene's own picture and film are as if nobody had looked elsewhere …
    let own = rendered(folder.path(), "scene.toml", "own.exr", asked);
    assert!(bits(path("a.exr")) == own);
    // … and that of the moved camera is what a scene with the printed one gives.
    let scene = fs::read_to_string(path("scene.toml")).expect("a scene");
    let (before, after) = scene.split_once("[camera]").expect("a camera");
    let (_, after) = after.split_once("\n[").expect("more than that");
    let printed = camera.split("[camera]").nth(1).unwrap_or_else(|| panic!("no camera: {camera:?}"));
    fs::write(path("moved.toml"), format!("{before}[camera]{printed}\n[{after}")).expect("a folder");
    let moved = rendered(folder.path(), "moved.toml", "moved.exr", asked);
    assert!(bits(path(&views().pop().expect("a picture of it"))) == moved, "{printed}");
    // Negative control: they are two pictures.
    assert!(own != moved);
    open_film(&path("a.film")).expect("a film")
}
