//! The keys of shapes, and what is made of them.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::limits::{COORDINATE, DIRECTION, EDGE, LENGTH, LONGEST, PARALLEL, POINT, SHORTEST};
use super::report::{Placed, Read, Reports};
use super::table::{At, Block, Fields, Key, Named, OneOf, Table, Variant, WordOrMap};
use super::value::{Direction, NonZero, Number, Rows, Triple, Vector, Word, unit};
use crate::scene::check::is_flat;
use crate::scene::description::{Mesh, Shape};
use crate::scene::mesh::{FileMaterial, MeshFile, Split};
use crate::scene::spelling::{instead, quote};

/// A shape, or the parts of a mesh, each of which becomes an entity.
pub(super) enum RawShape {
    One(Shape),
    Parts(Vec<RawPart>),
}

/// A part of a mesh.
pub(super) struct RawPart {
    /// Its group or material in the file; empty for what no name is for.
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) material: RawMaterial,
}

/// Where a part has its material from.
pub(super) enum RawMaterial {
    /// Its entity.
    Entity,
    /// The scene's of this name.
    Named(Placed<String>),
    /// The mesh file at this path, as the scene names it.
    OfFile(String, FileMaterial),
}

/// What a scene says of the materials of a mesh's parts.
#[derive(Clone, Debug)]
enum PartMaterials {
    /// They are the file's.
    OfFile,
    /// Those of groups and materials of the file.
    Named(Vec<Named<Placed<String>>>),
}

/// A normal whose length is one but for this much is one whose components were rounded to three digits.
const UNIT_LENGTH: f64 = 1e-3;

// The smallest longest side of the box around a whole mesh. The areas of triangles a thousandth as long still fit.
const SMALLEST_MESH: f64 = 1e-15;
const FACTOR: Number = Number::between(-1e9, 1e9);
pub(super) const SHAPES: OneOf<RawShape> = OneOf {
    what: "shape",
    variants: &[
        Variant::new("plane", &PLANE_TABLE, plane),
        Variant::new("sphere", &SPHERE_TABLE, sphere),
        Variant::new("quad", &QUAD_TABLE, quad),
        Variant::new("disk", &DISK_TABLE, disk),
        Variant::new("cylinder", &CYLINDER_TABLE, cylinder),
        Variant::new("box", &CUBOID_TABLE, cuboid),
        Variant::new("mesh", &MESH_TABLE, mesh),
    ],
};

static PLANE_TABLE: Table = Table::new("a plane", &[&NORMAL, &PLANE_DISTANCE]);
static SPHERE_TABLE: Table = Table::new("a sphere", &[&CENTER, &RADIUS]);
static QUAD_TABLE: Table = Table::new("a quad", &[&CORNER, &U, &V]);
static DISK_TABLE: Table = Table::new("a disk", &[&DISK_CENTER, &DISK_NORMAL, &DISK_RADIUS]);
static CYLINDER_TABLE: Table = Table::new("a cylinder", &[&FROM, &TO, &CYLINDER_RADIUS]);
static CUBOID_TABLE: Table = Table::new("a box", &[&MIN, &MAX]);
static MESH_TABLE: Table = Table::new("a mesh", &[&MESH_FILE, &TRANSFORM, &PART_MATERIALS]);
static TRANSFORM_TABLE: Table = Table {
    what: "a transform",
    keys: &[&SCALE, &ROTATE, &TRANSLATE, &MATRIX],
    rules: r#"{
        "not": { "anyOf": [
            { "required": ["matrix", "scale"] },
            { "required": ["matrix", "rotate"] },
            { "required": ["matrix", "translate"] }
        ] }
    }"#,
};

