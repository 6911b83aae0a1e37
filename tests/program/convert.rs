//! Mitsuba's scene files on the command line, and what is converted from them: the same picture to the bit.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use stride::output::npy::RECORD_BYTES;

const SCENE: &str = r#"<scene version="3.0.0">
    <default name="spp" value="2"/>
    <default name="sky" value="0.5"/>
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective" id="front">
        <float name="fov" value="50"/>
        <transform name="to_world"><lookat origin="0.3 -6 2" target="0 0 0.5" up="0 0 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="20"/><integer name="height" value="12"/><rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
    </sensor>
    <sensor type="orthographic" id="above">
        <transform name="to_world"><scale x="3" y="3"/><lookat origin="0 0 9" target="0 0 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="20"/><integer name="height" value="12"/></film>
    </sensor>
    <bsdf type="twosided" id="board"><bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="board.png"/></texture></bsdf></bsdf>
    <shape type="rectangle"><ref id="board"/><transform name="to_world"><scale value="3"/></transform></shape>
    <shape type="obj"><string name="filename" value="spike.obj"/><bsdf type="twosided"><bsdf type="roughconductor">
        <string name="material" value="Au"/><string name="distribution" value="ggx"/></bsdf></bsdf>
        <transform name="to_world"><rotate x="1" y="0.3" angle="17"/><translate z="0.2"/></transform></shape>
    <shape type="sphere"><point name="center" x="1" y="-1" z="0.6"/><float name="radius" value="0.6"/><bsdf type="dielectric"/></shape>
    <shape type="sphere"><point name="center" x="-2" z="4"/><emitter type="area"><rgb name="radiance" value="9 8 7"/></emitter></shape>
    <emitter type="directional"><vector name="direction" x="0.31" y="0.7" z="-1"/></emitter>
    <emitter type="constant"><float name="radiance" value="$sky"/></emitter>
</scene>"#;

const SPIKE: &str = "v -1 0 0\nv 1 0 0\nv 0 1 0\nv 0.1 0.2 1.7\nvt 0 0.3\nvt 1 0\nvt 0.7 1\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 3/1 1/2 4/3\n";

/// Samples of a picture.
const COUNT: usize = 20 * 12 * 3;

fn stride(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stride"))
        .args(arguments)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stride(folder, arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {errors}");
    errors
}

/// A folder with a scene, its mesh and its picture.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.xml"), SCENE).expect("written");
    fs::write(folder.path().join("spike.obj"), SPIKE).expect("written");
    let checks =
        image::RgbImage::from_fn(8, 8, |x, y| image::Rgb([40 + 200 * ((x + y) % 2) as u8, 90, 20 * x as u8]));
    checks.save(folder.path().join("board.png")).expect("written");
    folder
}

/// Every sample of a scene, of which each bit counts.
fn samples(folder: &Path, scene: &str, more: &[&str]) -> Vec<u8> {
    let arguments =
        ["render", scene, "--headless", "-q", "--threads", "1", "-o", "a.exr", "--samples", "a.npy"];
    done(folder, &[&arguments[..], more].concat());
    let dump = fs::read(folder.join("a.npy")).expect("samples");
    // Before them stands what files and entities are called. They come in any order.
    let mut records: Vec<_> = dump[dump.len() - COUNT * RECORD_BYTES..].chunks(RECORD_BYTES).collect();
    records.sort();
    records.concat()
}

#[test]
fn what_is_converted_gives_the_same_samples() {
    let folder = folder();
    let path = folder.path();
    for camera in ["front", "above"] {
        let of = ["--camera", camera, "-D", "sky=0.25", "-D", "spp=3"];
        done(path, &[&["convert", "a.xml", "-o", "out/b.toml", "-q"][..], &of].concat());
        let original = samples(path, "a.xml", &of);
        assert!(original == samples(path, "out/b.toml", &[]), "{camera}");
    }
    // Negative control: another value.
    let other = samples(path, "a.xml", &["--camera", "above", "-D", "sky=0.26", "-D", "spp=3"]);
    assert!(other != samples(path, "out/b.toml", &[]));
}

#[test]
fn what_has_no_counterpart_is_a_warning_or_an_error() {
    let folder = folder();
    let text = SCENE.replace("dielectric", "plastic");
    fs::write(folder.path().join("a.xml"), text).expect("written");
    let output = stride(folder.path(), &["check", "a.xml"]);
    let (what, instead) =
        ("bsdf \"plastic\" has no counterpart; ", "a matte material of its diffuse_reflectance is");
    let told = format!("{what}{instead}");
    assert!(String::from_utf8_lossy(&output.stdout).contains(&told), "{output:?}");
    let output = stride(folder.path(), &["check", "a.xml", "--strict"]);
    assert_eq!(output.status.code(), Some(1));
    let told = format!("{what}without --strict, {instead}");
    assert!(String::from_utf8_lossy(&output.stderr).contains(&told), "{output:?}");
}

#[test]
fn what_is_no_toml_is_not_written_and_toml_has_no_variables() {
    let folder = folder();
    let output = stride(folder.path(), &["convert", "a.xml", "-o", "b.xml"]);
    assert_eq!(output.status.code(), Some(2));
    fs::write(folder.path().join("b.toml"), "").expect("written");
    for (more, message) in [
        (["-D", "spp=3"], "has no variables; leave out -D spp, and change the value in the file"),
        (["--camera", "front"], "has one camera; leave out --camera front"),
    ] {
        let commands: [&[&str]; 6] = [
            &["check"],
            &["info"],
            &["trace", "--pixel", "0,0"],
            &["render", "--headless"],
            &["bench", "noise"],
            &["convert", "-o", "c.toml"],
        ];
        for command in commands {
            let output = stride(folder.path(), &[command, &["b.toml"], &more].concat());
            assert_eq!(output.status.code(), Some(2), "{command:?}");
            let told = format!("b.toml: a scene file in TOML {message}");
            assert!(String::from_utf8_lossy(&output.stderr).contains(&told), "{command:?}: {output:?}");
        }
    }
}
