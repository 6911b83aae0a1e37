//! The tables of a scene file, and the scene that is made of them: what no single table can check.

use super::declared::Values;
use super::entity::{self, Linked, OfFiles, RawEntity, link_entities};
use super::environment::{self, Surroundings};
use super::groups::{self, RawGroup, RawInstance};
use super::materials;
use super::one_of::OneOf;
use super::report::{Read, Reported, Reports};
use super::table::{Block, Fields, Key, ListOf, MapOf, Table};
use super::textures::{self, TextureNames};
use super::{camera, film, light, render};
use crate::scene::check::SceneProblem;
use crate::scene::description::{CameraSettings, FilmSettings, Light, RenderSettings, Scene};
use crate::scene::open_glass::{Warning, open_glass};
use crate::scene::spelling::quote;

/// The whole file.
pub(super) static SCENE: Block<Scene> = Block { table: &SCENE_TABLE, build: scene };

static SCENE_TABLE: Table = Table::new(
    "a scene file",
    &[&FILM, &CAMERA, &RENDER, &TEXTURES, &MATERIALS, &ENTITIES, &GROUPS, &INSTANCES, &LIGHTS, &ENVIRONMENT],
);

static FILM: Key<Block<FilmSettings>> = Key::default(
    "film",
    Block { table: &film::FILM_TABLE, build: film::film },
    "{}",
    "The picture's shape and how samples become pixels.",
);
static CAMERA: Key<Block<CameraSettings>> = Key::default(
    "camera",
    Block { table: &camera::CAMERA_TABLE, build: camera::camera },
    "{}",
    "Where the picture is taken from.",
);
static RENDER: Key<Block<RenderSettings>> = Key::default(
    "render",
    Block { table: &render::RENDER_TABLE, build: render::render },
    "{}",
    "How light is followed.",
);
static TEXTURES: Key<MapOf<OneOf<Values>>> = Key::default(
    "textures",
    MapOf(textures::TEXTURE),
    "{}",
    "Numbers and colours that differ from point to point, each under its name. Numbers and colours of materials may be textures, but for those of a checkerboard of materials and the scales of maps. A colour takes its channels, a number its red one, each within the limits of the parameter.",
);
static MATERIALS: Key<MapOf<OneOf<Values>>> = Key::default(
    "materials",
    MapOf(materials::MATERIAL),
    "{}",
    "What surfaces do with light, each under its name.",
);
static ENTITIES: Key<ListOf<Block<RawEntity>>> = Key::default(
    "entities",
    ListOf(Block { table: &entity::ENTITY_TABLE, build: entity::entity }),
    "[]",
    "The surfaces of the scene.",
);
static GROUPS: Key<MapOf<Block<RawGroup>>> = Key::default(
    "groups",
    MapOf(Block { table: &groups::GROUP_TABLE, build: groups::group }),
    "{}",
    "Surfaces that are kept once and stand at many places, each group under its name: nothing of it is seen but by instances.",
);
static INSTANCES: Key<ListOf<Block<RawInstance>>> = Key::default(
    "instances",
    ListOf(Block { table: &groups::INSTANCE_TABLE, build: groups::instance }),
    "[]",
    "Where groups stand in the world.",
);
static LIGHTS: Key<ListOf<OneOf<Light>>> =
    Key::default("lights", ListOf(light::LIGHT), "[]", "The lights that are not surfaces.");
static ENVIRONMENT: Key<Block<Surroundings>> = Key::default(
    "environment",
    Block { table: &environment::ENVIRONMENT_TABLE, build: environment::environment },
    "{}",
    "What a ray that leaves the scene sees.",
);

/// Where a key that stands in the wrong place may belong.
static HEADERS: &[(&str, &Table)] = &[
    ("[film]", &film::FILM_TABLE),
    ("[camera]", &camera::CAMERA_TABLE),
    ("[render]", &render::RENDER_TABLE),
    ("[[entities]]", &entity::ENTITY_TABLE),
    ("[environment]", &environment::ENVIRONMENT_TABLE),
];

/// The header under which a key belongs that stands in the wrong place.
pub(super) fn header_of(key: &str) -> Option<&'static str> {
    let of_key = HEADERS.iter().find(|(_, table)| table.names().any(|name| name == key));
    of_key.map(|(header, _)| *header)
}

