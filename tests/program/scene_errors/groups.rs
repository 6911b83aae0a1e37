//! Groups and instances.

use super::*;

/// A grey sphere in a group in lines 4 to 6, then `text` from line 7.
fn with_group(text: &str) -> String {
    with_grey(&format!(
        "[[groups.tree.entities]]\nshape = {{ type = \"sphere\", center = [0, 0, 0], radius = 1 }}\nmaterial = \"grey\"\n{}",
        text.trim_start_matches('\n')
    ))
}

#[test]
fn groups_and_nested_groups_are_accepted() {
    let text = with_group(
        r#"
[[instances]]
group = "forest"
transform = { scale = 2, translate = [1, 2, 3] }
[[instances]]
name = "one"
group = "tree"
[[groups.forest.instances]]
group = "tree"
transform = { rotate = [0, 0, 90], translate = [1, 0, 0] }
"#,
    );
    let scene = parse(&text, "box.toml".as_ref()).expect("a scene").scene;
    let names: Vec<_> = scene.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["tree", "forest"]);
    let instances: Vec<_> = scene.instances.iter().map(|i| (i.name.as_str(), i.group, i.within)).collect();
    assert_eq!(instances, [("instance 1", 1, None), ("one", 0, None), ("instance 3", 0, Some(1))]);
    assert_eq!((scene.entities[0].within, scene.place_counts()), (Some(0), vec![2, 1]));
    let places = scene.group_places();
    let origin = places[1].transform.transform_point3(glam::DVec3::ZERO);
    assert!((origin - glam::DVec3::new(3.0, 2.0, 3.0)).length() < 1e-12, "{origin}");
}

