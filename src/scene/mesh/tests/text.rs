//! Text files with the irregularities of real exporters: they are read as intended, with notes.

use super::*;

/// A mesh, its notes, and twice its area if it lies in a plane of one height.
fn noted(name: &str, bytes: &[u8]) -> (Arc<Mesh>, Vec<String>) {
    let file = read_split(name, bytes, &Split::Whole).expect("a mesh");
    (Arc::clone(&file.parts[0].1), file.notes.iter().map(Note::to_string).collect())
}

fn none() -> Vec<String> {
    Vec::new()
}

/// The area of a mesh in the plane z = 0, and the same without signs.
fn areas(mesh: &Mesh) -> [f32; 2] {
    let each = |triangle: &[u32; 3]| area(&[*triangle], &mesh.positions) / 2.0;
    [mesh.triangles.iter().map(each).sum(), mesh.triangles.iter().map(|t| each(t).abs()).sum()]
}

#[test]
fn polygons_with_bridges_and_spikes_have_the_area_of_their_inside() {
    let keyhole =
        "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    let spike = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 4 8 0\nv 0 4 0\nf 1 2 3 4 3 5\n";
    for (text, right) in [(keyhole, 12.0), (spike, 16.0)] {
        let (mesh, notes) = noted("a.obj", text.as_bytes());
        assert_eq!((areas(&mesh), notes), ([right; 2], none()));
    }
    let crossed = "v 0 0 0\nv 4 3 0\nv 4 0 0\nv 0 4 0\nf 1 2 3 4\nf 1 2 4\nf 1 1 2 2\n";
    assert_eq!(
        noted("a.obj", crossed.as_bytes()).1,
        [
            "self-intersecting faces are split into overlapping triangles: 1, in line 5",
            "faces without area are invisible: 1, in line 7"
        ]
    );
}

#[test]
fn statements_continue_but_comments_do_not() {
    let text = "# exported from C:\\models\\\nv 0 0 0\nv 1 0 0 # right \\\nv 0 1 0\nv 5 5 5\ng a#b\nf 1 \\\n2 3# a face\n";
    let file = read_split("a.obj", text.as_bytes(), &Split::Whole).unwrap();
    assert_eq!(file.parts[0].1.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!((file.names, file.notes), (vec!["a#b".to_owned()], Vec::new()));
}

#[test]
fn byte_order_marks_are_skipped() {
    let (mesh, notes) = noted("a.obj", "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n".as_bytes());
    assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(notes, none());
    let mut file = "\u{feff}".as_bytes().to_vec();
    file.extend(ply("ascii"));
    assert_eq!(read_bytes("a.ply", &file), read_bytes("a.ply", &ply("ascii")));
}

#[test]
fn comments_after_names_are_removed() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for key in ["usemtl", "g", "o"] {
        for comment in ["# C:\\a\\", "# x", "\t# x"] {
            let text = format!("{vertices}{key} red #2 one#2 {comment}\nf 1 2 3\nf 3 2 1\n");
            let file = read_split("a.obj", text.as_bytes(), &Split::Whole).unwrap();
            assert_eq!(
                (&file.names[..], file.parts[0].1.triangles.len()),
                (&["red #2 one#2".to_owned()][..], 2)
            );
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let obj = format!("mtllib a#1.mtl # C:\\a\\\n{vertices}usemtl red # C:\\a\\\nf 1 2 3\n");
    std::fs::write(&path, obj).unwrap();
    std::fs::write(folder.path().join("a#1.mtl"), "newmtl red # C:\\a\\\nKd 0.5 0.25 0.125\n").unwrap();
    let file = read(&path, &Split::Materials, &mut |_, _| {}).unwrap();
    assert_eq!((file.parts[0].0.as_str(), &file.notes[..]), ("red", &[][..]));
    let kind = MaterialKind::Matte(MatteParameters { reflectance: [0.5, 0.25, 0.125], roughness: 0.0 });
    assert_eq!((file.materials[0].name.as_str(), &file.materials[0].kind), ("red", &kind));
}

#[test]
fn smoothing_groups_without_normals_and_odd_uv_are_noted() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0.5 abc\nvt 0.25\nvt 0.75 0.5\n";
    let faces = "f 1/1 2/2 3/3\ns 1\nf 1/1 2/2 3/3\nf 1/1/1 2/2/1 3/3/1\nf 1/1 2/2 3/3/1\n";
    let flat = "s off\nf 1/1 2/2 3/3\ns 2\ns 0\nf 1/1 2/2 3/3\n";
    let (mesh, notes) = noted("a.obj", format!("{vertices}{faces}{flat}").as_bytes());
    assert_eq!(mesh.uv[..3], [[0.5, 0.0], [0.25, 0.0], [0.75, 0.5]]);
    assert_eq!(
        notes,
        [
            "an invalid second coordinate of uv is taken for 0: 1, in line 5",
            "faces of smoothing groups are flat without normals; export the file with normals to smooth them: 2, the first in line 10"
        ]
    );
}

#[test]
fn properties_of_ply_files_that_are_not_read_are_noted() {
    let header = |vertex: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}{vertex}element face 1\n\
             property list uchar int vertex_indices\nproperty float flags\nend_header\n"
        )
    };
    let body = |row: &str| format!("0 0 0{row}\n1 0 0{row}\n0 1 0{row}\n3 0 1 2 7\n");
    let read = |names: &[&str]| {
        let properties: String = names.iter().map(|name| format!("property float {name}\n")).collect();
        noted("a.ply", (header(&properties) + &body(&" 0.5".repeat(names.len()))).as_bytes())
    };
    let unknown = |names: &str, count: &str| format!("unknown properties are left out ({names}): {count}");
    assert_eq!(read(&["u", "v", "nx", "ny", "nz", "alpha"]).1[0], unknown("\"flags\"", "1, in line 15"));
    let (mesh, notes) = read(&["u", "nx", "nz", "a1", "a2", "a3", "a4", "a5"]);
    assert!(mesh.uv.is_empty() && mesh.normals.is_empty());
    assert_eq!(
        notes,
        [
            unknown("\"a1\", \"a2\", \"a3\", \"a4\", \"a5\", …", "6, the first in line 10"),
            "normals with fewer than three coordinates are left out: 3, the first in line 3".into(),
            "uv with a single coordinate are left out: 3, the first in line 3".into(),
        ]
    );
    // One of two names for the same is read.
    assert_eq!(read(&["u", "v", "s"]).1, [unknown("\"s\", \"flags\"", "2, the first in line 9")]);
}

