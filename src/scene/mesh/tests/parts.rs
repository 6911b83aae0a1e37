//! Groups and materials: separate meshes, and the conversion of MTL colours.

use super::*;

/// A square of two triangles in two groups of the same two materials, on vertices that they share.
const SQUARE: &str = "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
    g left side\nusemtl Red Paint\nf 1 2 3\nusemtl Clear\nf 1 3 4\n\
    g right side\nusemtl Red Paint\nf 3 2 1\n";

fn counts(file: &MeshFile) -> Vec<(&str, usize, usize)> {
    let count =
        |(name, mesh): &'_ (String, Arc<Mesh>)| (mesh.positions.len(), mesh.triangles.len(), name.len());
    file.parts
        .iter()
        .map(|part| {
            let (vertices, triangles, _) = count(part);
            (part.0.as_str(), vertices, triangles)
        })
        .collect()
}

#[test]
fn files_are_split_by_names_alone() {
    let whole = read_split("a.obj", SQUARE.as_bytes(), &Split::Whole).unwrap();
    assert_eq!(counts(&whole), [("", 4, 3)]);
    let names = |names: &[&str]| {
        let split = Split::Named(names.iter().map(|&name| name.to_owned()).collect());
        read_split("a.obj", SQUARE.as_bytes(), &split).unwrap()
    };
    assert_eq!(counts(&names(&["Clear"])), [("Clear", 3, 1), ("", 3, 2)]);
    // A group counts before a material.
    assert_eq!(
        counts(&names(&["Red Paint", "right side"])),
        [("Red Paint", 3, 1), ("right side", 3, 1), ("", 3, 1)]
    );
    assert_eq!(names(&["no such"]).names, ["left side", "Red Paint", "Clear", "right side"]);
}

fn materials(mtl: &str) -> Result<MeshFile, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, SQUARE).unwrap();
    std::fs::write(folder.path().join("colours.mtl"), mtl).unwrap();
    read(&path, &Split::Materials, &mut |_, _| {}).map_err(|error| error.to_string())
}

