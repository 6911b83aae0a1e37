//! Morph targets at their default weights, skins in their rest pose, and copies of a mesh.

use super::*;

const CORNERS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]];

/// A triangle with two morph targets that move its third corner.
fn morphed() -> Growing {
    let mut growing = Growing::triangle(CORNERS);
    let left = growing.floats("VEC3", &[[0.0; 3], [0.0; 3], [-2.0, 2.0, 0.0]].concat());
    let up = growing.sparse(3, &[2], &[[1.0, 1.0, 4.0]]);
    growing.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{ "POSITION": left }, { "POSITION": up, "TANGENT": 99 }]);
    growing
}

#[test]
fn morph_targets_are_applied_by_their_default_weights() {
    let mut growing = morphed();
    // Without weights no target has an effect.
    assert_eq!(growing.positions(), CORNERS);
    growing.json["meshes"][0]["weights"] = json!([0.5, 0.25]);
    let [a, b, _] = CORNERS;
    assert_eq!(growing.positions(), [a, b, [0.25, 2.25, 1.0]]);
    // The weights of a node replace those of its mesh.
    growing.json["nodes"][0]["weights"] = json!([0, -1]);
    assert_eq!(growing.positions(), [a, b, [0.0, 0.0, -4.0]]);
    // The node's transform comes after the targets.
    growing.json["nodes"][0]["scale"] = json!([1, 1, 2]);
    assert_eq!(growing.positions(), [a, b, [0.0, 0.0, -8.0]]);
    assert_eq!(growing.notes(), [""; 0]);
    growing.json["nodes"][0]["weights"] = json!([0.5]);
    assert_eq!(growing.positions(), [a, b, [0.0, 2.0, 0.0]]);
    let note = "primitives have more or fewer morph targets than weights, and missing weights are 0: 1, \
                in meshes[0].primitives[0]";
    assert_eq!(growing.notes(), [note]);
}

#[test]
fn morph_targets_move_normals_and_may_be_quantised() {
    let mut growing = Growing::triangle(CORNERS);
    let normals = growing.floats("VEC3", &[[0.0, 0.0, 1.0]; 3].concat());
    growing.attribute("NORMAL", normals);
    let turned = growing.integers("VEC3", 5120, true, &[0, 0, 0, 0, 0, 0, 127, 0, -127]);
    let moved = growing.integers("VEC3", 5122, true, &[0, 0, 0, 32767, 0, 0, 0, 0, -32767]);
    let target = json!({ "POSITION": moved, "NORMAL": turned });
    growing.json["meshes"][0]["primitives"][0]["targets"] = json!([target]);
    growing.json["meshes"][0]["weights"] = json!([1]);
    let file = growing.read().expect("a mesh");
    let mesh = &file.parts[0].1;
    all_near(&mesh.positions, &[[0.0; 3], [3.0, 0.0, 0.0], [1.0, 1.0, -1.0]]);
    all_near(&mesh.normals, &[[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
}

#[test]
fn morph_targets_that_do_not_fit_are_errors() {
    let with = |targets: Value| {
        let mut growing = morphed();
        growing.floats("VEC3", &[0.0; 6]);
        growing.json["meshes"][0]["weights"] = json!([1, 1]);
        growing.json["meshes"][0]["primitives"][0]["targets"] = targets;
        growing
    };
    with(json!([{}, { "POSITION": 3 }]))
        .error(&["meshes[0].primitives[0]: targets[1]", "2 offsets for 3 vertices"]);
    with(json!([{ "POSITION": 4 }])).error(&["meshes[0].primitives[0]: targets[0]", "accessor 4", "only 4"]);
    let mut far = morphed();
    far.json["meshes"][0]["weights"] = json!([1e300, 0]);
    far.error(&["meshes[0].primitives[0]", "vertex 2", "position"]);
    // A target without data is zero, but must have as many elements as there are vertices.
    let mut zeros = with(json!([{ "POSITION": 4 }]));
    let count = 1_u64 << 60;
    zeros.accessor(json!({ "componentType": 5126, "count": count, "type": "VEC3" }));
    zeros.error(&["targets[0]", "accessor 4", "declares 1152921504606846976"]);
    zeros.json["accessors"][4]["count"] = 3.into();
    assert_eq!(zeros.positions(), CORNERS);
}

/// A rectangle with a skin of two joints. The second joint is 1 above the first, turned by a quarter about z, and
/// moves the upper two corners.
fn skinned() -> Growing {
    let mut growing = Growing::new();
    let positions = growing.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 2.0, 0.0]);
    let normals = growing.floats("VEC3", &[1.0, 0.0, 0.0].repeat(4));
    let indices = growing.integers("SCALAR", 5121, false, &[0, 1, 2, 0, 2, 3]);
    let joints = growing.integers("VEC4", 5121, false, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 9, 0, 0, 0, 1, 200, 0]);
    let weights = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]];
    let weights = growing.floats("VEC4", &weights.concat());
    let inverse = |y: f32| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -y, 0.0, 1.0];
    let inverse = growing.floats("MAT4", &[inverse(0.0), inverse(1.0)].concat());
    growing.json["scene"] = 0.into();
    growing.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    growing.json["nodes"] = json!([
        // The transform of the mesh's own node is ignored.
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0], "scale": [7, -7, 7] },
        { "children": [2], "translation": [0, 0, 5] },
        { "translation": [0, 1, 0], "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2] },
    ]);
    growing.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": inverse, "skeleton": 1 }]);
    growing.json["meshes"] = json!([{ "primitives": [{
        "attributes": { "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights },
        "indices": indices,
    }] }]);
    growing
}