#[test]
fn utf_16_is_refused_with_a_remedy() {
    let text = "# a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let units: Vec<u16> = text.encode_utf16().collect();
    let (little, big) =
        (units.iter().flat_map(|u| u.to_le_bytes()), units.iter().flat_map(|u| u.to_be_bytes()));
    let (little, big): (Vec<u8>, Vec<u8>) = (little.collect(), big.collect());
    for (mark, bytes) in [(&b"\xff\xfe"[..], &little), (b"\xfe\xff", &big), (b"", &little), (b"", &big)] {
        let error = read_bytes("a.obj", &[mark, bytes].concat()).unwrap_err();
        assert!(error.contains("UTF-16") && error.contains("save it as UTF-8"), "{error}");
    }
}

#[test]
fn all_line_endings_are_read() {
    let right = read_bytes("a.obj", OBJ.as_bytes());
    assert!(right.is_ok());
    for end in ["\r", "\r\n"] {
        assert_eq!(read_bytes("a.obj", OBJ.replace('\n', end).as_bytes()), right, "{end:?}");
    }
    // Copied once too often, each line has an empty one behind it.
    let twice = OBJ.replace("\\\n", "").replace('\n', "\r\r\n");
    assert_eq!(read_bytes("a.obj", twice.as_bytes()), right);
    let wrong = read_bytes("a.obj", b"v 0 0 0\rv 1 0 0\rv x 0 0\r").unwrap_err();
    assert!(wrong.contains("line 3"), "{wrong}");
    // What follows a header may begin with a line feed: 10 vertices' worth of corners, the first coordinate of which
    // has it for its lowest byte.
    let header = |end: &str| {
        let xyz = "property float x\nproperty float y\nproperty float z\n";
        let face = "element face 1\nproperty list uchar uchar vertex_indices\nend_header\n";
        format!("ply\nformat binary_little_endian 1.0\nelement vertex 3\n{xyz}{face}")
            .replace('\n', end)
            .into_bytes()
    };
    let x = f32::from_bits(0x3f80_000a);
    let body: Vec<u8> =
        [x, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    for end in ["\n", "\r\n", "\r"] {
        let file = [&header(end)[..], &body, &[3, 0, 1, 2]].concat();
        let mesh = read_bytes("a.ply", &file).unwrap();
        assert_eq!((mesh.positions[0], &mesh.triangles[..]), ([x, 0.0, 0.0], &[[0, 1, 2]][..]), "{end:?}");
    }
}

#[test]
fn invalid_numbers_affect_only_their_own_values() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for none in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND00", "inf", "1e60"] {
        let text = format!(
            "{vertices}vn 0 0 1\nvn 0 0 {none}\nvt {none} 0\nvt 1 1\nvt 0 {none}\nf 1/1/1 2/2/2 3/3/1\n"
        );
        let (mesh, notes) = noted("a.obj", text.as_bytes());
        assert_eq!(mesh.uv, [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]], "{none}");
        assert_eq!(mesh.normals, [[0.0, 0.0, 1.0], [0.0; 3], [0.0, 0.0, 1.0]], "{none}");
        assert_eq!(
            notes,
            [
                "normals that are not numbers are ignored; shading is flat there: 1, in line 5",
                "uv that are not numbers, or larger than 10¹⁸, are taken for 0: 2, the first in line 6"
            ]
        );
        // The position of a vertex must be valid if a face uses it.
        let error = read_bytes("a.obj", format!("{vertices}v 0 0 {none}\nf 1 2 4\n").as_bytes()).unwrap_err();
        assert!(error.contains("position that is not a number"), "{error}");
    }
    // Such numbers of C libraries are neither comments nor missing.
    let unused = "v nan -nan nan\nv inf -inf inf\nv 1.#IND -1.#IND 1.#IND\nv 1.#INF -1.#INF 1.#INF\n";
    let used = format!("{unused}{vertices}f 5 6 7\n");
    assert_eq!(noted("a.obj", used.as_bytes()).0.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let error = read_bytes("a.obj", format!("{used}f 1 2 3 4\n").as_bytes()).unwrap_err();
    assert!(error.contains("position that is not a number"), "{error}");
    let long = noted("a.obj", format!("{vertices}vn 0 -1e30 1e30\nf 1//1 2//1 3//1\n").as_bytes());
    assert_eq!((long.0.normals[0], long.1), ([0.0, -1.0, 1.0], none()));
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0 0 0 1 0 0\nnan 0 0 0 0 1 0 0\n1 0 0 0 nan 1 1 0\n0 1 0 0 0 1 inf 1\n3 0 2 3\n";
    let (mesh, notes) = noted("a.ply", ply.as_bytes());
    // The second vertex is no face's.
    assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(
        (&mesh.normals[1], &mesh.uv[2], &mesh.triangles[..]),
        (&[0.0; 3], &[0.0; 2], &[[0, 1, 2]][..])
    );
    assert_eq!(
        notes,
        [
            "normals that are not numbers are ignored; shading is flat there: 1, in vertex 2 (counted from 0)",
            "uv that are not numbers, or larger than 10¹⁸, are taken for 0: 1, in vertex 3 (counted from 0)"
        ]
    );
}

