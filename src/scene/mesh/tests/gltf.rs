//! glTF as text and as `.glb`: nodes, accessors and materials.

use super::*;
use data_encoding::BASE64;
use serde_json::{Value, json};
use std::f64::consts::FRAC_1_SQRT_2;

mod extensions;
mod materials;
mod notes;
pub(super) mod pose;
mod refused;

/// A document under construction, with the bytes of its buffer.
struct Growing {
    json: Value,
    bytes: Vec<u8>,
}

impl Growing {
    fn new() -> Growing {
        let json =
            json!({ "asset": { "version": "2.0" }, "accessors": [], "bufferViews": [], "buffers": [{}] });
        Growing { json, bytes: Vec::new() }
    }

    /// A document with a triangle as mesh 0 on node 0.
    fn triangle(corners: [[f32; 3]; 3]) -> Growing {
        let mut growing = Growing::new();
        let positions = growing.floats("VEC3", &corners.concat());
        growing.json["nodes"] = json!([{ "mesh": 0 }]);
        growing.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": positions } }] }]);
        growing
    }

    /// Adds a buffer view of some bytes.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().unwrap();
        views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend(bytes);
        views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        let accessors = self.json["accessors"].as_array_mut().unwrap();
        accessors.push(accessor);
        accessors.len() - 1
    }

    /// Adds an accessor of integers of one, two or four bytes.
    fn integers(&mut self, kind: &str, component: u32, normalized: bool, numbers: &[i64]) -> usize {
        let wide = [1, 1, 2, 2, 4, 4][component as usize - 5120];
        let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()[..wide].to_vec()).collect();
        let (view, count) = (self.view(&bytes), numbers.len() / components(kind));
        self.accessor(json!({
            "bufferView": view, "componentType": component, "normalized": normalized, "count": count, "type": kind,
        }))
    }

    fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        let (view, count) = (self.view(&bytes), numbers.len() / components(kind));
        self.accessor(json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind }))
    }

    /// Adds an accessor of vectors that are zero except for some that are replaced.
    fn sparse(&mut self, count: usize, places: &[u8], vectors: &[[f32; 3]]) -> usize {
        let places_view = self.view(places);
        let bytes: Vec<u8> = vectors.concat().iter().flat_map(|x| x.to_le_bytes()).collect();
        let values_view = self.view(&bytes);
        self.accessor(json!({
            "componentType": 5126, "count": count, "type": "VEC3",
            "sparse": {
                "count": places.len(),
                "indices": { "bufferView": places_view, "componentType": 5121 },
                "values": { "bufferView": values_view },
            },
        }))
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    fn file(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"][0]["byteLength"] = self.bytes.len().into();
        glb(&json, &self.bytes)
    }

    fn read(&self) -> Result<MeshFile, String> {
        read_split("a.glb", &self.file(), &Split::Whole)
    }

    /// The positions of the first part.
    #[track_caller]
    fn positions(&self) -> Vec<[f32; 3]> {
        self.read().expect("a mesh").parts[0].1.positions.clone()
    }

    #[track_caller]
    fn notes(&self) -> Vec<String> {
        self.read().expect("a mesh").notes.iter().map(Note::to_string).collect()
    }

    #[track_caller]
    fn error(&self, words: &[&str]) {
        let error = self.read().expect_err("an error");
        for word in words {
            assert!(error.contains(word), "{error} lacks {word}");
        }
    }
}

fn components(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => panic!("{kind}"),
    }
}

#[track_caller]
fn all_near(are: &[[f32; 3]], should_be: &[[f32; 3]]) {
    assert_eq!(are.len(), should_be.len());
    are.iter().zip(should_be).for_each(|(a, b)| near(*a, *b));
}

