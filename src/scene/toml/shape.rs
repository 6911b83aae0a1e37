//! Shapes: those that are declared, and the keys of meshes, and what is made of them.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::common::POINT;
use super::declared::Values;
use super::one_of::{Members, OneOf, Variant};
use super::report::{Placed, Read, Reports};
use super::table::{AnyKey, At, Block, Fields, Key, Named, Table, WordOrMap};
use super::value::{Rows, Triple, Vector, Word};
use crate::parameter::limits::COORDINATE;
use crate::parameter::{Declaration, Declared, Family, Number};
use crate::scene::description::{Mesh, PlaneParameters, Shape};
use crate::scene::mesh::{FileMaterial, MeshFile, Split};
use crate::scene::placement::{is_flat, misplaced};
use crate::scene::spelling::{instead, quote};

/// A shape and the transform that takes it to its place, or the parts of a mesh, each of which becomes an entity.
pub(super) enum RawShape {
    One(Shape, Option<Placed<DAffine3>>),
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

const FACTOR: Number = Number::between(-1e9, 1e9);
pub(super) const SHAPES: OneOf<RawShape> = OneOf {
    what: "shape",
    members: Some(Members {
        declarations: Shape::DECLARATIONS,
        textured: false,
        common: None,
        more,
        build: one,
    }),
    variants: &[Variant::new("mesh", &MESH_TABLE, mesh)],
};

static MESH_TABLE: Table = Table::new("a mesh", &[&MESH_FILE, &TRANSFORM, &PART_MATERIALS]);
pub(super) static TRANSFORM_TABLE: Table = Table {
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
static PLACING: Key<Block<DAffine3>> = Key::optional(
    "transform",
    Block { table: &TRANSFORM_TABLE, build: transform },
    "From the space of the parameters to the world, squeezed along the axes or not: scale, then rotate, then translate; or a matrix. The shape becomes a group of one, so that it emits as shapes in groups do.",
);
static SCALE: Key<Triple> =
    Key::default("scale", Triple(FACTOR), "1", "One number, or one for each axis; below zero it mirrors.");
static ROTATE: Key<Vector> = Key::default(
    "rotate",
    Vector(Number::between(-1e6, 1e6)),
    "[0, 0, 0]",
    "Degrees about the x axis, then about y, then about z.",
);
static TRANSLATE: Key<Vector> = Key::default("translate", POINT, "[0, 0, 0]", "Where the origin goes.");
static MATRIX: Key<Rows> = Key::optional(
    "matrix",
    Rows(COORDINATE),
    "Three rows of four numbers, instead: the first three columns are what x, y and z become, the fourth is the translation.",
);

/// What is bounded may be placed by a transform.
fn more(declaration: &Declaration) -> &'static [&'static dyn AnyKey] {
    if declaration.name == PlaneParameters::DECLARATION.name { &[] } else { &OF_BOUNDED }
}

static OF_BOUNDED: [&dyn AnyKey; 1] = [&PLACING];

fn one(values: Values, fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<RawShape> {
    let shape = values.build_alone(reports);
    let transform = fields.find(&PLACING, reports)?;
    let at = fields.place_of(&PLACING);
    let shape = shape?;
    // A plane has no such key, which is reported.
    let transform = transform.filter(|_| !matches!(shape, Shape::Plane(_)));
    Ok(RawShape::One(shape, transform.map(|value| Placed { at, value })))
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
    if let Some(message) = misplaced(read.parts.iter().map(|(_, mesh)| &**mesh), &transform) {
        return Err(reports.error(fields.place_of(&TRANSFORM), message));
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

pub(super) fn transform(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<DAffine3> {
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
