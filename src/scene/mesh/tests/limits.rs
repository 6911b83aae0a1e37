//! Limits on a mesh relative to the size of its file, and large files that must be accepted.

use super::*;
use serde_json::json;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

#[test]
fn separate_buffers_increase_the_limit() {
    // Every vertex is a corner of a triangle: others would be dropped.
    let count: usize = 139_998;
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let bytes: Vec<u8> = corners.iter().cycle().take(count).flatten().flat_map(|x| x.to_le_bytes()).collect();
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(), "uri": "large.bin" }],
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    std::fs::write(folder.path().join("large.bin"), bytes).unwrap();
    let file = read(&path, &Split::Whole, &mut |_, _| {}).map_err(|error| error.to_string()).unwrap();
    assert_eq!(file.parts[0].1.positions.len(), count);
}

#[test]
fn a_position_with_many_normals_takes_linear_time() {
    let count = 200_000;
    let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    (0..count).for_each(|i| writeln!(text, "vn {i} 0 1").unwrap());
    // Twice, so that each is looked for where it is.
    (0..2 * count).for_each(|i| writeln!(text, "f 1//{} 2 3", i % count + 1).unwrap());
    let start = Instant::now();
    let mesh = read_bytes("a.obj", text.as_bytes()).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (count + 2, 2 * count));
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        assert_eq!(mesh.normals[triangle[0] as usize], [(i % count) as f32, 0.0, 1.0]);
    }
    // Searching one long chain would take minutes.
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
}

#[test]
fn continued_lines_have_the_same_length_limit() {
    let read = |blanks: usize, between: &str| {
        let blanks = " ".repeat(blanks);
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3{blanks}{between}{blanks}1\n");
        read_bytes("a.obj", text.as_bytes()).map(|mesh| mesh.triangles.len())
    };
    for between in ["", "\\\n"] {
        assert_eq!(read(500_000, between), Ok(2), "{between:?}");
        let error = read(600_000, between).unwrap_err();
        assert!(error.contains("line") && error.contains("longer than 1 MiB"), "{between:?}: {error}");
    }
}

#[test]
fn empty_items_count_against_the_limit() {
    // Primitives without vertices, and one long name that all of them have.
    for (nodes, primitives, name) in [(1100, 1000, "a".to_owned()), (1, 3000, "a".repeat(100_000))] {
        let document = json!({
            "asset": { "version": "2.0" },
            "nodes": vec![json!({ "mesh": 0 }); nodes],
            "meshes": [{ "name": name, "primitives": vec![json!({ "attributes": {} }); primitives] }],
        });
        let error = read_bytes("a.gltf", document.to_string().as_bytes()).unwrap_err();
        assert!(error.contains("meshes[0].primitives[") && error.contains("more than 64 times"), "{error}");
    }
    // A triangle, one corner of which is replaced again and again.
    let replacing = 50_000;
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.resize(bytes.len() + 13 * replacing, 0);
    let placed = |nodes: usize| {
        let document = json!({
            "asset": { "version": "2.0" },
            "nodes": vec![json!({ "mesh": 0 }); nodes],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "accessors": [{
                "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "sparse": {
                    "count": replacing,
                    "indices": { "bufferView": 1, "componentType": 5121 },
                    "values": { "bufferView": 2 },
                },
            }],
            "bufferViews": [
                { "buffer": 0, "byteLength": 36 },
                { "buffer": 0, "byteOffset": 36, "byteLength": replacing },
                { "buffer": 0, "byteOffset": 36 + replacing, "byteLength": 12 * replacing },
            ],
            "buffers": [{ "byteLength": bytes.len() }],
        });
        read_bytes("a.glb", &gltf::glb(&document, &bytes)).map(|mesh| mesh.triangles.len())
    };
    assert_eq!(placed(40), Ok(40));
    let error = placed(500).unwrap_err();
    assert!(error.contains("more than 64 times"), "{error}");
}