fn scene(fields: &Fields<'_, '_>, reports: &mut Reports<'_>) -> Read<Scene> {
    let film = fields.get(&FILM, reports);
    let camera = fields.get(&CAMERA, reports);
    let render = fields.get(&RENDER, reports);
    let raw_textures = fields.get(&TEXTURES, reports);
    let raw_materials = fields.get(&MATERIALS, reports);
    let raw_entities = fields.get(&ENTITIES, reports);
    let raw_groups = fields.get(&GROUPS, reports);
    let raw_instances = fields.get(&INSTANCES, reports);
    let lights = fields.get(&LIGHTS, reports);
    let environment = fields.get(&ENVIRONMENT, reports);

    let raw_materials = raw_materials?;
    let names = materials::names(&raw_materials);
    let mut of_files = OfFiles::after(raw_materials.len());
    let raw_textures = raw_textures.as_deref().map_err(|reported| *reported);
    let texture_names = TextureNames::new(raw_textures);
    let all = groups::split(raw_entities, raw_groups, raw_instances);
    let (entities, linked_groups) = match all {
        Ok((entities, groups)) => (
            link_entities(entities, &names, &texture_names, &mut of_files, reports),
            groups::link(groups, reports),
        ),
        Err(reported) => (Err(reported), Err(reported)),
    };
    let textures = raw_textures.and_then(|raw| textures::resolve(raw, &texture_names, reports));
    let mut resolved = materials::resolve(&raw_materials, &names, &texture_names, reports)?;
    let Linked { mut entities, places, mut used, placed } = entities?;
    let mut linked_groups = linked_groups?;

    for entity in &mut entities {
        entity.within = entity.within.map(|group| linked_groups.index_of[group]);
        // Those of mesh files come after the scene's own.
        entity.material = match resolved.index_of.get(entity.material) {
            Some(&index) => index,
            None => entity.material,
        };
    }
    groups::place_alone(&mut entities, placed, &mut linked_groups);
    let mut used_in_order = vec![false; raw_materials.len()];
    used.drain(..).for_each(|material| used_in_order[resolved.index_of[material]] = true);
    materials::warn_of_unused(&raw_materials, &resolved, used_in_order, reports);
    let (textures, raw_textures) = (textures?, raw_textures?);
    for textured in resolved.materials.iter_mut().flat_map(|material| &mut material.textures) {
        textured.texture = textures.index_of[textured.texture];
    }
    for entity in &mut entities {
        entity.emission_texture = entity.emission_texture.map(|texture| textures.index_of[texture]);
    }
    textures::warn_of_unused(raw_textures, &textures, &resolved.materials, &entities, reports);
    let images = reports.take_images();
    materials::warn_of_encoded(&raw_materials, &resolved, &textures.textures, &images, reports);
    resolved.materials.extend(of_files.materials);
    let Surroundings { radiance, picture } = environment?;

    let scene = Scene {
        film: film?,
        camera: camera?,
        render: render?,
        materials: resolved.materials,
        textures: textures.textures,
        images,
        entities,
        groups: linked_groups.groups,
        instances: linked_groups.instances,
        lights: lights?,
        environment: radiance,
        environment_picture: picture,
    };
    groups::check(&scene, &linked_groups.places, &places, reports)?;
    let scene = scene.checked().map_err(|problems| complain(&problems, reports))?;
    warn_of_darkness(&scene, reports);
    groups::warn_of_chance(&scene, &places, reports);
    for Warning { first, message, help } in open_glass(&scene, quote) {
        reports.warn(Some(places[first]), message, help);
    }
    Ok(scene)
}

/// Reports that this reader let something pass that it should have refused, with a place.
fn complain(problems: &[SceneProblem], reports: &mut Reports<'_>) -> Reported {
    let list: Vec<String> = problems.iter().map(SceneProblem::to_string).collect();
    let message = format!("stride read something else than it promises: {}", list.join("; "));
    reports.error_with(0, message, |_| Some("this is a defect of stride; please report it".into()))
}

/// Warns of a scene that can only be black.
fn warn_of_darkness(scene: &Scene, reports: &mut Reports<'_>) {
    if scene.entities.is_empty() {
        reports.warn(None, "there is nothing in this scene", "add [[entities]] with a shape and a material");
    }
    if !scene.has_light() {
        let help = "give an entity an emission, or add [[lights]] or an [environment]";
        reports.warn(None, "there is no light in this scene: the picture will be black", help);
    }
}