static NORMAL: Key<NonZero> = Key::required(
    "normal",
    EDGE,
    "The direction the plane faces. Its length does not matter: it is made one.",
);
static PLANE_DISTANCE: Key<Number> = Key::required(
    "distance",
    COORDINATE,
    "Signed distance of the plane from the origin along its normal, a length whatever the normal's: X·n = distance, where n is the normal over its length.",
);
static CENTER: Key<Vector> = Key::required("center", POINT, "The centre of the sphere.");
static RADIUS: Key<Number> = Key::required("radius", LENGTH, "The radius of the sphere.");
static CORNER: Key<Vector> = Key::required("corner", POINT, "The corner of the quad where uv is (0, 0).");
static U: Key<NonZero> = Key::required("u", EDGE, "The first edge, from the corner.");
static V: Key<NonZero> = Key::required("v", EDGE, "The second edge, from the corner. The quad faces u × v.");
static DISK_CENTER: Key<Vector> = Key::required("center", POINT, "The centre of the disk.");
static DISK_NORMAL: Key<Direction> =
    Key::required("normal", DIRECTION, "The direction the disk faces, of any length.");
static DISK_RADIUS: Key<Number> = Key::required(
    "radius",
    LENGTH,
    "The radius of the disk. Its uv are the angle about the normal over 2π and the distance from the centre over the radius.",
);
static FROM: Key<Vector> =
    Key::required("from", POINT, "The end of the cylinder's axis where v is 0. Both ends are open.");
static TO: Key<Vector> = Key::required("to", POINT, "The end where v is 1.");
static CYLINDER_RADIUS: Key<Number> =
    Key::required("radius", LENGTH, "The radius of the cylinder. Its u is the angle about the axis over 2π.");
static MIN: Key<Vector> = Key::required("min", POINT, "The corner of the box with the least x, y and z.");
static MAX: Key<Vector> = Key::required(
    "max",
    POINT,
    "The corner of the box with the greatest x, y and z. On each side uv run from 0 to 1, v along z, or along y on top and bottom.",
);
static MESH_FILE: Key<At<Word>> = Key::required(
    "file",
    At(Word),
    "A .ply, .obj, .glb or .gltf file, relative to this one. Entities may share it: it is read once.",
);
static PART_MATERIALS: Key<WordOrMap<PartMaterials, At<Word>>> = Key::optional(
    "materials",
    WordOrMap { word: "file", means: PartMaterials::OfFile, value: At(Word), map: PartMaterials::Named },
    "Materials of parts of the mesh: \"file\" takes those of the file (colours of MTL, base materials of glTF, and \
     what they emit); a table gives one of the scene's to each group or material of the file that it names. What \
     is left has the entity's.",
);
static TRANSFORM: Key<Block<DAffine3>> = Key::default(
    "transform",
    Block { table: &TRANSFORM_TABLE, build: transform },
    "{}",
    "From the file's space to the world: scale, then rotate, then translate; or a matrix.",
);
static SCALE: Key<Triple> =
    Key::default("scale", Triple(FACTOR), "1", "One number, or one for each axis; below zero it mirrors.");
static ROTATE: Key<Vector> = Key::default(
    "rotate",
    Vector(Number::between(-1e6, 1e6)),
    "[0, 0, 0]",
    "Degrees about the x axis, then about y, then about z.",
);
static TRANSLATE: Key<Vector> =
    Key::default("translate", POINT, "[0, 0, 0]", "Where the file's origin goes.");
static MATRIX: Key<Rows> = Key::optional(
    "matrix",
    Rows(COORDINATE),
    "Three rows of four numbers, instead: the first three columns are what x, y and z become, the fourth is the translation.",
);

fn plane(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let normal = fields.get(&NORMAL, reports);
    let distance = fields.get(&PLANE_DISTANCE, reports);
    let (normal, distance) = (normal?, distance?);
    let length = normal.length();
    if distance != 0.0 && (length - 1.0).abs() > UNIT_LENGTH {
        let at = fields.place_of(&PLANE_DISTANCE);
        let length = shown(length);
        let message = format!("the normal's length is {length}, and distance is a length all the same");
        let help =
            format!("if X·normal = distance is meant with the normal as it is, divide both by {length}");
        reports.warn(Some(at), message, &help);
    }
    Ok(RawShape::One(Shape::Plane { normal: unit(normal), distance }))
}