/// Two triangles of a square in the plane z = 0, with normals, uv, indices, and a position that sparse values move.
pub(super) fn binary() -> Vec<u8> {
    let mut bytes = Vec::new();
    for p in [[0.0_f32, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [0.0, 3.0, 0.0]] {
        bytes.extend(p.iter().flat_map(|x| x.to_le_bytes()));
    }
    // Normals as signed bytes, padded to four.
    bytes.extend([0, 0, 127, 0].repeat(4));
    // uv as unsigned shorts.
    for uv in [[0_u16, 0], [65535, 0], [65535, 65535], [0, 65535]] {
        bytes.extend(uv.iter().flat_map(|x| x.to_le_bytes()));
    }
    for index in [0_u16, 1, 2, 0, 2, 3] {
        bytes.extend(index.to_le_bytes());
    }
    bytes.extend([3_u8, 0, 0, 0]);
    bytes.extend([-1.0_f32, 3.0, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// A square with two instances: rotated, and mirrored by a matrix; a red metal and glass.
pub(super) fn document() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "extensionsRequired": ["KHR_mesh_quantization"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "children": [1, 2], "translation": [10, 0, 0] },
            // A quarter turn about z.
            { "name": "turned", "mesh": 0, "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2], "scale": [1, 2, 1] },
            { "mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 5, 1] },
        ],
        "meshes": [
            { "name": "square", "primitives": [{
                "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
            }] },
            { "name": "window", "primitives": [
                { "attributes": { "POSITION": 4 }, "indices": 3, "material": 1 },
                { "attributes": { "POSITION": 0 }, "mode": 1 },
                { "attributes": { "POSITION": 0 }, "mode": 6 },
            ] },
        ],
        "materials": [
            { "name": "red", "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.1, 0.2, 1] } },
            {
                "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorTexture": { "index": 0 } },
                "emissiveFactor": [1, 0.5, 0],
                "extensions": {
                    "KHR_materials_transmission": { "transmissionFactor": 1 },
                    "KHR_materials_ior": { "ior": 1.3 },
                    "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
                },
            },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5120, "count": 4, "type": "VEC3", "normalized": true },
            { "bufferView": 2, "componentType": 5123, "count": 4, "type": "VEC2", "normalized": true },
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" },
            {
                "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                "sparse": {
                    "count": 1,
                    "indices": { "bufferView": 4, "componentType": 5121 },
                    "values": { "bufferView": 5 },
                },
            },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 16, "byteStride": 4 },
            { "buffer": 0, "byteOffset": 64, "byteLength": 16 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 92, "byteLength": 4 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": 108 }],
    })
}

pub(super) fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    let chunks = [(&text[..], b"JSON"), (binary, b"BIN\0")];
    let len = 12 + chunks.iter().map(|(bytes, _)| 8 + bytes.len()).sum::<usize>();
    file.extend([2, len as u32].iter().flat_map(|x| x.to_le_bytes()));
    for (bytes, kind) in chunks {
        file.extend((bytes.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(bytes);
    }
    file
}

/// As text, with its buffer in a URI.
pub(super) fn with_data() -> Vec<u8> {
    let mut document = document();
    let data = format!("data:application/octet-stream;base64,{}", BASE64.encode(&binary()));
    document["buffers"][0]["uri"] = data.into();
    document.to_string().into_bytes()
}

#[track_caller]
fn near(a: [f32; 3], b: [f32; 3]) {
    assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-5), "{a:?} is not {b:?}");
}

#[test]
fn nodes_transform_triangles() {
    let mesh = read_bytes("a.glb", &glb(&document(), &binary())).expect("a mesh");
    // The square twice, and once as a fan without material.
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 6));
    // Scaled, turned, moved.
    for (i, p) in
        [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [4.0, 2.0, 0.0], [4.0, 0.0, 0.0]].into_iter().enumerate()
    {
        near(mesh.positions[i], p);
        near(mesh.normals[i], [0.0, 0.0, 1.0]);
    }
    assert_eq!(mesh.triangles[..2], [[0, 1, 2], [0, 2, 3]]);
    // Mirrored: wound the other way round. The last corner is the sparse one.
    near(mesh.positions[4], [10.0, 0.0, 5.0]);
    near(mesh.positions[7], [9.0, 3.0, 5.0]);
    assert_eq!(mesh.triangles[2..4], [[4, 6, 5], [4, 7, 6]]);
    // Those without normals are flat; uv, which some lack, none have.
    assert_eq!(mesh.normals[5], [0.0; 3]);
    assert!(mesh.uv.is_empty());
    assert_eq!(read_bytes("a.gltf", &with_data()), Ok(mesh));
}

