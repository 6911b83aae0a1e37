//! The window of the program, on a virtual display.

use crate::common::watched::poll;
use crossbeam_channel::{Receiver, unbounded};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use stride::output::{FilmFile, open_film};

/// A process that is killed when dropped, so that a failed test leaves none behind.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A virtual display, which ends when dropped.
struct Display {
    name: String,
    _server: Process,
}

fn quiet(program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// The lines of a process's standard output, as they arrive.
fn lines(process: &mut Child) -> Receiver<String> {
    let (sender, lines) = unbounded();
    let stdout = BufReader::new(process.stdout.take().expect("a pipe"));
    std::thread::spawn(move || stdout.lines().map_while(Result::ok).all(|line| sender.send(line).is_ok()));
    lines
}

/// The next line.
fn next_line(lines: &Receiver<String>) -> String {
    lines.recv_timeout(Duration::from_secs(60)).expect("a line on standard output")
}

/// A display, or `None` if its programs are missing and that is allowed.
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
    // Without -noreset it would restart whenever xdotool, its only client at first, disconnects; a desktop's server
    // never does. It chooses a free number, and prints it when it is ready.
    let server = quiet("Xvfb", &["-displayfd", "1", "-noreset", "-screen", "0", "800x600x24"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("Xvfb starts");
    let mut server = Process(server);
    let number = next_line(&lines(&mut server.0));
    Some(Display { name: format!(":{number}"), _server: server })
}

impl Display {
    fn tool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).output();
        String::from_utf8_lossy(&output.expect("xdotool runs").stdout).trim().to_owned()
    }

    /// Moves the pointer to a position in the window, which then has the focus: there is no window manager.
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
    poll("a title that counts", || {
        assert_eq!(stride.0.try_wait().expect("a child"), None, "the program has ended without a window");
        display.title().contains("spp")
    });
    let picture = folder.path().join("scene.png");
    assert!(!picture.exists(), "nothing is written before it is asked for");
    display.point(20, 20);
    poll("a saved picture", || {
        display.tool(&["key", "s"]);
        picture.exists()
    });
    poll("a brighter picture", || {
        display.tool(&["key", "plus"]);
        display.title().contains("EV")
    });
    fs::remove_file(&picture).expect("the picture is there");
    poll("the end", || {
        display.tool(&["key", "Escape"]);
        stride.0.try_wait().expect("a child").is_some()
    });
    assert_eq!(stride.0.wait().expect("a child").code(), Some(0));
    let bytes = fs::read(&picture).expect("closing the window writes the picture");
    assert_eq!(&bytes[1..4], b"PNG");
}

#[test]
fn the_window_shows_saves_and_closes_and_the_picture_is_written() {
    let Some(display) = display() else { return };
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
fn a_moved_camera_starts_a_new_render_and_the_suspended_one_resumes() {
    let Some(display) = display() else { return };
    let spp = "4000";
    let film = tour(&display, &["--spp", spp]);
    assert_eq!(film.sample_ranges().to_string(), format!("0..{spp}"));
}

// A resumed render keeps the decisions of the milestones before the camera moved.
#[test]
fn an_adaptive_render_makes_the_same_decisions_after_a_moved_camera() {
    let Some(display) = display() else { return };
    let film = tour(&display, &["--adaptive", "--noise", "0.017"]);
    assert_eq!(film.head().identity.get("adaptive"), Some("noise 0.017"));
    assert!(film.sample_ranges().open().is_some(), "all pixels have the same: this decides nothing");
}

/// The next camera on standard output, in the notation of a scene file.
fn printed_camera(lines: &Receiver<String>) -> String {
    let mut camera = String::new();
    while !camera.contains("vertical_fov") {
        camera += &next_line(lines);
        camera += "\n";
    }
    camera
}

/// Moves the camera during a render, and returns when that of the moved one is done; checks that both pictures
/// equal those of plain renders. Returns the film.
fn tour(display: &Display, asked: &[&str]) -> FilmFile {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| folder.path().join(name);
    // During the move the camera may have seen nothing, and finished a picture of that at once.
    let views = || {
        let names = (1..10).map(|view| format!("a-view-{view}.exr"));
        names.filter(|name| path(name).exists()).collect::<Vec<_>>()
    };
    let arguments = ["--size", "64x48", "-o", "a.exr", "--film", "a.film", "--layers", "samples"];
    let mut stride = Process(show(display, folder.path(), &[&arguments[..], asked].concat()));
    let printed = lines(&mut stride.0);
    let print = || {
        display.tool(&["key", "k"]);
        printed_camera(&printed)
    };
    poll("a title that counts", || {
        assert_eq!(stride.0.try_wait().expect("a child"), None, "the program has ended without a window");
        display.title().contains("spp")
    });
    display.point(150, 100);
    poll("keys that are heard", || {
        display.tool(&["key", "plus"]);
        display.title().contains("EV")
    });
    display.tool(&["key", "c"]);
    poll("a mouse that moves the camera", || display.title().contains("mouse moves camera"));
    // A drag in steps, as by hand: the camera that is printed after the button was pressed shows that the program has
    // seen the button, and each step has been seen when the camera has changed.
    display.tool(&["mousedown", "1"]);
    let mut camera = print();
    let mut moves = |what: &str| {
        let before = std::mem::replace(&mut camera, print());
        poll(what, || {
            camera = print();
            camera != before
        });
    };
    for x in [160, 180, 200] {
        display.point(x, 110);
        moves("a turn of the camera");
    }
    display.tool(&["mouseup", "1"]);
    display.tool(&["click", "4"]);
    moves("a step of the camera");
    display.tool(&["key", "c"]);
    poll("a view that is not steered any more", || display.title().contains("moved camera"));
    let camera = print();
    poll("the moved camera's render", || display.title().contains("done"));
    poll("its picture", || !views().is_empty());
    display.tool(&["key", "r"]);
    poll("the scene's own camera", || !display.title().contains("moved camera"));
    poll("its render's end", || display.title().contains("done"));
    poll("the end", || {
        display.tool(&["key", "Escape"]);
        stride.0.try_wait().expect("a child").is_some()
    });
    assert_eq!(stride.0.wait().expect("a child").code(), Some(0));

    // The scene's own picture and film are unaffected by the moved camera …
    let own = rendered(folder.path(), "scene.toml", "own.exr", asked);
    assert!(bits(path("a.exr")) == own);
    // … and that of the moved camera equals a render of the scene with the printed one.
    let scene = fs::read_to_string(path("scene.toml")).expect("a scene");
    let (before, after) = scene.split_once("[camera]").expect("a camera");
    let (_, after) = after.split_once("\n[").expect("more than that");
    fs::write(path("moved.toml"), format!("{before}{camera}\n[{after}")).expect("a folder");
    let moved = rendered(folder.path(), "moved.toml", "moved.exr", asked);
    assert!(bits(path(&views().pop().expect("a picture of it"))) == moved, "{camera}");
    // Negative control: the two pictures differ.
    assert!(own != moved);
    open_film(&path("a.film")).expect("a film")
}
