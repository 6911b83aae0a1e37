//! Warnings about glass that encloses no volume.
//!
//! Glass has an inside, on the side opposite to its normal. Light that enters an open surface is refracted on entry but
//! not on exit, which is legal but rarely intended.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use glam::DVec3;

use super::description::{
    CylinderParameters, DielectricParameters, DiskParameters, Entity, Material, MaterialKind, Mesh,
    QuadParameters, Scene, Shape,
};
use crate::math::narrow;

/// The tolerance between the direction of a disk's normal and a cylinder's axis, as one minus the cosine, for the disk
/// to close the cylinder.
const ALIGNED: f64 = 1e-6;

/// The maximum number of border edges that are compared with those of other entities, at 28 bytes each. Surfaces beyond
/// it count as open.
const MOST_EDGES: usize = 1 << 22;

/// The reason why a surface encloses no volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// A plane has a border at infinity.
    Plane,
    /// A quad without a shared edge.
    Quad,
    /// A disk at no end of a cylinder.
    Disk,
    /// A disk at the end of a cylinder that faces the cylinder's inside.
    InwardDisk,
    /// A cylinder without a disk at one of its ends.
    Cylinder,
    /// A mesh with an edge that belongs to one triangle only.
    Mesh,
}

/// A warning about glass that encloses no volume.
pub(super) struct Warning {
    /// The first entity concerned.
    pub(super) first: usize,
    pub(super) message: String,
    /// The remedy.
    pub(super) help: &'static str,
}

const BOUND: &str = "glass must enclose a volume: use a box, a sphere or a closed mesh";
const CLOSE: &str =
    "close both ends with disks of the same material, centre and radius that face away from the cylinder";
const TURN: &str = "turn its normal, or flip it where the cylinder is flipped";

impl Kind {
    /// The description of one entity and of several, and the remedy.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Kind::Plane => ("a plane of glass", "planes of glass", BOUND),
            Kind::Quad => ("a quad of glass", "quads of glass", BOUND),
            Kind::Disk => ("a disk of glass", "disks of glass", BOUND),
            Kind::InwardDisk => (
                "a disk of glass that faces the inside of its cylinder",
                "disks of glass that face the insides of their cylinders",
                TURN,
            ),
            Kind::Cylinder => {
                ("a cylinder of glass with an open end", "cylinders of glass with open ends", CLOSE)
            }
            Kind::Mesh => (
                "an open mesh of glass, with edges that belong to one triangle only",
                "open meshes of glass, with edges that belong to one triangle only",
                BOUND,
            ),
        }
    }

    /// The effect on the image.
    fn effect(self) -> &'static str {
        match self {
            Kind::InwardDisk => "inside and outside are swapped there",
            _ => "light is refracted on entry but not on exit",
        }
    }
}

/// Warnings about glass that encloses no volume, one for each kind, with names in quotes.
pub(super) fn open_glass(scene: &Scene, quote: impl Fn(&str) -> String) -> Vec<Warning> {
    let glass = glass(&scene.materials);
    // Entities in one space may close each other.
    let mut spaces: BTreeMap<Option<usize>, Vec<(usize, &Entity)>> = BTreeMap::new();
    for (index, entity) in scene.entities.iter().enumerate().filter(|(_, entity)| glass[entity.material]) {
        spaces.entry(entity.within).or_default().push((index, entity));
    }
    let mut open: Vec<(Kind, usize)> = Vec::new();
    for entities in spaces.into_values() {
        let planes = entities.iter().filter(|(_, entity)| matches!(entity.shape, Shape::Plane(_)));
        open.extend(planes.map(|&(index, _)| (Kind::Plane, index)));
        open.extend(open_cylinders_and_disks(&entities));
        open.extend(open_faces(&entities));
    }
    open.sort_unstable();
    let warning = |open: &[(Kind, usize)]| {
        let (kind, first) = open[0];
        let ((one, many, help), effect) = (kind.words(), kind.effect());
        let name = quote(&scene.entities[first].name);
        let message = match open.len() {
            1 => format!("{name} is {one}: {effect}"),
            count => format!("{count} entities, {name} the first, are {many}: {effect}"),
        };
        Warning { first, message, help }
    };
    open.chunk_by(|a, b| a.0 == b.0).map(warning).collect()
}