#[test]
fn joints_move_the_vertices_of_a_skin() {
    let growing = skinned();
    let file = growing.read().expect("a mesh");
    let mesh = &file.parts[0].1;
    // The second joint takes (1, 2) to (1, 1), turns it to (−1, 1) and adds (0, 1). It takes (0, 2) to (−1, 1), and the
    // first joint leaves it: weights of a half give the middle.
    let right = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [-1.0, 2.0, 5.0], [-0.5, 1.5, 5.0]];
    all_near(&mesh.positions, &right);
    let diagonal = FRAC_1_SQRT_2 as f32;
    all_near(&mesh.normals, &[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [diagonal, diagonal, 0.0]]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(growing.notes(), [""; 0]);

    // Joints outside the scene have the transforms of their own parents.
    let mut outside = skinned();
    outside.json["scenes"] = json!([{ "nodes": [0] }]);
    all_near(&outside.positions(), &right);

    // Mirrored triangles have the other winding.
    let mut mirrored = skinned();
    mirrored.json["nodes"][1]["scale"] = json!([1, 1, -1]);
    let file = mirrored.read().expect("a mesh");
    all_near(&file.parts[0].1.positions, &right);
    assert_eq!(file.parts[0].1.triangles, [[0, 2, 1], [0, 3, 2]]);
}

