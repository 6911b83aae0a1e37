use super::*;
use glam::DVec3;
use std::path::Path;

const SCENE: &str = r#"
    [film]
    width = 64
    [render]
    seed = 7
    [materials]
    white = { type = "matte", reflectance = [0.5, 0.5, 0.5] }
    red = { type = "matte", reflectance = [0.5, 0, 0] }
    floor = { type = "checkerboard", even = "white", odd = "red" }
    [[entities]]
    name = "ball"
    shape = { type = "sphere", center = [0, 0.5, 1], radius = 1 }
    material = "floor"
    emission = [1, 1, 1]
    [[entities]]
    shape = { type = "plane", normal = [0, 0, 1], distance = -3 }
    material = "white"
"#;

fn of(text: &str) -> Fingerprint {
    let loaded = crate::scene::parse(text, Path::new("a.toml")).unwrap_or_else(|error| panic!("{error}"));
    Fingerprint::of(&loaded.scene, &loaded.sources)
}

/// The scene with one text replaced by another.
fn with(from: &str, to: &str) -> Fingerprint {
    let text = SCENE.replacen(from, to, 1);
    assert_ne!(text, SCENE, "{from}");
    of(&text)
}

#[test]
fn irrelevant_changes_keep_the_fingerprint() {
    for (from, to) in [
        (
            "width = 64",
            "width = 0x40 # pixels\n exposure = 3\n tone = \"filmic\"\n filter = \"tent\"\n height = 480",
        ),
        ("seed = 7", "samples = 12\n max_depth = 5\n integrator = \"path\"\n seed = 7.0"),
        // Stored in films.
        ("width = 64", "width = 65\n filter = \"box\""),
        ("width = 64", "width = 64\n filter = \"mitchell\"\n mode = \"continuous\""),
        ("seed = 7", "seed = 8\n sampler = \"independent\"\n max_depth = 3"),
        ("seed = 7", "seed = 7\n ambient = [0, 0, 0]\n [environment]\n radiance = [0, 0, 0]\n [camera]\n"),
        ("[render]", "[camera]\n vertical_fov = 90\n eye = [0, -0.0, 0]\n forward = [2, 0, 0]\n [render]"),
        ("center = [0, 0.5, 1], radius = 1", "radius = 1e0, center = [0.0, 5e-1, 1]"),
        ("odd = \"red\"", "odd = \"red\", checks_per_unit = [1, 1]"),
        ("name = \"ball\"", "name = \"bowl\"\n flip_normal = false"),
        ("red = {", "red = { opacity = 1.0, normal_scale = 1, bump_scale = 1,"),
        ("white = {", "unused = { type = \"mirror\", reflectance = [1, 1, 1] }\n white = {"),
    ] {
        let text = SCENE.replacen(from, to, 1).replace("seed = 7.0", "seed = 7");
        assert_eq!(of(&text).digits(), of(SCENE).digits(), "{to}");
    }
}

#[test]
fn modifiers_of_materials_change_the_fingerprint() {
    let textures =
        "[textures.t]\n type = \"constant\"\n value = 0.5\n [textures.u]\n type = \"constant\"\n value = 1";
    let texts = [
        "",
        "opacity = 0.5,",
        "opacity = 0,",
        "opacity = \"t\",",
        "opacity = \"u\",",
        "back = \"white\",",
        "back = \"other\",",
        "normal_map = \"t\",",
        "normal_map = \"t\", normal_scale = 0.5,",
        "bump_map = \"t\",",
        "bump_map = \"t\", bump_scale = 0.5,",
        "bump_map = \"t\", normal_map = \"t\",",
    ];
    let other = "other = { type = \"mirror\", reflectance = [1, 1, 1] }";
    let all = texts.map(|text| {
        let scene = SCENE.replacen("red = {", &format!("{other}\n red = {{ {text}"), 1);
        of(&format!("{textures}\n{scene}")).digits()
    });
    for (i, one) in all.iter().enumerate() {
        assert!(!all[..i].contains(one), "{:?} counts as another one does", texts[i]);
    }
    assert_eq!(all[0], of(SCENE).digits());
}

