//! `stride info` of scenes and meshes.

use std::fs;
use std::path::Path;
use std::process::Command;

fn info(folder: &Path, file: &str) -> Result<String, String> {
    let output =
        Command::new(env!("CARGO_BIN_EXE_stride")).current_dir(folder).args(["info", file]).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
}

/// A square of `n` × `n` squares of two triangles each.
fn grid(n: u32) -> String {
    let mut text = String::new();
    for i in 0..=n {
        for j in 0..=n {
            text += &format!("v {i} {j} 0\n");
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            text += &format!("f {a} {} {} {}\n", a + n + 1, a + n + 2, a + 1);
        }
    }
    text
}

#[test]
fn info_describes_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("grid.obj"), format!("g floor\n{}", grid(20))).unwrap();
    let told = info(folder.path(), "grid.obj").unwrap();
    for line in [
        "mesh        800 triangles, 441 vertices",
        "bounds      (0, 0, 0) to (20, 20, 0)",
        "area        400",
        "vertices    positions alone",
        "parts       floor",
    ] {
        assert!(told.lines().any(|l| l == line), "{told} lacks {line:?}");
    }
    // At least a hundred leaves of eight triangles: three levels of nodes with eight children.
    assert!(told.contains("tree        3 levels, ") || told.contains("tree        4 levels, "), "{told}");
    fs::write(folder.path().join("bad.obj"), "f 1 2 3").unwrap();
    let told = info(folder.path(), "bad.obj").unwrap_err();
    assert!(told.contains("bad.obj: line 1"), "{told}");
}

#[test]
fn bounds_match_the_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let vertices = "v 100 -100 1e30\nv 0 0 0\nv 1 0 0\nv nan 0 0\nv 0 2 0\nv -5 -5 -5\n";
    fs::write(folder.path().join("a.obj"), format!("{vertices}f 2 3 5\n")).unwrap();
    let told = info(folder.path(), "a.obj").unwrap();
    for line in ["mesh        1 triangle, 3 vertices", "bounds      (0, 0, 0) to (1, 2, 0)"] {
        assert!(told.lines().any(|l| l == line), "{told} lacks {line:?}");
    }
}

/// Files with the features of Khronos' samples `SimpleMorph` and `SimpleSkin`, and with their bounds.
#[test]
fn bounds_match_the_pose() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    for (file, bounds) in
        [("07-morph.gltf", "(0, 0, 0) to (1, 1.5, 0)"), ("07-skin.gltf", "(-0.5, 0, 0) to (0.5, 2, 0)")]
    {
        let told = info(&seeds, file).unwrap();
        assert!(told.contains(&format!("bounds      {bounds}\n")), "{file}: {told}");
    }
}

#[test]
fn instances_are_counted_and_held_by_the_bounds() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("grid.obj"), grid(60)).unwrap();
    let place = |i: u32| {
        format!(
            "{{ shape = {{ type = \"mesh\", file = \"grid.obj\", transform = {{ translate = [{}, 0, 0] }} }}, \
             material = \"white\" }}, ",
            10 * i
        )
    };
    // Enough triangles for instances to share them.
    let entities: String = (0..10).map(place).collect();
    let text = format!(
        "entities = [{entities}]\nmaterials.white = {{ type = \"matte\", reflectance = [1, 1, 1] }}\n\
         environment.radiance = [1, 1, 1]\n"
    );
    fs::write(folder.path().join("grids.toml"), text).unwrap();
    let told = info(folder.path(), "grids.toml").unwrap();
    for line in [
        "entities    10",
        "surfaces    7200 triangles, 10 instances of meshes",
        "bounds      (0, 0, 0) to (150, 60, 0)",
        "lights      none; 0 to sample, and the environment",
        "materials   white (matte)",
    ] {
        assert!(told.lines().any(|l| l == line), "{told} lacks {line:?}");
    }
}

#[test]
fn info_describes_a_scene() {
    let told = info(Path::new(env!("CARGO_MANIFEST_DIR")), "scenes/room.toml").unwrap();
    for words in [
        "entities    10\n",
        "surfaces    4 spheres, 6 quads\n",
        "lights      1 entity that emits; 1 to sample\n",
        "(glass)",
        "tree        none: there are few surfaces, and rays are tested against all of them\n",
    ] {
        assert!(told.contains(words), "{told} lacks {words:?}");
    }
    let told = info(Path::new(env!("CARGO_MANIFEST_DIR")), "scenes/shapes.toml").unwrap();
    for words in [
        "entities    13\n",
        "surfaces    2 planes, 3 disks, 4 cylinders, 4 boxes of six quads\n",
        "lights      4 entities that emit; 9 to sample\n",
    ] {
        assert!(told.contains(words), "{told} lacks {words:?}");
    }
    let told = info(Path::new(env!("CARGO_MANIFEST_DIR")), "no.toml").unwrap_err();
    assert!(told.contains("no such file"), "{told}");
}

#[test]
fn info_reports_the_memory_of_the_environment() {
    let folder = tempfile::tempdir().unwrap();
    let picture = image::RgbImage::from_raw(3, 2, (0..18).collect()).unwrap();
    picture.save(folder.path().join("sky.png")).unwrap();
    fs::write(folder.path().join("a.toml"), "environment.file = \"sky.png\"\n").unwrap();
    let told = info(folder.path(), "a.toml").unwrap();
    for line in [
        "lights      none; 1 to sample",
        "environment sky.png, sampled by a grid of 3×2, 64 bytes",
        "picture     sky.png: 3×2, 3 channels, 8-bit, 32 bytes",
        "pictures    32 bytes in use",
    ] {
        assert!(told.lines().any(|l| l == line), "{told} lacks {line:?}");
    }
}

#[test]
fn info_reports_the_memory_of_textures() {
    let folder = tempfile::tempdir().unwrap();
    let picture = image::RgbImage::from_raw(3, 2, (0..18).collect()).unwrap();
    picture.save(folder.path().join("wood.png")).unwrap();
    let scene = "[materials.a]\ntype = \"matte\"\nreflectance = \"wood\"\n\
                 [[entities]]\nshape = { type = \"sphere\", center = [0, 0, 0], radius = 1 }\nmaterial = \"a\"\n\
                 [textures.wood]\ntype = \"image\"\nfile = \"wood.png\"\n\
                 [textures.checks]\ntype = \"checkerboard\"\neven = \"wood\"\nodd = 0.5\n";
    fs::write(folder.path().join("a.toml"), scene).unwrap();
    let told = info(folder.path(), "a.toml").unwrap();
    for line in [
        "textures    wood (image), checks (checkerboard)",
        "picture     wood.png: 3×2, 3 channels, 8-bit, 32 bytes",
        // Includes the coarser level of one texel.
        "pictures    48 bytes in use",
    ] {
        assert!(told.lines().any(|l| l == line), "{told} lacks {line:?}");
    }
}
