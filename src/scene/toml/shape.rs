//! The keys of shapes and meshes, and their conversion.

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use serde_json::Value as Json;

use super::common::POINT;
use super::declared::Values;
use super::form::{Value, ValueForm};
use super::one_of::{Members, OneOf, Variant};
use super::report::{Diagnostics, Placed, Read};
use super::table::{AnyKey, At, Block, Fields, Key, Named, Table, WordOrMap};
use super::value::{Rows, Triple, Vector, Word};
use crate::parameter::limits::COORDINATE;
use crate::parameter::{Declaration, Declared, Family, Number};
use crate::scene::description::{Mesh, PlaneParameters, Shape};
use crate::scene::mesh::{FileMaterial, MeshFile, Split};
use crate::scene::placement::{is_flat, misplaced};
use crate::scene::spelling::{instead, quote};

/// A shape with its transform, or the parts of a mesh, each of which becomes an entity.
pub(super) enum RawShape {
    One(Shape, Option<Placed<DAffine3>>),
    Parts(Vec<RawPart>),
}

/// A part of a mesh.
pub(super) struct RawPart {
    /// Its group or material in the file; empty for the rest.
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) material: RawMaterial,
}

/// The source of a part's material.
pub(super) enum RawMaterial {
    /// The material of its entity.
    Entity,
    /// The scene's material with this name.
    Named(Placed<String>),
    /// The material of the mesh file at this path, as written in the scene.
    OfFile(String, FileMaterial),
}

/// The scene's assignment of materials to a mesh's parts.
#[derive(Clone, Debug)]
enum PartMaterials {
    /// The file's own materials.
    OfFile,
    /// Materials by the names of groups and materials of the file.
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
    "A .ply, .obj, .glb or .gltf file, relative to this one. A file that several entities share is read once.",
);
static PART_MATERIALS: Key<WordOrMap<PartMaterials, At<Word>>> = Key::optional(
    "materials",
    WordOrMap { word: "file", means: PartMaterials::OfFile, value: At(Word), map: PartMaterials::Named },
    "The materials of parts of the mesh. \"file\" uses those of the file (colours in MTL, base materials in glTF, and their emission). A table assigns materials of the scene to groups or materials of the file by name. All other parts have the entity's material.",
);
static TRANSFORM: Key<Transform> = Key::default(
    "transform",
    Transform,
    "{}",
    "The transform from the file's space to the world: scale, then rotate, then translate; or a matrix.",
);
static PLACING: Key<Transform> = Key::optional(
    "transform",
    Transform,
    "The transform from the space of the parameters to the world: scale, then rotate, then translate; or a matrix. The shape becomes a group with one instance, and is sampled as a light like shapes in groups.",
);
static SCALE: Key<Triple> = Key::default(
    "scale",
    Triple(FACTOR),
    "1",
    "A scale factor, or one for each axis; negative factors mirror.",
);
static ROTATE: Key<Vector> = Key::default(
    "rotate",
    Vector(Number::between(-1e6, 1e6)),
    "[0, 0, 0]",
    "Degrees about the x axis, then about y, then about z.",
);
static TRANSLATE: Key<Vector> = Key::default("translate", POINT, "[0, 0, 0]", "The translation.");
static MATRIX: Key<Rows> = Key::optional(
    "matrix",
    Rows(COORDINATE),
    "Three rows of four numbers, which replace the other keys: the first three columns are the images of the x, y and z axes, the fourth is the translation.",
);

/// Bounded shapes may have a transform.
fn more(declaration: &Declaration) -> &'static [&'static dyn AnyKey] {
    if declaration.name == PlaneParameters::DECLARATION.name { &[] } else { &OF_BOUNDED }
}

static OF_BOUNDED: [&dyn AnyKey; 1] = [&PLACING];

fn one(values: Values, fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RawShape> {
    let shape = values.build_alone(diagnostics);
    let transform = fields.find(&PLACING, diagnostics)?;
    let at = fields.place_of(&PLACING);
    let shape = shape?;
    // A plane has no such key, which is reported.
    let transform = transform.filter(|_| !matches!(shape, Shape::Plane(_)));
    Ok(RawShape::One(shape, transform.map(|value| Placed { at, value })))
}

fn mesh(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RawShape> {
    let file = fields.get(&MESH_FILE, diagnostics);
    let transform = fields.get(&TRANSFORM, diagnostics);
    let materials = fields.find(&PART_MATERIALS, diagnostics);
    let (file, transform, materials) = (file?, transform?, materials?);
    let split = match &materials {
        None => Split::Whole,
        Some(PartMaterials::OfFile) => Split::Materials,
        Some(PartMaterials::Named(names)) => {
            // Sorted, as the order of keys has no meaning but that of entities has.
            let mut names: Vec<_> = names.iter().map(|name| name.name.clone()).collect();
            names.sort_unstable();
            Split::Named(names)
        }
    };
    let read = diagnostics.mesh(&file, split)?;
    if let Some(PartMaterials::Named(names)) = &materials {
        parts_are_there(names, &read, diagnostics)?;
    }
    if let Some(message) = misplaced(read.parts.iter().map(|(_, mesh)| &**mesh), &transform) {
        return Err(diagnostics.error(fields.place_of(&TRANSFORM), message));
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

/// Checks that all parts with an assigned material exist in the file.
fn parts_are_there(
    names: &[Named<Placed<String>>],
    read: &MeshFile,
    diagnostics: &mut Diagnostics<'_>,
) -> Read<()> {
    let mut outcome = Ok(());
    let missing = |name: &&Named<_>| !read.parts.iter().any(|(part, _)| *part == name.name);
    for name in names.iter().filter(missing) {
        let message = format!("the mesh has no group or material {}", quote(&name.name));
        outcome = Err(diagnostics
            .error_with(name.at, message, |_| instead(&name.name, read.names.iter().map(String::as_str))));
    }
    outcome
}

/// A transform, whose keys are often written beside it.
pub(super) struct Transform;

static TRANSFORM_BLOCK: Block<DAffine3> = Block { table: &TRANSFORM_TABLE, build: transform };

impl ValueForm for Transform {
    type Output = DAffine3;

    fn read(&self, key: &str, value: &Value<'_>, diagnostics: &mut Diagnostics<'_>) -> Read<DAffine3> {
        TRANSFORM_BLOCK.read(key, value, diagnostics)
    }

    fn owners(&self, key: &str) -> Vec<&'static str> {
        let is_key = TRANSFORM_TABLE.names().any(|name| name == key);
        if is_key { vec![TRANSFORM_TABLE.what] } else { Vec::new() }
    }

    fn schema(&self) -> Json {
        TRANSFORM_BLOCK.schema()
    }
}

fn transform(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<DAffine3> {
    let scale = fields.get(&SCALE, diagnostics);
    let rotate = fields.get(&ROTATE, diagnostics);
    let translate = fields.get(&TRANSLATE, diagnostics);
    let matrix = fields.find(&MATRIX, diagnostics);
    let (scale, rotate, translate, matrix) = (scale?, rotate?, translate?, matrix?);
    let transform = match matrix {
        Some(_) if [fields.has(&SCALE), fields.has(&ROTATE), fields.has(&TRANSLATE)].contains(&true) => {
            let at = fields.place_of(&MATRIX);
            let message = "the transform has both matrix and scale, rotate or translate";
            return Err(diagnostics.error_with(at, message, |_| Some("keep the matrix or the others".into())));
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
        return Err(diagnostics.error(at, "the transform is singular"));
    }
    Ok(transform)
}
