//! The tables of a scene file, the resulting scene, and checks across tables.

use super::declared::Values;
use super::entity::{self, Linked, OfFiles, RawEntity, link_entities};
use super::environment::{self, Surroundings};
use super::groups::{self, RawGroup, RawInstance};
use super::materials;
use super::one_of::OneOf;
use super::report::{Diagnostics, Placed, Read, Reported};
use super::table::{At, Block, Fields, Key, ListOf, MapOf, Table};
use super::textures::{self, TextureNames};
use super::{camera, film, light, render, shape};
use crate::scene::check::SceneProblem;
use crate::scene::dark_lights::{Dark, DarkLights, dark_lights};
use crate::scene::description::{CameraSettings, FilmSettings, Light, RenderSettings, Scene};
use crate::scene::mixed_media::mixed_media;
use crate::scene::open_glass::{Warning, open_glass};
use crate::scene::second_uv::{self, Lacking, lacking};
use crate::scene::spelling::quote;

/// The entire file.
pub(super) static SCENE: Block<Scene> = Block { table: &SCENE_TABLE, build: scene };

static SCENE_TABLE: Table = Table::new(
    "a scene file",
    &[&FILM, &CAMERA, &RENDER, &TEXTURES, &MATERIALS, &ENTITIES, &GROUPS, &INSTANCES, &LIGHTS, &ENVIRONMENT],
);

static FILM: Key<Block<FilmSettings>> = Key::default(
    "film",
    Block { table: &film::FILM_TABLE, build: film::film },
    "{}",
    "The size of the image and its reconstruction from samples.",
);
static CAMERA: Key<Block<CameraSettings>> = Key::default(
    "camera",
    Block { table: &camera::CAMERA_TABLE, build: camera::camera },
    "{}",
    "The camera.",
);
static RENDER: Key<Block<RenderSettings>> = Key::default(
    "render",
    Block { table: &render::RENDER_TABLE, build: render::render },
    "{}",
    "The render settings.",
);
static TEXTURES: Key<MapOf<OneOf<Values>>> = Key::default(
    "textures",
    MapOf(textures::TEXTURE),
    "{}",
    "Textures: numbers and colours that vary over a surface, each under its name. Parameters of materials may be textures, except those of a checkerboard and the scales of maps. A colour uses all channels of a texture, a number its red channel; values are clamped to the limits of the parameter.",
);
static MATERIALS: Key<MapOf<OneOf<Values>>> =
    Key::default("materials", MapOf(materials::MATERIAL), "{}", "The materials, each under its name.");
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
    "Groups of surfaces that are stored once, each under its name. A group is visible only through instances.",
);
static INSTANCES: Key<ListOf<Block<RawInstance>>> = Key::default(
    "instances",
    ListOf(Block { table: &groups::INSTANCE_TABLE, build: groups::instance }),
    "[]",
    "Instances of groups in the world.",
);
static LIGHTS: Key<ListOf<At<OneOf<Light>>>> =
    Key::default("lights", ListOf(At(light::LIGHT)), "[]", "The lights that are no surfaces.");
static ENVIRONMENT: Key<Block<Surroundings>> = Key::default(
    "environment",
    Block { table: &environment::ENVIRONMENT_TABLE, build: environment::environment },
    "{}",
    "The radiance of rays that leave the scene.",
);

/// The places for misplaced keys, the likeliest first.
static PLACES: &[(&str, &Table)] = &[
    ("in the transform of a shape or an instance", &shape::TRANSFORM_TABLE),
    ("under [film]", &film::FILM_TABLE),
    ("under [camera]", &camera::CAMERA_TABLE),
    ("under [render]", &render::RENDER_TABLE),
    ("under [[entities]]", &entity::ENTITY_TABLE),
    ("under [environment]", &environment::ENVIRONMENT_TABLE),
];

/// The places for a misplaced key of the item `what`.
pub(super) fn places_of(what: &str, key: &str) -> Vec<&'static str> {
    let tables = PLACES.iter().filter(|(_, table)| table.names().any(|name| name == key));
    let families = [
        ("under [materials.NAME]", materials::MATERIAL.is_home(what, key)),
        ("under [textures.NAME]", textures::TEXTURE.is_home(what, key)),
        ("under [[lights]]", light::LIGHT.is_home(what, key)),
    ];
    let families = families.into_iter().filter(|(_, is_home)| *is_home).map(|(place, _)| place);
    tables.map(|(place, _)| *place).chain(families).collect()
}

