//! Files that a scene refers to.

use super::super::load;
use crate::scene::description::{Shape, TextureKind};
use crate::scene::formats::LoadOptions;
use crate::scene::toml::Loaded;
use crate::scene::{Scene, SceneErrors};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, text).expect("written");
    }
    folder
}

fn load_with(folder: &Path, options: &LoadOptions) -> Result<Loaded, SceneErrors> {
    load(&folder.join("scene/a.xml"), options, &mut |_, _, _| {})
}

fn scene(folder: &Path) -> Scene {
    load_with(folder, &LoadOptions::default()).unwrap_or_else(|errors| panic!("{errors}")).scene
}

/// The errors, without the path of the folder.
fn errors(folder: &Path) -> String {
    let errors = load_with(folder, &LoadOptions::default()).expect_err("a scene came of it").to_string();
    errors.replace(&format!("{}/", folder.display()), "")
}

const START: &str = "<scene version=\"3.0.0\">\n<sensor type=\"perspective\"/>\n";
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0.25\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";

#[test]
fn files_are_included_with_their_names_variables_and_folders() {
    let main = format!(
        "{START}<default name=\"r\" value=\"3\"/><include filename=\"parts/b.xml\"/>\n<shape type=\"sphere\"><ref id=\"late\"/><include filename=\"parts/light.xml\"/></shape></scene>"
    );
    let part = "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"late\"/>\n<shape type=\"sphere\" id=\"big\"><float name=\"radius\" value=\"$r\"/></shape>\n<shape type=\"obj\"><string name=\"filename\" value=\"c.obj\"/></shape></scene>";
    let light = "<emitter type=\"area\"/>";
    let files = [
        ("scene/a.xml", main.as_str()),
        ("scene/parts/b.xml", part),
        ("scene/parts/light.xml", light),
        ("scene/parts/c.obj", OBJ),
    ];
    let scene = scene(folder(&files).path());
    assert_eq!(scene.entities.len(), 3);
    assert!(matches!(scene.entities[0].shape, Shape::Sphere(sphere) if sphere.radius == 3.0));
    assert_eq!(scene.entities[2].emission, [1.0; 3]);
    assert_eq!(scene.materials[scene.entities[2].material].name, "late");
}

#[test]
fn errors_in_included_files_have_their_places() {
    let main = format!("{START}<include filename=\"b.xml\"/></scene>");
    let part = "<scene version=\"3.0.0\">\n  <shap/>\n</scene>";
    let folder = folder(&[("scene/a.xml", &main), ("scene/b.xml", part)]);
    assert_eq!(errors(folder.path()), "scene/b.xml:2:3: unknown element <shap>; did you mean \"shape\"?");
}

#[test]
fn a_file_that_includes_itself_is_an_error() {
    let main = format!("{START}<include filename=\"a.xml\"/></scene>");
    let folder = folder(&[("scene/a.xml", &main)]);
    assert!(errors(folder.path()).contains("files include each other more than 16 deep"));
}

#[test]
fn files_outside_the_folder_are_read_only_if_allowed() {
    let main = format!(
        "{START}<path value=\"../common\"/>\n<shape type=\"obj\"><string name=\"filename\" value=\"c.obj\"/></shape></scene>"
    );
    let folder = folder(&[("scene/a.xml", &main), ("common/c.obj", OBJ)]);
    let message = "scene/a.xml:4:19: \"c.obj\" is outside the scene's folder; use --allow-outside to read it";
    assert_eq!(errors(folder.path()), message);
    let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    assert_eq!(load_with(folder.path(), &options).expect("a scene").scene.entities.len(), 1);
}

#[test]
fn pointers_of_git_lfs_are_reported_as_such() {
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"c.obj\"/></shape>\n";
    let main = format!("{START}{shape}{shape}</scene>");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    let folder = folder(&[("scene/a.xml", &main), ("scene/c.obj", pointer)]);
    let message =
        "\"c.obj\" is a pointer of Git LFS, not the file itself; run \"git lfs pull\" in its repository";
    let told = [3, 4].map(|line| format!("scene/a.xml:{line}:19: {message}"));
    assert_eq!(errors(folder.path()), told.join("\n"));
}