#[test]
fn references_to_undefined_uv_and_normals_are_ignored() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/0/1 3/7/-2\nf 1//2 2 3\n";
    let (mesh, notes) = noted("a.obj", text.as_bytes());
    assert_eq!(mesh.triangles.len(), 2);
    assert_eq!(mesh.normals[..3], [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0; 3]]);
    assert_eq!(
        notes,
        [
            "references to undefined uv are ignored: 2, the first in line 6",
            "references to undefined normals are ignored: 2, the first in line 6",
            "uv are ignored in parts where some vertices have none"
        ]
    );
}

#[test]
fn other_contents_of_obj_files_are_noted() {
    let text = "v 0 0 0\nv 1 0 0 1\nv 0 1 0 1 0.5 0\nf 1 2\nf 1 2 3\nfo 3 2 1\nl 1 2\np 1\ns 1\nlod 2\n\
        cstype bezier\ndeg 3\ncurv 0 1 1 2 3\nparm u 0 1\nend\nsurf 0 1 0 1 1 2 3\nusemap a\ncall b.obj\nfrobnicate\n\
        f 1\nf 1 1 2\n";
    let (mesh, notes) = noted("a.obj", text.as_bytes());
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0], [0, 0, 1]]);
    assert_eq!(
        notes,
        [
            "colours of vertices are not read: 1, in line 3",
            "faces of fewer than three corners are left out: 2, the first in line 4",
            "points and lines are left out: 2, the first in line 7",
            "curves and free-form surfaces are left out: 2, the first in line 13",
            "textures are not read: 1, in line 17",
            "calls of other files and programs are ignored: 1, in line 18",
            "unknown statements are ignored: 1, in line 19",
            "faces of smoothing groups are flat without normals; export the file with normals to smooth them: 1, in line 21",
            "faces without area are invisible: 1, in line 21"
        ]
    );
    let error = read_bytes("a.obj", b"v 0 0 0\nv 1 0 0\nl 1 2\n").unwrap_err();
    assert!(
        error.ends_with("there is no triangle in it; points and lines are left out: 1, in line 3"),
        "{error}"
    );
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

