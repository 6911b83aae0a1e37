//! Valid files of all variants, invalid files of every kind, and randomly corrupted files.

use super::*;
use crate::sampling::Stream;
use crate::scene::description::{GlassParameters, MaterialKind, MatteParameters, MirrorParameters};
use rand::RngExt;
use std::sync::Arc;

mod gltf;
mod limits;
mod parts;
mod text;

fn read_split(name: &str, bytes: &[u8], split: &Split) -> Result<MeshFile, String> {
    parse(Path::new(name), bytes, bytes.len() as u64, split, &mut |_, _| {})
        .map_err(|error| error.to_string())
}

fn read_bytes(name: &str, bytes: &[u8]) -> Result<Mesh, String> {
    let file = read_split(name, bytes, &Split::Whole)?;
    let [(name, mesh)] = &file.parts[..] else { panic!("{} parts", file.parts.len()) };
    assert_eq!(name, "");
    Ok((**mesh).clone())
}

/// A pyramid: four triangles and a square below, with uv and normals.
fn pyramid() -> (Vec<[f32; 8]>, Vec<Vec<u32>>) {
    let corner = |x: f32, y: f32, z: f32| [x, y, z, x, y, z, 0.5 + x / 2.0, 0.5 + y / 2.0];
    let vertices = vec![
        corner(1.0, 1.0, 0.0),
        corner(-1.0, 1.0, 0.0),
        corner(-1.0, -1.0, 0.0),
        corner(1.0, -1.0, 0.0),
        corner(0.0, 0.0, 1.5),
    ];
    (vertices, vec![vec![0, 1, 4], vec![1, 2, 4], vec![2, 3, 4], vec![3, 0, 4], vec![3, 2, 1, 0]])
}

fn ply(format: &str) -> Vec<u8> {
    let (vertices, faces) = pyramid();
    let mut file = format!("ply\r\nformat {format} 1.0\ncomment a pyramid\nelement vertex 5\n").into_bytes();
    for name in ["x", "y", "z", "nx", "ny", "nz", "s", "t"] {
        file.extend(format!("property float {name}\n").bytes());
    }
    file.extend(b"property uchar red\nelement face 5\nproperty list uchar int vertex_indices\n");
    file.extend(b"element edge 1\nproperty list uint short ends\nproperty double w\nend_header\n");
    let text = format == "ascii";
    let little = format == "binary_little_endian";
    let mut put = |word: String, bytes: Vec<u8>| {
        if text {
            file.extend(word.bytes().chain(*b" "));
        } else {
            file.extend(if little { bytes } else { bytes.into_iter().rev().collect() });
        }
    };
    for vertex in &vertices {
        vertex.iter().for_each(|x| put(x.to_string(), x.to_le_bytes().to_vec()));
        put("200\n".into(), vec![200]);
    }
    for face in &faces {
        put(face.len().to_string(), vec![face.len() as u8]);
        for (i, corner) in face.iter().enumerate() {
            let end = if i + 1 == face.len() { "\n" } else { "" };
            put(format!("{corner}{end}"), corner.to_le_bytes().to_vec());
        }
    }
    put("2".into(), 2_u32.to_le_bytes().to_vec());
    put("0".into(), 0_i16.to_le_bytes().to_vec());
    put("-1".into(), (-1_i16).to_le_bytes().to_vec());
    put("0.25\n".into(), 0.25_f64.to_le_bytes().to_vec());
    file
}

const OBJ: &str = "# a pyramid\nmtllib none.mtl\no pyramid\nv 1 1 0\nv -1 1 0\nv -1 -1 0\nv 1 -1 0\nv 0 0 1.5 1\n\
    vt 0.5 0.5\nvn 0 0 1\ng sides\nusemtl red\ns off\nf 1 2 5\nf 2/1 3/1 -1/1\nf 3//1 4//1 5//-1\n\
    f 4/1/1 1/1/1 \\\n5/1/1\nf 4 3 2 1\n";

