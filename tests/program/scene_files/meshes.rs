//! Meshes of scene files: their materials, and the progress of reading.

use std::fs;
use std::path::Path;
use stride::scene::*;

/// A folder with a square of two triangles in two groups with two materials, and their colours.
fn house() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let obj = "mtllib house.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
               g wall\nusemtl brick\nf 1 2 3\ng window\nusemtl pane\nf 1 3 4\n";
    fs::write(folder.path().join("house.obj"), obj).expect("written");
    let mtl = "newmtl brick\nKd 0.5 0.25 0.125\nnewmtl pane\nillum 4\nNi 1.25\nKe 1 2 3\n";
    fs::write(folder.path().join("house.mtl"), mtl).expect("written");
    folder
}

/// The scene of that mesh with further keys, or the errors in it.
fn housed(more: &str) -> Result<stride::scene::Loaded, String> {
    let folder = house();
    let text = format!(
        "entities = [{{ name = \"house\", shape = {{ type = \"mesh\", file = \"house.obj\"{more} }}, \
         material = \"a\", emission = [9, 9, 9] }}]\n\
         materials.a = {{ type = \"matte\", reflectance = [1, 1, 1] }}\n\
         materials.b = {{ type = \"mirror\", reflectance = [1, 1, 1] }}\n"
    );
    let path = folder.path().join("house.toml");
    fs::write(&path, text).expect("written");
    load(&path).map_err(|errors| errors.to_string().replace(&folder.path().display().to_string(), "…"))
}

#[test]
fn parts_of_meshes_have_their_own_materials() {
    let parts = |more: &str| {
        let scene = housed(more).expect("a scene").scene;
        let of = |e: &Entity| (e.name.clone(), scene.materials[e.material].clone(), e.emission[0]);
        scene.entities.iter().map(of).collect::<Vec<_>>()
    };
    let names = |parts: &[(String, stride::scene::Material, f64)]| {
        parts.iter().map(|(name, material, _)| format!("{name} of {}", material.name)).collect::<Vec<_>>()
    };
    assert_eq!(names(&parts("")), ["house of a"]);
    // By groups and by materials; the rest has the entity's.
    assert_eq!(names(&parts(", materials = { window = \"b\" }")), ["house: window of b", "house of a"]);
    assert_eq!(names(&parts(", materials = { brick = \"b\" }")), ["house: brick of b", "house of a"]);
    // The order of keys has no meaning.
    for both in
        [", materials = { window = \"b\", wall = \"a\" }", ", materials = { wall = \"a\", window = \"b\" }"]
    {
        assert_eq!(names(&parts(both)), ["house: wall of a", "house: window of b"]);
    }
    let of_file = parts(", materials = \"file\"");
    assert_eq!(names(&of_file), ["house: brick of house.obj: brick", "house: pane of house.obj: pane"]);
    assert_eq!(
        of_file[0].1.kind,
        MaterialKind::Matte(MatteParameters { reflectance: [0.5, 0.25, 0.125], roughness: 0.0 })
    );
    let pane =
        MaterialKind::Glass(GlassParameters { ior: 1.25, reflectance: [1.0; 3], transmittance: [1.0; 3] });
    assert_eq!(of_file[1].1.kind, pane);
    // Emission of the file's materials takes precedence over that of the entity.
    assert_eq!((of_file[0].2, of_file[1].2), (9.0, 1.0));
}

#[test]
fn replaced_materials_of_files_give_no_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let gltf = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0,"camera":0}],
        "meshes":[{"name":"leaf","primitives":[{"attributes":{"POSITION":0},"material":0}]}],
        "materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5],"roughnessFactor":0}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
        "uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    fs::write(folder.path().join("leaf.gltf"), gltf).expect("written");
    let scene = folder.path().join("leaf.toml");
    let warnings = |materials: &str| {
        let text = format!(
            "entities = [{{ shape = {{ type = \"mesh\", file = \"leaf.gltf\"{materials} }}, material = \"a\" }}]\n\
             materials.a = {{ type = \"matte\", reflectance = [1, 1, 1] }}\nenvironment.radiance = [1, 1, 1]\n"
        );
        fs::write(&scene, text).expect("written");
        let loaded = load(&scene).expect("a scene");
        let kinds = loaded.warnings.iter().filter_map(|warning| warning.message.split("leaf.gltf: ").nth(1));
        kinds.map(|kind| kind.split(':').next().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    let camera = "cameras are left out";
    assert_eq!(warnings(""), [camera]);
    assert_eq!(warnings(", materials = { leaf = \"a\" }"), [camera]);
    let alpha = "alpha is not read";
    assert_eq!(warnings(", materials = \"file\""), [camera, alpha]);
}

#[test]
fn large_files_report_progress() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", "# nothing\n".repeat(400_000));
    fs::write(folder.path().join("long.obj"), &long).expect("written");
    let scene = folder.path().join("long.toml");
    let text = "entities = [{ shape = { type = \"mesh\", file = \"long.obj\" }, material = \"a\" }]\n\
                materials.a = { type = \"matte\", reflectance = [1, 1, 1] }\n";
    fs::write(&scene, text).expect("written");
    let mut told = Vec::new();
    let mut watch = |path: &Path, bytes: u64, of: u64| told.push((path.to_owned(), bytes, of));
    stride::scene::load_watched(&scene, &mut watch).expect("a scene");
    // Every mebibyte.
    assert_eq!(told.len(), 4, "{told:?}");
    assert!(told.is_sorted_by(|a, b| a.1 < b.1));
    let whole = (folder.path().join("long.obj"), long.len() as u64);
    assert!(told.iter().all(|(path, bytes, of)| (path, *of) == (&whole.0, whole.1) && *bytes <= *of));
}

#[test]
fn unknown_parts_are_reported() {
    for (more, told) in [
        (
            ", materials = \"none\"",
            "1:88: materials must be \"file\" or a table of named tables, not \"none\"",
        ),
        (", materials = { window = \"c\" }", "1:99: no material \"c\"; the materials are \"a\", \"b\""),
        // All of them.
        (
            ", materials = { wall = \"c\", window = \"d\" }",
            "1:97: no material \"c\"; the materials are \"a\", \"b\"\n\
             …/house.toml:1:111: no material \"d\"; the materials are \"a\", \"b\"",
        ),
        (
            ", materials = { windwo = \"b\" }",
            "1:90: the mesh has no group or material \"windwo\"; did you mean \"window\"?",
        ),
    ] {
        assert_eq!(housed(more).map(|_| ()), Err(format!("…/house.toml:{told}")));
    }
}
