//! Files that are rejected: contradictory ones, other versions, and invalid JSON.

use super::*;

#[test]
fn contradictions_are_reported_with_location_and_reason() {
    let huge = json!(1_u64 << 60);
    for (at, value, words) in [
        ("/asset/version", json!("1.0"), ["glTF version 1.0;", "version 2 is read"]),
        ("/extensionsRequired/0", json!("EXT_nurbs"), ["extensionsRequired[0]", "EXT_nurbs"]),
        ("/scene", json!(3), ["scene 3 is the default", "there is only 1"]),
        ("/scenes", json!([]), ["scene 0 is the default", "there are none"]),
        ("/scenes/0/nodes/0", json!(9), ["nodes[9]", "only 3"]),
        ("/nodes/0/children/1", json!(1), ["nodes[1]", "more than one parent"]),
        ("/nodes/0/children/1", json!(0), ["nodes[0]", "its own"]),
        ("/nodes/0/translation/0", json!(1e300), ["meshes[0].primitives[0]: vertex 0", "position"]),
        ("/nodes/1/rotation", json!([0, 0, 0, 0]), ["nodes[1]", "not finite"]),
        ("/nodes/1/mesh", json!(7), ["nodes[1]: it has mesh 7", "only 2"]),
        ("/meshes/0/primitives/0/material", json!(2), ["meshes[0].primitives[0]", "material 2"]),
        ("/meshes/0/primitives/0/indices", json!(99), ["accessor 99", "only 5"]),
        ("/meshes/0/primitives/0/indices", json!(0), ["accessor 0", "cannot be indices"]),
        ("/meshes/1/primitives/2/mode", json!(7), ["meshes[1].primitives[2]", "mode is 7, but"]),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(3), ["accessor 3", "does not fit"]),
        ("/accessors/0/count", huge.clone(), ["accessor 0", "declares 1152921504606846976"]),
        ("/accessors/0/count", json!(5), ["accessor 0", "declares 5"]),
        ("/accessors/0/byteOffset", json!(u64::MAX), ["accessor 0", "more than fit"]),
        ("/accessors/0/byteOffset", json!(4), ["accessor 0", "more than fit"]),
        ("/accessors/0/componentType", json!(5130), ["accessor 0", "unknown type 5130"]),
        ("/accessors/0/bufferView", json!(null), ["accessor 0 has no buffer view", "name the one with"]),
        ("/accessors/0/bufferView", json!(8), ["buffer view 8", "only 6"]),
        ("/accessors/1/count", json!(3), ["4 positions", "normals"]),
        ("/accessors/3/count", json!(7), ["accessor 3", "declares 7"]),
        ("/accessors/4/sparse/count", huge.clone(), ["accessor 4", "declares"]),
        (
            "/accessors/4/sparse/indices",
            json!({ "bufferView": 2, "byteOffset": 4, "componentType": 5121 }),
            ["accessor 4", "replaces element 255 of 4"],
        ),
        ("/bufferViews/0/byteLength", huge.clone(), ["buffer view 0", "of a buffer of 108"]),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), ["buffer view 0", "of a buffer of 108"]),
        ("/bufferViews/0/buffer", json!(1), ["buffer 1", "only 1"]),
        ("/bufferViews/1/byteStride", json!(2), ["elements of 3 bytes", "buffer view 1 holds 2"]),
        ("/buffers/0/byteLength", huge, ["108 bytes of 1152921504606846976", "truncated"]),
        ("/buffers/0/uri", json!("https://example.org/a.bin"), ["https://", "another machine"]),
        ("/buffers/0/uri", json!("data:;base64,?"), ["buffer 0", "invalid base64"]),
        ("/buffers/0/uri", json!("data:text/plain,a"), ["buffer 0", "not in base64"]),
        ("/meshes", json!(3), ["a.glb: meshes: it does not fit glTF 2.0", "(line 1, column "]),
        (
            "/accessors/1",
            json!({ "count": 4 }),
            ["a.glb: accessors[1]: it", "missing field `componentType` (line 1,"],
        ),
        ("/nodes", json!(vec![json!({}); (1 << 20) + 1]), ["a.glb: nodes", "maximum of 1048576"]),
        ("/meshes", json!([]), ["nodes[1]: it has mesh 0, but", "there are none"]),
        ("/nodes/0/children", json!([]), ["a.glb", "no triangle"]),
    ] {
        let mut document = document();
        document["buffers"][0]["uri"] = Value::Null;
        document["accessors"][0]["byteOffset"] = 0.into();
        document["bufferViews"][0]["byteOffset"] = 0.into();
        *document.pointer_mut(at).expect(at) = value.clone();
        let error = read_bytes("a.glb", &glb(&document, &binary())).expect_err("an error");
        for word in words {
            assert!(error.contains(word), "{at} = {value}: {error} lacks {word}");
        }
    }
    let good = glb(&document(), &binary());
    for (bytes, words) in [
        (b"glT".to_vec(), ["byte 0", "truncated"]),
        (b"glUF\x02\0\0\0\x0c\0\0\0".to_vec(), ["a.glb", "does not begin"]),
        (b"glTF\x01\0\0\0\x0c\0\0\0".to_vec(), ["version 1", "version 2"]),
        (b"glTF\x02\0\0\0\x0c\0\0\0".to_vec(), ["a.glb", "no JSON"]),
        (good[..good.len() - 1].to_vec(), ["a chunk of 108 bytes", "truncated"]),
        (good[..40].to_vec(), ["a chunk of", "only 20 are left"]),
    ] {
        let error = read_bytes("a.glb", &bytes).expect_err("an error");
        for word in words {
            assert!(error.contains(word), "{error} lacks {word}");
        }
    }
    let error = read_bytes("a.glb", &glb(&document(), &[&f32::NAN.to_le_bytes(), &binary()[4..]].concat()));
    assert!(error.as_ref().is_err_and(|e| e.contains("position") && e.contains("not a number")), "{error:?}");
    let mut indices = binary();
    indices[80] = 200;
    let error = read_bytes("a.glb", &glb(&document(), &indices)).unwrap_err();
    assert!(error.contains("vertex 200") && error.contains("only 4"), "{error}");
}