#[test]
fn strips_have_consistent_winding() {
    let header = |format: &str, lists: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 4\n{XYZ}element tristrips {lists}\nproperty list int int vertex_indices\nend_header\n"
        )
    };
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let mut binary = header("binary_little_endian", "1").into_bytes();
    binary.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
    binary.extend([5_i32, 0, 1, 2, 3, -1].iter().flat_map(|i| i.to_le_bytes()));
    let (mesh, notes) = noted("a.ply", &binary);
    assert_eq!((&mesh.triangles[..], areas(&mesh), notes), (&[[0, 1, 2], [2, 1, 3]][..], [1.0; 2], none()));
    // −1 begins anew, with the winding too; several lists are several strips; what is repeated is no face.
    let text = format!("{}0 0 0 1 0 0 0 1 0 1 1 0\n8 0 1 2 3 -1 0 1 2\n4 0 0 1 2\n", header("ascii", "2"));
    let (mesh, notes) = noted("a.ply", text.as_bytes());
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3], [0, 1, 2], [0, 0, 1], [1, 0, 2]]);
    assert_eq!(
        notes,
        ["elements not on lines of their own are read number by number: 3, the first in line 10"]
    );
    let error = read_bytes("a.ply", text.replace("-1", "-2").as_bytes()).unwrap_err();
    assert!(error.contains("strip 0") && error.contains("-2"), "{error}");
}

#[test]
fn elements_of_text_are_split_at_blanks() {
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let right = noted("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 2").as_bytes());
    assert_eq!((&right.0.triangles[..], &right.1[..]), (&[[0, 1, 2]][..], &[][..]));
    for (body, astray) in [
        ("0 0\n0 1 0\n0\n0 1 0\n3 0 1 2\n", "2, the first in line 10"),
        ("0 0 0 1 0 0 0 1 0\n3\n0 1 2\n", "3, the first in line 10"),
        ("0\n0\n0\n\n1\n0\n0\n0\n1\n0\n3\n0\n1\n2\n", "4, the first in line 10"),
        ("0 0 0 1 0 0 0 1 0 3 0 1 2", "3, the first in line 10"),
    ] {
        for end in ["\n", "\r"] {
            let (mesh, notes) = noted("a.ply", format!("{header}{body}").replace('\n', end).as_bytes());
            assert_eq!(*mesh, *right.0);
            let note = "elements not on lines of their own are read number by number";
            assert_eq!(notes, [format!("{note}: {astray}")], "{body:?}");
        }
    }
    let more = noted("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n\nthe end\n").as_bytes());
    assert_eq!(more.1, ["data after the last element is ignored: 1, in line 15"]);
    // Numbers that fit neither the lines nor the header.
    for (body, message) in [
        ("0 0 0 9\n1 0 0\n0 1\n0\n3 0 1 2\n", "line 14: there are more numbers than the header"),
        (
            "0 0\n1 0 0\n0 1 0 1 1.5 0 1 2\n",
            "line 12: 1.5 is not a length of the list \"vertex_indices\": from line 10 on, lines have more or fewer numbers",
        ),
    ] {
        let error = read_bytes("a.ply", format!("{header}{body}").as_bytes()).unwrap_err();
        assert!(error.contains(message), "{body:?}: {error}");
    }
    let error =
        read_bytes("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n-1 0 1 2\n").as_bytes()).unwrap_err();
    assert!(error.ends_with("line 13: -1 is not a length of the list \"vertex_indices\""), "{error}");
}