/// For each material whether it is or contains glass.
fn glass(materials: &[Material]) -> Vec<bool> {
    let mut glass = Vec::with_capacity(materials.len());
    for material in materials {
        // Materials follow those that they refer to.
        let is_glass = match material.kind {
            MaterialKind::Glass(_) => true,
            MaterialKind::Dielectric(DielectricParameters { thin_walled, .. }) => !thin_walled,
            _ => false,
        };
        glass.push(is_glass || material.named().any(|named| glass[named]));
    }
    glass
}

/// Coordinates as bits, for equality; −0 and 0 are the same.
fn bits(numbers: [f32; 3]) -> [u32; 3] {
    numbers.map(|x| (x + 0.0).to_bits())
}

/// Cylinders with an end that no disk of their material closes, and disks that close no cylinder.
fn open_cylinders_and_disks(entities: &[(usize, &Entity)]) -> Vec<(Kind, usize)> {
    // By centre, radius and material, which must match exactly.
    let key = |at: DVec3, radius: f64, material: usize| {
        (bits(narrow(at.to_array())), (radius as f32).to_bits(), material)
    };
    let mut disks: HashMap<_, Vec<(usize, DVec3, bool)>> = HashMap::new();
    for &(index, entity) in entities {
        if let Shape::Disk(DiskParameters { center, normal, radius }) = entity.shape {
            let disk = (index, normal, entity.flip_normal);
            disks.entry(key(center, radius, entity.material)).or_default().push(disk);
        }
    }
    let mut open: Vec<(Kind, usize)> = disks.values().flatten().map(|disk| (Kind::Disk, disk.0)).collect();
    let mut used: HashMap<usize, Kind> = HashMap::new();
    for &(index, entity) in entities {
        let Shape::Cylinder(CylinderParameters { from, to, radius }) = entity.shape else { continue };
        let axis = (to - from).normalize();
        let closed = [(from, -axis), (to, axis)].map(|(end, out)| {
            let at_end = disks.get(&key(end, radius, entity.material)).into_iter().flatten();
            let across = at_end.filter(|(_, normal, _)| normal.dot(out).abs() > 1.0 - ALIGNED);
            let mut closed = false;
            for &(disk, normal, flipped) in across {
                closed = true;
                let outward = (normal.dot(out) > 0.0) == (flipped == entity.flip_normal);
                // A disk between two cylinders faces into one of them, which is correct.
                let kind = if outward { Kind::Disk } else { Kind::InwardDisk };
                used.entry(disk).and_modify(|known| *known = (*known).min(kind)).or_insert(kind);
            }
            closed
        });
        if closed.contains(&false) {
            open.push((Kind::Cylinder, index));
        }
    }
    open.retain(|(kind, index)| *kind != Kind::Disk || !used.contains_key(index));
    open.extend(
        used.into_iter().filter(|(_, kind)| *kind == Kind::InwardDisk).map(|(index, kind)| (kind, index)),
    );
    open
}

/// An edge by its ends, the lesser first, for equality.
type Edge = [[u32; 3]; 2];

fn edge(ends: [[f32; 3]; 2]) -> Edge {
    let mut edge = ends.map(bits);
    edge.sort_unstable();
    edge
}