#[test]
fn parts_have_the_materials_of_the_file() {
    let file = read_split("a.glb", &glb(&document(), &binary()), &Split::Materials).expect("a file");
    let names: Vec<_> = file.parts.iter().map(|(name, mesh)| (name.as_str(), mesh.triangles.len())).collect();
    assert_eq!(names, [("red", 2), ("material 1", 2), ("", 2)]);
    assert_eq!(file.parts[0].1.uv[2], [1.0, 1.0]);
    let [red, window] = &file.materials[..] else { panic!("{:?}", file.materials) };
    assert!(matches!(red.kind, MaterialKind::Conductor(_)) && red.name == "red", "{red:?}");
    let glass =
        MaterialKind::Glass(GlassParameters { ior: 1.3, reflectance: [1.0; 3], transmittance: [1.0; 3] });
    assert_eq!((&window.kind, window.emission), (&glass, [4.0, 2.0, 0.0]));
    assert_eq!(
        file.notes.iter().map(Note::to_string).collect::<Vec<_>>(),
        [
            "primitives of points or lines are left out: 1, in meshes[1].primitives[1]",
            "textures are not read: 1, in materials[1]",
            "rough glass becomes perfectly smooth: 1, in materials[1]",
            "thin-walled glass becomes solid, and refracts: 1, in materials[1]",
        ]
    );
    // The distribution of the emission is unknown.
    let mut document = document();
    document["materials"][1]["emissiveTexture"] = json!({ "index": 0 });
    let dark = read_split("a.glb", &glb(&document, &binary()), &Split::Materials).expect("a file");
    assert_eq!((&dark.materials[1].kind, dark.materials[1].emission), (&glass, [0.0; 3]));
    assert!(dark.notes.iter().any(|note| note.message == "materials with an emission texture do not emit"));
    // By the names of nodes and meshes.
    let split = Split::Named(vec!["window".into(), "turned".into()]);
    let file = read_split("a.glb", &glb(&self::document(), &binary()), &split).expect("a file");
    let names: Vec<_> = file.parts.iter().map(|(name, mesh)| (name.as_str(), mesh.triangles.len())).collect();
    assert_eq!(names, [("window", 4), ("turned", 2)]);
    assert_eq!(file.names, ["turned", "red", "window", "material 1"]);
}

#[test]
fn materials_with_one_name_stay_separate() {
    let names = [
        json!("Material"),
        json!(null),
        json!("Material"),
        json!("Material (2)"),
        json!(""),
        json!("material 1"),
        json!("Material"),
        json!("material 1"),
        json!("Material (2)"),
    ];
    let mut document = document();
    let red = |i: usize| json!([i as f64 / 10.0, 0, 0, 1]);
    document["materials"] = names
        .iter()
        .enumerate()
        .map(|(i, name)| {
            json!({ "name": name, "pbrMetallicRoughness": { "metallicFactor": 0, "baseColorFactor": red(i) } })
        })
        .collect();
    document["meshes"][1]["primitives"] = (0..names.len())
        .map(|i| json!({ "attributes": { "POSITION": 0 }, "indices": 3, "material": i }))
        .collect();
    document["nodes"][0]["children"] = json!([2]);
    let file = read_split("a.glb", &glb(&document, &binary()), &Split::Materials).expect("a file");
    let unique = [
        "Material",
        // Another has this name, and keeps it.
        "material 1 (2)",
        "Material (3)",
        "Material (2)",
        "material 4",
        "material 1",
        "Material (4)",
        "material 1 (3)",
        "Material (2) (2)",
    ];
    assert_eq!(file.parts.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), unique);
    for (i, material) in file.materials.iter().enumerate() {
        let reflectance = [i as f64 / 10.0, 0.0, 0.0];
        assert_eq!(
            (material.name.as_str(), &material.kind),
            (unique[i], &MaterialKind::Matte(MatteParameters { reflectance, roughness: 0.0 }))
        );
    }
}

#[test]
fn buffers_may_be_separate_files() {
    let folder = tempfile::tempdir().unwrap();
    let mut document = document();
    document["buffers"][0]["uri"] = "the%20square.bin".into();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let read = || read(&path, &Split::Whole, &mut |_, _| {}).map_err(|error| error.to_string());
    let error = read().unwrap_err();
    assert!(error.contains("a.gltf") && error.contains("the square.bin: there is no such file"), "{error}");
    let side = folder.path().join("the square.bin");
    std::fs::write(&side, &binary()[..100]).unwrap();
    let error = read().unwrap_err();
    assert!(error.contains("100 bytes of 108: it is truncated"), "{error}");
    std::fs::write(&side, binary()).unwrap();
    let file = read().unwrap();
    assert_eq!(file.parts[0].1.triangles.len(), 6);
}

#[test]
fn instances_in_a_small_file_are_limited() {
    let placed = |nodes: usize| {
        let mut growing = Growing::new();
        let positions = growing.sparse(100_000, &[1, 2], &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        growing.json["nodes"] = vec![json!({ "mesh": 0 }); nodes].into();
        growing.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": positions } }] }]);
        growing
    };
    // Each takes 3.6 MB.
    assert_eq!(placed(10).positions().len(), 999_990);
    placed(100)
        .error(&["meshes[0].primitives[0]", "repeat its meshes to more than 64 times its size and 256 MiB"]);
}
