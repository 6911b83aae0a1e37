//! What a file may make of its size, and what large files must be given.

use super::*;
use serde_json::json;

#[test]
fn large_buffers_beside_a_small_document_count_for_it() {
    let count: usize = 140_000;
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