#[test]
fn ply_in_every_encoding_is_the_same_mesh() {
    let text = read_bytes("a.ply", &ply("ascii")).expect("a mesh");
    let (vertices, _) = pyramid();
    assert_eq!(text.positions, vertices.iter().map(|v| [v[0], v[1], v[2]]).collect::<Vec<_>>());
    assert_eq!(text.normals, vertices.iter().map(|v| [v[3], v[4], v[5]]).collect::<Vec<_>>());
    assert_eq!(text.uv, vertices.iter().map(|v| [v[6], v[7]]).collect::<Vec<_>>());
    assert_eq!(text.triangles.len(), 6);
    assert_eq!(text.triangles[..4], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
    for format in ["binary_little_endian", "binary_big_endian"] {
        assert_eq!(read_bytes("a.PLY", &ply(format)).as_ref(), Ok(&text), "{format}");
    }
}

#[test]
fn obj_has_corners_of_every_form() {
    let mesh = read_bytes("a.obj", OBJ.as_bytes()).expect("a mesh");
    assert_eq!(mesh.triangles.len(), 6);
    let at = |corner: u32| mesh.positions[corner as usize];
    for (triangle, corners) in mesh.triangles.iter().zip([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]) {
        let (vertices, _) = pyramid();
        assert_eq!(
            triangle.map(at),
            corners.map(|i: usize| [vertices[i][0], vertices[i][1], vertices[i][2]])
        );
    }
    // Some corners have uv, some have normals: uv count only if all corners have them.
    assert!(mesh.uv.is_empty());
    assert_eq!(mesh.normals[mesh.triangles[2][0] as usize], [0.0, 0.0, 1.0]);
    assert_eq!(mesh.normals[mesh.triangles[0][0] as usize], [0.0; 3]);
}

/// Twice the area of some triangles in the plane z = 0, with its sign.
fn area(triangles: &[[u32; 3]], positions: &[[f32; 3]]) -> f32 {
    let p = |i: u32| positions[i as usize];
    let twice = |[a, b, c]: [[f32; 3]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    triangles.iter().map(|corners| twice(corners.map(p)).abs() * twice(corners.map(p)).signum()).sum()
}

#[test]
fn concave_polygons_are_triangulated_inside() {
    let plane = |points: &[[f32; 2]]| points.iter().map(|[x, y]| [*x, *y, 0.0]).collect::<Vec<_>>();
    let dart = plane(&[[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]]);
    let comb = plane(&[
        [0.0, 0.0],
        [5.0, 0.0],
        [5.0, 3.0],
        [4.0, 1.0],
        [3.0, 3.0],
        [2.0, 1.0],
        [1.0, 3.0],
        [0.0, 1.0],
    ]);
    for mut points in [dart, comb] {
        for _ in 0..points.len() {
            points.rotate_left(1);
            let corners: Vec<u32> = (0..points.len() as u32).collect();
            let mut triangles = Vec::new();
            polygon::triangulate(&corners, &points, &mut triangles);
            assert_eq!(triangles.len(), points.len() - 2);
            let outline: f32 = (0..points.len())
                .map(|i| (points[i], points[(i + 1) % points.len()]))
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
                .sum();
            // The same winding and total area: none overlap.
            assert!(triangles.iter().all(|&t| area(&[t], &points) > 0.0), "{triangles:?}");
            assert!((area(&triangles, &points) - outline).abs() < 1e-5);
        }
    }
}

#[test]
fn invalid_files_are_rejected_with_location_and_reason() {
    let ply =
        |header: &str, body: &str| format!("ply\nformat ascii 1.0\n{header}end_header\n{body}").into_bytes();
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let face = "property list uchar int vertex_indices\n";
    let three = format!("element vertex 3\n{xyz}element face 1\n{face}");
    let huge = format!("element vertex {}\n{xyz}element face 1\n{face}", 1_u64 << 60);
    for (name, bytes, words) in [
        ("a.ply", b"solid".to_vec(), ["a.ply", "does not begin"]),
        ("a.ply", b"".to_vec(), ["a.ply", "does not begin"]),
        ("a.ply", b"ply\nformat ascii 1.0\n".to_vec(), ["end_header", "missing"]),
        ("a.ply", b"ply\nformat ebcdic 1.0\n".to_vec(), ["line 2", "ebcdic"]),
        ("a.ply", b"ply\nelement vertex x\n".to_vec(), ["line 2", "\"x\""]),
        ("a.ply", b"ply\nproperty float x\n".to_vec(), ["line 2", "before the first element"]),
        ("a.ply", b"ply\nelement vertex 1\nproperty half x\n".to_vec(), ["line 3", "half"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 zero\n3 0 1 2\n"), ["line 12", "zero"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1\n3 0 1 2 4 4 4 4 4\n"), ["line 13", "more numbers"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), ["vertex 3", "only 3"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), ["face 0", "-1"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 0\n9999999999 0 1 2\n"), ["9999999999", "length"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n"), ["vertex 1", "not a number"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 inf\n0 1 0\n3 0 1 2\n"), ["vertex 1", "position"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 0\n2 0 1\n"), ["a.ply", "no triangle"]),
        ("a.ply", ply(&huge, "0 0 0\n"), ["declares 1152921504606846976", "bytes"]),
        ("a.ply", ply("element vertex 0\n", ""), ["x, y and z", "vertices"]),
        ("a.obj", b"v 1 2\n".to_vec(), ["line 1", "fewer than 3"]),
        ("a.obj", b"v 0 0 0\nf 1 1 2\n".to_vec(), ["line 2", "number 2 of 1"]),
        ("a.obj", b"v 0 0 0\nf 1 1 0\n".to_vec(), ["line 2", "number 0"]),
        ("a.obj", b"v 0 0 0\nf 1 1 -2\n".to_vec(), ["line 2", "number -2"]),
        ("a.obj", b"v 0 0 0\nf 1 1 x\n".to_vec(), ["line 2", "\"x\""]),
        ("a.obj", b"v 0 0 0\nf 1 1\n".to_vec(), ["line 2", "fewer than three"]),
        ("a.obj", b"# nothing\n".to_vec(), ["a.obj", "no triangle"]),
        ("a.stl", b"solid".to_vec(), ["a.stl", ".ply"]),
        ("a.ply", ply(&three, "0 0 0\n1 0 0\n0 1 0\n3 0 1 1\n"), ["a.ply", "without area"]),
        ("a.obj", b"v 0 0 0\nv 1 1 1\nf 1 2 1\n".to_vec(), ["a.obj", "without area"]),
    ] {
        let error = read_bytes(name, &bytes).expect_err("an error");
        for word in words {
            assert!(error.contains(word), "{error} lacks {word}");
        }
    }
    let binary = self::ply("binary_little_endian");
    let cut = read_bytes("a.ply", &binary[..binary.len() - 9]).expect_err("an error");
    assert!(["declares", "truncated", "are left"].iter().any(|words| cut.contains(words)), "{cut}");
}

#[test]
fn corrupted_files_give_errors_or_meshes_but_never_panics() {
    let stream = &mut Stream::new(21, 0, 0);
    let files = [
        ("a.ply", ply("ascii")),
        ("a.ply", ply("binary_little_endian")),
        ("a.ply", ply("binary_big_endian")),
        ("a.obj", OBJ.as_bytes().to_vec()),
        ("a.glb", gltf::glb(&gltf::document(), &gltf::binary())),
        ("a.gltf", gltf::with_data()),
        ("a.glb", gltf::pose::posed()),
    ];
    let (mut meshes, mut errors) = (0, 0);
    for i in 0..30_000 {
        let (name, good) = &files[i % files.len()];
        let mut bytes = good.clone();
        for _ in 0..stream.random_range(1..4) {
            let at = stream.random_range(0..bytes.len());
            match stream.random_range(0..4) {
                0 => bytes[at] = stream.random(),
                1 => bytes.truncate(at.max(1)),
                2 => bytes.insert(at, b"0123456789-/ \n\xff"[stream.random_range(0..15)]),
                _ => {
                    bytes.remove(at);
                    bytes.push(b'\n');
                }
            }
        }
        match read_bytes(name, &bytes) {
            Ok(mesh) => {
                assert_eq!(mesh.check(), Ok(()));
                meshes += 1;
            }
            Err(_) => errors += 1,
        }
    }
    assert!(meshes > 1000 && errors > 1000, "{meshes} meshes, {errors} errors");
}