#[test]
fn surplus_numbers_on_lines_are_ignored() {
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}element nothing 9\nelement face 2\n\
         property list uchar int vertex_indices\nend_header\n"
    );
    let right = noted("a.ply", format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n").as_bytes());
    let message = "surplus numbers at the end of an element's line are ignored";
    for (body, surplus) in [
        // The numbers of a line might be two vertices.
        ("0 0 0 7 7 7\n1 0 0 7 7 7\n0 1 0 7 7 7\n3 0 1 2\n3 2 1 0\n", "3, the first in line 11"),
        // Or a part of a list, of a length that is none.
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0.5\n\n3 2 1 0 6 0.5\n", "2, the first in line 14"),
        ("0 0 0\n1 0 0\n0 1 0 a b\n\t\n3 0 1 2\n3 2 1 0", "1, in line 13"),
    ] {
        for end in ["\n", "\r", "\r\n"] {
            let (mesh, mut notes) = noted("a.ply", format!("{header}{body}").replace('\n', end).as_bytes());
            assert_eq!(mesh, right.0, "{body:?}");
            notes.retain(|note| !right.1.contains(note));
            assert_eq!(notes, [format!("{message}: {surplus}")], "{body:?}");
        }
    }
    // What follows the lines of all elements is none of them.
    let text = format!("{header}0 0 0 7\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0 7\nthe end\n");
    let notes = noted("a.ply", text.as_bytes()).1;
    assert!(notes.contains(&format!("{message}: 2, the first in line 11")), "{notes:?}");
    assert!(notes.contains(&"data after the last element is ignored: 1, in line 16".into()), "{notes:?}");
}

#[test]
fn unknown_header_lines_of_ply_files_are_noted() {
    let named = "Created by Blender3D 247 - www.blender.org, source file:";
    let file = String::from_utf8(ply("ascii")).unwrap();
    let right = noted("a.ply", file.as_bytes());
    let (mesh, notes) = noted("a.ply", file.replace("comment a pyramid", named).as_bytes());
    assert_eq!(mesh, right.0);
    let note = "unknown header lines are ignored: 1, in line 3";
    assert_eq!(notes, [&[note.to_owned()], &right.1[..]].concat());
    // Those of a known beginning count.
    for wrong in ["format ascii 2.0", "element vertex", "property", "end_header 3"] {
        let error = read_bytes("a.ply", file.replace("comment a pyramid", wrong).as_bytes()).unwrap_err();
        assert!(error.contains(&format!("line 3: unknown header line \"{wrong}\"")), "{error}");
    }
}

#[test]
fn other_contents_of_ply_files_are_noted() {
    let text = format!(
        "ply\nformat ascii 1.0\ncomment TextureFile wood.png\nelement vertex 4\n{XYZ}property uchar red\nproperty float quality\n\
         element face 5\nproperty list uchar int vertex_index\nproperty list uchar float texcoord\nproperty uchar green\n\
         element edge 2\nproperty int vertex1\nelement range_grid 1\nproperty int n\nend_header\n\
         0 0 0 1 0\n1 0 0 1 0\n0 1 0 1 0\n1 1 0 1 0\n\
         2 0 1 0 9\n4 0 1 3 2 0 9\n3 0 1 1 0 9\n0 0 9\n4 0 0 1 1 0 9\n1\n2\n3\n"
    );
    let (mesh, notes) = noted("a.ply", text.as_bytes());
    assert_eq!(mesh.triangles.len(), 5);
    assert_eq!(
        notes,
        [
            "textures are not read: 1, in line 3",
            "unknown properties are left out (\"quality\"): 1, in line 9",
            "colours of vertices are not read: 4, the first in line 4",
            "colours of faces are not read: 5, the first in line 10",
            "uv of faces' corners are not read: 5, the first in line 10",
            "faces of fewer than three corners are left out: 2, the first in face 0 (counted from 0)",
            "points and lines are left out: 2, the first in line 14",
            "unknown elements are left out: 1, in line 16",
            "faces without area are invisible: 2, the first in face 2 (counted from 0)"
        ]
    );
}