#[test]
fn relevant_changes_change_the_fingerprint_and_are_named() {
    let ours = of(SCENE);
    let mut seen = vec![ours.digits()];
    for (from, to, named) in [
        ("[0, 0.5, 1]", "[0, 0.5, 1.0000000000000002]", "the shape of ball"),
        ("[0, 0.5, 1]", "[0.5, 0, 1]", "the shape of ball"),
        ("[1, 1, 1]", "[1, 1, 1]\n flip_normal = true", "the shape of ball"),
        ("[1, 1, 1]", "[1, 1, 2]", "the emission of ball"),
        ("[0.5, 0, 0]", "[0.5, 0.25, 0]", "the material of ball"),
        ("even = \"white\", odd = \"red\"", "even = \"red\", odd = \"white\"", "the material of ball"),
        ("material = \"white\"", "material = \"red\"", "the material of entity 2"),
        ("distance = -3", "distance = 3", "the shape of entity 2"),
        ("[render]", "[camera]\n near = 0.1\n [render]", "camera.near"),
        ("[render]", "[environment]\n radiance = [0, 0, 1]\n [render]", "environment.radiance"),
        ("seed = 7", "integrator = \"whitted\"\n ambient = [1, 0, 0]", "render.ambient"),
        (
            "[render]",
            "[[lights]]\n type = \"point\"\n position = [0, 0, 0]\n intensity = [1, 1, 1]\n [render]",
            "light 1",
        ),
    ] {
        let other = with(from, to);
        let reported = |a: &Fingerprint, b: &Fingerprint| {
            differing(&a.outline().expect("few parts"), &b.outline().expect("few parts"))
        };
        assert_eq!(reported(&ours, &other), named, "{to}");
        assert_eq!(reported(&other, &ours), named, "{to}");
        seen.push(other.digits());
    }
    let len = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), len);
}

#[test]
fn used_textures_and_their_pictures_change_the_fingerprint() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |name: &str, code: u8| {
        let path = folder.path().join(name);
        image::GrayImage::from_raw(2, 1, vec![7, code]).expect("a picture").save(path).expect("written");
    };
    picture("a.png", 1);
    picture("b.png", 2);
    let image =
        |more: &str| format!("[textures.wood]\n type = \"image\"\n file = \"a.png\"\n {more}\n [render]");
    let of = |texture: &str, reflectance: &str| {
        let text = SCENE.replacen("[render]", texture, 1).replacen("[0.5, 0.5, 0.5]", reflectance, 1);
        let loaded = crate::scene::parse(&text, &folder.path().join("a.toml")).expect("a scene");
        let fingerprint = Fingerprint::of(&loaded.scene, &loaded.sources);
        (fingerprint.digits(), fingerprint.outline().expect("few parts"))
    };
    let plain = of("[render]", "[0.5, 0.5, 0.5]");
    assert_eq!(of(&image(""), "[0.5, 0.5, 0.5]"), plain, "a texture that nothing uses");
    let ours = of(&image(""), "\"wood\"");
    assert_eq!(of(&image("wrap = [\"repeat\", \"repeat\"]\n mipmap = true"), "\"wood\""), ours);
    let others = [
        (of(&image("wrap = \"clamp\""), "\"wood\""), "the material of ball, the material of entity 2"),
        (of(&image("").replace("a.png", "b.png"), "\"wood\""), "b.png, a.png"),
    ];
    for (other, named) in &others {
        assert_ne!(other.0, ours.0);
        assert_eq!(differing(&other.1, &ours.1), *named);
    }
    // The same pixels under another name give the same digest.
    picture("b.png", 1);
    assert_eq!(of(&image("").replace("a.png", "b.png"), "\"wood\"").0, ours.0);
}

