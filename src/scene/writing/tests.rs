//! What is written is read as the same scene.

use super::*;
use crate::parameter::Family;
use crate::scene::description::{MatteParameters, Shape, SphereParameters};
use crate::scene::{Loaded, load, parse};
use std::fs;

/// Writes a scene into a folder, and reads it again.
fn again(scene: &Scene, folder: &Path, into: &Path) -> Loaded {
    let written = write(scene, folder, Path::new("files")).expect("a scene that can be written");
    fs::create_dir_all(into.join("files")).expect("a folder");
    for (path, contents) in &written.files {
        contents.write(fs::File::create(into.join(path)).expect("a file")).expect("written");
    }
    let path = into.join("a.toml");
    fs::write(&path, &written.text).expect("written");
    load(&path).unwrap_or_else(|error| panic!("{error}\n{}", written.text))
}

/// With materials and textures in the order of their names, by which readers sort them, and without those of files.
fn in_order(mut scene: Scene) -> Scene {
    let mut names: Vec<_> = scene.materials.iter().map(|material| material.name.clone()).collect();
    names.sort();
    let old: Vec<_> = scene.materials.iter().map(|material| material.name.clone()).collect();
    let new = |index: usize| names.iter().position(|name| *name == old[index]).expect("a name");
    for material in &mut scene.materials {
        material.kind.renumber(&new);
        material.modifiers.renumber(&new);
    }
    scene.entities.iter_mut().for_each(|entity| entity.material = new(entity.material));
    scene.materials.sort_by(|a, b| a.name.cmp(&b.name));
    for image in &mut scene.images {
        image.name = String::new();
    }
    scene
}

#[test]
fn scenes_of_the_repository_are_read_as_they_were() {
    for name in ["cover", "shapes", "surfaces", "room", "smallpt"] {
        let path = PathBuf::from(format!("scenes/{name}.toml"));
        let scene = load(&path).expect("a scene").scene;
        let folder = tempfile::tempdir().expect("a folder");
        let read = again(&scene, Path::new("scenes"), folder.path());
        assert_eq!(in_order(read.scene), in_order(scene), "{name}");
    }
}

#[test]
fn meshes_pictures_and_transforms_stay_as_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let obj = "v 0 0 0\nv 1 0 0\nv 0.1 1 0\nvt 0 0.3\nvt 1 0\nvt 0 1\nvn 0 0.1 1\nf 1/1/1 2/2/1 3/3/1\n";
    fs::write(folder.path().join("a.obj"), obj).expect("written");
    let text = r#"
        [materials."a \"b\""]
        type = "matte"
        reflectance = [0.1, 0.2, 0.3]
        [[entities]]
        shape = { type = "mesh", file = "a.obj", transform = { scale = [1, -2, 0.1], rotate = [10, 20, 33], translate = [1, 2, 3] } }
        material = "a \"b\""
        flip_normal = true
        [[entities]]
        shape = { type = "mesh", file = "a.obj" }
        material = "a \"b\""
        emission = [1, 0.5, 0]
        [[lights]]
        type = "directional"
        direction = [0.3, 0.1, -0.7]
        irradiance = [1, 1, 1]
    "#;
    let scene = parse(text, &folder.path().join("a.toml")).expect("a scene").scene;
    let read = again(&scene, folder.path(), &folder.path().join("out"));
    assert_eq!(in_order(read.scene.clone()), in_order(scene));
    let mesh = |i: usize| match &read.scene.entities[i].shape {
        Shape::Mesh { mesh, .. } => Arc::clone(mesh),
        other => panic!("{other:?}"),
    };
    assert!(Arc::ptr_eq(&mesh(0), &mesh(1)));
}

#[test]
fn names_that_are_given_twice_become_different() {
    let mut scene = Scene::default();
    for grey in [0.25, 0.75] {
        let matte = MatteParameters { reflectance: [grey; 3], roughness: 0.0 };
        let material = scene.add_material("grey", matte);
        let ball = SphereParameters { center: [0.0; 3].into(), radius: 1.0 };
        scene.add_entity("ball", ball, material);
    }
    let folder = tempfile::tempdir().expect("a folder");
    let read = again(&scene, Path::new(""), folder.path()).scene;
    let names: Vec<_> = read.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["grey", "grey (2)"]);
}

#[test]
fn a_picture_that_is_no_file_is_an_error() {
    let picture = Arc::new(crate::texture::Picture::black());
    let images = vec![ImageFile::of("nowhere.png".into(), picture)];
    let scene = Scene { images, ..Scene::default() };
    let error = write(&scene, Path::new("/none"), Path::new("files")).unwrap_err();
    assert_eq!(error, "/none/nowhere.png is not a file: its picture cannot be copied");
}

#[test]
fn both_sets_of_uv_are_written_and_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let properties = ["x", "y", "z", "u", "v", "u1", "v1"].map(|name| format!("property float {name}\n"));
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{}element face 1\nproperty list uchar int vertex_indices\n\
         end_header\n0 0 0 0.1 0.2 0.5 2\n1 0 0 0.3 0.4 -1 0.25\n0 1 0 0.5 0.6 0 1\n3 0 1 2\n",
        properties.concat()
    );
    fs::write(folder.path().join("a.ply"), ply).expect("written");
    let text = r#"
        [materials.white]
        type = "matte"
        reflectance = [0.8, 0.8, 0.8]
        [[entities]]
        shape = { type = "mesh", file = "a.ply" }
        material = "white"
        emission = [1, 1, 1]
    "#;
    let scene = parse(text, &folder.path().join("a.toml")).expect("a scene").scene;
    let second = |scene: &Scene| match &scene.entities[0].shape {
        Shape::Mesh { mesh, .. } => mesh.second_uv.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(second(&scene), [[0.5, 2.0], [-1.0, 0.25], [0.0, 1.0]]);
    let read = again(&scene, folder.path(), &folder.path().join("out"));
    assert_eq!(in_order(read.scene), in_order(scene));
}
