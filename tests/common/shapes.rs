// Samples of every kind of shape, and their transforms. Tests that concern all shapes take theirs from here. This file is
// included in modules with the library's shapes and their parameters, `Mesh`, `Arc`, `DAffine3`, `DMat3` and `DVec3`.

/// One shape of every kind, by name: around the origin, with a size of about one, oblique and of unequal sides, so that
/// no two numbers can be exchanged unnoticed. New kinds are appended, which leaves the materials of the others.
pub(crate) fn samples() -> Vec<(&'static str, Shape)> {
    let v = DVec3::new;
    let [a, b, c, d] = [[0.0, -1.6, -0.4], [0.5, -1.3, -0.4], [-0.4, -1.2, -0.3], [0.1, -1.4, 0.5]];
    let tetrahedron = Mesh {
        positions: vec![a, b, c, d],
        uv: vec![[0.0, 0.0], [1.0, 0.2], [0.3, 1.1], [0.7, 0.6]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
        ..Mesh::default()
    };
    vec![
        ("plane", PlaneParameters { normal: v(0.36, 0.48, 0.8), distance: 0.2 }.into()),
        ("sphere", SphereParameters { center: v(0.2, 0.1, 0.4), radius: 0.5 }.into()),
        (
            "quad",
            QuadParameters { corner: v(-1.2, -0.5, -0.6), u: v(0.8, 0.1, 0.2), v: v(0.1, 0.9, 0.3) }.into(),
        ),
        ("box", BoxParameters { min: v(0.9, -0.4, -0.5), max: v(1.5, 0.3, 0.4) }.into()),
        ("disk", DiskParameters { center: v(0.0, 1.2, 0.1), normal: v(0.6, 0.0, 0.8), radius: 0.5 }.into()),
        (
            "cylinder",
            CylinderParameters { from: v(-0.9, 0.9, -0.8), to: v(-0.7, 1.3, 0.5), radius: 0.25 }.into(),
        ),
        ("mesh", Shape::Mesh { mesh: Arc::new(tetrahedron), transform: DAffine3::IDENTITY }),
    ]
}

/// The samples that can be in a group, each with its bounds moved to `centre` and scaled to a diagonal of twice the
/// radius.
pub(crate) fn bounded_samples(centre: DVec3, radius: f64) -> Vec<(&'static str, Shape)> {
    let moved = |shape: &Shape| {
        let [low, high] = corners(shape);
        let scale = 2.0 * radius / high.distance(low);
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            glam::DQuat::IDENTITY,
            centre - (low + high) * (0.5 * scale),
        );
        placed(shape, &place).0.swap_remove(0)
    };
    let bounded = samples().into_iter().filter(|(_, shape)| is_bounded(shape));
    bounded.map(|(name, shape)| (name, moved(&shape))).collect()
}

/// The other samples.
pub(crate) fn unbounded_samples() -> Vec<(&'static str, Shape)> {
    samples().into_iter().filter(|(_, shape)| !is_bounded(shape)).collect()
}

/// Whether a shape can be in a group.
pub(crate) fn is_bounded(shape: &Shape) -> bool {
    !matches!(shape, Shape::Plane(_))
}

/// Whether every linear transform of a shape is a shape of the same kind, with the same uv. For all others this holds
/// if the transform is a similarity, and uv may be rotated.
pub(crate) fn is_linear(shape: &Shape) -> bool {
    matches!(shape, Shape::Quad(_) | Shape::Box(_) | Shape::Mesh { .. })
}

/// Opposite corners of a bounding box.
fn corners(shape: &Shape) -> [DVec3; 2] {
    let wide = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
    let points: Vec<DVec3> = match shape {
        Shape::Mesh { mesh, transform } => {
            mesh.positions.iter().map(|p| transform.transform_point3(wide(*p))).collect()
        }
        other => {
            let all = other.pieces().into_iter().map(|piece| piece.bounds());
            all.flat_map(|bounds| [wide(bounds.low), wide(bounds.high)]).collect()
        }
    };
    let fold = |f: fn(DVec3, DVec3) -> DVec3| points.iter().copied().reduce(f).expect("points");
    [fold(DVec3::min), fold(DVec3::max)]
}

/// A shape that is moved, turned, scaled evenly and perhaps mirrored, as shapes without a transform, and whether
/// `flip_normal` has to turn them around. It follows from the definitions of the shapes alone, so that tests can compare
/// the library's transforms with it.
pub(crate) fn placed(shape: &Shape, place: &DAffine3) -> (Vec<Shape>, bool) {
    let matrix = &place.matrix3;
    let scale = matrix.x_axis.length();
    let mirrors = matrix.determinant() < 0.0;
    let point = |p: DVec3| place.transform_point3(p);
    let turned = |d: DVec3| place.transform_vector3(d) / scale;
    let quad = |corner, u, v| -> Shape {
        let edge = |d: DVec3| place.transform_vector3(d);
        QuadParameters { corner: point(corner), u: edge(u), v: edge(v) }.into()
    };
    let one = match shape {
        Shape::Plane(PlaneParameters { normal, distance }) => {
            let normal = turned(*normal);
            let distance = distance * scale + normal.normalize().dot(place.translation);
            PlaneParameters { normal, distance }.into()
        }
        Shape::Sphere(SphereParameters { center, radius }) => {
            SphereParameters { center: point(*center), radius: radius * scale }.into()
        }
        Shape::Quad(QuadParameters { corner, u, v }) => return (vec![quad(*corner, *u, *v)], mirrors),
        Shape::Box(BoxParameters { min, max }) if *matrix == DMat3::from_diagonal(DVec3::splat(scale)) => {
            BoxParameters { min: point(*min), max: point(*max) }.into()
        }
        Shape::Box(BoxParameters { min: low, max: high }) => {
            let size = *high - *low;
            let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
            let sides = vec![
                quad(DVec3::new(low.x, high.y, low.z), -y, z),
                quad(DVec3::new(high.x, low.y, low.z), y, z),
                quad(*low, x, z),
                quad(DVec3::new(high.x, high.y, low.z), -x, z),
                quad(DVec3::new(high.x, low.y, low.z), -x, y),
                quad(DVec3::new(low.x, low.y, high.z), x, y),
            ];
            return (sides, mirrors);
        }
        Shape::Disk(DiskParameters { center, normal, radius }) => {
            DiskParameters { center: point(*center), normal: turned(*normal), radius: radius * scale }.into()
        }
        Shape::Cylinder(CylinderParameters { from, to, radius }) => {
            CylinderParameters { from: point(*from), to: point(*to), radius: radius * scale }.into()
        }
        Shape::Mesh { mesh, transform } => {
            Shape::Mesh { mesh: Arc::clone(mesh), transform: *place * *transform }
        }
        #[allow(unreachable_patterns, reason = "in the crate that declares them, all shapes are known")]
        other => panic!("the transform of {other:?} has to be written here"),
    };
    (vec![one], false)
}