#[test]
fn environment_pictures_count_by_contents_and_orientation() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |name: &str, code: u8| {
        let path = folder.path().join(name);
        image::GrayImage::from_raw(2, 1, vec![7, code]).expect("a picture").save(path).expect("written");
    };
    picture("a.png", 1);
    picture("b.png", 2);
    let of = |keys: &str| {
        let text = SCENE.replacen("[render]", &format!("[environment]\n {keys}\n [render]"), 1);
        let loaded = crate::scene::parse(&text, &folder.path().join("a.toml")).expect("a scene");
        let fingerprint = Fingerprint::of(&loaded.scene, &loaded.sources);
        (fingerprint.digits(), fingerprint.outline().expect("few parts"))
    };
    let ours = of("file = \"a.png\"");
    assert_eq!(of("file = \"a.png\"\n scale = [1, 1, 1]\n rotate = 0\n up = [0, 0, 2]"), ours);
    for (keys, named) in [
        ("file = \"b.png\"", "b.png, a.png"),
        ("file = \"a.png\"\n scale = 2", "environment.scale"),
        ("file = \"a.png\"\n rotate = 10", "environment.rotate"),
        ("file = \"a.png\"\n up = [0, 1, 0]", "environment.up"),
        ("", "environment.file, environment.scale, environment.rotate, environment.up and 1 more"),
    ] {
        let other = of(keys);
        assert_ne!(other.0, ours.0, "{keys}");
        assert_eq!(differing(&other.1, &ours.1), named, "{keys}");
    }
    // The same picture under another name gives the same digest.
    picture("b.png", 1);
    assert_eq!(of("file = \"b.png\"").0, ours.0);
}

#[test]
fn textures_count_by_the_parameters_they_replace() {
    let of = |texture: &str| {
        let textures = format!(
            "[textures]\n inner = {{ type = \"constant\", value = 0.5 }}\n wood = {{ {texture} }}\n [render]"
        );
        let text = SCENE.replacen("[render]", &textures, 1).replacen("[0.5, 0.5, 0.5]", "\"wood\"", 1);
        let loaded =
            crate::scene::parse(&text, Path::new("a.toml")).unwrap_or_else(|error| panic!("{error}"));
        Fingerprint::of(&loaded.scene, &loaded.sources).digits()
    };
    for (kind, [a, b], more) in [
        ("checkerboard", ["even", "odd"], ""),
        ("mix", ["a", "b"], ", amount = 0.25"),
        ("noise", ["a", "b"], ""),
        ("scale", ["texture", "by"], ""),
    ] {
        let with = |a: &str, b: &str| of(&format!("type = \"{kind}\", {a} = \"inner\", {b} = 0.2{more}"));
        assert_ne!(with(a, b), with(b, a), "{kind}");
        assert_eq!(with(a, b), with(a, b), "{kind}");
    }
}

/// Every number of every shape counts, and so does the order of those of the same kind.
#[test]
fn each_number_of_each_shape_counts() {
    let loaded = crate::scene::parse(SCENE, Path::new("a.toml")).unwrap_or_else(|error| panic!("{error}"));
    let of = |shape: Shape| {
        let mut scene = loaded.scene.clone();
        scene.entities[0].shape = shape;
        Fingerprint::of(&scene, &loaded.sources)
    };
    let ours = Fingerprint::of(&loaded.scene, &loaded.sources);
    let mut seen = vec![ours.digits()];
    for (name, shape) in crate::shape::samples::samples() {
        let Some(place) = shape.place() else { continue };
        let values = shape.values();
        let mut changed = vec![values.clone()];
        for (i, value) in values.iter().enumerate() {
            let others: Vec<Value> = match *value {
                Value::Number(x) => vec![Value::Number(x + 0.125)],
                Value::Vector(x) => {
                    [DVec3::X, DVec3::Y, DVec3::Z].map(|e| Value::Vector(x + e * 0.125)).into()
                }
                other => panic!("{name}: another value than {other:?} has to be made here"),
            };
            changed
                .extend(others.into_iter().map(|other| [&values[..i], &[other], &values[i + 1..]].concat()));
        }
        // Two vectors, or two numbers, exchanged.
        for (i, j) in (0..values.len()).flat_map(|j| (0..j).map(move |i| (i, j))) {
            if std::mem::discriminant(&values[i]) == std::mem::discriminant(&values[j]) {
                let mut exchanged = values.clone();
                exchanged.swap(i, j);
                changed.push(exchanged);
            }
        }
        for values in changed {
            let Ok(shape) = Shape::build(place, &values, &mut Vec::new()) else { continue };
            let other = of(shape);
            let reported = differing(&ours.outline().unwrap(), &other.outline().unwrap());
            assert_eq!(reported, "the shape of ball", "{name}: {values:?}");
            seen.push(other.digits());
        }
    }
    let len = seen.len();
    assert!(len > 40, "{len}");
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), len);
}

