//! Extensions that are read, ignored with a note, or refused.

use super::*;

const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]];

#[test]
fn required_extensions_that_cannot_change_triangles_are_notes() {
    let required = |names: &[&str]| {
        let mut growing = Growing::triangle(CORNERS);
        growing.json["extensionsRequired"] = json!(names);
        growing.json["extensionsUsed"] = json!(names);
        growing
    };
    for (name, about) in [
        ("KHR_texture_transform", "textures"),
        ("KHR_texture_basisu", "textures"),
        ("EXT_texture_webp", "textures"),
        ("EXT_texture_avif", "textures"),
        ("MSFT_texture_dds", "textures"),
        ("KHR_materials_specular", "materials"),
        ("KHR_materials_variants", "materials"),
        ("KHR_lights_punctual", "lights"),
    ] {
        let growing = required(&[name]);
        assert_eq!(growing.positions(), CORNERS);
        let note =
            format!("the required extension {name:?}, for {about}, is not read: 1, in extensionsRequired[0]");
        assert_eq!(growing.notes(), [note]);
    }
    // Extensions that are read need no note.
    let read =
        ["KHR_mesh_quantization", "EXT_mesh_gpu_instancing", "KHR_node_visibility", "KHR_materials_ior"];
    assert_eq!(required(&read).notes(), [""; 0]);
    // Nor do those about which there are notes where a material has them.
    let of_materials = [
        "KHR_materials_unlit",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_volume",
        "KHR_materials_clearcoat",
    ];
    assert_eq!(required(&of_materials).notes(), [""; 0]);
    for (name, properties) in
        [("KHR_materials_clearcoat", json!({ "clearcoatFactor": 1 })), ("KHR_materials_specular", json!({}))]
    {
        let mut growing = required(&[name]);
        let metal = json!({ "roughnessFactor": 0 });
        growing.json["materials"] =
            json!([{ "pbrMetallicRoughness": metal, "extensions": { name: properties } }]);
        growing.json["meshes"][0]["primitives"][0]["material"] = 0.into();
        assert_eq!(growing.notes(), [format!("{name} is left out of materials: 1, in materials[0]")]);
    }
    let notes = required(&["KHR_xmp_json_ld"]).notes();
    assert!(notes[0].contains("\"KHR_xmp_json_ld\", which does not change the rest pose"), "{notes:?}");

    for name in ["KHR_gaussian_splatting", "KHR_accessor_float64", "CESIUM_RTC", "EXT_nurbs", "", "no"] {
        required(&["KHR_texture_transform", name]).error(&["extensionsRequired[1]", &format!("{name:?}")]);
    }
    required(&[&"x".repeat(1000)]).error(&[&format!("{:?} is not read", "x".repeat(60))]);
}

#[test]
fn used_extensions_that_may_change_triangles_are_notes() {
    let mut growing = Growing::triangle(CORNERS);
    growing.json["extensionsUsed"] = json!([
        "KHR_texture_transform",
        "CESIUM_RTC",
        "KHR_xmp_json_ld",
        "ACME_waves",
        "KHR_lights_punctual"
    ]);
    assert_eq!(
        growing.notes(),
        [
            "the extension \"CESIUM_RTC\", which may change the triangles, is not read: 1, in extensionsUsed[1]",
            "the extension \"ACME_waves\", which may change the triangles, is not read: 1, in extensionsUsed[3]",
        ]
    );
}

#[test]
fn draco_is_refused_unless_there_is_a_fallback() {
    let mut growing = Growing::triangle(CORNERS);
    let indices = growing.integers("SCALAR", 5121, false, &[2, 1, 0]);
    growing.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    let primitive = &mut growing.json["meshes"][0]["primitives"][0];
    primitive["indices"] = indices.into();
    primitive["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 0 } } });
    // The uncompressed accessors have data.
    assert_eq!(growing.read().unwrap().parts[0].1.triangles[..], [[2, 1, 0]]);
    assert_eq!(growing.notes(), [""; 0]);
    for required in [false, true] {
        for accessor in [0, indices] {
            let mut growing = Growing { json: growing.json.clone(), bytes: growing.bytes.clone() };
            if required {
                growing.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
            }
            growing.json["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
            growing.error(&[
                "meshes[0].primitives[0]: it is compressed by KHR_draco_mesh_compression",
                "write the file without compression",
                "gltf-transform copy",
            ]);
        }
    }
}

#[test]
fn meshopt_is_refused_unless_there_is_a_fallback() {
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        let mut growing = Growing::triangle(CORNERS);
        growing.json["extensionsRequired"] = json!([name]);
        growing.json["bufferViews"][0]["extensions"] = json!({ name: { "buffer": 0, "count": 3 } });
        // The buffer has the uncompressed bytes.
        assert_eq!(growing.positions(), CORNERS);
        // The uncompressed bytes would be in a buffer without data.
        growing.json["buffers"] =
            json!([{}, { "byteLength": 36, "extensions": { name: { "fallback": true } } }]);
        growing.json["bufferViews"][0]["buffer"] = 1.into();
        let words = ["meshes[0].primitives[0]: accessor 0", "gltf-transform copy"];
        growing.error(&[&[name][..], &words].concat());
        // The first buffer is not the binary chunk if it is marked as a fallback.
        growing.json["buffers"] = json!([{ "byteLength": 36, "extensions": { name: { "fallback": true } } }]);
        growing.json["bufferViews"][0]["buffer"] = 0.into();
        growing.error(&[&[name][..], &words].concat());
    }
}