broken!(
    group_misspelt,
    with_group("[[instances]]\ngroup = \"three\""),
    [r#"8:9: no group "three"; did you mean "tree"?"#]
);
broken!(
    group_where_there_is_none,
    "[[instances]]\ngroup = \"tree\"",
    [r#"2:9: no group "tree"; this file has no [groups.NAME]"#]
);
broken!(
    scale_beside_the_transform,
    with_group("[[instances]]\ngroup = \"tree\"\nscale = 2"),
    [
        r#"9:1: unknown key "scale" in an instance; "scale" belongs inside transform: transform = { scale = … }"#
    ]
);
broken!(
    instance_without_group,
    with_group("[[instances]]\nname = \"a\""),
    [r#"7:1: missing key "group" in an instance"#]
);
broken!(
    plane_in_a_group,
    with_grey(
        "[[groups.a.entities]]\nshape = { type = \"plane\", normal = [0, 0, 1], distance = 0 }\nmaterial = \"grey\""
    ),
    ["5:9: a plane is unbounded and cannot be in a group; a quad is a part of a plane"]
);
broken!(
    power_in_a_group,
    with_group("power = [1, 1, 1]"),
    ["7:9: power needs a surface outside of groups, which may have many instances; give emission instead"]
);
broken!(
    group_that_holds_itself,
    with_group("[[groups.tree.instances]]\ngroup = \"tree\""),
    [r#"8:9: group contains itself: tree → tree"#]
);
broken!(
    groups_that_hold_each_other,
    with_group(
        "[[groups.a.instances]]\ngroup = \"b\"\n[[groups.b.instances]]\ngroup = \"tree\"\n[[groups.b.instances]]\ngroup = \"a\""
    ),
    [r#"12:9: group contains itself: a → b → a"#]
);
broken!(
    group_made_flat,
    with_group("[[instances]]\ngroup = \"tree\"\ntransform = { scale = [1, 0, 1] }"),
    ["9:23: the transform is singular"]
);
broken!(
    group_sheared_too_much,
    with_group(
        "[[instances]]\ngroup = \"tree\"\ntransform = { matrix = [[1, 1e5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] }"
    ),
    ["9:13: the transform shears the group, or scales it unevenly, too much to trace rays in it"]
);
broken!(
    group_too_far_out,
    with_group("[[instances]]\ngroup = \"tree\"\ntransform = { scale = 1e9, translate = [1e18, 0, 0] }"),
    ["9:13: the group extends farther than 1e18, before or after its transform"]
);
broken!(
    group_too_small,
    with_group("[[instances]]\ngroup = \"tree\"\ntransform = { scale = 1e-16 }"),
    [
        "9:13: the transformed group is smaller than 1e-15 and would be invisible; give the transform a larger scale"
    ]
);
broken!(
    keys_of_a_group,
    with_grey("[groups.a]\nshapes = []"),
    [r#"5:1: unknown key "shapes" in a group; valid here: "entities", "instances""#]
);

#[test]
fn too_many_instances_by_nesting_are_rejected() {
    let mut text = with_group("");
    for level in 0..9 {
        let held = if level == 0 { "tree".to_owned() } else { format!("g{}", level - 1) };
        for _ in 0..8 {
            text += &format!("\n[[groups.g{level}.instances]]\ngroup = \"{held}\"");
        }
    }
    text += "\n[[instances]]\ngroup = \"g8\"\n";
    let error = parse(&text, "box.toml".as_ref()).expect_err("a scene came of it").to_string();
    assert!(error.contains("instances of groups") && error.contains("16777216"), "{error}");
}

#[test]
fn groups_nest_at_most_sixteen_levels_deep() {
    let nested = |depth: usize| {
        let mut text = with_group("");
        for level in 0..depth {
            let held = if level == 0 { "tree".to_owned() } else { format!("g{}", level - 1) };
            text += &format!("\n[[groups.g{level}.instances]]\ngroup = \"{held}\"");
        }
        text += &format!("\n[[instances]]\ngroup = \"g{}\"\n", depth - 1);
        parse(&text, "box.toml".as_ref())
    };
    assert!(nested(16).is_ok());
    let error = nested(17).expect_err("a scene came of it").to_string();
    assert!(error.contains("\"g16\" is nested more than 16 levels deep"), "{error}");
}

#[test]
fn unused_groups_and_unsampled_emission_give_warnings() {
    let text = with_group(
        r#"
emission = [1, 1, 1]
[[groups.b.entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "grey"
[[instances]]
group = "tree"
transform = { scale = [1, 2, 1] }
"#,
    );
    let warnings = parse(&text, "box.toml".as_ref()).expect("a scene").warnings;
    let told: Vec<_> = warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told.iter().any(|told| told.contains("group \"b\" is not used")), "{told:?}");
    assert!(told.iter().any(|told| told.contains("\"entity 1\" emits, but its instance")), "{told:?}");
    // Negative control: uniform scale.
    let text = text.replace("scale = [1, 2, 1]", "scale = 2");
    let warnings = parse(&text, "box.toml".as_ref()).expect("a scene").warnings;
    assert_eq!(warnings.len(), 1, "{warnings:?}");
}

#[test]
fn a_shape_with_a_transform_becomes_a_group() {
    let text = with_group(
        r#"
[[groups.tree.entities]]
shape = { type = "box", min = [0, 0, 0], max = [1, 1, 1], transform = { rotate = [0, 0, 45] } }
material = "grey"
[[entities]]
name = "egg"
shape = { type = "sphere", center = [0, 0, 1], radius = 1, transform = { scale = [1, 1, 2] } }
material = "grey"
[[instances]]
group = "tree"
"#,
    );
    let scene = parse(&text, "box.toml".as_ref()).expect("a scene").scene;
    let names: Vec<_> = scene.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["egg", "entity 3", "tree"]);
    let withins: Vec<_> = scene.entities.iter().map(|entity| entity.within).collect();
    assert_eq!(withins, [Some(0), Some(2), Some(1)]);
    let instances: Vec<_> = scene.instances.iter().map(|i| (i.group, i.within)).collect();
    assert_eq!(instances, [(2, None), (0, None), (1, Some(2))]);
    assert_eq!(scene.place_counts(), [1, 1, 1]);
    let top = scene.instances[1].transform.transform_point3(glam::DVec3::Z);
    assert!((top - glam::DVec3::Z * 2.0).length() < 1e-12, "{top}");
}

broken!(
    transform_of_a_plane,
    entity(r#"{ type = "plane", normal = [0, 0, 1], distance = 0, transform = { scale = 2 } }"#, ""),
    [r#"5:61: unknown key "transform" in a plane; valid here: "type", "normal", "distance""#]
);
broken!(
    power_with_a_transform,
    entity(
        r#"{ type = "sphere", center = [0, 0, 0], radius = 1, transform = { scale = [1, 2, 1] } }"#,
        "power = [1, 1, 1]"
    ),
    [
        "7:9: power needs a shape without a transform, as a transform may change its area; give emission instead"
    ]
);
broken!(
    shape_made_flat,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1, transform = { scale = [1, 0, 1] } }"#, ""),
    ["5:82: the transform is singular"]
);
