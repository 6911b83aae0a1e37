//! The program ends soon after a request to stop, however long its paths are.
//!
//! Otherwise each of these renders would take minutes at least: between lossless mirrors, paths have thousands of
//! bounces.

use std::fs;
use std::io::Read;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// Much more than a loaded machine needs, and much less than one sample of every pixel takes.
const WATCHDOG: Duration = Duration::from_secs(30);

/// A closed room of mirrors, with additional entities.
fn room(render: &str, size: u32, more: &str) -> String {
    format!(
        r#"
film = {{ width = {size}, height = {size} }}
camera = {{ eye = [0.1, 0.2, 0.3], forward = [1, 0.2, 0.1] }}
render = {{ {render} }}
[materials]
mirror = {{ type = "mirror", reflectance = [1, 1, 1] }}
glass = {{ type = "glass", ior = 1.5 }}
[[entities]]
shape = {{ type = "box", min = [-1, -1, -1], max = [1, 1, 1] }}
material = "mirror"
{more}
"#
    )
}

/// Scenes in which a pixel takes centuries, for each integrator.
fn endless() -> [(&'static str, String); 3] {
    let balls = (0..3).map(|i| {
        let x = 0.5 - 0.4 * f64::from(i);
        format!(
            "[[entities]]\nshape = {{ type = \"sphere\", center = [{x}, -0.5, 0.4], radius = 0.15 }}\nmaterial = \"glass\"\n"
        )
    });
    let balls: String = balls.collect();
    [
        ("path", room("integrator = \"path\", max_depth = \"unlimited\"", 1500, "")),
        ("path-naive", room("integrator = \"path-naive\", max_depth = 10000", 1000, "")),
        ("whitted", room("integrator = \"whitted\", max_depth = 10000", 200, &balls)),
    ]
}

/// The documented limit is two seconds; this includes a loaded machine.
#[cfg(unix)]
const ENDS_WITHIN: Duration = Duration::from_secs(8);

/// A grid of 4 × 4 squares that a transform makes tiny: normals of 0/0 once led to endless paths.
fn tiny_mesh(folder: &Path) -> String {
    let mut grid = String::new();
    for (x, y) in (0..5).flat_map(|y| (0..5).map(move |x| (x, y))) {
        grid += &format!("v {} {} 0\n", x - 2, y - 2);
    }
    for corner in (0..4).flat_map(|y| (1..5).map(move |x| 5 * y + x)) {
        grid += &format!("f {corner} {} {} {}\n", corner + 1, corner + 6, corner + 5);
    }
    fs::write(folder.join("grid.obj"), grid).unwrap();
    r#"
camera = { eye = [0, -8e-12, 4e-12], look_at = [0, 0, 0], vertical_fov = 42 }
film = { width = 40, height = 30 }
environment = { radiance = [1, 1, 1] }
entities = [{ shape = { type = "mesh", file = "grid.obj", transform = { scale = 1e-12 } }, material = "w" }]
[materials]
w = { type = "matte", reflectance = [0.5, 0.5, 0.5] }
"#
    .to_owned()
}

fn start(folder: &Path, scene: &str, arguments: &[&str]) -> Child {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(["render", "scene.toml", "--headless", "--threads", "2"])
        .args(arguments)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Its exit code; if it does not end, it is killed, and the test fails.
fn end_of(child: Child, of: &str) -> Output {
    let id = child.id();
    let (ended_out, ended) = mpsc::channel();
    let waits = std::thread::spawn(move || ended_out.send(child.wait_with_output().unwrap()).unwrap());
    let output = ended.recv_timeout(WATCHDOG);
    if output.is_err() {
        signal(id, "KILL");
    }
    waits.join().unwrap();
    output.unwrap_or_else(|_| panic!("{of}: it does not end"))
}

fn signal(id: u32, name: &str) {
    let kill = format!("kill -{name} {id}");
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
}

#[test]
fn a_tiny_mesh_is_rendered_in_every_world() {
    for world in ["simple", "bvh"] {
        let folder = tempfile::tempdir().unwrap();
        let scene = tiny_mesh(folder.path());
        let more = ["--spp", "4", "--world", world, "-o", "a.exr"];
        let output = end_of(start(folder.path(), &scene, &more), world);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{world}: {said}");
        let (_, picture) = stride::output::read_picture(&folder.path().join("a.exr")).unwrap();
        // The grid under a white sky is grey, and the sky surrounds it.
        let grey = picture.rgb.iter().filter(|pixel| (0.45..0.55).contains(&pixel[0])).count();
        let white = picture.rgb.iter().filter(|pixel| pixel[0] == 1.0).count();
        assert!(grey > 100 && white > 200, "{world}: {grey} grey pixels, {white} white ones");
    }
}

#[test]
fn a_time_limit_ends_a_render_with_a_slow_first_sample() {
    for (name, scene) in endless() {
        let folder = tempfile::tempdir().unwrap();
        let output = end_of(start(folder.path(), &scene, &["--time", "100ms"]), name);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{name}: {said}");
        let is_told = said.contains("the time limit came") || said.contains("nothing was rendered:");
        assert!(is_told, "{name}: {said}");
    }
}

#[cfg(unix)]
#[test]
fn a_request_to_terminate_ends_a_render_with_a_slow_first_sample() {
    for (name, scene) in endless() {
        let folder = tempfile::tempdir().unwrap();
        // The viewer connects when the render is about to begin: from then on requests are handled.
        let viewer = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = viewer.local_addr().unwrap().to_string();
        let child = start(folder.path(), &scene, &["--tev", &address]);
        let (mut called, _) = viewer.accept().unwrap();
        let reads = std::thread::spawn(move || called.read_to_end(&mut Vec::new()));
        let asked = Instant::now();
        signal(child.id(), "TERM");
        let output = end_of(child, name);
        let took = asked.elapsed();
        assert!(took < ENDS_WITHIN, "{name}: it ends {took:?} after the request");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{name}: {said}");
        assert!(said.contains("stopped early") || said.contains("nothing was rendered:"), "{name}: {said}");
        let _ = reads.join().unwrap();
    }
}

#[test]
fn the_dump_is_listed_among_written_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = room("integrator = \"path\", max_depth = 3", 8, "");
    let output = end_of(start(folder.path(), &scene, &["--spp", "1", "--samples", "all.npy"]), "dump");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("wrote scene.png, all.npy"), "{said}");
}