fn scene(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<Scene> {
    let film = fields.get(&FILM, diagnostics);
    let camera = fields.get(&CAMERA, diagnostics);
    let render = fields.get(&RENDER, diagnostics);
    let raw_textures = fields.get(&TEXTURES, diagnostics);
    let raw_materials = fields.get(&MATERIALS, diagnostics);
    let raw_entities = fields.get(&ENTITIES, diagnostics);
    let raw_groups = fields.get(&GROUPS, diagnostics);
    let raw_instances = fields.get(&INSTANCES, diagnostics);
    let lights = fields.get(&LIGHTS, diagnostics);
    let environment = fields.get(&ENVIRONMENT, diagnostics);

    let raw_materials = raw_materials?;
    let names = materials::names(&raw_materials);
    let mut of_files = OfFiles::after(raw_materials.len());
    let raw_textures = raw_textures.as_deref().map_err(|reported| *reported);
    let texture_names = TextureNames::new(raw_textures);
    let all = groups::split(raw_entities, raw_groups, raw_instances);
    let (entities, linked_groups) = match all {
        Ok((entities, groups)) => (
            link_entities(entities, &names, &texture_names, &mut of_files, diagnostics),
            groups::link(groups, diagnostics),
        ),
        Err(reported) => (Err(reported), Err(reported)),
    };
    let textures = raw_textures.and_then(|raw| textures::resolve(raw, &texture_names, diagnostics));
    let mut resolved = materials::resolve(&raw_materials, &names, &texture_names, diagnostics)?;
    let Linked { mut entities, places, mut used, placed } = entities?;
    let mut linked_groups = linked_groups?;

    for entity in &mut entities {
        entity.within = entity.within.map(|group| linked_groups.index_of[group]);
        // Materials of mesh files follow the scene's own.
        entity.material = match resolved.index_of.get(entity.material) {
            Some(&index) => index,
            None => entity.material,
        };
    }
    groups::place_alone(&mut entities, placed, &mut linked_groups);
    let mut used_in_order = vec![false; raw_materials.len()];
    used.drain(..).for_each(|material| used_in_order[resolved.index_of[material]] = true);
    materials::warn_of_unused(&raw_materials, &resolved, used_in_order, diagnostics);
    let (textures, raw_textures) = (textures?, raw_textures?);
    for textured in resolved.materials.iter_mut().flat_map(|material| &mut material.textures) {
        textured.texture = textures.index_of[textured.texture];
    }
    for entity in &mut entities {
        entity.emission_texture = entity.emission_texture.map(|texture| textures.index_of[texture]);
    }
    textures::warn_of_unused(raw_textures, &textures, &resolved.materials, &entities, diagnostics);
    let images = diagnostics.take_images();
    materials::warn_of_encoded(&raw_materials, &resolved, &textures.textures, &images, diagnostics);
    resolved.materials.extend(of_files.materials);
    let Surroundings { radiance, picture } = environment?;

    let (light_places, lights): (Vec<_>, Vec<_>) =
        lights?.into_iter().map(|Placed { at, value }| (at, value)).unzip();
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
        lights,
        environment: radiance,
        environment_picture: picture,
    };
    groups::check(&scene, &linked_groups.places, &places, diagnostics)?;
    check_second_uv(&scene, &places, diagnostics)?;
    let scene = scene.checked().map_err(|problems| complain(&problems, diagnostics))?;
    warn_of_darkness(&scene, diagnostics);
    groups::warn_of_chance(&scene, &places, diagnostics);
    let warnings = open_glass(&scene, quote).into_iter().chain(mixed_media(&scene, quote));
    for Warning { first, message, help } in warnings {
        diagnostics.warn(Some(places[first]), message, help);
    }
    for DarkLights { first, message, help } in dark_lights(&scene, quote, "flip_normal") {
        let place = match first {
            Dark::Entity(index) => places[index],
            Dark::Light(index) => light_places[index],
        };
        diagnostics.warn(Some(place), message, &help);
    }
    Ok(scene)
}

/// Reports entities that lack the second set of uv. `places` are their positions in the file.
fn check_second_uv(scene: &Scene, places: &[usize], diagnostics: &mut Diagnostics<'_>) -> Read<()> {
    let mut outcome = Ok(());
    for Lacking { first, message } in lacking(scene) {
        outcome = Err(diagnostics.error_with(places[first], message, |_| Some(second_uv::HELP.into())));
    }
    outcome
}

/// Reports, with a position, that this reader accepted an invalid scene.
fn complain(problems: &[SceneProblem], diagnostics: &mut Diagnostics<'_>) -> Reported {
    let list: Vec<String> = problems.iter().map(SceneProblem::to_string).collect();
    let message = format!("stride accepted an invalid scene: {}", list.join("; "));
    diagnostics.error_with(0, message, |_| Some("this is a bug in stride; please report it".into()))
}

/// Warns of a scene that can only be black.
fn warn_of_darkness(scene: &Scene, diagnostics: &mut Diagnostics<'_>) {
    if scene.entities.is_empty() {
        diagnostics.warn(
            None,
            "there is nothing in this scene",
            "add [[entities]] with a shape and a material",
        );
    }
    if !scene.has_light() {
        let help = "give an entity an emission, or add [[lights]] or an [environment]";
        diagnostics.warn(None, "there is no light in this scene: the picture will be black", help);
    }
}