#[test]
fn skins_without_matrices_and_with_more_than_four_joints_are_read() {
    let mut growing = skinned();
    growing.json["skins"][0].as_object_mut().unwrap().remove("inverseBindMatrices");
    // The second joint turns (1, 2) to (−2, 1) and (0, 2) to (−2, 0), and adds (0, 1).
    let right = [[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [-2.0, 2.0, 5.0], [-1.0, 1.5, 5.0]];
    all_near(&growing.positions(), &right);

    // The same in two sets, with weights in bytes and shorts.
    let zero = [0; 4];
    let joints = growing.integers("VEC4", 5123, false, &[zero, zero, [0, 0, 0, 1], [0, 0, 0, 1]].concat());
    let weights = growing.integers(
        "VEC4",
        5121,
        true,
        &[[255, 0, 0, 0], [255, 0, 0, 0], [0, 0, 0, 255], zero].concat(),
    );
    growing.attribute("JOINTS_0", joints);
    growing.attribute("WEIGHTS_0", weights);
    let joints = growing.integers("VEC4", 5121, false, &[zero, zero, zero, [1, 0, 0, 0]].concat());
    let weights = growing.integers("VEC4", 5123, true, &[zero, zero, zero, [32768, 32767, 0, 0]].concat());
    growing.attribute("JOINTS_1", joints);
    growing.attribute("WEIGHTS_1", weights);
    let are = growing.positions();
    let is_near = |a: [f32; 3], b: [f32; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < 1e-4);
    assert!(are.iter().zip(right).all(|(a, b)| is_near(*a, b)), "{are:?}");
    assert_eq!(growing.notes(), [""; 0]);
}

#[test]
fn skins_come_after_morph_targets() {
    let mut growing = skinned();
    let up = growing.floats("VEC3", &[[0.0; 3], [0.0; 3], [0.0, 0.0, 1.0], [0.0; 3]].concat());
    growing.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": up }]);
    growing.json["nodes"][0]["weights"] = json!([3]);
    near(growing.positions()[2], [-1.0, 2.0, 8.0]);
}

#[test]
fn skin_weights_are_repaired_with_a_note() {
    let with = |weights: [f32; 4]| {
        let mut growing = skinned();
        let all = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], weights, [0.5, 0.5, 0.0, 0.0]];
        let weights = growing.floats("VEC4", &all.concat());
        growing.attribute("WEIGHTS_0", weights);
        (growing.positions()[2], growing.notes())
    };
    for (weights, note) in [
        ([4.0, 0.0, 0.0, 0.0], "vertices whose skin weights do not add up to 1 have them scaled"),
        ([0.25, 0.0, 0.0, 0.0], "vertices whose skin weights do not add up to 1 have them scaled"),
        (
            [1.0, 0.0, -3.0, 0.0],
            "vertices with skin weights that are negative or not numbers have 0 for these",
        ),
        (
            [1.0, f32::NAN, 0.0, 0.0],
            "vertices with skin weights that are negative or not numbers have 0 for these",
        ),
        ([0.0; 4], "vertices whose skin weights are all 0 follow their first joint"),
    ] {
        let (position, notes) = with(weights);
        near(position, [-1.0, 2.0, 5.0]);
        assert_eq!(notes, [format!("{note}: 1, in meshes[0].primitives[0]")], "{weights:?}");
    }
    // Rounding errors give no note.
    assert_eq!(with([0.999, 0.0, 0.0, 0.0]).1, [""; 0]);
}

#[test]
fn wrong_skins_are_errors() {
    for (at, value, words) in [
        ("/nodes/0/skin", json!(1), ["skins[1]", "only 1"]),
        ("/skins/0/joints", json!([]), ["skins[0]", "no joints"]),
        ("/skins/0/joints/1", json!(9), ["skins[0]: nodes[9]", "only 3"]),
        ("/skins/0/joints", json!([1]), ["meshes[0].primitives[0]", "vertex 2 follows joint 1, but"]),
        ("/skins/0/joints", json!([1, 2, 2]), ["skins[0]", "2 inverse bind matrices for 3"]),
        ("/skins/0/inverseBindMatrices", json!(0), ["skins[0]", "accessor 0"]),
        // Cycles and second parents outside the scene.
        ("/nodes/2/children", json!([1]), ["skins[0]: nodes[", "its own"]),
        ("/nodes/2/children", json!([2]), ["skins[0]: nodes[2]", "more than one parent"]),
        ("/nodes/1/translation/0", json!(1e308), ["meshes[0].primitives[0]", "vertex 0"]),
        ("/nodes/2/rotation", json!([0, 0, 0, 0]), ["nodes[2]", "not finite"]),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(0), ["primitives[0]", "accessor 0"]),
        ("/accessors/3/count", json!(3), ["primitives[0]", "not as many joints"]),
    ] {
        let mut growing = skinned();
        growing.json["scenes"] = json!([{ "nodes": [0] }]);
        growing.json["nodes"][2]["children"] = json!([]);
        *growing.json.pointer_mut(at).expect(at) = value;
        growing.error(&words);
    }
    let mut lonely = skinned();
    let attributes = lonely.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
    attributes.remove("JOINTS_0");
    lonely.error(&["meshes[0].primitives[0]", "only one of JOINTS_0 and WEIGHTS_0"]);
    // Without joints and weights the node places the primitive.
    let attributes = lonely.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
    attributes.remove("WEIGHTS_0");
    near(lonely.positions()[2], [107.0, -14.0, 0.0]);
    let note = "primitives of skinned meshes without joints are placed by their node: 1, \
                in meshes[0].primitives[0]";
    assert_eq!(lonely.notes(), [note]);

    let mut nan = skinned();
    let matrices = nan.floats("MAT4", &[f32::NAN; 32]);
    nan.json["skins"][0]["inverseBindMatrices"] = matrices.into();
    nan.error(&["skins[0]", "joint 0", "not finite"]);
    let mut fraction = skinned();
    let joints = fraction.floats("VEC4", &[0.5; 16]);
    fraction.attribute("JOINTS_0", joints);
    fraction.error(&["vertex 0 follows joint 0.5"]);
}