/// A length in four digits or so, for messages.
fn shown(length: f64) -> String {
    match (1e-2..1e6).contains(&length) {
        true => format!("{length:.4}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => format!("{length:.3e}"),
    }
}

fn sphere(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let center = fields.get(&CENTER, reports);
    let radius = fields.get(&RADIUS, reports);
    Ok(RawShape::One(Shape::Sphere { center: center?, radius: radius? }))
}

fn quad(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let corner = fields.get(&CORNER, reports);
    let u = fields.get(&U, reports);
    let v = fields.get(&V, reports);
    let (u, v) = (u?, v?);
    if unit(u).cross(unit(v)).length() < PARALLEL {
        let at = fields.place_of(&V);
        return Err(reports.error(at, "v is parallel to u: the quad has no area"));
    }
    Ok(RawShape::One(Shape::Quad { corner: corner?, u, v }))
}

fn disk(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let center = fields.get(&DISK_CENTER, reports);
    let normal = fields.get(&DISK_NORMAL, reports);
    let radius = fields.get(&DISK_RADIUS, reports);
    Ok(RawShape::One(Shape::Disk { center: center?, normal: normal?, radius: radius? }))
}

fn cylinder(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let from = fields.get(&FROM, reports);
    let to = fields.get(&TO, reports);
    let radius = fields.get(&CYLINDER_RADIUS, reports);
    let (from, to) = (from?, to?);
    if from.distance(to) < SHORTEST {
        let at = fields.place_of(&TO);
        return Err(reports.error(at, "to is the same point as from: the cylinder has no length"));
    }
    Ok(RawShape::One(Shape::Cylinder { from, to, radius: radius? }))
}

fn cuboid(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let min = fields.get(&MIN, reports);
    let max = fields.get(&MAX, reports);
    let (min, max) = (min?, max?);
    // Shapes are kept in single precision, in which sides that are far out and close together are one.
    let single = |x: f64| f64::from(x as f32);
    let size = |axis: usize| single(max[axis]) - single(min[axis]);
    if let Some(axis) = (0..3).find(|&axis| size(axis) < SHORTEST) {
        let (at, name) = (fields.place_of(&MAX), ["x", "y", "z"][axis]);
        let swapped = size(axis) < 0.0;
        let why = if swapped { "there min is above it along" } else { "the box has no extent along" };
        let message = format!("max must be above min in each of x, y, z: {why} {name}");
        let remedy = if swapped { "swap the two" } else { "a quad is flat" };
        return Err(reports.error_with(at, message, |_| Some(remedy.into())));
    }
    Ok(RawShape::One(Shape::Box { min, max }))
}

fn mesh(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let file = fields.get(&MESH_FILE, reports);
    let transform = fields.get(&TRANSFORM, reports);
    let materials = fields.find(&PART_MATERIALS, reports);
    let (file, transform, materials) = (file?, transform?, materials?);
    let split = match &materials {
        None => Split::Whole,
        Some(PartMaterials::OfFile) => Split::Materials,
        Some(PartMaterials::Named(names)) => {
            // Sorted, for the order of keys says nothing, and that of entities does.
            let mut names: Vec<_> = names.iter().map(|name| name.name.clone()).collect();
            names.sort_unstable();
            Split::Named(names)
        }
    };
    let read = reports.mesh(&file, split)?;
    if let Some(PartMaterials::Named(names)) = &materials {
        parts_are_there(names, &read, reports)?;
    }
    // Coordinates as far out have squares that do not fit 32 bits.
    let fits = |p: &[f32; 3]| {
        let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
        p.abs().max_element() <= LONGEST
    };
    let is_near = |mesh: &Arc<Mesh>| mesh.positions.iter().all(fits);
    if !read.parts.iter().all(|(_, mesh)| is_near(mesh)) {
        let at = fields.place_of(&TRANSFORM);
        return Err(reports.error(at, "the transform takes some of the mesh farther than 1e18"));
    }
    let parts = read.parts.iter().map(|(_, mesh)| &**mesh);
    let [narrower, longest] = sizes_in_place(parts, &transform);
    if longest < SMALLEST_MESH || narrower == 0.0 {
        let at = fields.place_of(&TRANSFORM);
        let message = "the mesh is smaller than 1e-15 where it stands, or than what 32-bit numbers tell apart there: nothing of it would be seen; give the transform a larger scale, or move the mesh nearer to the origin";
        return Err(reports.error(at, message));
    }
    let part = |(name, mesh): &(String, Arc<Mesh>)| {
        let material = match &materials {
            Some(PartMaterials::OfFile) => {
                let own = read.materials.iter().find(|material| material.name == *name);
                own.map(|own| RawMaterial::OfFile(file.value.clone(), own.clone()))
            }
            Some(PartMaterials::Named(names)) => {
                let given = names.iter().find(|given| given.name == *name);
                given.map(|given| RawMaterial::Named(given.value.clone()))
            }
            None => None,
        };
        let shape = Shape::Mesh { mesh: Arc::clone(mesh), transform };
        RawPart { name: name.clone(), shape, material: material.unwrap_or(RawMaterial::Entity) }
    };
    Ok(RawShape::Parts(read.parts.iter().map(part).collect()))
}

/// The two longest sides of the box around meshes where a transform takes them, in 32-bit numbers, the longest last.
fn sizes_in_place<'a>(meshes: impl Iterator<Item = &'a Mesh>, transform: &DAffine3) -> [f64; 2] {
    let place = |p: &[f32; 3]| {
        let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
        DVec3::from(p.to_array().map(|x| f64::from(x as f32)))
    };
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let around = |(low, high): (DVec3, DVec3), p: DVec3| (low.min(p), high.max(p));
    let (low, high) = meshes.flat_map(|mesh| &mesh.positions).map(place).fold(empty, around);
    let mut sides = (high - low).to_array();
    sides.sort_by(f64::total_cmp);
    [sides[1], sides[2]]
}