#[test]
fn groups_count_by_contents_and_instances() {
    let of = |ball: &str, place: &str| {
        let instance = format!("[[instances]]\n name = \"it\"\n group = \"g\"\n {place}\n [render]");
        of(&SCENE.replacen("[[entities]]", ball, 1).replace("[render]", &instance))
    };
    let reported = |a: &Fingerprint, b: &Fingerprint| differing(&a.outline().unwrap(), &b.outline().unwrap());
    let ours = of("[[groups.g.entities]]", "");
    assert_eq!(of("[[groups.g.entities]]", "transform = { scale = [1, 1, 1] }").digits(), ours.digits());
    let moved = of("[[groups.g.entities]]", "transform = { translate = [0, 0, 1] }");
    assert_eq!(reported(&ours, &moved), "the place of it");
    assert_ne!(of("[groups.g]\n [[entities]]", "").digits(), ours.digits());
}

#[test]
fn the_order_of_entities_counts_and_many_differences_are_counted() {
    let (ours, other) = (of(SCENE), with("ball", "a;b"));
    let mut turned = ours.clone();
    turned.parts.reverse();
    assert_ne!(ours.digits(), turned.digits());
    assert_eq!(differing(&ours.outline().unwrap(), &turned.outline().unwrap()), "the order of its entities");
    assert!(differing(&other.outline().unwrap(), "").ends_with("and 11 more"));
    assert!(other.outline().unwrap().contains("the shape of a,b;"));
}

#[test]
fn outlines_are_limited_in_parts_and_bytes() {
    assert!(with("ball", &"a".repeat(1000)).outline().is_some());
    // Three of its parts have this name.
    assert!(with("ball", &"a".repeat(LONGEST_OUTLINE / 2)).outline().is_none());
    let many = |len: usize| Fingerprint { parts: vec![Part::new("", |_| ()); len] };
    assert!(many(MOST_LISTED).outline().is_some() && many(MOST_LISTED + 1).outline().is_none());
}

#[test]
fn meshes_count_by_contents_and_not_by_file_name() {
    let folder = tempfile::tempdir().unwrap();
    let ply = |x: f32| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n{x} 0 0\n0 1 0\n3 0 1 2\n"
        )
    };
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.ply", &ply(1.0));
    write("b.ply", &ply(1.0).replace("format ascii 1.0", "format ascii 1.0\ncomment the same"));
    let scene = folder.path().join("a.toml");
    let of = |file: &str| {
        let text = format!(
            "materials.m = {{ type = \"matte\", reflectance = [1, 1, 1] }}\n\
             entities = [{{ shape = {{ type = \"mesh\", file = \"{file}\" }}, material = \"m\" }}]"
        );
        let loaded = crate::scene::parse(&text, &scene).unwrap_or_else(|error| panic!("{error}"));
        Fingerprint::of(&loaded.scene, &loaded.sources)
    };
    let ours = of("a.ply");
    assert_eq!(of("b.ply").digits(), ours.digits());
    write("a.ply", &ply(2.0));
    let changed = of("a.ply");
    assert_ne!(changed.digits(), ours.digits());
    let reported = differing(&ours.outline().unwrap(), &changed.outline().unwrap());
    assert_eq!(reported, "a.ply");
    // Films of earlier builds have the folder, too.
    let [before, after] = [&ours, &changed].map(|it| it.outline().unwrap());
    let earlier = before.replace("a.ply", "scenes/a.ply");
    assert_eq!(
        (differing(&earlier, &after), differing(&after, &earlier)),
        ("scenes/a.ply".into(), "a.ply".into())
    );
    assert_eq!(differing(&earlier, &before), differing(&before, &before));
    assert_eq!(differing(&before.replace("a.ply", "aa.ply"), &before), "aa.ply, a.ply");
}