/// A triangle with copies, on a node that is translated by 10 along x.
fn copied(attributes: impl FnOnce(&mut Growing) -> Value) -> Growing {
    let mut growing = Growing::triangle(CORNERS);
    growing.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let attributes = attributes(&mut growing);
    growing.json["nodes"][0]["translation"] = json!([10, 0, 0]);
    growing.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    growing
}

#[test]
fn copies_are_placed_by_their_attributes() {
    let at = [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]];
    let moved = copied(|growing| json!({ "TRANSLATION": growing.floats("VEC3", &at.concat()), "_ID": 99 }));
    let corners = |z: f32| [[10.0, 0.0, z], [12.0, 0.0, z], [11.0, 1.0, z]];
    assert_eq!(moved.positions(), [corners(1.0), corners(2.0)].concat());
    assert_eq!(moved.notes(), [""; 0]);
    let triangles = &moved.read().unwrap().parts[0].1.triangles;
    assert_eq!(triangles[..], [[0, 1, 2], [3, 4, 5]]);

    // Scale, rotation (of 16 bits) and translation; the second copy is turned by a quarter about z and mirrored.
    let all = copied(|growing| {
        let turn = [[0, 0, 0, 32767], [0, 0, 23170, 23170]];
        json!({
            "TRANSLATION": growing.floats("VEC3", &at.concat()),
            "ROTATION": growing.integers("VEC4", 5122, true, &turn.concat()),
            "SCALE": growing.floats("VEC3", &[3.0, 1.0, 1.0, 1.0, 2.0, -1.0]),
        })
    });
    let right = [
        [[10.0, 0.0, 1.0], [16.0, 0.0, 1.0], [13.0, 1.0, 1.0]],
        [[10.0, 0.0, 2.0], [10.0, 2.0, 2.0], [8.0, 1.0, 2.0]],
    ];
    all_near(&all.positions(), &right.concat());
    assert_eq!(all.read().unwrap().parts[0].1.triangles[..], [[0, 1, 2], [3, 5, 4]]);

    // Copies without attributes that place them coincide: one is read.
    assert_eq!(copied(|_| json!({ "_ID": 99 })).positions().len(), 3);
}