#[test]
fn mtl_materials_become_matte_mirror_and_glass() {
    let file = materials("newmtl Red Paint\nKd 0.8 0.1 0.2\nNs 10\nnewmtl Clear\nd 0.1\nNi 1.4\n").unwrap();
    assert_eq!(counts(&file), [("Red Paint", 3, 2), ("Clear", 3, 1)]);
    let kind = |text: &str| {
        let file = materials(&format!("newmtl Clear\n{text}\n")).unwrap();
        (file.materials[0].kind.clone(), file.materials[0].emission)
    };
    let matte =
        |reflectance| (MaterialKind::Matte(MatteParameters { reflectance, roughness: 0.0 }), [0.0; 3]);
    let mirror = |reflectance| (MaterialKind::Mirror(MirrorParameters { reflectance }), [0.0; 3]);
    let glass = |ior, transmittance| {
        (MaterialKind::Glass(GlassParameters { ior, reflectance: [1.0; 3], transmittance }), [0.0; 3])
    };
    assert_eq!(kind("Kd 0.5 0.25 2"), matte([0.5, 0.25, 1.0]));
    assert_eq!(kind("Kd 0.5"), matte([0.5; 3]));
    assert_eq!(kind("Ka 1 1 1"), matte([0.8; 3]));
    assert_eq!(kind("Kd 0.5 0.5 0.5\nKs 0.5 0.5 0.5\nillum 2"), matte([0.5; 3]));
    assert_eq!(kind("Kd 0.5 0.5 0.5\nKs 0.75 0.5 0.25\nillum 3"), mirror([0.75, 0.5, 0.25]));
    assert_eq!(kind("Kd 0 0 0\nKs 1 1 1"), mirror([1.0; 3]));
    assert_eq!(kind("illum 7\nNi 2.5\nTf 0.5 1 1"), glass(2.5, [0.5, 1.0, 1.0]));
    // An illumination model says how light is transmitted, not whether: Maya writes this one for all opaque materials.
    assert_eq!(kind("illum 4\nKd 0.75 0.25 0.25\nKa 0 0 0\nTf 1 1 1\nNi 1"), matte([0.75, 0.25, 0.25]));
    assert_eq!(kind("illum 9\nKd 0.5"), matte([0.5; 3]));
    assert_eq!(kind("illum 4\nTf 0 0 0\nNi 0"), matte([0.8; 3]));
    assert_eq!(kind("illum 4\nNi 1.5\nd 1"), glass(1.5, [1.0; 3]));
    assert_eq!(kind("illum 4\nNi 1\nTf 0.5 1 1"), glass(1.5, [0.5, 1.0, 1.0]));
    assert_eq!(kind("illum 4\nNi 1\nd 0"), glass(1.5, [1.0; 3]));
    // With the usual model, the index has no effect: Blender writes one for everything.
    assert_eq!(kind("illum 2\nNi 1.45\nKd 0.5"), matte([0.5; 3]));
    // Exporters disagree about the meaning of a Tr of 1.
    for both in ["d 1\nTr 1", "Tr 1\nd 1"] {
        assert_eq!(kind(both), matte([0.8; 3]));
    }
    assert_eq!(kind("Tr 0.75"), glass(1.5, [1.0; 3]));
    assert_eq!(kind("d -halo 0.25"), glass(1.5, [1.0; 3]));
    assert_eq!(kind("Kd 1 1 1\nKe 2 3 4").1, [2.0, 3.0, 4.0]);
    // The distribution of the emission is unknown: in either order, and for this material alone.
    assert_eq!(kind("map_Ke lamp.png\nKe 2 3 4").1, [0.0; 3]);
    assert_eq!(kind("Ke 2 3 4\nmap_Ke lamp.png\nnewmtl b").1, [0.0; 3]);
    assert_eq!(kind("Ke 2 3 4\nmap_Kd wood.png\nnewmtl b\nmap_Ke lamp.png").1, [2.0, 3.0, 4.0]);
}

#[test]
fn losses_of_materials_are_noted() {
    let noted = |mtl: &str| {
        let file = materials(&format!("newmtl Red Paint\nnewmtl Clear\n{mtl}")).unwrap();
        file.notes.iter().map(Note::to_string).collect::<Vec<_>>()
    };
    assert_eq!(noted("Kd 1 0 0 # red\nKa 1 1 1\nNs 10\nsharpness 60\nillum 2\n"), [""; 0]);
    for (mtl, note) in [
        (
            "map_Kd wood#1.png\nbump rough.png\n",
            "textures are not read: 2, the first in line 3 of colours.mtl",
        ),
        ("d 0.75\n", "materials of an opacity from 0.5 are opaque: 1, in line 2 of colours.mtl"),
        (
            "d 0.25\nNi 1.45\n",
            "materials of an opacity below 0.5 are clear glass: 1, in line 2 of colours.mtl",
        ),
        (
            "Kd 1 1 1\nKs 1 1 1\nillum 3\n",
            "materials that reflect are perfect mirrors, without their diffuse colour: 1, in line 2 of colours.mtl",
        ),
        (
            "Kd 1 1 1\nKs 1 1 1\n",
            "highlights (Ks) are left out of matte materials: 1, in line 4 of colours.mtl",
        ),
        (
            "Kd spectral a.rfl\nKs xyz 1 1 1\n",
            "spectral curves and CIE colours are not read: 2, the first in line 3 of colours.mtl",
        ),
        (
            "Pr 0\nPm 0.5\n",
            "roughness, metalness, sheen and coats (Pr, Pm, Ps, Pc, aniso) are not read: 1, in line 4 of colours.mtl",
        ),
        ("gloss 1\n", "unknown statements are ignored: 1, in line 3 of colours.mtl"),
    ] {
        assert_eq!(noted(mtl), [note]);
    }
    let mark = materials("\u{feff}newmtl Red Paint\nKd 1 0 0\n").unwrap();
    assert_eq!(mark.materials[0].name, "Red Paint");
    assert_eq!(
        mark.notes.iter().map(Note::to_string).collect::<Vec<_>>(),
        ["materials missing from the libraries come from the scene: 1, in line 9"]
    );
}