/// That every part that is given a material is in the file.
fn parts_are_there(names: &[Named<Placed<String>>], read: &MeshFile, reports: &mut Reports<'_>) -> Read<()> {
    let mut outcome = Ok(());
    let missing = |name: &&Named<_>| !read.parts.iter().any(|(part, _)| *part == name.name);
    for name in names.iter().filter(missing) {
        let message = format!("nothing in the mesh is of the group or material {}", quote(&name.name));
        outcome = Err(reports
            .error_with(name.at, message, |_| instead(&name.name, read.names.iter().map(String::as_str))));
    }
    outcome
}

fn transform(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<DAffine3> {
    let scale = fields.get(&SCALE, reports);
    let rotate = fields.get(&ROTATE, reports);
    let translate = fields.get(&TRANSLATE, reports);
    let matrix = fields.find(&MATRIX, reports);
    let (scale, rotate, translate, matrix) = (scale?, rotate?, translate?, matrix?);
    let transform = match matrix {
        Some(_) if [fields.has(&SCALE), fields.has(&ROTATE), fields.has(&TRANSLATE)].contains(&true) => {
            let at = fields.place_of(&MATRIX);
            let message = "the transform has a matrix and scale, rotate or translate";
            return Err(reports.error_with(at, message, |_| Some("keep the matrix or the others".into())));
        }
        Some([x, y, z]) => {
            let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
        }
        None => {
            let [x, y, z] = rotate.to_array().map(f64::to_radians);
            let rotate = DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
            DAffine3 { matrix3: rotate * DMat3::from_diagonal(scale), translation: translate }
        }
    };
    if is_flat(&transform) {
        let at = match matrix {
            Some(_) => fields.place_of(&MATRIX),
            None => fields.place_of(&SCALE),
        };
        return Err(reports.error(at, "the transform makes everything flat"));
    }
    Ok(transform)
}