#[test]
fn wrong_copies_are_errors() {
    let both = |translations: usize, scales: usize| {
        copied(|growing| {
            json!({
                "TRANSLATION": growing.floats("VEC3", &vec![0.0; 3 * translations]),
                "SCALE": growing.floats("VEC3", &vec![1.0; 3 * scales]),
            })
        })
    };
    both(2, 3).error(&["nodes[0]", "scales of its copies differ"]);
    copied(|_| json!({ "TRANSLATION": 7 })).error(&["nodes[0]", "accessor 7"]);
    copied(|growing| json!({ "SCALE": growing.floats("VEC3", &[f32::INFINITY; 3]) })).error(&[
        "nodes[0]",
        "copy 0",
        "not finite",
    ]);
    copied(|growing| json!({ "ROTATION": growing.floats("VEC4", &[0.0; 4]) })).error(&[
        "nodes[0]",
        "copy 0",
        "not finite",
    ]);
    // Accessors without data take no bytes of the file, but count against the limit.
    for count in [4_000_000_u64, 1 << 40] {
        copied(|growing| {
            let zeros = json!({ "componentType": 5126, "count": count, "type": "VEC3" });
            json!({ "TRANSLATION": growing.accessor(zeros) })
        })
        .error(&["nodes[0]", if count < 1 << 30 { "more than 64 times" } else { "declares" }]);
    }
    // A few thousand copies of a triangle are within the limit.
    assert_eq!(both(3000, 3000).positions().len(), 9000);
}

#[test]
fn skinned_meshes_have_no_copies() {
    let mut growing = skinned();
    let three = growing.floats("VEC3", &[1.0; 9]);
    growing.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": three } } });
    assert_eq!(growing.positions().len(), 4);
    assert_eq!(growing.notes(), ["only one copy of each skinned mesh is read: 1, in nodes[0]"]);
}

#[test]
fn poses_count_against_the_limit() {
    // Many targets on many nodes, with a weight of 0 and without data.
    for weight in [0, 1] {
        let mut growing = Growing::triangle(CORNERS);
        let zero = growing.accessor(json!({ "componentType": 5126, "count": 3, "type": "VEC3" }));
        growing.json["nodes"] = vec![json!({ "mesh": 0 }); 10_000].into();
        let targets = vec![json!({ "POSITION": zero }); 2000];
        growing.json["meshes"][0]["primitives"][0]["targets"] = targets.into();
        growing.json["meshes"][0]["weights"] = vec![weight; 2000].into();
        growing.error(&["meshes[0].primitives[0]", "more than 64 times"]);
    }
    // Many sets of joints on many nodes.
    let mut growing = skinned();
    for set in 1..2000 {
        growing.attribute(&format!("JOINTS_{set}"), 3);
        growing.attribute(&format!("WEIGHTS_{set}"), 4);
    }
    growing.json["scenes"] = json!([{ "nodes": [0] }]);
    growing.json["nodes"][0]["children"] = (3..2000).collect();
    growing.json["nodes"].as_array_mut().unwrap().resize(2000, json!({ "mesh": 0, "skin": 0 }));
    growing.error(&["meshes[0].primitives[0]", "more than 64 times"]);
    // A long chain of joints takes linear time.
    let mut chain = skinned();
    let count = 200_000;
    let nodes = chain.json["nodes"].as_array_mut().unwrap();
    nodes.extend((3..count).map(|i| json!({ "children": if i + 1 < count { vec![i + 1] } else { vec![] } })));
    chain.json["skins"][0] = json!({ "joints": (1..count).rev().collect::<Vec<_>>() });
    assert_eq!(chain.positions().len(), 4);
}

/// A file with a skin, morph targets and copies.
pub(in super::super) fn posed() -> Vec<u8> {
    let mut growing = skinned();
    let up = growing.sparse(4, &[2], &[[0.0, 0.0, 1.0]]);
    let more = growing.floats("VEC3", &[0.5; 12]);
    growing.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": up }, { "NORMAL": more }]);
    growing.json["meshes"][0]["weights"] = json!([0.5, 0.25]);
    let two = growing.floats("VEC3", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    growing.json["nodes"][2]["mesh"] = 0.into();
    growing.json["nodes"][2]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": two, "SCALE": two } } });
    growing.file()
}

#[test]
fn skins_targets_and_copies_work_together() {
    let mesh = read_bytes("a.glb", &posed()).expect("a mesh");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 6));
    near(mesh.positions[2], [-1.0, 2.0, 5.5]);
    // The second copy of (1, 2, 0.5) is scaled, translated, and then turned by its node.
    near(mesh.positions[4 + 4 + 2], [-15.0, 9.0, 14.0]);
}