#[test]
fn a_file_that_cannot_be_read_is_explained_once() {
    let shape = "<shape type=\"obj\"><string name=\"filename\" value=\"c.obj\"/></shape>\n";
    let main = format!("{START}{shape}{shape}</scene>");
    let folder = folder(&[("scene/a.xml", &main), ("scene/c.obj", "v 0 0 0\n")]);
    let told = errors(folder.path());
    let lines: Vec<_> = told.lines().collect();
    assert!(lines[0].contains("there is no triangle in it"), "{told}");
    let again = "scene/a.xml:4:19: this file cannot be read, as reported at its first place";
    assert_eq!(lines[1..], [again]);
}

#[test]
fn v_of_obj_files_is_flipped_and_normals_are_computed() {
    let shape = |more: &str| {
        format!("<shape type=\"obj\"><string name=\"filename\" value=\"c.obj\"/>{more}</shape>\n")
    };
    let main = format!(
        "{START}{}{}{}{}</scene>",
        shape(""),
        shape("<boolean name=\"flip_tex_coords\" value=\"false\"/>"),
        shape("<boolean name=\"face_normals\" value=\"true\"/>"),
        shape("")
    );
    let scene = scene(folder(&[("scene/a.xml", &main), ("scene/c.obj", OBJ)]).path());
    let mesh = |i: usize| match &scene.entities[i].shape {
        Shape::Mesh { mesh, .. } => mesh.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!((mesh(0).uv[0], mesh(1).uv[0]), ([0.0, 0.75], [0.0, 0.25]));
    assert_eq!((mesh(0).normals[0], mesh(2).normals.len()), ([0.0, 0.0, 1.0], 0));
    assert!(std::sync::Arc::ptr_eq(&mesh(0), &mesh(3)));
}

#[test]
fn meshes_are_read_by_the_reader_of_their_plugin() {
    let main =
        format!("{START}<shape type=\"ply\"><string name=\"filename\" value=\"c.obj\"/></shape></scene>");
    let folder = folder(&[("scene/a.xml", &main), ("scene/c.obj", OBJ)]);
    assert_eq!(errors(folder.path()), "scene/a.xml:3:19: the file of shape \"ply\" must end in .ply");
}

#[test]
fn bitmaps_are_flipped_vertically() {
    let main = format!(
        "{START}<shape type=\"rectangle\"><bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" value=\"p.png\"/><string name=\"wrap_mode\" value=\"clamp\"/></texture></bsdf></bsdf></shape></scene>"
    );
    let folder = folder(&[("scene/a.xml", &main)]);
    image::RgbImage::new(2, 1).save(folder.path().join("scene/p.png")).expect("written");
    let scene = scene(folder.path());
    assert_eq!((scene.images.len(), scene.materials[0].textures.len()), (1, 1));
    match scene.textures[0].kind {
        TextureKind::Image(image) => {
            assert_eq!((image.uv_scale, image.uv_offset, image.uv_rotate), ([1.0, -1.0], [0.0, 1.0], 0.0));
            assert!(!image.mipmap);
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn environments_have_the_orientation_of_mitsuba() {
    let of = |transform: &str| {
        let main = format!(
            "{START}<emitter type=\"envmap\"><string name=\"filename\" value=\"p.png\"/><float name=\"scale\" value=\"2\"/>{transform}</emitter></scene>"
        );
        let folder = folder(&[("scene/a.xml", &main)]);
        image::RgbImage::from_pixel(4, 2, image::Rgb([200; 3]))
            .save(folder.path().join("scene/p.png"))
            .expect("written");
        scene(folder.path()).environment_picture.expect("a picture")
    };
    let upright = of("");
    assert_eq!((upright.up, upright.scale), (glam::DVec3::Y, [2.0; 3]));
    // With y up and no rotation the middle column is seen along x, and after a quarter turn along z.
    assert!((upright.rotate.to_degrees() + 90.0).abs() < 1e-4, "{}", upright.rotate);
    let turned = of("<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/></transform>");
    assert!((turned.up - glam::DVec3::Z).length() < 1e-12);
    // Now up is z, and the middle column is along −y.
    assert!((turned.rotate.to_degrees() + 90.0).abs() < 1e-4, "{}", turned.rotate);
}

#[test]
fn an_element_may_be_included_as_often_as_a_file_has_room_for() {
    let includes = "<include filename=\"b.xml\"/><include filename=\"./b.xml\"/>".repeat(10_000);
    let main = format!("{START}{includes}</scene>");
    let folder = folder(&[("scene/a.xml", &main), ("scene/b.xml", "<shape type=\"sphere\"/>")]);
    assert_eq!(scene(folder.path()).entities.len(), 20_000);
}

#[test]
fn one_spectrum_file_is_one_spectrum() {
    let light = "<emitter type=\"point\"><spectrum name=\"intensity\" filename=\"s.spd\"/></emitter>";
    let main = format!("{START}{}</scene>", light.repeat(500));
    let samples: String = (0..50_000).map(|i| format!("{:.2} 1\n", 360.0 + f64::from(i) * 0.01)).collect();
    let folder = folder(&[("scene/a.xml", &main), ("scene/s.spd", &samples)]);
    assert_eq!(scene(folder.path()).lights.len(), 500);
}

#[test]
fn broken_files_that_a_scene_names_are_told_where_it_names_them() {
    let shape = |plugin: &str, file: &str| {
        let main = format!(
            "{START}<shape type=\"{plugin}\"><string name=\"filename\" value=\"{file}\"/></shape></scene>"
        );
        let folder = folder(&[
            ("scene/a.xml", &main),
            ("scene/b.ply", "ply\n"),
            ("scene/b.obj", "v 1 x 2\n"),
            ("scene/b.serialized", "x"),
        ]);
        std::fs::create_dir(folder.path().join("scene/c.ply")).expect("made");
        errors(folder.path())
    };
    let at = |plugin: &str| format!("scene/a.xml:3:{}: ", 16 + plugin.len());
    let told = [
        ("ply", "b.ply", "scene/b.ply:"),
        ("obj", "b.obj", "scene/b.obj: "),
        ("serialized", "b.serialized", "scene/b.serialized: this is not a serialized mesh"),
        ("ply", "c.ply", "scene/c.ply: "),
    ];
    for (plugin, file, message) in told {
        let error = shape(plugin, file);
        assert!(error.starts_with(&(at(plugin) + message)), "{error}");
    }
    let spectrum = |text: &str| {
        let main = format!(
            "{START}<emitter type=\"constant\"><spectrum name=\"radiance\" filename=\"s.spd\"/></emitter></scene>"
        );
        errors(folder(&[("scene/a.xml", &main), ("scene/s.spd", text)]).path())
    };
    let told = "scene/a.xml:3:26: \"s.spd\": line 2 is not a wavelength and a value";
    assert_eq!(spectrum("400 1\n500\n"), told);
    let long = format!("400 1\n500 2\n#{}", "x".repeat(1 << 20));
    let told = "scene/a.xml:3:26: \"s.spd\": a file with a spectrum is larger than 1 MiB";
    assert_eq!(spectrum(&long), told);
    let picture = format!(
        "{START}<emitter type=\"envmap\"><string name=\"filename\" value=\"p.png\"/></emitter></scene>"
    );
    let error = errors(folder(&[("scene/a.xml", &picture), ("scene/p.png", "x")]).path());
    assert!(error.starts_with("scene/a.xml:3:24: scene/p.png: "), "{error}");
    let broken = folder(&[
        ("scene/a.xml", &format!("{START}<include filename=\"b.xml\"/></scene>")),
        ("scene/b.xml", "<scene>\n</a>"),
    ]);
    assert!(
        errors(broken.path()).starts_with("scene/b.xml:2:1: this is not XML"),
        "{}",
        errors(broken.path())
    );
}

#[test]
fn meshes_of_which_nothing_can_be_seen_are_left_out() {
    let shape =
        "<shape type=\"obj\"><string name=\"filename\" value=\"b.obj\"/><bsdf type=\"diffuse\"/></shape>\n";
    let main = format!("{START}{shape}{shape}<shape type=\"sphere\"/></scene>");
    let write = |obj: &str| folder(&[("scene/a.xml", main.as_str()), ("scene/b.obj", obj)]);
    let flat = write("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    let loaded = load_with(flat.path(), &LoadOptions { strict: true, ..LoadOptions::default() });
    let loaded = loaded.unwrap_or_else(|errors| panic!("{errors}"));
    assert_eq!(loaded.scene.entities.len(), 1);
    let told: Vec<_> = loaded.warnings.iter().map(ToString::to_string).collect();
    let of_mesh: Vec<_> = told.iter().filter(|warning| warning.contains("zero area")).collect();
    assert!(of_mesh.len() == 1 && of_mesh[0].ends_with("it is left out"), "{told:?}");
    // A file without any triangle is a wrong one.
    assert!(errors(write("v 0 0 0\n").path()).contains("there is no triangle in it"));
}
