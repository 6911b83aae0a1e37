//! The keys of entities, and their conversion: parts of meshes become separate entities.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use super::common::RADIANCE;
use super::materials::find;
use super::one_of::OneOf;
use super::report::{Diagnostics, Placed, Read};
use super::shape::{RawMaterial, RawPart, RawShape, SHAPES};
use super::table::{At, Fields, Key, Table};
use super::textures::TextureNames;
use super::value::{self, Flag, Word};
use super::varying::{ColourOr, ColourOrName};
use crate::parameter::limits::INTENSITY;
use crate::scene::description::{Colour, Entity, Material, Shape};
use crate::scene::groups::PLANE;
use crate::scene::mesh::FileMaterial;
use crate::scene::names::Names;
use crate::scene::spelling::quote;

/// An entity with the name of its material. Shape and material are read separately, so that an error in one does not
/// hide an error in the other.
pub(super) struct RawEntity {
    name: Read<Option<Placed<String>>>,
    shape: Read<RawShape>,
    /// The position of the shape.
    at_shape: usize,
    material: Read<Placed<String>>,
    emission: Read<Emission>,
    flip_normal: Read<bool>,
}

/// The emission of an entity.
enum Emission {
    Radiance(ColourOrName),
    /// Total power, in W.
    Power(Placed<Colour>),
}

pub(super) static ENTITY_TABLE: Table = Table {
    what: "an entity",
    keys: &[&NAME, &SHAPE, &ENTITY_MATERIAL, &EMISSION, &POWER, &FLIP_NORMAL],
    rules: r#"{ "not": { "required": ["emission", "power"] } }"#,
};

static NAME: Key<At<Word>> = Key::optional("name", At(Word), "The name of the entity in messages.");
static SHAPE: Key<OneOf<RawShape>> = Key::required("shape", SHAPES, "The shape of the entity.");
static ENTITY_MATERIAL: Key<At<Word>> = Key::required(
    "material",
    At(Word),
    "The name of the entity's material; for a mesh, the material of all parts that its materials do not list.",
);
static EMISSION: Key<ColourOr> = Key::default(
    "emission",
    ColourOr(RADIANCE),
    "[0, 0, 0]",
    "Radiance emitted on the outward side, in W/(m² sr): red, green, blue, or the name of a texture. It is sampled in proportion to the texture; triangles of a mesh are chosen by its mean over each, and sampled uniformly. Planes, and round shapes in instances that rotate or deform them, are found by chance. Emission ignores mipmaps.",
);
static POWER: Key<At<value::Colour>> = Key::optional(
    "power",
    At(value::Colour(INTENSITY)),
    "The total flux emitted on the outward side, in W: red, green, blue. It replaces emission.",
);
static FLIP_NORMAL: Key<Flag> = Key::default(
    "flip_normal",
    Flag,
    "false",
    "Swaps the outward side and the inward side. Each shape defines its outward side; for a mesh, it is the side from which a triangle's corners run counter-clockwise.",
);