#[test]
fn a_byte_order_mark_may_come_before_the_name_of_a_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, format!("\u{feff}{SQUARE}")).unwrap();
    std::fs::write(folder.path().join("colours.mtl"), "\u{feff}newmtl Red Paint\nnewmtl Clear\n").unwrap();
    let file = read(&path, &Split::Materials, &mut |_, _| {}).unwrap();
    let names: Vec<_> = file.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!((names, file.notes), (vec!["Red Paint", "Clear"], vec![]));
}

#[test]
fn repairs_of_materials_are_noted() {
    let noted = |mtl: &str| {
        let file = materials(&format!("newmtl Red Paint\nnewmtl Clear\n{mtl}")).unwrap();
        file.notes.iter().map(Note::to_string).collect::<Vec<_>>()
    };
    let index = "glass whose index of refraction (Ni) is missing, 1 or out of range gets 1.5";
    let range = "colours (Kd, Ks, Tf) out of the range from 0 to 1 are clamped";
    let emission = "emissions below 0 or above 2³⁰ are clamped";
    let opaque = "materials with a transparent illum (4, 6, 7, 9) but no transmission are matte";
    for (mtl, note) in [
        ("d 0\n", index),
        ("d 0\nNi 1\n", index),
        ("Tr 1\nNi 1e9\n", index),
        ("illum 4\nTf 0.5 1 1\n", index),
        ("Kd 0 2 0\n", range),
        ("Ks -1 0 0\n", range),
        ("illum 4\nNi 1.5\nTf 1 1 1.5\n", range),
        ("Kd nan 0 0\n", range),
        ("Ke 0 -1 0\n", emission),
        ("Ke 0 1e12 0\n", emission),
        ("illum 4\nKd 0.5 0 0\nTf 1 1 1\nNi 1\n", opaque),
        ("illum 9\n", opaque),
        (
            "illum 4\nNi 1.5\nKd 0.5 0 0\n",
            "materials that refract are clear glass, without their diffuse colour",
        ),
        ("Kd 0 0 0\nKs 1 1 1\n", "black materials with highlights (Ks) are perfect mirrors"),
    ] {
        let notes = noted(mtl);
        assert!(
            matches!(&notes[..], [one] if one.starts_with(&format!("{note}: 1, in line "))),
            "{mtl}: {notes:?}"
        );
    }
    let textures = "textures are not read: 1, in line 4 of colours.mtl";
    let dark = "materials with an emission texture do not emit: 1, in line 2 of colours.mtl";
    assert_eq!(noted("Ke 1 1 1\nmap_Ke lamp.png\n"), [textures, dark]);
    assert_eq!(noted("newmtl Clear\n"), ["materials with a repeated name are ignored"]);
    for lossless in [
        "",
        "Kd 0.5 0 1\n",
        "illum 2\nKd 0.5 0 0\nKs 0 0 0\nKe 0 0 0\nd 1\nNi 1.45\n",
        "illum 4\nNi 1.5\nTf 0.5 1 1\n",
    ] {
        assert_eq!(noted(lossless), [""; 0], "{lossless}");
    }
}

