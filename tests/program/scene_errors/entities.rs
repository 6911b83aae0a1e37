//! Entities, lights, environment.

use super::*;
use stride::parameter::{Declaration, Family};
use stride::scene::Shape;

/// The names of all shapes, as messages list them.
fn shapes() -> String {
    Shape::DECLARATIONS
        .iter()
        .map(|shape| format!("{:?}, ", shape.name))
        .chain([r#""mesh""#.into()])
        .collect()
}

/// The shapes with a parameter of this name.
fn shapes_with(name: &str) -> String {
    let has_it = |shape: &&Declaration| shape.parameters.iter().any(|parameter| parameter.name == name);
    Shape::DECLARATIONS.iter().filter(has_it).map(|shape| shape.what).collect::<Vec<_>>().join(", ")
}

// Entities.
broken!(
    entity_without_shape,
    with_grey(
        r#"
[[entities]]
material = "grey"
"#
    ),
    [r#"4:1: missing key "shape" in an entity"#]
);
broken!(
    entity_without_material,
    r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
"#,
    [r#"1:1: missing key "material" in an entity"#]
);
broken!(
    keys_of_shapes_beside_the_shape,
    entity(r#"{ type = "mesh" }"#, "materials = \"file\"\nradius = 1"),
    [
        r#"5:9: missing key "file" in a mesh"#,
        r#"7:1: unknown key "materials" in an entity; "materials" belongs inside shape, as a key of a mesh"#,
        &format!(
            r#"8:1: unknown key "radius" in an entity; "radius" belongs inside shape, as a key of {}"#,
            shapes_with("radius")
        )
    ]
);
broken!(
    material_misspelt,
    r#"
[materials.red]
type = "matte"
reflectance = [1, 0, 0]

[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "rad"
"#,
    [r#"7:12: no material "rad"; did you mean "red"?"#]
);
broken!(
    material_unlike_any,
    with_grey(
        r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "marble"
"#
    ),
    [r#"6:12: no material "marble"; the materials are "grey""#]
);
broken!(
    material_where_there_is_none,
    r#"
[[entities]]
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "white"
"#,
    [r#"3:12: no material "white"; this file has no [materials.NAME]"#]
);
broken!(
    shape_without_type,
    entity("{ center = [0, 0, 0], radius = 1 }", ""),
    [&format!(r#"5:9: missing key "type" in shape; a shape is one of {}"#, shapes())]
);
broken!(
    shape_unknown,
    entity(r#"{ type = "torus" }"#, ""),
    [&format!(r#"5:18: unknown shape type "torus"; valid here: {}"#, shapes())]
);
broken!(
    shape_by_another_programs_name,
    entity(r#"{ type = "cube" }"#, ""),
    [r#"5:18: unknown shape type "cube"; did you mean "box"?"#]
);
broken!(
    shape_by_its_format,
    entity(r#"{ type = "obj", file = "a.obj" }"#, ""),
    [r#"5:18: unknown shape type "obj"; a shape from a file is { type = "mesh", file = "NAME.obj" }"#]
);
broken!(
    disk_without_normal,
    entity(r#"{ type = "disk", center = [0, 0, 0], radius = 1 }"#, ""),
    [r#"5:9: missing key "normal" in a disk"#]
);
broken!(
    disk_with_a_zero_normal_and_radius,
    entity(r#"{ type = "disk", center = [0, 0, 0], normal = [0, 0, 0], radius = 0 }"#, ""),
    ["5:55: normal must not be zero in all of x, y, z", "5:75: radius must be above 0, not 0"]
);
broken!(
    cylinder_without_length,
    entity(r#"{ type = "cylinder", from = [0, 1, 0], to = [0, 1.0, -0.0], radius = 1 }"#, ""),
    ["5:53: to is the same point as from: the cylinder has no length"]
);
broken!(
    box_inside_out,
    entity(r#"{ type = "box", min = [0, 2, 0], max = [1, 1, 1] }"#, ""),
    ["5:48: max must be above min in each of x, y, z: there min is above it along y; swap the two"]
);
broken!(
    box_thinner_than_single_precision,
    entity(r#"{ type = "box", min = [1e9, 0, 0], max = [1000000001, 1, 1] }"#, ""),
    ["5:50: max must be above min in each of x, y, z: the box has no extent along x; a quad is flat"]
);
broken!(
    box_without_height,
    entity(r#"{ type = "box", min = [0, 1, 0], max = [1, 1, 1] }"#, ""),
    ["5:48: max must be above min in each of x, y, z: the box has no extent along y; a quad is flat"]
);
broken!(mesh_without_file, entity(r#"{ type = "mesh" }"#, ""), [r#"5:9: missing key "file" in a mesh"#]);
broken!(
    mesh_file_missing_is_said_once,
    r#"
entities = [
    { shape = { type = "mesh", file = "no/dragon.ply" }, material = "grey" },
    { shape = { type = "mesh", file = "no/dragon.ply" }, material = "grey" },
]
materials = { grey = { type = "matte", reflectance = [0.5, 0.5, 0.5] } }
"#,
    ["2:39: no/dragon.ply: there is no such file"]
);
broken!(
    mesh_of_another_format,
    entity(r#"{ type = "mesh", file = "Cargo.toml" }"#, ""),
    ["5:33: Cargo.toml: unknown kind of mesh file; supported are .ply, .obj, .glb and .gltf"]
);
broken!(
    transform_with_matrix_and_scale,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { scale = 2, matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] } }"#,
        ""
    ),
    ["5:76: the transform has both matrix and scale, rotate or translate; keep the matrix or the others"]
);
broken!(
    transform_that_flattens,
    entity(r#"{ type = "mesh", file = "a.ply", transform = { scale = [1, 0, 1] } }"#, ""),
    ["5:64: the transform is singular"]
);
broken!(
    transform_matrix_that_flattens,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 5]] } }"#,
        ""
    ),
    ["5:65: the transform is singular"]
);
broken!(
    transform_matrix_of_two_rows,
    entity(r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 0, 0, 0], [0, 1, 0, 0]] } }"#, ""),
    ["5:65: matrix must be an array of 3 rows of 4 numbers, not an array of 2"]
);
broken!(
    transform_matrix_of_three_columns,
    entity(
        r#"{ type = "mesh", file = "a.ply", transform = { matrix = [[1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]] } }"#,
        ""
    ),
    ["5:66: the first row of matrix must be an array of 4 numbers, not an array of 3"]
);
broken!(
    radius_zero,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 0 }"#, ""),
    ["5:57: radius must be above 0, not 0"]
);
broken!(
    radius_negative,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = -1 }"#, ""),
    ["5:57: radius must be above 0, not -1"]
);
broken!(
    radius_not_a_number,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = nan }"#, ""),
    ["5:57: radius must be a finite number, not nan"]
);
broken!(
    radius_too_small,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1e-30 }"#, ""),
    ["5:57: radius must be at least 1e-18, not 1e-30"]
);
broken!(
    radius_missing,
    entity(r#"{ type = "sphere", center = [0, 0, 0] }"#, ""),
    [r#"5:9: missing key "radius" in a sphere"#]
);
broken!(
    normal_zero,
    entity(r#"{ type = "plane", normal = [0, 0.0, -0.0], distance = 1 }"#, ""),
    ["5:36: normal must not be zero in all of x, y, z"]
);
broken!(
    quad_edge_zero,
    entity(r#"{ type = "quad", corner = [0, 0, 0], u = [0, 0, 0], v = [0, 1, 0] }"#, ""),
    ["5:50: u must not be zero in all of x, y, z"]
);
broken!(
    quad_edges_parallel,
    entity(r#"{ type = "quad", corner = [0, 0, 0], u = [1, 2, 0], v = [-2, -4, 0] }"#, ""),
    ["5:65: v is parallel to u: the quad has no area"]
);
broken!(
    emission_negative,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "emission = [1, 1, -1]"),
    ["7:19: blue of emission must be from 0 to 1073741824, not -1"]
);
broken!(
    emission_above_the_film,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, "emission = [2e9, 1, 1]"),
    ["7:13: red of emission must be from 0 to 1073741824, not 2e9"]
);
broken!(
    name_empty,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#, r#"name = """#),
    ["7:8: name must not be empty"]
);

// Lights.
broken!(
    light_without_position,
    r#"
[[lights]]
type = "point"
intensity = [1, 1, 1]
"#,
    [r#"1:1: missing key "position" in a point light"#]
);
broken!(
    light_type_unknown,
    r#"
[[lights]]
type = "pont"
"#,
    [r#"2:8: unknown light type "pont"; did you mean "point"?"#]
);
broken!(
    light_of_a_surface,
    "[[lights]]\ntype = \"area\"\n",
    [
        r#"2:8: unknown light type "area"; an area light is an entity with emission: [[entities]] with shape = { type = "sphere", center = [0, 0, 3], radius = 0.5 }, a material, and emission = [10, 10, 10]"#
    ]
);
broken!(
    light_from_everywhere,
    "[[lights]]\ntype = \"envmap\"\n",
    [
        r#"2:8: unknown light type "envmap"; light from all directions is the table [environment] with radiance = [1, 1, 1], or with file = "sky.exr""#
    ]
);
broken!(
    light_intensity_infinite,
    r#"
[[lights]]
type = "point"
position = [0, 0, 0]
intensity = [inf, 1, 1]
"#,
    ["4:14: red of intensity must be a finite number, not inf"]
);
broken!(
    environment_negative,
    "[environment]\nradiance = [-1, 0, 0]\n",
    ["2:13: red of radiance must be from 0 to 1073741824, not -1"]
);

// Power.
const BALL: &str = r#"{ type = "sphere", center = [0, 0, 0], radius = 1 }"#;
broken!(
    emission_and_power,
    entity(BALL, "emission = [1, 1, 1]\npower = [1, 1, 1]"),
    ["8:9: the entity has both emission and power; keep one of them"]
);
broken!(
    power_of_a_plane,
    entity(r#"{ type = "plane", normal = [0, 0, 1], distance = 0 }"#, "power = [1, 1, 1]"),
    ["7:9: power needs a bounded surface with an area; give emission instead"]
);
broken!(
    power_of_a_speck,
    entity(r#"{ type = "sphere", center = [0, 0, 0], radius = 1e-9 }"#, "power = [1, 0, 0]"),
    ["7:9: power gives a radiance of 2.53e16, above 1073741824"]
);
broken!(
    power_that_is_negative,
    entity(BALL, "power = [1, 1, -1]"),
    ["7:16: blue of power must be from 0 to 1e36, not -1"]
);