pub(super) fn entity(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RawEntity> {
    Ok(RawEntity {
        name: fields.find(&NAME, diagnostics),
        shape: fields.get(&SHAPE, diagnostics),
        at_shape: fields.place_of(&SHAPE),
        material: fields.get(&ENTITY_MATERIAL, diagnostics),
        emission: emission(fields, diagnostics),
        flip_normal: fields.get(&FLIP_NORMAL, diagnostics),
    })
}

fn emission(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Emission> {
    let (radiance, power) = (fields.get(&EMISSION, diagnostics), fields.get_if_there(&POWER, diagnostics)?);
    match power {
        Some(power) if fields.has(&EMISSION) => {
            let message = "the entity has both emission and power";
            Err(diagnostics.error_with(power.at, message, |_| Some("keep one of them".into())))
        }
        Some(power) => Ok(Emission::Power(power)),
        None => radiance.map(Emission::Radiance),
    }
}

/// The area of a shape.
fn area(shape: &Shape) -> f64 {
    if let Shape::Mesh { mesh, transform } = shape {
        let corner = |index: u32| {
            let p = DVec3::from(mesh.positions[index as usize].map(f64::from));
            transform.transform_point3(p)
        };
        let of_triangle = |[a, b, c]: [u32; 3]| {
            let a = corner(a);
            (corner(b) - a).cross(corner(c) - a).length() / 2.0
        };
        return mesh.triangles.iter().map(|&triangle| of_triangle(triangle)).sum();
    }
    shape.pieces().iter().map(|piece| f64::from(piece.surface().area)).sum()
}

/// The radiance of a Lambertian emitter with a given power and area: Φ = π·A·L.
fn radiance(power: &Placed<Colour>, area: f64, diagnostics: &mut Diagnostics<'_>) -> Read<Colour> {
    if !(area > 0.0 && area.is_finite()) {
        let message = "power needs a bounded surface with an area";
        return Err(diagnostics.error_with(power.at, message, |_| Some("give emission instead".into())));
    }
    let radiance = power.value.map(|power| power / (area * PI));
    match radiance.iter().copied().find(|&channel| channel > RADIANCE.0.most) {
        Some(most) => {
            let message = format!("power gives a radiance of {most:.2e}, above {}", RADIANCE.0.most);
            Err(diagnostics.error(power.at, message))
        }
        None => Ok(radiance),
    }
}

/// Entities with the indices of their materials.
#[derive(Default)]
pub(super) struct Linked {
    pub(super) entities: Vec<Entity>,
    /// The positions of their materials' names.
    pub(super) places: Vec<usize>,
    /// The materials that are used.
    pub(super) used: Vec<usize>,
    /// The entities with a transform, each of which becomes a group.
    pub(super) placed: Vec<Placed<(usize, DAffine3)>>,
}

/// The materials of mesh files, numbered after the scene's own.
pub(super) struct OfFiles {
    first: usize,
    pub(super) materials: Vec<Material>,
    seen: HashMap<(String, String), usize>,
}

impl OfFiles {
    /// Empty, following a number of the scene's own materials.
    pub(super) fn after(first: usize) -> OfFiles {
        OfFiles { first, materials: Vec::new(), seen: HashMap::new() }
    }

    /// The index of a material of the file at a path.
    fn index(&mut self, path: String, material: FileMaterial) -> usize {
        let next = self.first + self.materials.len();
        let FileMaterial { name, kind, .. } = material;
        *self.seen.entry((path, name)).or_insert_with_key(|(path, name)| {
            let name = format!("{path}: {name}");
            self.materials.push(Material { name, kind, ..Material::default() });
            next
        })
    }
}

/// Resolves material names to indices in the order of the file. Parts of meshes become separate entities. Each comes
/// with the group that contains it.
pub(super) fn link_entities(
    raw: Vec<(Option<usize>, RawEntity)>,
    materials: &Names<'_>,
    textures: &TextureNames<'_>,
    of_files: &mut OfFiles,
    diagnostics: &mut Diagnostics<'_>,
) -> Read<Linked> {
    let mut seen = HashMap::new();
    let Linked { mut entities, mut places, mut used, mut placed } = Linked::default();
    let mut outcome = Ok(());
    for (i, (within, raw)) in raw.into_iter().enumerate() {
        let place = raw.material.as_ref().map_or(0, |name| name.at);
        let material = raw.material.and_then(|name| find(&name, materials, diagnostics));
        if let Ok(Some(name)) = &raw.name
            && let Some(first) = seen.insert(name.value.clone(), i + 1)
        {
            // Legal: only messages refer to entities by name.
            let message = format!("entity {} has the name of entity {first}, {}", i + 1, quote(&name.value));
            diagnostics.warn(Some(name.at), message, "messages cannot distinguish them");
        }
        let link = || {
            let (shape, material) = (raw.shape?, material?);
            let name = raw.name?.map_or_else(|| format!("entity {}", i + 1), |name| name.value);
            let (emission, flip_normal) = (raw.emission?, raw.flip_normal?);
            let (parts, transform) = match shape {
                RawShape::One(shape, transform) => {
                    let part = RawPart { name: String::new(), shape, material: RawMaterial::Entity };
                    (vec![part], transform)
                }
                RawShape::Parts(parts) => (parts, None),
            };
            if within.is_some() && parts.iter().any(|part| matches!(part.shape, Shape::Plane(_))) {
                let help = || "a quad is a part of a plane".to_owned();
                return Err(diagnostics.error_with(raw.at_shape, PLANE, |_| Some(help())));
            }
            let (emission, emission_texture) = match emission {
                Emission::Radiance(ColourOrName::Colour(radiance)) => (radiance, None),
                Emission::Radiance(ColourOrName::Name(name)) => {
                    let texture = textures.find(&name, diagnostics)?;
                    ([0.0; 3], Some(texture))
                }
                Emission::Power(power) if transform.is_some() => {
                    let message =
                        "power needs a shape without a transform, as a transform may change its area";
                    let help = "give emission instead".to_owned();
                    return Err(diagnostics.error_with(power.at, message, |_| Some(help)));
                }
                Emission::Power(power) if within.is_some() => {
                    let message = "power needs a surface outside of groups, which may have many instances";
                    let help = "give emission instead".to_owned();
                    return Err(diagnostics.error_with(power.at, message, |_| Some(help)));
                }
                Emission::Power(power) => {
                    let is_own = |part: &&RawPart| match &part.material {
                        RawMaterial::OfFile(_, material) => material.emission == [0.0; 3],
                        RawMaterial::Entity | RawMaterial::Named(_) => true,
                    };
                    let area = parts.iter().filter(is_own).map(|part| area(&part.shape)).sum();
                    (radiance(&power, area, diagnostics)?, None)
                }
            };
            used.push(material);
            placed
                .extend(transform.map(|Placed { at, value }| Placed { at, value: (entities.len(), value) }));
            let mut linked = Ok(());
            for part in parts {
                let mut emission_texture = emission_texture;
                let (material, emission) = match part.material {
                    RawMaterial::Entity => (material, emission),
                    RawMaterial::Named(name) => match find(&name, materials, diagnostics) {
                        Ok(material) => (material, emission),
                        Err(reported) => {
                            linked = Err(reported);
                            continue;
                        }
                    },
                    RawMaterial::OfFile(path, material) => {
                        let dark = material.emission == [0.0; 3];
                        if !dark {
                            emission_texture = None;
                        }
                        let emission = if dark { emission } else { material.emission };
                        (of_files.index(path, material), emission)
                    }
                };
                if material < of_files.first {
                    used.push(material);
                }
                let separator = if part.name.is_empty() { "" } else { ": " };
                let name = format!("{name}{separator}{}", part.name);
                entities.push(Entity {
                    name,
                    shape: part.shape,
                    material,
                    emission,
                    emission_texture,
                    flip_normal,
                    within,
                });
                places.push(place);
            }
            linked
        };
        if let Err(reported) = link() {
            outcome = Err(reported);
        }
    }
    outcome.map(|()| Linked { entities, places, used, placed })
}