/// Films of earlier versions can be continued: the digits of a scene with every shape, material and light have not
/// changed.
#[test]
fn digits_are_stable() {
    let folder = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    std::fs::write(folder.path().join("a.ply"), ply).unwrap();
    let text = r#"
        [materials]
        white = { type = "matte", reflectance = [0.5, 0.25, 0.125] }
        board = { type = "checkerboard", even = "water", odd = "inner", checks_per_unit = [2, 3] }
        steel = { type = "mirror", reflectance = [0.75, 0.5, 0.25] }
        water = { type = "glass", ior = 1.33, reflectance = [1, 0.5, 0], transmittance = [0.25, 0.5, 1] }
        inner = { type = "checkerboard", even = "steel", odd = "white" }
        [[entities]]
        shape = { type = "plane", normal = [0, 0, 2], distance = -3 }
        material = "board"
        [[entities]]
        shape = { type = "sphere", center = [0, 0.5, 1], radius = 0.25 }
        material = "white"
        emission = [1, 2, 3]
        [[entities]]
        shape = { type = "quad", corner = [0, 1, 2], u = [3, 4, 5], v = [6, 7, 9] }
        material = "steel"
        flip_normal = true
        [[entities]]
        shape = { type = "disk", center = [0, 1, 2], normal = [0, 3, 4], radius = 2 }
        material = "water"
        [[entities]]
        shape = { type = "cylinder", from = [0, 1, 2], to = [3, 4, 5], radius = 6 }
        material = "inner"
        [[entities]]
        shape = { type = "box", min = [0, 1, 2], max = [3, 4, 5] }
        material = "white"
        [[entities]]
        shape = { type = "mesh", file = "a.ply", transform = { scale = 2, translate = [1, 2, 3] } }
        material = "white"
        [[lights]]
        type = "point"
        position = [1, 2, 3]
        intensity = [4, 5, 6]
    "#;
    let loaded = crate::scene::parse(text, &folder.path().join("a.toml"));
    let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    let digits = Fingerprint::of(&loaded.scene, &loaded.sources).digits();
    assert_eq!(digits, "1c9ee8392e7e51b4c26a48b9ddbbb562b7acfb2d20ca45f4760e8233d6aee6b7");
}

/// Colours in an MTL file and numbers in a buffer affect the fingerprint although they are in another file.
#[test]
fn files_referenced_by_mesh_files_count() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let of = |shape: &str| {
        let text = format!(
            "materials.m = {{ type = \"matte\", reflectance = [1, 1, 1] }}\n\
             entities = [{{ name = \"house\", shape = {{ type = \"mesh\", {shape} }}, material = \"m\" }}]"
        );
        let loaded = crate::scene::parse(&text, &folder.path().join("a.toml"));
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        Fingerprint::of(&loaded.scene, &loaded.sources)
    };
    let reported = |a: &Fingerprint, b: &Fingerprint| differing(&a.outline().unwrap(), &b.outline().unwrap());

    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 2 3 1\n";
    write("a.obj", obj.as_bytes());
    let coloured = |red: &str| {
        write("a.mtl", format!("newmtl red\n{red}\nnewmtl blue\nKd 0 0 1\n").as_bytes());
        of("file = \"a.obj\", materials = \"file\"")
    };
    let ours = coloured("Kd 1 0 0");
    // Negative controls: another spelling, and statements that are not used.
    assert_eq!(coloured("# scarlet\nKd 1.0 0 0").digits(), ours.digits());
    let unasked = of("file = \"a.obj\"");
    assert_eq!(reported(&ours, &coloured("Kd 0.5 0 0")), "the material of house: red");
    assert_eq!(reported(&ours, &coloured("Kd 1 0 0\nKe 1 1 1")), "the emission of house: red");
    assert_eq!(of("file = \"a.obj\"").digits(), unasked.digits());

    let gltf = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "a.bin" }] }"#;
    write("a.gltf", gltf.as_bytes());
    let placed = |x: f32| {
        let bytes = [0.0_f32, 0.0, 0.0, x, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes);
        write("a.bin", bytes.as_flattened());
        of("file = \"a.gltf\"")
    };
    let ours = placed(1.0);
    assert_eq!(placed(1.0).digits(), ours.digits());
    assert_eq!(reported(&ours, &placed(2.0)), "a.gltf");
}