/// Quads and meshes with an edge that belongs to no other face, including those of other entities.
fn open_faces(entities: &[(usize, &Entity)]) -> Vec<(Kind, usize)> {
    let mut borders: HashMap<*const Mesh, Vec<[[f32; 3]; 2]>> = HashMap::new();
    // Edges of a single face within their entity, with the index of that entity.
    let mut edges: Vec<(Edge, usize)> = Vec::new();
    let mut open = vec![false; entities.len()];
    for (place, (_, entity)) in entities.iter().enumerate() {
        let mut add = |own: &mut dyn Iterator<Item = [[f32; 3]; 2]>, count: usize| {
            if edges.len() + count > MOST_EDGES {
                open[place] = true;
            } else {
                edges.extend(own.map(|ends| (edge(ends), place)));
            }
        };
        match &entity.shape {
            Shape::Quad(QuadParameters { corner, u, v }) => {
                let corners = [*corner, corner + u, corner + u + v, corner + v].map(|p| narrow(p.to_array()));
                add(&mut (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]), 4);
            }
            Shape::Mesh { mesh, transform } => {
                let border = borders.entry(Arc::as_ptr(mesh)).or_insert_with(|| border(mesh));
                let to_world = |p: [f32; 3]| {
                    narrow(transform.transform_point3(DVec3::from(p.map(f64::from))).to_array())
                };
                add(&mut border.iter().map(|ends| ends.map(to_world)), border.len());
            }
            _ => {}
        }
    }
    edges.sort_unstable();
    for same in edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1) {
        open[same[0].1] = true;
    }
    let kind = |entity: &Entity| if matches!(entity.shape, Shape::Quad(_)) { Kind::Quad } else { Kind::Mesh };
    let open = entities.iter().zip(open).filter(|(_, open)| *open);
    open.map(|(&(index, entity), _)| (kind(entity), index)).collect()
}