#[test]
fn a_line_may_name_several_libraries_or_one_with_blanks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, SQUARE.replacen("colours.mtl", "red.mtl  clear.mtl", 1)).unwrap();
    let write = |name: &str, mtl: &str| std::fs::write(folder.path().join(name), mtl).unwrap();
    let read = || {
        let file = read(&path, &Split::Materials, &mut |_, _| {}).unwrap();
        let names: Vec<_> = file.materials.into_iter().map(|material| material.name).collect();
        (names, file.notes.iter().map(Note::to_string).collect::<Vec<_>>())
    };
    let missing = |name: &str| {
        let path = folder.path().join(name);
        let left = "unreadable material libraries are ignored: 1, in line 1";
        format!("{left}: {}: there is no such file", path.display())
    };
    let left = "materials missing from the libraries come from the scene";
    assert_eq!(
        read(),
        (vec![], vec![missing("red.mtl  clear.mtl"), format!("{left}: 2, the first in line 7")])
    );
    write("red.mtl", "newmtl Red Paint\n");
    assert_eq!(
        read(),
        (vec!["Red Paint".into()], vec![missing("clear.mtl"), format!("{left}: 1, in line 9")])
    );
    write("clear.mtl", "newmtl Clear\n");
    assert_eq!(read(), (vec!["Red Paint".into(), "Clear".into()], vec![]));
    write("red.mtl  clear.mtl", "newmtl Both\n");
    assert_eq!(read().0, ["Both"]);
}

#[test]
fn invalid_libraries_are_reported_with_location_and_reason() {
    for (mtl, words) in [
        ("newmtl Clear\nKd 1 2", ["colours.mtl: line 2", "fewer than 3"]),
        ("newmtl Clear\n\nKd red green blue", ["colours.mtl: line 3", "\"red\" is not a number"]),
        ("newmtl Clear\nillum glass", ["colours.mtl: line 2", "\"glass\" is not an illumination model"]),
    ] {
        let error = materials(mtl).unwrap_err();
        for word in words {
            assert!(error.contains(word), "{error} lacks {word}");
        }
    }
    // A missing library costs no more than its colours, and nothing if they are not used.
    let file = read_split("no/a.obj", SQUARE.as_bytes(), &Split::Materials).unwrap();
    assert_eq!(counts(&file), [("Red Paint", 3, 2), ("Clear", 3, 1)]);
    let note = file.notes[0].to_string();
    assert!(note.ends_with(": 1, in line 1: no/colours.mtl: there is no such file"), "{note}");
    // Several of them are one kind.
    let many = format!("{}{SQUARE}", "mtllib a.mtl\n".repeat(150));
    let file = read_split("no/a.obj", many.as_bytes(), &Split::Materials).unwrap();
    let note = file.notes[0].to_string();
    assert!(
        note.ends_with("are ignored: 151, the first in line 1: no/a.mtl: there is no such file"),
        "{note}"
    );
    assert_eq!(read_split("no/a.obj", SQUARE.as_bytes(), &Split::Whole).unwrap().notes, []);
}

#[test]
fn corrupted_libraries_give_errors_or_materials_but_never_panics() {
    let good =
        "newmtl a\nKd 1 2 3\nKs 0.5\nNi 1.5\nd -halo 0.5\nTr 0.1\nillum 7\nKe 1 1 1\nnewmtl b\nTf 1 1 1\n";
    let stream = &mut Stream::new(22, 0, 0);
    let split = Split::Materials;
    for _ in 0..5000 {
        let mut bytes = good.as_bytes().to_vec();
        for _ in 0..stream.random_range(1..4) {
            let at = stream.random_range(0..bytes.len());
            match stream.random_range(0..3) {
                0 => bytes[at] = stream.random(),
                1 => bytes.truncate(at.max(1)),
                _ => bytes.insert(at, b"0123456789-/e \n\xff"[stream.random_range(0..15)]),
            }
        }
        let (mut parts, mut materials) = (Parts::new(&split), Vec::new());
        let mut watch = |_, _| {};
        let mut source = Source::new(Path::new("a.mtl"), &bytes[..], bytes.len() as u64, &mut watch);
        if mtl::read(&mut source, &mut parts, &mut materials).is_ok() {
            for FileMaterial { kind, emission, .. } in &materials {
                assert!(emission.iter().all(|e| (0.0..=f64::from(1_u32 << 30)).contains(e)));
                let (MaterialKind::Matte(MatteParameters { reflectance, .. })
                | MaterialKind::Mirror(MirrorParameters { reflectance })) = kind
                else {
                    continue;
                };
                assert!(reflectance.iter().all(|c| (0.0..=1.0).contains(c)));
            }
        }
    }
}
