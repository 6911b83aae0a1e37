//! Notes about nodes, scenes and primitives: one for each kind.

use super::*;

const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]];

#[test]
fn omissions_from_a_scene_are_noted() {
    let mut growing = Growing::triangle(CORNERS);
    growing.json["scene"] = 1.into();
    let image_based = json!({ "EXT_lights_image_based": { "light": 0 } });
    growing.json["scenes"] = json!([{ "nodes": [4] }, { "nodes": [0], "extensions": image_based }, {}]);
    let light = json!({ "KHR_lights_punctual": { "light": 0 } });
    growing.json["nodes"] = json!([
        { "children": [1, 2, 3], "camera": 0 },
        { "extensions": light, "mesh": 0 },
        { "extensions": light, "camera": 1 },
        { "extensions": { "KHR_node_visibility": { "visible": false } }, "mesh": 0, "children": [6] },
        { "mesh": 0, "camera": 0 },
        { "mesh": 0 },
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": true } } },
    ]);
    growing.json["animations"] = json!([
        { "channels": [], "samplers": [] },
        { "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }], "samplers": [{}] },
    ]);
    assert_eq!(growing.positions(), CORNERS);
    assert_eq!(
        growing.notes(),
        [
            "scenes other than the default one are left out: 2, the first in scenes[0]",
            "lights are left out: 3, the first in scenes[1]",
            "cameras are left out: 2, the first in nodes[0]",
            "meshes of hidden nodes are left out: 2, the first in nodes[3]",
            "meshes of nodes outside the scene are left out: 2, the first in nodes[4]",
            "animations are left out; the rest pose is rendered: 1, in animations[1]",
        ]
    );
}

#[test]
fn omissions_from_primitives_are_counted_once_however_often_a_mesh_is_placed() {
    let mut growing = Growing::triangle(CORNERS);
    let two = growing.integers("SCALAR", 5121, false, &[0, 1]);
    let four = growing.integers("SCALAR", 5121, false, &[0, 1, 2, 0]);
    let colours = growing.integers("VEC4", 5121, true, &[255; 12]);
    growing.json["meshes"][0]["primitives"] = json!([
        { "attributes": { "POSITION": 0, "COLOR_0": colours }, "indices": four },
        { "attributes": { "POSITION": 0 }, "indices": two, "mode": 5 },
        { "attributes": { "POSITION": 0 }, "indices": four, "mode": 6 },
        { "attributes": { "POSITION": 0 }, "mode": 0 },
        { "attributes": { "POSITION": 0 }, "mode": 3 },
        { "attributes": { "NORMAL": 0 } },
    ]);
    // Two nodes place the mesh.
    growing.json["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0 }]);
    let file = growing.read().expect("a mesh");
    assert_eq!(file.parts[0].1.triangles.len(), 2 * (1 + 2));
    assert_eq!(
        growing.notes(),
        [
            "colours of vertices are not read: 3, the first in meshes[0].primitives[0]",
            "incomplete triangles are left out: 2, the first in meshes[0].primitives[0]",
            "primitives of points or lines are left out: 2, the first in meshes[0].primitives[3]",
            "primitives without positions are left out: 1, in meshes[0].primitives[5]",
        ]
    );
}

#[test]
fn normals_and_uv_that_are_not_numbers_are_left_out() {
    let mut growing = Growing::triangle(CORNERS);
    let normals = growing.floats("VEC3", &[0.0, 0.0, 2.0, f32::NAN, 0.0, 1.0, 0.0, 0.0, 0.0]);
    growing.attribute("NORMAL", normals);
    let uv = growing.floats("VEC2", &[0.5, 0.5, f32::INFINITY, 0.5, 0.25, f32::NAN]);
    growing.attribute("TEXCOORD_0", uv);
    let file = growing.read().expect("a mesh");
    assert_eq!(file.parts[0].1.normals, [[0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]]);
    assert_eq!(file.parts[0].1.uv, [[0.5, 0.5], [0.0; 2], [0.0; 2]]);
    assert_eq!(
        growing.notes(),
        [
            "normals of length 0 are ignored; shading is flat there: 1, in meshes[0].primitives[0]",
            "normals that are not numbers are ignored; shading is flat there: 1, in meshes[0].primitives[0]",
            "uv that are not numbers, or larger than 10¹⁸, are taken for 0: 2, the first in meshes[0].primitives[0]",
        ]
    );
}

#[test]
fn a_wrong_length_in_the_header_is_noted() {
    let growing = Growing::triangle(CORNERS);
    assert_eq!(growing.notes(), [""; 0]);
    for length in [0, 12, u32::MAX] {
        let mut file = growing.file();
        file[8..12].copy_from_slice(&length.to_le_bytes());
        let file = read_split("a.glb", &file, &Split::Whole).unwrap();
        let notes: Vec<_> = file.notes.iter().map(Note::to_string).collect();
        let note =
            "the length in the header differs from that of the file, which is read to its end: 1, at byte 8";
        assert_eq!(notes, [note]);
    }
}

#[test]
fn matrices_that_are_not_affine_are_noted() {
    let mut growing = Growing::triangle(CORNERS);
    growing.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    assert_eq!(growing.positions(), CORNERS);
    let note = "the last row of matrices is read as 0 0 0 1: 1, in nodes[0]";
    assert_eq!(growing.notes(), [note]);
    growing.json["nodes"][0]["matrix"][3] = 1e-9.into();
    assert_eq!(growing.notes(), [""; 0]);
}

#[test]
fn sparse_indices_and_byte_order_marks_are_read() {
    let mut growing = Growing::triangle(CORNERS);
    let indices = growing.integers("SCALAR", 5121, false, &[0, 0, 0]);
    let places = growing.view(&[1, 2]);
    let values = growing.view(&[1, 2]);
    growing.json["accessors"][indices]["sparse"] = json!({
        "count": 2,
        "indices": { "bufferView": places, "componentType": 5121 },
        "values": { "bufferView": values },
    });
    growing.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
    let file = growing.read().expect("a mesh");
    assert_eq!(file.parts[0].1.triangles[..], [[0, 1, 2]]);
    growing.json["accessors"][indices]["count"] = 2.into();
    growing.error(&["accessor 1 replaces element 2 of 2"]);

    // A byte-order mark is skipped.
    let marked = [b"\xef\xbb\xbf", &with_data()[..]].concat();
    assert_eq!(read_bytes("a.gltf", &marked), read_bytes("a.gltf", &with_data()));
}

#[test]
fn a_second_set_of_uv_is_read_unless_it_is_invalid() {
    let mut growing = Growing::triangle(CORNERS);
    let second = [0.5, 0.25, 1.5, -2.0, 0.0, 1.0];
    let uv = growing.floats("VEC2", &second);
    growing.attribute("TEXCOORD_1", uv);
    let mesh = &growing.read().expect("a mesh").parts[0].1;
    assert_eq!((mesh.second_uv.as_flattened(), mesh.uv.len()), (&second[..], 0));
    assert_eq!(growing.notes(), [""; 0]);
    // Of another length, and of another type: the file is read without it.
    for broken in [growing.floats("VEC2", &second[..4]), growing.floats("VEC3", &second)] {
        growing.attribute("TEXCOORD_1", broken);
        assert!(growing.read().expect("a mesh").parts[0].1.second_uv.is_empty());
        let note = "second sets of uv that are invalid are left out: 1, in meshes[0].primitives[0]";
        assert_eq!(growing.notes(), [note]);
    }
}