#[test]
fn the_version_is_checked_first() {
    // In glTF 1.0, nodes and meshes are objects.
    let error_of = |text: &str| read_bytes("a.gltf", text.as_bytes()).unwrap_err();
    for (version, named) in [("1.0", "1.0"), ("3.0", "3.0"), ("1\n", "1\\n")] {
        let document = json!({ "nodes": { "a": {} }, "meshes": {}, "asset": { "version": version } });
        let error = error_of(&document.to_string());
        assert_eq!(error, format!("a.gltf: this is glTF version {named}; version 2 is read"));
    }
    for text in [
        "{}",
        "[]",
        "3",
        r#"{ "asset": 2 }"#,
        r#"{ "nodes": {}, "asset": {} }"#,
        r#"{ "nodes": {}, "asset": { "version": 1.0 } }"#,
        r#"{ "asset": { "version": null } }"#,
    ] {
        let error = error_of(text);
        let missing = "a.gltf: the string \"asset.version\" is missing, as in some files of glTF 1.0; version 2 is read";
        assert_eq!(error, missing, "{text}");
    }
}

#[test]
fn invalid_json_is_reported_with_location_and_reason() {
    for (text, message) in [
        ("", "it is empty"),
        (" \n ", "it is empty"),
        ("{a: 3}", "key must be a string (line 1, column 2)"),
        // The structural error comes first, but is irrelevant without JSON.
        ("{ \"meshes\": 3,\n  a", "key must be a string (line 2, column 3)"),
        ("{\n\"asset\"", "EOF while parsing an object (line 2, column 7): it is truncated"),
    ] {
        let right = format!("this is not JSON: {message}");
        assert_eq!(read_bytes("a.gltf", text.as_bytes()).unwrap_err(), format!("a.gltf: {right}"));
        assert_eq!(read_bytes("a.glb", &chunk(text.as_bytes())).unwrap_err(), format!("a.glb: {right}"));
    }
    let text = r#"{ "asset": { "version": "2.0" }, "meshes": [{ "primitives": [{ "attributes": { "NORMAL": -1 } }] }] }"#;
    let error = read_bytes("a.gltf", text.as_bytes()).unwrap_err();
    let right = "a.gltf: meshes[0].primitives[0].attributes.NORMAL: it does not fit glTF 2.0: \
                 invalid value: integer `-1`, expected usize (line 1, column ";
    assert!(error.starts_with(right) && !error.contains("at line"), "{error}");
}

/// A `.glb` of a JSON chunk alone.
fn chunk(text: &[u8]) -> Vec<u8> {
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((20 + text.len() as u32).to_le_bytes());
    file.extend((text.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(text);
    file
}