/// The edges of a mesh that belong to one triangle only. Coincident vertices are merged; degenerate triangles are then
/// ignored.
fn border(mesh: &Mesh) -> Vec<[[f32; 3]; 2]> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    let vertices: Vec<u32> = (0..)
        .zip(&mesh.positions)
        .map(|(vertex, &position)| *known.entry(bits(position)).or_insert(vertex))
        .collect();
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * mesh.triangles.len());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        if a != b && b != c && c != a {
            edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]));
        }
    }
    edges.sort_unstable();
    let single = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    single.map(|same| same[0].map(|vertex| mesh.positions[vertex as usize])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const MATERIALS: &str = r#"
        environment = { radiance = [1, 1, 1] }
        [materials]
        clear = { type = "glass", ior = 1.5 }
        dim = { type = "glass", ior = 1.3 }
        matte = { type = "matte", reflectance = [0.5, 0.5, 0.5] }
        board = { type = "checkerboard", even = "matte", odd = "clear" }
        boards = { type = "checkerboard", even = "board", odd = "matte" }
        unseen = { type = "checkerboard", even = "matte", odd = "matte" }
    "#;

    /// The warnings about entities (name, shape, other keys) of glass.
    fn warnings_in(folder: &Path, entities: &[(&str, &str, &str)]) -> Vec<String> {
        let entity = |(name, shape, rest): &(&str, &str, &str)| {
            format!("[[entities]]\nname = \"{name}\"\nshape = {{ {shape} }}\n{rest}\n")
        };
        let text = MATERIALS.to_owned() + &entities.iter().map(entity).collect::<String>();
        let loaded =
            crate::scene::parse(&text, &folder.join("a.toml")).unwrap_or_else(|error| panic!("{error}"));
        let said = loaded.warnings.iter().map(ToString::to_string);
        said.filter(|line| !line.contains("material \"")).collect()
    }

    fn warnings(entities: &[(&str, &str, &str)]) -> Vec<String> {
        warnings_in(Path::new(""), entities)
    }

    const CLEAR: &str = "material = \"clear\"";
    const MATTE: &str = "material = \"matte\"";
    const QUAD: &str = "type = \"quad\", corner = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0]";
    const PLANE: &str = "type = \"plane\", normal = [0, 0, 1], distance = 0";
    const DISK: &str = "type = \"disk\", center = [0, 0, 0], normal = [0, 0, 1], radius = 1";
    const TUBE: &str = "type = \"cylinder\", from = [0, 0, 0], to = [0, 0, 2], radius = 0.1";

    #[test]
    fn each_kind_of_open_shape_has_one_warning_with_a_count() {
        for (shape, reported) in [
            (QUAD, "\"pane\" is a quad of glass: light is refracted"),
            (PLANE, "\"pane\" is a plane of glass: light is refracted"),
            (DISK, "\"pane\" is a disk of glass: light is refracted"),
            (TUBE, "\"pane\" is a cylinder of glass with an open end: light is refracted"),
        ] {
            for material in ["clear", "dim", "board", "boards"] {
                let rest = format!("material = \"{material}\"");
                let said = warnings(&[("pane", shape, &rest)]);
                assert!(said.len() == 1 && said[0].contains(reported), "{said:?}");
                // The position is that of the material's name.
                assert!(said[0].starts_with("a.toml:13:12: "), "{said:?}");
            }
            // Negative controls: other materials, and checkerboards without glass.
            for material in ["matte", "unseen"] {
                let rest = format!("material = \"{material}\"");
                assert_eq!(warnings(&[("pane", shape, &rest)]), Vec::<String>::new());
            }
        }
        let moved = QUAD.replace("corner = [0, 0, 0]", "corner = [5, 0, 0]");
        let all = [("a", QUAD, MATTE), ("b", QUAD, CLEAR), ("c", TUBE, CLEAR), ("d", &moved, CLEAR)];
        let said = warnings(&all);
        assert_eq!(said.len(), 2, "{said:?}");
        assert!(said[0].contains("2 entities, \"b\" the first, are quads of glass: "), "{said:?}");
        assert!(said[1].contains("\"c\" is a cylinder"), "{said:?}");
    }

    #[test]
    fn closed_shapes_have_no_warning() {
        let sphere = "type = \"sphere\", center = [0, 0, 0], radius = 1";
        let cuboid = "type = \"box\", min = [0, 0, 0], max = [1, 1, 1]";
        assert_eq!(warnings(&[("a", sphere, CLEAR), ("b", cuboid, CLEAR)]), Vec::<String>::new());
        // Six quads that share their edges.
        let side =
            |corner: &str, u: &str, v: &str| format!("type = \"quad\", corner = {corner}, u = {u}, v = {v}");
        let sides = [
            side("[0, 0, 0]", "[0, 1.1, 0]", "[0.1, 0, 0]"),
            side("[0, 0, 0.3]", "[0.1, 0, 0]", "[0, 1.1, 0]"),
            side("[0, 0, 0]", "[0.1, 0, 0]", "[0, 0, 0.3]"),
            side("[0, 1.1, 0]", "[0, 0, 0.3]", "[0.1, 0, 0]"),
            side("[0, 0, 0]", "[0, 0, 0.3]", "[0, 1.1, 0]"),
            side("[0.1, 0, 0]", "[0, 1.1, 0]", "[0, 0, 0.3]"),
        ];
        let all: Vec<_> = sides.iter().map(|side| ("side", side.as_str(), CLEAR)).collect();
        let reported = |all: &[(&str, &str, &str)]| {
            let said = warnings(all);
            said.into_iter().filter(|line| line.contains("of glass")).collect::<Vec<_>>()
        };
        assert_eq!(reported(&all), Vec::<String>::new());
        // Negative control: without a lid, the four beside it are open, and the bottom is not.
        let said = reported(&all[1..]);
        assert!(said.len() == 1 && said[0].contains("4 entities, \"side\" the first, are quads"), "{said:?}");
    }

    #[test]
    fn disks_close_cylinders_of_their_material_exactly() {
        let tube = "type = \"cylinder\", from = [0.1, 0, 0], to = [0.1, 0, 2], radius = 0.5";
        let disk = |center: &str, normal: &str, radius: &str| {
            format!("type = \"disk\", center = {center}, normal = {normal}, radius = {radius}")
        };
        let top = disk("[0.1, 0, 2]", "[0, 0, 3]", "0.5");
        let bottom = disk("[0.1, 0, 0]", "[0, 0, -1]", "0.5");
        let flip = "material = \"clear\"\nflip_normal = true";
        let with = |bottom: &str, rest: &str| {
            warnings(&[("t", tube, CLEAR), ("top", &top, CLEAR), ("bottom", bottom, rest)])
        };
        assert_eq!(with(&bottom, CLEAR), Vec::<String>::new());
        assert_eq!(with(&disk("[0.1, 0, 0]", "[0, 0, 1]", "0.5"), flip), Vec::<String>::new());
        assert_eq!(
            warnings(&[("t", tube, flip), ("top", &top, flip), ("bottom", &bottom, flip)]),
            Vec::<String>::new()
        );
        // Negative controls: another position, radius, direction or material, and none.
        for (other, rest) in [
            (disk("[0.1, 0, 0.1]", "[0, 0, -1]", "0.5"), CLEAR),
            (disk("[0.1, 0, 0]", "[0, 0, -1]", "0.49"), CLEAR),
            (disk("[0.1, 0, 0]", "[0, 0.1, -1]", "0.5"), CLEAR),
            (bottom.clone(), "material = \"dim\""),
        ] {
            let said = with(&other, rest);
            assert!(
                said.len() == 2 && said.iter().any(|line| line.contains("\"t\" is a cylinder")),
                "{said:?}"
            );
            assert!(said.iter().any(|line| line.contains("\"bottom\" is a disk of glass: ")), "{said:?}");
        }
        let said = with(&bottom, MATTE);
        assert!(
            said.len() == 1 && said[0].contains("\"t\" is a cylinder of glass with an open end"),
            "{said:?}"
        );
        // A disk that faces the wrong way closes it, but swaps inside and outside.
        let said = with(&disk("[0.1, 0, 0]", "[0, 0, 1]", "0.5"), CLEAR);
        assert!(
            said.len() == 1 && said[0].contains("\"bottom\" is a disk of glass that faces the inside"),
            "{said:?}"
        );
    }

    /// A tetrahedron with separate vertices for each face.
    fn tetrahedron() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let [a, b, c, d] = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, -0.0, 0.1]];
        let faces = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        (faces.concat(), (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    fn mesh_of((positions, triangles): (Vec<[f32; 3]>, Vec<[u32; 3]>)) -> Mesh {
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn border_edges_have_one_triangle() {
        let (positions, mut triangles) = tetrahedron();
        assert_eq!(border(&mesh_of((positions.clone(), triangles.clone()))), Vec::<[[f32; 3]; 2]>::new());
        // A triangle without an area on one of the edges changes nothing.
        triangles.push([0, 1, 1]);
        assert_eq!(border(&mesh_of((positions.clone(), triangles.clone()))).len(), 0);
        triangles.remove(2);
        let open = border(&mesh_of((positions, triangles)));
        assert_eq!(open.len(), 3);
        assert!(open.as_flattened().iter().all(|p| p.iter().sum::<f32>() == 0.1), "{open:?}");
    }

    #[test]
    fn meshes_are_closed_by_themselves_or_by_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
        let write = |name: &str, faces: &str| {
            std::fs::write(folder.path().join(name), format!("{vertices}{faces}")).unwrap();
        };
        write("closed.obj", "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
        write("open.obj", "f 1 3 2\nf 1 2 4\nf 2 3 4\n");
        write("parts.obj", "g one\nf 1 3 2\nf 1 2 4\ng two\nf 2 3 4\nf 3 1 4\n");
        let mesh = |file: &str, more: &str| format!("type = \"mesh\", file = \"{file}\"{more}");
        let reported = |entities: &[(&str, &str, &str)]| warnings_in(folder.path(), entities);
        let turned = ", transform = { scale = [0.1, 7, 1e-3], rotate = [10, 20, 30], translate = [1, 2, 3] }";
        assert_eq!(reported(&[("m", &mesh("closed.obj", turned), CLEAR)]), Vec::<String>::new());
        let said = reported(&[
            ("m", &mesh("open.obj", turned), CLEAR),
            ("n", &mesh("open.obj", ""), "material = \"board\""),
        ]);
        assert!(
            said.len() == 1
                && said[0].contains(
                    "2 entities, \"m\" the first, are open meshes of glass, with edges that belong to one triangle"
                ),
            "{said:?}"
        );
        assert_eq!(reported(&[("m", &mesh("open.obj", ""), MATTE)]), Vec::<String>::new());
        // Parts that are separate entities, of two kinds of glass.
        let parts = |materials: &str| {
            mesh("parts.obj", &format!("{turned}, materials = {{ {materials} }}").replacen(", ,", ",", 1))
        };
        assert_eq!(reported(&[("m", &parts("one = \"dim\""), CLEAR)]), Vec::<String>::new());
        let said = reported(&[("m", &parts("one = \"matte\""), CLEAR)]);
        assert!(said.len() == 1 && said[0].contains("is an open mesh of glass, with edges"), "{said:?}");
    }
}
